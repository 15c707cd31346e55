"""The contribution of one named effect: its law along the movements, and its change of the channels."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ... import _armrs
from ..._armrs import Missing
from ...catalogue import catalogue
from ...model import Effect
from . import residual_maps
from .core_input import channel_names, core_settings, core_trials, is_led
from .gap_result import GapFound

_BINS = 24
"""Cells of an angle or a speed over which torques are averaged."""
_FEWEST = 8
"""Samples below which a cell has no mean; a trial needs more."""


@dataclass(frozen=True, eq=False)
class EffectCurve:
    """One effect by itself.

    Attributes
    ----------
    against : {"speed", "angle", "time"}
        What its torque follows most closely.
    x : ndarray, shape (k,)
        Speed [rad/s], angle [rad] or time [s].
    torque, low, high : ndarray, shape (k,), or None
        Mean resisting torque there, and at both ends of the interval of its size [N m]; None for what is no torque of a joint.
    data, scatter : ndarray, shape (k,)
        Torque that was measured beyond everything else in the model, mean over trials and standard deviation of these means [N m].
    trial : str
        The file of the trial in which `changed` is shown.
    t : ndarray, shape (n,)
        [s]
    changed : ndarray, shape (n, n_channels), or None
        What the effect changes in the simulated channels; None where it cannot be simulated by itself.
    """

    against: str
    x: np.ndarray
    torque: np.ndarray | None
    low: np.ndarray
    high: np.ndarray
    data: np.ndarray
    scatter: np.ndarray
    trial: str
    t: np.ndarray
    changed: np.ndarray | None


def effect_curve(result: GapFound, effect: Missing) -> EffectCurve:
    """Return one effect of a result by itself."""
    own = _own(result, effect)
    trial, t, changed = _changed(result, effect, own)
    empty = np.empty(0)
    shown = EffectCurve("time", empty, None, empty, empty, empty, empty, trial, t, changed)
    if catalogue()[effect.kind].where != "joint" or effect.joint is None or effect.trial is not None:
        return shown
    return _law(result, effect, own, shown)


def telling_trial(result: GapFound) -> int:
    """Return the number of the trial that shows the calibrated gap best: of the test trials where there are such."""
    trials, plays = result.dataset.trials, result.trials
    simulated = {k: course for k, play in enumerate(plays) if (course := play.shown["calibrated"]) is not None}
    tests = [k for k in simulated if trials[k].role == "test"]
    return max(tests or simulated, key=lambda k: _in_floors(result, k, simulated[k] - plays[k].measured), default=0)


def _in_floors(result: GapFound, k: int, rows: np.ndarray) -> float:
    """Return the mean square of what channels of trial `k` differ by, (n, n_channels), each in units of its floor."""
    names = channel_names(result.dataset, is_led(result.dataset))
    size = np.array([result.gap[n].floor or result.gap[n].calibrated or 1.0 for n in names])
    seen = rows[result.dataset.trials[k].valid]
    return float(np.mean(np.square(seen / np.maximum(size, 1e-12)))) if len(seen) else 0.0


def _own(result: GapFound, effect: Missing) -> Effect:
    """Return the effect as the amended model has it; what was in one trial only is not in the model."""
    for known in reversed(result.model.effects if effect.trial is None else ()):
        if (known.kind, known.joint, known.channel) == (effect.kind, effect.joint, effect.channel):
            return known
    assert effect.simulated is not None, "an effect of a result"
    return effect.simulated


def _values(effect: Missing, values: dict[str, float]) -> dict[str, float]:
    """Return values within the bounds of the kind, and without those for reports only, such as the start of a sensor's slip."""
    known = {p.name: p for p in catalogue()[effect.kind].parameters}
    return {n: min(max(v, known[n].min), known[n].max) for n, v in values.items() if n in known}


def _ends(effect: Missing, own: Effect) -> list[Effect]:
    """Return the effect at both ends of the interval of its size."""
    size = next((n for p in catalogue()[effect.kind].parameters for n in [p.name] if p.linear and effect.parameters[n].std), None)
    if size is None:
        return [own, own]
    interval = effect.parameters[size].interval or (own.parameters[size],) * 2
    return [own.replace(parameters=_values(effect, {**own.parameters, size: end})) for end in interval]


