"""Parameters of effects fitted by simulation to one recorded run."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from .. import _armrs, checks
from .._armrs import RunFit as RunFit
from ..catalogue import catalogue
from ..errors import BadInput
from ..io.trial import Trial
from ..model import Effect, Model, load_model
from ..tabular import Framed, Tidy
from .core_experiment import INTEGRATORS, CoreRun, driven
from .movement import Movement
from .simulate import DEFAULT_RATE
from .stiction import DEFAULT_DT


@dataclass(frozen=True, eq=False)
class SimulationFit(Framed):
    """What a fit by simulation found.

    Attributes
    ----------
    values, sd : dict of str to float
        Estimate of every free parameter and its standard deviation, if the noise is white and as large as stated; in the
        parameter's own unit. Infinite where the record does not determine it.
    at_bound : tuple of str
        Parameters that a bound holds.
    residual_rms : float
        Root mean square of the residuals in units of the noise; about 1 where the model describes the record.
    rounds : int
        Batches of simulations.
    settled : bool
        Whether the estimate stands; false where the rounds ran out.
    effects : tuple of Effect
        All effects of the model with the estimates in place.
    """

    values: dict[str, float]
    sd: dict[str, float]
    at_bound: tuple[str, ...]
    residual_rms: float
    rounds: int
    settled: bool
    effects: tuple[Effect, ...] = field(repr=False)

    def tidy(self) -> Tidy:
        """Return the free parameters, one a row."""
        names = list(self.values)
        columns = {"value": [self.values[n] for n in names], "std": [self.sd[n] for n in names]}
        return Tidy({"name": names, **columns, "at_bound": [n in self.at_bound for n in names]}, {})


def fit_by_simulation(
    model: Model | str | os.PathLike[str],
    drive: Movement | Trial | None,
    q: np.ndarray,
    force_on_arm: np.ndarray,
    free: Sequence[str] | Mapping[str, tuple[float, float]],
    *,
    angle_noise: float,
    force_noise: float,
    integrator: str = "rk4",
    dt: float = DEFAULT_DT,
    rate: float = DEFAULT_RATE,
) -> SimulationFit:
    """Fit parameters of effects so that a simulated run comes closest to a recorded one.

    The fit starts from the model's values, and from others where a parameter ends at a bound or the rounds run out. The closest run counts.

    Parameters
    ----------
    model : Model or path
    drive : Movement, Trial or None
        What led the arm, as in `simulate`; the run starts in equilibrium, or with the trial.
    q : ndarray, shape (n, n_joints)
        Recorded angles, from the start of the run at `rate` [rad].
    force_on_arm : ndarray, shape (n, 2)
        Recorded contact force [N].
    free : sequence of str, or dict of str to (least, greatest)
        Parameters as `"viscous1 viscosity"`: kind and joint of an effect of the model, and its parameter. Bounds, or the catalogue's.
    angle_noise, force_noise : float
        Standard deviations of the noise, which weigh angles against forces [rad, N].
    integrator, dt, rate
        As in `simulate`.

    Returns
    -------
    SimulationFit

    Raises
    ------
    BadInput
        For a parameter that the model lacks, and records that do not fit the run.
    IdentificationError
        When there is no solution.
    SimulationError
        When the first run stops early.
    """
    model = checks.loaded("model", model, Model, load_model)
    checks.instance("drive", drive, Movement, Trial, type(None))
    checks.choice("integrator", integrator, INTEGRATORS)
    positive = {"dt": (dt, "s"), "rate": (rate, "Hz"), "angle_noise": (angle_noise, "rad"), "force_noise": (force_noise, "N")}
    for name, (value, unit) in positive.items():
        checks.number(name, value, above=0.0, unit=unit)
    angles, force = _recorded(q, force_on_arm, len(model.segments))
    effects = list(model.all_effects)
    names = list(checks.texts("free", list(free) if isinstance(free, Mapping) else free, "parameters"))
    places = [_place(effects, name) for name in names]
    bounds = [_bounds(name, free[name]) if isinstance(free, Mapping) else place[2:] for name, place in zip(names, places, strict=True)]
    start = drive.q[0].tolist() if isinstance(drive, Trial) else None
    settings = CoreRun(integrator, dt, 1.0 / rate, duration=(len(angles) - 1) / rate, q=start)
    recorded: _armrs._Records = {
        "q": np.ascontiguousarray(angles),
        "force_on_arm": np.ascontiguousarray(force),
        "angle_noise": angle_noise,
        "force_noise": force_noise,
    }
    limits = [(effect, parameter, float(low), float(high)) for (effect, parameter, *_), (low, high) in zip(places, bounds, strict=True)]
    found = _armrs.fit_by_simulation(_armrs.Rig(model), driven(model, drive, "compliant"), settings, recorded, limits)
    for (index, parameter, *_), value in zip(places, found.values, strict=True):
        effect = effects[index]
        key = catalogue()[effect.kind].parameters[parameter].name
        effects[index] = Effect(effect.kind, effect.joint, effect.channel, {**effect.parameters, key: value})
    return SimulationFit(
        values=dict(zip(names, found.values, strict=True)),
        sd=dict(zip(names, found.sd, strict=True)),
        at_bound=tuple(name for name, active in zip(names, found.active, strict=True) if active),
        residual_rms=float(np.sqrt(found.squares / found.residuals)),
        rounds=found.rounds,
        settled=found.settled,
        effects=tuple(effects),
    )


def _recorded(q: np.ndarray, force_on_arm: np.ndarray, joints: int) -> tuple[np.ndarray, np.ndarray]:
    """Return recorded angles and forces as arrays with a row for each sample."""
    angles = checks.numbers("q", q, "rad")
    force = checks.numbers("force_on_arm", force_on_arm, "N")
    for name, values, columns in (("q", angles, joints), ("force_on_arm", force, 2)):
        if values.ndim != 2 or values.shape[1] != columns or len(values) != len(angles) or len(values) < 2:
            raise BadInput(name, f"an array of shape {values.shape}", f"rows of {columns}, as many of q as of force_on_arm, two or more")
    return angles, force


def _bounds(name: str, bounds: tuple[float, float]) -> tuple[float, float]:
    """Return bounds of a parameter, least before greatest."""
    low, high = checks.pair(f"bounds of {name}", bounds)
    if not low <= high:
        raise BadInput(f"bounds of {name}", (low, high), "least before greatest")
    return low, high


def _place(effects: list[Effect], name: str) -> tuple[int, int, float, float]:
    """Return index of effect and parameter of a name, and the bounds of the catalogue."""
    known = {}
    for index, effect in enumerate(effects):
        for number, parameter in enumerate(catalogue()[effect.kind].parameters):
            label = effect.joint if effect.joint is not None else effect.channel or ""
            known[f"{effect.kind}{label} {parameter.name}"] = (index, number, parameter.min, parameter.max)
    if name not in known:
        raise BadInput("free parameter", name, ", ".join(known) or "a parameter of an effect, which this model has none of")
    return known[name]
