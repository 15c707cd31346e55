"""Summary of the results of a sweep, read from disk in bounded pieces."""

from __future__ import annotations

import math
import re
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .store import Store

SAMPLE = 20_000
"""So many values of each quantity are kept, the first ones: for percentiles and figures."""
_REASONS = 5
_ROUNDING = 1e-12
"""Values that differ by less than this, relative to their mean, are the same."""
_FOUND = re.compile(r"found [^,]*,")
"""What differs between cases that failed for one reason."""


@dataclass
class Moments:
    """Number, mean and spread of values that come in pieces."""

    n: int = 0
    mean: float = 0.0
    squares: float = 0.0

    def add(self, values: np.ndarray) -> None:
        """Take finite values; what is not finite is left out."""
        values = values[np.isfinite(values)]
        if not len(values):
            return
        n, mean = len(values), float(np.mean(values))
        shift, total = mean - self.mean, self.n + n
        self.squares += float(np.sum((values - mean) ** 2)) + shift**2 * self.n * n / total
        self.mean += shift * n / total
        self.n = total

    @property
    def std(self) -> float | None:
        """Standard deviation of one value; 0 where all are the same to rounding."""
        if self.n < 2:
            return None
        found = math.sqrt(self.squares / (self.n - 1))
        return found if found > _ROUNDING * abs(self.mean) else 0.0

    @property
    def average(self) -> float | None:
        """The mean, where there is one."""
        return self.mean if self.n else None


@dataclass
class Quantity:
    """One quantity over all cases."""

    name: str
    kind: str
    joint: int | None
    unit: str
    value: Moments = field(default_factory=Moments)
    truth: Moments = field(default_factory=Moments)
    error: Moments = field(default_factory=Moments)
    square: Moments = field(default_factory=Moments)
    std: Moments = field(default_factory=Moments)
    inside: Moments = field(default_factory=Moments)
    again: Moments = field(default_factory=Moments)
    again_inside: Moments = field(default_factory=Moments)
    decided_by: Counter[str] = field(default_factory=Counter)
    values: list[np.ndarray] = field(default_factory=list)
    truths: list[np.ndarray] = field(default_factory=list)

    def add(self, rows: dict[str, np.ndarray], decided_by: list[str]) -> None:
        """Take the columns of some cases."""
        value, truth = rows["value"], rows["truth"]
        self.value.add(value)
        self.truth.add(truth)
        self.error.add(value - truth)
        self.square.add((value - truth) ** 2)
        self.std.add(rows["std"])
        self.inside.add(_inside(truth, rows["low"], rows["high"]))
        self.again.add(rows["bootstrap_std"])
        self.again_inside.add(_inside(truth, rows["bootstrap_low"], rows["bootstrap_high"]))
        self.decided_by.update(decided_by)
        room = SAMPLE - sum(map(len, self.values))
        if room > 0:
            self.values.append(value[:room])
            self.truths.append(truth[:room])

    def to_dict(self, level: float) -> dict[str, Any]:
        """Return the summary as plain data, in the unit of the quantity; coverage is a share of the cases."""
        sample = np.concatenate(self.values)
        tail = 0.5 * (1.0 - level)
        return {
            "name": self.name,
            "kind": self.kind,
            "joint": self.joint,
            "unit": self.unit,
            "cases": self.value.n,
            "decided_by": dict(sorted(self.decided_by.items())),
            "value": {"mean": self.value.average, "std": self.value.std, "interval": np.quantile(sample, [tail, 1.0 - tail]).tolist()},
            "truth": {"mean": self.truth.average, "std": self.truth.std},
            "error": {
                "mean": self.error.average,
                "std": self.error.std,
                "rms": None if not self.square.n else math.sqrt(self.square.mean),
            },
            "claimed_std": self.std.average,
            "coverage": self.inside.average,
            "bootstrap": {"std": self.again.average, "coverage": self.again_inside.average} if self.again.n else None,
        }


@dataclass(frozen=True)
class Summary:
    """What a sweep came to.

    Attributes
    ----------
    quantities : list of Quantity
        In the order in which they first appear.
    cases : dict
        Counts and forces, as plain data.
    """

    quantities: list[Quantity]
    cases: dict[str, Any]


def summarise(store: Store) -> Summary:
    """Read the final files once, a row group at a time."""
    return Summary(_quantities(store), _cases(store))


def _quantities(store: Store) -> list[Quantity]:
    found: dict[tuple[str, str, int | None], Quantity] = {}
    numbers = ("value", "truth", "std", "low", "high", "bootstrap_std", "bootstrap_low", "bootstrap_high")
    for table in store.tables("estimates"):
        keys = list(zip(*(table.column(c).to_pylist() for c in ("name", "kind", "joint")), strict=True))
        units, decided = table.column("unit").to_pylist(), table.column("decided_by").to_pylist()
        columns = {c: table.column(c).to_numpy().astype(float) for c in numbers}
        places: dict[tuple[str, str, int | None], list[int]] = {}
        for k, key in enumerate(keys):
            places.setdefault(key, []).append(k)
        for key, rows in places.items():
            quantity = found.setdefault(key, Quantity(*key, units[rows[0]]))
            quantity.add({c: values[rows] for c, values in columns.items()}, [decided[k] for k in rows])
    return list(found.values())


def _cases(store: Store) -> dict[str, Any]:
    counts: Counter[str] = Counter()
    reasons: Counter[str] = Counter()
    force, rms, largest = Moments(), Moments(), -math.inf
    for table in store.tables("cases"):
        counts.update(table.column("status").to_pylist())
        reasons.update(_FOUND.sub("found …,", reason) for reason in table.column("reason").to_pylist() if reason is not None)
        counts["stopped"] += sum(table.column("stopped").to_numpy(zero_copy_only=False) > 0)
        if "sound" in table.column_names:
            sound = table.column("sound").to_pylist()
            counts["sound"] += sum(flag is True for flag in sound)
            counts["unsound"] += sum(flag is False for flag in sound)
        peaks = table.column("force_max_N").to_numpy().astype(float)
        force.add(peaks)
        rms.add(table.column("force_rms_N").to_numpy().astype(float))
        largest = max(largest, float(np.nanmax(peaks, initial=-math.inf)))
    return {
        "cases": store.sweep.cases,
        "failed": counts["failed"],
        "reasons": [{"cases": n, "reason": reason} for reason, n in reasons.most_common(_REASONS)],
        "with_stopped_trials": counts["stopped"],
        "sound": counts["sound"],
        "not_sound": counts["unsound"],
        "force": {"peak_mean_N": force.average, "peak_std_N": force.std, "peak_largest_N": largest, "rms_mean_N": rms.average},
    }


def _inside(truth: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Return 1 where the truth is in the interval, 0 where it is not, NaN where one of them is missing."""
    known = np.isfinite(truth) & np.isfinite(low) & np.isfinite(high)
    return np.where(known, ((low <= truth) & (truth <= high)).astype(float), np.nan)
