"""The safety monitor of the C interface, on a whole log or sample by sample."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .. import _armrs, checks
from ..errors import BadInput, Text

QUANTITIES = ("angle", "speed", "acceleration", "force", "power")
_MICRO = 1e6
"""Microseconds in a second: the monitor counts them."""
_LONGEST = 1e9
"""A time [s] from which on it is no time of a device."""


@dataclass(frozen=True)
class Channel:
    """What one channel must not do.

    Attributes
    ----------
    quantity : {"angle", "speed", "acceleration", "force", "power"}
    min, max : float
        Smallest and largest value; infinite for none.
    fastest : float
        Fastest change from one sample to the next [unit/s].
    farthest : float
        Farthest jump from one sample to the next, however long that took.
    frozen_after : float
        How long the value may stay the same to the last bit while motion is commanded [s].
    """

    quantity: str
    min: float = -math.inf
    max: float = math.inf
    fastest: float = math.inf
    farthest: float = math.inf
    frozen_after: float = math.inf

    def __post_init__(self) -> None:
        checks.choice("quantity", self.quantity, QUANTITIES)
        for name in ("min", "max", "fastest", "farthest", "frozen_after"):
            value = float(checks.samples(name, getattr(self, name), shape=()))
            if math.isnan(value) or (name not in ("min", "max") and value <= 0.0):
                raise BadInput(name, value, "a number" if name in ("min", "max") else "a number above 0, infinite for any")
            if name == "frozen_after" and _LONGEST < value < math.inf:
                raise BadInput(name, value, f"at most {_LONGEST:g} s, or infinite for ever")
            object.__setattr__(self, name, value)

    def limits(self) -> dict[str, object]:
        """Return the fields of `armrs_channel`, times in microseconds and zero for no limit."""
        frozen = 0 if math.isinf(self.frozen_after) else max(1, round(self.frozen_after * _MICRO))
        return {**vars(self), "fastest": _zero(self.fastest), "farthest": _zero(self.farthest), "frozen_after": frozen}


def _zero(change: float) -> float:
    return 0.0 if math.isinf(change) else change


@dataclass(frozen=True)
class Stop:
    """The stop of a device: the first thing that was not allowed.

    Attributes
    ----------
    row : int
        Of the samples that were given in one call.
    reason : str
        "beyond the limit", "not finite", "frozen", "late data", "clock runs backwards", "jump" or "control loop stalled".
    channel : int or None
        From 0; None where time was at fault.
    value, limit : float
        What was found, and what it broke; times in s.
    at : float
        Time of the device [s].
    """

    row: int
    reason: str
    channel: int | None
    value: float
    limit: float
    at: float


class Monitor:
    """The monitor of the C interface. After a stop it stays stopped until `reset`.

    Parameters
    ----------
    channels : sequence of Channel
        1 to 16.
    oldest : float
        Greatest age of the data that is allowed [s].
    period : float
        Longest time from one check to the next [s], usually two control periods.

    Examples
    --------
    >>> monitor = Monitor([Channel("angle", -1.5, 0.5)], oldest=0.002, period=0.002)
    >>> monitor.check(0.001, [0.2])
    >>> monitor.check(0.002, [0.6]).reason
    'beyond the limit'
    """

    def __init__(self, channels: Iterable[Channel], oldest: float, period: float) -> None:
        self.channels = checks.instances("channels", channels, Channel)
        times = [checks.number(name, t, above=0.0, most=_LONGEST, unit="s") for name, t in (("oldest", oldest), ("period", period))]
        self.oldest, self.period = times
        self._inner = _armrs.OnlineMonitor([c.limits() for c in self.channels], *(max(1, round(t * _MICRO)) for t in times))

    def __repr__(self) -> str:
        return f"Monitor({len(self.channels)} channels, data at most {self.oldest:g} s old, a check every {self.period:g} s at least)"

    def check(self, now: float, values: ArrayLike, *, stamp: float | None = None, moving: bool = False) -> Stop | None:
        """Check one control period; return the stop, in every period from the first fault on.

        Parameters
        ----------
        now : float
            The clock [s], from 0 on.
        values : array_like, shape (n_channels,)
            NaN is a value that stops.
        stamp : float, optional
            When they were measured, by the same clock [s]; now when absent.
        moving : bool
            Whether motion is commanded that must change the channels.
        """
        row = checks.samples("values", values, shape=(len(self.channels),))
        clock = [
            checks.number(name, t, least=0.0, most=_LONGEST, unit="s")
            for name, t in (("now", now), ("stamp", now if stamp is None else stamp))
        ]
        return self._run(np.array([clock[0]]), np.array([clock[1]]), row[None, :], np.full((1, len(row)), checks.flag("moving", moving)))

    def reset(self) -> None:
        """Let a stopped device start again; nothing is remembered of the time before."""
        self._inner.reset()

    def _run(self, now: np.ndarray, stamp: np.ndarray, values: np.ndarray, moving: np.ndarray) -> Stop | None:
        times = tuple(np.rint(t * _MICRO).astype(np.uint64) for t in (now, stamp))
        found = self._inner.run((times[0], times[1]), np.ascontiguousarray(values), np.ascontiguousarray(moving))
        if found is None:
            return None
        row, reason, channel, value, limit, at = found
        return Stop(row, reason, channel, value, limit, at / _MICRO)


def watch(
    t: ArrayLike,
    values: ArrayLike,
    channels: Iterable[Channel],
    *,
    period: float,
    oldest: float | None = None,
    moving: ArrayLike | None = None,
) -> Stop | None:
    """Return where a monitor would have stopped a device, or None where it would not.

    Parameters
    ----------
    t : array_like, shape (n,)
        Clock of the device [s]; it may run backwards, which stops. Counted from the earliest.
    values : array_like, shape (n, n_channels)
    channels : sequence of Channel
    period : float
        Longest time from one check to the next [s].
    oldest : float, optional
        Greatest age of data [s]; a period when absent.
    moving : array_like of bool, shape (n,), optional
        Where motion is commanded; nowhere when absent, so that nothing counts as frozen.
    """
    monitor = Monitor(channels, period if oldest is None else oldest, period)
    clock = checks.numbers("t", t, "s", shape=(None,))
    if len(clock) and np.ptp(clock) > _LONGEST:
        raise BadInput("t", Text(f"{np.ptp(clock):.3g} s"), f"a log of at most {_LONGEST:g} s")
    n, count = len(clock), len(monitor.channels)
    rows = checks.samples("values", values, shape=(n, count))
    commanded = np.zeros(n, dtype=bool) if moving is None else np.asarray(moving)
    if commanded.dtype != bool or commanded.shape != (n,):
        raise BadInput("moving", Text(f"{commanded.dtype} of shape {commanded.shape}"), f"true or false, shape ({n},)")
    clock = clock - clock.min() if n else clock
    return monitor._run(clock, clock, rows, np.repeat(commanded[:, None], count, axis=1))