def _law(result: GapFound, effect: Missing, own: Effect, shown: EffectCurve) -> EffectCurve:
    """Return the effect's torque along the fit trials, averaged over cells of what it follows most closely."""
    joint = (effect.joint or 1) - 1
    found = [
        d
        for d in residual_maps.discrepancies(result.dataset, is_led(result.dataset), result.trials, "amended")
        if d.trial.role == "fit" and d.valid(joint).sum() > _FEWEST
    ]
    if not found:
        return shown
    built = _armrs.Rig(result.model, [own, *_ends(effect, own)])
    torques = [built.resisting(d.q, d.qd, np.gradient(d.qd, 1.0 / d.trial.rate, axis=0), 1.0 / d.trial.rate)[d.valid(joint)] for d in found]
    axes = {
        "speed": [d.qd[d.valid(joint), joint] for d in found],
        "angle": [d.q[d.valid(joint), joint] for d in found],
        "time": [(d.trial.t - d.trial.t[0])[d.valid(joint)] for d in found],
    }
    measured = [torque[:, 0] + d.torque[d.valid(joint), joint] for torque, d in zip(torques, found, strict=True)]
    against = max(axes, key=lambda name: _described(axes[name], [t[:, 0] for t in torques]))
    x, cells = _cells(axes[against])
    count = len(x)
    rows = np.array([_means(c, m, count) for c, m in zip(cells, measured, strict=True)])
    laws = [np.concatenate([t[:, k] for t in torques]) for k in range(3)]
    mean, low, high = (_means(np.concatenate(cells), law, count) for law in laws)
    several = np.isfinite(rows).sum(axis=0) > 1
    data, scatter = np.full(count, np.nan), np.full(count, np.nan)
    data[several] = np.nanmean(rows[:, several], axis=0)
    scatter[several] = np.nanstd(rows[:, several], axis=0, ddof=1)
    kept = np.isfinite(mean)
    return replace(
        shown,
        against=against,
        x=x[kept],
        torque=mean[kept],
        low=np.minimum(low, high)[kept],
        high=np.maximum(low, high)[kept],
        data=data[kept],
        scatter=scatter[kept],
    )


def _cells(columns: list[np.ndarray]) -> tuple[np.ndarray, list[np.ndarray]]:
    """Return middles of cells and the cell of every sample; edges go through quantiles and even steps alike, so that both are resolved."""
    together = np.concatenate(columns)
    even = np.linspace(together.min(), together.max(), _BINS + 1)
    edges = np.unique(0.5 * (even + np.quantile(together, np.linspace(0.0, 1.0, _BINS + 1))))
    if len(edges) < 2:
        edges = np.array([together.min() - 1e-9, together.max() + 1e-9])
    cells = [np.clip(np.searchsorted(edges, c, side="right") - 1, 0, len(edges) - 2) for c in columns]
    return 0.5 * (edges[1:] + edges[:-1]), cells


def _means(cells: np.ndarray, values: np.ndarray, count: int) -> np.ndarray:
    number = np.bincount(cells, minlength=count)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(number >= _FEWEST, np.bincount(cells, weights=values, minlength=count) / number, np.nan)


def _described(columns: list[np.ndarray], values: list[np.ndarray]) -> float:
    """Return the share of a torque's variance that means over cells of a column describe."""
    x, cells = _cells(columns)
    torque, cell = np.concatenate(values), np.concatenate(cells)
    number = np.maximum(np.bincount(cell, minlength=len(x)), 1)
    left = torque - (np.bincount(cell, weights=torque, minlength=len(x)) / number)[cell]
    whole = float(np.var(torque))
    return 1.0 - float(np.mean(left**2)) / whole if whole > 0 else 0.0


def _changed(result: GapFound, effect: Missing, own: Effect) -> tuple[str, np.ndarray, np.ndarray | None]:
    """Return what the effect changes in one trial: that in which it was, else the test trial in which it changes most.

    Without test trials, it is the most informative fit trial.
    """
    data, led = result.dataset, is_led(result.dataset)
    if effect.trial is None:
        asked = [k for k, t in enumerate(data.trials) if t.role == "test"] or [telling_trial(result)]
    else:
        asked = [[t.file for t in data.trials].index(effect.trial)]
    others = [e for e in result.model.all_effects if e != own]
    columns = [replace(core_trials(data)[k], role="fit") for k in asked]
    settings = core_settings(data, led, 1)
    with_it, without = (
        [play.shown["given"] for play in _armrs.play(_armrs.Rig(result.model, listed), columns, settings)]
        for listed in ([*others, own], others)
    )
    changed = {k: a - b for k, a, b in zip(asked, with_it, without, strict=True) if a is not None and b is not None}
    shown = max(changed, key=lambda k: _in_floors(result, k, changed[k]), default=asked[0])
    trial = data.trials[shown]
    t, rows = trial.t - trial.t[0], changed.get(shown)
    if rows is not None and effect.span is not None and "sensor" in catalogue()[effect.kind].where:
        rows = np.where(((t >= effect.span[0]) & (t <= effect.span[1]))[:, None], rows, 0.0)  # an error of a sensor has no after-effect
    return trial.file, t, rows
