"""Resampling from uneven times with missing samples to a uniform grid.

All channels go through the same interpolation, so that no channel is smoothed or delayed against another. It is the cubic through each
interval whose end slopes are those of the parabola through three neighbouring samples: exact for parabolas, four samples wide, so that a
gap or an outlier stays local.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

EVEN = 0.01
"""Time stamps within this part of a sample interval of a uniform grid count as uniform."""

LONGEST_GAP = 0.25
"""Longest stretch without samples that is bridged [s]."""


def is_even(t: np.ndarray) -> bool:
    """Return whether time stamps, shape (n,), lie on a uniform grid."""
    step = (t[-1] - t[0]) / (len(t) - 1)
    return bool(np.max(np.abs(t - t[0] - step * np.arange(len(t)))) <= EVEN * step)


def complete_pieces(complete: np.ndarray) -> list[slice]:
    """Return the stretches in which a flag, shape (n,), is true, in order."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], complete.astype(np.int8), [0]])))
    return [slice(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def usual_step(t: np.ndarray) -> float:
    """Return the sample interval [s]: the mean of the intervals that are no gaps.

    The median alone has the rounding of the printed time stamps in it.
    """
    steps = np.diff(t)
    return float(np.mean(steps[steps < 1.5 * np.median(steps)]))


def uniform_grid(t: np.ndarray, rate: float | None = None) -> np.ndarray:
    """Return a uniform grid from the first time stamp to at most the last.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Increasing time stamps [s].
    rate : float, optional
        Samples a second [Hz]; without it that of the time stamps, see `usual_step`.
    """
    step = 1.0 / rate if rate is not None else usual_step(t)
    count = int(np.floor((t[-1] - t[0]) / step * (1.0 + 1e-12) + 1e-6)) + 1
    return np.minimum(t[0] + step * np.arange(count), t[-1])


@dataclass(frozen=True)
class Channel:
    """One channel on the grid.

    Attributes
    ----------
    values : ndarray, shape (n,)
        NaN where a gap is too long to be bridged, and before the first and after the last sample.
    bridged : ndarray of bool, shape (n,)
        True where missing samples were bridged.
    gaps : list of (float, float)
        Stretches that were not bridged, start and end [s].
    """

    values: np.ndarray
    bridged: np.ndarray
    gaps: list[tuple[float, float]]


def onto_grid(t: np.ndarray, values: np.ndarray, grid: np.ndarray) -> Channel:
    """Interpolate one channel.

    Parameters
    ----------
    t : ndarray, shape (m,)
        Increasing time stamps [s].
    values : ndarray, shape (m,)
        Samples; NaN where missing. At least two are there.
    grid : ndarray, shape (n,)
        Increasing times, within those of `t` [s].

    Returns
    -------
    Channel
        Where a grid time is a time stamp, the value is that sample, to the bit.
    """
    there = ~np.isnan(values)
    ts, ys = t[there], values[there]
    step = grid[1] - grid[0] if len(grid) > 1 else 0.0
    left = np.clip(np.searchsorted(ts, grid, side="right") - 1, 0, len(ts) - 2)
    width = ts[left + 1] - ts[left]
    on_sample = (grid == ts[left]) | (grid == ts[left + 1])
    longest = max(LONGEST_GAP, 2.5 * step)
    lost = ((width > longest) & ~on_sample) | (grid < ts[0]) | (grid > ts[-1])
    bridged = ~lost & ~on_sample & _spans_missing(t, there, ts, left, width, step)
    out = np.full(len(grid), np.nan)
    keep = ~lost
    out[keep] = _cubic(ts, ys, grid[keep], left[keep])
    return Channel(out, bridged, _stretches(t, ts, longest))


def _spans_missing(t: np.ndarray, there: np.ndarray, ts: np.ndarray, left: np.ndarray, width: np.ndarray, step: float) -> np.ndarray:
    """Return for each grid time whether its interval lacks samples: an empty cell, or a row that is not there."""
    rows = np.flatnonzero(there)
    empty = rows[left + 1] - rows[left] > 1
    return empty | (width > 1.5 * step)


def _cubic(ts: np.ndarray, ys: np.ndarray, at: np.ndarray, left: np.ndarray) -> np.ndarray:
    """Evaluate the piecewise cubic with three-point slopes."""
    if len(ts) == 2:
        slope = np.full(2, (ys[1] - ys[0]) / (ts[1] - ts[0]))
    else:
        h = np.diff(ts)
        d = np.diff(ys) / h
        inner = (h[1:] * d[:-1] + h[:-1] * d[1:]) / (h[:-1] + h[1:])
        slope = np.concatenate([[2.0 * d[0] - inner[0]], inner, [2.0 * d[-1] - inner[-1]]])
    width = ts[left + 1] - ts[left]
    u = (at - ts[left]) / width
    v = 1.0 - u
    y0, y1 = ys[left], ys[left + 1]
    bend = u * v * (v * (slope[left] * width - (y1 - y0)) - u * (slope[left + 1] * width - (y1 - y0)))
    return np.where(u == 0.0, y0, np.where(u == 1.0, y1, v * y0 + u * y1 + bend))


def _stretches(t: np.ndarray, ts: np.ndarray, longest: float) -> list[tuple[float, float]]:
    wide = np.flatnonzero(np.diff(ts) > longest)
    gaps = [(float(ts[k]), float(ts[k + 1])) for k in wide]
    if ts[0] > t[0]:
        gaps.insert(0, (float(t[0]), float(ts[0])))
    if ts[-1] < t[-1]:
        gaps.append((float(ts[-1]), float(t[-1])))
    return gaps
