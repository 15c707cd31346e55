"""Write the JSON Schemas of model.toml and dataset.toml, so that editors complete and check them.

Run with the project's own Python after a build: `.venv/bin/python scripts/schemas.py`. A test compares the files with the catalogue.
In a file, `#:schema PATH/model.schema.json` as the first line tells editors with a TOML language server.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from armrs.catalogue import FORCE_CHANNELS, Kind, Parameter, catalogue

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


def effect(kind: Kind) -> Any:
    """Return the schema of an effect of one kind."""
    places = {"joint": {"type": "integer", "minimum": kind.first_joint}, "channel": {"enum": list(FORCE_CHANNELS)}}
    address = {kind.address: places[kind.address]} if kind.address else {}
    values = {p.name: parameter(p) for p in kind.parameters}
    text = f"{kind.summary}. {kind.formula}"
    return table({"kind": {"const": kind.kind}, **address, **values}, ["kind", *address], text)


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
    joint = {
        "name": {"type": "string"},
        "stiffness": number("[N m/rad] about `rest`", least=0.0, default=0.0),
        "rest": number("[rad]", default=0.0),
        "viscosity": number("[N m s/rad]", least=0.0, default=0.0),
        "coulomb": number("dry friction [N m]", least=0.0, default=0.0),
    }
    arm = {
        "gravity": number("along −z [m/s²]", least=0.0, default=9.81),
        "base": pair("first joint, y and z [m]"),
        "segment_uncertainty": number("relative standard deviation of masses, centres of mass and inertias", least=0.0, most=1.0),
        "joint_uncertainty": number("relative standard deviation of the joint laws; 0 is exact", least=0.0, most=1.0),
        "segment": {"type": "array", "items": table(segment, ["name", "length", "mass", "com", "inertia"]), "minItems": 1, "maxItems": 6},
        "joint": {"type": "array", "items": table(joint, ["name"]), "minItems": 1, "maxItems": 6},
    }
    robot = {"lengths": pair("[m]"), "base": pair("first axis, y and z [m]"), "elbow": {"enum": ["up", "down"]}}
    contact = {"stiffness": pair("[N/m]"), "damping": pair("[N s/m]")}
    kinds = [effect(kind) for kind in catalogue().values() if not kind.own]
    return {"$schema": DRAFT, "title": "model.toml of armrs"} | table(
        {
            "arm": table(arm, ["segment", "joint"]),
            "robot": table(robot, ["lengths", "base"]),
            "contact": table(contact, ["stiffness"]),
            "effect": {"type": "array", "items": {"oneOf": kinds}},
        },
        ["arm"],
    )


def dataset() -> Any:
    """Return the schema of dataset.toml."""
    trial = {
        "file": {"type": "string", "description": "CSV or Parquet, relative to this file"},
        "configuration": {"type": "string", "description": "name of the movement, shared by its repeats"},
        "repeat": {"type": "integer", "minimum": 1},
        "role": {"enum": ["fit", "test"], "description": "nothing is chosen or fitted on a test trial"},
    }
    subject = {
        "name": {"type": "string"},
        "body_mass": number("[kg]", least=1.0, most=500.0),
        "height": number("[m]", least=0.3, most=3.0),
        "sex": {"enum": ["male", "female"]},
        "lengths_m": {
            "type": "array",
            "items": {"type": "number", "exclusiveMinimum": 0.0, "maximum": 1.0},
            "maxItems": 3,
            "description": "measured lengths of the segments [m]",
        },
    }
    tolerance = {
        "angle_offset_deg": number("one standard deviation [deg]", least=0.0, default=0.3),
        "force_bias_N": number("one standard deviation [N]", least=0.0, default=0.2),
        "force_gain": number("one standard deviation, relative", least=0.0, default=0.01),
        "time_delay_s": number("one standard deviation, force against angles [s]", least=0.0, default=0.005),
        "handle_placement_m": number("one standard deviation [m]", least=0.0, default=0.001),
    }
    added = {
        "segment": {"type": "integer", "minimum": 1},
        "mass": number("[kg]", above=0.0, most=20.0),
        "at": number("from the segment's proximal joint [m]", least=0.0, most=2.0),
        "configurations": {"type": "array", "items": {"type": "string"}},
    }
    return {"$schema": DRAFT, "title": "dataset.toml of armrs"} | table(
        {
            "name": {"type": "string"},
            "model": {"type": "string", "description": "the model file, relative to this one; not needed beside a whole [subject]"},
            "force_on": {"enum": ["robot", "arm"], "description": "what the recorded force acts on"},
            "sample_rate": number("where time stamps are uneven [Hz]", above=0.0, most=1e6),
            "synthetic": {"type": "boolean"},
            "subject": table(subject),
            "tolerance": table(tolerance),
            "added": {"type": "array", "items": table(added, ["segment", "mass", "at"])},
            "trial": {"type": "array", "items": table(trial, ["file", "configuration", "role"]), "minItems": 1},
        },
        ["trial"],
    )


def texts() -> dict[Path, str]:
    """Return the files and their contents."""
    made = {"model": model(), "dataset": dataset()}
    return {FOLDER / f"{name}.schema.json": json.dumps(schema, indent=1, ensure_ascii=False) + "\n" for name, schema in made.items()}


if __name__ == "__main__":
    for path, text in texts().items():
        path.write_text(text, encoding="utf-8")
