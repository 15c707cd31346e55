"""An arm led by a robot in MuJoCo: MJCF, and one trial.

MuJoCo (Todorov, Erez, Tassa, IROS 2012, https://mujoco.org) computes everything that moves: generalised coordinates with soft constraints,
`stiffness` and `springref`, `damping`, `frictionloss`, `armature`, fixed tendons over two joints, actuators that are
spring and damper between two sites for the contact, and their force sensors. Nothing of armrs is imported.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import mujoco
import numpy as np

STEP = 0.5e-3
"""Of the engine [s]."""
RECORD = 1e-3
"""From one record to the next [s]."""
CARRIAGE = 15.0
"""Mass that the robot moves [kg]."""
LEAD_IN = 2.0
"""Time before the recording in which the arm comes to rest [s]; where friction is to hold it, the robot comes from `ASIDE`."""
ASIDE = (0.02, -0.015)
"""[m]"""
SLIP_TIME = 0.1
"""How long a slip of the handle takes [s]."""


@dataclass(frozen=True)
class Segment:
    """A rigid segment: lengths in m from the proximal joint, kg, kg m² about the centre of mass."""

    length: float
    mass: float
    com: float
    inertia: float


@dataclass(frozen=True)
class Joint:
    """What MuJoCo's hinge does by itself [N m/rad, rad, N m s/rad, N m, kg m²]."""

    stiffness: float = 0.0
    rest: float = 0.0
    viscosity: float = 0.0
    friction: float = 0.0
    rotor: float = 0.0


@dataclass(frozen=True)
class Cord:
    """A fixed tendon over a joint and the one before it: length `q + ratio q_before`; slack within `slack` of its rest."""

    joint: int
    stiffness: float
    ratio: float
    rest: float
    slack: float = 0.0
    friction: float = 0.0


@dataclass(frozen=True)
class Rig:
    """Arm and contact; y forward, z up."""

    segments: tuple[Segment, ...]
    joints: tuple[Joint, ...]
    gravity: tuple[float, float] = (0.0, -9.81)
    stiffness: tuple[float, float] = (10_000.0, 10_000.0)
    damping: tuple[float, float] = (25.0, 25.0)
    hand_mass: float = 0.0
    cords: tuple[Cord, ...] = ()
    heave: tuple[float, float, float, float] = (0.0, 0.0, 0.25, 0.0)
    """How the shoulder heaves: y and z [m], frequency [Hz], phase when the recording begins [rad]."""

    def tip(self, q: Sequence[float] | np.ndarray) -> np.ndarray:
        """Return where the hand ends [m]; `q` of shape (..., n)."""
        angles = np.cumsum(np.asarray(q), axis=-1)
        lengths = np.array([s.length for s in self.segments])
        return np.stack([(lengths * np.cos(angles)).sum(-1), (lengths * np.sin(angles)).sum(-1)], axis=-1)


Torque = Callable[[float, np.ndarray, np.ndarray], np.ndarray]
"""Torques of motors at the joints [N m] of time [s], angles [rad] and speeds [rad/s]; called once a step."""


@dataclass
class Grip:
    """How the handle is held in a trial [m]: beside the hand's end, beside the place by the robot's angles; start [s], way of a slip."""

    in_hand: tuple[float, float] = (0.0, 0.0)
    in_room: tuple[float, float] = (0.0, 0.0)
    slip: tuple[float, tuple[float, float]] | None = None
    held: bool = False
    """Whether joints that rub are held by their friction when the recording begins, instead of being in equilibrium without it."""


@dataclass
class Truth:
    """What happened: angles (n, joints), force on the arm (n, 2), handle where the robot has it (n, 2), every `RECORD`."""

    q: np.ndarray
    force: np.ndarray
    handle: np.ndarray


