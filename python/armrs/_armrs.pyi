# The compiled core. Docstrings stand in the binary; this file is checked against it by `make test`.
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import ClassVar, NotRequired, TypeAlias, TypedDict, final, type_check_only

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "DECISIONS",
    "SAMPLE_STATUSES",
    "AddedMass",
    "Arm",
    "ArmSlave",
    "ArmState",
    "Contact",
    "Description",
    "Digest",
    "Effect",
    "Joint",
    "Model",
    "OnlineCompensation",
    "OnlineEstimator",
    "OnlineMonitor",
    "ParameterId",
    "ParameterInfo",
    "Rig",
    "Robot",
    "Segment",
    "Subject",
    "Tolerance",
    "TrialEntry",
    "__version__",
    "build_profile",
    "control",
    "declare",
    "design",
    "distances",
    "effects",
    "find_gap",
    "firmware",
    "fit_by_simulation",
    "forecast",
    "held_out",
    "identify",
    "literature",
    "load_model",
    "look",
    "low_pass_both_ways",
    "online_settings",
    "play",
    "simulate",
    "simulate_in_pieces",
    "smooth",
]

__version__: str
build_profile: str
DECISIONS: tuple[str, str, str]
SAMPLE_STATUSES: list[str]

# ---- what the functions return: these names are there for type checkers alone
_Array: TypeAlias = NDArray[np.float64]
_Entry: TypeAlias = tuple[str, int, list[float]]  # kind, place from 0, parameters
_Asked: TypeAlias = tuple[_Entry, list[int]]  # an effect, and which of its parameters are free
_Lack: TypeAlias = tuple[float, float, float]  # ratio, z, excess
_Unknown: TypeAlias = tuple[str, int, int, float, float, float]  # what, place, part, value, standard deviation before and after

@type_check_only
class _Estimate(TypedDict):
    name: str
    joint: int | None
    kind: str
    value: float
    std: float
    unit: str
    interval: list[float]
    decided_by: str

@type_check_only
class _Explained(TypedDict):
    samples: NDArray[np.uint64]
    measured: _Array
    fitted: _Array

@type_check_only
class _Identified(TypedDict):
    status: str
    rank: int
    unknowns: int
    scale_free: bool
    cutoff: float
    clusters: int
    neglected_inertia: list[float]
    speed_noise: list[float]
    speed_noise_allowed: float
    not_simulated: str | None
    trades: list[str]
    parameters: list[_Estimate]
    combinations: list[_Estimate]
    calibration: list[_Estimate]
    explained: list[_Explained]
    segments: list[tuple[float, float, float, float, float]]
    effects: list[_Entry]

@type_check_only
class _Predicted(TypedDict):
    name: str
    unit: str
    effect: int | None
    value: float
    std: float
    std_of_data: float
    relative: float

@type_check_only
class _Forecast(TypedDict):
    predicted: list[_Predicted]
    worst: float
    force: float
    speed: float
    robot_speed: float
    robot_acceleration: float
    duration: float
    durations: list[float]

@type_check_only
class _Excess(TypedDict):
    limit: str
    what: str
    found: float
    allowed: float
    unit: str

@type_check_only
class _Task(TypedDict):
    waypoints: _Array
    speed: float
    acceleration: float
    pace: float
    slowed_for: _Excess | None

@type_check_only
class _Design(_Forecast):
    tasks: list[_Task]

@type_check_only
class _Fit(TypedDict):
    values: list[float]
    sd: list[float]
    active: list[int]
    squares: float
    residuals: int
    rounds: int
    settled: bool

@type_check_only
class _Free(TypedDict, total=False):
    given: _Array | None
    calibrated: _Array | None
    amended: _Array | None

@type_check_only
class _Played(_Free):
    measured: _Array
    counted: NDArray[np.bool_]
    free: _Free

