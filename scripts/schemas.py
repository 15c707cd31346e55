"""Write the JSON Schemas of the files that are written by hand, so that editors complete and check them.

Run with the project's own Python after a build: `.venv/bin/python scripts/schemas.py`. A test compares the files with the catalogue.
In a file, `#:schema PATH/model.schema.json` as the first line is read by editors with a TOML language server.
"""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

from armrs.catalogue import FORCE_CHANNELS, Kind, Parameter, catalogue
from armrs.workflows.experiment import FAULTS, Controller, Devices, Fault, Safety
from armrs.workflows.force_sensor import SixAxis
from armrs.workflows.interaction import Interaction, Perturbation, Support

FOLDER = Path(__file__).parent.parent / "docs" / "schemas"
DRAFT = "https://json-schema.org/draft/2020-12/schema"


def number(text: str, *, least: float | None = None, above: float | None = None, most: float | None = None, default: Any = None) -> Any:
    """Return the schema of a number, with its unit in the description."""
    bounds = {"minimum": least, "exclusiveMinimum": above, "maximum": most, "default": default}
    return {"type": "number", "description": text} | {key: value for key, value in bounds.items() if value is not None}


def pair(text: str) -> Any:
    """Return the schema of two numbers, along y and z."""
    return {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2, "description": text}


def table(properties: dict[str, Any], required: list[str] | None = None, text: str = "") -> Any:
    """Return the schema of a table that takes no other keys."""
    found = {"type": "object", "properties": properties, "additionalProperties": False}
    return found | ({"required": required} if required else {}) | ({"description": text} if text else {})


def parameter(p: Parameter) -> Any:
    """Return the schema of a parameter of an effect."""
    within = number(f"[{p.unit}]", least=p.min, most=p.max, default=p.default)
    if not p.or_zero:
        return within
    bounds = {key: within.pop(key) for key in ("minimum", "maximum")}
    return within | {"anyOf": [{"const": 0}, bounds]}


def kinds() -> list[Kind]:
    """Return the kinds of the catalogue, without those that a user has added to this process."""
    return [kind for kind in catalogue().values() if not kind.own]


def effect(kind: Kind) -> Any:
    """Return the schema of an effect of one kind."""
    places = {"joint": {"type": ["integer", "string"], "minimum": kind.first_joint}, "channel": {"enum": list(FORCE_CHANNELS)}}
    address = {kind.address: places[kind.address]} if kind.address else {}
    values = {p.name: parameter(p) for p in kind.parameters}
    text = f"{kind.summary}. {kind.formula}"
    return table({"kind": {"const": kind.kind}, **address, **values}, ["kind", *address], text)


def list_of(items: Any, *, least: int = 0, most: int | None = None, text: str = "") -> Any:
    """Return the schema of an array."""
    bounds = {"minItems": least or None, "maxItems": most, "description": text or None}
    return {"type": "array", "items": items} | {key: value for key, value in bounds.items() if value is not None}


def settings(of: Any, /, **known: Any) -> Any:
    """Return the schema of a table that is read into a dataclass, whose names end in their units; `known` are those of other fields."""
    types = {bool: "boolean", int: "integer"}

    def schema(f: Any) -> Any:
        return {"type": types.get(type(f.default), "number")} | ({} if f.default in (None, dataclasses.MISSING) else {"default": f.default})

    fields = dataclasses.fields(of)
    return table({f.name: known.get(f.name, schema(f)) for f in fields}, [f.name for f in fields if f.default is dataclasses.MISSING])


def joint(required: list[str]) -> Any:
    """Return the schema of a joint with its laws."""
    return table(
        {
            "name": {"type": "string"},
            "stiffness": number("[N m/rad] about `rest`", least=0.0, default=0.0),
            "rest": number("[rad]", default=0.0),
            "viscosity": number("[N m s/rad]", least=0.0, default=0.0),
            "coulomb": number("dry friction [N m]", least=0.0, default=0.0),
        },
        required,
    )


def rig() -> dict[str, Any]:
    """Return the schemas of the tables that models and experiments share."""
    robot = {"lengths": pair("[m]"), "base": pair("first axis, y and z [m]"), "elbow": {"enum": ["up", "down"]}}
    contact = {"stiffness": pair("[N/m]"), "damping": pair("[N s/m]")}
    return {
        "robot": table(robot, ["lengths", "base"]),
        "contact": table(contact, ["stiffness"]),
        "effect": list_of({"oneOf": [effect(kind) for kind in kinds()]}),
    }


