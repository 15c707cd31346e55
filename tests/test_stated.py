"""What reports state agrees with itself: shares, maps, names of colours, and what is installed for what is shown."""

from __future__ import annotations

import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib import rcParams
from matplotlib.colors import rgb_to_hsv, to_hex, to_rgb
from matplotlib.font_manager import FontProperties, findfont, get_font

import armrs
from armrs import demo, formatting
from armrs.analysis import double_exponential
from armrs.catalogue import catalogue
from armrs.report import clinic_sentences, plotting, tables
from armrs.report import sentences as common
from armrs.report.gap import figures, sentences
from armrs.thesis import simulation_comparison
from armrs.workflows import identify, setup_check
from armrs.workflows.gap import residual_maps
from armrs.workflows.residuals import Explained, residuals
from test_docs import ROOT, blocks


def gap_of(**channel: float | None) -> dict[str, Any]:
    whole = {"before": 1.0, "calibrated": 0.5, "after": 0.2, "floor": 0.2} | channel
    return {"gap": {"Fy_N": whole}, "effects": [{"trial": None}], "open": []}


def test_documents_count_the_effects_that_are_searched_for() -> None:
    """The catalogue printed 38, the README said 34 and the blind test 32, and nothing said why."""
    kinds = [kind for kind in catalogue().values() if not kind.own]
    searched = {kind.kind for kind in kinds if kind.searched}
    assert f"armrs searches {len(searched)} of the {len(kinds)} effects of its" in (ROOT / "README.md").read_text()
    assert f"Y, of {len(searched)} kinds" in (ROOT / "docs/peers.md").read_text()
    hidden = ROOT / "bench" / "hidden"
    cast = re.findall(r'(?:at_joints|anywhere)\(\s*"(\w+)"', (hidden / "src" / "cast" / "sizes.rs").read_text())
    other = re.search(r"^SIZES.*?^}", (hidden / "mujoco_world" / "sizes.py").read_text(), flags=re.M | re.S)
    assert other is not None and searched - set(cast) == {"handle_slip", "shoulder_heave"} and set(cast) < searched
    said = (hidden / "README.md").read_text()
    assert f"each of {len(cast)} kinds" in said and f"the {len(searched)} that `armrs gap` searches for" in said
    of_mujoco = re.findall('^    "', other[0], flags=re.M)
    assert f"the same families, {len(of_mujoco)} kinds" in said


@pytest.mark.parametrize(("after", "closed"), [(0.1, "100 %"), (0.35, "50 %"), (0.2, "100 %")])
def test_no_more_than_all_of_a_gap_is_closed(after: float, closed: str) -> None:
    """Below what repeats differ by there is nothing to close: `104 %` was printed."""
    (row,) = sentences.gap(gap_of(after=after)).rows
    assert closed in row


def effect(**more: Any) -> dict[str, Any]:
    value = {"value": 0.2, "std": 0.01, "interval": [0.18, 0.22], "unit": "N m"}
    return {"kind": "coulomb", "joint": 2, "channel": None, "share": 0.001, "without": 3.4, "parameters": {"torque": value}} | more


def test_the_worth_of_an_effect_is_told_in_units_of_the_scatter() -> None:
    """A share of what is explained was 0 % in most rows of the table of an arm without laws."""
    found = {"effects": [effect(), effect(without=None)], "lack_of_fit": {"amended": {"ratio": 1.21}}}
    table = sentences.missing(found)
    assert table.head[2] == "residual without the effect" and [row[2] for row in table.rows] == ["3.4", "–"]
    assert "With every effect it is 1.1." in sentences.worth(found)
    unrepeated = {"effects": [effect(without=None)], "lack_of_fit": {"amended": {"ratio": None}}}
    assert sentences.missing(unrepeated).rows[0][2] == "< 1 %" and "Share: " in sentences.worth(unrepeated)


def test_a_moment_is_told_with_the_angle_at_which_it_holds() -> None:
    """An end-range moment of `0.43 N m` was printed without its angle, but with that of the other end, whose moment is zero."""

    def of(std: float | None) -> dict[str, Any]:
        interval = None if std is None else [0.4, 0.46]
        moment, none = {"value": 0.43, "std": std, "interval": interval, "unit": "N m"}, {"std": None, "interval": None}
        others = {"lower_moment": none | {"value": 0.0, "unit": "N m"}, "upper": none | {"value": 0.354, "unit": "rad"}}
        return {"upper_moment": moment, **others, "lower": none | {"value": -2.0, "unit": "rad"}}

    for std in (0.01, None):
        found = {"effects": [effect(kind="end_range", parameters=of(std))]}
        assert [row[3] for row in sentences.missing(found).rows] == ["upper_moment", "upper"]