@type_check_only
class _Fitted(TypedDict):
    cost: float
    segments: list[list[float]]
    contact: list[list[float]]
    shift: list[float]
    known: list[_Entry]
    calibration: list[_Entry]
    named: list[_Entry]

@type_check_only
class _Named(TypedDict):
    effect: _Entry
    sd: list[tuple[int, float]]
    p_value: float
    share: float
    alternatives: list[tuple[_Asked, float, float]]

@type_check_only
class _Screened(TypedDict):
    groups: list[int]
    calibrated: _Fitted
    lack: _Lack
    unknowns: list[_Unknown]
    suspects: list[tuple[_Entry, list[int], float, float, float]]
    trials: list[_Played]

@type_check_only
class _Found(TypedDict):
    repeated: bool
    groups: list[int]
    scale: float
    calibrated: _Fitted
    amended: _Fitted
    rhythms: list[_Entry]
    locked: list[_Entry]
    lack: tuple[_Lack, _Lack]
    unknowns: list[_Unknown]
    named: list[_Named]
    apart: list[tuple[_Entry, float, int | None, tuple[float, float], float, list[tuple[_Entry, float]]]]
    ruled: list[tuple[_Asked, float, float, float]]
    ladder: list[tuple[list[tuple[list[_Asked], float]], float, float]]
    trials: list[_Played]

@type_check_only
class _Controlled(TypedDict):
    time: _Array
    robot_q: _Array
    tracking_error: float
    periods_to_stop: int | None
    force_after_fault: float | None
    way_after_stop: float | None
    stop: tuple[str, int, float, float, float] | None

_Recorded = TypedDict(
    "_Recorded",
    {
        "time": _Array,
        "q": _Array,
        "qd": _Array,
        "qdd": _Array,
        "tip": _Array,
        "handle": _Array | None,
        "robot_q": _Array | None,
        "robot_qd": _Array | None,
        "robot_qdd": _Array | None,
        "force_on_arm": _Array,
        "moment_on_arm": _Array,
        "torque.inertial": _Array,
        "torque.centrifugal": _Array,
        "torque.coriolis": _Array,
        "torque.gravity": _Array,
        "torque.frame": _Array,
        "torque.resisting": _Array,
        "torque.drive": _Array,
        "torque.contact": _Array,
        "resisting": _Array | None,
        "memory": _Array | None,
        "energy.kinetic": _Array,
        "energy.potential": _Array,
        "energy.contact": _Array,
        "work.handle": _Array,
        "work.drive": _Array,
        "work.resisted": _Array,
        "work.damped": _Array,
        "effects": list[tuple[str, int]],
        "energy_error": _Array,
        "readings": NotRequired[list[_Readings]],
    },
)

@type_check_only
class _Readings(TypedDict):
    time: _Array
    q: _Array
    force_on_arm: _Array | None
    moment_on_arm: _Array | None
    robot_q: _Array | None
    tau: _Array | None

@type_check_only
class _Parameter(TypedDict):
    name: str
    unit: str
    min: float
    max: float
    default: float
    linear: bool
    or_zero: bool

@type_check_only
class _Kind(TypedDict):
    kind: str
    where: str
    summary: str
    formula: str
    reference: str
    parameters: list[_Parameter]
    first_joint: int
    family: str
    address: str
    own: bool

@type_check_only
class _Firmware(TypedDict):
    values: list[float]
    sd: list[float]
    torques: list[list[float]]
    angle_offset: list[float]
    force: list[list[float]]
    force_offset: list[float]
    force_delay: float
    acts_on: list[str]

@type_check_only
class _OnlineSettings(TypedDict):
    period: float
    cutoff: float
    window: float
    noise: list[float]
    dead_band: float
    range: list[list[float]]
    fastest: float
    steepest: float
    largest_force: float
    largest_torque: float
    gate: float
    frozen_after: float
    envelope: list[float]
    forgetting: float

