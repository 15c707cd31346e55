"""Every argument of the public functions given what it is not: armrs' own error on one line, never another exception, nothing taken silently."""

from __future__ import annotations

import dataclasses
import re
import warnings
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import armrs
from armrs import ArmrsError, BadInput, _armrs
from armrs.demo import given_model, true_model

MODEL = true_model()
BELIEVED = given_model(MODEL)
ARM = armrs.Arm([0.3, 0.25], [2.0, 1.0], [0.15, 0.12], [0.02, 0.01])
STATES = np.zeros((3, 2))
MOVEMENT = armrs.Movement(np.radians([[-60, 60], [-48, 60]]), speed=0.5, acceleration=2.0)
TIME = np.arange(20.0) / 50.0
MARKERS = armrs.Markers(["a", "b", "c"], np.arange(3.0), np.random.default_rng(1).normal(size=(3, 3, 3)), "z")
PARAMETER = armrs.Parameter("size", "N m", -1.0, 1.0, 0.1)

NOTHING_CAN_BE = (
    object(),
    {1: 2},
    b"x",
    print,
    np.array([1 + 2j]),
    np.array(["a"]),
    np.array(["2020"], "datetime64[Y]"),
    np.array([np.nan, 0.0]),
    1j,
)
"""What no argument is."""
OTHERS = (None, "x", -1, 2.5, float("nan"), [None], ["x"], True, 10**400)
"""What is right for some arguments, and is taken or refused; it never ends otherwise."""