def test_sentences_write_a_value_and_its_interval_in_one_way() -> None:
    """The sentence of a reflex had one digit more than that of a gap: above 91.7 °/s (95 % interval 88.2 to 95.1)."""

    def value(mean: float, std: float, unit: str) -> dict[str, Any]:
        return {"value": mean, "std": std, "unit": unit, "interval": [mean - 2.0 * std, mean + 2.0 * std]}

    threshold = value(1.6, 0.03, "rad/s")
    latency, way = value(0.0402, 0.0021, "s"), {"value": 1.0}
    parameters = {"direction": way, "threshold": threshold, "gain": value(0.5012, 0.02, "N m s/rad"), "latency": latency}
    reflex = {"joint": 1, "decided": True, "parameters": parameters}
    assert clinic_sentences.verdict({"verb": "spasticity", "data": {"joints": ["elbow"]}, "effects": [reflex]}) == (
        "elbow: a stretch reflex resists where the angle grows faster than 92 °/s (95 % interval 88 to 95); gain 0.50 N m s/rad "
        "(95 % interval 0.46 to 0.54); latency 40 ms (95 % interval 36 to 44)."
    )
    assert sentences.size({"parameters": {"speed": threshold}}) == "speed 92 °/s (95 % interval 88 to 95)"


def test_what_is_followed_has_the_names_and_units_of_the_page_it_stands_on() -> None:
    """Below a table in degrees and milliseconds stood `stretch_reflex 1 threshold` in rad/s and a latency in seconds."""
    before = {"value": 0.002, "std": 0.002, "p_value": 0.4, "clear": False}
    tested = {"before": before, "change": 0.002, "change_std": 0.002, "p_value": 1e-14, "changed": True}
    reflex = {"kind": "stretch_reflex", "joint": 1, "dates": ["a", "b", "c"], "stds": [0.002] * 3, **tested}
    threshold = {"name": "threshold", "unit": "rad/s", "values": [1.0, 1.0, 1.002], **reflex}
    table = tables.history([threshold, {**threshold, "name": "latency", "unit": "s", "values": [0.04, 0.04, 0.0393]}])
    assert table.rows == [
        ["stretch reflex threshold, joint 1", "°/s", 3, "57.41 ± 0.11", "+0.11 ± 0.11", "no (p = 0.4)", "+0.11 ± 0.11", "yes (p < 1e-12)"],
        ["stretch reflex latency, joint 1", "ms", 3, "39.3 ± 2.0", "+2.0 ± 2.0", "no (p = 0.4)", "+2.0 ± 2.0", "yes (p < 1e-12)"],
    ]
    half_width = {**threshold, "kind": "passive", "name": "half_width in slow_elbow", "unit": "N m"}
    assert formatting.parameter_label(half_width) == "passive half width, joint 1 in slow_elbow"
    assert len(tables.history([{**threshold, "dates": ["a"], "change": None, "p_value": None}]).head) == 4


def test_moments_that_depend_on_both_angles_may_be_a_wrong_mass() -> None:
    """The demonstration, whose joints are not coupled and whose model is too heavy, was told that they are."""
    found = {"joint_names": ["shoulder", "elbow"], "coupled": True, "value_Nm_rad": 0.0449, "std_Nm_rad": 0.002, "p_value": 2e-11}
    said, why = common.couplings({"couplings": [found]})
    assert said.startswith("shoulder and elbow: the elastic moment of each depends on the angle of the other, 0.0449 ± 0.0020 N m/rad")
    assert "Tissue that spans both joints" in why and "A wrong mass or centre of mass in the model does the same" in why
    [said] = common.couplings({"couplings": [found | {"coupled": False}]})
    assert "no dependence of the elastic moment of one on the angle of the other was detected" in said