@type_check_only
class _Replayed(TypedDict):
    status: NDArray[np.uint8]
    value: NDArray[np.float64]
    sd: NDArray[np.float64]
    decided: NDArray[np.uint8]
    torque: NDArray[np.float64]
    torque_sd: NDArray[np.float64]
    residual: NDArray[np.float64]
    excess: NDArray[np.float64]
    age: NDArray[np.float64]
    restarts: NDArray[np.uint32]

@type_check_only
class _Literature(TypedDict):
    name: str
    length: float
    mass: tuple[float, float]
    com: tuple[float, float]
    inertia: tuple[float, float]

@type_check_only
class _Variable(TypedDict):
    name: str
    reference: int
    causality: str
    variability: str
    initial: str | None
    unit: str | None
    exponents: list[int] | None
    start: float | None
    min: float | None
    max: float | None
    nominal: float | None
    description: str

@final
class Segment:
    __match_args__: ClassVar[tuple[str, ...]]
    def __new__(
        cls,
        name: str,
        length: float,
        mass: float,
        com: float,
        inertia: float,
        com_normal: float = 0.0,
    ) -> Segment: ...
    @property
    def name(self) -> str: ...
    @property
    def length(self) -> float: ...
    @property
    def mass(self) -> float: ...
    @property
    def com(self) -> float: ...
    @property
    def inertia(self) -> float: ...
    @property
    def com_normal(self) -> float: ...
    def replace(self, **changes: object) -> Segment: ...
    def __replace__(self, **changes: object) -> Segment: ...
    def to_dict(self) -> dict[str, object]: ...
    @staticmethod
    def from_dict(table: Mapping[str, object], place: str = "") -> Segment: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class Joint:
    __match_args__: ClassVar[tuple[str, ...]]
    def __new__(
        cls,
        name: str,
        stiffness: float = 0.0,
        rest: float = 0.0,
        viscosity: float = 0.0,
        coulomb: float = 0.0,
    ) -> Joint: ...
    @property
    def name(self) -> str: ...
    @property
    def stiffness(self) -> float: ...
    @property
    def rest(self) -> float: ...
    @property
    def viscosity(self) -> float: ...
    @property
    def coulomb(self) -> float: ...
    def replace(self, **changes: object) -> Joint: ...
    def __replace__(self, **changes: object) -> Joint: ...
    def to_dict(self) -> dict[str, object]: ...
    @staticmethod
    def from_dict(table: Mapping[str, object], place: str = "") -> Joint: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class Robot:
    __match_args__: ClassVar[tuple[str, ...]]
    def __new__(
        cls,
        lengths: Sequence[float],
        base: Sequence[float],
        elbow: str = "up",
    ) -> Robot: ...
    @property
    def lengths(self) -> tuple[float, float]: ...
    @property
    def base(self) -> tuple[float, float]: ...
    @property
    def elbow(self) -> str: ...
    def replace(self, **changes: object) -> Robot: ...
    def __replace__(self, **changes: object) -> Robot: ...
    def to_dict(self) -> dict[str, object]: ...
    @staticmethod
    def from_dict(table: Mapping[str, object], place: str = "") -> Robot: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class Contact:
    __match_args__: ClassVar[tuple[str, ...]]
    def __new__(
        cls,
        stiffness: Sequence[float],
        damping: Sequence[float] = (0.0, 0.0),
    ) -> Contact: ...
    @property
    def stiffness(self) -> tuple[float, float]: ...
    @property
    def damping(self) -> tuple[float, float]: ...
    @staticmethod
    def assumed() -> Contact: ...
    def replace(self, **changes: object) -> Contact: ...
    def __replace__(self, **changes: object) -> Contact: ...
    def to_dict(self) -> dict[str, object]: ...
    @staticmethod
    def from_dict(table: Mapping[str, object], place: str = "") -> Contact: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class Effect:
    __match_args__: ClassVar[tuple[str, ...]]
    def __new__(
        cls,
        kind: str,
        joint: int | None = None,
        channel: str | None = None,
        parameters: Mapping[str, float] = {},
    ) -> Effect: ...
    @property
    def kind(self) -> str: ...
    @property
    def joint(self) -> int | None: ...
    @property
    def channel(self) -> str | None: ...
    @property
    def parameters(self) -> MappingProxyType[str, float]: ...
    def replace(self, **changes: object) -> Effect: ...
    def __replace__(self, **changes: object) -> Effect: ...
    def to_dict(self) -> dict[str, object]: ...
    @staticmethod
    def from_dict(table: Mapping[str, object], place: str = "") -> Effect: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class Model:
    __match_args__: ClassVar[tuple[str, ...]]
    def __new__(
        cls,
        segments: Iterable[Segment],
        joints: Iterable[Joint],
        gravity: float = 9.81,
        base: Sequence[float] = (0.0, 0.0),
        segment_uncertainty: float = 0.05,
        robot: Robot | None = None,
        contact: Contact | None = None,
        effects: Iterable[Effect] = (),
        joint_uncertainty: float = 0.0,
    ) -> Model: ...
    @property
    def segments(self) -> tuple[Segment, ...]: ...
    @property
    def joints(self) -> tuple[Joint, ...]: ...
    @property
    def gravity(self) -> float: ...
    @property
    def base(self) -> tuple[float, float]: ...
    @property
    def segment_uncertainty(self) -> float: ...
    @property
    def robot(self) -> Robot | None: ...
    @property
    def contact(self) -> Contact | None: ...
    @property
    def effects(self) -> tuple[Effect, ...]: ...
    @property
    def joint_uncertainty(self) -> float: ...
    @property
    def all_effects(self) -> tuple[Effect, ...]: ...
    @property
    def n_joints(self) -> int: ...
    @property
    def warnings(self) -> tuple[str, ...]: ...
    @property
    def parameters(self) -> tuple[ParameterInfo, ...]: ...
    def value(self, parameter: ParameterId | str) -> float | None: ...
    def with_value(self, parameter: ParameterId | str, value: float) -> Model: ...
    def with_mass(self, number: int, mass: float, at: float | None = None) -> Model: ...
    def with_joint_effects(self, fitted: Iterable[Effect], others: Iterable[Effect]) -> Model: ...
    def write(self, path: str | os.PathLike[str]) -> None: ...
    def to_toml(self) -> str: ...
    @staticmethod
    def from_toml(text: str) -> Model: ...
    def replace(self, **changes: object) -> Model: ...
    def __replace__(self, **changes: object) -> Model: ...
    def to_dict(self) -> dict[str, object]: ...
    @staticmethod
    def from_dict(table: Mapping[str, object], place: str = "") -> Model: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class ParameterId:
    def __new__(cls, text: str) -> ParameterId: ...
    @property
    def object(self) -> str: ...
    @property
    def kind(self) -> str | None: ...
    @property
    def name(self) -> str: ...
    def __hash__(self) -> int: ...
    def __lt__(self, other: ParameterId, /) -> bool: ...
    def __le__(self, other: ParameterId, /) -> bool: ...
    def __gt__(self, other: ParameterId, /) -> bool: ...
    def __ge__(self, other: ParameterId, /) -> bool: ...

