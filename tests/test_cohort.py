"""Cohorts: the mixed model against closed forms, norm bands that hold, tables that are refused."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

import armrs
from armrs import BadInput
from armrs.analysis import mixed_model
from armrs.cli import main
from armrs.io import files
from armrs.report import clinic_norms, clinic_sentences

SEED = 7101


def table(path: Path, rows: list[tuple[str, str, str, float]]) -> Path:
    lines = ["subject,group,date,quantity,value,unit", *(f"{s},{g},{d},stiffness,{v!r},N m/rad" for s, g, d, v in rows)]
    path.write_text("\n".join(lines) + "\n")
    return path


def population(draw: np.random.Generator, subjects: int, sessions: int, mean: float, group: str) -> list[tuple[str, str, str, float]]:
    own = mean + 0.3 * draw.standard_normal(subjects)
    return [
        (f"{group}{k}", group, f"2026-01-{i + 1:02}", float(own[k] + 0.1 * draw.standard_normal()))
        for k in range(subjects)
        for i in range(sessions)
    ]


def test_balanced_sessions_have_the_variances_of_their_mean_squares() -> None:
    """In balanced data restricted maximum likelihood is the analysis of variance (Searle, Casella, McCulloch 1992, section 4.7)."""
    draw = np.random.default_rng(SEED)
    values = (draw.standard_normal(12)[:, None] + 0.4 * draw.standard_normal((12, 3))).ravel()
    found = mixed_model.fit(values, np.ones((36, 1)), np.repeat(np.arange(12), 3).tolist())
    means = values.reshape(12, 3).mean(axis=1)
    within = np.sum((values.reshape(12, 3) - means[:, None]) ** 2) / 24
    between = 3.0 * means.var(ddof=1)
    assert found.within**2 == pytest.approx(within, rel=1e-5)
    assert found.between**2 == pytest.approx((between - within) / 3.0, rel=1e-4)
    assert found.covariance[0, 0] == pytest.approx(between / 36.0, rel=1e-4)


def test_norm_bands_hold_and_no_difference_is_called_one(tmp_path: Path) -> None:
    """Forty subjects with two sessions; their band holds 90 to 98 % of sessions of others, and equal groups differ in one of twenty."""
    draw = np.random.default_rng(SEED)
    held, called, ends = [], 0, []
    for number in range(60):
        rows = population(draw, 20, 2, 1.0, "a") + population(draw, 20, 2, 1.0, "b")
        found = armrs.cohort(table(tmp_path / f"{number}.csv", rows))
        band = next(q for q in found.quantities if q.group == "a")
        held += [band.norm[0] <= v <= band.norm[1] for *_, v in population(draw, 50, 1, 1.0, "a")]
        called += found.contrasts[0].p_value < 0.05
        true_low = 1.0 - 1.96 * np.hypot(0.3, 0.1)
        ends.append(band.norm_low_interval[0] <= true_low <= band.norm_low_interval[1])
    assert 0.93 <= np.mean(held) <= 0.97
    assert called <= 8  # of 60 at a level of 5 %: more has a probability of 0.4 %
    assert np.mean(ends) >= 0.85


def test_groups_and_sides_that_differ_are_told(tmp_path: Path) -> None:
    """Only patients have a side that differs: it widens neither the scatter of subjects nor the norm band of the others."""
    draw = np.random.default_rng(SEED)
    lines = ["subject,group,side,quantity,value"]
    for group, mean, right in (("control", 1.0, 0.0), ("patient", 1.6, 0.4)):
        for k in range(15):
            own = mean + 0.2 * draw.standard_normal()
            lines += [
                f"{group}{k},{group},{side},half width,{own + more + 0.05 * draw.standard_normal()}"
                for side, more in (("Links", 0.0), ("R", right))
            ]
    (tmp_path / "t.csv").write_text("\n".join(lines))
    found = armrs.cohort(tmp_path / "t.csv")
    differ = {(*c.between, c.within): c for c in found.contrasts}
    assert set(differ) == {("control", "patient", ""), ("left", "right", "control"), ("left", "right", "patient")}
    groups = differ["control", "patient", ""]
    assert groups.p_value < 1e-4 and groups.difference == pytest.approx(0.8, abs=0.2)
    # Within subjects the sides are told far better than their scatter between subjects would.
    sides = differ["left", "right", "patient"]
    assert sides.difference == pytest.approx(0.4, abs=0.04) and sides.std < 0.03 and sides.p_value < 1e-4
    assert differ["left", "right", "control"].p_value > 0.05
    bands = {(q.group, q.side): q for q in found.quantities}
    assert len(bands) == 4 and bands["control", "left"].within_std == pytest.approx(0.05, rel=0.3)
    assert len(found.values_of(bands["patient", "right"])) == 15
    said = clinic_sentences.verdict(found.to_dict() | {"verb": "cohort"})
    assert "higher in patient than in control and higher in right than in left (group patient)" in said


def test_differences_of_sides_within_subjects_have_the_p_value_of_a_paired_t_test(tmp_path: Path) -> None:
    from scipy.stats import ttest_rel

    draw = np.random.default_rng(SEED)
    left = draw.standard_normal(12)
    right = left + 0.1 + 0.3 * draw.standard_normal(12)
    rows = [f"s{k},{side},stiffness,{v}" for side, of in (("l", left), ("r", right)) for k, v in enumerate(of)]
    (tmp_path / "t.csv").write_text("\n".join(["subject,side,quantity,value", *rows]))
    (found,) = armrs.cohort(tmp_path / "t.csv").contrasts
    paired = ttest_rel(right, left)
    assert found.difference == pytest.approx(float(np.mean(right - left)))
    assert found.p_value == pytest.approx(float(paired.pvalue), rel=1e-3)


def test_groups_that_were_measured_on_different_sides_are_compared_with_a_warning(tmp_path: Path) -> None:
    rows = [f"{g}{k},{g},{side},stiffness,{1.0 + 0.1 * k + more}" for g, side, more in (("a", "l", 0.0), ("b", "r", 5.0)) for k in range(4)]
    (tmp_path / "t.csv").write_text("\n".join(["subject,group,side,quantity,value", *rows]))
    found = armrs.cohort(tmp_path / "t.csv")
    (contrast,) = found.contrasts
    assert contrast.between == ("a", "b") and contrast.difference == pytest.approx(5.0)
    (line,) = found.warnings
    assert line.endswith("a and b were measured on different sides: their difference may be one of sides")


def test_the_verb_and_its_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    draw = np.random.default_rng(SEED)
    source = table(tmp_path / "in.csv", population(draw, 40, 2, 1.0, "a"))
    assert main(["cohort", str(source), "-o", str(tmp_path / "out")]) == 0
    assert "40 subjects, 80 sessions, 1 quantity." in capsys.readouterr().out
    again = armrs.cohort(tmp_path / "out" / "cohort.csv")
    assert again.values == armrs.cohort(source).values
    assert "norm band" in (tmp_path / "out" / "report.html").read_text()


def test_a_folder_of_results_is_read_with_its_groups(slow_arm: Path, tmp_path: Path) -> None:
    first = tmp_path / "first.json"
    main(["passive", str(slow_arm), "--json", str(first)])
    result = json.loads(first.read_text())
    folder = tmp_path / "results"
    for k in range(6):
        named = result | {"data": result["data"] | {"name": f"subject {k} 2026-02-0{k + 1}", "subject": None}}
        files.write_json(folder / f"{k}" / "passive.json", named)
    (tmp_path / "groups.csv").write_text("subject,group\n" + "".join(f"subject {k},{'ab'[k % 2]}\n" for k in range(6)))
    found = armrs.cohort(folder, groups=tmp_path / "groups.csv")
    assert {q.group for q in found.quantities} == {"a", "b"} and found.to_dict()["subjects"] == 6
    (tmp_path / "empty").mkdir()
    with pytest.raises(BadInput, match="folder without results"):
        armrs.cohort(tmp_path / "empty")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("subject,value\na,1\n", "quantity"),
        ("subject,quantity,value\na,k,x\n", "row 2, value"),
        ("subject,quantity,value\na,k,1e308\nb,k,-1e308\nc,k,1\n", r"row 2, value: found '1e308', allowed a number below 1e\+100"),
        ("subject,quantity,value\n,k,1\n", "row 2, subject"),
        ("subject,quantity,value\n", "a value a row"),
        ("subject,quantity,value\na,k,\nb,k,NA\n", "value: found none, allowed a value a row"),
        ("subject,quantity,value,unit\na,k,1,N m\nb,k,1,kN m\n", "one unit a quantity"),
        ("subject,quantity,value\na,k,0,5\n", r"row 2: found 4 cells, allowed 3, as the first row \(a decimal comma\? Put semicolons"),
        ("subject;quantity;value\na;k;0,5\nb;k;0.75\n", "row 3, value: found '0.75', allowed a number .* with a decimal comma"),
        (
            "subject;quantity;value;side\na;k;1;Links\nb;k;1;paretisch\n",
            "row 3, side: found 'paretisch', allowed left l links li or right r rechts re in any case, or nothing",
        ),
    ],
)
def test_refused_tables(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "t.csv").write_text(text)
    with pytest.raises(BadInput, match=message):
        armrs.cohort(tmp_path / "t.csv")


def test_a_table_of_a_spreadsheet_is_read_as_one_in_english(tmp_path: Path) -> None:
    """Semicolons and decimal commas were refused, and `L`, `links` and `Left` were three sides, which nothing compared."""
    words = {"left": ("L", "links", "Left"), "right": ("R", "rechts", "Right")}
    rows = [(f"s{k}", side, 1.0 + 0.125 * k + more) for k in range(6) for side, more in (("left", 0.0), ("right", 0.5))]
    plain = ["subject,side,quantity,value", *(f"{who},{side},stiffness,{value}" for who, side, value in rows)]
    (tmp_path / "plain.csv").write_text("\n".join(plain))
    local = [f"{who};{words[side][k % 3]};stiffness;{value:.3f}".replace(".", ",") for k, (who, side, value) in enumerate(rows)]
    (tmp_path / "local.csv").write_bytes("\r\n".join(["Subject;Side;Quantity;Value;;", *local, ";;;;;"]).encode("utf-16"))
    one, two = armrs.cohort(tmp_path / "plain.csv"), armrs.cohort(tmp_path / "local.csv")
    assert one.values == two.values and [c.between for c in two.contrasts] == [("left", "right")]


def test_values_without_a_side_among_others_are_told(tmp_path: Path) -> None:
    rows = [f"s{k},{side},k,{k}" for k in range(4) for side in ("left", "right")]
    (tmp_path / "t.csv").write_text("\n".join(["subject,side,quantity,value", *rows, "s9,,k,1"]))
    (line,) = armrs.cohort(tmp_path / "t.csv").warnings
    assert line == "k: 1 of 9 values state no side: sides are not compared"


def test_norm_bands_become_usual_ranges(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Norm bands could not be used on the page for a clinician but by copying them."""
    draw = np.random.default_rng(SEED)
    lines = ["subject,group,side,quantity,unit,value"]
    for group, mean in (("healthy", 1.0), ("after stroke", 2.0)):
        for k in range(8):
            for side in ("left", "right"):
                for what, unit in (
                    ("elastic stiffness of joint 2", "N m/rad"),
                    ("passive half_width in slow of joint 1", "N m"),
                    ("grip", "N"),
                ):
                    lines.append(f"{group}{k},{group},{side},{what},{unit},{mean + 0.1 * draw.standard_normal()}")
    (tmp_path / "t.csv").write_text("\n".join(lines))
    assert main(["cohort", str(tmp_path / "t.csv"), "-o", str(tmp_path / "out")]) == 0
    said = capsys.readouterr().out
    assert f"Next: armrs report RESULT.json --summary --norms {tmp_path / 'out' / 'norms-healthy.toml'} -o clinic" in said
    found = {norm: norm for norm in clinic_norms.load_norms(tmp_path / "out" / "norms-healthy.toml")}
    assert {(n.kind, n.name, n.joint, n.movement, n.side) for n in found} == {
        (kind, name, joint, movement, side)
        for kind, name, joint, movement in (("elastic", "stiffness", 2, None), ("passive", "half_width", 1, "slow"))
        for side in ("left", "right")
    }
    band = next(q for q in armrs.cohort(tmp_path / "t.csv").quantities if (q.name[:7], q.group, q.side) == ("elastic", "healthy", "left"))
    assert (band.norm, "armrs cohort t: 8 subjects of group healthy, 8 sessions") in {((n.low, n.high), n.source) for n in found}
    assert (tmp_path / "out" / "norms-after-stroke.toml").is_file()
    left = {"data": {"side": "left"}}
    assert set(clinic_norms.usual_of(list(found), left)) == {("elastic", "stiffness", 2)}
    assert set(clinic_norms.usual_of(list(found), left, "slow")) == {("elastic", "stiffness", 2), ("passive", "half_width", 1)}
    assert not clinic_norms.usual_of(list(found), {"data": {"side": None}}, "slow")


