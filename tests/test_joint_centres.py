"""Joint centres from the path of the handle: what markers beside the joints misread is found as far as the robot shows it."""

from __future__ import annotations

import dataclasses
import sys
from pathlib import Path

import numpy as np
import pytest

import armrs
from armrs.analysis import joint_centres, students_t, uncertainty
from armrs.model import Contact, Joint, Model, Robot, Segment

sys.path.insert(0, str(Path(__file__).parents[1] / "scripts"))
import check_passive

LENGTHS = np.array([0.32, 0.30])
ROBOT = Robot(lengths=(0.45, 0.45), base=(1.05, -0.10))


def led(movements: tuple[tuple[tuple[float, float], tuple[float, float]], ...]) -> armrs.Dataset:
    """Return a session whose markers are at the joints: each movement there and back, three times, under the force of a robot."""
    model = Model(
        tuple(Segment(name, a, 1.5, 0.15, 0.01) for name, a in zip(("upper arm", "forearm"), LENGTHS, strict=True)),
        (Joint("shoulder"), Joint("elbow")),
        robot=ROBOT,
        contact=Contact(stiffness=(10_000.0, 10_000.0), damping=(25.0, 25.0)),
    )
    t = np.arange(0.0, 6.0, 0.02)
    trials, share = [], 0.5 - 0.5 * np.cos(2.0 * np.pi * t / t[-1])[:, None]
    for number, (one, other) in enumerate(movements):
        q = np.radians(np.array(one) + share * (np.array(other) - np.array(one)))
        force = np.column_stack([4.0 * np.cos(t), 12.0 + 3.0 * np.sin(t)])
        absolute = np.cumsum(q, axis=1)
        hand = np.column_stack([np.cos(absolute) @ LENGTHS, np.sin(absolute) @ LENGTHS])
        robot_q = _robot_angles(hand + force / 10_000.0)
        trials += [armrs.Trial(f"{number}_{k}.csv", f"movement {number}", k, "fit", t, q, force, robot_q=robot_q) for k in (1, 2, 3)]
    return armrs.Dataset("led", model, tuple(trials), "robot", tolerance=armrs.Tolerance())


def _robot_angles(handle: np.ndarray) -> np.ndarray:
    """Return the angles at which a robot has its handle there (law of cosines)."""
    (a, b), apart = ROBOT.lengths, handle - np.array(ROBOT.base)
    bent = np.arccos((np.sum(apart**2, axis=1) - a**2 - b**2) / (2.0 * a * b))
    return np.column_stack([np.arctan2(apart[:, 1], apart[:, 0]) - np.arctan2(b * np.sin(bent), a + b * np.cos(bent)), bent])


BENT = (((-60.0, 30.0), (-60.0, 110.0)), ((-70.0, 60.0), (-20.0, 60.0)))
"""Elbow alone and shoulder alone."""


def misplaced(data: armrs.Dataset, draw: np.random.Generator) -> armrs.Dataset:
    """Return a session whose markers sit beside the joints, on trunk and segments, and are carried along by the skin; where a robot shows
    it, the clock of the cameras is off as well."""
    n, lengths = data.model.n_joints, np.array([s.length for s in data.model.segments])
    offsets = uncertainty.LENGTH_STD / np.sqrt(2.0) * draw.standard_normal((n + 1, 2))
    skin = joint_centres.SKIN_STD * draw.standard_normal((n, 2))
    late = 0.0 if data.trials[0].robot_q is None else data.tolerance.time_delay_s * draw.standard_normal()
    angles, distances = [], []
    for trial in data.trials:
        q, at = np.column_stack([np.interp(trial.t + late, trial.t, column) for column in trial.q.T]), np.zeros((len(trial.q), 2))
        markers = [at + offsets[0] + skin[0] * (q[:, :1] + 0.5 * np.pi)]
        for k, direction in enumerate(np.exp(1j * np.cumsum(q, axis=1)).T):
            at = at + lengths[k] * np.column_stack([direction.real, direction.imag])
            beside = offsets[k + 1] + (skin[k + 1] * q[:, [k + 1]] if k + 1 < n else np.zeros((len(q), 2)))
            turned = (beside[:, 0] + 1j * beside[:, 1]) * direction
            markers.append(at + np.column_stack([turned.real, turned.imag]))
        apart = np.diff(np.stack(markers, axis=1), axis=1)
        distances.append(np.linalg.norm(apart, axis=2))
        angles.append(np.diff(np.unwrap(np.arctan2(apart[:, :, 1], apart[:, :, 0]), axis=0), axis=1, prepend=0.0))
    more = np.concatenate(distances).mean(axis=0) - lengths
    trials = tuple(dataclasses.replace(t, q=q) for t, q in zip(data.trials, angles, strict=True))
    return data.replace(model=joint_centres.lengthened(data.model, more), trials=trials)


