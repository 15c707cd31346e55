"""The gap workflow on synthetic sessions: named, nothing missing, refused."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import armrs
from armrs import cli
from armrs._armrs import SimulatedTrial
from armrs.errors import BadInput
from armrs.io.dataset import Dataset, write_dataset
from armrs.model import AddedMass
from armrs.report import plotting
from armrs.report.gap import figures
from armrs.report.gap.result_files import gap_data, write_gap
from armrs.workflows.gap import calibrate, compare
from armrs.workflows.gap.data_checks import _still_joints, examine, refuse_mislabelled
from armrs.workflows.gap.effect_curves import effect_curve
from browser import opened
from gap_sessions import session, session_of_three_joints
from markup import unescaped


def look(report: Path, *, figures: int, headings: set[str]) -> str:
    """Open a report, see that it has these headings and figures and that each shows something; return its verdict."""
    with opened(report) as seen:
        assert headings <= set(seen.page.locator("h2").all_inner_texts())
        images = seen.page.locator("figure img")
        assert images.count() == figures
        assert all(width > 300 for width in images.evaluate_all("all => all.map(i => i.complete ? i.naturalWidth : 0)"))
        # Nothing sticks out of the page, on a narrow screen as well.
        for width in (1280, 400):
            seen.page.set_viewport_size({"width": width, "height": 900})
            assert seen.page.evaluate("document.documentElement.scrollWidth") <= width
        return str(seen.page.inner_text(".verdict"))


@pytest.fixture(scope="module")
def viscous() -> armrs.GapFound:
    return armrs.find_gap(session(armrs.Effect("viscous", 2, parameters={"viscosity": 0.4})), threads=2)


def test_the_report_of_a_named_effect(viscous: armrs.GapFound, tmp_path: Path) -> None:
    written = write_gap(viscous, gap_data(viscous, "armrs gap hidden -o out"), tmp_path)
    told = sum(a.separation is not None for a in viscous.effects[0].alternatives)
    separating = [f"separating-{k + 1}.toml" for k in range(told)]
    assert [p.name for p in written if p.suffix != ".png"] == ["amended.toml", *separating, "live.json", "gap.json", "report.html"]
    verdict = look(
        written[-1],
        figures=5,
        headings={
            "Missing from the model",
            "Each effect by itself",
            "The gap on test trials",
            "Where model and data disagree",
            "Evidence",
            "What was ruled out",
            "How to repeat",
        },
    )
    assert verdict.startswith("Missing from the model is viscous damping in joint 2 (elbow), viscosity 0.402 N m s/rad (95 % interval ")
    assert verdict.count(". ") == 0 and "on test trials falls from" in verdict
    assert unescaped(tmp_path / "gap.json", tmp_path) == []


def test_a_joint_may_have_any_name(viscous: armrs.GapFound, tmp_path: Path) -> None:
    data, name = viscous.dataset, r"elbow $\frac{1}$"
    renamed = data.model.replace(joints=(data.model.joints[0], data.model.joints[1].replace(name=name)))
    result = dataclasses.replace(viscous, dataset=data.replace(model=renamed))
    written = write_gap(result, gap_data(result), tmp_path)
    assert sum(path.suffix == ".png" for path in written) == 5
    assert name in written[-1].read_text(encoding="utf-8")


def test_of_each_round_one_contender_is_blue(viscous: armrs.GapFound) -> None:
    """None was: the rungs of a result are made anew each time they are asked for."""
    from matplotlib.colors import to_hex

    axes = figures.gap(viscous)["search_trace"]().figure.axes[0]
    colours = [to_hex(bar.get_facecolor()) for bar in axes.patches]
    assert colours.count(plotting.BLUE.lower()) == len(viscous.search_trace) and len(colours) == sum(
        len(r.tried) for r in viscous.search_trace
    )


def test_what_one_effect_does_is_that_of_its_law(viscous: armrs.GapFound) -> None:
    seen = effect_curve(viscous, viscous.effects[0])
    value = viscous.effects[0].parameters["viscosity"]
    assert seen.against == "speed"
    assert seen.torque is not None
    fast = np.abs(seen.x) > 0.1
    # A cell's mean torque is that at its mean speed; its middle may be half a cell beside.
    assert np.abs(seen.torque / seen.x - value.value)[fast].max() < 0.1 * value.value
    # What was measured beyond the rest of the model follows the law without being asked to.
    assert np.corrcoef(seen.data[np.isfinite(seen.data)], seen.torque[np.isfinite(seen.data)])[0, 1] > 0.95
    assert seen.changed is not None
    assert np.abs(seen.changed[:, 2:]).max() > 0.5
    # It shows most where the arm is fast.
    assert seen.trial == "fast_4.csv"


def test_a_hidden_viscosity_is_named_with_its_value_and_closes_the_gap(viscous: armrs.GapFound) -> None:
    found = viscous
    assert [(e.kind, e.joint) for e in found.effects] == [("viscous", 2)]
    value = found.effects[0].parameters["viscosity"]
    assert value.std is not None
    assert abs(value.value - 0.4) < 4 * value.std < 0.1
    assert found.verdict == "explained"
    for channel in ("Fy_N", "Fz_N"):
        gap = found.gap[channel]
        assert gap.after is not None and gap.calibrated is not None and gap.floor is not None
        assert gap.after < 1.2 * gap.floor
    assert found.gap["Fz_N"].before > 1.5 * found.gap["Fz_N"].floor  # type: ignore[operator]
    assert found.effects[0].p_value < 1e-6
    assert found.model.effects[-1].kind == "viscous"


def test_nothing_is_missing_where_nothing_is_hidden(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_dataset(session(), tmp_path / "data")
    assert cli.main(["gap", str(tmp_path / "data"), "-o", str(tmp_path / "out")]) == 0
    assert "Nothing is missing" in capsys.readouterr().out
    result = json.loads((tmp_path / "out" / "gap.json").read_text(encoding="utf-8"))
    assert (result["verdict"], result["effects"]) == ("nothing_missing", [])
    limits = {(w["kind"], w["joint"]): w["at_least"] for w in result["would_have_seen"]}
    assert 0 < limits["viscous", 2] < 0.4
    assert armrs.load_model(tmp_path / "out" / "amended.toml").n_joints == 2
    assert len(result["made_by"]["input_sha256"]) == 64
    verdict = look(tmp_path / "out" / "report.html", figures=3, headings={"The gap on test trials", "What was ruled out"})
    assert verdict.startswith("Nothing is missing")


@pytest.mark.long
def test_dry_friction_of_a_real_rig_is_named_and_nothing_is_called_noise_without_repeats(
    data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["gap", str(data / "dfki_a0"), "--json", str(tmp_path / "gap.json")]) == 0
    result = json.loads((tmp_path / "gap.json").read_text(encoding="utf-8"))
    assert {(e["kind"] in ("coulomb", "load_friction"), e["joint"]) for e in result["effects"]} == {(True, 1), (True, 2)}
    out = capsys.readouterr().out
    assert "Without repeats of a movement, it cannot be tested whether the remaining difference is noise." in out
    assert "is noise." not in out.replace("whether the remaining difference is noise.", "")


def changed(data: Dataset, **columns: object) -> Dataset:
    """Return a data set with columns of every trial changed by functions."""
    trials = tuple(
        dataclasses.replace(t, **{name: change(getattr(t, name)) for name, change in columns.items()})  # type: ignore[operator]
        for t in data.trials
    )
    return data.replace(trials=trials)


@pytest.mark.parametrize(
    ("columns", "word"),
    [
        ({"force_on_arm": lambda f: -f}, "force_on"),
        ({"force_on_arm": lambda f: 1000.0 * f}, "mN"),
        ({"force_on_arm": lambda f: f[:, ::-1]}, "swapped"),
        ({"force_on_arm": lambda f: f * [1.0, -1.0]}, "column Fz: found .*reversed axis"),
        ({"q": lambda q: q * [57.29578, 57.29578]}, "degrees"),
        ({"force_on_arm": lambda f: f * [1.0, 0.0]}, "in every sample"),
    ],
)
def test_what_only_a_label_can_explain_is_refused(columns: dict[str, object], word: str) -> None:
    with pytest.raises(BadInput, match=word):
        armrs.find_gap(changed(session(), **columns))


@pytest.mark.parametrize(
    ("change", "word"),
    [(lambda f: -f, r"_1\.csv: force_on: found"), (lambda f: 1e-3 * f, r"_1\.csv: columns Fy, Fz: found all of .*kN labelled as N")],
)
def test_one_trial_with_another_label_is_refused(change: Callable[[np.ndarray], np.ndarray], word: str) -> None:
    data = session()
    first, *rest = data.trials
    other = data.replace(trials=(dataclasses.replace(first, force_on_arm=change(first.force_on_arm)), *rest))
    for function in (armrs.find_gap, compare):
        with pytest.raises(BadInput, match=word):
            function(other)


def test_a_movement_that_all_repeats_show_against_the_model_is_not_a_wrong_label() -> None:
    data = session()

    def plays(measured: Callable[[armrs.Trial], float], given: Callable[[armrs.Trial], float]) -> list[SimulatedTrial]:
        sides = [
            (np.column_stack((t.q, measured(t) * t.force_on_arm)), np.column_stack((t.q, given(t) * t.force_on_arm))) for t in data.trials
        ]
        return [
            SimulatedTrial(t.file, 0, False, t.rate, np.repeat(t.valid[:, None], m.shape[1], axis=1), m, {"given": g}, {})
            for t, (m, g) in zip(data.trials, sides, strict=True)
        ]

    first = data.trials[0]
    refuse_mislabelled(data, True, plays(lambda t: 1.0, lambda t: -1.0 if t.configuration == first.configuration else 1.0))
    with pytest.raises(BadInput, match=rf"{first.file}: force_on"):
        refuse_mislabelled(data, True, plays(lambda t: -1.0 if t is first else 1.0, lambda t: 1.0))


def copied(data: Dataset, into: str, source: str, *, length: int | None = None, **columns: Callable[[np.ndarray], np.ndarray]) -> Dataset:
    """Return a data set in which a trial has the samples of another, the first of them, with columns changed by functions."""
    by_name = {t.file: t for t in data.trials}
    taken = {name: getattr(by_name[source], name)[:length].copy() for name in ("t", "q", "force_on_arm", "robot_q")}
    taken |= {name: change(taken[name]) for name, change in columns.items()}
    unknown = np.empty(0, dtype=bool)
    copy = dataclasses.replace(by_name[into], valid=unknown, active=unknown, **taken)
    return data.replace(trials=tuple(copy if t.file == into else t for t in data.trials))


NO_REPEAT, NO_TEST = "a copy is no repeat", "a test on a copy of what was fitted proves nothing"


@pytest.mark.parametrize(
    ("into", "source", "length", "why"),
    [
        ("fast_3.csv", "fast_1.csv", None, NO_REPEAT),
        ("fast_3.csv", "fast_1.csv", 100, NO_REPEAT),
        ("fast_4.csv", "slow_4.csv", None, NO_REPEAT),
        ("fast_4.csv", "fast_2.csv", None, NO_TEST),
        ("slow_4.csv", "fast_2.csv", None, NO_TEST),
    ],
)
def test_a_copied_trial_is_refused(into: str, source: str, length: int | None, why: str) -> None:
    data = copied(session(), into, source, length=length)
    # A test trial is blamed wherever it stands; of equals, the later one.
    for trials in [data.trials, data.trials[::-1]] if why == NO_TEST else [data.trials]:
        for function in (armrs.find_gap, calibrate, compare):
            with pytest.raises(BadInput) as refused:
                function(data.replace(trials=trials))
            start = f"{into}: samples: found those of {source}, one by one, allowed a measurement of its own"
            assert str(refused.value) == f"{start} ({why}; simulated repeats need noise)"


def test_masses_worn_in_some_configurations_are_refused() -> None:
    data = session().replace(added=(AddedMass(2, 0.2, 0.1, ("slow",)),))
    for function in (armrs.find_gap, calibrate, compare):
        with pytest.raises(BadInput, match=r"^\[\[added\]\]: found masses worn in some configurations"):
            function(data)


def test_a_copied_file_ends_with_status_2_and_nothing_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_dataset(copied(session(), "fast_2.csv", "fast_1.csv"), tmp_path / "data")
    assert cli.main(["gap", str(tmp_path / "data"), "-o", str(tmp_path / "out")]) == 2
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert "fast_2.csv: samples: found those of fast_1.csv" in told
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("column", ["q", "force_on_arm"])
def test_angles_or_forces_alone_that_are_the_same_are_no_copy(column: str) -> None:
    def last(values: np.ndarray) -> np.ndarray:
        values[-1] += 1e-4
        return values

    assert examine(copied(session(), "fast_2.csv", "fast_1.csv", **{column: last}), led=True) == []


@pytest.mark.parametrize("moves", [False, True])
def test_a_swing_without_torque_is_a_copy_where_it_moves_alike(moves: bool) -> None:
    t = np.arange(200) / 100.0
    swings = [np.sin(3.0 * t), moves * np.cos(3.0 * t), moves * np.cos(3.0 * t)]
    pivot = armrs.Model((armrs.Segment("link", 0.3, 0.15, 0.15, 1e-4),), (armrs.Joint("pivot"),))
    trials = [
        armrs.Trial(f"swing_{k}.csv", "swing", k, "fit" if k < 3 else "test", t, q[:, None], tau=np.zeros((200, 1)))
        for k, q in enumerate(swings, start=1)
    ]
    data = Dataset("swings", pivot, tuple(trials))
    if not moves:
        assert examine(data, led=False) == []
        return
    with pytest.raises(BadInput, match=r"^swing_3\.csv: samples: found those of swing_2\.csv"):
        examine(data, led=False)


def test_what_a_trial_without_robot_angles_costs_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data = session()
    first, second, *rest = data.trials
    bare = data.replace(trials=(first, dataclasses.replace(second, robot_q=None), *rest))
    write_dataset(bare, tmp_path / "data")
    assert cli.main(["gap", str(tmp_path / "data"), "--quick", "--json", str(tmp_path / "gap.json")]) == 0
    [line] = json.loads((tmp_path / "gap.json").read_text(encoding="utf-8"))["warnings"]
    assert line.startswith(
        "no robot angles in slow_2.csv: so all trials are compared by joint torques in measured motion; leave such trials out, "
    )
    assert line in capsys.readouterr().err
    none = data.replace(trials=tuple(dataclasses.replace(t, robot_q=None) for t in data.trials))
    [line] = examine(none, led=False)
    assert line.startswith("no robot angles (qr1, qr2): so all trials are compared by joint torques in measured motion")
    assert examine(data, led=True) == []


def test_friction_that_shows_near_rest_alone_is_found_where_rest_is_left_out() -> None:
    """Of three joints rest is left out once one of them is dry; with it, Stribeck's law was lost again."""
    hidden = armrs.Effect("stribeck", 1, parameters={"torque": 0.1, "speed": 0.06})
    [effect] = armrs.find_gap(session_of_three_joints(hidden), threads=2).effects
    assert effect.kind == "stribeck" and effect.joint == 1
    assert effect.parameters["torque"].value == pytest.approx(0.1, rel=0.2)


