"""Movements whose path between the samples is not known are warned of."""

import dataclasses

import numpy as np
import pytest

import armrs
from armrs.io.dataset import Dataset
from armrs.workflows.gap.core_input import core_settings
from armrs.workflows.gap.data_checks import examine
from armrs.workflows.gap.unresolved_motion import unresolved, unresolved_movements
from gap_sessions import session


def jolted(data: Dataset, names: set[str], size: float) -> Dataset:
    """Return a data set whose robot jolts by an angle [rad] every few samples in some movements, alike in all repeats."""

    def one(trial: armrs.Trial) -> armrs.Trial:
        if trial.configuration not in names or trial.robot_q is None:
            return trial
        jolts = size * (np.arange(len(trial)) % 5 == 0)
        return dataclasses.replace(trial, robot_q=trial.robot_q + jolts[:, None])

    return data.replace(trials=tuple(one(t) for t in data.trials))


def test_a_smooth_path_is_known_between_the_samples() -> None:
    data = session()
    assert unresolved(data, True) == []
    assert unresolved(jolted(data, {data.trials[0].configuration}, 1e-3), False) == []


def test_a_movement_with_jolts_is_named() -> None:
    data = session()
    first = data.trials[0].configuration
    [line] = unresolved(jolted(data, {first}, 1e-3), True)
    assert line.count("where repeats differ by") == 1
    assert f"the force in {first!r} (by " in line and "record the robot at a higher rate" in line
    assert line in examine(jolted(data, {first}, 1e-3), True)


def test_samples_of_a_movement_with_jolts_weigh_less() -> None:
    data = session()
    first = data.trials[0].configuration
    jolting = jolted(data, {first}, 1e-3)
    [(missed, differ)] = unresolved_movements(jolting).values()
    weights = {t.configuration: w for t, w in zip(jolting.trials, core_settings(jolting, True, 1).weights, strict=True)}
    assert weights.pop(first) == pytest.approx((1.0 + (missed / differ) ** 2) ** -0.5)
    assert set(weights.values()) == {1.0}
    assert set(core_settings(jolting, False, 1).weights) == {1.0}


def test_the_force_that_is_foretold_grows_with_the_stiffness_of_the_contact() -> None:
    data = session()
    data = jolted(data, {data.trials[0].configuration}, 1e-3)

    def foretold(stiffness: float) -> float:
        model = data.model.replace(contact=data.model.contact.replace(stiffness=(stiffness, stiffness)))
        [line] = unresolved(data.replace(model=model), True)
        return float(line.split("(by ")[1].split(" N")[0])

    assert foretold(4e4) == pytest.approx(2.0 * foretold(2e4), rel=0.1)


@pytest.mark.parametrize("lost", [slice(None), slice(10, 20)])
def test_missing_robot_angles_tell_nothing_of_the_path(lost: slice) -> None:
    data = session()
    first, *rest = data.trials
    angles = first.robot_q.copy()
    angles[lost] = np.nan
    broken = dataclasses.replace(first, robot_q=angles, valid=np.isfinite(angles).all(axis=1))
    assert unresolved(data.replace(trials=(broken, *rest)), True) == []