def mjcf(rig: Rig, servo: float) -> str:
    """Return the model for MuJoCo; `servo` is the natural frequency of the robot's controller [rad/s]."""
    # Bodies along x; a hinge about -y turns x towards z.
    inner = f'<site name="grip" pos="{rig.segments[-1].length!r} 0 0"/>'
    if rig.hand_mass:
        inner += (
            f'<body pos="{rig.segments[-1].length!r} 0 0">'
            f'<inertial pos="0 0 0" mass="{rig.hand_mass!r}" diaginertia="1e-9 1e-9 1e-9"/></body>'
        )
    for j in range(len(rig.segments) - 1, -1, -1):
        s, own = rig.segments[j], rig.joints[j]
        at = rig.segments[j - 1].length if j else 0.0
        inner = (
            f'<body name="segment{j}" pos="{at!r} 0 0">'
            f'<joint name="q{j}" type="hinge" axis="0 -1 0" stiffness="{own.stiffness!r}" springref="{own.rest!r}"'
            f' damping="{own.viscosity!r}" frictionloss="{own.friction!r}" armature="{own.rotor!r}"'
            ' solreffriction="0.002 1" solimpfriction="0.99 0.999 0.001 0.5 2"/>'
            f'<inertial pos="{s.com!r} 0 0" mass="{s.mass!r}" diaginertia="{s.inertia!r} {s.inertia!r} {s.inertia!r}"/>'
            f"{inner}</body>"
        )
    tendons = "".join(
        f'<fixed name="cord{k}" stiffness="{c.stiffness!r}" springlength="{c.rest - c.slack!r} {c.rest + c.slack!r}"'
        f' frictionloss="{c.friction!r}" solreffriction="0.002 1" solimpfriction="0.99 0.999 0.001 0.5 2">'
        f'<joint joint="q{c.joint}" coef="1"/><joint joint="q{c.joint - 1}" coef="{c.ratio!r}"/></fixed>'
        for k, c in enumerate(rig.cords)
    )
    kp, kv = CARRIAGE * servo**2, 2.0 * CARRIAGE * servo
    axes = {"y": "1 0 0", "z": "0 0 1"}
    carriage = "".join(f'<joint name="robot_{a}" type="slide" axis="{axis}"/>' for a, axis in axes.items())
    # Between two sites, along axes of the carriage, which does not turn; the force on the arm.
    contact = "".join(
        f'<general name="contact_{a}" site="grip" refsite="handle" gear="{axes[a]} 0 0 0" gainprm="0" biastype="affine"'
        f' biasprm="0 {-k!r} {-b!r}"/>'
        for a, k, b in zip("yz", rig.stiffness, rig.damping, strict=True)
    )
    sensors = "".join(f'<actuatorfrc actuator="contact_{a}"/>' for a in "yz")
    servos = "".join(
        f'<general joint="robot_{a}" gaintype="fixed" gainprm="{kp!r}" biastype="affine" biasprm="0 {-kp!r} {-kv!r}"/>' for a in "yz"
    )
    motors = "".join(f'<motor joint="q{j}"/>' for j in range(len(rig.joints)))
    return f"""<mujoco>
<compiler angle="radian" autolimits="true"/>
<option timestep="{STEP!r}" gravity="{rig.gravity[0]!r} 0 {rig.gravity[1]!r}" integrator="implicitfast" solver="Newton" tolerance="1e-12">
<flag contact="disable"/></option>
<worldbody>{inner}
<body name="carriage" gravcomp="1">{carriage}<inertial pos="0 0 0" mass="{CARRIAGE!r}" diaginertia="1 1 1"/>
<site name="handle"/></body>
</worldbody>
<tendon>{tendons}</tendon>
<actuator>{servos}{motors}{contact}</actuator>
<sensor>{sensors}</sensor>
</mujoco>"""