def model() -> Any:
    """Return the schema of model.toml."""
    segment = {
        "name": {"type": "string"},
        "length": number("joint to joint, or joint to handle [m]", above=0.0, most=100.0),
        "mass": number("[kg]", above=0.0),
        "com": number("centre of mass from the proximal joint [m]", least=0.0),
        "inertia": number("about the centre of mass [kg m²]", least=0.0),
        "com_normal": number("centre of mass beside the segment, counter-clockwise [m]", default=0.0),
    }
    arm = {
        "gravity": number("along −z [m/s²]", least=0.0, default=9.81),
        "base": pair("first joint, y and z [m]"),
        "segment_uncertainty": number("relative standard deviation of masses, centres of mass and inertias", least=0.0, most=1.0),
        "joint_uncertainty": number("relative standard deviation of the joint laws; 0 is exact", least=0.0, most=1.0),
        "segment": list_of(table(segment, ["name", "length", "mass", "com", "inertia"]), least=1, most=6),
        "joint": list_of(joint(["name"]), least=1, most=6),
    }
    return table({"arm": table(arm, ["segment", "joint"])} | rig(), ["arm"])


def subject() -> dict[str, Any]:
    """Return the schemas of the keys of [subject]."""
    return {
        "name": {"type": "string"},
        "side": {"enum": ["left", "right"], "description": "which arm was measured"},
        "body_mass": number("[kg]", least=1.0, most=500.0),
        "height": number("[m]", least=0.3, most=3.0),
        "sex": {"enum": ["male", "female"]},
        "lengths_m": list_of(
            {"type": "number", "exclusiveMinimum": 0.0, "maximum": 1.0}, most=3, text="measured lengths of the segments [m]"
        ),
    }


def tolerance() -> Any:
    """Return the schema of [tolerance]."""
    return table(
        {
            "angle_offset_deg": number("one standard deviation [deg]", least=0.0, default=0.3),
            "force_bias_N": number("one standard deviation [N]", least=0.0, default=0.2),
            "force_gain": number("one standard deviation, relative", least=0.0, default=0.01),
            "time_delay_s": number("one standard deviation, force against angles [s]", least=0.0, default=0.005),
            "handle_placement_m": number("one standard deviation [m]", least=0.0, default=0.001),
        }
    )


def added() -> Any:
    """Return the schema of a mass that is worn."""
    fields = {
        "segment": {"type": "integer", "minimum": 1},
        "mass": number("[kg]", above=0.0, most=20.0),
        "at": number("from the segment's proximal joint [m]", least=0.0, most=2.0),
        "configurations": list_of({"type": "string"}),
    }
    return table(fields, ["segment", "mass", "at"])


def muscle() -> Any:
    """Return the schema of a muscle whose activity is recorded."""
    fields = {
        "channel": {"type": "string", "pattern": "^emg_", "description": "name of its column"},
        "joint": {"type": "integer", "minimum": 1, "description": "that it moves"},
        "mvc": number("envelope of a maximal voluntary contraction, in the unit of the channel", above=0.0, most=1e9),
        "rest": number("envelope at rest, in the unit of the channel", least=0.0, most=1e9),
        "delay_s": number("by how much torque follows activity [s]", least=0.0, most=0.5, default=0.05),
    }
    return table(fields, ["channel", "joint"])


def dataset() -> Any:
    """Return the schema of dataset.toml."""
    trial = {
        "file": {"type": "string", "description": "CSV or Parquet, relative to this file"},
        "configuration": {"type": "string", "description": "name of the movement, shared by its repeats"},
        "repeat": {"type": "integer", "minimum": 1},
        "role": {"enum": ["fit", "test"], "description": "nothing is chosen or fitted on a test trial"},
    }
    return table(
        {
            "name": {"type": "string"},
            "model": {"type": "string", "description": "the model file, relative to this one; not needed beside a whole [subject]"},
            "force_on": {"enum": ["robot", "arm"], "description": "what the recorded force acts on"},
            "sample_rate": number("where time stamps are uneven [Hz]", above=0.0, most=1e6),
            "synthetic": {"type": "boolean"},
            "subject": table(subject()),
            "tolerance": tolerance(),
            "added": list_of(added()),
            "muscle": list_of(muscle()),
            "trial": list_of(table(trial, ["file", "configuration", "role"]), least=1),
        },
        ["trial"],
    )


def movement(**more: Any) -> Any:
    """Return the schema of a movement, with the keys that it has beside its own in an experiment."""
    points = list_of(list_of({"type": "number"}, least=1), least=2, text="rows of joint angles, one a waypoint")
    keys = {"pause_s": number("rest in every waypoint on the way [s]", least=0.0, default=0.0), "shape": {"enum": ["trapezoid", "smooth"]}}
    units = {"waypoints": ("deg", "rad"), "speed": ("rad_s", "deg_s"), "acceleration": ("rad_s2", "deg_s2")}
    for name, both in units.items():
        keys |= {f"{name}_{unit}": points if name == "waypoints" else number("largest of any joint", above=0.0) for unit in both}
    once = [{"not": {"required": [f"{name}_{unit}" for unit in both]}} for name, both in units.items()]
    return table(keys | more) | {"oneOf": [{"required": [f"waypoints_{unit}"]} for unit in units["waypoints"]], "allOf": once}


