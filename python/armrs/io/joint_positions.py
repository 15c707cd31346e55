"""Positions of the joints of a planar chain."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def chain_points(base: Sequence[float], lengths: Sequence[float], q: np.ndarray) -> np.ndarray:
    """Return the joints of a chain and its end.

    Parameters
    ----------
    base : (float, float)
        First joint, y and z [m].
    lengths : sequence of float
        Of the links [m].
    q : ndarray, shape (n, n_joints)
        Angles: the first from +y, each other from the link before it [rad].

    Returns
    -------
    ndarray, shape (n, n_joints + 1, 2)
        y and z [m].
    """
    directions = np.cumsum(q, axis=1)
    steps = np.asarray(lengths, dtype=float)[:, None] * np.stack([np.cos(directions), np.sin(directions)], axis=-1)
    start = np.broadcast_to(np.asarray(base, dtype=float), (len(q), 1, 2))
    return np.cumsum(np.concatenate([start, steps], axis=1), axis=1)
