"""The classes of results: typed in the core, the same in Python, one JSON."""

from __future__ import annotations

import copy
import inspect
import json
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import armrs
from armrs import BadInput, _armrs
from armrs.formatting import symbol
from armrs.io import files
from armrs.report.tables import label

CLASSES: dict[str, dict[str, Any]] = {
    "Value": {"value": 0.4, "std": 0.01, "unit": "N m s/rad", "interval": (0.38, 0.42)},
    "Separation": {
        "waypoints_deg": ((0.0, 1.0), (2.0, 3.0)),
        "speed_rad_s": 0.5,
        "acceleration_rad_s2": 2.0,
        "shape": "smooth",
        "now": 1.0,
        "then": 3.0,
    },
    "Place": {
        "trial": "a.csv",
        "channel": "tau1_Nm",
        "t_start": 0.0,
        "t_end": 1.0,
        "joint": 1,
        "condition": "dq1 > 0",
        "mean": 0.1,
        "z": 4.0,
    },
    "Open": {"trial": "a.csv", "t_start": 0.0, "t_end": 1.0, "size": None},
    "ChannelGap": {"before": 3.0, "calibrated": 2.0, "after": 1.0, "floor": 0.9, "floor_std": 0.1, "open": None},
    "Absorbed": {"name": "force bias of Fy", "value": 0.1, "promised": 0.4, "unit": "N"},
    "Limit": {
        "kind": "coulomb",
        "joint": 1,
        "channel": None,
        "parameter": "torque",
        "at_least": 0.02,
        "unit": "N m",
        "gain": 1.0,
        "price": 20.0,
    },
    "Suspect": {
        "kind": "viscous",
        "joint": 2,
        "channel": None,
        "parameters": {"viscosity": 0.4},
        "unit": "N m s/rad",
        "gain": 90.0,
        "price": 20.0,
        "smallest": 0.03,
    },
    "Tried": {"effects": (("viscous", 2, None),), "gain": 90.0},
    "SearchStep": {"tried": (), "before": 300.0, "after": 210.0},
    "Prediction": {
        "name": "torque",
        "kind": "coulomb",
        "joint": 1,
        "value": 0.2,
        "std": 0.01,
        "std_of_data": 0.02,
        "relative": 0.1,
        "unit": "N m",
    },
    "Slowed": {
        "movement": 2,
        "pace": 0.5,
        "limit": "force",
        "found": 120.0,
        "allowed": 60.0,
        "what": "force on the arm",
        "unit": "N",
    },
    "DesignedMovement": {"waypoints": ((0.0, 0.1), (0.2, 0.3)), "speed": 1.0, "acceleration": 4.0},
    "RunFit": {"values": (0.2,), "sd": (0.01,), "active": (-1,), "squares": 98.0, "residuals": 100, "rounds": 3, "settled": True},
    "Fitted": {
        "segments": ([0.0, 0.1, 0.0],),
        "contact": [[0.0, 0.0], [0.0, 0.1]],
        "shift": [0.0, 0.001],
        "known": (armrs.Effect("coulomb", 1, parameters={"torque": 0.1}),),
        "calibration": (),
        "named": (),
    },
    "Estimate": {
        "name": "m2*l2",
        "joint": 2,
        "kind": "segment",
        "value": 0.7,
        "std": 0.002,
        "unit": "kg m",
        "interval": (0.69, 0.71),
        "decided_by": "data",
        "caveat": None,
    },
}
"""Arguments of small classes; the others are made of these."""


def made(name: str, **change: Any) -> Any:
    return getattr(_armrs, name)(**(CLASSES[name] | change))


@pytest.mark.parametrize("name", CLASSES)
def test_a_result_is_a_value(name: str) -> None:
    one = made(name)
    assert one == made(name)
    assert pickle.loads(pickle.dumps(one)) == copy.deepcopy(one) == one
    assert {key: getattr(one, key) for key in one.__match_args__} == CLASSES[name]
    assert repr(one).startswith(f"{name}({one.__match_args__[0]}=")
    with pytest.raises(AttributeError):
        setattr(one, one.__match_args__[0], None)
    with pytest.raises(BadInput, match="nothing_known"):
        one.replace(nothing_known=1)


@pytest.mark.parametrize("name", CLASSES)
def test_it_is_documented_and_its_json_has_its_attributes(name: str) -> None:
    kind = getattr(_armrs, name)
    assert all(inspect.getdoc(getattr(kind, key)) for key in (*kind.__match_args__, "replace", "to_dict"))
    assert inspect.getdoc(kind)
    told = made(name).to_dict()
    assert list(told) == [key for key in kind.__match_args__ if key != "open"]
    assert json.loads(files.json_text(told)) == told


