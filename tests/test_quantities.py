"""What a model says of the names in a result, by arithmetic in the head."""

from __future__ import annotations

import pytest

from armrs import Effect, Joint, Model, Segment
from armrs.analysis.quantity_expressions import value_in

MODEL = Model(
    segments=(
        Segment("one", length=2.0, mass=3.0, com=1.0, inertia=5.0),
        Segment("two", length=1.0, mass=7.0, com=0.5, inertia=11.0, com_normal=0.25),
        Segment("three", length=1.0, mass=13.0, com=1.0, inertia=17.0),
    ),
    joints=(Joint("a", viscosity=0.5), Joint("b"), Joint("c")),
    effects=(Effect("coulomb", 2, parameters={"torque": 0.1}), Effect("coulomb", 2, parameters={"torque": 0.2})),
)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("m1", 3.0),
        ("m1*l1", 3.0),
        ("m1*l1 + a1*m2", 17.0),
        ("m1*l1 + a1*(m2 + m3)", 43.0),
        ("I1 + m1*l1^2 + a1^2*(m2 + m3)", 88.0),
        ("m2*n2", 1.75),
        ("I2", 11.0),
        ("m4", None),
        ("g", None),
        ("m1 - m2", None),
        ("", None),
    ],
)
def test_segments(name: str, value: float | None) -> None:
    assert value_in(MODEL, name) == value


def test_effects() -> None:
    assert value_in(MODEL, "viscosity", kind="viscous", joint=1) == 0.5
    assert value_in(MODEL, "viscosity", kind="viscous", joint=2) == 0.0
    assert value_in(MODEL, "torque", kind="coulomb", joint=2) == pytest.approx(0.3)
    assert value_in(MODEL, "force bias Fy", kind="calibration") is None