@final
class ParameterInfo:
    @property
    def id(self) -> ParameterId: ...
    @property
    def value(self) -> float: ...
    @property
    def unit(self) -> str: ...
    @property
    def min(self) -> float: ...
    @property
    def max(self) -> float: ...

@final
class Tolerance:
    __match_args__: ClassVar[tuple[str, ...]]
    def __new__(
        cls,
        angle_offset_deg: float = 0.3,
        force_bias_N: float = 0.2,
        force_gain: float = 0.01,
        time_delay_s: float = 0.005,
        handle_placement_m: float = 0.001,
    ) -> Tolerance: ...
    @property
    def angle_offset_deg(self) -> float: ...
    @property
    def angle_offset(self) -> float: ...
    @property
    def force_bias_N(self) -> float: ...
    @property
    def force_gain(self) -> float: ...
    @property
    def time_delay_s(self) -> float: ...
    @property
    def handle_placement_m(self) -> float: ...
    def replace(self, **changes: object) -> Tolerance: ...
    def __replace__(self, **changes: object) -> Tolerance: ...
    def to_dict(self) -> dict[str, object]: ...
    @staticmethod
    def from_dict(table: Mapping[str, object], place: str = "") -> Tolerance: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class Subject:
    __match_args__: ClassVar[tuple[str, ...]]
    def __new__(
        cls,
        body_mass: float | None = None,
        height: float | None = None,
        sex: str | None = None,
        name: str | None = None,
        lengths_m: Iterable[float] | None = None,
    ) -> Subject: ...
    @property
    def body_mass(self) -> float | None: ...
    @property
    def height(self) -> float | None: ...
    @property
    def sex(self) -> str | None: ...
    @property
    def name(self) -> str | None: ...
    @property
    def lengths_m(self) -> tuple[float, ...] | None: ...
    def replace(self, **changes: object) -> Subject: ...
    def __replace__(self, **changes: object) -> Subject: ...
    def to_dict(self) -> dict[str, object]: ...
    @staticmethod
    def from_dict(table: Mapping[str, object], place: str = "") -> Subject: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class AddedMass:
    __match_args__: ClassVar[tuple[str, ...]]
    def __new__(
        cls,
        segment: int,
        mass: float,
        at: float,
        configurations: Sequence[str] = (),
    ) -> AddedMass: ...
    @property
    def segment(self) -> int: ...
    @property
    def mass(self) -> float: ...
    @property
    def at(self) -> float: ...
    @property
    def configurations(self) -> tuple[str, ...]: ...
    def replace(self, **changes: object) -> AddedMass: ...
    def __replace__(self, **changes: object) -> AddedMass: ...
    def to_dict(self) -> dict[str, object]: ...
    @staticmethod
    def from_dict(table: Mapping[str, object], place: str = "") -> AddedMass: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class TrialEntry:
    __match_args__: ClassVar[tuple[str, ...]]
    def __new__(
        cls,
        file: str,
        configuration: str,
        repeat: int,
        role: str,
    ) -> TrialEntry: ...
    @property
    def file(self) -> str: ...
    @property
    def configuration(self) -> str: ...
    @property
    def repeat(self) -> int: ...
    @property
    def role(self) -> str: ...
    def replace(self, **changes: object) -> TrialEntry: ...
    def __replace__(self, **changes: object) -> TrialEntry: ...
    def to_dict(self) -> dict[str, object]: ...
    @staticmethod
    def from_dict(table: Mapping[str, object], place: str = "") -> TrialEntry: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class Description:
    __match_args__: ClassVar[tuple[str, ...]]
    def __new__(
        cls,
        name: str | None,
        model: str | None,
        trials: Iterable[TrialEntry],
        force_on: str | None = None,
        sample_rate: float | None = None,
        subject: Subject = ...,
        tolerance: Tolerance = ...,
        synthetic: bool = False,
        added: Iterable[AddedMass] = (),
    ) -> Description: ...
    @property
    def name(self) -> str | None: ...
    @property
    def model(self) -> str | None: ...
    @property
    def trials(self) -> tuple[TrialEntry, ...]: ...
    @property
    def force_on(self) -> str | None: ...
    @property
    def sample_rate(self) -> float | None: ...
    @property
    def subject(self) -> Subject: ...
    @property
    def tolerance(self) -> Tolerance: ...
    @property
    def synthetic(self) -> bool: ...
    @property
    def added(self) -> tuple[AddedMass, ...]: ...
    @staticmethod
    def load(path: str | os.PathLike[str]) -> Description: ...
    def to_toml(self) -> str: ...
    def replace(self, **changes: object) -> Description: ...
    def __replace__(self, **changes: object) -> Description: ...
    def to_dict(self) -> dict[str, object]: ...
    @staticmethod
    def from_dict(table: Mapping[str, object], place: str = "") -> Description: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...

