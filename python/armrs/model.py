"""The model of an arm: segments, joints, robot, contact and effects, and its file `model.toml`.

Values are checked where they are made, so a `Model` that exists is valid, wherever it came from.
"""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

from . import checks
from .catalogue import Kind, catalogue
from .errors import BadInput, Text, unknown_name
from .io import files, tomlfile

CHANNELS = ("Fy", "Fz", "Mx")
MOST_SEGMENTS = 6
MOST_DENSE = 1000.0
"""Mass of a segment for each metre of its length [kg/m]; an upper arm has 7, and steel as thick as a man 1000."""
SOFT_CONTACT = 0.2
"""The weight of an arm that is held at its tip may press the contact in by this part of the arm's length."""
LARGE_INERTIA = 3.0
"""In mass · length². A point mass at the far end has 1, a rod a twelfth; more than this is probably another unit."""


@dataclass(frozen=True)
class Segment:
    """One rigid segment.

    Attributes
    ----------
    name : str
    length : float
        Joint to joint, or joint to handle for the last [m].
    mass : float
        [kg]
    com : float
        Centre of mass along the segment from the proximal joint [m].
    inertia : float
        Moment of inertia about the centre of mass [kg m²].
    com_normal : float
        Centre of mass normal to the segment, counter-clockwise [m].
    """

    name: str
    length: float
    mass: float
    com: float
    inertia: float
    com_normal: float = 0.0

    def __post_init__(self) -> None:
        length = checks.number("length", self.length, above=0.0, most=100.0, unit="m", hint="millimetres?")
        _set(
            self,
            name=checks.text("name", self.name),
            length=length,
            mass=_mass(self.mass, length),
            com=checks.number("com", self.com, least=0.0, most=length, unit="m", hint="at most the length of the segment"),
            inertia=checks.number("inertia", self.inertia, least=0.0, unit="kg m²"),
            com_normal=checks.number("com_normal", self.com_normal, least=-length, most=length, unit="m"),
        )


@dataclass(frozen=True)
class Joint:
    """The passive properties of one joint that belong to the model itself.

    Attributes
    ----------
    name : str
    stiffness : float
        [N m/rad] about `rest`.
    rest : float
        Angle at which the elastic moment is zero [rad].
    viscosity : float
        [N m s/rad]
    coulomb : float
        Dry friction [N m].
    """

    name: str
    stiffness: float = 0.0
    rest: float = 0.0
    viscosity: float = 0.0
    coulomb: float = 0.0

    def __post_init__(self) -> None:
        _set(
            self,
            name=checks.text("name", self.name),
            stiffness=checks.number("stiffness", self.stiffness, least=0.0, unit="N m/rad"),
            rest=checks.number("rest", self.rest, least=-100.0, most=100.0, unit="rad", hint="degrees?"),
            viscosity=checks.number("viscosity", self.viscosity, least=0.0, unit="N m s/rad"),
            coulomb=checks.number("coulomb", self.coulomb, least=0.0, unit="N m"),
        )


@dataclass(frozen=True)
class Robot:
    """The robot that leads the arm: two links.

    Attributes
    ----------
    lengths : (float, float)
        [m]
    base : (float, float)
        First axis, y and z [m].
    elbow : {"up", "down"}
        Which of the two postures it takes.
    """

    lengths: tuple[float, float]
    base: tuple[float, float]
    elbow: str = "up"

    def __post_init__(self) -> None:
        _set(
            self,
            lengths=checks.pair("lengths", self.lengths, above=0.0, most=100.0, unit="m", hint="millimetres?"),
            base=checks.pair("base", self.base, unit="m"),
            elbow=checks.choice("elbow", self.elbow, ("up", "down")),
        )


@dataclass(frozen=True)
class Contact:
    """The spring and damper between hand and robot.

    Attributes
    ----------
    stiffness : (float, float)
        Along y and z [N/m].
    damping : (float, float)
        Along y and z [N s/m].
    """

    stiffness: tuple[float, float]
    damping: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        _set(
            self,
            stiffness=checks.pair("stiffness", self.stiffness, above=0.0, unit="N/m"),
            damping=checks.pair("damping", self.damping, least=0.0, unit="N s/m"),
        )


