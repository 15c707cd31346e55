"""URDF: links and revolute joints with damping and friction. Axis +x, so that the plane is y forward, z up.

Source: the specification of the XML elements `robot`, `link` and `joint` of ROS.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET

from ...errors import BadInput, Text
from ...model import Joint, Model, Segment
from .joints import Exported, document, laws, lost_effects, lost_robot, number, numbers, parse, vector

_ROOT = "ground"
_TIP = "hand_tip"
_PARALLEL = 1e-9
_HELD = ("continuous", "revolute")


def write(model: Model) -> Exported:
    """Return the text of a URDF file."""
    found = laws(model)
    robot = ET.Element("robot", name="arm")
    ET.SubElement(robot, "link", name=_ROOT)
    origin = (0.0, *model.base)
    parent = _ROOT
    for segment, joint, law in zip(model.segments, model.joints, found.joints, strict=True):
        link = ET.SubElement(robot, "link", name=segment.name)
        inertial = ET.SubElement(link, "inertial")
        ET.SubElement(inertial, "origin", xyz=numbers(0.0, segment.com, segment.com_normal), rpy="0 0 0")
        ET.SubElement(inertial, "mass", value=number(segment.mass))
        # Only ixx acts in the plane; the others complete a body that readers accept.
        same = number(segment.inertia)
        ET.SubElement(inertial, "inertia", ixx=same, iyy=same, izz=same, ixy="0", ixz="0", iyz="0")
        element = ET.SubElement(robot, "joint", name=joint.name, type="continuous")
        ET.SubElement(element, "parent", link=parent)
        ET.SubElement(element, "child", link=segment.name)
        ET.SubElement(element, "origin", xyz=numbers(*origin), rpy="0 0 0")
        ET.SubElement(element, "axis", xyz="1 0 0")
        ET.SubElement(element, "dynamics", damping=number(law.viscosity), friction=number(law.coulomb))
        parent, origin = segment.name, (0.0, segment.length, 0.0)
    ET.SubElement(robot, "link", name=_TIP)
    tip = ET.SubElement(robot, "joint", name=_TIP, type="fixed")
    ET.SubElement(tip, "parent", link=parent)
    ET.SubElement(tip, "child", link=_TIP)
    ET.SubElement(tip, "origin", xyz=numbers(*origin), rpy="0 0 0")
    lost = []
    for j, law in enumerate(found.joints, start=1):
        if law.stiffness:
            lost.append(f"joint {j}: stiffness {law.stiffness:g} N m/rad about {law.rest:g} rad")
        if law.rotor:
            lost.append(f"joint {j}: rotor inertia {law.rotor:g} kg m²")
    lost += [*lost_effects(found.others), *lost_robot(model), "gravity: set by the program that reads the file"]
    return Exported(document(robot), tuple(lost))


def read(text: str) -> Model:
    """Return the planar chain of a URDF file."""
    robot = parse(text, "robot")
    links = {link.get("name", ""): link for link in robot.findall("link")}
    joints = robot.findall("joint")
    by_parent: dict[str, list[ET.Element]] = {}
    for joint in joints:
        if joint.find("mimic") is not None:
            raise BadInput(f"<joint {joint.get('name')!r}>", Text("mimic"), "joints that move by themselves")
        by_parent.setdefault(_end(joint, "parent"), []).append(joint)
    children = {_end(joint, "child") for joint in joints}
    roots = [name for name in links if name not in children]
    if len(roots) != 1:
        raise BadInput("links", Text(f"{len(roots)} roots"), "one")
    return _walk(roots[0], links, by_parent)


def _end(joint: ET.Element, which: str) -> str:
    element = joint.find(which)
    if element is None or not element.get("link"):
        raise BadInput(f"<joint {joint.get('name')!r}>", Text(f"no <{which}>"), f"a {which} link")
    return element.get("link", "")


def _walk(root: str, links: dict[str, ET.Element], by_parent: dict[str, list[ET.Element]]) -> Model:
    base: tuple[float, float] | None = None
    segments: list[tuple[ET.Element, ET.Element]] = []
    origins: list[tuple[float, float]] = []
    at, seen = root, {root}
    tip: tuple[float, float] | None = None
    while branches := by_parent.get(at, []):
        if len(branches) > 1:
            raise BadInput(f"<link {at!r}>", Text(f"{len(branches)} joints"), "an unbranched chain")
        (joint,) = branches
        place = _planar_origin(joint)
        child = _end(joint, "child")
        if child in seen or child not in links:
            raise BadInput(f"<joint {joint.get('name')!r}>", child, "a link of the file that was not met before")
        seen.add(child)
        at = child
        if joint.get("type") == "fixed":
            tip = place
            continue
        if joint.get("type") not in _HELD or tip is not None:
            raise BadInput(
                f"<joint {joint.get('name')!r}>", joint.get("type"), "continuous or revolute; fixed only at the end of the chain"
            )
        _axis(joint)
        if base is None:
            base = place
        else:
            origins.append(place)
        segments.append((joint, links[child]))
    if base is None:
        raise BadInput("joints", Text("none that turns"), "a chain of hinges")
    if tip is None:
        raise BadInput(f"<link {at!r}>", Text("no end"), "a fixed joint at the hand: it says how long the last segment is")
    ends = [*origins, tip]
    made = [_segment(link, end) for (_, link), end in zip(segments, ends, strict=True)]
    return Model(tuple(made), tuple(_joint(joint) for joint, _ in segments), base=base)


def _planar_origin(joint: ET.Element) -> tuple[float, float]:
    origin = joint.find("origin")
    if origin is None:
        return 0.0, 0.0
    x, y, z = vector(origin, "xyz", 3, (0.0, 0.0, 0.0))
    roll = vector(origin, "rpy", 3, (0.0, 0.0, 0.0))
    if any(roll) or abs(x) > _PARALLEL:
        raise BadInput(f"<joint {joint.get('name')!r}> origin", Text("turned, or beside the plane y, z"), "rpy 0 0 0 and x 0")
    return y, z


def _axis(joint: ET.Element) -> None:
    axis = joint.find("axis")
    found = vector(axis, "xyz", 3) if axis is not None else (1.0, 0.0, 0.0)
    if abs(found[0] - 1.0) > _PARALLEL or max(abs(found[1]), abs(found[2])) > _PARALLEL:
        raise BadInput(f"<joint {joint.get('name')!r}> axis", Text(numbers(*found)), "1 0 0: the arm moves in the plane y, z")


def _segment(link: ET.Element, end: tuple[float, float]) -> Segment:
    name = link.get("name", "")
    if end[1] != 0.0:
        raise BadInput(
            f"<link {name!r}>", Text(f"its next joint at z = {end[1]:g} m"), "along y: angles count from the line between joints"
        )
    inertial = link.find("inertial")
    mass, inertia = (inertial.find(k) if inertial is not None else None for k in ("mass", "inertia"))
    if inertial is None or mass is None or inertia is None:
        raise BadInput(f"<link {name!r}>", Text("no mass or inertia"), "an <inertial> with both")
    origin = inertial.find("origin")
    _, com, normal = vector(origin, "xyz", 3, (0.0, 0.0, 0.0)) if origin is not None else (0.0, 0.0, 0.0)
    return Segment(name, end[0], vector(mass, "value", 1)[0], com, vector(inertia, "ixx", 1)[0], com_normal=normal)


def _joint(joint: ET.Element) -> Joint:
    dynamics = joint.find("dynamics")
    if dynamics is None:
        return Joint(joint.get("name", ""))
    damping, friction = (vector(dynamics, key, 1, (0.0,))[0] for key in ("damping", "friction"))
    return Joint(joint.get("name", ""), viscosity=damping, coulomb=friction)