def test_without_repeats_a_movement_that_separates_rivals_is_found() -> None:
    """The samples of a planned movement weigh the same, however those of the trials that were made weigh."""
    data = session(armrs.Effect("coulomb", 2, parameters={"torque": 0.3}))
    at_one_speed = tuple(t for t in data.trials if t.configuration == "slow" and t.repeat in (1, 4))
    [effect] = armrs.find_gap(data.replace(trials=at_one_speed), threads=2).effects
    assert effect.kind == "coulomb" and effect.joint == 2
    assert any(a.separating_movement for a in effect.alternatives)


def test_a_trial_that_begins_while_the_robot_moves_is_warned_of() -> None:
    data = session()
    assert not [line for line in examine(data, led=True) if "when these begin" in line]
    late = data.trials[4]
    speed = np.abs(np.gradient(late.robot_q, late.t, axis=0)).max(axis=1)
    first = int(np.argmax(speed > 0.3))
    columns = {name: getattr(late, name)[first:] for name in ("t", "q", "force_on_arm", "robot_q")}
    cut = dataclasses.replace(late, valid=np.empty(0, dtype=bool), **columns)
    changed_data = data.replace(trials=tuple(cut if t is late else t for t in data.trials))
    (line,) = [line for line in examine(changed_data, led=True) if "when these begin" in line]
    assert late.file in line and line.count(" rad/s") == 1


