"""Who is led along which movements."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from engine import STEP, Grip, Joint, Rig, Segment, Truth

FURTHEST = 1.5
"""Standard deviations that a segment is off at most."""

Random = np.random.Generator
Json = dict[str, Any]

# De Leva 1996, tables 1 and 4: length as a part of the body height, mass as a part of the body mass, centre of mass and radius of gyration
# (sagittal) as parts of the length; upper arm, forearm, hand (to the knuckle of the third finger).
DE_LEVA = {
    "male": ((0.1618, 0.0271, 0.5772, 0.285), (0.1545, 0.0162, 0.4574, 0.276), (0.0495, 0.0061, 0.79, 0.628)),
    "female": ((0.1586, 0.0255, 0.5754, 0.278), (0.1523, 0.0138, 0.4559, 0.261), (0.0450, 0.0056, 0.7474, 0.531)),
}


@dataclass
class Subject:
    """Who is led, the true rig, the model of it, and about which posture."""

    sex: str
    body_mass: float
    height: float
    truth: Rig
    model: Rig
    posture: np.ndarray
    uncertainty: float
    robot: tuple[tuple[float, float], tuple[float, float]]
    little_known: bool


@dataclass
class Trial:
    """A trial: which movement, and what is its own."""

    name: str
    repeat: int
    test: bool
    path: np.ndarray
    grip: Grip
    part: float = 1.0
    slip: Json | None = None
    truth: Truth | None = field(default=None, repr=False)

    @property
    def file(self) -> str:
        """Path within the data set."""
        return f"trials/{self.name}_{self.repeat}.csv"

    @property
    def duration(self) -> float:
        """Of what is recorded [s]."""
        return self.part * (len(self.path) - 1) * STEP


def within(random: Random, low: float, high: float) -> float:
    """Draw a number."""
    return float(random.uniform(low, high))


def normal(random: Random, limit: float) -> float:
    """Draw from the part of the normal distribution within a limit."""
    while True:
        x = float(random.normal())
        if abs(x) <= limit:
            return x


# ---- who


def subject(random: Random, little_known: bool, exact: bool) -> Subject:
    """Draw a person; in a third of them an orthosis locks the wrist."""
    sex = str(random.choice(["male", "female"]))
    height = round(normal(random, 2.0) * 0.07 + (1.78 if sex == "male" else 1.66), 2)
    mass = float(round(within(random, 20.0, 28.0) * height**2))
    segments = [Segment(a * height, b * mass, c * a * height, b * mass * (r * a * height) ** 2) for a, b, c, r in DE_LEVA[sex]]
    posture = np.radians([within(random, -72.0, -55.0), within(random, 45.0, 68.0), within(random, 0.0, 12.0)])
    if random.uniform() < 1 / 3:
        fore, hand = segments[1:]
        both = fore.mass + hand.mass
        com = (fore.mass * fore.com + hand.mass * (fore.length + hand.com)) / both
        inertia = fore.inertia + hand.inertia + fore.mass * (fore.com - com) ** 2 + hand.mass * (fore.length + hand.com - com) ** 2
        segments[1:] = [Segment(fore.length + hand.length, both, com, inertia)]
    posture = posture[: len(segments)]
    uncertainty = within(random, 0.05, 0.10) if little_known else 0.05
    off = 0.0 if exact else uncertainty
    true = [Segment(s.length, *(v * (1.0 + off * normal(random, FURTHEST)) for v in (s.mass, s.com, s.inertia))) for s in segments]
    joints = []
    for j, q in enumerate(posture):
        stiffness = within(random, 0.4, 3.0) if little_known else within(random, *((0.5, 1.5), (0.4, 1.0), (0.8, 1.6))[j])
        viscosity = within(random, 0.05, 0.4) if little_known else within(random, *((0.15, 0.3), (0.1, 0.25), (0.05, 0.12))[j])
        joints.append(Joint(stiffness, float(q) + math.radians(within(random, -12.0, 12.0)), viscosity))
    truth = Rig(tuple(true), tuple(joints))
    model = Rig(tuple(segments), tuple(Joint() for _ in joints) if little_known else tuple(joints))
    robot = ((0.47, 0.45), (within(random, 1.0, 1.06), within(random, -0.15, 0.05)))
    return Subject(sex, mass, height, truth, model, posture, uncertainty, robot, little_known)


# ---- movements


def movements(who: Subject, random: Random) -> dict[str, np.ndarray]:
    """Return paths of the handle [m] at every step; the last is for checking alone. All but one have two speeds or more."""
    n = len(who.posture)
    wrist = within(random, -8.0, 8.0)

    def path(points: Sequence[tuple[float, float]], speeds: Sequence[float], shift: tuple[float, float] = (0.0, 0.0)) -> np.ndarray:
        home = who.posture + np.radians([*shift, 0.0])[:n]
        at, pieces = home, [np.tile(home, (round(0.6 / STEP), 1))]
        goals = [home + np.radians([a, b, wrist * (b != 0.0)])[:n] for a, b in points] + [home]
        for k, goal in enumerate(goals):
            # Least jerk; its peak is 1.875 of the mean speed.
            duration = max(0.3, 1.875 * float(np.abs(goal - at).max()) / speeds[k % len(speeds)])
            s = np.arange(1, round(duration / STEP) + 1)[:, None] * STEP / duration
            pieces += [at + (goal - at) * s**3 * (10 - 15 * s + 6 * s**2), np.tile(goal, (round(0.2 / STEP), 1))]
            at = goal
        pieces.append(np.tile(home, (round(0.6 / STEP), 1)))
        return who.model.tip(np.concatenate(pieces))

    big, small = within(random, 26.0, 36.0), within(random, 14.0, 22.0)
    slow, quick, fast = within(random, 0.2, 0.3), within(random, 0.5, 0.8), within(random, 1.0, 1.4)
    made = {
        "elbow": path([(0, big), (0, -0.4 * big), (0, 0.8 * big)], [slow, quick, fast]),
        "shoulder": path([(small, 0), (-0.6 * small, 0), (small, 0)], [slow, quick, fast]),
        "round": path([(big, 0), (big, big), (0, big), (0, 0), (big, 0), (big, big)], [quick]),
        "reach": path([(0.8 * small, -0.5 * big), (0, big), (-0.3 * small, 0.2 * big)] * 2, [fast, fast, fast, slow]),
        "raised": path([(small, 0), (small, big), (0, big)], [quick, slow], (within(random, 25.0, 38.0), within(random, -12.0, 10.0))),
        "checking": path([(0.5 * big, 0.6 * big), (-0.3 * small, 0.2 * big), (0.4 * big, -0.3 * big)], [quick, slow, fast], (5.0, 4.0)),
    }
    if who.little_known and random.uniform() < 0.5:
        del made[str(random.choice(["elbow", "shoulder", "raised"]))]
    return made


def robot_angles(handle: np.ndarray, lengths: tuple[float, float], base: tuple[float, float]) -> np.ndarray:
    """Return the angles of two links that hold a point, elbow up [rad].

    Raises
    ------
    ValueError
        Where they do not reach.
    """
    (a, b), (y, z) = lengths, (handle - np.array(base)).T
    cosine = (y**2 + z**2 - a**2 - b**2) / (2.0 * a * b)
    if np.abs(cosine).max() > 0.98 or y.max() > -0.02:
        raise ValueError("the robot does not reach")
    second = np.arccos(cosine)
    first = np.arctan2(z, y) - np.arctan2(b * np.sin(second), a + b * np.cos(second))
    return np.column_stack([np.mod(first, 2.0 * math.pi), second])


def trials(who: Subject, random: Random) -> list[Trial]:
    """Draw movements, repeats, how the handle is held, and what goes wrong."""
    paths = movements(who, random)
    for path in paths.values():
        robot_angles(path, *who.robot)
    repeats = int(random.integers(2, 6)) if who.little_known else int(random.integers(2, 4))
    made: list[Trial] = []
    misplaced = who.little_known or random.uniform() < 0.5
    in_hand, held = random.uniform() < 0.5, random.uniform() < 0.5

    def add(name: str, repeat: int, test: bool) -> None:
        beside = (0.35e-3 * normal(random, 2.0) * misplaced, 0.35e-3 * normal(random, 2.0) * misplaced)
        grip = Grip(in_hand=beside, held=held) if in_hand else Grip(in_room=beside, held=held)
        part = within(random, 0.7, 1.0) if who.little_known and random.uniform() < 1 / 3 else 1.0
        made.append(Trial(name, repeat, test, paths[name], grip, part))

    *fitted, checking = paths
    for name in fitted:
        for repeat in range(1, repeats + 1):
            add(name, repeat, False)
    for name in random.permutation(fitted)[:2]:
        add(str(name), repeats + 1, True)
    for repeat in (1, 2):
        add(checking, repeat, True)
    if who.little_known:
        slipping(who, made[int(random.integers(len(fitted) * repeats))], random)
    return made


def slipping(who: Subject, trial: Trial, random: Random) -> None:
    """Let the handle or the sensor of an angle slip in a trial."""
    start = trial.duration * within(random, 0.25, 0.75)
    sign = float(random.choice([-1.0, 1.0]))
    if random.uniform() < 0.5:
        by = (sign * within(random, 2e-3, 4e-3), within(random, -2e-3, 2e-3))
        trial.grip.slip = (start, by)
        trial.slip = {"trial": trial.file, "what": "handle", "start_s": start, "by_m": by}
    else:
        joint = int(random.integers(len(who.posture)))
        by_rad = sign * math.radians(within(random, 1.5, 4.0))
        trial.slip = {"trial": trial.file, "what": "angle", "joint": joint + 1, "start_s": start, "by_rad": by_rad}
