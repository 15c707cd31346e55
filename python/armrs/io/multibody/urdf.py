"""URDF: links and revolute joints with damping and friction. Written with axes +x, so that the plane is y forward, z up.

Source: the specification of the XML elements `robot`, `link` and `joint` of ROS.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np

from ...errors import BadInput, Text
from ...model import Joint, Model
from .chain import Body, Hinge, Imported, planar
from .joints import Exported, document, laws, lost_effects, lost_robot, number, numbers, parse, plain_value, vector

_ROOT = "ground"
_TIP = "hand_tip"
_ONCE = ("origin", "axis", "inertial", "mass", "inertia", "dynamics", "parent", "child")
_NEUTRAL = {
    "springStiffness": ("0", "0.0"), "gravity": ("true", "1"), "turnGravityOff": ("false", "0")}  # fmt: skip
"""What Gazebo adds to joints and links that changes the arm -> values with which it changes nothing."""
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


def read(text: str) -> Imported:
    """Return the planar chain of a URDF file."""
    robot = parse(text, "robot")
    _refuse_foreign(robot)
    links = {link.get("name", ""): link for link in robot.findall("link")}
    by_parent: dict[str, list[ET.Element]] = {}
    children = set()
    for joint in robot.findall("joint"):
        if joint.find("mimic") is not None:
            raise BadInput(f"<joint {joint.get('name')!r}>", Text("mimic"), "joints that move by themselves")
        by_parent.setdefault(_end(joint, "parent"), []).append(joint)
        child = _end(joint, "child")
        if child in children or child not in links:
            raise BadInput(f"<joint {joint.get('name')!r}>", child, "a link of the file that was not met before")
        children.add(child)
    roots = [name for name in dict.fromkeys([*links, *by_parent]) if name not in children]  # `world` may have no link of its own
    if len(roots) != 1:
        raise BadInput("links", Text(f"{len(roots)} roots"), "one")
    stopped = [joint.get("name", "") for joint in robot.findall("joint") if joint.get("type") == "revolute"]
    return _walk(roots[0], links, by_parent).without_stops(stopped)


def _refuse_foreign(robot: ET.Element) -> None:
    """Refuse elements that would change the arm and are not read, or that are stated twice: better no arm than another one."""
    for parent in (element for element in robot.iter() if element.tag in ("link", "joint", "inertial")):
        for tag in _ONCE:
            if (count := len(parent.findall(tag))) > 1:
                raise BadInput(f"<{parent.tag} {parent.get('name', '')!r}> <{tag}>", Text(f"{count} of them"), "one")
        origin = parent.find("origin")
        if origin is not None and (foreign := sorted(set(origin.keys()) - {"xyz", "rpy"})):
            raise BadInput(f"<{parent.tag} {parent.get('name', '')!r}> <origin>", Text(", ".join(foreign)), "xyz and rpy")
    for gazebo in robot.findall("gazebo"):
        for element in gazebo.iter():
            neutral = _NEUTRAL.get(element.tag)
            if neutral and plain_value((element.text or "").strip().lower()) not in map(plain_value, neutral):
                place = f"<gazebo {gazebo.get('reference', '')!r}> <{element.tag}>"
                raise BadInput(place, element.text, neutral[0])


def _end(joint: ET.Element, which: str) -> str:
    element = joint.find(which)
    if element is None or not element.get("link"):
        raise BadInput(f"<joint {joint.get('name')!r}>", Text(f"no <{which}>"), f"a {which} link")
    return element.get("link", "")


def _walk(root: str, links: dict[str, ET.Element], by_parent: dict[str, list[ET.Element]]) -> Imported:
    hinges: list[Hinge] = []
    tip: np.ndarray | None = None
    met = 0
    # Links that move together, with their places from the last hinge and their directions.
    at = [(root, np.zeros(3), np.eye(3))]
    while at:
        onward: list[tuple[ET.Element, np.ndarray, np.ndarray]] = []
        fixed = list(at)
        while fixed:
            name, place, turned = fixed.pop(0)
            if hinges and name in links:
                hinges[-1].bodies += _bodies(links[name], place, turned)
            for joint in by_parent.get(name, []):
                met += 1
                there, rotation = place + turned @ _vector(joint, "xyz"), turned @ _rotation(_vector(joint, "rpy"))
                if joint.get("type") == "fixed":
                    fixed.append((_end(joint, "child"), there, rotation))
                    tip = there
                elif joint.get("type") in _HELD:
                    onward.append((joint, there, rotation))
                else:
                    raise BadInput(f"<joint {joint.get('name')!r}>", joint.get("type"), "continuous, revolute or fixed")
        if len(onward) > 1:
            raise BadInput(
                "joints", Text(", ".join(repr(joint.get("name")) for joint, _, _ in onward)), "one after the other: an unbranched chain"
            )
        at = []
        for joint, there, rotation in onward:
            child = _end(joint, "child")
            hinges.append(Hinge(child, _joint(joint), rotation @ _axis(joint), there))
            at, tip = [(child, np.zeros(3), rotation)], None
    if met < sum(map(len, by_parent.values())):
        raise BadInput("joints", Text("a ring of links"), "a chain that begins at one link")
    return planar(hinges, tip)


def _vector(joint: ET.Element, key: str) -> np.ndarray:
    origin = joint.find("origin")
    return np.array(vector(origin, key, 3, (0.0, 0.0, 0.0)) if origin is not None else (0.0, 0.0, 0.0))


def _rotation(rpy: np.ndarray) -> np.ndarray:
    """Return the rotation by roll, pitch and yaw about fixed axes."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    roll = np.array([[1.0, 0.0, 0.0], [0.0, cr, -sr], [0.0, sr, cr]])
    pitch = np.array([[cp, 0.0, sp], [0.0, 1.0, 0.0], [-sp, 0.0, cp]])
    yaw = np.array([[cy, -sy, 0.0], [sy, cy, 0.0], [0.0, 0.0, 1.0]])
    return yaw @ pitch @ roll


def _axis(joint: ET.Element) -> np.ndarray:
    axis = joint.find("axis")
    found = np.array(vector(axis, "xyz", 3) if axis is not None else (1.0, 0.0, 0.0))
    length = np.linalg.norm(found)
    if length == 0.0:
        raise BadInput(f"<joint {joint.get('name')!r}> axis", Text(numbers(*found)), "a direction")
    return found / length


def _bodies(link: ET.Element, place: np.ndarray, turned: np.ndarray) -> list[Body]:
    inertial = link.find("inertial")
    if inertial is None:
        return []
    mass, inertia = inertial.find("mass"), inertial.find("inertia")
    if mass is None or inertia is None:
        raise BadInput(f"<link {link.get('name')!r}>", Text("no mass or inertia"), "an <inertial> with both")
    xx, yy, zz, xy, xz, yz = (
        vector(inertia, key, 1, None if key in ("ixx", "iyy", "izz") else (0.0,))[0] for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    )
    about = turned @ _rotation(_vector(inertial, "rpy"))
    tensor = about @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ about.T
    return [Body(vector(mass, "value", 1)[0], place + turned @ _vector(inertial, "xyz"), tensor)]


def _joint(joint: ET.Element) -> Joint:
    dynamics = joint.find("dynamics")
    if dynamics is None:
        return Joint(joint.get("name", ""))
    damping, friction = (vector(dynamics, key, 1, (0.0,))[0] for key in ("damping", "friction"))
    return Joint(joint.get("name", ""), viscosity=damping, coulomb=friction)