def load_model(path: str | os.PathLike[str]) -> Model: ...

@final
class Arm:
    def __new__(
        cls,
        lengths: ArrayLike,
        masses: ArrayLike,
        coms: ArrayLike,
        inertias: ArrayLike,
        *,
        com_normals: ArrayLike | None = None,
        gravity: float = 9.81,
        base: tuple[float, float] = ...,
        rotor_inertia: ArrayLike | None = None,
    ) -> Arm: ...
    @staticmethod
    def from_model(model: Model) -> Arm: ...
    @property
    def n_joints(self) -> int: ...
    @property
    def first_moments(self) -> list[float]: ...
    @property
    def second_moments(self) -> list[float]: ...
    def forward_kinematics(self, q: ArrayLike) -> NDArray[np.float64]: ...
    def jacobian(self, q: ArrayLike) -> NDArray[np.float64]: ...
    def inertia(self, q: ArrayLike) -> NDArray[np.float64]: ...
    def coriolis(self, q: ArrayLike, qd: ArrayLike) -> NDArray[np.float64]: ...
    def gravity(self, q: ArrayLike) -> NDArray[np.float64]: ...
    def static_torque(self, q: ArrayLike, force_on_arm: ArrayLike) -> NDArray[np.float64]: ...
    def inverse_dynamics(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> NDArray[np.float64]: ...
    def forward_dynamics(self, q: ArrayLike, qd: ArrayLike, tau: ArrayLike) -> NDArray[np.float64]: ...
    def regressor(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> NDArray[np.float64]: ...

@final
class Rig:
    def __new__(cls, model: Model, effects: Iterable[Effect] | None = None) -> Rig: ...
    def resisting(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike, interval: float) -> NDArray[np.float64]: ...

@final
class ArmState: ...

@final
class Digest:
    def __new__(cls, effects: Sequence[tuple[str, int]]) -> Digest: ...
    def column(self, name: str, length: int) -> None: ...
    def values(self, values: NDArray[np.float64]) -> None: ...
    def value(self) -> str: ...

@final
class OnlineEstimator:
    def __new__(cls, rig: Rig, uncertainty: float, settings: Mapping[str, object]) -> OnlineEstimator: ...
    def run(
        self,
        log: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]],
        lead: NDArray[np.float64] | None,
        every: int,
    ) -> _Replayed: ...
    def carry(
        self, time: NDArray[np.float64], q: NDArray[np.float64], qd: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]: ...
    def estimates(self) -> list[tuple[float, float, str]]: ...
    def health(self) -> tuple[list[float], float, float, int]: ...