@dataclass(frozen=True)
class Effect:
    """One effect of the catalogue, with values.

    Attributes
    ----------
    kind : str
        Name in the catalogue.
    joint : int, optional
        Joint or segment it acts on, 1-based.
    channel : {"Fy", "Fz", "Mx"}, optional
        Channel of the force sensor it acts on.
    parameters : mapping of str to float
        Values in SI units. What the catalogue knows and is not given takes its default.
    """

    kind: str
    joint: int | None = None
    channel: str | None = None
    parameters: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        kind = checks.text("kind", self.kind)
        known = catalogue()
        if known and kind not in known:
            raise unknown_name("kind", kind, known, what="kind of effect")
        if self.joint is not None:
            _set(self, joint=checks.whole("joint", self.joint, least=1))
        if self.channel is not None:
            checks.choice("channel", self.channel, CHANNELS)
        given = checks.table("parameters", self.parameters)
        if kind in known:
            values = _parameters_of(known[kind], given)
            _check_address(known[kind], self.joint, self.channel)
        else:
            values = {name: checks.number(name, item) for name, item in given.items()}
        _set(self, parameters=MappingProxyType(values))

    def __hash__(self) -> int:
        return hash((self.kind, self.joint, self.channel, tuple(sorted(self.parameters.items()))))

    def __reduce__(self) -> tuple[Any, ...]:  # the read-only view of the parameters has no pickle of its own
        return (Effect, (self.kind, self.joint, self.channel, dict(self.parameters)))


