"""The stages of the gap workflow, each by itself: compare, calibrate, (name: `find_gap`), separate, confirm."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ... import _armrs, checks
from ...catalogue import catalogue
from ...custom_effects import OwnEffect
from ...errors import BadInput, Text
from ...io.dataset import Dataset, load_dataset, naming_trials
from ...model import Contact, Model, Robot
from ...report.figures import shown
from ...report.plain import data_of, origin
from . import figures, maps, reading, suspicion
from .core_input import core_settings, core_trials
from .found import Absorbed, ChannelGap, GapFound, Place, Suspect, gap_to_dict

Source = Dataset | str | os.PathLike[str]


@dataclass(frozen=True, eq=False)
class Compared:
    """A model as given beside its data.

    Attributes
    ----------
    gap : dict of float
        Root mean square of simulated less measured by channel, over all trials that the model could be simulated on.
    where : tuple of Place
        Where they disagree most, on fit trials.
    discrepancies : tuple of Discrepancy
        The torque that the model lacks at every sample of every trial.
    warnings : tuple of str
        What a reader should know of the data.
    """

    gap: Mapping[str, float]
    where: tuple[Place, ...]
    discrepancies: tuple[maps.Discrepancy, ...] = field(repr=False)
    warnings: tuple[str, ...]

    def plot(self) -> np.ndarray:
        """Draw the torque that the model lacks over angle and speed of each joint, in the fit trials; return the Axes."""
        found = [d for d in self.discrepancies if d.trial.role == "fit"]
        if not found:
            raise BadInput("plot", Text("no fit trial that the model could be simulated on"), "one or more")
        joints = [f"joint {j}" for j in range(1, found[0].torque.shape[1] + 1)]
        return shown(lambda: figures.missing_torque(joints, {"given": found}))


@dataclass(frozen=True, eq=False)
class Calibrated:
    """A model after everything was refitted that was never exact, and a first look at what it lacks.

    Attributes
    ----------
    model : Model
        Segments and known effects refitted.
    absorbed : tuple of Absorbed
    gap : dict of ChannelGap
        On the test trials; `after` is None.
    lack : (float, float)
        Lack of fit, ratio and z; NaN without repeats.
    suspects : tuple of Suspect
        Every effect that was asked, alone and to first order, the likeliest first. One that gains more than its price may be there;
        nothing was converged, and several of them may be one.
    """

    model: Model
    absorbed: tuple[Absorbed, ...]
    gap: Mapping[str, ChannelGap]
    lack: tuple[float, float]
    suspects: tuple[Suspect, ...]
    warnings: tuple[str, ...]
    dataset: Dataset = field(repr=False)

    def plot(self) -> np.ndarray:
        """Draw what each effect alone would explain, the likeliest first; return the Axes."""
        if not self.suspects:
            raise BadInput("plot", Text("no effect that was asked"), "one or more")
        return shown(lambda: figures.first_look(self.suspects, [j.name for j in self.dataset.model.joints]))

    def to_dict(self, command: str | None = None) -> dict[str, Any]:
        """Return the result as it is written to JSON."""
        return {
            "verb": "gap --quick",
            "gap": {name: gap_to_dict(g) for name, g in self.gap.items()},
            "suspects": [dict(vars(s)) for s in self.suspects],
            "calibration": [dict(vars(a)) for a in self.absorbed],
            "lack_of_fit": {"calibrated": {"ratio": self.lack[0], "z": self.lack[1]}},
            "warnings": list(self.warnings),
            "data": data_of(self.dataset),
            "made_by": origin(command),
        }


def compare(dataset: Source, model: Model | None = None) -> Compared:
    """Compare a model with data, as it is: nothing is fitted.

    Parameters
    ----------
    dataset : Dataset or path
    model : Model, optional
        Instead of that of the data set.

    Raises
    ------
    BadInput
        For data that cannot be judged, as `find_gap`.
    """
    data = _loaded(dataset, model)
    led = reading.is_led(data)
    warnings = suspicion.examine(data, led)
    plays = _armrs.play(_armrs.Rig(data.model), core_trials(data), core_settings(data, led, 1))
    suspicion.refuse_mislabelled(data, led, plays)
    known = [p for p in plays if p["given"] is not None]
    trials = [t for t, p in zip(data.trials, plays, strict=True) if p["given"] is not None]
    found = maps.discrepancies(data.replace(trials=tuple(trials)), led, known, "given") if trials else []
    gap = {name: reading.size(known, "given", c) for c, name in enumerate(reading.channel_names(data, led))}
    return Compared({n: g for n, g in gap.items() if g is not None}, maps.places(found), tuple(found), tuple(warnings))


def calibrate(
    dataset: Source,
    *,
    effects: Sequence[OwnEffect] = (),
    threads: int | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> Calibrated:
    """Refit what was never exact, and look which effects would explain the rest: a first answer, in seconds.

    Parameters
    ----------
    dataset : Dataset or path
    effects, threads, progress
        As for `find_gap`.

    Raises
    ------
    BadInput
        For data that cannot be judged.
    SimulationError
        When the model as given cannot be simulated on a trial.
    """
    data = _loaded(dataset, None)
    led = reading.is_led(data)
    warnings = suspicion.examine(data, led)
    settings = core_settings(data, led, threads, [e.kind for e in effects])
    built, columns = _armrs.Rig(data.model, data.model.all_effects), core_trials(data)
    with naming_trials(data.trials):
        suspicion.refuse_mislabelled(data, led, _armrs.play(built, columns, settings))
        raw = _armrs.look(built, columns, settings, progress)
    return Calibrated(
        model=reading.amended(data.model, raw["calibrated"]),
        absorbed=reading.absorbed(data, raw),
        gap=reading.gaps(data, led, raw, last="calibrated"),
        lack=raw["lack"][:2],
        suspects=tuple(suspect(item) for item in raw["suspects"]),
        warnings=tuple(warnings),
        dataset=data,
    )


def confirm(result: GapFound, dataset: Source | None = None) -> dict[str, ChannelGap]:
    """Measure the gap of a result on trials that played no part in it, such as those of another day.

    Parameters
    ----------
    result : GapFound
        Its calibration, model and named effects are taken as they are; nothing is fitted but what is each trial's own: where the hand
        holds the handle, and the phase of a rhythm.
    dataset : Dataset or path, optional
        Its test trials are taken where there are such, else all; its model does not matter. That of the result when absent.

    Returns
    -------
    dict of ChannelGap
        By channel; `floor` is that of the result, and `open` says where these trials exceed what their own repeats differ by.
    """
    data = result.dataset if dataset is None else _loaded(dataset, result.dataset.model)
    led = reading.is_led(data)
    tests = data.test_trials or data.trials
    data = data.replace(trials=tuple(tests))
    columns, settings = [t | {"role": "fit"} for t in core_trials(data)], core_settings(data, led, 1)
    model, raw = result.dataset.model, result.raw
    plays = {
        "given": _armrs.play(_armrs.Rig(data.model), columns, settings),
        "calibrated": _armrs.play(as_fitted(model, raw["calibrated"]), columns, settings, own=True),
        "amended": _armrs.play(as_fitted(model, raw["amended"], raw["rhythms"]), columns, settings, own=True),
    }
    configurations = sorted({t.configuration for t in data.trials})
    groups = [configurations.index(t.configuration) for t in data.trials]
    tests_only = data.replace(trials=tuple(dataclasses.replace(t, role="test") for t in data.trials))
    tested = reading.held_out(tests_only, plays["amended"], groups, "given")
    gap = {}
    for c, name in enumerate(reading.channel_names(data, led)):
        size = {version: reading.size(listed, "given", c) for version, listed in plays.items()}
        known = result.gap[name]
        opened = tested[c][2] if tested else None
        gap[name] = ChannelGap(size["given"], size["calibrated"], size["amended"], known.floor, known.floor_std, opened)
    return gap


def as_fitted(model: Model, fitted: Mapping[str, Any], rhythms: Sequence[Any] = ()) -> _armrs.Rig:
    """Return a model for the core with everything that was fitted, the imperfections of its sensors included."""
    if model.contact is None:
        model = model.replace(contact=Contact.assumed())
    robot = model.robot
    if robot is not None:
        base = (robot.base[0] + fitted["shift"][0], robot.base[1] + fitted["shift"][1])
        robot = Robot(robot.lengths, base, robot.elbow)
    bare = reading.amended(model, {**fitted, "known": [], "named": []}, joints=False).replace(robot=robot)
    effects = [*fitted["known"], *fitted["named"], *rhythms, *fitted["calibration"]]
    return _armrs.Rig(bare, [reading.effect(entry) for entry in effects])


def suspect(item: Sequence[Any]) -> Suspect:
    """Return an effect of the core's first look."""
    (name, index, values), free, gain, price, smallest = item
    kind = catalogue()[name]
    parameters = {kind.parameters[p].name: float(values[p]) for p in free}
    return Suspect(name, *kind.place(index), parameters, kind.parameters[free[0]].unit, float(gain), float(price), float(smallest))


def _loaded(dataset: Source, model: Model | None) -> Dataset:
    data = checks.loaded("dataset", dataset, Dataset, load_dataset)
    checks.instance("model", model, Model, type(None))
    return data if model is None else data.replace(model=model)
