"""The log of a device processed by the estimator: estimates, refused samples, compensation torques."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .. import _armrs, checks
from ..errors import BadInput, Text
from ..io.trial import Trial, refuse_moving_base
from ..model import Model, load_model
from ..tabular import Labelled, Series, Tabular, Tidy
from .estimator import STATUSES, Estimator, OnlineEstimate
from .log import Log, load_log
from .settings import Settings, default_settings

RECORDED = 0.01
"""Time between two recorded states [s], unless a number of periods is given."""
NO_REFUSAL = ("taken", "resting", "settling")


@dataclass(frozen=True, eq=False)
class Replay(Tabular, Series):
    """What an estimator made of a log; rows are states, recorded at some of the control periods.

    Attributes
    ----------
    t : ndarray, shape (n,)
        Time of each recorded state, as in the log [s].
    status : ndarray of str, shape (n_periods,)
        What became of the sample of every control period, one of `armrs.online.estimator.STATUSES`; "missing" where the log has none.
    values, std : ndarray, shape (n, n_unknowns)
        The unknowns, in the order of `estimates`.
    decided_by : ndarray of str, shape (n, n_unknowns)
    torque, torque_sd : ndarray, shape (n, n_joints)
        What carries the arm at rest at the measured angles [N m]; NaN where the device would give none.
    residual : ndarray, shape (n, n_joints)
        Usual size of the torque that is not explained [N m].
    excess, age : ndarray, shape (n,)
        See `Health`; age in s.
    estimates : tuple of OnlineEstimate
        After the last control period.
    restarts : int
    start : float
        Time of the first control period [s].
    model : Model
    settings : Settings
    """

    t: np.ndarray
    status: np.ndarray = field(repr=False)
    values: np.ndarray = field(repr=False)
    std: np.ndarray = field(repr=False)
    decided_by: np.ndarray = field(repr=False)
    torque: np.ndarray = field(repr=False)
    torque_sd: np.ndarray = field(repr=False)
    residual: np.ndarray = field(repr=False)
    excess: np.ndarray = field(repr=False)
    age: np.ndarray = field(repr=False)
    estimates: tuple[OnlineEstimate, ...] = field(repr=False)
    restarts: int = field(repr=False)
    start: float = field(repr=False)
    model: Model = field(repr=False)
    settings: Settings = field(repr=False)

    def __repr__(self) -> str:
        by_data = sum(e.decided_by == "data" for e in self.estimates)
        return (
            f"Replay({len(self.status)} periods of {self.settings.period:.6g} s, {self.refused} refused; "
            f"{by_data} of {len(self.estimates)} unknowns by data)"
        )

    @property
    def counts(self) -> dict[str, int]:
        """How many samples became what; what became of none is left out."""
        return {name: int(np.count_nonzero(self.status == name)) for name in STATUSES if (self.status == name).any()}

    @property
    def refused(self) -> int:
        """Control periods without a sample, or with one that was refused."""
        return sum(count for name, count in self.counts.items() if name not in NO_REFUSAL)

    def tidy(self) -> Tidy:
        """Return the recorded states, one a row."""
        columns: dict[str, np.ndarray] = {"t": self.t}
        units = {"t": "s", "age": "s"}
        for e, values, std, by in zip(self.estimates, self.values.T, self.std.T, self.decided_by.T, strict=True):
            name = _column(e)
            columns |= {name: values, f"{name}_std": std, f"{name}_by": by}
            units |= {name: e.unit, f"{name}_std": e.unit}
        for name in ("torque", "torque_sd", "residual"):
            for j, values in enumerate(getattr(self, name).T, start=1):
                columns[f"{name}{j}"], units[f"{name}{j}"] = values, "N m"
        return Tidy(columns | {"excess": self.excess, "age": self.age}, units)

    def labelled(self) -> tuple[Mapping[str, Any], Mapping[str, Labelled]]:
        """Return the recorded states with the names of their dimensions."""
        joint, unknown = ("time", "joint"), ("time", "unknown")
        names = [_column(e) for e in self.estimates]
        coordinates = {"time": self.t, "joint": [j.name for j in self.model.joints], "unknown": names}
        quantities = {name: Labelled(joint, getattr(self, name), "N m") for name in ("torque", "torque_sd", "residual")}
        quantities |= {name: Labelled(unknown, getattr(self, name), "") for name in ("values", "std", "decided_by")}
        return coordinates, quantities | {
            "excess": Labelled(("time",), self.excess, ""),
            "age": Labelled(("time",), self.age, "s"),
        }

    def to_dict(self) -> dict[str, Any]:
        """Return counts, settings and the last state as plain data."""
        return {
            "periods": len(self.status),
            "statuses": self.counts,
            "refused": self.refused,
            "estimates": [dict(vars(e)) for e in self.estimates],
            "residual_Nm": self.residual[-1].tolist() if len(self.t) else [],
            "excess": float(self.excess[-1]) if len(self.t) else 1.0,
            "untrusted_share": float(np.isnan(self.torque).any(axis=1).mean()) if len(self.t) else 0.0,
            "restarts": self.restarts,
            "settings": dict(vars(self.settings)),
        }


def _column(estimate: OnlineEstimate) -> str:
    """Return the name of an unknown as a column: `X1`, `viscous_viscosity_1`."""
    name = estimate.name.replace(" ", "_")
    return f"{name}_{estimate.joint}" if "_" in name else name


def replay(
    log: Log | Trial | str | os.PathLike[str],
    model: Model | str | os.PathLike[str],
    *,
    settings: Settings | None = None,
    force_on: str | None = None,
    every: int | None = None,
) -> Replay:
    """Run the estimator of a device on a log, and record its states.

    Control periods without a sample in the log are missing samples, as the device would count them. Constant errors of the sensors that the
    model has are taken out of the log first, as `armrs_model_calibrate` does.

    Parameters
    ----------
    log : Log, Trial or path
        A path is read by `load_log`. Of a trial its samples on the uniform grid are taken, so that short gaps are bridged in it.
    model : Model or path
        The arm that the device is given: two or three segments.
    settings : Settings, optional
        `default_settings` at the rate of the log when absent.
    force_on : {"arm", "robot"}, optional
        What the forces of a file act on.
    every : int, optional
        Control periods from one recorded state to the next; 10 ms when absent.

    Raises
    ------
    BadInput
        For a log whose joints or rate are not those of model and settings, settings out of range, and effects that a device cannot apply.

    Examples
    --------
    >>> replay("log.csv", "identified.toml", force_on="arm").plot("health")  # doctest: +SKIP
    """
    loaded = checks.loaded("model", model, Model, load_model)
    data = _log(log, loaded, force_on)
    if data.q.shape[1] != loaded.n_joints:
        raise BadInput("log", Text(f"{data.q.shape[1]} joints"), f"{loaded.n_joints}, as the model has")
    data = data.calibrated(loaded)
    if settings is None:
        settings = default_settings(loaded, data.period)
    checks.instance("settings", settings, Settings)
    estimator = Estimator(loaded, settings)
    places = data.places(settings.period)
    count = int(places[-1]) + 1
    if every is None:
        every = min(max(1, round(RECORDED / settings.period)), count)
    every = checks.whole("every", every, least=1)
    told = estimator.run(*_laid_out(data, places, settings.period), every)
    recorded = np.arange(every - 1, count, every)
    decisions = np.array(_armrs.DECISIONS)
    return Replay(
        t=data.t[0] + settings.period * recorded,
        status=np.array(STATUSES)[told["status"]],
        values=told["value"],
        std=told["sd"],
        decided_by=decisions[told["decided"]],
        torque=told["torque"],
        torque_sd=told["torque_sd"],
        residual=told["residual"],
        excess=told["excess"],
        age=told["age"],
        estimates=estimator.estimates,
        restarts=estimator.health.restarts,
        start=float(data.t[0]),
        model=loaded,
        settings=settings,
    )


def _log(log: Log | Trial | str | os.PathLike[str], model: Model, force_on: str | None) -> Log:
    if not isinstance(log, (Log, Trial)):
        checks.path("log", log, Log, Trial)
        return load_log(log, model.n_joints, force_on=force_on)
    if force_on is not None:
        raise BadInput("force_on", force_on, "a file of forces beside it: a log or trial has forces on the arm")
    if isinstance(log, Log):
        return log
    refuse_moving_base([log])
    return Log(log.t, log.q, log.force_on_arm, log.moment_on_arm, log.tau)


def _laid_out(
    log: Log, places: np.ndarray, period: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray | None, np.ndarray]:
    """Return times, angles, torques, loads of the hand and leading angles in every control period, and which periods have no sample."""
    count = int(places[-1]) + 1

    def spread(values: np.ndarray) -> np.ndarray:
        whole = np.full((count, values.shape[1]), np.nan)
        whole[places] = values
        return whole

    missing = np.ones(count, dtype=bool)
    missing[places] = log.empty
    lead = None if log.lead is None else spread(log.lead)
    return period * np.arange(count), spread(log.q), spread(log.torque), spread(log.hand), lead, missing
