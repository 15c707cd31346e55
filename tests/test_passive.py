"""Passive moments: known friction and elasticity come back, and fast movements are warned of."""

from __future__ import annotations

import dataclasses
import json
import shutil
from pathlib import Path

import numpy as np
import pytest

import armrs
from armrs import cli
from armrs.analysis import motion_direction
from armrs.analysis.passivity_checks import gives_energy
from armrs.demo import BRAKES
from conftest import Session

FRICTION = 0.01
"""Half of the hysteresis has the brake's torque to this [N m]: 0.2 N of force noise over 0.6 m, averaged over a bin and four repeats."""


def test_half_the_hysteresis_is_the_dry_friction(slow_arm: Path) -> None:
    result = armrs.passive_moments(slow_arm)
    assert [(c.joint, c.repeats) for c in result.curves] == [(1, 4), (2, 4)]
    for curve, brake in zip(result.curves, BRAKES, strict=True):
        assert np.nanmean(curve.half_width) == pytest.approx(brake, abs=FRICTION)
        assert np.nanmax(curve.half_width_std) < 5 * FRICTION
        assert curve.inertial_share < 0.1
    assert result.warnings == ()
    assert "joint 2 in 'slow': ±0.16" in repr(result)


def test_the_elastic_mean_is_the_spring(slow_arm: Path, tmp_path: Path) -> None:
    stiffness, rest = 1.5, -1.0
    dataset = armrs.load_dataset(slow_arm)
    truth = armrs.load_model(slow_arm / "truth.toml")
    springy = truth.replace(joints=(armrs.Joint("shoulder", stiffness=stiffness, rest=rest), truth.joints[1]))
    run = armrs.simulate(springy, armrs.load_movement(slow_arm / "movement.toml", 2))
    trial = armrs.Trial("trials/x.csv", "x", 1, "fit", run.t, run.q, run.force_on_arm, None, None)
    curve = armrs.passive_moments(dataset.replace(model=truth, trials=(trial,))).curves[0]
    assert np.allclose(curve.elastic, stiffness * (curve.angle - rest), atol=0.01)
    assert np.isnan(curve.elastic_std).all()  # one repeat has no deviation


def test_signs_do_not_depend_on_what_the_force_acts_on(slow_arm: Path, tmp_path: Path) -> None:
    dataset = armrs.load_dataset(slow_arm)
    armrs.write_dataset(dataset.replace(force_on="arm"), tmp_path)
    curves = [armrs.passive_moments(folder).curves[0] for folder in (slow_arm, tmp_path)]
    assert np.allclose(curves[0].elastic, curves[1].elastic, atol=1e-12, equal_nan=True)


def test_measured_torques_count(slow_arm: Path) -> None:
    """With the force turned into joint torques, the moments stay the same."""
    dataset = armrs.load_dataset(slow_arm)
    model = dataset.model
    arm = armrs.Arm(*([getattr(s, name) for s in model.segments] for name in ("length", "mass", "com", "inertia")))
    trial = dataset.trials[0]
    torque = arm.static_torque(trial.q, trial.force_on_arm)
    other = armrs.Trial(trial.file, "slow", 1, "fit", trial.t, trial.q, None, None, None, torque)
    by_force, by_torque = (armrs.passive_moments(dataset.replace(trials=(t,))).curves[1] for t in (trial, other))
    # Filtering before and after the Jacobian differs by the noise of the angles.
    assert np.nanmax(np.abs(by_force.elastic - by_torque.elastic)) < 0.01


def test_a_fast_movement_is_warned_of(slow_arm: Path) -> None:
    truth = armrs.load_model(slow_arm / "truth.toml")
    fast = armrs.Movement(np.radians([[-60, 60], [0, 60], [-60, 60], [0, 60], [-60, 60]]), speed=4.0, acceleration=20.0)
    run = armrs.simulate(truth, fast)
    trial = armrs.Trial("fast.csv", "fast", 1, "fit", run.t, run.q, run.force_on_arm, None, None)
    result = armrs.passive_moments(armrs.load_dataset(slow_arm).replace(trials=(trial,), model=truth), cutoff=5.0)
    assert len(result.warnings) >= 1
    assert "fast: not slow for joint 1: inertial torques are" in result.warnings[0]