def six_axis() -> Any:
    """Return the schema of [sensors.six_axis]."""
    three = {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}
    row = list_of({"type": "number", "minimum": -0.5, "maximum": 0.5}, least=6, most=6)
    known = {f.name: three | {"default": f.default} for f in dataclasses.fields(SixAxis) if isinstance(f.default, tuple)}
    places = {name: pair("in the sensor's frame [m]") for name in ("handle_m", "tool_com_m", "stated_com_m")}
    return settings(SixAxis, **known | places | {"crosstalk": list_of(row, least=6, most=6, text="shares of the ranges")})


def experiment() -> Any:
    """Return the schema of EXPERIMENT.toml."""
    trials = {"type": "integer", "minimum": 0, "maximum": 1000}
    person = subject() | {
        "segments": {"enum": [2, 3], "default": 2, "description": "3: with a wrist"},
        "spread": number("from the literature, in its standard deviations", least=0.0, most=3.0, default=0.0),
    }
    fault = settings(Fault, kind={"enum": list(FAULTS)}, force_N=pair("[N]"), configuration={"type": "string"})
    run = movement(configuration={"type": "string"}, repeats=trials | {"default": 1}, tests=trials | {"default": 0}, worn=list_of(added()))
    return table(
        {
            "name": {"type": "string"},
            "seed": {"type": "integer", "minimum": 0, "default": 1},
            "model": {"type": "string", "description": "the arm that is simulated, in place of a person of the literature"},
            "believed": {"type": "string", "description": "the model in the data set; only beside `model`"},
            "subject": table(person),
            "joint": list_of(joint([]), most=3),
            "handle": table({"mass": number("[kg]", least=0.0, most=10.0, default=0.0)}),
            "controller": settings(Controller),
            "safety": settings(Safety),
            "sensors": settings(Devices, six_axis=six_axis()),
            "variation": table({"moment_Nm": list_of(number("[N m]", least=0.0), text="one a joint")}),
            "tolerance": tolerance(),
            "fault": list_of(fault),
            "interaction": settings(Interaction, law={"enum": ["impedance", "admittance"]}, link_masses_kg=pair("[kg]")),
            "support": settings(Support, model={"type": "string", "description": "the arm that is carried, as it was identified"}),
            "perturbation": settings(Perturbation, kind={"enum": ["multisine", "prbs", "ramps"]}),
            "movement": list_of(run, least=1),
        }
        | rig(),
        ["movement"],
    )


def sweep() -> Any:
    """Return the schema of SWEEP.toml."""
    vary = {
        "key": {"type": "string", "description": "as in the other files, positions from 1: segment[2].com"},
        "range": pair("low and high of a uniform distribution"),
        "normal": pair("mean and standard deviation"),
        "values": list_of({}, least=1, text="one of them, each as likely"),
        "within": pair("limits of a normal distribution"),
        "apply": {"enum": ["replace", "scale", "add"], "default": "replace"},
    }
    identify = {
        "method": {"enum": ["joint", "cascade"], "default": "joint"},
        "with": list_of({"enum": sorted(kind.kind for kind in kinds())}),
        "motion": {"enum": ["auto", "measured", "simulated"], "default": "auto"},
        "cutoff_Hz": number("of the low-pass [Hz]", above=0.0),
        "level": number("probability of the intervals", above=0.0, default=0.95),
        "bootstrap": {"type": "integer", "minimum": 0, "maximum": 10_000, "default": 0},
    }
    one = [{"required": [name]} for name in ("range", "normal", "values")]
    return table(
        {
            "name": {"type": "string"},
            "seed": {"type": "integer", "minimum": 0, "default": 1},
            "cases": {"type": "integer", "minimum": 1, "maximum": 1_000_000},
            "experiment": {"type": "string", "description": "EXPERIMENT.toml, relative to this file"},
            "dataset": {"type": "string", "description": "folder of a data set that is resampled, in place of `experiment`"},
            "identify": table(identify),
            "vary": list_of(table(vary, ["key"]) | {"oneOf": one}),
        },
        ["cases"],
    ) | {"oneOf": [{"required": ["experiment"]}, {"required": ["dataset"]}]}


def texts() -> dict[Path, str]:
    """Return the files and their contents."""
    made = {
        "model": model(),
        "dataset": dataset(),
        "movement": table({"movement": movement()}, ["movement"]),
        "experiment": experiment(),
        "sweep": sweep(),
    }
    heads = {name: {"$schema": DRAFT, "title": f"{name}.toml of armrs"} for name in made}
    return {
        FOLDER / f"{name}.schema.json": json.dumps(heads[name] | schema, indent=1, ensure_ascii=False) + "\n"
        for name, schema in made.items()
    }


if __name__ == "__main__":
    for path, text in texts().items():
        path.write_text(text, encoding="utf-8")