def run(rig: Rig, path: np.ndarray, start: Sequence[float], servo: float, grip: Grip | None = None, torque: Torque | None = None,
        friction: Callable[[np.ndarray], np.ndarray] | None = None) -> Truth:  # fmt: skip
    """Run a trial.

    Parameters
    ----------
    path : (n, 2) array
        Where the handle is to be at every step [m].
    start : angles near which the arm is when the robot comes [rad]
    torque : what motors at the joints do
    friction : dry friction of each joint of its speed, where it is not constant

    Raises
    ------
    ValueError
        In words, when the arm does not stay where an arm can be.
    """
    grip = grip or Grip()
    model = mujoco.MjModel.from_xml_string(mjcf(rig, servo))
    data = mujoco.MjData(model)
    n = len(rig.joints)
    site = model.site("grip").id
    nominal = model.site_pos[site] + np.array([grip.in_hand[0], 0.0, grip.in_hand[1]])
    model.site_pos[site] = nominal
    room = np.array(grip.in_room)
    data.qpos[:n] = start
    data.qpos[n : n + 2] = rig.tip(start)
    mujoco.mj_forward(model, data)
    dry = model.dof_frictionloss[:n].copy()
    lead = round(LEAD_IN / STEP)
    every = round(RECORD / STEP)
    q, force, handle = [], [], []
    turning = 2.0 * math.pi * rig.heave[2]
    angles, robot = data.qpos[:n].copy(), data.qpos[n : n + 2].copy()
    for k in range(-lead, len(path)):
        goal = path[max(k, 0)] + room
        if k < 0:
            s = min(1.0, (k + lead) / (0.5 * lead))
            goal = goal + grip.held * (1.0 - s * s * (3.0 - 2.0 * s)) * np.array(ASIDE)
        elif grip.slip is not None:
            begin, way = grip.slip
            s = min(1.0, max(0.0, (k * STEP - begin) / SLIP_TIME))
            part = s * s * (3.0 - 2.0 * s)
            model.site_pos[site] = nominal + np.array([part * way[0], 0.0, part * way[1]])
        # The whole is seen from the shoulder: where that is accelerated, gravity is another one.
        swing = np.array(rig.heave[:2]) * math.sin(turning * k * STEP + rig.heave[3])
        goal = goal - swing
        model.opt.gravity[[0, 2]] = np.array(rig.gravity) + turning**2 * swing
        data.ctrl[:2] = goal
        if torque is not None:
            data.ctrl[2 : 2 + n] = torque(k * STEP, data.qpos[:n], data.qvel[:n])
        if friction is not None:
            model.dof_frictionloss[:n] = friction(data.qvel[:n])
        if not grip.held and k <= 0:
            model.dof_frictionloss[:n] = 0.0 if k < 0 else dry
        mujoco.mj_step1(model, data)
        mujoco.mj_step2(model, data)
        if data.warning[mujoco.mjtWarning.mjWARN_BADQACC].number:
            raise ValueError("the arm does not stay together")
        if k >= 0 and k % every == 0:
            # The sensor belongs to the state at the beginning of the step, which the step has left; the angles are taken there too.
            q.append(angles)
            force.append(data.sensordata.copy())
            handle.append(robot + swing - room)
        angles, robot = data.qpos[:n].copy(), data.qpos[n : n + 2].copy()
    truth = Truth(np.array(q), np.array(force), np.array(handle))
    if not (np.isfinite(truth.q).all() and np.abs(truth.q).max() < 4.0):
        raise ValueError("the arm spun")
    return truth


# ---- what motors do


@dataclass
class Reflex:
    """Resists beyond a threshold of the speed in one direction, late."""

    joint: int
    gain: float
    threshold: float
    direction: float
    latency: float
    past: deque[float] = field(default_factory=deque)

    def __call__(self, time: float, q: np.ndarray, v: np.ndarray) -> float:
        """Return the torque [N m]."""
        self.past.append(float(v[self.joint]))
        felt = self.past.popleft() if len(self.past) * STEP > self.latency else 0.0
        return -self.direction * self.gain * max(0.0, self.direction * felt - self.threshold)


@dataclass
class Tremor:
    """A rhythm whose size wanders."""

    joint: int
    amplitude: float
    frequency: float
    phases: tuple[float, float]

    def __call__(self, time: float, q: np.ndarray, v: np.ndarray) -> float:
        """Return the torque [N m]."""
        swell = 1.0 + 0.15 * math.sin(2.0 * math.pi * 0.37 * time + self.phases[1])
        return self.amplitude * swell * math.sin(2.0 * math.pi * self.frequency * time + self.phases[0])


@dataclass
class Burst:
    """A push of half a sine."""

    joint: int
    amplitude: float
    start: float
    duration: float

    def __call__(self, time: float, q: np.ndarray, v: np.ndarray) -> float:
        """Return the torque [N m]."""
        s = (time - self.start) / self.duration
        return self.amplitude * math.sin(math.pi * s) if 0.0 < s < 1.0 else 0.0


@dataclass
class Law:
    """A torque of angle and speed."""

    joint: int
    law: Callable[[float, float], float]

    def __call__(self, time: float, q: np.ndarray, v: np.ndarray) -> float:
        """Return the torque [N m]."""
        return self.law(float(q[self.joint]), float(v[self.joint]))


@dataclass
class Maxwell:
    """A spring that relaxes, and has done so when the recording begins."""

    joint: int
    stiffness: float
    time: float
    stretch: float = 0.0

    def __call__(self, time: float, q: np.ndarray, v: np.ndarray) -> float:
        """Return the torque [N m]."""
        left = math.exp(-STEP / self.time)
        if time >= 0.0:
            self.stretch = self.stretch * left + float(v[self.joint]) * self.time * (1.0 - left)
        return -self.stiffness * self.stretch
