"""The one sentence that a gap report opens with, on made-up results in the form of `gap.json`."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import armrs
from armrs._armrs import ChannelGap, Missing, verdict_of
from armrs.catalogue import catalogue
from armrs.cli.analysis import after_gap
from armrs.demo import given_model, true_model
from armrs.report.gap.headline import amount, headline, still_open, undecided
from armrs.report.gap.result_files import formula_of
from armrs.report.gap.sentences import calibration, gap, heading, intervals, left, missing, named, nearest, others, quick, show, tie
from armrs.report.gap.summary_figure import marks, rivals


def channel(before: float, calibrated: float, after: float, floor: float | None) -> dict[str, Any]:
    return {"before": before, "calibrated": calibrated, "after": after, "floor": floor}


def sized(value: float, std: float, unit: str) -> dict[str, Any]:
    return {"value": value, "std": std, "unit": unit, "interval": [value - 2.0 * std, value + 2.0 * std]}


def effect(kind: str, joint: int | None = None, size: tuple[str, float, float, str] | None = None, **more: Any) -> dict[str, Any]:
    parameters = {} if size is None else {size[0]: sized(*size[1:])}
    return {"kind": kind, "joint": joint, "channel": None, "parameters": parameters, "alternatives": [], **more}


def result(verdict: str, *effects: dict[str, Any], z: float | None = 0.5, **more: Any) -> dict[str, Any]:
    return {
        "verdict": verdict,
        "effects": list(effects),
        "gap": {"Fz_N": channel(3.0, 2.4, 0.16, 0.15), "q3_rad": channel(0.003, 0.002, 0.0019, 0.0018)},
        "data": {"joints": ["shoulder", "elbow", "wrist"]},
        "lack_of_fit": {"calibrated": {"ratio": 3.0, "z": 20.0}, "amended": {"ratio": 1.0, "z": z}},
        "unexplained": {"share": 0.0, "looks_like": None},
        "would_have_seen": [],
        **more,
    }


DRY = effect("coulomb", 2, ("torque", 0.161, 0.006, "N m"))


def test_a_named_effect_is_told_with_its_size_and_what_it_is_worth() -> None:
    assert headline(result("explained", DRY)) == (
        "Missing from the model is Coulomb friction in joint 2 (elbow), torque 0.161 N m (95 % interval 0.149 to 0.173): with it, the "
        "gap of the contact force upward (Fz) on test trials falls from 2.4 N to 0.16 N RMS; repeats differ by 0.15 N."
    )


def test_of_two_amplitudes_the_larger_one_is_told() -> None:
    """A heave of 3 mm upward and 1 mm forward was told with the latter, where the table of effects begins with y."""
    heave = effect("shoulder_heave", None)
    heave["parameters"] = {
        name: {"value": value, "std": std, "unit": held_in, "interval": [value - 2e-4, value + 2e-4]}
        for name, value, std, held_in in (
            ("y", 1e-3, 1e-4, "m"),
            ("z", -3e-3, 1e-4, "m"),
            ("frequency", 0.31, 0.01, "Hz"),
            ("phase", 0.7, None, "rad"),
        )
    }
    assert headline(result("explained", heave)).startswith(
        "Missing from the model is shoulder heave, z -0.0030 m (95 % interval -0.0032 to -0.0028): with it, "
    )
    heave |= {"summary": "first joint that heaves", "formula": "f", "p_value": 1e-20}
    assert "z -0.0030 m (95 % interval -0.0032 to -0.0028)" in named(result("explained", heave))[0]
    # As its interval, the probability of an improvement by chance assumes that the structure of the model is right.
    assert "by chance: below one in a million" in named(result("explained", heave))[0]
    assert "by chance" not in named(result("unexplained", heave))[0]


def test_an_open_gap_contradicts_no_sentence() -> None:
    """As where a reflex was absorbed: the wrist off by 0.0153 rad where repeats differ by 0.0019."""
    channels = {"q3_rad": channel(0.02, 0.0155, 0.0153, 0.0019), "Fz_N": channel(0.7, 0.65, 0.65, 0.14)}
    for verdict, effects in (("nothing_missing", []), ("explained", [DRY])):
        told = result(verdict, *effects, gap=channels)
        assert still_open(told) == ["q3_rad", "Fz_N"]
        said = headline(told)
        assert "Nothing is missing" not in said and "falls from" not in said
        assert "off by 0.88° RMS; repeats differ by 0.11°" in said
        assert [row[-1] for row in gap(told).rows] == ["open", "open"]
        assert any(line.startswith("The angle of joint 3 (q3) is open on the test trials") for line in left(told))


def test_the_next_step_speaks_of_an_open_gap_only_where_a_channel_is_open() -> None:
    """A lack of fit alone makes a result unexplained: no channel of its report was open."""
    step = after_gap(result("unexplained", DRY, open=[]), Path("s"), Path("out"), session())
    assert step == "out/report.html shows where model and data disagree; armrs check s lists problems of the recordings"
    opened = result("unexplained", open=[{"channel": "q3_rad"}])
    assert "in which channel the gap is open" in after_gap(opened, Path("s"), Path("out"), session())


def session(subject: armrs.Subject | None = None, **channels: np.ndarray) -> armrs.Dataset:
    """Return a data set of a mechanical arm with one test trial, or that of a subject."""
    t = np.linspace(0.0, 1.0, 30)
    trial = armrs.Trial("trials/a_2.csv", "a", 2, "test", t, np.column_stack([t, t]), **channels)
    model = given_model(true_model())
    return armrs.Dataset("arm", model, (trial,), folder=Path("s"), subject=subject or armrs.Subject())


def test_a_mechanical_arm_has_no_page_for_a_clinician_as_next_step() -> None:
    """It was the page in plain words, also after the brakes of the demonstration."""
    torques = np.zeros((30, 2))
    after = [
        after_gap(told, Path("s"), Path("out"), data)
        for told, data in (
            (result("explained", DRY), session(tau=torques)),
            (result("explained", DRY), session()),
            (result("nothing_missing"), session(tau=torques)),
            (result("explained", DRY), session(armrs.Subject(body_mass=70.0), tau=torques)),
        )
    ]
    shown = "out/report.html shows the gap before and after"
    assert after == [
        f"{shown}; armrs simulate out/amended.toml --trial s/trials/a_2.csv -o simulated simulates a trial with the amended model",
        shown,
        "armrs identify s -o identified",
        "armrs report out/gap.json --summary -o clinic writes one page in plain words",
    ]


def test_the_files_that_are_listed_are_the_model_the_result_and_the_report(capsys: pytest.CaptureFixture[str]) -> None:
    """It was the report alone."""
    written = [Path("out") / name for name in ("amended.toml", "figures/gap.png", "figures/live.json", "gap.json", "report.html")]
    show(
        result("explained", DRY | {"share": 0.5, "without": None}, where=[], data={"joints": ["shoulder", "elbow"], "name": "arm"}), written
    )
    assert capsys.readouterr().out.splitlines()[-3:] == ["out/amended.toml", "out/gap.json", "out/report.html"]


def test_parameters_that_a_law_does_without_have_no_row() -> None:
    """Under `unexplained` nothing has an interval, and a reflex had rows for a direction, a tonic angle and a slope of zero."""
    reflex = effect("stretch_reflex", 3)
    reflex |= {"share": 0.1, "without": None}
    values = (("gain", 0.087, "N m s/rad"), ("threshold", 0.31, "rad/s"), ("direction", 0.0, "1"), ("slope", 0.0, "1/s"))
    reflex["parameters"] = {name: {"value": value, "std": None, "unit": unit, "interval": None} for name, value, unit in values}
    assert [row[3] for row in missing(result("unexplained", reflex)).rows] == ["gain", "threshold"]


def test_the_sketch_says_where_a_rival_acts_that_acts_elsewhere() -> None:
    at = [SimpleNamespace(kind="elastic", joint=joint, channel=None) for joint in (2, 1)]
    torn: Any = SimpleNamespace(joint=2, channel=None, alternatives=at)
    assert rivals(torn) == ["elastic spring", "elastic spring in joint 1"]


def test_names_that_leave_the_gap_open_are_what_comes_nearest() -> None:
    """As where a slack tendon was called a spring over two joints: it closed 0.41 of the gap of the force."""
    # Under this verdict no effect has an interval.
    bare = {**DRY, "parameters": {"torque": DRY["parameters"]["torque"] | {"std": None, "interval": None}}}
    told = result("unexplained", bare, gap={"Fz_N": channel(2.6, 2.31, 1.41, 0.1)})
    assert headline(told) == (
        "Something is missing that no effect of the catalogue explains; nearest to it is Coulomb friction in joint 2 (elbow), which does not "
        "close the gap: on test trials, the contact force upward (Fz) is still off by 1.4 N RMS; repeats differ by 0.1 N."
    )
    assert heading(told) == "What comes nearest to what is missing"
    # Nine tenths of the gap closed, or a gap that hardly was there: the names stand.
    for before, after, verdict in ((2.31, 0.3, "unexplained"), (0.105, 0.3, "unexplained"), (2.31, 1.41, "explained")):
        told = result(verdict, DRY, gap={"Fz_N": channel(2.6, before, after, 0.1)})
        assert headline(told).startswith("Missing from the model is Coulomb friction in joint 2")
        assert heading(told) == "Missing from the model"


def test_what_is_left_beside_closed_gaps_is_called_small() -> None:
    """One sentence said both that something unexplained is missing and that the gap falls to the scatter between repeats."""
    told = headline(result("unexplained", DRY))
    assert ", and something too small to show on test trials, which no effect of the catalogue explains: with it, the gap of" in told


def test_what_the_result_calls_open_counts_with_its_place() -> None:
    listed = [{"channel": "q3_rad", "trial": "trials/fast_2.csv", "t_start": 3.14, "t_end": 4.6}]
    told = result("unexplained", DRY, open=listed)
    assert still_open(told) == ["q3_rad"]
    assert headline(told).endswith("(q3) is still off by 0.11° RMS (widest in trials/fast_2.csv, 3.1 to 4.6 s); repeats differ by 0.1°.")
    assert "and something that no effect of the catalogue explains" in headline(told)
    # What it calls closed is closed, whatever the ratio: its test knows what the floor is uncertain by.
    assert still_open(result("explained", DRY, gap={"Fz_N": channel(3.0, 2.4, 0.3, 0.15)}, open=[])) == []


def test_a_joint_that_friction_holds_is_no_riddle() -> None:
    """Its angle was said to lack something that the catalogue has no name for, above a warning that friction holds it."""
    hidden = [{"kind": kind, "joint": 3, "at_least": None, "price": 0.0} for kind in ("elastic", "viscous", "coulomb")]
    q3 = {"channel": "q3_rad", "trial": "trials/reach_5.csv", "start_s": 1.0, "end_s": 8.9}
    told = headline(result("unexplained", DRY, open=[q3], would_have_seen=hidden))
    assert (
        ", and the laws in joint 3 (wrist), which these movements cannot show because friction holds the joint nearly all the time: on test"
        in told
    )
    # A force is open beside it, or nothing holds the joint.
    for seen, opened in ((hidden, [q3, q3 | {"channel": "Fz_N"}]), ([], [q3])):
        assert "no effect of the catalogue explains" in headline(result("unexplained", DRY, open=opened, would_have_seen=seen))


def test_what_is_not_decided_is_said_to_be(monkeypatch: pytest.MonkeyPatch) -> None:
    rival = {"kind": "viscous", "joint": 1, "channel": None}
    torn = effect("coulomb", 1, ("torque", 0.14, 0.01, "N m"), decided=False, family="dry", alternatives=[rival])
    assert headline(result("explained", torn)).startswith(
        "Missing from the model is Coulomb friction or viscous damping in joint 1 (shoulder), which these movements cannot distinguish: with it, "
    )
    monkeypatch.setattr("armrs.report.gap.headline.family", lambda kind: "dry")
    one_family = headline(result("explained", {**torn, "alternatives": [{**rival, "kind": "stribeck"}]}))
    assert one_family.startswith(
        "Missing from the model is dry friction in joint 1 (shoulder) (Coulomb friction or Stribeck friction: not distinguished): with it, "
    )
    elsewhere = {**torn, "alternatives": [{**rival, "joint": 2}]}
    assert "Coulomb friction in joint 1 (shoulder) or viscous damping in joint 2 (elbow), which" in headline(result("explained", elsewhere))


def test_a_trial_stands_beside_what_is_not_decided_in_it() -> None:
    rival = {**effect("angle_offset", 1, ("offset", 0.02, 0.001, "rad")), "gain": 1.0}
    slip = {**effect("handle_slip", None, ("y", 2e-3, 1e-4, "m")), "decided": False, "trial": "trials/a_3.csv", "alternatives": [rival]}
    said = headline(result("explained", slip))
    assert said.startswith(
        "Missing from the model is handle slip or angle offset in joint 1 (shoulder) in trials/a_3.csv only, which these movements cannot distinguish: "
    )


def test_many_effects_are_named_by_kind(monkeypatch: pytest.MonkeyPatch) -> None:
    springs = [effect("elastic", j, ("stiffness", 1.0, 0.1, "N m/rad")) for j in (3, 1, 2)]
    said = headline(result("explained", *springs, DRY))
    assert said.startswith(
        "Missing from the model are 4 effects (elastic spring in joints 1, 2 and 3; Coulomb friction in joint 2): with them, "
    )
    monkeypatch.setattr("armrs.report.gap.headline.family", lambda kind: "dry")
    torn = {**DRY, "decided": False, "alternatives": [{"kind": "stribeck", "joint": 2, "channel": None}]}
    said = headline(result("explained", *springs, torn))
    assert "joints 1, 2 and 3; dry friction in joint 2 (Coulomb friction or Stribeck friction: not distinguished)): with them, " in said


def test_nothing_is_claimed_that_was_not_tested() -> None:
    assert headline(result("nothing_missing")).startswith("Nothing is missing that these data could show: on test trials")
    near, wider = ({"q2_rad": channel(0.003, last, last, 1e-3)} for last in (1.08e-3, 1.21e-3))
    assert headline(result("nothing_missing", gap=near)).endswith("no channel is off by more than about what repeats differ by.")
    assert headline(result("nothing_missing", gap=wider)).endswith("no channel is off by more than 1.3 times what repeats differ by.")
    assert "cannot be tested" in headline(result("nothing_missing", z=None))
    untested = {"q2_rad": dict.fromkeys(("before", "calibrated", "after", "floor"))}
    for kept in ({}, untested):
        assert headline(result("explained", DRY, gap=kept)).endswith("; there is no test trial to measure the gap on.")
        assert "test trials" not in headline(result("nothing_missing", gap=kept))
    assert headline(result("unexplained")).startswith("Something is missing that no effect of the catalogue explains: on test trials")


@pytest.mark.parametrize(
    ("kind", "joint", "marked"),
    [
        ("elastic", 3, [("joint", 2)]),
        ("biarticular", 2, [("joint", 0), ("joint", 1), ("across", 1)]),
        ("gravity_moment", 1, [("segment", 0)]),
        ("angle_offset", 2, [("joint", 1)]),
        ("gravity_tilt", None, [("frame", 0)]),
        ("shoulder_heave", None, [("base", 0)]),
        ("shoulder_motion", None, [("base", 0)]),
        ("backlash", None, [("hand", 0)]),
        ("force_bias", None, [("hand", 0)]),
    ],
)
def test_an_effect_is_drawn_where_it_acts(kind: str, joint: int | None, marked: list[tuple[str, int]]) -> None:
    assert marks(Missing(kind, joint, None, {}, 0.0, 1.0), catalogue()[kind]) == marked


def test_where_nothing_is_named_the_table_shows_what_the_headline_says() -> None:
    """The last fit moves the contact: the headline told 1.2 N of it, the table 1.0 N of the fit before."""
    told = result("unexplained", gap={"Fy_N": channel(1.8, 1.0, 1.2, 0.084)})
    assert "off by 1.2 N" in headline(told)
    table = gap(told)
    assert table.rows[0][table.head.index("calibrated")] == "1.2"


def test_no_more_than_all_of_a_gap_is_closed() -> None:
    """Both the gap that is left and what repeats differ by are estimates: the first may be the smaller one."""
    table = gap(result("explained", DRY, gap={"Fz_N": channel(3.0, 2.4, 0.10, 0.15)}))
    assert table.rows[0][table.head.index("gap closed")] == "100 %"
    assert ChannelGap(3.0, 2.4, 0.10, 0.15).closed == 1.0
    assert ChannelGap(3.0, 2.4, 1.275, 0.15).closed == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("change", "verdict"),
    [
        ({}, "explained"),
        ({"named": False}, "nothing_missing"),
        ({"is_open": True}, "unexplained"),
        ({"is_open": True, "named": False}, "unexplained"),
        ({"z": 5.99, "share": 1.0, "ratio": 9.0}, "explained"),
        ({"z": 5.99, "share": 1.0, "ratio": 9.0, "named": False}, "nothing_missing"),
        ({"z": 6.0, "share": 1.0, "ratio": 9.0}, "unexplained"),
        ({"z": 6.0, "share": 0.049, "ratio": 1.99}, "explained"),
        ({"z": 60.0, "share": 0.049, "ratio": 1.99}, "explained"),
        ({"z": 6.0, "share": 0.05, "ratio": 1.99}, "unexplained"),
        ({"z": 6.0, "share": 0.049, "ratio": 2.0}, "unexplained"),
        ({"z": 6.0, "share": 0.0, "ratio": 1.0, "named": False}, "unexplained"),
    ],
)
def test_the_rule_of_the_verdict(change: dict[str, Any], verdict: str) -> None:
    """Each limit from both sides: 6 standard deviations, 5 % that may be left where effects were named, twice the noise."""
    assert verdict_of(**({"named": True, "is_open": False, "z": 0.0, "ratio": 1.0, "share": 0.0} | change)) == verdict


def test_an_open_torque_is_told_with_its_unit() -> None:
    """`0.027 Nm` stood beside `N m` everywhere else."""
    told = result("unexplained", DRY, gap={"tau2_Nm": channel(0.5, 0.13, 0.027, 0.018)})
    assert any("off by 0.027 N m RMS; repeats" in line for line in left(told)) and "0.027 N m RMS; repeats" in headline(told)


def test_what_has_no_interval_has_no_columns_for_it() -> None:
    """Under two columns of dashes it was said that the intervals were widened."""
    bare = {**DRY, "share": 0.5, "parameters": {"torque": {"value": 0.161, "std": None, "interval": None, "unit": "N m"}}}
    table = missing(result("unexplained", bare))
    assert list(table.head) == ["effect", "at", "share", "parameter", "value", "unit"]
    assert list(table.rows[0]) == ["coulomb", 2, "50 %", "torque", "0.161", "N m"]
    assert intervals(result("unexplained", bare)).startswith("No intervals are given")
    sized = {**DRY, "share": 0.5, "parameters": DRY["parameters"]}
    assert "95 % interval" in missing(result("explained", sized)).head
    assert (
        intervals(result("explained", sized)) == "± is one standard deviation. Interval and ± hold if the structure of the model is right."
    )


def test_effects_stand_joint_by_joint_as_on_the_page_for_a_clinician() -> None:
    size = ("torque", 0.161, 0.006, "N m")
    more = {"share": 0.5, "summary": "dry friction", "formula": "R", "p_value": 0.0}
    listed = [effect("coulomb", joint, size, **more) for joint in (2, None, 1)]
    for one in listed:
        one["parameters"]["torque"]["interval"] = [0.149, 0.173]
    told = result("explained", *listed)
    assert [row[1] for row in missing(told).rows] == [1, 2, None]
    assert [line.split(":")[0] for line in named(told)] == [
        "Coulomb friction in joint 1 (shoulder)",
        "Coulomb friction in joint 2 (elbow)",
        "Coulomb friction",
    ]


def test_an_effect_with_two_sizes_came_nearest_once() -> None:
    """A compliance along y and along z stood in two equal rows."""
    asked = [("contact_compliance", None, 21.4, 23.9), ("contact_compliance", None, 21.4, 23.9), ("viscous", 1, 3.0, 18.0)]
    told = [dict(zip(("kind", "joint", "gain", "price"), row, strict=True)) | {"channel": None} for row in asked]
    assert nearest({"would_have_seen": told}).rows == [["contact_compliance", None, "21.4", "23.9"], ["viscous", 1, "3", "18"]]


def test_alternatives_are_compared_in_one_unit() -> None:
    """It was called a misfit, as was what is left in units of the floor."""
    rival = effect("viscous", 2, why="explains these movements nearly as well", worse=7.1)
    assert others(result("explained", {**DRY, "alternatives": [rival]})) == [
        "Instead of Coulomb friction in joint 2 it may be viscous damping in joint 2 (explains these movements nearly as well, by 7.1 units less)."
    ]
    far = effect("viscous", 2, why="explains these movements to within the possible error of the named law", worse=170.4)
    [line] = others(result("explained", {**DRY, "alternatives": [far]}))
    assert line.endswith(
        "it may be viscous damping in joint 2 (explains these movements to within the possible error of the named law, by 170 units less)."
    )
    # What is 13 standard deviations apart already cannot be distinguished only because a law may miss as much.
    asked = {"separating_movement": "lead the elbow alone", "separation": {"now": 13.0, "then": 40.0}}
    lines = others(result("explained", {**DRY, "alternatives": [{**far, **asked}]}))
    assert lines[1].endswith("40 standard deviations apart (now 13, which the error of the named law may cause).")
    assert "or by no more than the possible error of the named law: on these" in tie(result("explained", {**DRY, "alternatives": [far]}))
    assert "log-likelihood: on these" in tie(result("explained", {**DRY, "alternatives": [rival]}))
    rare = effect("stretch_reflex", 2, why="explains these movements better, but few joints have it", worse=-60.4)
    assert tie(result("explained", {**DRY, "alternatives": [rival, rare]})).endswith(
        "One that explains them better is not named, because few joints have it."
    )
    for worse, said in ((-729.0, "(why, by 729 units more)."), (-3.0, "(why)."), (0.05, "(why).")):
        other = effect("viscous", 2, why="why", worse=worse)
        [line] = others(result("explained", {**DRY, "alternatives": [other]}))
        assert line.endswith(said)


def test_a_page_has_angles_in_degrees_alone() -> None:
    """The headline told an offset in radians and the gap of the same joint in degrees."""
    offset = effect("angle_offset", 2, ("offset", 0.02, 0.001, "rad"), share=0.5)
    told = result("explained", offset)
    assert "offset 1.15° (95 % interval 1.03 to 1.26°)" in headline(told)
    assert [row[4:] for row in missing(told).rows] == [["1.146", "0.057", "1.031 … 1.261", "°"]]
    absorbed = {"name": "angle offset of joint 1", "value": 0.01, "promised": 0.005, "unit": "rad"}
    assert calibration({"calibration": [absorbed]}).rows == [["angle offset of joint 1", "+0.573", "± 0.286", "°", "beyond the prior"]]


def test_the_headline_names_effects_in_the_order_of_the_table() -> None:
    size = ("torque", 0.161, 0.006, "N m")
    assert headline(result("explained", effect("coulomb", 2, size), effect("coulomb", 1, size))).startswith(
        "Missing from the model are Coulomb friction in joint 1 (shoulder), torque 0.161 N m"
    )


def test_a_gap_beyond_a_hundred_has_no_exponent() -> None:
    assert amount("Fz_N", 123.0) == "120 N"


@pytest.mark.parametrize(("smoothing", "formula"), [(0.0, "R = torque · sgn(q̇)"), (0.01, "R = torque · tanh(q̇/smoothing)")])
def test_friction_that_sticks_has_the_sign_of_the_speed_in_its_formula(smoothing: float, formula: str) -> None:
    effect = {"kind": "coulomb", "parameters": {"torque": {"value": 0.2}, "smoothing": {"value": smoothing}}}
    assert formula_of(effect) == formula


def test_a_first_look_says_how_many_effects_improve_the_fit(capsys: pytest.CaptureFixture[str]) -> None:
    """It was `2 effects may be missing, and several of them may be one`."""
    asked = [
        {"kind": kind, "joint": 2, "channel": None, "gain": gain, "price": 20.0, "parameters": {"size": 0.1}, "unit": "N m"}
        for kind, gain in (("coulomb", 90.0), ("viscous", 60.0), ("elastic", 3.0))
    ]
    quick(result("explained", suspects=asked, data={"joints": ["shoulder", "elbow"], "name": "arm"}))
    said = "arm, a first look: 2 effects each improve the fit; several may have one cause; Coulomb friction in joint 2 explains most"
    assert capsys.readouterr().out.startswith(said)


def test_a_rival_that_is_closer_to_the_data_is_not_called_a_tie() -> None:
    rival = {"kind": "cubic_elastic", "joint": 2, "channel": None, "worse": -2177.0}
    effect = {"kind": "elastic", "joint": 2, "channel": None, "decided": False, "alternatives": [rival]}
    said = undecided(effect)
    assert said == "elastic spring in joint 2 (rarer, but closer to the data: cubic spring)"
    assert "distinguish" not in tie({"effects": [effect]})
    rival["worse"] = 3.0
    assert "not distinguished" in undecided(effect)
    assert "cannot be distinguished" in tie({"effects": [effect]})