ROUGH: dict[str, tuple[Callable[..., object], dict[str, Any]]] = {
    "Arm": (armrs.Arm, {"lengths": [0.3], "masses": [2.0], "coms": [0.1], "inertias": [0.1], "com_normals": [0.0], "gravity": 9.81, "base": (0.0, 0.0), "rotor_inertia": [0.0]}),
    "forward_kinematics": (ARM.forward_kinematics, {"q": STATES}),
    "jacobian": (ARM.jacobian, {"q": STATES}),
    "inertia": (ARM.inertia, {"q": STATES}),
    "coriolis": (ARM.coriolis, {"q": STATES, "qd": STATES}),
    "gravity": (ARM.gravity, {"q": STATES}),
    "static_torque": (ARM.static_torque, {"q": STATES, "force_on_arm": STATES}),
    "inverse_dynamics": (ARM.inverse_dynamics, {"q": STATES, "qd": STATES, "qdd": STATES}),
    "forward_dynamics": (ARM.forward_dynamics, {"q": STATES, "qd": STATES, "tau": STATES}),
    "regressor": (ARM.regressor, {"q": STATES, "qd": STATES, "qdd": STATES}),
    "Segment": (armrs.Segment, {"name": "a", "length": 0.3, "mass": 1.0, "com": 0.1, "inertia": 0.01, "com_normal": 0.0}),
    "Joint": (armrs.Joint, {"name": "a", "stiffness": 1.0, "rest": 0.0, "viscosity": 0.1, "coulomb": 0.1}),
    "Robot": (armrs.Robot, {"lengths": (0.4, 0.4), "base": (1, 0), "elbow": "up"}),
    "Contact": (armrs.Contact, {"stiffness": (1e4, 1e4), "damping": (1, 1)}),
    "Effect": (armrs.Effect, {"kind": "coulomb", "joint": 1, "channel": None, "parameters": {"torque": 0.1}}),
    "Model": (armrs.Model, {"segments": MODEL.segments, "joints": MODEL.joints, "gravity": 9.81, "base": (0, 0), "segment_uncertainty": 0.1, "robot": MODEL.robot, "contact": MODEL.contact, "effects": ()}),
    "with_mass": (MODEL.with_mass, {"number": 1, "mass": 0.1, "at": 0.1}),
    "write": (MODEL.write, {"path": "model.toml"}),
    "load_model": (armrs.load_model, {"path": "model.toml"}),
    "load_dataset": (armrs.load_dataset, {"source": "data"}),
    "load_sweep": (armrs.load_sweep, {"path": "sweep.toml"}),
    "load_movement": (armrs.load_movement, {"path": "movement.toml", "n_joints": 2}),
    "Movement": (armrs.Movement, {"waypoints": [[0, 0], [1, 1]], "speed": 1.0, "acceleration": 1.0, "pause": 0.0, "shape": "smooth", "file": "movement.toml"}),
    "Channel": (armrs.Channel, {"deviation": 0.1, "correlation_time": 0.0, "range": 1.0, "bits": 3}),
    "Sensors": (armrs.Sensors, {"rate": 50.0, "angle": armrs.Channel(), "force": armrs.Channel()}),
    "Subject": (armrs.Subject, {"body_mass": 70.0, "height": 1.8, "sex": "male", "name": "S1"}),
    "Tolerance": (armrs.Tolerance, {"angle_offset_deg": 0.1, "force_bias_N": 0.1, "force_gain": 0.1}),
    "Parameter": (armrs.Parameter, {"name": "a", "unit": "m", "min": 0.0, "max": 1.0, "default": 0.0, "linear": True}),
    "own_effect": (armrs.own_effect, {"kind": "for the test of types", "law": None, "parameters": [PARAMETER], "summary": "", "shapes": None, "angles": (-1.0, 1.0), "speed": 20.0}),
    "simulate": (armrs.simulate, {"model": MODEL, "drive": MOVEMENT, "engine": "native", "integrator": "rk4", "dt": 0.00025, "rate": 50.0, "duration": 0.02, "coupling": "compliant", "start": None, "start_speed": None, "sensors": armrs.Sensors(), "seeds": (1,)}),
    "fit_by_simulation": (armrs.fit_by_simulation, {"model": MODEL, "drive": MOVEMENT, "q": STATES, "force_on_arm": STATES, "free": {"coulomb1 torque": (0.0, 1.0)}, "angle_noise": 0.001, "force_noise": 0.1, "integrator": "rk4", "dt": 0.00025, "rate": 50.0}),
    "forecast": (armrs.forecast, {"model": BELIEVED, "movements": [MOVEMENT], "repeats": 2, "with_effects": (), "instruments": armrs.Instruments()}),
    "plan": (armrs.plan, {"model": BELIEVED, "limits": armrs.Limits(((-1.1, -0.9), (0.9, 1.1)), duration=3.0), "speeds": (1.0,), "waypoints": 2, "repeats": 2, "with_effects": (), "instruments": armrs.Instruments(), "evaluations": 1, "seed": 1}),
    "Limits": (armrs.Limits, {"angles": ((-1.1, -0.9), (0.9, 1.1)), "speed": 2.0, "acceleration": 8.0, "robot_speed": 4.0, "robot_acceleration": 60.0, "force": 60.0, "duration": 3.0}),
    "Instruments": (armrs.Instruments, {"rate": 50.0, "cutoff": 5.0, "force": 0.2, "angle": 0.001, "tolerance": armrs.Tolerance()}),
    "record": (armrs.record, {"experiment": "experiment.toml", "folder": "out"}),
    "sweep": (armrs.sweep, {"source": "sweep.toml", "folder": "out", "jobs": 1}),
    "convert": (armrs.convert, {"source": "data", "folder": "out", "to": "csv"}),
    "convert_motion": (armrs.convert_motion, {"source": "a.mot", "folder": "out", "to": "csv", "coordinates": ()}),
    "convert_markers": (armrs.convert_markers, {"source": "a.trc", "folder": "out", "to": "csv", "points": ("a", "b")}),
    "read_markers": (armrs.read_markers, {"path": "a.trc"}),
    "planar_motion": (armrs.planar_motion, {"markers": MARKERS, "points": ["a", "b", "c"], "up": "z", "forward": "y"}),
    "Markers": (lambda **k: armrs.Markers(["a"], **k), {"t": np.zeros(3), "positions": np.zeros((3, 1, 3)), "up": "z"}),
    "write_report": (armrs.write_report, {"sources": ["a.json"], "path": "report.html"}),
    "export_fmu": (armrs.export_fmu, {"model": MODEL, "path": "a.fmu", "fmi": 3, "port": "force", "start": None, "rest": False, "name": "a"}),
    "export_c": (armrs.export_c, {"model": MODEL, "precision": "double", "identified": None}),
    "check_dataset": (armrs.check_dataset, {"source": "data"}),
    "import_recordings": (armrs.import_recordings, {"sources": ["raw.csv"], "out": "out", "model": MODEL, "columns_map": "", "angles": None, "zero": None, "clockwise": None, "force_on": None, "points": ()}),
    "segment_expectations": (armrs.segment_expectations, {"body_mass": 70.0, "height": 1.8, "sex": "male", "lengths": (0.3, None)}),
    "initialise": (armrs.initialise, {"folder": "out", "body_mass": 70.0, "height": 1.8, "sex": "male", "lengths": (0.3, None), "worn": (), "replace": True}),
    "Worn": (armrs.Worn, {"segment": 1, "mass": 0.1, "at": 0.1}),
    "export_model": (armrs.export_model, {"model": MODEL, "path": "arm.urdf"}),
    "import_model": (armrs.import_model, {"path": "arm.urdf"}),
    "cohort": (armrs.cohort, {"source": "values.csv", "groups": None}),
    "check_fmu": (armrs.check_fmu, {"path": "a.fmu"}),
    "Trial": (armrs.Trial, {"file": "a", "configuration": "a", "repeat": 1, "role": "fit", "t": TIME, "q": np.zeros((20, 2)), "force_on_arm": np.zeros((20, 2)), "moment_on_arm": np.zeros(20), "robot_q": np.zeros((20, 2)), "tau": np.zeros((20, 2)), "dq": np.zeros((20, 2))}),
    "Dataset": (armrs.Dataset, {"name": "a", "model": MODEL, "trials": (), "force_on": "arm", "sample_rate": 50.0, "subject": armrs.Subject(), "tolerance": armrs.Tolerance(), "synthetic": False, "added": ()}),
}  # fmt: skip
OF_A_DATA_SET: dict[str, tuple[Callable[..., object], dict[str, Any]]] = {
    "identify": (armrs.identify, {"method": "joint", "with_effects": (), "cutoff": None, "motion": "auto", "level": 0.95}),
    "passive_moments": (armrs.passive_moments, {"cutoff": 1.0, "bins": 24}),
    "spasticity": (armrs.spasticity, {"cutoff": 4.0}),
    "find_gap": (armrs.find_gap, {"effects": (), "separate": False, "threads": 1, "progress": None}),
    "write_dataset": (armrs.write_dataset, {"folder": "out", "suffix": None}),
}