@dataclass(frozen=True)
class Model:
    """An arm, what acts on it, and the rig that leads it.

    Attributes
    ----------
    segments : tuple of Segment
        Proximal first.
    joints : tuple of Joint
        One a segment: `joints[j]` is at the proximal end of `segments[j]`.
    gravity : float
        Along −z [m/s²].
    base : (float, float)
        First joint, y and z [m].
    segment_uncertainty : float
        Relative standard deviation of masses, centres of mass and inertias; 0 is exact.
    robot : Robot, optional
    contact : Contact, optional
    effects : tuple of Effect
    """

    segments: tuple[Segment, ...]
    joints: tuple[Joint, ...]
    gravity: float = 9.81
    base: tuple[float, float] = (0.0, 0.0)
    segment_uncertainty: float = 0.05
    robot: Robot | None = None
    contact: Contact | None = None
    effects: tuple[Effect, ...] = ()

    def __post_init__(self) -> None:
        segments = checks.instances("segments", self.segments, Segment)
        joints = checks.instances("joints", self.joints, Joint)
        effects = checks.instances("effects", self.effects, Effect)
        checks.instance("robot", self.robot, Robot, type(None))
        checks.instance("contact", self.contact, Contact, type(None))
        if not 1 <= len(segments) <= MOST_SEGMENTS:
            raise BadInput("[[arm.segment]]", Text(f"{len(segments)} segments"), f"1 to {MOST_SEGMENTS} segments")
        if len(joints) != len(segments):
            raise BadInput("[[arm.joint]]", Text(f"{len(joints)} joints"), f"one a segment, so {len(segments)}")
        for number, effect in enumerate(effects, start=1):
            if effect.joint is not None and effect.joint > len(joints):
                raise BadInput(f"[[effect]] {number} ({effect.kind}), joint", effect.joint, f"1 to {len(joints)}")
        _set(
            self,
            segments=segments,
            joints=joints,
            effects=effects,
            gravity=checks.number("[arm], gravity", self.gravity, least=0.0, most=1000.0, unit="m/s²"),
            base=checks.pair("[arm], base", self.base, unit="m"),
            segment_uncertainty=checks.number(
                "[arm], segment_uncertainty", self.segment_uncertainty, least=0.0, most=1.0, hint="5 % is 0.05"
            ),
        )

        self._refuse_soft_contact()

    def _refuse_soft_contact(self) -> None:
        """Refuse a contact into which the arm would sink: its stiffness is then in another unit."""
        if self.contact is None:
            return
        length = sum(s.length for s in self.segments)
        # Stretched out forward, with its first joint free.
        before = [sum(s.length for s in self.segments[:k]) for k in range(len(self.segments))]
        held = self.gravity * sum(s.mass * (at + s.com) for s, at in zip(self.segments, before, strict=True)) / length
        least = held / (SOFT_CONTACT * length)
        # A slide gives way in one direction on purpose.
        stiffest = max(self.contact.stiffness)
        if stiffest < least:
            raise BadInput(
                "[contact], stiffness",
                stiffest,
                f">= {least:.3g} N/m: {held:.3g} N of the arm's weight would press it in by {held / stiffest:.3g} m",
                hint="kN/m or N/mm? 10 kN/m is 10000",
            )

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is hardly an arm, a line each."""
        return tuple(
            f"model: inertia {s.inertia:g} kg m² of segment {s.name!r} is {s.inertia / (s.mass * s.length**2):.3g} times mass · length², "
            f"a mass at the far end has 1: is it in kg cm², or about another point?"
            for s in self.segments
            if s.inertia > LARGE_INERTIA * s.mass * s.length**2
        )

    @property
    def n_joints(self) -> int:
        """Number of joints, and of segments."""
        return len(self.joints)

    def replace(self, **changes: Any) -> Model:
        """Return a model with some attributes changed; it is checked like any other."""
        names = [f.name for f in dataclasses.fields(self)]
        for name in changes:
            if name not in names:
                raise unknown_name("Model", name, names, what="attribute")
        return dataclasses.replace(self, **changes)

    def with_mass(self, number: int, mass: float, at: float | None = None) -> Model:
        """Return a model with a point mass on a segment.

        Parameters
        ----------
        number : int
            The segment, from 1.
        mass : float
            [kg]
        at : float, optional
            From the segment's proximal joint [m]; at its end when absent. The centre of mass stays on the segment.
        """
        number = checks.whole("number", number, least=1, most=self.n_joints)
        mass = checks.number("mass", mass, above=0.0, unit="kg")
        old = self.segments[number - 1]
        place = old.length if at is None else checks.number("at", at, least=0.0, most=old.length, unit="m")
        total = old.mass + mass
        com = (old.mass * old.com + mass * place) / total
        normal = old.mass * old.com_normal / total
        shift = (old.com - com) ** 2 + (old.com_normal - normal) ** 2
        inertia = old.inertia + old.mass * shift + mass * ((place - com) ** 2 + normal**2)
        new = Segment(old.name, old.length, total, com, inertia, com_normal=normal)
        return self.replace(segments=(*self.segments[: number - 1], new, *self.segments[number:]))

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write `model.toml`; reading it back gives an equal model, to the last bit. The file is replaced at once or not at all."""
        files.write_text(checks.path("path", path), self.to_toml(), kind=".toml")

    def to_toml(self) -> str:
        """Return the text of `model.toml`."""
        blocks = [("[arm]", {"gravity": self.gravity, "base": self.base, "segment_uncertainty": self.segment_uncertainty})]
        blocks += [("[[arm.segment]]", _fields(segment)) for segment in self.segments]
        blocks += [("[[arm.joint]]", _fields(joint)) for joint in self.joints]
        if self.robot is not None:
            blocks.append(("[robot]", _fields(self.robot)))
        if self.contact is not None:
            blocks.append(("[contact]", _fields(self.contact)))
        for e in self.effects:
            blocks.append(("[[effect]]", {"kind": e.kind, "joint": e.joint, "channel": e.channel, **e.parameters}))
        return "\n".join("\n".join([head, *tomlfile.lines(body), ""]) for head, body in blocks)


def load_model(path: str | os.PathLike[str]) -> Model:
    """Read `model.toml`.

    Parameters
    ----------
    path : path
        The file.

    Returns
    -------
    Model

    Raises
    ------
    BadInput
        Names the file, the key, the value found and the value allowed. A key that is not known is refused with the nearest known one.
    """
    return tomlfile.load(path, _model)