def test_a_difference_between_groups_has_a_direction() -> None:
    """The page of a cohort said that they differ, once for the groups and once for the sides."""

    def contrast(first: str, second: str, difference: float, p_value: float) -> dict[str, Any]:
        return {"name": "half_width in slow", "between": [first, second], "within": "", "difference": difference, "p_value": p_value}

    found = {"verb": "cohort", "subjects": 12, "sessions": 24, "quantities": [{"name": "half_width in slow"}]}
    found["contrasts"] = [contrast("control", "patient", 0.6, 1e-4), contrast("left", "right", -0.2, 0.01), contrast("a", "b", 1.0, 0.2)]
    assert clinic_sentences.verdict(found) == (
        "12 subjects, 24 sessions, 1 quantity. Half width in slow is higher in patient than in control and lower in right than in left "
        "(level of 5 % for all comparisons together)."
    )


def test_standard_deviations_beyond_a_hundred_are_not_counted() -> None:
    """`+40589.3 standard deviations` and `-0.0` were printed."""
    lack = {"calibrated": {"ratio": 2431.4, "z": 40589.3}, "amended": {"ratio": 0.999, "z": -0.01}}
    said = sentences.left(
        {"lack_of_fit": lack, "effects": [effect()], "gap": {}, "open": [], "unexplained": {"share": 0.0, "looks_like": None}}
    )
    assert "2430 times" in said[0] and "more than 100 standard deviations" in said[0]
    assert "(+0.0 standard deviations; limit 6)" in said[1]


def test_what_is_left_lies_where_repeats_share_it() -> None:
    """The joint with the longest lever arm was stated, because its torque contained the most noise of the force sensor."""
    t, random = np.arange(0.0, 8.0, 0.01), np.random.default_rng(4)
    q = np.column_stack([np.sin(t), np.cos(t)])
    repeats = [
        SimpleNamespace(
            trial=SimpleNamespace(role="fit", configuration="reach", file=f"reach_{k}.csv", t=t, rate=100.0),
            q=q,
            qd=np.gradient(q, 0.01, axis=0),
            torque=random.normal(0.0, [0.05, 0.002], (len(t), 2)) + np.column_stack([0.0 * t, 0.02 * q[:, 0]]),
            valid=lambda _: np.full(len(t), True),
        )
        for k in range(3)
    ]
    said = residual_maps.shape(repeats)  # type: ignore[arg-type]
    assert said is not None and said.startswith("most of it lies in joint 2 (0.014 N m, root mean square)")
    alone = residual_maps.shape(repeats[:1])  # type: ignore[arg-type]
    assert alone is not None and alone.startswith("most of it lies in joint 1 (0.051 N m")


def test_cells_that_are_not_clear_do_not_look_unvisited() -> None:
    """A pale cell is a tint of white, a cell that was not visited is grey."""
    t = np.arange(0.0, 20.0, 0.01)
    q = np.column_stack([np.sin(t)])
    seen = SimpleNamespace(
        trial=SimpleNamespace(role="fit"), q=q, qd=np.column_stack([np.cos(t)]), torque=1e-9 * q, valid=lambda _: np.full(len(t), True)
    )
    with plotting.style():
        figure = figures.missing_torque(["elbow"], {"calibrated": [seen, seen]}).figure  # type: ignore[list-item]
        figure.canvas.draw()
    ax = figure.axes[0]
    assert to_hex(ax.get_facecolor()) == to_hex(plotting.FAINT) != "#ffffff"
    visited = np.isfinite(residual_maps.residual_map([seen, seen], 0).torque)  # type: ignore[list-item]
    white = ax.collections[0].get_facecolor().reshape(*visited.shape, 4)
    assert 0.1 < visited.mean() < 1.0
    assert (white[visited] == 1.0).all() and (white[~visited][:, 3] == 0.0).all()


def test_the_film_names_the_colours_that_it_has() -> None:
    """The arm in #D55E00 was called red."""
    run = armrs.simulate(demo.true_model(), armrs.Movement(np.radians([[-60.0, 60.0], [-58.0, 61.0]]), speed=0.5, acceleration=2.0))
    film = simulation_comparison._film(simulation_comparison.Comparison(run, demo.measure_two_speeds), "t")  # type: ignore[arg-type]
    said = dict(re.findall(r"(robot|arm) \((\w+)\)", str(film["text"])))
    hues = {"orange": (15.0, 45.0), "blue": (190.0, 250.0)}
    colours = {chain["name"]: chain["colour"] for chain in film["chains"]}  # type: ignore[attr-defined]
    assert said.keys() == colours.keys()
    for name, colour in colours.items():
        low, high = hues[said[name]]
        assert low < 360.0 * rgb_to_hsv(to_rgb(colour))[0] < high


