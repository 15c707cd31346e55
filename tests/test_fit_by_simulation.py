import numpy as np
import pytest

import armrs
from armrs.demo import true_model

MOVEMENT = armrs.Movement(np.radians([[-60, 60], [-48, 70], [-60, 60]]), speed=0.5, acceleration=2.0)
NOISE = {"angle_noise": 1e-3, "force_noise": 0.1}
FREE = ["viscous1 viscosity", "viscous2 viscosity"]


def model(viscosity):
    joints = tuple(j.replace(viscosity=v, stiffness=0.4) for j, v in zip(true_model().joints, viscosity, strict=True))
    return true_model().replace(joints=joints)


@pytest.fixture(scope="module")
def record():
    return armrs.simulate(model([0.3, 0.12]), MOVEMENT)


def test_recovers_what_made_the_record(record):
    # Stored by columns, as arrays of pandas are.
    q, force = np.asfortranarray(record.q), np.asfortranarray(record.force_on_arm)
    fitted = armrs.fit_by_simulation(model([0.1, 0.1]), MOVEMENT, q, force, FREE, **NOISE)
    assert fitted.settled
    assert fitted.residual_rms < 1e-4
    assert fitted.values == pytest.approx(dict(zip(FREE, [0.3, 0.12], strict=True)), rel=1e-5)
    assert all(0 < sd < 0.1 for sd in fitted.sd.values())
    assert {e.parameters["viscosity"] for e in fitted.effects if e.kind == "viscous"} == set(fitted.values.values())


def test_bound_is_said(record):
    free = {FREE[0]: (0.0, 0.2), FREE[1]: (0.0, 1.0)}
    fitted = armrs.fit_by_simulation(model([0.1, 0.1]), MOVEMENT, record.q, record.force_on_arm, free, **NOISE)
    assert fitted.at_bound == (FREE[0],)
    assert fitted.values[FREE[0]] == 0.2


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"free": ["stribeck1 torque"]}, "free parameter.*stribeck1 torque.*viscous1 viscosity"),
        ({"free": {FREE[0]: (0.2, 0.1)}}, "bounds of viscous1 viscosity"),
        ({"free": {FREE[0]: (0.2, 0.3)}}, "start of a free parameter"),
        ({"free": []}, "free parameters"),
        ({"angle_noise": 0.0}, "angle_noise"),
        ({"integrator": "verlet"}, "integrator"),
        ({"force_on_arm": np.zeros((3, 2))}, "force_on_arm"),
        ({"q": np.full((5, 2), np.nan), "force_on_arm": np.zeros((5, 2))}, "q"),
    ],
)
def test_refuses(record, change, message):
    given = {"q": record.q, "force_on_arm": record.force_on_arm, "free": FREE} | NOISE | change
    with pytest.raises(armrs.BadInput, match=message):
        armrs.fit_by_simulation(model([0.1, 0.1]), MOVEMENT, **given)
