"""Sessions with hidden effects made with MuJoCo: the third world of the judge.

    python bench/hidden/mujoco_world --family null|single|double|outside|little_known --seed S --count N -o DIR
                                        [--strength strong|medium] [--from K]

Needs `pip install mujoco`. Writes what `hidden-world generate` writes: DIR/mS/data for the workflow, DIR/mS/truth.json, DIR/manifest.json.
Seeds 1 to 99999 are for development, those from 100000 on are scored. Nothing of armrs is imported; what acts stands in engine.py.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from effects import FURTHER, OUTSIDE, Hidden, hide, in_joint, laws, outside, several
from engine import RECORD, Rig, Torque, run
from sizes import SIZES
from subject import Json, Random, Subject, Trial, normal, robot_angles, subject, trials, within

TOLERANCE = {"angle_offset_deg": 0.3, "force_bias_N": 0.2, "force_gain": 0.01, "time_delay_s": 0.005, "handle_placement_m": 0.001}
ENCODER = 2.0 * math.pi / 2**19
"""Step of the robot's encoders [rad]."""

# ---- what is read


@dataclass
class Sensors:
    """Noise and what the calibration left."""

    rate: float
    angle: float
    force: float
    memory: float
    offset: np.ndarray
    bias: np.ndarray
    gain: np.ndarray
    delay: float


def sensors(joints: int, little_known: bool, random: Random) -> Sensors:
    """Draw them; half of what is allowed is a standard deviation."""
    memory = float(random.choice([0.0, 0.0, 0.9, 0.97]))
    finest = 0.5 if memory > 0.95 else 1.0
    rate = float(random.choice([25.0, 50.0, 100.0, 200.0])) if little_known else 50.0

    def error(allowed: float, count: int) -> np.ndarray:
        return np.array([0.5 * allowed * normal(random, 2.0) for _ in range(count)])

    return Sensors(
        rate=rate,
        angle=finest * math.radians(within(random, 0.02, 0.15)),
        force=finest * within(random, 0.05, 0.3),
        memory=memory ** (50.0 / rate),
        offset=error(math.radians(TOLERANCE["angle_offset_deg"]), joints),
        bias=error(TOLERANCE["force_bias_N"], 2),
        gain=error(TOLERANCE["force_gain"], 2),
        delay=float(error(TOLERANCE["time_delay_s"], 1)[0]),
    )


def noise(shape: tuple[int, int], deviation: float, memory: float, random: Random) -> np.ndarray:
    """Return white noise or a first-order autoregression, (n, channels)."""
    out = deviation * random.normal(size=shape)
    fresh = math.sqrt(1.0 - memory**2)
    for k in range(1, shape[0] if memory else 0):
        out[k] = memory * out[k - 1] + fresh * out[k]
    return out


def read(trial: Trial, who: Subject, own: Sensors, hidden: list[Hidden], random: Random) -> np.ndarray:
    """Return the columns of a file: time, angles, force on the arm, angles of the robot."""
    truth = trial.truth
    assert truth is not None
    count = math.floor(trial.duration * own.rate + 1e-9) + 1
    t = np.arange(count) / own.rate
    at = np.round(t / RECORD).astype(int)
    late = own.delay + sum(h.late for h in hidden)
    records = np.arange(len(truth.q)) * RECORD
    q = truth.q[at].copy()
    f = np.column_stack([np.interp(t - late, records, truth.force[:, c]) for c in range(2)])
    for effect in hidden:
        if effect.sense is not None:
            effect.sense(t, q, f)
    if trial.slip and trial.slip["what"] == "angle":
        q[:, trial.slip["joint"] - 1] += trial.slip["by_rad"] * (t >= trial.slip["start_s"])
    q += own.offset + noise(q.shape, own.angle, own.memory, random)
    f = f * (1.0 + own.gain) + own.bias + noise(f.shape, own.force, own.memory, random)
    robot = robot_angles(truth.handle[at], *who.robot)
    robot = np.round(robot / ENCODER) * ENCODER
    return np.column_stack([t, q, f, robot])


# ---- a session


