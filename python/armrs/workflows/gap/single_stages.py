"""Single stages of the gap workflow: `compare`, `calibrate`, `confirm`."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from ... import _armrs, checks, interruptible, view_registry
from ..._armrs import Absorbed, ChannelGap, Place, Suspect
from ...custom_effects import OwnEffect
from ...io.dataset import Dataset, load_dataset, naming_trials
from ...io.muscle_activity import comparable
from ...model import Model
from ..result_data import data_of, origin
from . import data_checks, residual_maps
from .core_input import channel_names, core_settings, core_trials, is_led
from .gap_result import GapFound

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
        Remarks on the data.
    """

    gap: Mapping[str, float]
    where: tuple[Place, ...]
    discrepancies: tuple[residual_maps.Discrepancy, ...] = field(repr=False)
    warnings: tuple[str, ...]

    def plot(self) -> np.ndarray:
        """Draw the torque that the model lacks over angle and speed of each joint, in the fit trials; return the Axes."""
        axes: np.ndarray = view_registry.of(self).plot(self, None)
        return axes


@dataclass(frozen=True, eq=False)
class Calibrated:
    """A model after calibration, and a screening for effects that it lacks.

    Attributes
    ----------
    result : Screening
        What the core found.
    model : Model
        Segments and known effects refitted.
    absorbed : tuple of Absorbed
    gap : mapping of str to ChannelGap
        On the test trials; `after` is None.
    lack : (float, float)
        Lack of fit, ratio and z; NaN without repeats.
    suspects : tuple of Suspect
        Every effect that was tested, alone and to first order, the likeliest first. One that gains more than its price may be there;
        nothing was converged, and several may have one cause.
    """

    result: _armrs.Screening = field(repr=False)
    warnings: tuple[str, ...]
    dataset: Dataset = field(repr=False)

    @cached_property
    def model(self) -> Model:
        """Segments and known effects refitted."""
        return self.result.model

    @cached_property
    def absorbed(self) -> tuple[Absorbed, ...]:
        """Small imperfections that were refitted."""
        return self.result.absorbed

    @cached_property
    def gap(self) -> Mapping[str, ChannelGap]:
        """The gap by channel on the test trials; `after` is None."""
        return self.result.gap

    @property
    def lack(self) -> tuple[float, float]:
        """Lack of fit, ratio and z; NaN without repeats."""
        return self.result.lack

    @cached_property
    def suspects(self) -> tuple[Suspect, ...]:
        """Every effect that was tested, alone and to first order, the likeliest first."""
        return self.result.suspects

    def plot(self) -> np.ndarray:
        """Draw what each effect alone would explain, the likeliest first; return the Axes."""
        axes: np.ndarray = view_registry.of(self).plot(self, None)
        return axes

    def to_dict(self, command: str | None = None) -> dict[str, Any]:
        """Return the result as it is written to JSON."""
        return {
            "verb": "gap --quick",
            **self.result.to_dict(),
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
        For insufficient data, as `find_gap`.
    """
    data = _loaded(dataset, model)
    led = is_led(data)
    warnings = data_checks.examine(data, led)
    plays = interruptible.call(_armrs.play, _armrs.Rig(data.model), core_trials(data), core_settings(data, led, 1))
    data_checks.refuse_mislabelled(data, led, plays)
    found = residual_maps.discrepancies(data, led, plays, "given")
    gap = dict(zip(channel_names(data, led), _armrs.sizes(plays, "given"), strict=True))
    return Compared({n: g for n, g in gap.items() if g is not None}, residual_maps.places(found), tuple(found), tuple(warnings))


def calibrate(
    dataset: Source,
    *,
    effects: Sequence[OwnEffect] = (),
    threads: int | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> Calibrated:
    """Calibrate the model, and test to first order which effects would explain the residual: a first result, in seconds.

    Parameters
    ----------
    dataset : Dataset or path
    effects, threads, progress
        As for `find_gap`.

    Raises
    ------
    BadInput
        For insufficient data.
    SimulationError
        When the model as given cannot be simulated on a trial.
    """
    data = _loaded(dataset, None)
    led = is_led(data)
    warnings = data_checks.examine(data, led)
    settings = core_settings(data, led, threads, [e.kind for e in effects])
    built, columns = _armrs.Rig(data.model, data.model.all_effects), core_trials(data)
    with naming_trials(data.trials):
        data_checks.refuse_mislabelled(data, led, interruptible.call(_armrs.play, built, columns, settings))
        seen = interruptible.call_with_progress(_armrs.look, built, columns, settings, progress=progress)
    return Calibrated(seen, tuple(warnings), data)


def confirm(result: GapFound, dataset: Source | None = None) -> Mapping[str, ChannelGap]:
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
    mapping of str to ChannelGap
        By channel; `floor` is that of the result, and `open` states where these trials exceed the scatter of their own repeats.
    """
    data = result.dataset if dataset is None else _loaded(dataset, result.dataset.model)
    led = is_led(data)
    tests = data.test_trials or data.trials
    data = data.replace(trials=tests)
    columns, settings = [replace(t, role="fit") for t in core_trials(data)], core_settings(data, led, 1)
    model, found = result.dataset.model, result.result
    return _armrs.confirmed(
        _armrs.play(_armrs.Rig(data.model), columns, settings),
        _armrs.play(found.calibrated.rig(model, ()), columns, settings, own=True),
        _armrs.play(found.amended.rig(model, found.rhythms), columns, settings, own=True),
        found,
        channel_names(data, led),
    )


def _loaded(dataset: Source, model: Model | None) -> Dataset:
    data = checks.loaded("dataset", dataset, Dataset, load_dataset)
    checks.instance("model", model, Model, type(None))
    data = data.replace(trials=comparable(data.trials))
    return data if model is None else data.replace(model=model)