def test_rows_without_a_value_are_left_out_and_told(tmp_path: Path) -> None:
    """One empty cell refused the whole table."""
    rows = [f"s{k};stiffness;{value}" for k, value in enumerate(("0,5", "", "0,75", "NA", "0,625"))]
    (tmp_path / "t.csv").write_text("\n".join(["subject;quantity;value", *rows]))
    found = armrs.cohort(tmp_path / "t.csv")
    assert [v.value for v in found.values] == [0.5, 0.75, 0.625]
    assert found.warnings == (f"{tmp_path / 't.csv'}: row 3 and 1 more: no value: left out",)


def test_sessions_without_dates_are_counted(tmp_path: Path) -> None:
    """The sentence said 4 sessions, and the source of the norms 8."""
    rows = [f"s{k},{what},{0.1 * k + n}" for k in range(4) for n in range(2) for what in ("a", "b")]
    (tmp_path / "t.csv").write_text("\n".join(["subject,quantity,value", *rows]))
    found = armrs.cohort(tmp_path / "t.csv")
    assert found.to_dict()["sessions"] == 8 == found.quantities[0].sessions


def test_single_sessions_say_nothing_about_the_scatter_within_subjects(tmp_path: Path) -> None:
    """It was stated as 0."""
    draw = np.random.default_rng(SEED)
    (single,) = armrs.cohort(table(tmp_path / "1.csv", population(draw, 8, 1, 1.0, "a"))).quantities
    assert single.within_std is None
    shown = clinic_sentences.quantities({"quantities": [dataclasses.asdict(single)]}).rows[0][4]
    assert str(shown).endswith(", –")
    (paired,) = armrs.cohort(table(tmp_path / "2.csv", population(draw, 8, 2, 1.0, "a"))).quantities
    assert paired.within_std == pytest.approx(0.1, rel=0.6)


