"""Trials of an import: their raw tables, and the channels in SI units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...errors import BadInput, Text
from ...io.raw import RawTable
from ...io.raw.units import unit
from .angle_wrapping import TURN, counted_from
from .recipe import Channel, RawTrial


@dataclass(frozen=True)
class LoadedTrial:
    """A trial with its raw tables."""

    trial: RawTrial
    table: RawTable
    forces: RawTable | None
    others: tuple[float, ...] = ()
    """Shifts of the forces that their clock may have [s]."""


def by(channels: Sequence[Channel], symbol: str) -> Channel:
    """Return the channel of a symbol."""
    return next(c for c in channels if c.symbol == symbol)


def values(table: RawTable, channel: Channel) -> np.ndarray:
    """Return a channel in SI units with its sign."""
    found = table.find(channel.column)
    if found is None:
        raise BadInput("columns", Text(f"no column {channel.column!r}"), f"the column of {channel.symbol}", file=table.path)
    known = unit(channel.unit) if channel.unit else None
    raw = found.values
    if channel.lowest is not None and known is not None:
        raw = counted_from(raw, channel.lowest, TURN / known.factor)
    factor = channel.sign * (known.factor if known and not channel.symbol.startswith("emg_") else 1.0)
    return raw if factor == 1.0 else raw * factor


def arrays(read: LoadedTrial, channels: Sequence[Channel], n_joints: int) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    """Return time, raw angles and raw force of a trial."""
    t = values(read.table, by(channels, "t"))
    q = np.column_stack([values(read.table, by(channels, f"q{j}")) for j in range(1, n_joints + 1)])
    if not any(c.symbol == "Fy" for c in channels):
        return t, q, None
    return t, q, np.column_stack([on_clock(read, t, channels, s) for s in ("Fy", "Fz")])


def angles_of(read: LoadedTrial, channels: Sequence[Channel]) -> np.ndarray:
    """Return the raw angles of a trial [rad]."""
    return np.column_stack([values(read.table, c) for c in channels if c.symbol.startswith("q") and c.symbol[1:].isdigit()])


def forces_of(read: LoadedTrial, channels: Sequence[Channel]) -> tuple[np.ndarray, np.ndarray]:
    """Return time [s] and raw forces [N] of a recording of forces, by its own clock."""
    if read.forces is None:
        raise ValueError(read.trial.file)
    return values(read.forces, by(channels, "t of forces")), np.column_stack([values(read.forces, by(channels, s)) for s in ("Fy", "Fz")])


def on_clock(read: LoadedTrial, t: np.ndarray, channels: Sequence[Channel], symbol: str) -> np.ndarray:
    """Return a channel in SI units at the times of the angles."""
    channel = by(channels, symbol)
    if read.forces is None or symbol[0] not in "FM":
        return values(read.table, channel)
    clock_of_forces = values(read.forces, by(channels, "t of forces")) + read.trial.force_shift
    own = values(read.forces, channel)
    good = np.isfinite(own)
    return np.interp(t, clock_of_forces[good], own[good], left=np.nan, right=np.nan)
