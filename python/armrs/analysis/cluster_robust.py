"""Standard deviations of a least-squares fit whose errors are correlated within trials (clusters), for few trials."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

_LEAST = 1e-10
"""Least share of a direction of the residuals that the fit leaves free."""


def deviations(jacobians: Sequence[np.ndarray], residuals: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Return standard deviations of the coefficients and their degrees of freedom.

    The sandwich of the scores of the trials. A trial that decides a coefficient leaves little of its own error in its residuals: these are
    raised by `(I − H)^(−1/2)`, H what the fit takes of a trial by itself (Bell, McCaffrey 2002). The degrees of freedom are those of
    Satterthwaite under independent errors (Pustejovsky, Tipton 2018): few where few trials decide.

    Parameters
    ----------
    jacobians : sequence of ndarray, shape (m, p)
        Derivatives of what was fitted to the coefficients, a trial each.
    residuals : sequence of ndarray, shape (m,)

    Returns
    -------
    stds, freedoms : ndarray, shape (p,)

    Examples
    --------
    >>> import numpy as np
    >>> from armrs.analysis.cluster_robust import deviations
    >>> stds, freedoms = deviations([np.ones((1, 1))] * 4, [np.array([v]) for v in (-1.0, 1.0, -1.0, 1.0)])
    >>> round(float(stds[0]), 6), round(float(freedoms[0]), 6)  # of the mean of four values
    (0.57735, 3.0)
    """
    whole = np.concatenate(jacobians)
    scale = np.linalg.norm(whole, axis=0) + 1e-300
    inverse = np.linalg.pinv((whole / scale).T @ (whole / scale), hermitian=True)
    values, vectors = np.linalg.eigh(inverse)
    root = vectors * np.sqrt(np.maximum(values, 0.0)) @ vectors.T
    moved, weights, crossed = [], [], []
    for own, rest in zip(jacobians, residuals, strict=True):
        left, sizes, _ = np.linalg.svd(own / scale @ root, full_matrices=False)
        raised = left * (1.0 / np.sqrt(np.maximum(1.0 - sizes**2, _LEAST)) - 1.0)
        weight = own / scale @ inverse
        weight = weight + raised @ (left.T @ weight)
        moved.append(weight.T @ rest)
        weights.append(np.sum(weight**2, axis=0))
        crossed.append((own / scale).T @ weight)
    of_trials, between = np.array(weights), np.array(crossed)
    freedoms = []
    for k in range(whole.shape[1]):
        form = np.diag(of_trials[:, k]) - between[:, :, k] @ inverse @ between[:, :, k].T
        freedoms.append(np.trace(form) ** 2 / max(float(np.sum(form**2)), 1e-300))
    return np.sqrt(np.sum(np.array(moved) ** 2, axis=0)) / scale, np.array(freedoms)
