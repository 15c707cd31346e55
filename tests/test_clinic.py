"""The page for a clinician: units of the bedside, what was not measured says so, norms and trends beside the values."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path
from typing import Any

import pytest

from armrs import BadInput, cli
from armrs.report import clinic_lines, clinic_next, clinic_norms, clinic_page, clinic_trends, session_changes
from armrs.report.sentences import verdict

NORMS = """\
[[norm]]
kind = "elastic"
name = "stiffness"
joint = 1
low = 0.5
high = 1.4
source = "a table"
"""


def estimate(kind: str, name: str, joint: int, value: float, half: float, decided_by: str = "data") -> dict[str, Any]:
    interval = [max(value - half, 0.0) if name != "rest" else value - half, value + half]
    return {"kind": kind, "name": name, "joint": joint, "value": value, "interval": interval, "decided_by": decided_by, "unit": "SI"}


def result(**changes: Any) -> dict[str, Any]:
    """Return an identification as its JSON has it."""
    change = {"kind": "elastic", "name": "stiffness", "joint": 1, "unit": "N m/rad", "dates": ["2026-01-02", "2026-02-02"]}
    change |= {"values": [0.9, 1.8], "stds": [0.1, 0.1], "changed": True}
    change["before"] = {"date": "2026-01-02", "value": 0.9, "std": 0.14, "p_value": 1e-9, "clear": True}
    return {
        "verb": "identify",
        "data": {
            "name": "S1", "joints": ["shoulder", "elbow"], "configurations": ["slow"], "range_deg": [[-60.0, -10.0], [50.0, 95.0]],
            "fit": {"trials": 4, "duration_s": 90.0}, "test": {"trials": 1, "duration_s": 30.0},
        },
        "parameters": [
            estimate("elastic", "stiffness", 1, 1.8, 0.18),
            estimate("elastic", "rest", 1, -1.0, 0.1),
            estimate("coulomb", "torque", 1, 0.0, 0.03, "bound"),
            estimate("viscous", "viscosity", 2, 0.1, 0.05, "prior"),
        ],
        "history": [change],
        "warnings": [],
        "made_by": {"armrs": "0"},
    } | changes  # fmt: skip


@pytest.fixture
def norms(tmp_path: Path) -> tuple[clinic_norms.Norm, ...]:
    (tmp_path / "norms.toml").write_text(NORMS, encoding="utf-8")
    return clinic_norms.load_norms(tmp_path / "norms.toml")


def test_values_are_in_the_units_of_the_bedside(norms: tuple[clinic_norms.Norm, ...]) -> None:
    stiffness, rest, friction, speed = clinic_lines.lines_of(result(), norms)
    assert stiffness.value == pytest.approx(1.8 * math.radians(10.0))
    assert rest.value == pytest.approx(math.degrees(-1.0))
    assert clinic_lines.words_of(stiffness) == [
        "shoulder", "Stiffness [N m per 10°]", "0.314", "0.283 to 0.346", "0.087 to 0.244, above it", "higher by 0.157 ± 0.048 (+100 %)",
    ]  # fmt: skip
    assert clinic_lines.words_of(friction)[2:4] == ["none seen", "at most 0.030"]
    assert speed.value is None and clinic_lines.words_of(speed)[2:4] == ["not measured", ""]


def test_angles_are_counted_as_in_the_laboratory(norms: tuple[clinic_norms.Norm, ...]) -> None:
    """A laboratory with the arm hanging at zero and clockwise positive read our horizontal zero."""
    as_there = {"signs": [-1, 1], "zero_deg": [-90.0, 0.0], "words": "as in the laboratory: hanging"}
    found = result(data=result()["data"] | {"angles": as_there})
    _, rest, *_ = clinic_lines.lines_of(found, norms)
    assert rest.value == pytest.approx(-(math.degrees(-1.0) + 90.0))
    assert rest.interval == pytest.approx((-(math.degrees(-0.9) + 90.0), -(math.degrees(-1.1) + 90.0)))
    said = clinic_page.measured([found])
    assert "shoulder from −80° to −30°" in said[1] and said[2] == "Angles: as in the laboratory: hanging."
    assert "from the horizontal" in clinic_page.measured([result()])[2]


def test_what_is_followed_is_drawn_as_the_table_counts_it() -> None:
    """Before, the figure had `elastic 1 stiffness` in N m/rad below a table of stiffness in N m per 10°."""
    as_there = {"signs": [-1, 1], "zero_deg": [-90.0, 0.0], "words": "as in the laboratory: hanging"}
    stiffness = result()["history"][0]
    rest = stiffness | {"name": "rest", "values": [-1.0, -0.9], "stds": [0.1, 0.2]}
    other = stiffness | {"kind": "segment", "name": "m1*l1"}
    one, two = clinic_trends.followed([result(data=result()["data"] | {"angles": as_there}, history=[stiffness, rest, other])])
    assert (one["name"], one["joint"], one["unit"]) == ("shoulder: stiffness", None, "N m per 10°")
    assert one["values"] == pytest.approx([0.9 * math.radians(10.0), 1.8 * math.radians(10.0)])
    assert two["name"] == "shoulder: resting angle"
    assert two["values"] == pytest.approx([-(math.degrees(angle) + 90.0) for angle in (-1.0, -0.9)])
    assert two["stds"] == pytest.approx([math.degrees(0.1), math.degrees(0.2)])


def test_two_analyses_of_one_quantity_are_one_line(tmp_path: Path) -> None:
    """Identify and gap of one session had a line each for the stiffness of the shoulder."""
    parameters = {"stiffness": {"value": 2.5, "interval": [2.4, 2.6]}, "rest": {"value": -1.0, "interval": [-1.1, -0.9]}}
    gap = result(verb="gap", verdict="explained", effects=[{"kind": "elastic", "joint": 1, "parameters": parameters}], history=[])
    for name, data in (("a", result()), ("b", gap)):
        (tmp_path / f"{name}.json").write_text(json.dumps(data), encoding="utf-8")
    text = clinic_page.write_summary([tmp_path / "a.json", tmp_path / "b.json"], tmp_path / "s.html").read_text(encoding="utf-8")
    assert text.count("Stiffness [N m per 10°]") == 1 and ">0.314<" in text
    assert (
        "The table has the values of armrs identify. The page of gap fits only the laws that the recordings require, together with all "
        "other effects found, and states shoulder, stiffness 0.436 (0.419 to 0.454)."
    ) in text
    assert "shoulder: stiffness differs between the analyses by more than the uncertainty of both." in text
    assert "resting angle differs" not in text


def test_what_changed_is_said_first_with_how_sure_it_is(norms: tuple[clinic_norms.Norm, ...], tmp_path: Path) -> None:
    """What changed, by how much, whether that is sure and what next are what a therapist asks: it comes before the table."""
    change = result()["history"][0]
    same = change | {"name": "torque", "kind": "coulomb", "before": {**change["before"], "value": 0.01, "std": 0.02, "clear": False}}
    lines = clinic_lines.lines_of(result(history=[change, same]), norms)
    assert session_changes.change_lines(lines) == [
        "shoulder: stiffness is higher by 0.157 ± 0.048 N m per 10° (+100 %).",
        session_changes.SURE["change"],
        "No clear change: shoulder (friction).",
        session_changes.EITHER_WAY,
    ]
    assert clinic_lines.words_of(lines[2])[5] == "no clear change: +0.010 ± 0.039"
    assert session_changes.change_lines(clinic_lines.lines_of(result(history=[]))) == []
    (tmp_path / "a.json").write_text(json.dumps(result(history=[change, same])), encoding="utf-8")
    page = clinic_page.write_summary([tmp_path / "a.json"], tmp_path / "s.html").read_text(encoding="utf-8")
    heads = [page.index(head) for head in ("What changed since", "What next", "What was found", "Over the sessions")]
    assert heads == sorted(heads)


def compared(value: float, std: float, *, clear: bool, date: str = "2026-01-02") -> dict[str, Any]:
    return {"date": date, "value": value, "std": std, "p_value": 0.01 if clear else 0.5, "clear": clear}


def kept(side: str = "left", **sessions: dict[str, Any]) -> dict[str, Any]:
    """A result that a history keeps, with what its stiffness is compared with."""
    course = result()["history"][0] | {
        "dates": ["2026-01-02", "2026-02-02", "2026-03-02"],
        "values": [0.9, 1.2, 1.8],
        "stds": [0.1, 0.1, 0.1],
    }
    session = {"subject": "S1", "side": side, "date": "2026-03-02", "later": ["2026-04-02"]}
    return result(history=[course | sessions], session=session, data=result()["data"] | {"side": side})


def test_a_page_names_the_sessions_that_it_compares(tmp_path: Path) -> None:
    """The page of a session that was added later stated the change of another session."""
    sessions = {
        "before": compared(0.6, 0.14, clear=True, date="2026-02-02"),
        "first": compared(0.9, 0.14, clear=True),
        "other_arm": compared(-0.2, 0.14, clear=False, date="2026-02-28"),
    }
    (tmp_path / "a.json").write_text(json.dumps(kept(**sessions)), encoding="utf-8")
    page = clinic_page.write_summary([tmp_path / "a.json"], tmp_path / "s.html").read_text(encoding="utf-8")
    for words in (
        "Arm measurement: S1, left arm, 2026-03-02",
        "This session of the left arm is compared with the session before it (2026-02-02), the first one (2026-01-02) and the right arm "
        "(2026-02-28). Later sessions (2026-04-02) are not compared.",
        "<h2>What changed since 2026-02-02</h2>",
        "shoulder: stiffness is higher by 0.105 ± 0.048 N m per 10° (+50 %).",
        "<h2>Since the first session, 2026-01-02</h2>",
        "shoulder: stiffness is higher by 0.157 ± 0.048 N m per 10° (+100 %).",
        "<h2>Compared with the right arm on 2026-02-28</h2>",
        "No clear difference: shoulder (stiffness).",
    ):
        assert words in page
    other = kept(side="right", **sessions)
    (tmp_path / "b.json").write_text(json.dumps(other), encoding="utf-8")
    with pytest.raises(BadInput, match="side: found 'right', allowed that of the others, 'left': one page is of one session"):
        clinic_page.write_summary([tmp_path / "a.json", tmp_path / "b.json"], tmp_path / "s.html")


def test_a_clear_difference_between_arms_is_said_with_its_certainty_and_what_next() -> None:
    """A page that compares arms alone stated neither: with a clear difference it had no `What next` at all."""
    found = kept(before=None, other_arm=compared(0.6, 0.14, clear=True, date="2026-02-28"))
    lines = clinic_lines.lines_of(found)
    ((_, said),) = clinic_page.answers([found], lines)
    assert said[1] == "How sure: if the arms did not differ, each analysis would still report a difference in 1 of 50 sessions."
    assert clinic_next.next_steps([found], lines) == [
        "Repeat the session within days before acting on a difference between the arms: strapping and posture differ from day to day."
    ]


def test_what_is_beyond_its_own_interval_alone_is_called_perhaps() -> None:
    """A change larger than its ± stood beside `no clear change`."""
    (line, *_) = clinic_lines.lines_of(kept(before=compared(0.3, 0.14, clear=False, date="2026-02-02")))
    assert line.trend == "perhaps higher: +0.052 ± 0.048"
    said = session_changes.change_lines([line])
    assert said[0].startswith("Perhaps: shoulder: stiffness +0.052 ± 0.048 N m per 10°. This is more than its ±, but")
    # It read `+0.022 ± 0.022`, and that the one is more than the other.
    assert session_changes.trend(0.0224, 0.0216, None, clear=False) == "perhaps higher: +0.0224 ± 0.0216"


def test_repeats_that_make_a_change_certain_are_computed_from_its_deviation() -> None:
    """By hand: with s = 0.1 in both sessions and one quantity, a change of 0.3 needs s²/n' = (0.3/2.33)² − s², n' = 1.5 n."""
    change = session_changes.Change(0.3, 1.96 * math.hypot(0.1, 0.1), None, False, "2026-01-02", 1, 0.1)
    assert clinic_next.repeats_needed(change, 10) == math.ceil(10 * 0.01 / ((0.3 / 2.32635) ** 2 - 0.01)) == 16
    # Of several quantities, chance makes one large more easily.
    assert clinic_next.repeats_needed(dataclasses.replace(change, compared=2), 10) > 16
    # The session before alone is too uncertain: no number of repeats helps.
    assert clinic_next.repeats_needed(dataclasses.replace(change, value=0.19), 10) == math.inf


def test_what_next_is_made_of_the_figures_of_the_result() -> None:
    found = kept(before=compared(0.3, 0.14, clear=False, date="2026-02-02"))
    found["data"] |= {"warnings": ["slow_1: joint 1 has missing samples"]}
    lines = clinic_lines.lines_of(found)
    said = clinic_next.next_steps([found], lines)
    assert said[0] == "Correct before the next session: slow_1: shoulder has missing samples."
    assert said[1].startswith("shoulder, stiffness: about 8 repeats of each movement instead of 5 would make a change of this size clear")
    assert said[2] == "Measure the right arm in the same way, into the same history: the page then compares both arms."
    stretches = [{"joint": 2, "configuration": f"v{k}", "speed": 0.3 * k} for k in (1, 2, 3)]
    effect = {"joint": 2, "decided": False, "parameters": {}}
    reflex = found | {"verb": "spasticity", "effects": [effect], "stretches": stretches, "history": []}
    assert clinic_next.next_steps([reflex], [])[1].startswith("elbow: no reflex up to 52 °/s. Only faster stretches can show one")
    effect |= {"decided": True, "parameters": {"threshold": {"value": 0.8}}}
    assert clinic_next.next_steps([reflex], [])[1].startswith(
        "elbow: only 1 of 3 speeds was above the reflex onset of 46 °/s (fastest 52 °/s). Add faster stretches"
    )
    active = reflex | {"data": reflex["data"] | {"warnings": ["v3_1: muscles are active for 1.2 s; left out"]}}
    assert not any("muscles" in line for line in clinic_next.next_steps([active], []))


def test_a_share_of_an_angle_is_not_stated() -> None:
    """Its zero is a convention."""
    assert session_changes.trend(-5.0, 1.23, None, clear=True) == "lower by 5.0 ± 1.2"
    assert session_changes.trend(-5.0, 1.23, 20.0, clear=True) == "lower by 5.0 ± 1.2 (−25 %)"
    # Rounded, the uncertainty has a digit more: it was 0.0100.
    assert session_changes.trend(0.0, 0.00999, None, clear=False) == "no clear change: +0.000 ± 0.010"


def test_what_is_unusual_is_said_in_words(norms: tuple[clinic_norms.Norm, ...]) -> None:
    said = clinic_page.unusual(clinic_lines.lines_of(result(), norms))
    assert said == [
        "shoulder: stiffness is above the usual range.",
    ]
    assert clinic_page.unusual(clinic_lines.lines_of(result(history=[]))) == []
    left = [{"verb": "gap", "verdict": verdict} for verdict in ("explained", "unexplained")]
    assert clinic_page.unusual([], left[:1]) == []
    assert clinic_page.unusual([], left) == [
        "An effect acts on the arm that the analysis could not identify: the numbers of this page may contain part of it."
    ]
    assert len(clinic_page.notes([result(warnings=list("abcdef"))])) == clinic_page.MOST_NOTES + 1
    assert clinic_page.notes([result(warnings=["slow: joint 2 moved"])]) == ["slow: elbow moved"]
    # The same of several movements is said once: one page has no room for a line of each.
    several = ["fast: joint 2 moved: left out", "noisy", "faster: joint 2 moved: left out", "noisy"]
    assert clinic_page.notes([result(warnings=several)]) == ["fast, faster: elbow moved: left out", "noisy"]


def test_a_slip_and_a_tremor_are_unusual_and_a_spring_is_not() -> None:
    """A page that was made of a gap with a handle that slipped said that nothing unusual was noticed."""
    effects = [
        {"kind": "elastic", "joint": 2, "family": "elastic", "summary": "linear spring about a rest angle"},
        {"kind": "tremor", "joint": 2, "family": "muscle", "summary": "muscle tremor"},
        {
            "kind": "handle_slip",
            "joint": None,
            "family": "contact",
            "summary": "handle that slips",
            "trial": "trials/slow_1.csv",
            "span": [2.575, 5.74],
        },
    ]
    gap = {"verb": "gap", "verdict": "explained", "effects": effects, "data": {"joints": ["shoulder", "elbow"]}}
    assert clinic_page.unusual([], [gap]) == [
        "The analysis found: muscle tremor (elbow).",
        "In the recording slow_1, 2.6 to 5.7 s: handle that slips. This part was left out.",
    ]


@pytest.mark.parametrize(("value", "said"), [(0.6, "within"), (0.5, "not clear"), (0.1, "below"), (3.0, "above")])
def test_the_interval_is_compared_with_the_norm_not_the_value(value: float, said: str, norms: tuple[clinic_norms.Norm, ...]) -> None:
    lines = clinic_lines.lines_of(result(parameters=[estimate("elastic", "stiffness", 1, value, 0.05)]), norms)
    assert [line.beside_norm for line in lines] == [said]


def test_the_verb_writes_one_page(norms: object, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source, out = tmp_path / "identified.json", tmp_path / "out"
    source.write_text(json.dumps(result()), encoding="utf-8")
    assert cli.main(["report", str(source), "--summary", "--norms", str(tmp_path / "norms.toml"), "-o", str(out)]) == 0
    assert capsys.readouterr().out.strip() == str(out / "summary.html")
    page = (out / "summary.html").read_text(encoding="utf-8")
    for words in (
        "moved and measured 5 times, 2.0 minutes",
        "shoulder from −60° to −10°",
        "Usual values: a table",
        "no diagnosis",
        "change since 2026-01-02",
        "elbow: nothing was measured of this joint",
        "before acting on a change",
    ):
        assert words in page
    # The course over the sessions, with what is usual behind it: one sheet has no room for a figure of the last values alone as well.
    assert page.count('src="data:image/png') == 1 and "Grey: what is usual." in page


def test_intervals_claim_no_more_than_holds(tmp_path: Path) -> None:
    """They were said to hold the true value in 95 of 100 measurements, also of joints that stick."""
    rubs = [estimate("coulomb", "torque", 1, 0.2, 0.03)]
    for name, changes, said in (
        ("sound", {}, "spring with resistance and friction.<"),
        ("rubs", {"parameters": rubs}, "too narrow: a joint has friction and may stick"),
        (
            "poor",
            {"warnings": ["the residual of joint 2 is 28% of the variation of its torque"]},
            "too narrow: the analysis does not describe",
        ),
        ("noisy", {"parameters": [{**e, "caveat": "noise"} for e in rubs]}, "a large part of the speeds is noise; a joint has friction"),
    ):
        source = tmp_path / f"{name}.json"
        source.write_text(json.dumps(result(**changes)), encoding="utf-8")
        page = clinic_page.write_summary([source], tmp_path / f"{name}.html").read_text(encoding="utf-8")
        assert said in page, name
        # With one session the figure of the joints has the caption.
        source.write_text(json.dumps(result(**changes, history=[])), encoding="utf-8")
        alone = clinic_page.write_summary([source], tmp_path / f"{name}.html").read_text(encoding="utf-8")
        assert said in alone.partition("<figcaption>")[2].partition("/figcaption>")[0], name
        assert "95 of 100" not in page


def test_a_resistance_that_may_be_none_is_told_as_a_limit() -> None:
    curve = {"joint": 1, "configuration": "slow", "repeats": 3, "half_width_mean_Nm": 0.06, "half_width_interval_Nm": [-0.03, 0.15]}
    # The movement with an interval is known better than one with more repeats that share no angle.
    other = {**curve, "configuration": "fast", "repeats": 4, "half_width_mean_Nm": 0.3, "half_width_interval_Nm": [None, None]}
    (line,) = clinic_lines.lines_of(result(verb="passive", curves=[other, curve], history=[]))
    assert clinic_lines.words_of(line)[2:4] == ["none seen", "at most 0.150"]
    named = {**curve, "joint_name": "shoulder"}
    assert (
        verdict({"verb": "passive", "curves": [named]})
        == "Half width of the hysteresis, with the movement in brackets: shoulder at most 0.15 N m (slow)."
    )
    negative = {**named, "half_width_mean_Nm": -0.12, "half_width_interval_Nm": [-0.15, -0.09]}
    assert (
        verdict({"verb": "passive", "curves": [negative]})
        == "Half width of the hysteresis, with the movement in brackets: shoulder -0.12 N m (slow)."
    )


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"verb": "plan"}, "verb: found 'plan', allowed a result of armrs identify or passive or gap or spasticity"),
        ({"data": {}}, "found not what a result holds"),
    ],
)
def test_what_no_summary_is_made_of_is_refused(change: dict[str, Any], message: str, tmp_path: Path) -> None:
    source = tmp_path / "x.json"
    source.write_text(json.dumps(result(**change)), encoding="utf-8")
    with pytest.raises(BadInput, match=message):
        clinic_page.write_summary([source], tmp_path / "summary.html")


def test_norms_are_refused_with_their_place(tmp_path: Path) -> None:
    for old, new, message in (
        ("high = 1.4", "high = 0.4", r"\[\[norm\]\] 1, high: found 0.4"),
        ('name = "stiffness"', 'name = "stifness"', r"\[\[norm\]\] 1: found elastic stifness, allowed elastic stiffness or "),
    ):
        (tmp_path / "n.toml").write_text(NORMS.replace(old, new), encoding="utf-8")
        with pytest.raises(BadInput, match=message):
            clinic_norms.load_norms(tmp_path / "n.toml")
    assert cli.main(["report", "x.json", "--norms", "n.toml"]) == 2


def slow_result(*curves: tuple[str, int, float, bool]) -> dict[str, Any]:
    """Return slow movements: of each its name, joint, range [deg], and whether it was slow."""
    made = [
        {"configuration": name, "joint": j, "angle_deg": [0.0, span], "slow": slow, "repeats": 3, "half_width_mean_Nm": 0.1}
        | {"half_width_interval_Nm": [0.09, 0.11], "half_width_whole_interval_Nm": [0.05, 0.15]}
        | {"stiffness_whole_interval_Nm_rad": [0.7, 1.3]}
        for name, j, span, slow in curves
    ]
    repeated = [{"joint": j, "name": f"stiffness in {name}", "value": 1.0, "interval": [0.95, 1.05]} for name, j, _, slow in curves if slow]
    check = {"name": "slow", "passed": all(c[3] for c in curves), "text": "Not slow: inertial torques are at most 23 % (joint 1, stretch3)"}
    warned = [f"{name}: not slow for joint {j}: inertial torques are 23 %" for name, j, _, slow in curves if not slow]
    return result(verb="passive", curves=made, repeated=repeated, checks=[check], warnings=warned, history=[])


def test_a_held_joint_is_not_advised_to_move_slowly() -> None:
    """A page said that nothing was unusual, and to mend the inertial torques of joint 1, which was held."""
    held = slow_result(("stretch3", 1, 4.0, False), ("stretch3", 2, 80.0, True))
    assert clinic_page.unusual([], [held]) == clinic_page.notes([held]) == clinic_next.next_steps([held], []) == []
    fast = slow_result(("stretch3", 1, 40.0, False), ("stretch3", 2, 80.0, True))
    assert clinic_page.unusual([], [fast]) == ["shoulder: moved too fast to measure its slow movement."]
    (said,) = clinic_next.next_steps([fast], [])
    assert said.startswith("Move the shoulder more slowly") and clinic_page.notes([fast]) == []


def test_the_activity_of_a_reflex_is_nothing_to_correct() -> None:
    """A page advised to correct the muscle activity of the reflex that it had found, before the next session."""
    active = {"name": "muscles silent", "passed": False, "text": "Not silent: emg_flexor rises to 2.3 times its median"}
    passive = slow_result(("stretch", 2, 80.0, True)) | {"checks": [active]}
    beside = result(verb="spasticity", effects=[{"kind": "stretch_reflex", "joint": 2, "decided": False, "parameters": {}}])
    assert clinic_next.faults([passive, beside]) == ["Not silent: emg_flexor rises to 2.3 times its median."]
    beside["effects"][0]["decided"] = True
    assert clinic_next.faults([passive, beside]) == []


def test_a_held_joint_was_not_moved_through_a_range() -> None:
    """It read `shoulder from −45° to −45°`."""
    told = result()
    told["data"] = told["data"] | {"range_deg": [[-45.2, -44.8], [30.0, 120.0]]}
    (said,) = [line for line in clinic_page.measured([told]) if line.startswith("Range")]
    assert "shoulder held at −45°, elbow from 30° to 120°" in said


def test_the_interval_of_a_slow_movement_has_the_errors_of_the_masses() -> None:
    """With masses 3 % off, the interval of the repeats excluded the true stiffness."""
    half_width, stiffness = clinic_lines.lines_of(slow_result(("slow", 2, 80.0, True)))
    assert half_width.interval == pytest.approx((0.05, 0.15))
    assert stiffness.interval == pytest.approx((0.7 * math.radians(10.0), 1.3 * math.radians(10.0)))


def test_a_movement_in_which_the_reflex_acts_is_not_slow() -> None:
    """A stretch of 80 °/s above the onset of 46 °/s counted as slow movement, and gave the stiffness of the page."""
    curve = {"joint": 2, "half_width_mean_Nm": 0.1, "half_width_interval_Nm": [0.05, 0.15], "slow": True}
    slow, fast = (
        {**curve, "configuration": "v1", "repeats": 3, "bandwidth_Hz": 0.2},
        {**curve, "configuration": "v3", "repeats": 4, "bandwidth_Hz": 0.9},
    )
    passive = {"verb": "passive", "curves": [slow, fast]}
    stretches = [{"joint": 2, "configuration": name, "speed": speed} for name, speed in (("v1", 0.3), ("v3", 1.4))]
    effect = {"joint": 2, "decided": True, "parameters": {"threshold": {"value": 0.8}}}

    def used(**changes: Any) -> str:
        beside = {"verb": "spasticity", "effects": [effect | changes], "stretches": stretches}
        found, _ = clinic_lines.without_reflexes([passive, beside])
        return str((clinic_lines.best_known(found, 2) or {})["configuration"])

    assert used() == "v1"
    assert used(decided=False) == "v3" and used(joint=1) == "v3"
    # Of movements with as many repeats the slowest counts.
    even = {"verb": "passive", "curves": [fast, {**slow, "repeats": 4}]}
    assert (clinic_lines.best_known(even, 2) or {})["configuration"] == "v1"
