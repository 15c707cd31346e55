"""What the gap workflow returns."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

from ...io.dataset import Dataset
from ...model import Model
from ...tabular import Tabular, Tidy
from ..identify import Estimate


@dataclass(frozen=True)
class Value:
    """One parameter of a named effect.

    Attributes
    ----------
    value : float
    std : float or None
        Standard deviation; None for a value that was held.
    unit : str
    interval : (float, float) or None
        The 95 % interval, within what its kind allows.
    """

    value: float
    std: float | None
    unit: str
    interval: tuple[float, float] | None = None

    @classmethod
    def of(cls, value: float, std: float | None, unit: str, limits: tuple[float, float]) -> Value:
        """Return a value with its interval; `limits` are what its kind allows."""
        if std is None:
            return cls(value, None, unit)
        return cls(value, std, unit, (max(value - 1.96 * std, limits[0]), min(value + 1.96 * std, limits[1])))


@dataclass(frozen=True)
class Separation:
    """A movement that would tell two explanations apart.

    Attributes
    ----------
    waypoints_deg : tuple of tuple of float
        Joint angles [deg].
    speed_rad_s, acceleration_rad_s2 : float
        Largest of any joint.
    shape : {"trapezoid", "smooth"}
    now, then : float
        How many standard deviations apart the two are, everything refitted: by the fit trials alone, and with one such trial more.
        By the fit trials they are no further apart than their misfits say, whatever was expected to first order.
    """

    waypoints_deg: tuple[tuple[float, ...], ...]
    speed_rad_s: float
    acceleration_rad_s2: float
    shape: str
    now: float
    then: float


@dataclass(frozen=True)
class Alternative:
    """Another effect that would explain what a named one does.

    Attributes
    ----------
    kind : str
    joint, channel
        Where it acts, as for an effect of a model.
    why : str
    worse : float
        How much worse it explains the data, in units of twice the log-likelihood; a few units decide nothing.
    likeness : float
        Squared cosine between what the two would show on these movements: 1 cannot be told apart.
    separating_movement : str or None
        A movement that would tell the two apart, in words, and as numbers in `separation`.
    separation : Separation or None
    """

    kind: str
    joint: int | None
    channel: str | None
    why: str
    worse: float
    likeness: float
    separating_movement: str | None = None
    separation: Separation | None = None


@dataclass(frozen=True)
class Missing:
    """An effect that the model lacks.

    Attributes
    ----------
    kind : str
    joint, channel
        Where it acts.
    parameters : dict of Value
    p_value : float
        Probability of such a gain by chance, all questions that were asked counted.
    share : float
        Share of what can be explained that is lost without it.
    without : float or None
        What the model would be off by without it, everything else refitted: root mean square in units of what repeats differ by. None
        without repeats, and for what was set apart.
    alternatives : tuple of Alternative
    trial : str or None
        Where it was in one trial only, its file; None for what is in all of them.
    span : (float, float) or None
        When it acted there [s].
    family : str
        The family of effects that it belongs to: `dry`, `rate`, `elastic`, `two_joints`, `segment`, `frame`, `contact`, `sensor` or
        `muscle`.
    decided : bool
        False where an alternative explains the data as well.
    """

    kind: str
    joint: int | None
    channel: str | None
    parameters: Mapping[str, Value]
    p_value: float
    share: float
    alternatives: tuple[Alternative, ...] = ()
    trial: str | None = None
    span: tuple[float, float] | None = None
    family: str = ""
    decided: bool = True
    without: float | None = None

    def __str__(self) -> str:
        place = f" joint {self.joint}" if self.joint else f" {self.channel}" if self.channel else ""
        values = ", ".join(f"{n} = {v.value:.4g}" + (f" ± {v.std:.2g}" if v.std else "") + f" {v.unit}" for n, v in self.parameters.items())
        return f"{self.kind}{place}: {values}"


@dataclass(frozen=True)
class Place:
    """Somewhere that simulation and data disagree.

    Attributes
    ----------
    trial : str
    channel : str
    t_start, t_end : float
        [s]
    joint : int or None
    condition : str
        Region of movement: `dq2 > 0`, `dq2 < 0`, `dq2 = 0`.
    mean : float
        Mean difference there, in the unit of the channel.
    z : float
        The mean in its standard deviations; the correlation of residuals in time is taken into account.
    """

    trial: str
    channel: str
    t_start: float
    t_end: float
    joint: int | None
    condition: str
    mean: float
    z: float


@dataclass(frozen=True)
class Open:
    """Where the gap of a channel is open on the test trials.

    Attributes
    ----------
    trial : str
    t_start, t_end : float
        The piece of the trial that exceeds the floor by most [s].
    size : float or None
        Root mean square of simulated less measured there; None for a trial that cannot be simulated.
    """

    trial: str
    t_start: float
    t_end: float
    size: float | None


@dataclass(frozen=True)
class ChannelGap:
    """Root mean square difference of simulation and data in one channel, over the test trials.

    Attributes
    ----------
    before, calibrated, after : float or None
        With the model as given, after refitting what the tolerances allow, and with the named effects.
    floor : float or None
        What repeats of one movement differ by; None without repeats.
    floor_std : float or None
        Standard deviation of `after` less `floor` where nothing is missing: both are estimates.
    open : Open or None
        Where `after` exceeds the floor by more than these allow.
    """

    before: float | None
    calibrated: float | None
    after: float | None
    floor: float | None
    floor_std: float | None = None
    open: Open | None = None

    @property
    def closed(self) -> float | None:
        """Share of the calibrated gap above the floor that is gone, 1 where all of it is."""
        if None in (self.calibrated, self.after) or self.floor is None:
            return None
        above = self.calibrated - self.floor  # type: ignore[operator]
        return None if above <= 0 else min((self.calibrated - self.after) / above, 1.0)  # type: ignore[operator]


@dataclass(frozen=True)
class Absorbed:
    """A small imperfection that was refitted, beside twice the standard deviation that was known of it beforehand.

    For sensors that is the tolerance of the data set, for segments twice their `segment_uncertainty`.
    """

    name: str
    value: float
    promised: float
    unit: str


@dataclass(frozen=True)
class Limit:
    """An effect that was asked for and not named: the smallest that these data would have shown, and what it would explain.

    Attributes
    ----------
    kind : str
    joint, channel
        Where it would act.
    parameter : str
    at_least : float
        Smallest size of the parameter that would have been named.
    unit : str
    gain, price : float
        What it would still explain, and what it would have to, in units of twice the log-likelihood.
    """

    kind: str
    joint: int | None
    channel: str | None
    parameter: str
    at_least: float
    unit: str
    gain: float = 0.0
    price: float = 0.0


@dataclass(frozen=True)
class Suspect:
    """An effect alone, to first order.

    Attributes
    ----------
    kind : str
    joint, channel
        Where it would act.
    parameters : dict of float
        What is free in it, as it would be.
    unit : str
        Of the first.
    gain, price : float
        What it would explain, and what it must explain to be named, in units of twice the log-likelihood.
    smallest : float
        Smallest size of the first parameter that would be named.
    """

    kind: str
    joint: int | None
    channel: str | None
    parameters: Mapping[str, float]
    unit: str
    gain: float
    price: float
    smallest: float


@dataclass(frozen=True)
class Tried:
    """Effects that were added together and converged by simulation."""

    effects: tuple[tuple[str, int | None, str | None], ...]
    gain: float


@dataclass(frozen=True)
class Rung:
    """One round of the search.

    Attributes
    ----------
    tried : tuple of Tried
        What was converged by simulation, best first; gains in units of twice the log-likelihood.
    before, after : float
        Misfit before the round and with the best of them.
    """

    tried: tuple[Tried, ...]
    before: float
    after: float


@dataclass(frozen=True, eq=False)
class GapFound(Tabular):
    """The result of the gap workflow.

    Attributes
    ----------
    verdict : {"explained", "nothing_missing", "unexplained"}
    effects : tuple of Missing
        What the model lacks, that which explains most first.
    where : tuple of Place
        Where the calibrated model and the fit trials disagree, the clearest first.
    gap : dict of ChannelGap
        By channel, on the test trials.
    would_have_seen : tuple of Limit
    unexplained : float
        Share of what the calibrated model left beyond noise that is still there.
    looks_like : str or None
        Shape of what is left.
    absorbed : tuple of Absorbed
    lack : ((float, float), (float, float))
        Lack of fit, ratio and z, of the calibrated and of the amended model; NaN without repeats.
    ladder : tuple of Rung
        Rounds of the search.
    warnings : tuple of str
    model : Model
        The model with the named effects, everything refitted.
    dataset : Dataset
    raw : dict
        What the core returned, with the simulated channels of every trial.
    """

    verdict: str
    effects: tuple[Missing, ...]
    where: tuple[Place, ...]
    gap: Mapping[str, ChannelGap]
    would_have_seen: tuple[Limit, ...]
    unexplained: float
    looks_like: str | None
    absorbed: tuple[Absorbed, ...]
    lack: tuple[tuple[float, float], tuple[float, float]]
    ladder: tuple[Rung, ...]
    warnings: tuple[str, ...]
    model: Model
    dataset: Dataset
    raw: Mapping[str, Any] = field(repr=False, default_factory=dict)

    method: ClassVar[str] = "gap"
    level: ClassVar[float] = 0.95

    def __repr__(self) -> str:
        named = ", ".join(f"{e.kind}{'' if e.joint is None else f' in joint {e.joint}'}" for e in self.effects) or "no effect named"
        shown = (f"{name} {g.before:.3g} → {g.after:.3g} (floor {g.floor:.3g})" for name, g in self.gap.items() if _complete(g))
        return f"GapFound({self.dataset.name!r}: {self.verdict}; {named}; gap on test trials: {', '.join(shown) or 'not measured'})"

    def followed(self) -> tuple[Estimate, ...]:
        """Return what a history keeps: the fitted parameters of the effects that are in all trials and were decided."""
        lasting = [e for e in self.effects if e.decided and e.trial is None]
        return tuple(
            Estimate(f"{name} of {e.channel}" if e.channel else name, e.joint, e.kind, v.value, v.std, v.unit, v.interval, "data")
            for e in lasting
            for name, v in e.parameters.items()
            if v.std is not None and v.interval is not None
        )

    def tidy(self) -> Tidy:
        """Return the parameters of the named effects, one a row."""
        rows = [(e, name, value) for e in self.effects for name, value in e.parameters.items()]
        columns: dict[str, list[Any]] = {name: [getattr(e, name) for e, _, _ in rows] for name in ("kind", "joint", "channel")}
        columns |= {"parameter": [name for _, name, _ in rows]}
        columns |= {name: [getattr(value, name) for _, _, value in rows] for name in ("value", "std", "unit")}
        return Tidy(columns | {"p_value": [e.p_value for e, _, _ in rows], "share": [e.share for e, _, _ in rows]}, {})

    def to_dict(self) -> dict[str, Any]:
        """Return the result as it is written to JSON."""
        return {
            "verdict": self.verdict,
            "effects": [_without_none(dataclasses.asdict(e), keep=("joint", "channel", "without")) for e in self.effects],
            "where": [dataclasses.asdict(w) for w in self.where],
            "gap": {name: gap_to_dict(g) for name, g in self.gap.items()},
            "open": [{"channel": name, **dataclasses.asdict(g.open)} for name, g in self.gap.items() if g.open is not None],
            "would_have_seen": [dataclasses.asdict(w) for w in self.would_have_seen],
            "unexplained": {"share": self.unexplained, "looks_like": self.looks_like},
            "calibration": [dataclasses.asdict(a) for a in self.absorbed],
            "lack_of_fit": {"calibrated": _lack(self.lack[0]), "amended": _lack(self.lack[1])},
            "ladder": [dataclasses.asdict(r) for r in self.ladder],
            "warnings": list(self.warnings),
            "model": "amended.toml",
        }


def _complete(gap: ChannelGap) -> bool:
    return None not in (gap.before, gap.after, gap.floor)


def gap_to_dict(gap: ChannelGap) -> dict[str, float | None]:
    """Return the numbers of a channel's gap as they are written to JSON."""
    return {key: value for key, value in vars(gap).items() if key != "open"}


def _lack(lack: tuple[float, float]) -> dict[str, float | None]:
    return {"ratio": _finite(lack[0]), "z": _finite(lack[1])}


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _without_none(item: dict[str, Any], keep: Sequence[str]) -> dict[str, Any]:
    return {k: v for k, v in item.items() if v is not None or k in keep}
