"""Animated stick figures: plain data, and SVG for a page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..io.joint_positions import chain_points

if TYPE_CHECKING:
    from ..model import Model

FRAMES = 25.0
"""Pictures a second."""
GHOSTS = 7
"""Poses that are shown all the time, over the whole movement."""
MOST_FRAMES = 400
"""Pictures of a film; a longer movement has fewer a second."""
_MARGIN = 0.06


def points(model: Model, q: np.ndarray) -> np.ndarray:
    """Return the joints of an arm and its end, shape (n, n_joints + 1, 2) [m], of angles (n, n_joints)."""
    return chain_points(model.base, [s.length for s in model.segments], q)


def robot_points(model: Model, robot_q: np.ndarray) -> np.ndarray:
    """Return base, elbow and handle of the robot, shape (n, 3, 2) [m], of its angles (n, 2), the second relative to the first."""
    assert model.robot is not None
    return chain_points(model.robot.base, model.robot.lengths, robot_q)


def film(title: str, text: str, t: np.ndarray, chains: Mapping[str, tuple[str, np.ndarray]]) -> dict[str, Any]:
    """Return a moving picture as plain data.

    Parameters
    ----------
    title, text : str
    t : ndarray, shape (n,)
        Evenly spaced times [s].
    chains : mapping
        Name -> colour and points, shape (n, k, 2) [m].
    """
    every = max(1, round(1.0 / (FRAMES * float(t[1] - t[0]))), -(-len(t) // MOST_FRAMES))
    return {
        "title": title,
        "text": text,
        "t_s": np.round(t[::every], 3).tolist(),
        "chains": [
            {"name": name, "colour": colour, "points_m": np.round(points[::every], 4).tolist()} for name, (colour, points) in chains.items()
        ],
    }


def drawn(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return a moving picture as the template shows it, in SVG; without scripts the poses over the movement are there."""
    chains = [(chain, np.asarray(chain["points_m"])) for chain in data["chains"]]
    every = np.concatenate([points.reshape(-1, 2) for _, points in chains])
    low, high = every.min(axis=0) - _MARGIN, every.max(axis=0) + _MARGIN
    size = high - low
    lines = []
    for chain, points in chains:
        ghosts = np.linspace(0, len(points) - 1, GHOSTS).astype(int)
        lines += [{"kind": "ghost", "colour": chain["colour"], "points": _path(points[k], low, high)} for k in ghosts]
    lines += [{"kind": "stick", "colour": chain["colour"], "points": _path(points[0], low, high)} for chain, points in chains]
    return {
        "title": data["title"],
        "text": data["text"],
        "size": f"{size[0]:.3f} {size[1]:.3f}",
        "lines": lines,
        "scale": _scale(size),
        "key": [(chain["name"], chain["colour"]) for chain, _ in chains],
        "last": len(data["t_s"]) - 1,
        "frames": [[[_path(pose, low, high) for pose in points] for _, points in chains], data["t_s"]],
    }


def _scale(size: np.ndarray) -> dict[str, Any]:
    """Return a bar of 0.1 m and the direction of gravity, in the lower left corner of a picture of that size [m]."""
    left, foot = 0.02, size[1] - 0.02
    bar = f"M{left:.3f} {foot:.3f}h.1m0 -.01v.02m-.1 0v-.02"
    arrow = f"M{left + 0.15:.3f} {foot - 0.07:.3f}v.07m-.012 -.018l.012 .018l.012 -.018"
    return {
        "path": bar + arrow,
        "length_at": (f"{left + 0.015:.3f}", f"{foot - 0.015:.3f}"),
        "gravity_at": (f"{left + 0.17:.3f}", f"{foot - 0.02:.3f}"),
    }


def _path(pose: Sequence[Sequence[float]] | np.ndarray, low: np.ndarray, high: np.ndarray) -> str:
    """Return a pose as SVG has it, where z grows downwards."""
    return " ".join(f"{y - low[0]:.3f},{high[1] - z:.3f}" for y, z in np.asarray(pose))