def test_what_a_history_allows_for_markers_is_what_misplaced_markers_do() -> None:
    """A history called 15 of 20 patients changed whose markers alone had been placed anew. Here they are misplaced at random, and the
    passive moments computed again, without a robot whose path shows where the joints are."""
    data = check_passive.session([check_passive.configurations(0.0)[1]], 121, 0.0, 0.0)
    data = data.replace(trials=data.trials[:2])
    draw = np.random.default_rng(7)
    told = next(c for c in armrs.passive_moments(data).curves if c.joint == 2).placed()
    found = []
    for _ in range(60):
        curve = next(c for c in armrs.passive_moments(misplaced(data, draw)).curves if c.joint == 2)
        found.append((curve.means("half_width").mean(), curve.stiffness().mean()))
    # The standard deviation of 60 draws is itself known to 9 %.
    np.testing.assert_allclose([told["half_width"], told["stiffness"]], np.std(found, axis=0, ddof=1), rtol=0.3)


def test_the_path_of_the_handle_shows_where_the_joints_are() -> None:
    """Forearm and its angle decide the moment of the elbow. What remains of their errors is as large as stated."""
    true, draw = led(BENT), np.random.default_rng(11)
    before, after, told = [], [], []
    for _ in range(20):
        seen = misplaced(true, draw)
        centres = joint_centres.find(seen)
        assert centres.found and not centres.contradicted
        found = centres.applied(seen)
        for data, kept in ((seen, before), (found, after)):
            angle = np.sum(data.trials[0].q - true.trials[0].q, axis=1)
            kept.append((data.model.segments[1].length - LENGTHS[1], angle.mean(), np.ptp(angle)))
        angles, lengths = centres.unknown(found.model, found.trials[0].q)
        whole = angles.sum(axis=2)
        told.append([np.linalg.norm(x) for x in (lengths[:, 1], whole.mean(axis=1), whole[:, 0] - whole[:, len(true.trials[0].t) // 2])])
    first, left, stated = (np.sqrt(np.mean(np.square(x), axis=0)) for x in (before, after, told))
    assert (left < 0.4 * first).all(), (first, left)
    assert (left < 1.3 * stated).all() and (stated < first).all(), (left, stated)


def test_markers_at_the_joints_stay_where_they_are() -> None:
    data = led(BENT)
    found = joint_centres.find(data).applied(data)
    np.testing.assert_allclose([s.length for s in found.model.segments], LENGTHS, atol=1e-5)
    np.testing.assert_allclose(found.trials[3].q, data.trials[3].q, atol=1e-4)


def test_a_shoulder_that_is_held_is_not_found() -> None:
    """The circle of the hand shows the elbow alone: the length of the upper arm stays as uncertain as markers make it."""
    found = [joint_centres.find(data).unknown(data.model, np.zeros((1, 2)))[1] for data in (led(BENT[:1]), led(BENT))]
    held, moved = (np.linalg.norm(lengths, axis=0) / uncertainty.LENGTH_STD for lengths in found)
    assert held[0] > 0.95 > 0.8 > moved[0] and held[1] < 0.6, (held, moved)


def test_what_markers_cannot_explain_is_not_taken_for_their_error() -> None:
    """An upper arm that is wrong by 3 cm is no marker beside its joint."""
    data = led(BENT)
    wrong = data.replace(model=joint_centres.lengthened(data.model, np.array([0.03, 0.0])))
    centres = joint_centres.find(wrong)
    assert centres.contradicted and not centres.found and centres.applied(wrong) is wrong
    assert "misplaced markers" in centres.lines(wrong.model)[0]


@pytest.mark.parametrize("missing", ["robot", "robot_q", "force"])
def test_without_the_path_nothing_is_corrected(missing: str) -> None:
    data = led(BENT)
    if missing == "robot":
        data = data.replace(model=data.model.replace(robot=None))
    else:
        without = {"robot_q": None} if missing == "robot_q" else {"force_on_arm": None, "tau": np.zeros((300, 2))}
        data = data.replace(trials=tuple(dataclasses.replace(t, **without) for t in data.trials))
    centres = joint_centres.find(data)
    assert not centres.found and centres.applied(data) is data and centres.lines(data.model) == ()
    angles, lengths = centres.unknown(data.model, data.trials[0].q)
    markers = missing != "force"
    assert bool(np.any(lengths)) is markers
    if not markers:  # a dynamometer: a constant error of each angle, as declared
        np.testing.assert_allclose(angles[:, 0].max(axis=0), np.radians(0.3))


def test_intervals_of_three_repeats_and_of_markers_hold_together() -> None:
    """Student's factor of two degrees of freedom stood at the scatter beside a larger error that is known: 99.5 of 100 intervals held."""
    draw, held = np.random.default_rng(3), []
    for _ in range(4000):
        values = 0.6 * draw.standard_normal(3) * np.sqrt(3.0) + draw.standard_normal()
        half = students_t.half_width(0.95, float(values.std(ddof=1)) / np.sqrt(3.0), 2, 1.0)
        held.append(abs(values.mean()) <= half)
    assert 0.93 < np.mean(held) < 0.97
