"""MJCF of MuJoCo: hinges with stiffness, damping, dry friction and rotor inertia; fixed tendons for springs over two joints.

Source: MuJoCo's XML reference, elements `body`, `joint`, `inertial`, `tendon/fixed`.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...errors import BadInput, Text
from ...model import Effect, Joint, Model
from .chain import Body, Hinge, Imported, planar
from .joints import Exported, document, laws, lost_effects, lost_robot, number, numbers, parse, plain_value, vector

_KNOWN_JOINT = {"name", "type", "axis", "pos", "stiffness", "springref", "damping", "frictionloss", "armature", "ref", "limited", "range"}
_KNOWN_TENDON = {"name", "group", "user", "stiffness", "springlength"}
_KNOWN_IN_BODY = {"joint", "freejoint", "inertial", "geom", "site", "camera", "light", "body"}
"""What else stands in a body holds, makes or carries bodies: `frame`, `attach`, `replicate`, `composite`, `flexcomp`, `plugin`."""
_AT_REST = -1.0
"""The `springlength` that stands for the length at the rest angles of the joints, meant where none is stated."""
_ROUNDED = 1e-6
"""Share by which figures of a flat body, rounded in a file, may fail the rule that a moment of inertia is at most the sum of the others."""
_EMPTY = ("default", "include", "equality", "actuator", "contact", "deformable", "extension")
"""Sections that change the arm as soon as they hold anything."""
_NEUTRAL: dict[str, dict[str, tuple[str, ...]]] = {
    "compiler": {
        "inertiafromgeom": ("auto", "false"), "coordinate": ("local",),
        "boundmass": ("0",), "boundinertia": ("0",), "settotalmass": ("-1",),
    },
    "option": {"viscosity": ("0",), "density": ("0",), "wind": ("0 0 0",)},
    "flag": dict.fromkeys(("gravity", "spring", "damper", "passive", "frictionloss", "constraint"), ("enable",)),
    "body": {"gravcomp": ("0",), "mocap": ("false",)},
}  # fmt: skip
"""Element -> attributes that change masses, gravity or the laws of joints -> values with which they change nothing."""


def write(model: Model) -> Exported:
    """Return the text of an MJCF file."""
    found = laws(model)
    root = ET.Element("mujoco", model="arm")
    ET.SubElement(root, "compiler", angle="radian", autolimits="true", balanceinertia="false", boundmass="0")
    ET.SubElement(root, "option", gravity=numbers(0.0, 0.0, -model.gravity), timestep="0.0005", integrator="RK4")
    parent = ET.SubElement(root, "worldbody")
    place = (0.0, *model.base)
    for segment, joint, law in zip(model.segments, model.joints, found.joints, strict=True):
        body = ET.SubElement(parent, "body", name=segment.name, pos=numbers(*place))
        ET.SubElement(
            body, "joint", name=joint.name, type="hinge", axis="1 0 0", stiffness=number(law.stiffness), springref=number(law.rest),
            damping=number(law.viscosity), frictionloss=number(law.coulomb), armature=number(law.rotor),
        )  # fmt: skip
        com = numbers(0.0, segment.com, segment.com_normal)
        ET.SubElement(body, "inertial", pos=com, mass=number(segment.mass), diaginertia=numbers(*(3 * (segment.inertia,))))
        parent, place = body, (0.0, segment.length, 0.0)
    ET.SubElement(parent, "site", name="hand", pos=numbers(*place))
    springs = [e for e in found.others if _is_two_joint_spring(e)]
    if springs:
        tendon = ET.SubElement(root, "tendon")
        for e in springs:
            assert e.joint is not None
            rest = _spring_length(e.parameters["rest"])
            fixed = ET.SubElement(tendon, "fixed", stiffness=number(e.parameters["stiffness"]), springlength=rest)
            ET.SubElement(fixed, "joint", joint=model.joints[e.joint - 2].name, coef=number(e.parameters["ratio"]))
            ET.SubElement(fixed, "joint", joint=model.joints[e.joint - 1].name, coef="1")
    lost = [*lost_effects([e for e in found.others if e not in springs]), *lost_robot(model)]
    if any(law.coulomb for law in found.joints):
        lost.append("dry friction is a soft constraint in MuJoCo: it creeps where it should stick")
    return Exported(document(root), tuple(lost))


def _is_two_joint_spring(effect: Effect) -> bool:
    """Whether an effect is a linear spring over its joint and the one before, as a fixed tendon is."""
    return effect.kind == "biarticular" and (effect.joint or 0) >= 2 and effect.parameters["stiffness"] >= 0.0


def read(text: str) -> Imported:
    """Return the planar chain of an MJCF file."""
    root = parse(text, "mujoco")
    _refuse_foreign(root)
    option = root.find("option")
    gravity = vector(option, "gravity", 3, (0.0, 0.0, -9.81)) if option is not None else (0.0, 0.0, -9.81)
    if gravity[0] or gravity[1] or gravity[2] > 0.0:
        raise BadInput("<option> gravity", Text(numbers(*gravity)), "along −z")
    world = root.find("worldbody")
    bodies = world.findall("body") if world is not None else []
    if len(bodies) != 1:
        raise BadInput("<worldbody>", Text(f"{len(bodies)} bodies"), "one chain")
    turn = 1.0 if _compiler(root, "angle", "degree") == "radian" else math.pi / 180.0
    hinges: list[Hinge] = []
    rotors: list[Effect] = []
    turned, body = np.eye(3), bodies[0]
    while True:
        place, turned = turned @ _place(body), turned @ _rotation(body)
        joint, axis, rotor = _joint(body, turn)
        hinges.append(Hinge(body.get("name") or f"segment {len(hinges) + 1}", joint, turned @ axis, place, [_body(body, turned)]))
        if rotor:
            rotors.append(Effect("motor_inertia", len(hinges), parameters={"inertia": rotor}))
        inner = body.findall("body")
        if len(inner) > 1:
            raise BadInput(f"<body {body.get('name')!r}>", Text(f"{len(inner)} bodies"), "an unbranched chain")
        if not inner:
            break
        body = inner[0]
    sites = body.findall("site")
    found = planar(hinges, turned @ _place(sites[-1]) if sites else None, -gravity[2])
    springs = [_spring(fixed, [hinge.joint for hinge in hinges], found.zeros) for fixed in root.findall("tendon/fixed")]
    by_itself = _compiler(root, "autolimits", "true")
    with_range = [joint for joint in bodies[0].iter("joint") if joint.get("range") is not None]
    stopped = [
        j.get("name", "joint") for j in with_range if (by_itself if j.get("limited", "auto") == "auto" else j.get("limited")) == "true"
    ]
    return replace(found, model=found.model.replace(effects=(*rotors, *springs))).without_stops(stopped)


def _compiler(root: ET.Element, setting: str, default: str) -> str:
    compiler = root.find("compiler")
    return compiler.get(setting, default) if compiler is not None else default


def _refuse_foreign(root: ET.Element) -> None:
    """Refuse what would change the arm and is not read: better no arm than another one."""
    for tag in sorted({section.tag for section in root}):
        found = root.findall(tag)
        if tag in _EMPTY and any(len(section) or section.attrib for section in found):
            raise BadInput(f"<{tag}>", Text("elements that change the arm"), f"a file without <{tag}>: save it as MuJoCo compiled it")
        if len(found) > 1 and tag in ("compiler", "option", "worldbody"):
            raise BadInput(f"<{tag}>", Text(f"{len(found)} of them"), "one: save the file as MuJoCo compiled it")
    for element in root.iter():
        for key, neutral in _NEUTRAL.get(element.tag, {}).items():
            if plain_value(element.get(key, neutral[0])) not in map(plain_value, neutral):
                raise BadInput(f"<{element.tag}> {key}", element.get(key), " or ".join(neutral))
    for parent in root.iter():
        if parent.tag in ("worldbody", "body"):
            for tag in sorted({child.tag for child in parent} - _KNOWN_IN_BODY):
                raise BadInput(f"<{parent.tag}>", Text(f"<{tag}>"), "bodies within bodies: save the file as MuJoCo compiled it")
    for tendon in root.findall("tendon/*"):
        if tendon.tag != "fixed" or (foreign := sorted(set(tendon.keys()) - _KNOWN_TENDON)):
            found_there = f"<{tendon.tag}>" if tendon.tag != "fixed" else ", ".join(foreign)
            raise BadInput("<tendon>", Text(found_there), "fixed tendons with stiffness and springlength alone")


def _place(element: ET.Element) -> np.ndarray:
    return np.array(vector(element, "pos", 3, (0.0, 0.0, 0.0)))


def _rotation(element: ET.Element) -> np.ndarray:
    """Return how a body or its axes of inertia are turned."""
    other = [key for key in ("euler", "axisangle", "xyaxes", "zaxis") if element.get(key) is not None]
    if other:
        raise BadInput(f"<{element.tag} {element.get('name')!r}>", Text(other[0]), "quat: save the file as MuJoCo compiled it")
    w, x, y, z = np.array(vector(element, "quat", 4, (1.0, 0.0, 0.0, 0.0)))
    if (square := w * w + x * x + y * y + z * z) == 0.0:
        raise BadInput(f"<{element.tag} {element.get('name')!r}> quat", Text("0 0 0 0"), "a rotation")
    s = 2.0 / square
    return np.array(
        [
            [1.0 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)],
            [s * (x * y + w * z), 1.0 - s * (x * x + z * z), s * (y * z - w * x)],
            [s * (x * z - w * y), s * (y * z + w * x), 1.0 - s * (x * x + y * y)],
        ]
    )


def _body(body: ET.Element, turned: np.ndarray) -> Body:
    inertial = body.find("inertial")
    if inertial is None:
        hint = "mass, centre of mass and inertia: save the file as MuJoCo compiled it"
        raise BadInput(f"<body {body.get('name')!r}>", Text("no <inertial>"), hint)
    if inertial.get("fullinertia") is not None:
        xx, yy, zz, xy, xz, yz = vector(inertial, "fullinertia", 6)
        inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    else:
        inertia = np.diag(vector(inertial, "diaginertia", 3))
    principal = np.linalg.eigvalsh(inertia)
    if 2.0 * principal[-1] > (1.0 + _ROUNDED) * principal.sum():
        found = Text(f"principal moments of inertia {', '.join(f'{value:.4g}' for value in principal)} kg m²")
        raise BadInput(f"<body {body.get('name')!r}>", found, "none greater than the sum of the others")
    about = turned @ _rotation(inertial)
    return Body(vector(inertial, "mass", 1)[0], turned @ _place(inertial), about @ inertia @ about.T)


def _joint(body: ET.Element, turn: float) -> tuple[Joint, np.ndarray, float]:
    joints = body.findall("joint")
    if len(joints) != 1 or body.find("freejoint") is not None:
        raise BadInput(f"<body {body.get('name')!r}>", Text(f"{len(joints)} hinges"), "one")
    (joint,) = joints
    name: str = joint.get("name") or body.get("name") or "joint"
    foreign = set(joint.keys()) - _KNOWN_JOINT
    if joint.get("type", "hinge") != "hinge" or foreign or vector(joint, "pos", 3, (0.0,) * 3) != (0.0, 0.0, 0.0):
        found = Text(f"type {joint.get('type', 'hinge')}{', ' + ', '.join(sorted(foreign)) if foreign else ''}")
        raise BadInput(f"<joint {name!r}>", found, "a hinge at the start of its body with stiffness, damping, frictionloss, armature")
    axis = np.array(vector(joint, "axis", 3, (0.0, 0.0, 1.0)))
    if not axis.any() or vector(joint, "ref", 1, (0.0,))[0]:
        raise BadInput(f"<joint {name!r}>", Text("no axis, or a reference angle"), "an axis, ref 0")
    k, rest, viscosity, coulomb, rotor = (
        vector(joint, key, 1, (0.0,))[0] for key in ("stiffness", "springref", "damping", "frictionloss", "armature")
    )
    law = Joint(name, stiffness=k, rest=turn * rest, viscosity=viscosity, coulomb=coulomb)
    return law, axis / np.linalg.norm(axis), rotor


def _spring_length(rest: float) -> str:
    """Write the rest of a spring; what MuJoCo would take for the length at the rest angles, as the number next to it."""
    return number(np.nextafter(rest, 0.0) if rest == _AT_REST else rest)


def _spring(fixed: ET.Element, joints: list[Joint], zeros: Sequence[float]) -> Effect:
    """Return a spring over two joints, its rest in the angles of the arm."""
    names = [joint.name for joint in joints]
    parts = [(p.get("joint"), vector(p, "coef", 1)[0]) for p in fixed.findall("joint")]
    if len(parts) == 2 and parts[1][0] in names and parts[0][0] in names:
        near, far = names.index(parts[0][0]), names.index(parts[1][0])
        if far == near + 1 and parts[1][1] == 1.0:
            ratio, length = parts[0][1], vector(fixed, "springlength", 1, (_AT_REST,))[0]
            if length == _AT_REST:
                length = ratio * joints[near].rest + joints[far].rest
            rest = length + (ratio * zeros[near] + zeros[far])
            values = {"ratio": ratio, "stiffness": vector(fixed, "stiffness", 1, (0.0,))[0], "rest": rest}
            return Effect("biarticular", far + 1, parameters=values)
    raise BadInput("<tendon> fixed", Text(str(parts)), "two joints one after the other, the far one with coef 1")