def _model(document: dict[str, Any], path: Path) -> Model:
    checks.keys("", document, required=["arm"], optional=["robot", "contact", "effect"])
    arm = checks.table("[arm]", document["arm"])
    checks.keys("[arm]", arm, required=["segment"], optional=["joint", "gravity", "base", "segment_uncertainty"])
    segments = checks.tables("arm.segment", arm.pop("segment"))
    joints = checks.tables("arm.joint", arm.pop("joint", []))
    effects = checks.tables("effect", document.get("effect", []))
    return Model(
        segments=tuple(part_of(Segment, f"[[arm.segment]] {k}", t, f"segment {k}") for k, t in enumerate(segments, 1)),
        joints=tuple(part_of(Joint, f"[[arm.joint]] {k}", t, f"joint {k}") for k, t in enumerate(joints, 1)),
        robot=part_of(Robot, "[robot]", document["robot"]) if "robot" in document else None,
        contact=part_of(Contact, "[contact]", document["contact"]) if "contact" in document else None,
        effects=tuple(effect_of(f"[[effect]] {k}", t) for k, t in enumerate(effects, 1)),
        **arm,
    )


def part_of(kind: type, place: str, value: object, default_name: str | None = None) -> Any:
    """Return the dataclass `kind` that a table describes; `place` names the table in refusals."""
    table = checks.table(place, value)
    own = [f for f in dataclasses.fields(kind) if f.init]
    if default_name is not None:
        table.setdefault("name", default_name)
    optional = [f.name for f in own if f.default is not dataclasses.MISSING]
    checks.keys(place, table, required=[f.name for f in own if f.name not in optional], optional=optional)
    try:
        return kind(**table)
    except BadInput as error:
        raise error.within(place=place) from None


def effect_of(place: str, table: dict[str, Any]) -> Effect:
    """Return the effect that a table `[[effect]]` describes."""
    if "kind" not in table:
        raise BadInput(f"{place}, kind", Text("nothing"), "key kind is required")
    parameters = dict(table)
    kind = parameters.pop("kind")
    named = f"{place} ({kind})" if isinstance(kind, str) else place
    try:
        return Effect(kind, parameters.pop("joint", None), parameters.pop("channel", None), parameters)
    except BadInput as error:
        raise error.within(place=named) from None


def _mass(value: object, length: float) -> float:
    mass, most = checks.number("mass", value, above=0.0, unit="kg"), max(1.0, MOST_DENSE * length)
    if mass > most:
        raise BadInput("mass", mass, f"at most {most:g} kg for a segment of {length:g} m", hint="grams?")
    return mass


def _parameters_of(kind: Kind, given: Mapping[str, object]) -> dict[str, float]:
    known = {p.name: p for p in kind.parameters}
    for name in given:
        if name not in known:
            raise unknown_name("", name, [*known, *filter(None, [kind.address])])
    return {
        p.name: checks.number(
            p.name,
            given.get(p.name, p.default),
            unit=p.unit,
            least=p.min if p.min > -float("inf") else None,
            most=p.max if p.max < float("inf") else None,
        )
        for p in kind.parameters
    }


def _check_address(kind: Kind, joint: int | None, channel: str | None) -> None:
    given = {"joint": joint, "channel": channel}
    allowed = {"joint": "the number of the joint or segment, from 1", "channel": " or ".join(CHANNELS)}
    for name, value in given.items():
        if kind.address == name and value is None:
            raise BadInput(name, Text("nothing"), allowed[name])
        if kind.address != name and value is not None:
            raise BadInput(name, value, f"no key {name}: {kind.kind} acts on the {kind.where}")


def _fields(item: Any) -> dict[str, object]:
    """Return the attributes of one part, without a centre of mass offset of zero."""
    values = {f.name: getattr(item, f.name) for f in dataclasses.fields(item)}
    if values.get("com_normal") == 0.0:
        del values["com_normal"]
    return values


def _set(instance: Any, **values: object) -> None:
    """Store checked values in a frozen dataclass under construction."""
    for name, value in values.items():
        object.__setattr__(instance, name, value)