def tried(function: Callable[..., object], keywords: dict[str, Any], name: str, value: object) -> BaseException | None:
    """Return how a call ends in which one argument is another; a warning that is not about the data counts as an exception."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", armrs.ArmrsWarning)
        try:
            function(**{**keywords, name: value})
        except Exception as error:
            return error
    return None


def ends_wrongly(function: Callable[..., object], keywords: dict[str, Any], name: str) -> list[str]:
    """Return the values of one argument at which a call ends as it must not: what nothing can be gets a line, the rest at most that."""

    def is_a_line(error: BaseException | None) -> bool:
        return (
            isinstance(error, BadInput) and "\n" not in str(error) and len(re.findall("(?:^|: )(?:found |no such file)", str(error))) == 1
        )

    asked = [v for v in NOTHING_CAN_BE if not (name in ("law", "progress") and callable(v))]
    ends = [(v, tried(function, keywords, name, v)) for v in asked]
    wrong = [(v, e) for v, e in ends if not is_a_line(e)]
    ends = [(v, tried(function, keywords, name, v)) for v in OTHERS]
    wrong += [(v, e) for v, e in ends if not (e is None or isinstance(e, ArmrsError))]
    return [f"{name} = {v!r}: {type(e).__name__}: {e}" for v, e in wrong]


@pytest.mark.parametrize(("of", "name"), [(of, name) for of, (_, keywords) in ROUGH.items() for name in keywords])
def test_what_an_argument_cannot_be_is_refused(of: str, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert ends_wrongly(*ROUGH[of], name) == []


@pytest.mark.parametrize(("of", "name"), [(of, name) for of, (_, keywords) in OF_A_DATA_SET.items() for name in keywords])
def test_and_of_functions_of_a_data_set(of: str, name: str, slow_arm: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    function, keywords = OF_A_DATA_SET[of]
    monkeypatch.chdir(tmp_path)
    whole = armrs.load_dataset(slow_arm)
    # One trial to fit and one to test: what is accepted is worked through.
    dataset = dataclasses.replace(whole, trials=whole.trials[2:])
    assert ends_wrongly(function, {"dataset": dataset, **keywords}, name) == []


@pytest.mark.parametrize("of", OF_A_DATA_SET)
def test_a_data_set_is_one(of: str) -> None:
    function, keywords = OF_A_DATA_SET[of]
    for value in (None, 3, True, *NOTHING_CAN_BE):
        error = tried(function, keywords, "dataset", value)
        assert isinstance(error, BadInput), f"{value!r}: {error}"
        assert error.place == "dataset"


def test_every_public_function_is_asked() -> None:
    made_by_functions = {
        "Estimate",
        "Identified",
        "Recorded",
        "PlanarMotion",
        "PassiveCurve",
        "PassiveMoments",
        "Sweep",
        "Swept",
        "OwnEffect",
        "SimulationFit",
    }
    made_by_functions |= {"Plan", "Simulated", "GapFound", "Demonstration", "FirmwareSource"}
    made_by_functions |= {"Cohort", "Spasticity"}
    made_by_functions |= {"Checked", "Expected", "ExportedModel", "Imported"}
    errors = {name for name in armrs.__all__ if name.endswith(("Error", "Warning")) or name == "BadInput"}
    texts = {"__version__", "build_profile"}
    asked = {*ROUGH, *OF_A_DATA_SET, "run_demo"}
    assert set(armrs.__all__) - made_by_functions - errors - texts - asked == set()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: armrs.identify("nowhere", with_effects=3), "^nowhere: no such file"),
        (lambda: armrs.simulate(None, MOVEMENT), "^model: found None, allowed a Model or a path$"),
        (lambda: armrs.Model(segments=3, joints=[]), "^segments: found 3, allowed a sequence of Segment$"),
        (lambda: armrs.Model(3, []), "^segments: found 3"),
        (lambda: armrs.Model(["x"], []), r"^segments\[0\]: found 'x', allowed a Segment$"),
        (lambda: armrs.Arm(None, [1.0], [0.1], [0.1]), "^lengths: found None, allowed numbers$"),
        (lambda: armrs.Arm([0.3], [1.0], [0.1], [0.1], gravity="9"), "^gravity: found '9', allowed numbers$"),
        (lambda: armrs.Arm([0.3], [1.0], [0.1], [0.1], base=(0.0,)), "^base: found 1 values, allowed two numbers"),
        (lambda: armrs.Arm([0.3], [0.0], [0.1], [0.1]), "^mass of segment 1: found 0, allowed more than 0$"),
        (lambda: armrs.Arm([0.3], [1e-300], [0.1], [0.1]), "^mass of segment 1: found 1e-300, allowed at least 1\\.1754943\\d*e-38$"),
        (lambda: ARM.gravity("x"), "^q: found 'x', allowed numbers$"),
        (lambda: ARM.gravity(np.array([[1j, 0.0]])), "^q: found complex numbers, allowed numbers$"),
        (lambda: ARM.gravity(np.array([["a", "b"]])), "^q: found texts"),
        (lambda: ARM.gravity(np.ma.masked_array([[0.0, 1.0]], [[True, False]])), "^q: found a masked array"),
        (lambda: ARM.coriolis(STATES, STATES + 1e200), "^q, qd: found values of which the result is not finite in row 0"),
        (lambda: armrs.simulate(MODEL, duration="1"), "^duration: found '1', allowed a finite number > 0 s$"),
        (lambda: armrs.export_fmu(None, "a.fmu"), "^model: found None, allowed a Model or a path$"),
    ],
)
def test_the_line_says_which_argument(call: Callable[[], object], message: str) -> None:
    with pytest.raises(BadInput, match=message):
        call()


@pytest.mark.parametrize(
    "name", ["forward_kinematics", "jacobian", "inertia", "gravity", "coriolis", "inverse_dynamics", "forward_dynamics"]
)
def test_arrays_stored_by_columns_are_read_by_rows(name: str) -> None:
    """As those of pandas are; of two rows or more, since one is stored the same either way."""
    kernel = getattr(ARM, name)
    count = {"coriolis": 2, "inverse_dynamics": 3, "forward_dynamics": 3}.get(name, 1)
    given = np.random.default_rng(1).normal(size=(count, 5, 2))
    np.testing.assert_array_equal(kernel(*map(np.asfortranarray, given)), kernel(*given))


def test_the_digest_of_an_array_is_that_of_its_rows() -> None:
    def digest(values: np.ndarray) -> str:
        made = _armrs.Digest([])
        made.column("q", values.size)
        made.values(values)
        return made.value()

    values = np.random.default_rng(1).normal(size=(5, 2))
    assert digest(np.asfortranarray(values)) == digest(values) == digest(values.ravel()) != digest(values.T)


def test_numbers_of_other_kinds_are_numbers() -> None:
    exact = ARM.gravity([[0.5, 0.25]])
    for same in ([[Fraction(1, 2), Fraction(1, 4)]], np.array([[0.5, 0.25]], np.float32), np.asfortranarray([[0.5, 0.25]])):
        np.testing.assert_array_equal(ARM.gravity(same), exact)
    np.testing.assert_array_equal(ARM.gravity([[1, 0]]), ARM.gravity(np.array([[1.0, 0.0]])))
    unmasked = np.ma.masked_array([[0.5, 0.25]], [[False, False]])
    np.testing.assert_array_equal(ARM.gravity(unmasked), exact)