def test_a_stretch_as_wide_as_the_low_pass_is_not_slow(slow_arm: Path) -> None:
    """With a reflex, the stiffness of stretches at 99 °/s was twice the true one, and its change was tested."""
    truth, trials = armrs.load_model(slow_arm / "truth.toml"), []
    for name, speed in (("slow", 20.0), ("fast", 99.0)):
        peak, there, back = np.radians(speed), [-40.0, 20.0], [-40.0, 110.0]
        move = armrs.Movement(np.radians([there, back, there]), speed=peak, acceleration=1.07 * peak**2, pause=2.0, shape="smooth")
        run = armrs.simulate(truth, move, sensors=armrs.Sensors.realistic(), seeds=range(2))
        trials += [
            armrs.Trial(f"{name}_{k}.csv", name, k, "fit", r.time, r.q, r.force_on_arm, None, None) for k, r in enumerate(run.readings, 1)
        ]
    result = armrs.passive_moments(armrs.load_dataset(slow_arm).replace(trials=tuple(trials), model=truth))
    slow, fast = (next(c for c in result.curves if (c.configuration, c.joint) == (name, 2)) for name in ("slow", "fast"))
    assert slow.slow and slow.bandwidth == pytest.approx(20.0 / 91.3, rel=0.1)
    assert not fast.slow and fast.bandwidth == pytest.approx(99.0 / 91.3, rel=0.1)
    (said,) = [line for line in result.warnings if "fast: not slow for joint 2" in line]
    assert said.endswith("the bandwidth of the movement is 1.1 Hz, and the low-pass is at 1 Hz")
    assert {e.name for e in result.followed() if e.joint == 2} == {
        f"{name} in slow" for name in ("half_width", "stiffness", "range", "speed")
    }
    check = result.checks[1]
    assert check.passed is False and check.text.startswith("Not slow: the bandwidth of a movement is 1.1 Hz")


@pytest.mark.parametrize("shape", ["rectangle", "raised cosine", "least jerk"])
def test_the_bandwidth_is_the_first_zero_of_the_spectrum_of_a_stroke(shape: str) -> None:
    """By hand: of a stroke of 1.2 s, 1/1.2 Hz for a rectangle, 2/1.2 Hz for a raised cosine, and 1.834/1.2 Hz for least jerk."""
    rate, length = 1000.0, 1.2
    x = np.arange(1, 1200) / 1200.0
    pulse, zero = {
        "rectangle": (np.where((x > 0.001) & (x < 0.999), 1.0, 0.01), 1.0),
        "raised cosine": (1.0 - np.cos(2.0 * np.pi * x), 2.0),
        "least jerk": (30.0 * x**2 * (1.0 - x) ** 2, 1.834),
    }[shape]
    speed = np.concatenate([np.zeros(50), pulse, np.zeros(50), -pulse, np.zeros(50)])
    found = motion_direction.bandwidth(speed, np.sign(speed), rate)
    assert found == pytest.approx([zero / length] * 2, rel=0.02)
    # A part of a stroke has no width.
    assert motion_direction.bandwidth(speed[: 50 + 600], np.sign(speed[: 50 + 600]), rate) == []


def test_a_joint_that_gives_energy_is_warned_of(slow_arm: Path) -> None:
    """Without a robot, angles in another unit gave negative friction without a word."""
    data = armrs.load_dataset(slow_arm)
    data = data.replace(model=data.model.replace(robot=None))
    mirrored = tuple(dataclasses.replace(t, force_on_arm=None if t.force_on_arm is None else -t.force_on_arm) for t in data.trials)
    said = [
        [line for line in armrs.passive_moments(d).warnings if "cannot generate energy" in line]
        for d in (data, data.replace(trials=mirrored))
    ]
    assert said[0] == [] and len(said[1]) == 1
    assert said[1][0].startswith("half width of the hysteresis below zero: joint 1 (slow), joint 2 (slow): ")
    chance = [("slow", 1, (-0.02, 0.001)), ("slow", 1, (-0.02, -0.001)), ("slow", 2, (float("nan"), float("nan")))]
    assert gives_energy(chance) == []


def test_a_held_joint_has_no_curve(slow_arm: Path) -> None:
    truth = armrs.load_model(slow_arm / "truth.toml")
    run = armrs.simulate(truth, armrs.Movement(np.radians([[-60, 60], [-48, 60], [-60, 60]])))
    trial = armrs.Trial("one.csv", "one", 1, "fit", run.t, run.q, run.force_on_arm, None, None)
    curves = armrs.passive_moments(armrs.load_dataset(slow_arm).replace(trials=(trial,), model=truth)).curves
    assert [c.joint for c in curves] == [1]


def test_gaps_stay_gaps(session: Session) -> None:
    def hole(lines: list[str]) -> list[str]:
        return lines[:40] + lines[70:]

    session.edit_lines(hole)
    data = armrs.load_dataset(session.folder)
    # Its columns are numbers without meaning: nothing holds this arm.
    first = armrs.passive_moments(data.replace(model=data.model.replace(robot=None))).trials[0]
    assert np.isnan(first.moment).any()
    assert np.isfinite(first.moment).any()
    assert (first.direction[np.isnan(first.q)] == 0).all()


def test_the_share_that_is_done_grows(slow_arm: Path, tmp_path: Path) -> None:
    told: list[tuple[str, float]] = []
    for name in ("a", "b"):
        shutil.copytree(slow_arm, tmp_path / name)
    armrs.passive_moments(slow_arm, progress=lambda stage, share: told.append((stage, share)))
    assert told == [("passive moments of slow", 0.0)]
    told.clear()
    armrs.cohort(tmp_path, progress=lambda stage, share: told.append((stage, share)))
    shares = [share for _, share in told]
    assert [stage for stage, _ in told[:2]] == ["passive moments of a", "passive moments of b"]
    assert shares == sorted(shares) and shares[:2] == [0.0, 0.4] and all(0.8 <= share < 1.0 for share in shares[2:])


