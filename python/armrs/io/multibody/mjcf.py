"""MJCF of MuJoCo: hinges with stiffness, damping, dry friction and rotor inertia; fixed tendons for springs over two joints.

Source: MuJoCo's XML reference, elements `body`, `joint`, `inertial`, `tendon/fixed`.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET

from ...errors import BadInput, Text
from ...model import Effect, Joint, Model, Segment
from .joints import Exported, document, laws, lost_effects, lost_robot, number, numbers, parse, vector

_KNOWN_JOINT = {"name", "type", "axis", "pos", "stiffness", "springref", "damping", "frictionloss", "armature", "ref", "limited"}


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
            fixed = ET.SubElement(tendon, "fixed", stiffness=number(e.parameters["stiffness"]), springlength=number(e.parameters["rest"]))
            ET.SubElement(fixed, "joint", joint=model.joints[e.joint - 2].name, coef=number(e.parameters["ratio"]))
            ET.SubElement(fixed, "joint", joint=model.joints[e.joint - 1].name, coef="1")
    lost = [*lost_effects([e for e in found.others if e not in springs]), *lost_robot(model)]
    if any(law.coulomb for law in found.joints):
        lost.append("dry friction is a soft constraint in MuJoCo: it creeps where it should stick")
    return Exported(document(root), tuple(lost))


def _is_two_joint_spring(effect: Effect) -> bool:
    """Whether an effect is a linear spring over its joint and the one before, as a fixed tendon is."""
    return effect.kind == "biarticular" and (effect.joint or 0) >= 2 and effect.parameters["stiffness"] >= 0.0


def read(text: str) -> Model:
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
    base = _place(bodies[0])
    segments, joints, rotors = [], [], []
    chain = [bodies[0]]
    while inner := chain[-1].findall("body"):
        if len(inner) > 1:
            raise BadInput(f"<body {chain[-1].get('name')!r}>", Text(f"{len(inner)} bodies"), "an unbranched chain")
        chain.append(inner[0])
    for k, body in enumerate(chain):
        end = _place(chain[k + 1]) if k + 1 < len(chain) else _site(body)
        segments.append(_segment(body, end, k))
        joint, rotor = _joint(body)
        joints.append(joint)
        if rotor:
            rotors.append(Effect("motor_inertia", k + 1, parameters={"inertia": rotor}))
    springs = [_spring(fixed, [j.name for j in joints]) for fixed in root.findall("tendon/fixed")]
    return Model(tuple(segments), tuple(joints), gravity=-gravity[2], base=base, effects=(*rotors, *springs))


def _refuse_foreign(root: ET.Element) -> None:
    compiler = root.find("compiler")
    if (compiler.get("angle", "degree") if compiler is not None else "degree") != "radian":
        raise BadInput("<compiler> angle", Text("degrees, MuJoCo's default"), 'angle="radian"')
    for tag in ("default", "include", "equality", "actuator", "contact"):
        element = root.find(tag)
        if element is not None and (len(element) or element.attrib):
            raise BadInput(f"<{tag}>", Text("elements that change the arm"), f"a file without <{tag}>: save it as MuJoCo compiled it")


def _place(body: ET.Element) -> tuple[float, float]:
    x, y, z = vector(body, "pos", 3, (0.0, 0.0, 0.0))
    turned = [key for key in ("quat", "euler", "axisangle", "xyaxes", "zaxis") if body.get(key) is not None]
    if x or turned:
        raise BadInput(
            f"<body {body.get('name')!r}>", Text(f"x = {x:g} m{' and ' + turned[0] if turned else ''}"), "in the plane y, z, not turned"
        )
    return y, z


def _site(body: ET.Element) -> tuple[float, float]:
    sites = body.findall("site")
    if not sites:
        raise BadInput(f"<body {body.get('name')!r}>", Text("no <site>"), "a site at the hand: it says how long the last segment is")
    return _place(sites[-1])


def _segment(body: ET.Element, end: tuple[float, float], k: int) -> Segment:
    name = body.get("name") or f"segment {k + 1}"
    inertial = body.find("inertial")
    if inertial is None:
        raise BadInput(f"<body {name!r}>", Text("no <inertial>"), "mass, centre of mass and inertia: save the file as MuJoCo compiled it")
    if end[1] != 0.0:
        raise BadInput(f"<body {name!r}>", Text(f"its end at z = {end[1]:g} m"), "along y: angles count from the line between joints")
    com = _place(inertial)
    return Segment(name, end[0], vector(inertial, "mass", 1)[0], com[0], vector(inertial, "diaginertia", 3)[0], com_normal=com[1])


def _joint(body: ET.Element) -> tuple[Joint, float]:
    joints = body.findall("joint")
    if len(joints) != 1 or body.find("freejoint") is not None:
        raise BadInput(f"<body {body.get('name')!r}>", Text(f"{len(joints)} hinges"), "one")
    (joint,) = joints
    name: str = joint.get("name") or body.get("name") or "joint"
    foreign = set(joint.keys()) - _KNOWN_JOINT
    if joint.get("type", "hinge") != "hinge" or foreign or vector(joint, "pos", 3, (0.0,) * 3) != (0.0, 0.0, 0.0):
        found = Text(f"type {joint.get('type', 'hinge')}{', ' + ', '.join(sorted(foreign)) if foreign else ''}")
        raise BadInput(f"<joint {name!r}>", found, "a hinge at the start of its body with stiffness, damping, frictionloss, armature")
    if vector(joint, "axis", 3, (0.0, 0.0, 1.0)) != (1.0, 0.0, 0.0) or vector(joint, "ref", 1, (0.0,))[0]:
        raise BadInput(f"<joint {name!r}>", Text("another axis, or a reference angle"), "axis 1 0 0, ref 0")
    k, rest, viscosity, coulomb, rotor = (
        vector(joint, key, 1, (0.0,))[0] for key in ("stiffness", "springref", "damping", "frictionloss", "armature")
    )
    return Joint(name, stiffness=k, rest=rest, viscosity=viscosity, coulomb=coulomb), rotor


def _spring(fixed: ET.Element, names: list[str]) -> Effect:
    parts = [(p.get("joint"), vector(p, "coef", 1)[0]) for p in fixed.findall("joint")]
    if len(parts) == 2 and parts[1][0] in names and parts[0][0] in names:
        near, far = names.index(parts[0][0]), names.index(parts[1][0])
        if far == near + 1 and parts[1][1] == 1.0:
            values = {"ratio": parts[0][1]}
            values |= {"stiffness": vector(fixed, "stiffness", 1, (0.0,))[0], "rest": vector(fixed, "springlength", 1, (0.0,))[0]}
            return Effect("biarticular", far + 1, parameters=values)
    raise BadInput("<tendon> fixed", Text(str(parts)), "two joints one after the other, the far one with coef 1")