def test_pages_and_figures_share_a_typeface() -> None:
    """Where it is installed; the page names Verdana, which is drawn alike, where it is not."""
    css = (ROOT / "python" / "armrs" / "report" / "templates" / "page.css").read_text(encoding="utf-8")
    first = re.search(r"^body \{[^}]*? font: [^\"]*\"([^\"]+)\", Verdana", css, flags=re.M)
    with plotting.style():
        drawn = findfont(FontProperties(family=rcParams["font.family"]))
    assert first is not None and get_font(drawn).family_name == first[1]


def test_what_the_readme_shows_is_installed_and_short() -> None:
    """C3D was missing after `make demo`; the first examples copied lists."""
    assert re.search(r"^files = \[.*ezc3d", (ROOT / "pyproject.toml").read_text(encoding="utf-8"), flags=re.M)
    built = re.search(r"^\$\(STAMPS\)/build:.*?\n\n", (ROOT / "Makefile").read_text(encoding="utf-8"), flags=re.M | re.S)
    assert built is not None and "--extras files" in built[0]
    python = [content for language, _, content in blocks(ROOT / "README.md") if language == "python"]
    assert len(python) >= 3 and not any(re.search(r"\blist\(|\.copy\(|\[\*", content) for content in python)


@pytest.mark.parametrize("file", ["README.md", "docs/architecture.md"])
def test_the_thesis_is_cited_where_it_is_spoken_of(file: str) -> None:
    """Pages said "the thesis" and nothing said whose."""
    text = (ROOT / file).read_text(encoding="utf-8")
    cited = (
        r"Timotej Kodek, \*Estimation of Upper Extremity Biomechanical Parameters Using a Robot Manipulator\*, Ph\. ?D\. thesis,[^.]*2004"
    )
    assert "thesis" in text and re.search(cited, " ".join(text.split()))


def test_the_documented_thresholds_are_those_of_the_code() -> None:
    """A null misfit of 4.3 stood in one place and of 4.8 in another."""
    guide = (ROOT / "docs" / "developer.md").read_text(encoding="utf-8")
    table = dict(re.findall(r"^\| `([A-Z_]+)`[^|]*\| ([0-9.]+) \|", guide, flags=re.M))
    assert set(table) >= {"THRESHOLD", "LACK_OF_FIT", "LEVEL", "TOLERATED_EXCESS", "OPEN_GAP", "TIE", "LEAST_GAIN_TO_NAME"}
    source = "\n".join(path.read_text(encoding="utf-8") for path in sorted((ROOT / "crates" / "arm-gap" / "src").rglob("*.rs")))
    for name, value in table.items():
        assert {float(v) for v in re.findall(rf"const {name}: f64 = ([0-9.]+);", source)} == {float(value)}, name
    texts = [*(ROOT / "docs").glob("*.md"), *(ROOT / "crates").rglob("verdict.rs")]
    said = {v for path in texts for v in re.findall(r"(?:hidden|nulls)(?:\s|///)+reach (\d\.\d)", path.read_text(encoding="utf-8"))}
    assert said == {"4.8"}


def test_a_trial_that_no_fit_has_seen_is_called_a_test_trial() -> None:
    """README, gallery and notebooks called it held out, the gap workflow kept apart."""
    pages = [ROOT / "README.md", *ROOT.glob("docs/*.md"), *ROOT.glob("examples/notebooks/*.ipynb")]
    texts = [*pages, *(path for path in ROOT.glob("python/armrs/**/*") if path.suffix in {".py", ".pyi", ".j2"})]
    other = re.compile(r"held[- ]out|kept apart", flags=re.I)
    assert {path.relative_to(ROOT).as_posix() for path in texts if other.search(path.read_text(encoding="utf-8"))} == set()
    assert "\n| test trial |" in (ROOT / "docs" / "gap.md").read_text(encoding="utf-8")