def test_a_joint_that_hardly_moves_is_warned_of() -> None:
    """By its sensor's noise, and by one trial in which the sensor slips."""
    data = session()
    trials = []
    for k, trial in enumerate(data.fit_trials):
        q = trial.q.copy()
        q[:, 1] = 0.5 + 2e-3 * np.sin(np.arange(len(q))) + (0.05 * (np.arange(len(q)) > 40) if k == 0 else 0.0)
        trials.append(dataclasses.replace(trial, q=q))
    (line,) = _still_joints(data.replace(trials=tuple(trials)), led=True)
    assert line.startswith("joint 2 moves by ")
    assert _still_joints(data, led=True) == []


def test_a_gap_that_keeps_repeats_from_being_compared_is_warned_of() -> None:
    data = session()
    first, *rest = data.trials
    lost = np.arange(len(first.t)) // 40 != 3
    assert examine(data, led=True) == []
    [line] = examine(data.replace(trials=(dataclasses.replace(first, valid=lost), *rest)), led=True)
    assert line.startswith(f"samples are missing in {first.file}: repeats of 'slow' are not compared")


@pytest.mark.parametrize("share", [0.6, 0.9])
def test_a_cut_off_channel_is_warned_of(share: float) -> None:
    data = session()
    most = share * max(np.abs(t.force_on_arm).max() for t in data.trials if t.force_on_arm is not None)
    cut = changed(data, force_on_arm=lambda f: np.clip(f, -most, most))
    assert any("saturated" in line for line in examine(cut, True))


