"""OSIM of OpenSim 4: bodies, pin joints, and a spring with a damper at each joint.

OpenSim's pins turn about z in the plane x, y: our y is written as x, our z as y.
Source: OpenSim's API, classes Body, PinJoint and SpringGeneralizedForce.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET

from ...model import Model
from .joints import Exported, JointLaw, document, laws, lost_effects, lost_robot, number, numbers

_VERSION = "40500"


def write(model: Model) -> Exported:
    """Return the text of an OSIM file."""
    found = laws(model)
    root = ET.Element("OpenSimDocument", Version=_VERSION)
    top = ET.SubElement(root, "Model", name="arm")
    ET.SubElement(top, "gravity").text = numbers(0.0, -model.gravity, 0.0)
    bodies = _set(top, "BodySet")
    joints = _set(top, "JointSet")
    forces = _set(top, "ForceSet")
    names = _unique([s.name for s in model.segments])
    coordinates = _unique([j.name for j in model.joints])
    parent, place = "/ground", model.base
    for segment, name, coordinate, law in zip(model.segments, names, coordinates, found.joints, strict=True):
        body = ET.SubElement(bodies, "Body", name=name)
        ET.SubElement(body, "mass").text = number(segment.mass)
        ET.SubElement(body, "mass_center").text = numbers(segment.com, segment.com_normal, 0.0)
        ET.SubElement(body, "inertia").text = numbers(*(3 * (segment.inertia,)), 0.0, 0.0, 0.0)
        _pin(joints, parent, f"/bodyset/{name}", place, coordinate)
        if law.stiffness or law.viscosity:
            _spring(forces, coordinate, law)
        parent, place = f"/bodyset/{name}", (segment.length, 0.0)
    lost = [f"joint {j}: dry friction {law.coulomb:g} N m" for j, law in enumerate(found.joints, start=1) if law.coulomb]
    lost += [f"joint {j}: rotor inertia {law.rotor:g} kg m²" for j, law in enumerate(found.joints, start=1) if law.rotor]
    return Exported(document(root), (*lost, *lost_effects(found.others), *lost_robot(model)))


def _set(top: ET.Element, kind: str) -> ET.Element:
    return ET.SubElement(ET.SubElement(top, kind, name=kind.lower()), "objects")


def _unique(names: list[str]) -> list[str]:
    """Return names as paths of OpenSim allow them: letters, digits and underscores, each once."""
    plain = [re.sub(r"\W", "_", name, flags=re.ASCII) or "part" for name in names]
    return [name if plain.count(name) == 1 else f"{name}_{k}" for k, name in enumerate(plain, start=1)]


def _pin(joints: ET.Element, parent: str, child: str, place: tuple[float, float], coordinate: str) -> None:
    pin = ET.SubElement(joints, "PinJoint", name=f"{coordinate}_pin")
    ET.SubElement(pin, "socket_parent_frame").text = "at_parent"
    ET.SubElement(pin, "socket_child_frame").text = "at_child"
    listed = ET.SubElement(pin, "coordinates")
    own = ET.SubElement(listed, "Coordinate", name=coordinate)
    ET.SubElement(own, "range").text = "-100 100"
    ET.SubElement(own, "clamped").text = "false"
    frames = ET.SubElement(pin, "frames")
    for name, socket, at in (("at_parent", parent, place), ("at_child", child, (0.0, 0.0))):
        frame = ET.SubElement(frames, "PhysicalOffsetFrame", name=name)
        ET.SubElement(frame, "socket_parent").text = socket
        ET.SubElement(frame, "translation").text = numbers(*at, 0.0)
        ET.SubElement(frame, "orientation").text = "0 0 0"


def _spring(forces: ET.Element, coordinate: str, law: JointLaw) -> None:
    spring = ET.SubElement(forces, "SpringGeneralizedForce", name=f"{coordinate}_passive")
    ET.SubElement(spring, "coordinate").text = coordinate
    ET.SubElement(spring, "stiffness").text = number(law.stiffness)
    ET.SubElement(spring, "rest_length").text = number(law.rest)
    ET.SubElement(spring, "viscosity").text = number(law.viscosity)