def test_nalgebra_is_said_to_do_what_it_does() -> None:
    """It "serves as a container" stood beside its Cholesky factorisation."""
    methods = {"cholesky": "Cholesky", "try_inverse": "inverse", "lu": "LU", "qr": "QR", "svd": "singular", "symmetric_eigen": "eigen"}
    users = [
        path.parent for path in ROOT.glob("crates/*/Cargo.toml") if "\nnalgebra" in path.read_text(encoding="utf-8").partition("[dev-")[0]
    ]
    sources = "\n".join(path.read_text(encoding="utf-8") for crate in users for path in crate.glob("src/**/*.rs"))
    done = {word for method, word in methods.items() if re.search(rf"\.{method}\(", sources)}
    assert done
    for file, place in (("docs/determinism.md", r"^- \*\*nalgebra\*\*.*?(?=^- )"), ("Cargo.toml", r"^#[^\n]*(?=\nnalgebra)")):
        said = re.search(place, (ROOT / file).read_text(encoding="utf-8"), flags=re.M | re.S)
        assert said is not None and {word for word in methods.values() if word in said[0]} == done, file


def test_no_time_of_the_performance_page_is_negative() -> None:
    """An import time of "-0.224 s" was the difference of two measurements."""
    text = (ROOT / "docs" / "performance.md").read_text(encoding="utf-8")
    times = re.findall(r"(?<![\w.])([-−]?)\d[\d.]* (?:ns|µs|ms|s|min)\b", text)
    assert len(times) > 50 and set(times) == {""}


def test_every_extra_is_imported() -> None:
    """The extra `fmi` installed what nothing imported."""
    extras = re.search(
        r"^\[project.optional-dependencies\]\n(.*?)^\[", (ROOT / "pyproject.toml").read_text(encoding="utf-8"), flags=re.M | re.S
    )
    assert extras is not None
    source = "\n".join(p.read_text(encoding="utf-8") for folder in ("python/armrs", "bench/hidden") for p in (ROOT / folder).rglob("*.py"))
    listed = {name: re.findall(r'"([a-z0-9-]+)[<>=]', line) for name, line in re.findall(r"^([a-z]+) = \[(.*)\]$", extras[1], flags=re.M)}
    assert {"cluster", "fmi", "files", "notebook"} <= set(listed)
    for name, packages in listed.items():
        for package in packages if name != "dev" else ():
            used = re.search(rf"^\s*(?:import|from) {package}\b|(?:import_module|find_spec)\(\"{package}", source, flags=re.M)
            assert used or package == "ipykernel", f"{name}: {package}"  # a notebook starts its kernel itself


def test_tolerances_are_warned_of_at_the_multiples_that_files_md_says() -> None:
    """It said five where the code had two, and a tolerance was one deviation here and two there."""
    text = " ".join((ROOT / "docs" / "files.md").read_text(encoding="utf-8").split())
    said = re.search(r"beyond (\w+) its tolerance is marked; beyond (\w+) times, a warning states", text)
    assert said is not None
    noted, warned = ({"twice": 2.0, "three": 3.0, "four": 4.0, "five": 5.0}[word] for word in said.groups())
    tolerance = armrs.Tolerance(force_bias_N=0.1)

    def told(times: float) -> tuple[int, int]:
        """Return how many are pointed out and warned of where a bias came out so many times its tolerance."""
        own = SimpleNamespace(name="force bias y", value=-0.1 * times, unit="N")
        steps = ((identify._FAR, identify._BEYOND), (identify._BEYOND, np.inf))
        return tuple(len(identify._beyond_tolerance([own], tolerance, *step)) for step in steps)  # type: ignore[return-value, list-item]

    assert [told(f * by) for f in (noted, warned) for by in (0.99, 1.01)] == [(0, 0), (1, 0), (1, 0), (0, 1)]


def test_the_tables_of_passive_moments_are_explained_beside_them() -> None:
    """`inertial share`, `upper` and `linear law enough` stood on the terminal without a word."""
    head = tables.passive({"curves": []}).head
    assert {name.partition(" [")[0] for name in head[4:]} == {"elastic mean", "half width", "95 % interval", "inertial share"}
    for name in head[4:]:
        assert name.partition(" [")[0] in common.PASSIVE_MEANING.lower(), name
    for name in (*double_exponential.NAMES, "coupling", "moment", "mean coupling", "linear law"):
        assert name.rpartition("_")[2] in common.DEPENDENCE_MEANING.lower().replace("mean\ncoupling", "mean coupling"), name