def test_the_verb(slow_arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["passive", str(slow_arm), "-o", str(tmp_path), "--json", str(tmp_path / "x.json")]) == 0
    out, err = capsys.readouterr()
    assert "warning" not in err
    assert "slow arm (synthetic data): Half width of the hysteresis, with the movement in brackets: shoulder 0.1" in out
    result = json.loads((tmp_path / "x.json").read_text(encoding="utf-8"))
    assert (result["verb"], len(result["curves"])) == ("passive", 2)
    assert {"angle_deg", "rising_Nm", "falling_Nm", "elastic_Nm", "elastic_std_Nm", "half_width_Nm", "inertial_share"} <= set(
        result["curves"][0]
    )
    assert (tmp_path / "figures/passive-slow.png").stat().st_size > 20_000
    assert "Synthetic data" in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_nothing_to_tell_is_a_finding(slow_arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    dataset = armrs.load_dataset(slow_arm)
    armrs.write_dataset(dataset.replace(trials=tuple(_first_second(t) for t in dataset.trials)), tmp_path)
    assert cli.main(["passive", str(tmp_path)]) == 1
    out, err = capsys.readouterr()
    assert "No joint moved far enough" in out
    assert err.count("warning: ") == 1
    assert "warning: slow: joint 1 moved, but not long enough in both directions" in err


def test_that_no_joint_of_a_movement_tells_is_said_once(data: Path) -> None:
    (line,) = armrs.passive_moments(data / "pendulum_double").warnings
    assert line.startswith("swing: joints 1, 2 moved, but not long enough in both directions")


def _first_second(trial: armrs.Trial) -> armrs.Trial:
    n = 100
    return armrs.Trial(
        trial.file, trial.configuration, trial.repeat, trial.role, trial.t[:n], trial.q[:n], trial.force_on_arm[:n], None, None
    )


def test_repeats_that_are_missing_from_a_curve_are_named_with_the_reason(slow_arm: Path) -> None:
    """A curve of three repeats of four said so by its number alone."""
    dataset = armrs.load_dataset(slow_arm)
    first, *others = dataset.trials
    assert first.force_on_arm is not None

    def warned(**changes: np.ndarray) -> list[str]:
        odd = armrs.Trial("odd.csv", "slow", 1, "fit", first.t, **{"q": first.q, "force_on_arm": first.force_on_arm, **changes})
        lines = armrs.passive_moments(dataset.replace(trials=(odd, *others))).warnings
        return [line for line in lines if "not among the repeats" in line]

    assert warned() == []
    held = np.column_stack([first.q[:, 0], np.full(len(first), first.q[:, 1].mean())])
    assert "odd.csv: not among the repeats of joint 2: it moves by less than 2°" in warned(q=held)
    back = np.arange(len(first)) >= np.argmax(np.abs(first.q[:, 1] - first.q[0, 1]))
    (said,) = [line for line in warned(active=back, valid=~back) if "joint 2" in line]
    assert said.startswith("odd.csv: not among the repeats of joint 2: the angle only ")
    # A joint that moves in one repeat of three was held: that one is the odd one, by a line of its own.
    still = [dataclasses.replace(t, robot_q=None, q=np.column_stack([t.q[:, 0], np.full(len(t), t.q[:, 1].mean())])) for t in others]
    lines = armrs.passive_moments(dataset.replace(trials=(dataclasses.replace(first, robot_q=None), *still))).warnings
    assert not any("not among the repeats of joint 2" in line for line in lines)


def test_what_cannot_be_right_of_one_trial_is_said(slow_arm: Path) -> None:
    """The other repeats stay good, so that nothing but these lines would tell."""
    dataset = armrs.load_dataset(slow_arm)
    first, *others = dataset.trials
    assert first.force_on_arm is not None

    def warned(**changes: np.ndarray) -> str:
        odd = armrs.Trial("odd.csv", "slow", 1, "fit", first.t, **{"q": first.q, "force_on_arm": first.force_on_arm, **changes})
        return "\n".join(armrs.passive_moments(dataset.replace(trials=(odd, *others))).warnings)

    assert warned() == ""
    still = warned(q=np.radians(first.q))
    assert "odd.csv: no joint moves long enough" in still and "mean angle of joint 1 differs by 5" in still
    active = np.arange(len(first)) < 0.98 * len(first)
    assert "(muscles are active in 98 % of it)" in warned(active=active, valid=~active)
    assert "odd.csv: the force carries 0.09" in warned(force_on_arm=1e-3 * first.force_on_arm)
    assert "odd.csv: the force carries -" in warned(force_on_arm=-first.force_on_arm)
    assert "mean angle of joint 2 differs by 120" in warned(q=first.q[:, ::-1])
    short = slice(0, 20)
    cut = armrs.Trial("odd.csv", "slow", 1, "fit", first.t[short], first.q[short], first.force_on_arm[short])
    result = armrs.passive_moments(dataset.replace(trials=(cut, *others)))
    assert "odd.csv: no joint moves long enough" in result.warnings[0] and {c.repeats for c in result.curves} == {len(others)}