def test_norms_in_another_unit_are_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """They were missing without a word, also in `Nm/rad`."""
    for unit, status in (("Nm/rad", 0), ("N·m/rad", 0), ("Nm/deg", 1)):
        rows = [f"s{k},elastic stiffness of joint 2,{unit},{1.0 + 0.1 * k}" for k in range(5)]
        (tmp_path / "t.csv").write_text("\n".join(["subject,quantity,unit,value", *rows]), encoding="utf-8")
        out = tmp_path / unit.replace("/", "_")
        assert main(["cohort", str(tmp_path / "t.csv"), "-o", str(out)]) == status
        assert (out / "norms.toml").exists() == (status == 0)
        said = "elastic stiffness of joint 2: found Nm/deg, allowed N m/rad: no norms for armrs report"
        assert (said in capsys.readouterr().err) == (status == 1)


def test_copies_and_two_analyses_of_one_recording_are_one_session(tmp_path: Path) -> None:
    """`gap` beside `identify` counted as a second session, and so did a copy of a file."""
    for k in range(4):
        entry = {"kind": "elastic", "name": "stiffness", "joint": 2, "value": 1.0 + 0.1 * k, "std": 0.05, "unit": "N m/rad"}
        data = {"name": f"s{k} 2026-03-0{k + 1}", "subject": f"s{k}"}
        fitted = {"verb": "identify", "data": data, "parameters": [entry | {"decided_by": "data"}]}
        effect = {"kind": "elastic", "joint": 2, "decided": True, "parameters": {"stiffness": entry | {"value": 3.0}}}
        files.write_json(tmp_path / f"{k}" / "identified.json", fitted)
        files.write_json(tmp_path / f"{k}" / "copy.json", fitted)
        files.write_json(tmp_path / f"{k}" / "gap.json", {"verb": "gap", "data": data, "effects": [effect]})
    found = armrs.cohort(tmp_path)
    assert sorted(v.value for v in found.values) == pytest.approx([1.0, 1.1, 1.2, 1.3])
    assert found.warnings == (f"{tmp_path}: 8 values that another result of the same session states: left out",)


def test_a_row_of_nobody_in_the_groups_is_told(slow_arm: Path, tmp_path: Path) -> None:
    main(["passive", str(slow_arm), "--json", str(tmp_path / "results" / "r.json")])
    (tmp_path / "groups.csv").write_text("subject;group;side\nslow arm;a;links\nslow am;b;\n")
    found = armrs.cohort(tmp_path / "results", groups=tmp_path / "groups.csv")
    assert {v.side for v in found.values} == {"left"}
    assert found.warnings[0].endswith("row 3, subject: found 'slow am', allowed slow arm: it is in no result")
    (tmp_path / "results" / "r.json").write_text('{"verb": "passive", "data": {"name": "x"}}')
    with pytest.raises(BadInput, match="content: found not what a result holds"):
        armrs.cohort(tmp_path / "results")
