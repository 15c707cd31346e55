"""The stages of the gap workflow by themselves, movements that separate, and effects of one's own."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.colors import to_hex

import armrs
from armrs import _armrs, cli
from armrs._armrs import Value
from armrs.catalogue import catalogue
from armrs.errors import BadInput
from armrs.io.dataset import Dataset, write_dataset
from armrs.report import plotting
from armrs.report.gap import animation, figures
from armrs.report.gap.result_files import gap_data, write_gap
from armrs.workflows.gap import Alternative, calibrate, compare, confirm, detectable, discriminating_movements, separate
from gap_sessions import model, session

VISCOUS = armrs.Effect("viscous", 2, parameters={"viscosity": 0.4})


@pytest.fixture(scope="module")
def found() -> armrs.GapFound:
    return armrs.find_gap(session(VISCOUS), threads=2)


def test_nothing_is_fitted_by_a_comparison() -> None:
    data = session(VISCOUS)
    seen = compare(data)
    # Joint 2 resists its motion both ways, and the model does not.
    signs = {p.condition: np.sign(p.mean) for p in seen.where if p.joint == 2}
    assert (signs["dq2 > 0"], signs["dq2 < 0"]) == (1.0, -1.0)
    truth = compare(data, data.model.replace(effects=(VISCOUS,)))
    # Noise of the force sensor is 0.1 N.
    assert 0.09 < truth.gap["Fz_N"] < 0.12 < seen.gap["Fz_N"]


def test_calibration_and_a_first_look(found: armrs.GapFound) -> None:
    first = calibrate(found.dataset, threads=2)
    likeliest = first.suspects[0]
    assert (likeliest.kind, likeliest.joint) == ("viscous", 2)
    assert likeliest.gain > 10 * likeliest.price
    # To first order, from where the segments have taken up part of it.
    assert 0.2 < likeliest.parameters["viscosity"] < 0.6
    for name, gap in first.gap.items():
        assert gap.after is None
        assert gap.before == pytest.approx(found.gap[name].before, rel=1e-12)
        assert gap.calibrated == pytest.approx(found.gap[name].calibrated, rel=1e-3)


def test_a_tolerance_is_one_standard_deviation_of_what_is_refitted(found: armrs.GapFound) -> None:
    """As for `identify`: a result states twice that beside each value."""
    tolerance = found.dataset.tolerance
    stated = {a.name: a.promised for a in found.absorbed}
    expected = {
        "angle offset of joint 1": tolerance.angle_offset,
        "force bias of Fy": tolerance.force_bias_N,
        "force gain of Fz": tolerance.force_gain,
        "time delay": tolerance.time_delay_s,
        "place of the robot, y": tolerance.handle_placement_m,
    }
    assert {name: stated[name] for name in expected} == pytest.approx({name: 2.0 * sd for name, sd in expected.items()})


def test_the_stages_draw_themselves(found: armrs.GapFound, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(mpl.rcParams, "backend", "agg")
    data = found.dataset
    seen = compare(data)
    axes = seen.plot()
    assert [ax.get_title(loc="left") for ax in axes[: data.model.n_joints]] == [f"joint {j}, model as given" for j in (1, 2)]
    first = calibrate(data, threads=2)
    (ax,) = first.plot()
    widths = [bar.get_width() for bar in ax.patches]
    assert widths == sorted(widths, reverse=True) and widths[0] == pytest.approx(max(s.gain / s.price for s in first.suspects))
    with pytest.raises(armrs.BadInput, match="plot: found no fit trial"):
        dataclasses.replace(seen, discrepancies=()).plot()


def test_a_result_is_confirmed_on_its_own_test_trials_as_it_was_measured(found: armrs.GapFound) -> None:
    for name, gap in confirm(found).items():
        for step in ("before", "calibrated", "after", "floor"):
            # The handle is placed anew in every trial, from a start that is rounded.
            assert getattr(gap, step) == pytest.approx(getattr(found.gap[name], step), rel=1e-8), (name, step)


def led(
    contact: armrs.Contact,
    effects: Sequence[armrs.Effect] = (),
    *,
    phases: Sequence[float] = (0.0,) * 4,
    moved: float = 0.0,
    shape: str = "smooth",
) -> Dataset:
    """Return a session that the rapier engine makes, with a contact that the model does not know, a tremor whose phase each trial
    has to itself, and a handle that is held elsewhere along the forearm in each trial."""
    movement = armrs.Movement(
        np.radians([[-60, 50], [-30, 80]] * 5), speed=0.9, acceleration=12.0 if shape == "trapezoid" else 4.0, shape=shape
    )
    sensors = armrs.Sensors(angle=armrs.Channel(5e-4), force=armrs.Channel(0.1))
    trials = []
    for repeat, phase in enumerate(phases, start=1):
        own = [e.replace(parameters={**e.parameters, "phase": phase}) if e.kind == "tremor" else e for e in effects]
        upper, fore = model().segments
        held = fore.replace(length=fore.length + moved * (-1) ** repeat)
        true = model(*own).replace(contact=contact, segments=(upper, held))
        read = armrs.simulate(true, movement, engine="rapier", rate=50.0, sensors=sensors, seeds=[repeat]).readings[0]
        columns = {name: getattr(read, name) for name in ("q", "force_on_arm", "robot_q")}
        role = "test" if repeat == len(phases) else "fit"
        trials.append(armrs.Trial(file=f"led_{repeat}.csv", configuration="led", repeat=repeat, role=role, t=read.time, **columns))
    return Dataset("led", model(), tuple(trials), force_on="arm", synthetic=True)


@pytest.mark.parametrize("amplitude", [0.0, 0.15])
def test_the_contact_is_read_off_the_ringing_of_the_arm(amplitude: float) -> None:
    # Also of one that trembles, which is no ringing.
    tremor = armrs.Effect("tremor", 2, parameters={"amplitude": amplitude, "frequency": 6.3})
    data = led(armrs.Contact((1e4, 1e4), (32.0, 32.0)), [tremor], phases=(0.3, 2.2, 4.4, 5.5), shape="trapezoid")
    first = calibrate(data, threads=2)
    absorbed = {a.name: a.value for a in first.absorbed}
    for axis in "yz":
        # 25 N s/m were believed.
        assert absorbed[f"damping of the contact, {axis}"] == pytest.approx(32.0 / 25.0 - 1.0, abs=0.03)


def test_where_the_handle_is_held_is_each_trials_own() -> None:
    gap = calibrate(led(model().contact, moved=4e-4), threads=2).gap
    for name in ("q1_rad", "q2_rad"):
        channel = gap[name]
        assert channel.calibrated is not None
        # The noise alone; 0.4 mm turn these joints by more than a milliradian.
        assert channel.before > 1.2e-3 and channel.calibrated < 6e-4, name


def test_a_handle_beside_the_hand_turns_the_wrist() -> None:
    parts = (
        armrs.Segment("upper arm", 0.32, 2.0, 0.15, 0.02),
        armrs.Segment("forearm", 0.28, 1.3, 0.13, 0.012),
        armrs.Segment("hand", 0.09, 0.5, 0.05, 0.001),
    )
    joints = tuple(armrs.Joint(name, viscosity=0.1) for name in ("shoulder", "elbow", "wrist"))
    given = model().replace(segments=parts, joints=joints, effects=[armrs.Effect("elastic", 3, parameters={"stiffness": 0.6})])
    movement = armrs.Movement(np.radians([[-60, 50, 0], [-30, 80, 0], [-60, 50, 0]]), speed=0.5, acceleration=2.0, shape="smooth")
    sensors = armrs.Sensors(angle=armrs.Channel(1e-4), force=armrs.Channel(0.05))
    trials = []
    for repeat in range(1, 5):
        held = parts[2].replace(length=parts[2].length + 4e-4 * (-1) ** repeat)
        true = given.replace(segments=(*parts[:2], held))
        read = armrs.simulate(true, movement, engine="rapier", rate=50.0, sensors=sensors, seeds=[repeat]).readings[0]
        columns = {name: getattr(read, name) for name in ("q", "force_on_arm", "robot_q")}
        role = "test" if repeat == 4 else "fit"
        trials.append(armrs.Trial(file=f"led_{repeat}.csv", configuration="led", repeat=repeat, role=role, t=read.time, **columns))
    wrist = calibrate(Dataset("led", given, tuple(trials), force_on="arm", synthetic=True), threads=2).gap["q3_rad"]
    assert wrist.calibrated is not None
    # The force on a lever of 0.4 mm turns the wrist by milliradians; what is left is noise.
    assert wrist.before > 1e-3 and wrist.calibrated < 2e-4


def test_a_slow_ripple_below_the_noise_is_seen_in_all_trials_together() -> None:
    ripple = armrs.Effect("robot_ripple", parameters={"y": 8e-5, "z": -4e-5, "frequency": 1.7, "phase": 0.7})
    result = armrs.find_gap(session(ripple), threads=2, separate=False)
    assert [e.kind for e in result.effects] == ["robot_ripple"]
    values = result.effects[0].parameters
    assert values["frequency"].value == pytest.approx(1.7, abs=0.02)
    # A tenth of the noise of the angles.
    assert values["y"].value == pytest.approx(8e-5, abs=2.5e-5)


@pytest.mark.parametrize(
    ("engine", "kind", "joint", "parameters"),
    [
        # A muscle may tremble slowly, or too fast for the band that is compared.
        ("rapier", "tremor", 2, {"amplitude": 0.08, "frequency": 1.3, "phase": 0.7}),
        ("rapier", "tremor", 1, {"amplitude": 0.15, "frequency": 6.1, "phase": 0.7}),
        # The rapier engine cannot.
        ("native", "shoulder_heave", None, {"y": 1e-3, "z": 3e-3, "frequency": 0.31, "phase": 0.7}),
    ],
)
def test_what_swings_with_the_same_phase_in_every_trial_is_seen(
    engine: str, kind: str, joint: int | None, parameters: dict[str, float]
) -> None:
    result = armrs.find_gap(session(armrs.Effect(kind, joint, parameters=parameters), engine=engine), threads=2, separate=False)
    assert [(e.kind, e.joint) for e in result.effects] == [(kind, joint)]
    assert result.verdict == "explained"
    found = {name: value.value for name, value in result.effects[0].parameters.items()}

    def turned(wave: dict[str, float]) -> float:
        # In the middle of the trials: at their start a phase is as uncertain as the frequency makes it.
        return 2.0 * np.pi * wave["frequency"] * 2.0 + wave["phase"]

    assert np.cos(turned(found) - turned(parameters)) > 0.99
    for name, value in parameters.items():
        assert name == "phase" or found[name] == pytest.approx(value, rel=0.1), name
    # The page switches it off, whether it acts in a joint or at the base.
    series = animation.moving(result).series
    assert series is not None
    for panel in series["panels"]:
        line = {line["name"].partition(" in joint")[0]: np.array(line["values"], dtype=float) for line in panel["lines"]}
        assert np.nanstd(line[f"without {kind.replace('_', ' ')}"] - line["with the named effects"]) > 0.0


def test_a_slow_swing_is_seen_beside_a_fast_one() -> None:
    """Once the tremor was set apart, nobody asked for what swings slowly; both begin alike in every trial."""
    tremor = armrs.Effect("tremor", 1, parameters={"amplitude": 0.15, "frequency": 6.1, "phase": 0.7})
    heave = armrs.Effect("shoulder_heave", parameters={"y": -3e-3, "z": 9e-3, "frequency": 0.31, "phase": 0.7})
    result = armrs.find_gap(session(tremor, heave, engine="native"), threads=2, separate=False)
    assert {(e.kind, e.joint) for e in result.effects} == {("tremor", 1), ("shoulder_heave", None)}
    assert result.verdict == "explained"


def test_a_rhythm_that_a_strong_effect_hides_is_seen_once_that_is_named() -> None:
    spring = armrs.Effect("elastic", 1, parameters={"stiffness": 4.0, "rest": -0.3})
    tremor = armrs.Effect("tremor", 2, parameters={"amplitude": 0.1, "frequency": 4.4})
    result = armrs.find_gap(led(model().contact, [spring, tremor], phases=(0.3, 2.2, 4.4, 5.5)), threads=2, separate=False)
    assert {(e.kind, e.joint) for e in result.effects} == {("elastic", 1), ("tremor", 2)}


def test_an_interrupt_ends_a_search_and_a_failing_display_does_not() -> None:
    data = session()

    def interrupted(what: str, share: float) -> None:
        raise KeyboardInterrupt

    def broken(what: str, share: float) -> None:
        raise ValueError(what)

    with pytest.raises(KeyboardInterrupt):
        armrs.find_gap(data, threads=2, progress=interrupted)
    assert armrs.find_gap(data, threads=2, separate=False, progress=broken).verdict == "nothing_missing"


@pytest.mark.parametrize("frequency", [2.5, 6.3])
def test_a_rhythm_has_its_own_phase_in_every_trial(frequency: float) -> None:
    tremor = armrs.Effect("tremor", 2, parameters={"amplitude": 0.15, "frequency": frequency})
    data = led(model().contact, [tremor], phases=(0.3, 2.2, 4.4, 5.5))
    result = armrs.find_gap(data, threads=2)
    assert [(e.kind, e.joint) for e in result.effects] == [("tremor", 2)]
    amplitude = result.effects[0].parameters["amplitude"]
    assert amplitude.std is not None and amplitude.std < 0.005
    assert amplitude.value == pytest.approx(0.15, abs=3.0 * amplitude.std)
    # No other trial could be foretold with the phase of one.
    assert result.model.effects == ()
    for name in ("Fy_N", "Fz_N"):
        gap = result.gap[name]
        assert gap.calibrated is not None and gap.after is not None and gap.floor is not None
        assert gap.calibrated > 3.0 * gap.floor
        # One test trial: the floor itself is known to some percent.
        assert gap.floor_std is not None and gap.floor_std < 0.1 * gap.floor
        assert gap.after - gap.floor < 0.1 * (gap.calibrated - gap.floor) + gap.floor_std, (name, gap)
    assert confirm(result)["Fy_N"].after == pytest.approx(result.gap["Fy_N"].after, rel=1e-9)


def test_an_interval_stays_within_what_the_kind_allows(found: armrs.GapFound) -> None:
    for effect in found.effects:
        limits = {p.name: (p.min, p.max) for p in catalogue()[effect.kind].parameters}
        for name, value in effect.parameters.items():
            low, high = limits[name]
            assert value.interval is None or low <= value.interval[0] <= value.value <= value.interval[1] <= high
    wide = Value.of(0.01, 0.08, "rad/s", (1e-4, 1.0))
    assert wide.interval == (1e-4, 0.01 + 1.96 * 0.08)
    assert Value.of(0.01, None, "rad/s", (1e-4, 1.0)).interval is None


def test_a_result_is_confirmed_on_another_day(found: armrs.GapFound) -> None:
    again = confirm(found, session(VISCOUS, seed=900))["Fy_N"]
    assert again.after is not None and again.calibrated is not None and again.before is not None and again.floor is not None
    assert again.after < 1.15 * again.floor < again.calibrated < again.before
    # Where nothing is missing, the amended model is the worse one.
    other = confirm(found, session(seed=900))["Fy_N"]
    assert other.after is not None and other.before is not None
    assert other.after > 5.0 * other.before


def test_maps_tell_what_was_visited_and_the_law_has_a_legend(found: armrs.GapFound) -> None:
    with plotting.style():
        drawn = {name: draw() for name, draw in figures.gap(found).items()}
    assert all(one.name == name for name, one in drawn.items())
    ax = drawn["maps"].figure.axes[0]
    visited, pale, clear = (np.ma.masked_invalid(mesh.get_array()) for mesh in ax.collections[:3])
    assert to_hex(ax.get_facecolor()) == plotting.FAINT.lower() and visited.mask.any()
    assert np.array_equal(~visited.mask, ~pale.mask | ~clear.mask) and set(visited.compressed()) == {0.0}
    worth = [line for line in drawn["summary"].figure.axes[1].lines if line.get_marker() == "o"]
    assert worth and not any(line.get_clip_on() for line in worth)
    law = next(one for name, one in drawn.items() if name.startswith("effect-1")).figure.axes[0]
    assert [text.get_text() for text in law.get_legend().get_texts()] == ["named effect", "measured"]


def test_a_movement_separates_two_laws_that_are_not_the_same(found: armrs.GapFound, tmp_path: Path) -> None:
    kinds = {"quadratic_drag": [0.3], "coulomb": [0.15, 0.01], "viscous": [found.effects[0].parameters["viscosity"].value]}
    alternatives = [
        Alternative(kind, 2, None, "", 1.0, 0.9, simulated=armrs.Effect(kind, 2, parameters=catalogue()[kind].values(values)), free=[0])
        for kind, values in kinds.items()
    ]
    rivals = found.result.replace(effects=[found.effects[0].replace(alternatives=alternatives)])
    told = separate(dataclasses.replace(found, result=rivals), threads=2)
    drag, dry, same = (a.separation for a in told.effects[0].alternatives)
    assert drag is not None and dry is not None and same is not None
    assert drag.then > drag.now + 5.0
    assert dry.then > dry.now + 5.0
    # By one unit of twice the log-likelihood they explain the data worse: that is one standard deviation, whatever was expected.
    assert drag.now <= 1.0 and dry.now <= 1.0
    # An effect is not apart from itself, on any movement.
    assert same.now < 0.1
    assert same.then < 0.1
    written = write_gap(told, gap_data(told), tmp_path)
    assert {p.name for p in written} >= {"separating-1.toml", "separating-2.toml"}
    movement = armrs.load_movement(tmp_path / "separating-1.toml", 2)
    assert np.allclose(np.degrees(movement.waypoints), drag.waypoints_deg)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "standard deviations apart" in page
    assert "no movement that was tried separates them clearly" in page


def test_the_named_effect_acts_once_where_movements_are_foretold(found: armrs.GapFound, monkeypatch: pytest.MonkeyPatch) -> None:
    """It acted twice: effects of a model were compared by identity, and those of two lists are never the same objects."""
    rigs: list[list[armrs.Effect]] = []
    real = _armrs.Rig

    def seen(model: armrs.Model, effects: list[armrs.Effect] | None = None) -> _armrs.Rig:
        rigs.append(list(effects or ()))
        return real(model, effects)

    rival = Alternative("coulomb", 2, None, "", 1.0, 0.9, simulated=armrs.Effect("coulomb", 2, parameters={"torque": 0.1}), free=[0])
    torn = found.result.replace(effects=[found.effects[0].replace(alternatives=[rival])])
    family = discriminating_movements._family(found)
    monkeypatch.setattr(discriminating_movements, "_family", lambda result: family)
    monkeypatch.setattr(_armrs, "Rig", seen)
    separate(dataclasses.replace(found, result=torn), threads=2)
    # The law that the joint states, and the named effect beside it.
    assert [sum((e.kind, e.joint) == ("viscous", 2) for e in effects) for effects in rigs] == [2]


def detent(angle: np.ndarray, speed: np.ndarray, height: float, pitch: float) -> np.ndarray:
    return height * np.sin(angle / pitch)


def declared() -> armrs.OwnEffect:
    return armrs.own_effect(
        "detent",
        detent,
        [armrs.Parameter("height", "N m", -5.0, 5.0, 0.0), armrs.Parameter("pitch", "rad", 0.02, 0.5, 0.1, linear=False)],
        summary="moment of magnets",
        formula="R = height · sin(q/pitch)",
        shapes={"pitch": [0.05, 0.08]},
    )


def test_an_effect_of_ones_own_is_simulated_named_and_written(tmp_path: Path) -> None:
    own = declared()
    # Cubics through points 0.012 rad apart, at a pitch of 0.1 rad: (0.012/0.1)⁴ · 3/128 = 5e-6.
    assert own.table_error < 1e-5
    hidden = armrs.Effect("detent", 2, parameters={"height": 0.3, "pitch": 0.075})
    found = armrs.find_gap(session(hidden), effects=[own], threads=2)
    assert [(e.kind, e.joint) for e in found.effects] == [("detent", 2)]
    for name, true in hidden.parameters.items():
        value = found.effects[0].parameters[name]
        assert value.std is not None
        assert abs(value.value - true) < 4 * value.std < 0.1 * true
    gap = found.gap["Fz_N"]
    assert gap.after is not None and gap.floor is not None and gap.calibrated is not None
    assert gap.after < 1.2 * gap.floor < gap.calibrated
    write_gap(found, gap_data(found), tmp_path)
    assert armrs.load_model(tmp_path / "amended.toml").effects[-1].kind == "detent"


def test_an_effect_of_ones_own_is_as_in_the_catalogue() -> None:
    armrs.own_effect("my_coulomb", lambda q, qd, torque: torque * np.tanh(qd / 0.01), [armrs.Parameter("torque", "N m", 0.0, 5.0, 0.0)])
    movement = armrs.Movement(np.radians([[-60, 50], [-30, 85], [-60, 50]]), speed=0.6, acceleration=2.4, shape="smooth")
    base = session().model
    mine, ours = (
        armrs.simulate(base.replace(effects=(armrs.Effect(kind, 2, parameters={"torque": 0.2}),)), movement, dt=1e-3)
        for kind in ("my_coulomb", "coulomb")
    )
    # The table is good to 2e-6 of the torque, and the arm's stiffness divides it.
    assert np.abs(mine.force_on_arm - ours.force_on_arm).max() < 1e-4


@pytest.mark.parametrize(
    ("law", "parameters", "message"),
    [
        (lambda q, qd, a: a * q, [armrs.Parameter("a", "N m", 0.0, 1.0, 0.0, linear=False)], "one such first"),
        (lambda q, qd, a: a * a * q, [armrs.Parameter("a", "N m", 0.0, 1.0, 0.0)], "not linear"),
        (lambda q, qd: q, [armrs.Parameter("a", "N m", 0.0, 1.0, 0.0)], r"allowed law\(angle, speed, a\)"),
        (lambda q, qd, a: a * np.sqrt(q), [armrs.Parameter("a", "N m", 0.0, 1.0, 0.0)], "allowed a finite torque"),
        (lambda q, qd, a: a * np.sin(3000.0 * q), [armrs.Parameter("a", "N m", 0.0, 1.0, 0.0)], "a smoother law"),
        (lambda q, qd, a: a * q, [armrs.Parameter("a", "N m", 1.0, 2.0, 1.0)], "zero where linear"),
    ],
)
@pytest.mark.filterwarnings("ignore:invalid value:RuntimeWarning")
def test_a_law_that_cannot_be_used_is_refused(law: object, parameters: list[armrs.Parameter], message: str) -> None:
    with pytest.raises(BadInput, match=message):
        armrs.own_effect("bad", law, parameters)  # type: ignore[arg-type]


def test_a_law_that_fails_later_says_so_itself() -> None:
    def law(angle: np.ndarray, speed: np.ndarray, size: float, shape: float) -> np.ndarray:
        if shape != 0.5:
            raise RuntimeError("no such shape")
        return size * np.cos(angle)

    armrs.own_effect(
        "picky", law, [armrs.Parameter("size", "N m", -1.0, 1.0, 0.0), armrs.Parameter("shape", "1", 0.0, 1.0, 0.5, linear=False)]
    )
    movement = armrs.Movement(np.radians([[-60, 50], [-30, 85]]))
    effect = armrs.Effect("picky", 1, parameters={"size": 0.1, "shape": 0.2})
    with pytest.raises(RuntimeError, match="no such shape"):
        armrs.simulate(session().model.replace(effects=(effect,)), movement)


def test_a_quick_answer_on_the_command_line(found: armrs.GapFound, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_dataset(found.dataset, tmp_path / "data")
    assert cli.main(["gap", str(tmp_path / "data"), "--quick", "--json", str(tmp_path / "quick.json")]) == 0
    out = capsys.readouterr().out
    assert "viscous damping in joint 2 explains" in out
    assert "Nothing is named yet" in out
    result = json.loads((tmp_path / "quick.json").read_text(encoding="utf-8"))
    assert (result["suspects"][0]["kind"], result["suspects"][0]["joint"]) == ("viscous", 2)
    assert cli.main(["gap", str(tmp_path / "data"), "--quick", "-o", str(tmp_path / "out")]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_a_session_shows_what_was_said_before_it_that_it_would(found: armrs.GapFound) -> None:
    """The same movements and sensors, planned and then made: limits of the same size."""
    instruments = armrs.Instruments(rate=100.0, force=0.1, angle=1e-3)
    movements = [
        armrs.Movement(np.radians([[-60, 50], [-30, 50], [-30, 85], [-60, 50]]), speed=0.4, acceleration=1.6, shape="smooth"),
        armrs.Movement(np.radians([[-50, 80], [-20, 40], [-50, 80]]), speed=1.0, acceleration=4.0, shape="smooth"),
    ]
    planned = {
        (w.kind, w.joint, w.channel, w.parameter): w.at_least for w in detectable(found.dataset.model, movements, instruments=instruments)
    }
    made = calibrate(session(), threads=2).suspects
    compared = [
        planned[key] / s.smallest for s in made for key in [(s.kind, s.joint, s.channel, next(iter(s.parameters)))] if key in planned
    ]
    assert len(compared) > 40
    # What is planned is simulated by the engine that also fits; the session comes from the other one, and a little more is left of it.
    assert 0.5 < np.median(compared) < 1.2
    slower = {w.kind: w.at_least for w in detectable(found.dataset.model, movements[:1], instruments=instruments) if w.joint == 2}
    assert slower["quadratic_drag"] > 2.0 * planned["quadratic_drag", 2, None, "drag"]