def test_a_history_without_quantities_is_not_explained(capsys: pytest.CaptureFixture[str]) -> None:
    """The meaning of a table stood where there was none."""
    common.followed({"history": []})
    assert capsys.readouterr().out == ""


def test_the_summary_of_an_identification_counts_what_its_tables_show() -> None:
    """It said 6 of 8, the first table had 4 rows, and 3 of the parameters were measured."""
    item = {"name": "m1", "kind": "segment", "joint": 1, "value": 2.0, "std": 0.1, "interval": (1.8, 2.2), "unit": "kg", "caveat": None}
    parameters = [item | {"name": name, "decided_by": by} for name, by in (("m1", "prior"), ("m2", "data"), ("l1", "bound"))]
    combinations = [item | {"name": name, "kind": "combination", "decided_by": "data"} for name in ("m1*l1", "m2")]
    result = {"verb": "identify", "status": "solved", "parameters": parameters, "combinations": combinations, "rank": 3, "unknowns": 4}
    assert len(tables.measured(result)) == 2
    assert common.verdict(result) == (
        "Measured: 2 quantities (first table). Of the 3 parameters, the measurement decides 1, the model as given 1, a physical limit 1."
    )
    one = result | {"combinations": []}
    assert common.verdict(one).startswith("Measured: 1 quantity (first table).")


def test_an_interval_that_ends_at_a_limit_says_so() -> None:
    """`0.0040 ± 0.0092` stood beside `0.0000 … 0.0241` without a word."""
    even = {
        "name": "m1",
        "kind": "segment",
        "joint": 1,
        "value": 2.0,
        "std": 0.1,
        "interval": (1.8, 2.2),
        "unit": "kg",
        "decided_by": "prior",
    }
    cut = even | {"name": "torque", "kind": "coulomb", "value": 0.004, "std": 0.0092, "interval": (0.0, 0.0241), "caveat": "noisy speed"}
    table = tables.estimates([even, cut], ["shoulder"], 0.95)
    assert [dict(zip(table.head, row, strict=True))["note"] for row in table.rows] == [None, "noisy speed, interval ends at 0"]


def test_what_can_change_together_has_units() -> None:
    """`m2, m1·l1 and I1 + m1·l1² can change together as 1 : -0.376 : -0.1414`: the units were those of the unknowns, in the order named."""
    listed = [("m2", "kg"), ("m1*l1", "kg m"), ("I1 + m1*l1^2", "kg m^2")]
    result = {
        "not_separable": ["m1 does not act on the data", "m2, m1*l1 and I1 + m1*l1^2 trade 1 : -0.376 : -0.1414"],
        "parameters": [{"name": name, "unit": unit} for name, unit in listed],
        "combinations": [],
        "scale_free": False,
    }
    assert common.not_separable(result) == [
        "m1 does not act on the data.",
        "Changing m2 by 1 kg, m1·l1 by -0.376 kg m and I1 + m1·l1² by -0.1414 kg m² together leaves every measurement unchanged: none is "
        "measured alone.",
    ]


def test_a_weight_says_what_its_deviations_count() -> None:
    """`0.46 ± 0.01 times the masses, 5.4 standard deviations from it`: the ± is not that of the model."""
    assert "0.460 ± 0.010 times the masses" in (said := str(setup_check.Weight(0.46, 0.01, 5.4)))
    assert "0.1068 ± 0.0031 times the masses" in str(setup_check.Weight(0.1068, 0.0031, 8.9))  # it read 0.11 ± 0.00
    assert "5.4 standard deviations from one, the model's own uncertainty counted" in said


def test_a_trial_of_which_nothing_is_left_has_no_residual() -> None:
    """The low-pass of a slow session took all samples of a short trial, and identify ended with a traceback of NumPy."""
    trial = SimpleNamespace(role="fit", configuration="slow", t=np.arange(4.0), q=np.arange(4.0)[:, None])
    torque = np.array([[1.0], [2.0], [4.0], [3.0]])
    whole = Explained(trial, trial.t, torque, 0.9 * torque)  # type: ignore[arg-type]
    none = Explained(trial, np.zeros(0), np.zeros((0, 0)), np.zeros((0, 0)))  # type: ignore[arg-type]
    assert residuals([none, whole]) == residuals([whole]) != ()
