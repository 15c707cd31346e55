"""The whole gap workflow, `find_gap`: which effect is missing, and how much it reduces the gap."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable, Sequence

from ... import _armrs, checks, interruptible
from ...custom_effects import OwnEffect
from ...errors import SimulationError
from ...io.dataset import Dataset, load_dataset, naming_trials
from ...io.muscle_activity import comparable
from ...result_warnings import with_warnings
from . import data_checks, discriminating_movements, residual_maps
from .core_input import core_settings, core_trials, is_led
from .gap_result import GapFound


@with_warnings
def find_gap(
    dataset: Dataset | str | os.PathLike[str],
    *,
    effects: Sequence[OwnEffect] = (),
    separate: bool = True,
    threads: int | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> GapFound:
    """Find where a model and its data disagree, and which effect is missing.

    Everything is chosen and fitted on the fit trials; the gap is measured on the test trials.

    Parameters
    ----------
    dataset : Dataset or path
    effects : sequence of OwnEffect
        User-defined kinds (`armrs.own_effect`) that are tested besides the catalogue.
    separate : bool
        Whether to search for movements that would distinguish a named effect from its alternatives.
    threads : int, optional
        All cores when absent; the result does not depend on it.
    progress : callable, optional
        Called with the name of the stage and the share that is done, 0 to 1.

    Returns
    -------
    GapFound

    Raises
    ------
    BadInput
        For data that cannot be used: wrong units, swapped channels, a reversed force, trials that are copies.
    SimulationError
        When the model cannot be simulated on a trial, and neither can joint torques in measured motion be compared.

    Notes
    -----
    Where the simulated arm does not follow the measured one at all, as a free wrist may, joint torques in measured motion are compared
    instead; the first of the warnings states that.

    Examples
    --------
    >>> import armrs
    >>> armrs.find_gap("session").verdict  # doctest: +SKIP
    'explained'
    """
    dataset = checks.loaded("dataset", dataset, Dataset, load_dataset)
    dataset = dataset.replace(trials=comparable(dataset.trials))
    checks.flag("separate", separate)
    if progress is not None:
        checks.function("progress", progress)
    effects = checks.instances("effects", effects, OwnEffect)
    own = [e.kind for e in effects]
    try:
        result = _searched(dataset, own, threads, progress)
    except SimulationError as error:
        if not is_led(dataset):
            raise
        # The arm that robot angles would lead is not simulated then: the torques of its measured motion are compared.
        still = dataset.replace(trials=tuple(dataclasses.replace(t, robot_q=None) for t in dataset.trials))
        result = _searched(still, own, threads, progress)
        warned = result.result.replace(warnings=(_torques_instead(error), *result.warnings))
        result = dataclasses.replace(result, result=warned)
    return discriminating_movements.separate(result, threads=threads, progress=progress) if separate else result


def _searched(dataset: Dataset, own: Sequence[str], threads: int | None, progress: Callable[[str, float], None] | None) -> GapFound:
    led = is_led(dataset)
    settings = core_settings(dataset, led, threads, own)
    columns = core_trials(dataset)
    built = _armrs.Rig(dataset.model, dataset.model.all_effects)
    warnings = data_checks.examine(dataset, led)
    with naming_trials(dataset.trials):
        data_checks.refuse_mislabelled(dataset, led, interruptible.call(_armrs.play, built, columns, settings))
        result = interruptible.call_with_progress(_armrs.find_gap, built, columns, settings, progress=progress)

    def lacking(version: str) -> list[residual_maps.Discrepancy]:
        return residual_maps.discrepancies(dataset, led, result.trials, version)

    looks_like = residual_maps.shape(lacking("amended")) if result.verdict == "unexplained" else None
    wrong = data_checks.refuted(dataset, result.model)
    warned = [*(line for line in warnings if line not in wrong), *result.warnings]
    told = result.replace(places=residual_maps.places(lacking("calibrated")), looks_like=looks_like, warnings=tuple(warned))
    return GapFound(told, dataset)


def _torques_instead(error: SimulationError) -> str:
    return (
        f"The simulated arm does not follow the measured one ({error}): joint torques in measured motion are compared instead of angles "
        "and forces. Effects of the contact and of the robot are not tested then."
    )