def draw(
    family: str, strength: str | None, number: int, who: Subject, made: list[Trial], random: Random
) -> tuple[list[Hidden], str | None]:
    """Draw what is hidden, and how strong it is. Numbers that follow each other go round all kinds."""
    fitted = [(k, t) for k, t in enumerate(made) if not t.test and t.slip is None]
    kinds = list(SIZES)
    if family == "single":
        strength = strength or ("strong", "medium")[(number // len(kinds)) % 2]
        return [hide(kinds[number % len(kinds)], strength, who, fitted, random)], strength
    if family == "double":
        return several(kinds, 2, "strong", who, fitted, random), "strong"
    if family == "outside":
        return [outside(OUTSIDE[number % len(OUTSIDE)], who, random)], None
    if family == "little_known":
        return several(FURTHER, number % 3, strength or "strong", who, fitted, random), strength or "strong"
    return [], None


def session(seed: int, family: str, strength: str | None, number: int, folder: Path) -> None:
    """Make a session and write it.

    Raises
    ------
    ValueError
        In words, when none can be made of this seed.
    """
    reason = ""
    for attempt in range(20):
        random = np.random.default_rng([seed, attempt])
        try:
            return _session(seed, family, strength, number, folder, random)
        except ValueError as wrong:
            reason = str(wrong)
    raise ValueError(f"seed {seed}: {reason}")


def _session(seed: int, family: str, strength: str | None, number: int, folder: Path, random: Random) -> None:
    little_known = family == "little_known"
    who = subject(random, little_known, exact=family == "null" and number % 2 == 0)
    n = len(who.posture)
    made = trials(who, random)
    hidden, strength = draw(family, strength, number, who, made, random)
    rig, stated = who.truth, hidden
    if little_known:
        friction = [within(random, 0.0, 0.25) * bool(random.uniform() < 0.5) for _ in range(n)]
        stated = [*laws(who, friction), *hidden]
        for j, torque in enumerate(friction):
            rig = in_joint(rig, j, friction=torque)
    for effect in hidden:
        rig = effect.alter(rig)
    servo = 2.0 * math.pi * within(random, 6.0, 10.0)
    for k, trial in enumerate(made):
        trial.truth = run(rig, trial.path, who.posture, servo, trial.grip, motors(hidden, k, n, random), rubbing(rig, hidden))
    own = sensors(n, little_known, random)
    on_robot = bool(random.uniform() < 0.5)
    tables = [read(trial, who, own, hidden, random) for trial in made]
    write(folder, seed, who, made, tables, own, on_robot)
    truth = {
        "world": "mujoco", "seed": seed, "family": family, "strength": strength, "joints": n,
        "null": None if family != "null" else "coloured" if own.memory else "white",
        "friction": "holds at the start" if made[0].grip.held else "none at the start",
        "effects": [_effect(h, made) for h in stated],
        "noise": {"angle_rad": own.angle, "force_N": own.force, "memory": own.memory, "rate_Hz": own.rate},
        "calibration": {
            "angle_offset_rad": own.offset.tolist(), "force_bias_on_arm_N": own.bias.tolist(), "force_gain": own.gain.tolist(),
            "time_delay_s": own.delay,
        },
        "placement": [{"file": t.file, "in_hand_m": t.grip.in_hand, "in_room_m": t.grip.in_room} for t in made],
        "slip": next((t.slip for t in made if t.slip), None), "segments": [vars(s) for s in who.truth.segments],
    }  # fmt: skip
    (folder / "truth.json").write_text(json.dumps(truth, indent=1) + "\n", encoding="utf-8")


def _effect(hidden: Hidden, made: list[Trial]) -> Json:
    return {
        "kind": hidden.kind,
        "joint": None if hidden.joint is None else hidden.joint + 1,
        "channel": None if hidden.channel is None else ("Fy", "Fz")[hidden.channel],
        "trial": None if hidden.trial is None else made[hidden.trial].file,
        "parameters": {name: {"value": value, "exact": exact} for name, (value, exact) in hidden.parameters.items()},
    }


def motors(hidden: list[Hidden], trial: int, n: int, random: Random) -> Torque | None:
    """Return what the motors of a trial do together."""
    acting = [(h.joint, h.motor(random)) for h in hidden if h.motor is not None and h.joint is not None and h.trial in (None, trial)]
    if not acting:
        return None

    def torque(time: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        total = np.zeros(n)
        for joint, act in acting:
            total[joint] += act(time, q, v)
        return total

    return torque


def rubbing(rig: Rig, hidden: list[Hidden]) -> Callable[[np.ndarray], np.ndarray] | None:
    """Return the dry friction where it depends on the speed."""
    changing = [h.friction for h in hidden if h.friction is not None]
    constant = np.array([joint.friction for joint in rig.joints])
    return (lambda v: constant + sum(law(v) for law in changing)) if changing else None


def write(folder: Path, seed: int, who: Subject, made: list[Trial], tables: list[np.ndarray], own: Sensors, on_robot: bool) -> None:
    """Write the data set."""
    data = folder / "data"
    (data / "trials").mkdir(parents=True, exist_ok=True)
    n = len(who.posture)
    head = ",".join(["t_s", *(f"q{j}_rad" for j in range(1, n + 1)), "Fy_N", "Fz_N", "qr1_rad", "qr2_rad"])
    for trial, table in zip(made, tables, strict=True):
        shown = table.copy()
        if on_robot:
            shown[:, n + 1 : n + 3] *= -1.0
        formats = ["%.3f", *["%.6f"] * n, "%.4f", "%.4f", "%.7f", "%.7f"]
        np.savetxt(data / trial.file, shown, fmt=formats, delimiter=",", header=head, comments="")
    on = "robot" if on_robot else "arm"
    lines = [
        f'name = "session m{seed}"', 'model = "model.toml"', f'force_on = "{on}"', f"sample_rate = {own.rate!r}",
        "synthetic = true", "", "[subject]", f"body_mass = {who.body_mass!r}", f"height = {who.height!r}", f'sex = "{who.sex}"', "",
        "[tolerance]", *(f"{name} = {value!r}" for name, value in TOLERANCE.items()),
    ]  # fmt: skip
    for trial in made:
        role = "test" if trial.test else "fit"
        lines += [
            "",
            "[[trial]]",
            f'file = "{trial.file}"',
            f'configuration = "{trial.name}"',
            f"repeat = {trial.repeat}",
            f'role = "{role}"',
        ]
    (data / "dataset.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (data / "model.toml").write_text(model(who), encoding="utf-8")


def model(who: Subject) -> str:
    """Return the model handed over: of little-known arms without any joint law."""
    rig, (lengths, base) = who.model, who.robot
    lines = ["[arm]", "gravity = 9.81", "base = [0.0, 0.0]", f"segment_uncertainty = {who.uncertainty!r}"]
    for name, s in zip(("upper arm", "forearm", "hand"), rig.segments, strict=False):
        lines += ["", "[[arm.segment]]", f'name = "{name}"', *(f"{key} = {value!r}" for key, value in vars(s).items())]
    for name, joint in zip(("shoulder", "elbow", "wrist"), rig.joints, strict=False):
        lines += ["", "[[arm.joint]]", f'name = "{name}"']
        if not who.little_known:
            lines += [f"stiffness = {joint.stiffness!r}", f"rest = {joint.rest!r}", f"viscosity = {joint.viscosity!r}"]
    lines += ["", "[robot]", f"lengths = {list(lengths)!r}", f"base = {list(base)!r}", 'elbow = "up"']
    lines += ["", "[contact]", f"stiffness = {list(rig.stiffness)!r}", f"damping = {list(rig.damping)!r}"]
    return "\n".join(lines) + "\n"


def main(arguments: list[str] | None = None) -> int:
    """Make sessions; a seed of which none can be made is reported and left out."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--family", required=True, choices=["null", "single", "double", "outside", "little_known"])
    parser.add_argument("--strength", choices=["strong", "medium"])
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--count", type=int, required=True)
    parser.add_argument("--from", type=int, default=0, dest="first", help="begin with this case of the family (0)")
    parser.add_argument("-o", type=Path, required=True, dest="folder")
    options = parser.parse_args(arguments)
    made = []
    for k in range(options.count):
        seed = options.seed + k
        name = f"m{seed:06}"
        try:
            session(seed, options.family, options.strength, options.first + k, options.folder / name)
        except ValueError as wrong:
            print(f"mujoco_world: {wrong}", file=sys.stderr)
            continue
        made.append({"folder": name, "seed": seed, "family": options.family})
    path = options.folder / "manifest.json"
    listed = json.loads(path.read_text(encoding="utf-8"))["sessions"] if path.is_file() else []
    listed = [old for old in listed if old["folder"] not in {new["folder"] for new in made}] + made
    if not listed:
        return 2
    path.write_text(json.dumps({"sessions": sorted(listed, key=lambda e: e["seed"])}, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
