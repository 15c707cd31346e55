"""The joint laws of a model as other formats state them, and what these formats cannot represent."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass, field

from ... import _armrs
from ...errors import BadInput, Text
from ...model import Effect, Model


@dataclass(frozen=True)
class Exported:
    """The text of a file, and what it could not hold."""

    text: str
    lost: tuple[str, ...]


@dataclass
class JointLaw:
    """The laws of one joint: springs are summed into one."""

    stiffness: float = 0.0
    rest: float = 0.0
    viscosity: float = 0.0
    coulomb: float = 0.0
    rotor: float = 0.0


@dataclass
class Laws:
    """The laws of every joint, and the effects that are none of these."""

    joints: list[JointLaw]
    others: list[Effect] = field(default_factory=list)


_LAWS = {kind: (key, parameter) for key, kind, parameter in _armrs.JOINT_LAWS}
_LAWS_OF_ROTORS = {"motor_inertia": ("rotor", "inertia")}


def laws(model: Model) -> Laws:
    """Return the laws of the joints, with those effects that have the same form added to them."""
    found = Laws([JointLaw(j.stiffness, j.rest, j.viscosity, j.coulomb) for j in model.joints])
    for effect in model.effects:
        known = (_LAWS | _LAWS_OF_ROTORS).get(effect.kind)
        if known is None or effect.joint is None:
            found.others.append(effect)
            continue
        law = found.joints[effect.joint - 1]
        ours, theirs = known
        value = effect.parameters[theirs]
        if ours == "stiffness" and law.stiffness + value != 0.0:
            # Two springs side by side are one about the mean of their rest angles, weighted with their stiffness.
            law.rest = (law.stiffness * law.rest + value * effect.parameters["rest"]) / (law.stiffness + value)
        setattr(law, ours, getattr(law, ours) + value)
    return found


def lost_effects(effects: list[Effect]) -> list[str]:
    """Return a line for each effect that a format has no element for."""
    return [f"effect {e.kind}{'' if e.joint is None else f' of joint {e.joint}'}" for e in effects]


def lost_robot(model: Model) -> list[str]:
    """Return a line where a robot leads the arm: other formats hold the arm alone."""
    return ["the robot and its contact with the hand"] if model.robot is not None or model.contact is not None else []


def number(value: float) -> str:
    """Write a number so that reading it back gives the same bits."""
    return repr(float(value))


def numbers(*values: float) -> str:
    """Write numbers between blanks."""
    return " ".join(number(v) for v in values)


def document(root: ET.Element) -> str:
    """Return indented XML text."""
    ET.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def parse(text: str, name: str) -> ET.Element:
    """Return the root element; a document type (entities) is refused, as is another root than `name`."""
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise BadInput("XML", Text("a document type"), "XML without one")
    try:
        root = ET.fromstring(text)
    except ET.ParseError as error:
        raise BadInput("XML", Text(str(error)), "well-formed XML") from None
    if root.tag != name:
        raise BadInput("XML", Text(f"<{root.tag}> as root"), f"<{name}>")
    return root


def plain_value(text: str) -> list[float] | str:
    """Return the numbers of an attribute, or its word."""
    try:
        return [float(part) for part in text.split()]
    except ValueError:
        return text


def vector(element: ET.Element, key: str, size: int, default: tuple[float, ...] | None = None) -> tuple[float, ...]:
    """Return the numbers of an attribute."""
    text = element.get(key)
    place = f"<{element.tag} name={element.get('name', '')!r}> {key}"
    if text is None:
        if default is None:
            raise BadInput(place, Text("nothing"), f"{size} number{'s' * (size > 1)}")
        return default
    try:
        found = tuple(float(part) for part in text.split())
    except ValueError:
        found = ()
    if len(found) != size or not all(abs(x) < 1e12 for x in found):
        raise BadInput(place, text, f"{size} finite number{'s' * (size > 1)}")
    return found
