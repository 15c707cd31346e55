"""`EXPERIMENT.toml`: what the virtual laboratory simulates, and how it measures."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .. import checks
from ..anthropometry import JOINTS, UNCERTAINTY, literature_arm, segments_of
from ..catalogue import catalogue
from ..errors import BadInput, Text
from ..io import tomlfile
from ..model import AddedMass, Contact, Joint, Model, Robot, Subject, Tolerance, load_model
from .force_sensor import SixAxis
from .interaction import PERIOD, Interaction, Perturbation, Support
from .movement import Movement, movement_of

THESIS_ROBOT = Robot(lengths=(0.45, 0.45), base=(1.05, -0.10))
THESIS_CONTACT = Contact(stiffness=(10_000.0, 10_000.0), damping=(25.0, 25.0))
FAULTS = ("runaway", "frozen", "nan", "late", "force")
YIELDING_MARGIN_DEG = 30.0
"""How far a robot with a compliant handle may be outside of the required angles, unless set in `[safety]`."""


@dataclass(frozen=True)
class Controller:
    """The robot's joint controller at 4 kHz.

    Attributes
    ----------
    bandwidth_rad_s : float
        Natural frequency of the closed loop.
    damping : float
        Its damping ratio.
    torque_limit_Nm : float
        Largest torque of a motor at the joint.
    """

    bandwidth_rad_s: float = 100.0
    damping: float = 0.8
    torque_limit_Nm: float = 400.0


@dataclass(frozen=True)
class Safety:
    """What the supervisor allows before it stops the robot.

    Attributes
    ----------
    angle_margin_deg : float
        How far an angle of the robot may be outside of the required ones; 30 where its handle yields, unless given.
    speed_rad_s, acceleration_rad_s2 : float
        Of a joint of the robot.
    force_N : float
        In y and z each.
    """

    angle_margin_deg: float = 3.0
    speed_rad_s: float = 4.0
    acceleration_rad_s2: float = 60.0
    force_N: float = 100.0


@dataclass(frozen=True)
class Devices:
    """The sensors; deviations are those of white noise.

    Attributes
    ----------
    rate_Hz : float
        Samples a second of every device.
    force_noise_N, force_range_N, force_bits
        The force sensor: noise, largest magnitude, bits over the whole range.
    moment_noise_Nm : float, optional
        Of its moment, which the bearing of the handle leaves at zero; without it no moment is recorded.
    marker_noise_m : float
        Of each coordinate of each marker.
    marker_offset_m : float
        Standard deviation of where a marker sits against its joint, along and across its segment, one draw for a session.
    marker_skin_m_rad : float
        Standard deviation of how far skin carries a marker along and across its segment, for each radian of the next joint, likewise.
    marker_gaps : float
        Share of the samples at which a marker is hidden, in gaps of a tenth of a second.
    brake_noise_Nm : float, optional
        Of the load cells at the brakes; without it there are none.
    emg : bool
        Whether muscle activity is recorded.
    clock_offset_s, clock_drift, clock_jitter_s : float
        Of the clock of the cameras against that of the force sensor: offset, relative rate, noise of a single stamp.
    six_axis : SixAxis, optional
        The force sensor behind the robot's last link, in place of the one that reads the contact force alone.
    """

    rate_Hz: float = 50.0
    force_noise_N: float = 0.2
    force_range_N: float = 110.0
    force_bits: int = 12
    moment_noise_Nm: float | None = None
    marker_noise_m: float = 0.0002
    marker_offset_m: float = 0.0
    marker_skin_m_rad: float = 0.0
    marker_gaps: float = 0.0
    brake_noise_Nm: float | None = None
    emg: bool = False
    clock_offset_s: float = 0.0
    clock_drift: float = 0.0
    clock_jitter_s: float = 0.0
    six_axis: SixAxis | None = None


@dataclass(frozen=True)
class Fault:
    """Something that goes wrong on purpose in one trial.

    Attributes
    ----------
    kind : {"runaway", "frozen", "nan", "late", "force"}
    at_s : float
    joint : int
        Of the robot, from 1, for the first three.
    delay_s : float
        Of data that come late.
    force_N : (float, float)
        With which something presses against the handle, y and z.
    configuration : str, optional
        Where it happens; in the first one when absent.
    repeat : int
    """

    kind: str
    at_s: float
    joint: int = 1
    delay_s: float = 0.001
    force_N: tuple[float, float] = (150.0, 0.0)
    configuration: str | None = None
    repeat: int = 1


@dataclass(frozen=True, eq=False)
class Run:
    """One movement, repeated.

    Attributes
    ----------
    configuration : str
    movement : Movement
    repeats, tests : int
        Trials to fit and trials to check on.
    worn : tuple of AddedMass
        What is fixed to the arm meanwhile.
    """

    configuration: str
    movement: Movement
    repeats: int
    tests: int
    worn: tuple[AddedMass, ...]


@dataclass(frozen=True, eq=False)
class Experiment:
    """Everything that `record` needs.

    Attributes
    ----------
    name : str
    seed : int
    truth : Model
        The arm that is simulated, with handle.
    believed : Model
        The arm as it is handed over; its lengths come from the markers.
    subject : Subject
    runs : tuple of Run
    controller : Controller
    safety : Safety
    devices : Devices
    variation_Nm : ndarray, shape (n_joints,)
        Standard deviation of a constant moment in each joint, one draw for a trial.
    faults : tuple of Fault
    tolerance : Tolerance
    file : str, optional
        Where it was read, for refusals.
    interaction : Interaction, optional
        How the handle yields; without it the robot follows the movement stiffly.
    support : Support, optional
        What carries the arm. Each trial is then run without it as well.
    perturbation : Perturbation, optional
        What pushes the handle.
    """

    name: str
    seed: int
    truth: Model
    believed: Model
    subject: Subject
    runs: tuple[Run, ...]
    controller: Controller
    safety: Safety
    devices: Devices
    variation_Nm: np.ndarray
    faults: tuple[Fault, ...]
    tolerance: Tolerance
    file: str | None = None
    interaction: Interaction | None = None
    support: Support | None = None
    perturbation: Perturbation | None = None


def load_experiment(path: str | os.PathLike[str]) -> Experiment:
    """Read `EXPERIMENT.toml`; see docs/files.md for its keys.

    Raises
    ------
    BadInput
        Names the file, the key, the value found and the value allowed.
    """
    return tomlfile.load(path, experiment_of)


def experiment_of(document: Mapping[str, Any], path: Path, alter: Callable[[Model], Model] = lambda truth: truth) -> Experiment:
    """Return the experiment that a document describes.

    Parameters
    ----------
    document : mapping
        As read from `EXPERIMENT.toml`; `model` and `believed` may also be models themselves.
    path : Path
        The file, from which the paths of models are seen, and which names an experiment without a name.
    alter : callable
        Takes the arm that is simulated, without the handle, and returns it changed. The arm handed over does not follow.
    """
    tables = [
        "subject",
        "joint",
        "effect",
        "robot",
        "contact",
        "handle",
        "controller",
        "safety",
        "sensors",
        "variation",
        "tolerance",
        "fault",
        "interaction",
        "support",
        "perturbation",
    ]
    checks.keys("", document, required=["movement"], optional=["name", "seed", "model", "believed", *tables])
    seed = checks.whole("seed", document.get("seed", 1), least=0, most=2**53)
    subject, truth, believed = _arms(document, path, seed, alter)
    n = truth.n_joints
    runs = tuple(_run(f"[[movement]] {k}", t, n) for k, t in enumerate(checks.tables("movement", document["movement"]), 1))
    names = [run.configuration for run in runs]
    for k, name in enumerate(names):
        # Trials are files of this name below the requested folder, and nowhere else.
        if not name or name.startswith(".") or any(c in name for c in "/\\\0"):
            raise BadInput(f"[[movement]] {k + 1}, configuration", name, "a name that files can have")
        if name in names[:k]:
            raise BadInput(f"[[movement]] {k + 1}, configuration", name, "each configuration once")
    if not any(run.repeats for run in runs):
        raise BadInput("[[movement]]", Text("no repeats"), "at least one trial to fit")
    faults = tuple(_fault(f"[[fault]] {k}", t, names) for k, t in enumerate(checks.tables("fault", document.get("fault", [])), 1))
    variation = checks.table("[variation]", document.get("variation", {}))
    checks.keys("[variation]", variation, optional=["moment_Nm"])
    moments = variation.get("moment_Nm", [0.0] * n)
    if not isinstance(moments, list) or len(moments) != n:
        raise BadInput("[variation], moment_Nm", moments, f"{n} numbers, one a joint")
    interaction, support, perturbation = _yielding(document, path, n)
    margin = {} if interaction is None else {"angle_margin_deg": YIELDING_MARGIN_DEG}
    return Experiment(
        name=checks.text("name", document.get("name", path.stem)),
        seed=seed,
        truth=truth,
        believed=believed,
        subject=subject,
        runs=runs,
        controller=_settings(Controller, "[controller]", document.get("controller", {})),
        safety=_settings(Safety, "[safety]", margin | checks.table("[safety]", document.get("safety", {}))),
        devices=_devices(document.get("sensors", {}), truth),
        variation_Nm=np.array([checks.number("[variation], moment_Nm", v, least=0.0, unit="N m") for v in moments]),
        faults=faults,
        tolerance=Tolerance.from_dict(document.get("tolerance", {}), "[tolerance]"),
        file=str(path),
        interaction=interaction,
        support=support,
        perturbation=perturbation,
    )


def _yielding(document: Mapping[str, Any], path: Path, n_joints: int) -> tuple[Interaction | None, Support | None, Perturbation | None]:
    """Return how the handle yields, what carries the arm and what pushes it."""
    if "interaction" not in document:
        for key in ("support", "perturbation"):
            if key in document:
                raise BadInput(f"[{key}]", Text("a value without [interaction]"), "a handle that yields: [interaction] as well")
        return None, None, None
    interaction: Interaction = _part_of(Interaction, "[interaction]", document["interaction"])
    for key, found in (("fault", document.get("fault")), ("[sensors], emg", document.get("sensors", {}).get("emg"))):
        if found:
            raise BadInput(key, Text("a value beside [interaction]"), "none: only a robot that leads stiffly has it")
    perturbation: Perturbation | None = None
    if "perturbation" in document:
        perturbation = _part_of(Perturbation, "[perturbation]", document["perturbation"])
        if interaction.hold_s < 3.0 * PERIOD:
            allowed = f"at least {3 * PERIOD:g} s with a perturbation: two of its periods after one in which it settles"
            raise BadInput("[interaction], hold_s", interaction.hold_s, allowed)
    if "support" not in document:
        return interaction, None, perturbation
    table = checks.table("[support]", document["support"])
    if "model" not in table:
        raise BadInput("[support], model", Text("nothing"), "the file of a model that was identified")
    support: Support = _part_of(Support, "[support]", table | {"model": model_at("[support], model", table["model"], path)})
    if support.model.n_joints != n_joints:
        raise BadInput("[support], model", Text(f"{support.model.n_joints} joints"), f"{n_joints}, as the arm")
    return interaction, support, perturbation


def _arms(document: Mapping[str, Any], path: Path, seed: int, alter: Callable[[Model], Model]) -> tuple[Subject, Model, Model]:
    """Return the subject, the arm that is simulated and the arm that is handed over."""
    table = checks.table("[subject]", document.get("subject", {}))
    own: dict[str, Any] = {key: table.pop(key) for key in ("segments", "lengths_m", "spread") if key in table}
    subject = Subject.from_dict(table, "[subject]")
    if "model" in document:
        for key in [*own, *(k for k in ("joint", "robot", "contact") if k in document)]:
            raise BadInput(key, Text("a value beside model"), "either model, or a subject with joints, robot and contact")
        truth = model_at("model", document["model"], path)
        truth = truth.replace(robot=truth.robot or THESIS_ROBOT, contact=truth.contact or THESIS_CONTACT)
        if "believed" in document:
            believed = model_at("believed", document["believed"], path)
            if believed.n_joints != truth.n_joints:
                raise BadInput("believed", Text(f"{believed.n_joints} joints"), f"{truth.n_joints}, as in model")
        else:
            believed = truth.replace(joints=tuple(Joint(j.name) for j in truth.joints), effects=())
    else:
        if "believed" in document:
            raise BadInput("believed", Text("a value without model"), "model as well; of a subject the literature is believed")
        truth, believed = _person(document, subject, own, seed)
    given = checks.tables("effect", document.get("effect", []))
    added = Model.from_dict({**truth.to_dict(), "effect": given}).effects
    truth = truth.replace(effects=(*truth.effects, *added))
    believed = believed.replace(robot=truth.robot, contact=truth.contact)
    truth = alter(truth)
    handle = checks.table("[handle]", document.get("handle", {}))
    checks.keys("[handle]", handle, optional=["mass"])
    mass = checks.number("[handle], mass", handle.get("mass", 0.0), least=0.0, most=10.0, unit="kg")
    if mass > 0.0:
        truth, believed = (model.with_mass(model.n_joints, mass) for model in (truth, believed))
    return subject, truth, believed


def model_at(place: str, value: object, path: Path) -> Model:
    """Return the model that a key of the experiment file `path` names."""
    return value if isinstance(value, Model) else load_model(path.parent / checks.text(place, value))


def _person(document: Mapping[str, Any], subject: Subject, own: dict[str, Any], seed: int) -> tuple[Model, Model]:
    count = checks.whole("[subject], segments", own.get("segments", 2), least=2, most=3)
    spread = checks.number("[subject], spread", own.get("spread", 0.0), least=0.0, most=3.0)
    lengths = own.get("lengths_m", [None] * count)
    if not isinstance(lengths, list) or len(lengths) != count:
        raise BadInput("[subject], lengths_m", lengths, f"{count} lengths")
    lengths = [None if v is None else checks.number("[subject], lengths_m", v, least=0.01, most=1.0, unit="m") for v in lengths]
    believed, parts = literature_arm(subject, lengths)
    draw = np.random.default_rng([seed, 0]).standard_normal((3, 3)) * spread
    true_parts = [
        {
            **part,
            **{
                key: (min(max(part[key][0] + d * part[key][1], 0.3 * part[key][0]), most), 0.0)
                for key, d, most in zip(("mass", "com", "inertia"), row, (np.inf, part["length"], np.inf), strict=True)
            },
        }
        for part, row in zip(parts, draw, strict=True)
    ]
    tables = checks.tables("joint", document.get("joint", []))
    if tables and len(tables) != count:
        raise BadInput("[[joint]]", Text(f"{len(tables)} joints"), f"none, or one a segment: {count}")
    joints = tuple(Joint.from_dict({"name": JOINTS[k - 1], **t}, f"[[joint]] {k}") for k, t in enumerate(tables, 1))
    robot = Robot.from_dict(document["robot"], "[robot]") if "robot" in document else THESIS_ROBOT
    contact = Contact.from_dict(document["contact"], "[contact]") if "contact" in document else THESIS_CONTACT
    plain = tuple(Joint(name) for name in JOINTS[:count])
    return (
        Model(tuple(segments_of(true_parts, lengths)), joints or plain, segment_uncertainty=0.0, robot=robot, contact=contact),
        Model(believed, plain, segment_uncertainty=UNCERTAINTY, robot=robot, contact=contact),
    )


def _part_of(kind: Any, place: str, value: object) -> Any:
    """Return the dataclass `kind` that a table describes; `place` names the table in refusals."""
    table = checks.table(place, value)
    own = dataclasses.fields(kind)
    optional = [f.name for f in own if f.default is not dataclasses.MISSING]
    checks.keys(place, table, required=[f.name for f in own if f.name not in optional], optional=optional)
    try:
        return kind(**table)
    except BadInput as error:
        raise error.within(place=place) from None


def _run(place: str, table: Mapping[str, Any], n_joints: int) -> Run:
    fields = dict(table)
    own = {key: fields.pop(key) for key in ("configuration", "repeats", "tests", "worn") if key in fields}
    try:
        worn = tuple(AddedMass.from_dict(t, f"worn {k}") for k, t in enumerate(checks.tables("worn", own.get("worn", [])), 1))
        for item in worn:
            checks.whole("worn, segment", item.segment, least=1, most=n_joints)
        return Run(
            configuration=checks.text("configuration", own.get("configuration", "movement")),
            movement=movement_of(fields, n_joints),
            repeats=checks.whole("repeats", own.get("repeats", 1), least=0, most=1000),
            tests=checks.whole("tests", own.get("tests", 0), least=0, most=1000),
            worn=worn,
        )
    except BadInput as error:
        raise error.within(place=place) from None


def _fault(place: str, table: Mapping[str, Any], configurations: list[str]) -> Fault:
    fault: Fault = _part_of(Fault, place, table)
    try:
        checks.choice("kind", fault.kind, FAULTS)
        checks.number("at_s", fault.at_s, least=0.0, unit="s")
        checks.whole("joint", fault.joint, least=1, most=2)
        checks.number("delay_s", fault.delay_s, above=0.0, unit="s")
        if fault.configuration is not None:
            checks.choice("configuration", fault.configuration, tuple(configurations))
        return dataclasses.replace(
            fault, force_N=checks.pair("force_N", fault.force_N, unit="N"), configuration=fault.configuration or configurations[0]
        )
    except BadInput as error:
        raise error.within(place=place) from None


def _settings(kind: Any, place: str, table: object) -> Any:
    made = _part_of(kind, place, table)
    for field in dataclasses.fields(kind):
        checks.number(f"{place}, {field.name}", getattr(made, field.name), above=0.0)
    return made


_MOST = {
    "force_noise_N": (100.0, "N"), "moment_noise_Nm": (100.0, "N m"), "brake_noise_Nm": (100.0, "N m"),
    "marker_noise_m": (0.1, "m"), "marker_offset_m": (0.1, "m"), "marker_skin_m_rad": (0.1, "m/rad"), "clock_jitter_s": (1.0, "s"),
}  # fmt: skip
"""Of the deviations: far beyond any device, and small enough that what is recorded are forces and places."""


def _devices(value: object, truth: Model) -> Devices:
    place = "[sensors]"
    table = checks.table(place, value)
    if "six_axis" in table:
        for key in ("force_noise_N", "force_range_N", "force_bits", "moment_noise_Nm"):
            if key in table:
                allowed = "none: [sensors.six_axis] has noise, range and bits of its own"
                raise BadInput(f"{place}, {key}", Text("a value beside six_axis"), allowed)
        for effect in truth.effects:
            if catalogue()[effect.kind].where == "frame":
                raise BadInput("[sensors.six_axis]", Text(f"the effect {effect.kind}"), "none of the frame: the tool's weight is along −z")
        table["six_axis"] = _part_of(SixAxis, "[sensors.six_axis]", table["six_axis"])
    made: Devices = _part_of(Devices, place, table)
    checks.bits(f"{place}, force_bits", made.force_bits)
    checks.flag(f"{place}, emg", made.emg)
    checks.number(f"{place}, rate_Hz", made.rate_Hz, least=10.0, most=1000.0, unit="Hz")
    checks.number(f"{place}, force_range_N", made.force_range_N, above=0.0, most=1e5, unit="N")
    checks.number(f"{place}, marker_gaps", made.marker_gaps, least=0.0, most=0.5)
    for name, (most, unit) in _MOST.items():
        if getattr(made, name) is not None:
            checks.number(f"{place}, {name}", getattr(made, name), least=0.0, most=most, unit=unit)
    checks.number(f"{place}, clock_offset_s", made.clock_offset_s, least=-1.0, most=1.0, unit="s")
    checks.number(f"{place}, clock_drift", made.clock_drift, least=-0.01, most=0.01)
    return made


__all__ = ["Controller", "Devices", "Experiment", "Fault", "Run", "Safety", "experiment_of", "load_experiment"]