def test_wrong_arguments_are_refused_by_name() -> None:
    with pytest.raises(BadInput, match=r"value: found 'much', allowed a number"):
        made("Value", value="much")
    with pytest.raises(BadInput, match=r"parameters: found 3, allowed a mapping of names"):
        made("Suspect", parameters=3)
    with pytest.raises(BadInput, match=r"known: found \(1,\), allowed a sequence"):
        made("Fitted", known=(1,))


def test_units_stand_in_the_repr() -> None:
    assert "speed_rad_s=0.5 rad/s" in repr(made("Separation"))
    assert "t_end=1.0 s" in repr(made("Open"))


def test_an_effect_says_itself_with_units() -> None:
    viscous = _armrs.Missing("viscous", 2, None, {"viscosity": made("Value")}, 0.0, 1.0)
    assert str(viscous) == "viscous joint 2: viscosity = 0.4 ± 0.01 N m s/rad"
    assert viscous.decided
    assert viscous.alternatives == ()
    assert str(made("Estimate")) == "m2*l2 = 0.7 ± 0.002 kg m"


def test_what_is_no_number_is_none_in_json() -> None:
    swings = _armrs.Alternative("tremor", 1, None, "swings these channels as much", 1.0, float("nan"))
    assert swings.to_dict()["likeness"] is None
    assert list(swings.to_dict())[-1] == "separation"


def test_sums_are_those_of_numpy() -> None:
    """Bit for bit: published digits rest on them."""
    rng = np.random.default_rng(3)
    for n in (1, 7, 8, 9, 127, 128, 129, 1000, 4097):
        measured, shown = rng.normal(size=(2, n, 1))
        trial = _armrs.SimulatedTrial("a", 0, True, 50.0, np.ones((n, 1), dtype=bool), measured, {"given": shown}, {})
        assert _armrs.sizes([trial], "given") == [float(np.sqrt(np.mean(np.square(shown - measured)[:, 0])))]
        assert pickle.loads(pickle.dumps(trial)) == trial


def test_whole_results_can_be_kept(slow_arm: Path) -> None:
    found = armrs.identify(slow_arm, with_effects="coulomb")
    again = pickle.loads(pickle.dumps(found.result))
    assert again == found.result
    assert again.to_dict() == found.to_dict()
    assert np.array_equal(again.explained[0].measured, found.explained[0].measured)
    doubled = found.result.replace(rank=2 * found.rank)
    assert doubled.rank == 2 * found.rank
    assert doubled.parameters == found.parameters


def test_a_plan_is_typed_and_one_json() -> None:
    forecast = _armrs.Forecast([made("Prediction")], 0.1, 12.0, 1.0, 0.8, 3.0, 40.0)
    assert list(forecast.to_dict())[:3] == ["predictions", "worst_relative_std", "largest_force_N"]
    design = _armrs.Design(forecast, [made("DesignedMovement")], [made("Slowed")])
    assert pickle.loads(pickle.dumps(design)) == design and design.replace(slowed=()).slowed == ()
    assert str(design.slowed[0]).startswith("movement 2 is slowed to 50 % of the pace asked for")
    assert str(forecast.predictions[0]) == "torque = 0.2 ± 0.01 N m"


def test_a_recording_and_what_is_read_of_it_are_objects(slow_arm: Path) -> None:
    movement = armrs.load_movement(slow_arm / "movement.toml")
    run = armrs.simulate(slow_arm / "truth.toml", movement, sensors=armrs.Sensors(), seeds=[1])
    (read,) = run.readings
    assert read.q.shape == run.q.shape and read.force_on_arm.shape == run.force_on_arm.shape and read.tau is None
    again = pickle.loads(pickle.dumps(read))
    assert np.array_equal(again.q, read.q) and repr(again) == f"Readings({len(run.t)} samples)"
    with pytest.raises(AttributeError):
        read.q = None  # type: ignore[misc]


def test_a_sum_in_a_name_makes_no_combination() -> None:
    """What an estimate is, its kind says: a kind of one's own may have a parameter with a sum in its name, and a combination none."""
    given = (1, 0.2, 0.01, "N m", (0.18, 0.22), "data")
    effect = armrs.Estimate("height+depth", given[0], "detent", *given[1:])
    combination = armrs.Estimate("h1", given[0], "combination", *given[1:])
    assert str(effect) == "detent height+depth = 0.2 ± 0.01 N m" and str(combination) == "h1 = 0.2 ± 0.01 N m"
    assert label({"name": effect.name, "kind": effect.kind}).startswith("detent ")
    assert label({"name": combination.name, "kind": combination.kind}) == symbol("h1")


def test_what_a_value_rests_on_is_one_of_three() -> None:
    given = ("torque", 1, "coulomb", 0.2, 0.01, "N m", (0.18, 0.22))
    assert [armrs.Estimate(*given, by).decided_by for by in ("data", "prior", "bound")] == ["data", "prior", "bound"]
    with pytest.raises(armrs.BadInput, match=r"^decided_by: found 'guess', allowed data, prior or bound"):
        armrs.Estimate(*given, "guess")