def test_a_coarse_channel_at_rest_is_not_called_saturated() -> None:
    assert examine(changed(session(), force_on_arm=lambda f: 0.1 * np.round(f / 0.1)), True) == []


def test_where_the_arm_cannot_be_followed_the_torques_of_its_measured_motion_are_compared(monkeypatch: pytest.MonkeyPatch) -> None:
    """The first search is refused as that of a free wrist is; the second is the real one."""
    from armrs import _armrs
    from armrs.errors import SimulationError

    real, asked = _armrs.find_gap, []

    def refused_once(*given: object) -> object:
        asked.append(given)
        if len(asked) == 1:
            raise SimulationError("angle beside the simulated run is inf")
        return real(*given)

    monkeypatch.setattr(_armrs, "find_gap", refused_once)
    hidden = armrs.Effect("coulomb", 2, parameters={"torque": 0.5})
    found = armrs.find_gap(session(hidden), threads=2, separate=False)
    assert [given[2].led for given in asked] == [True, False]
    assert set(found.gap) >= {"tau1_Nm", "tau2_Nm"}
    assert "joint torques in measured motion are compared" in found.warnings[0]
    # Without the closed chain the load of a joint is not known well enough to tell Coulomb's law from one that grows with the load.
    assert [(e.family, e.joint) for e in found.effects] == [("dry", 2)]