@final
class OnlineCompensation:
    def __new__(cls, rig: Rig, sd: Sequence[float]) -> OnlineCompensation: ...
    def carry(
        self, time: NDArray[np.float64], q: NDArray[np.float64], qd: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]: ...

@final
class OnlineMonitor:
    def __new__(cls, channels: Sequence[Mapping[str, object]], oldest: int, period: int) -> OnlineMonitor: ...
    def run(
        self,
        times: tuple[NDArray[np.uint64], NDArray[np.uint64]],
        values: NDArray[np.float64],
        moving: NDArray[np.bool_],
    ) -> tuple[int, str, int | None, float, float, int] | None: ...
    def reset(self) -> None: ...

@final
class ArmSlave:
    def __new__(cls, rig: Rig, coupling: Mapping[str, object]) -> ArmSlave: ...
    @property
    def token(self) -> str: ...
    @property
    def json(self) -> str: ...
    @property
    def mode(self) -> str: ...
    @property
    def time(self) -> float: ...
    def variables(self) -> list[_Variable]: ...
    def description(self, fmi: int) -> tuple[str, str | None]: ...
    def enter_initialization_mode(self, start: float, stop: float | None = None) -> None: ...
    def exit_initialization_mode(self) -> None: ...
    def set(self, references: Sequence[int], values: NDArray[np.float64]) -> None: ...
    def get(self, references: Sequence[int]) -> NDArray[np.float64]: ...
    def output_derivatives(self, references: Sequence[int], orders: Sequence[int]) -> NDArray[np.float64]: ...
    def do_step(self, time: float, step: float) -> None: ...
    def terminate(self) -> None: ...
    def reset(self) -> None: ...
    def state(self) -> ArmState: ...
    def set_state(self, state: ArmState) -> None: ...
    @staticmethod
    def serialize(state: ArmState) -> bytes: ...
    @staticmethod
    def deserialize(bytes: bytes) -> ArmState: ...

