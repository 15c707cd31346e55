"""Angles of another convention are named in one line, by where they put the hand."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from armrs.errors import BadInput
from armrs.io.plausibility import hand_meets_handle, mean_gap, refuse_implausible
from armrs.model import Joint, Model, Robot, Segment

LENGTHS = (0.30, 0.25, 0.08)
ROBOT = Robot(lengths=(0.45, 0.45), base=(1.0, -0.10))
SEGMENTS = tuple(Segment(f"segment {k}", length, 1.0, length / 2, 0.01) for k, length in enumerate(LENGTHS))
MODEL = Model(SEGMENTS, tuple(Joint(f"joint {k}") for k in range(3)), robot=ROBOT)


def arm(change: Callable[[np.ndarray], np.ndarray], wrist: tuple[float, float] = (0.1, 0.2)) -> Any:
    """Return a data set of one trial whose angles are changed, and whose robot holds the hand of those unchanged.

    The wrist swings about its first angle [rad] by the second.
    """
    t = np.linspace(0.0, 6.0, 300)
    q = np.column_stack([-1.2 + 0.3 * np.sin(t), 1.0 + 0.4 * np.sin(1.3 * t), wrist[0] + wrist[1] * np.sin(0.7 * t)])
    absolute = np.cumsum(q, axis=1)
    hand = np.column_stack([np.cos(absolute) @ LENGTHS, np.sin(absolute) @ LENGTHS]) - ROBOT.base
    near, far = ROBOT.lengths
    inner = np.arccos((np.sum(hand**2, axis=1) - near**2 - far**2) / (2 * near * far))
    outer = np.arctan2(hand[:, 1], hand[:, 0]) - np.arctan2(far * np.sin(inner), near + far * np.cos(inner))
    trial = SimpleNamespace(q=change(q), robot_q=np.column_stack([outer, inner]), force_on_arm=None, base=None, file="trial.csv")
    return SimpleNamespace(model=MODEL, trials=(trial,))


def test_angles_of_the_model_meet_the_handle() -> None:
    data = arm(lambda q: q)
    refuse_implausible(data)
    assert hand_meets_handle(data)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda q: -q, "mirrored"),
        (lambda q: np.cumsum(q, axis=1), "absolute angles"),
        (lambda q: q + np.array([np.pi / 2, 0.0, 0.0]), "vertical downwards"),
        (lambda q: [np.pi / 2, 0.0, 0.0] - q, "vertical upwards, mirrored"),
        (lambda q: [np.pi, 0.0, 0.0] - q, "other side"),
        (lambda q: np.cumsum(q, axis=1) + np.pi / 2, "absolute angles, from the vertical downwards"),
        (lambda q: q + np.array([0.0, 0.5, 0.0]), "another zero: q2 is 0.5 rad too large"),
    ],
)
def test_another_convention_is_named(change: Callable[[np.ndarray], np.ndarray], says: str) -> None:
    data = arm(change)
    assert not hand_meets_handle(data)
    with pytest.raises(BadInput, match=says):
        refuse_implausible(data)


def test_a_poor_zero_of_the_elbow_is_no_mirrored_wrist() -> None:
    """With play in the handle, a mirrored wrist brought the hand as near to the handle as the elbow's zero of 6 degrees."""
    play = 0.008 * np.sign(np.cos(np.linspace(0.0, 6.0, 300)))
    wrong = np.column_stack([play, np.full(300, 0.1), np.zeros(300)])
    data = arm(lambda q: q + wrong, wrist=(0.2, 0.02))
    assert 0.025 < float(np.hypot(*mean_gap(data))) < 0.04
    refuse_implausible(data)
    with pytest.raises(BadInput, match=r"column q3: .* mirrored"):
        refuse_implausible(arm(lambda q: q * [1.0, 1.0, -1.0], wrist=(0.2, 0.02)))