def control(
    rig: Rig,
    drive: Mapping[str, object],
    settings: Mapping[str, object],
    watch: Mapping[str, object],
) -> _Controlled: ...
def declare(
    name: str,
    summary: str,
    formula: str,
    parameters: Sequence[tuple[str, str, float, float, float, bool, Sequence[float]]],
    grid: tuple[float, float, float, float, int, int],
    tabulate: Callable[[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]],
) -> None: ...
def design(rig: Rig, settings: Mapping[str, object], sensing: Mapping[str, object], bounds: Mapping[str, object]) -> _Design: ...
def distances(
    rig: Rig,
    trials: Sequence[Mapping[str, object]],
    settings: Mapping[str, object],
    planned: Sequence[Mapping[str, object]],
    rivals: Sequence[tuple[str, int, Sequence[float], Sequence[int]]],
) -> list[list[float] | None]: ...
def effects() -> list[_Kind]: ...
def online_settings(rig: Rig, period: float) -> _OnlineSettings: ...
def firmware(rig: Rig, uncertainty: float, samples: Sequence[Sequence[float]]) -> _Firmware: ...
def held_out(
    trials: Sequence[tuple[int, bool, float, list[list[float]] | None, list[bool]]],
) -> list[tuple[float | None, float | None, float | None, tuple[int, float, float, float] | None]]: ...
def find_gap(
    rig: Rig,
    trials: Sequence[Mapping[str, object]],
    settings: Mapping[str, object],
    progress: Callable[[str, float], None] | None = None,
) -> _Found: ...
def fit_by_simulation(
    rig: Rig,
    drive: Mapping[str, object],
    settings: Mapping[str, object],
    recorded: Mapping[str, object],
    free: Sequence[tuple[int, int, float, float]],
) -> _Fit: ...
def forecast(
    rig: Rig, settings: Mapping[str, object], sensing: Mapping[str, object], tasks: Sequence[Mapping[str, object]]
) -> _Forecast: ...
def identify(rig: Rig, trials: Sequence[Mapping[str, object]], settings: Mapping[str, object]) -> _Identified: ...
def literature(body_mass: float, height: float, sex: str, lengths: Sequence[float | None]) -> list[_Literature]: ...
def play(rig: Rig, trials: Sequence[Mapping[str, object]], settings: Mapping[str, object], own: bool = False) -> list[_Played]: ...
def simulate(
    rig: Rig,
    drive: Mapping[str, object],
    settings: Mapping[str, object],
    sensing: Mapping[str, object] | None = None,
) -> _Recorded: ...
def simulate_in_pieces(
    rig: Rig, drive: Mapping[str, object], settings: Mapping[str, object], samples: int, take: Callable[[_Recorded], None]
) -> None: ...
def smooth(
    values: NDArray[np.float64], rate: float, cutoff: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]: ...
def look(
    rig: Rig,
    trials: Sequence[Mapping[str, object]],
    settings: Mapping[str, object],
    progress: Callable[[str, float], None] | None = None,
) -> _Screened: ...
def low_pass_both_ways(values: NDArray[np.float64], rate: float, cutoff: float, order: int) -> NDArray[np.float64]: ...
