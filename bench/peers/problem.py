"""The workloads as numbers: the arm, its movement, and the files that every tool reads.

One place for all of them: C and C++ get a header, Python imports this module, Rust has the same arm as `arm_sim::sample_experiments`.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

LENGTH = np.array([0.322, 0.264, 0.093])
COM = np.array([0.186, 0.121, 0.081])
MASS = np.array([2.114, 1.264, 0.753])
INERTIA = np.array([0.0157, 0.0061, 0.0016])
GRAVITY = 9.81
VISCOSITY, STIFFNESS = 0.2, 0.5
SPRING = 1e4
FROM, TO = np.radians([-68.0, 40.0, 0.0]), np.radians([-56.0, 80.0, 5.0])

STEP = 0.25e-3
"""Step of every simulation [s]."""
LONG, SHORT = 20.0, 2.0
"""Length of the single run and of a run of the batch [s]."""
RECORD = 80
"""Steps from one recorded sample to the next: 50 Hz."""
RUNS = 1000
"""Runs of a batch; masses, viscosities and stiffnesses of run i are 1 + i/10 000 times those above."""
EVERY = 50
"""The accuracy of a batch is that of every fiftieth run."""
STATES = 64
"""States that the kernels are called with."""
SIZES = (1_000, 10_000, 100_000, 1_000_000)
"""Samples of the cascade."""
KNOWN_WITHIN = 0.3
"""Half width of the box around the masses of the cascade, relative."""
MASS_ERROR = np.array([1.08, 0.92, 1.08])
"""Prior means of the masses in the cascade, relative to the truth."""
GUESS = np.tile([0.1, 1.0], 3)
"""Where the fit by simulation starts: viscosity and stiffness of each joint."""
TRUE = np.array([0.15, 0.4, 0.25, 0.6, 0.2, 0.5])
"""What it has to find."""
NOISE = np.array([np.radians(0.1)] * 3 + [0.2] * 2)
"""Standard deviations of angles [rad] and forces [N] in the fit by simulation; its residuals are in units of these."""
UPPER = np.tile([5.0, 20.0], 3)
"""Upper bounds of the fit by simulation; the lower ones are zero."""


def states() -> np.ndarray:
    """Return angles, speeds, and accelerations or torques of the kernels, shape (3, STATES, 3)."""
    wave = np.sin(1.7 * (1.0 + np.arange(9 * STATES))).reshape(STATES, 3, 3)
    return np.ascontiguousarray((wave * [[1.5], [1.0], [3.0]]).transpose(1, 0, 2))


def fraction(time: np.ndarray, duration: float) -> np.ndarray:
    """Return s(t): from 0 to 1 and back with trapezoidal speed, ramps of a tenth of each half."""
    half = 0.5 * duration
    ramp = 0.1 * half
    inside = np.minimum(time, duration - time)
    peak = 1.0 / (half - ramp)
    near = np.minimum(inside, half - inside)
    part = peak * np.where(near < ramp, 0.5 * near * near / ramp, near - 0.5 * ramp)
    return np.where(inside <= 0.5 * half, part, 1.0 - part)


def tip(q: np.ndarray) -> np.ndarray:
    """Return y and z of the tip, shape (…, 2) [m]."""
    angle = np.cumsum(q, axis=-1)
    return np.stack([(LENGTH * np.cos(angle)).sum(-1), (LENGTH * np.sin(angle)).sum(-1)], axis=-1)


def handle(duration: float, steps: int) -> np.ndarray:
    """Return the point that the spring pulls towards at the start of every step and the end of the last, shape (steps + 1, 2) [m]."""
    s = fraction(np.arange(steps + 1) * STEP, duration)
    return tip(FROM + s[:, None] * (TO - FROM))


def equilibrium(scale: float = 1.0, joints: np.ndarray | None = None) -> np.ndarray:
    """Return the static equilibrium at the start, for masses and stiffnesses `scale` times as large [rad]."""
    stiffness = np.full(3, STIFFNESS * scale) if joints is None else joints[1::2]
    mass, target, q = MASS * scale, tip(FROM), FROM.copy()
    first = mass * COM + LENGTH * (mass.sum() - np.cumsum(mass))
    for _ in range(50):
        angle = np.cumsum(q)
        along, across = LENGTH * np.cos(angle), LENGTH * np.sin(angle)
        # A joint turns every link beyond it.
        beyond = np.tri(3).T
        jacobian = np.stack([-(beyond @ across), beyond @ along])
        force = SPRING * (target - tip(q))
        rest = beyond @ (GRAVITY * first * np.cos(angle)) + stiffness * q - jacobian.T @ force
        # Derivatives to the link angles, which a joint turns together.
        weight = -GRAVITY * first * np.sin(angle) + along * force[0] + across * force[1]
        slope = SPRING * jacobian.T @ jacobian + beyond @ np.diag(weight) @ beyond.T + np.diag(stiffness)
        change = np.linalg.solve(slope, rest)
        q = q - change
        if np.abs(change).max() < 1e-15:
            break
    return q


def slow_movement(samples: int) -> tuple[np.ndarray, np.ndarray]:
    """Return noisy angles and the force on the arm that holds shoulder and elbow against gravity, of a slow movement there and back."""
    random = np.random.default_rng(4)
    s = 1.0 - np.abs(2.0 * np.arange(samples) / samples - 1.0)
    q = FROM + s[:, None] * (TO - FROM) + np.radians(0.1) * random.uniform(-1, 1, (samples, 3))
    angle = np.cumsum(q, axis=1)
    first = MASS * COM + LENGTH * (MASS.sum() - np.cumsum(MASS))
    weight = GRAVITY * first * np.cos(angle)
    gravity = np.cumsum(weight[:, ::-1], axis=1)[:, ::-1]
    along = np.cumsum((LENGTH * np.cos(angle))[:, ::-1], axis=1)[:, ::-1]
    across = np.cumsum((-LENGTH * np.sin(angle))[:, ::-1], axis=1)[:, ::-1]
    det = across[:, 0] * along[:, 1] - across[:, 1] * along[:, 0]
    force = np.stack(
        [
            (gravity[:, 0] * along[:, 1] - gravity[:, 1] * along[:, 0]) / det,
            (gravity[:, 1] * across[:, 0] - gravity[:, 0] * across[:, 1]) / det,
        ],
        axis=1,
    )
    return q, force + 0.2 * random.uniform(-1, 1, (samples, 2))


def box() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return mean, lower and upper bounds of (m1 l1, m2, m2 l2, m3, m3 l3) in the cascade.

    A mass may be off by `KNOWN_WITHIN`, its product with the place of its centre by √2 times as much.
    """
    mass = MASS * MASS_ERROR
    along = mass * COM
    mean = np.array([along[0], mass[1], along[1], mass[2], along[2]])
    half = KNOWN_WITHIN * mean * np.array([np.sqrt(2.0), 1.0, np.sqrt(2.0), 1.0, np.sqrt(2.0)])
    return mean, mean - half, mean + half


def mjcf(led: bool) -> str:
    """Return the arm for MuJoCo, free or with joints that resist and a spring at its tip; flags remove what no other tool computes."""
    bodies = ""
    for j in reversed(range(3)):
        joint = f'damping="{VISCOSITY}" stiffness="{STIFFNESS}"' if led else ""
        moment = INERTIA[j]
        bodies = f"""<body pos="0 {LENGTH[j - 1] if j else 0.0} 0"><joint type="hinge" axis="1 0 0" {joint}/>
            <inertial pos="0 {COM[j]} 0" mass="{MASS[j]}" diaginertia="{moment} {0.5 * moment} {0.5 * moment}"/>
            {bodies or f'<site name="tip" pos="0 {LENGTH[2]} 0"/>'}</body>"""
    spring = "".join(
        f'<general site="tip" refsite="room" gear="{gear} 0 0 0" gainprm="{SPRING}" biastype="affine" biasprm="0 -{SPRING} 0"/>'
        for gear in ("0 1 0", "0 0 1")
    )
    return f"""<mujoco><compiler angle="radian" inertiafromgeom="false"/>
        <option timestep="{STEP}" gravity="0 0 -{GRAVITY}" integrator="Euler">
            <flag eulerdamp="disable" contact="disable" constraint="disable"/></option>
        <worldbody><site name="room"/>{bodies}</worldbody>
        {f"<actuator>{spring}</actuator>" if led else ""}</mujoco>"""


def write(folder: Path) -> None:
    """Write the header and the binary files (doubles, one after the other) that the tools read."""
    folder.mkdir(parents=True, exist_ok=True)
    scalars = {
        "GRAVITY": GRAVITY, "VISCOSITY": VISCOSITY, "STIFFNESS": STIFFNESS, "SPRING": SPRING, "STEP": STEP, "LONG": LONG, "SHORT": SHORT,
    }  # fmt: skip
    arrays = {"LENGTH": LENGTH, "COM": COM, "MASS": MASS, "INERTIA": INERTIA, "FROM": FROM, "TO": TO}
    lines = [f"static const double {name} = {value!r};" for name, value in scalars.items()]
    lines += [f"static const double {name}_[3] = {{{', '.join(repr(float(v)) for v in values)}}};" for name, values in arrays.items()]
    lines += [
        f"enum {{ RECORD = {RECORD}, RUNS = {RUNS}, EVERY = {EVERY}, STATES = {STATES} }};",
        f'static const char *const FOLDER = "{folder.resolve()}";',
    ]
    (folder / "problem.h").write_text("#pragma once\n" + "\n".join(lines) + "\n", encoding="utf-8")
    for name in ("free", "led"):
        (folder / f"{name}.xml").write_text(mjcf(name == "led"), encoding="utf-8")
    states().tofile(folder / "states.f64")
    starts = np.array([equilibrium()] + [equilibrium(1.0 + 1e-4 * i) for i in range(RUNS)])
    starts.tofile(folder / "starts.f64")
    for samples in SIZES:
        q, force = slow_movement(samples)
        np.hstack([q, force]).tofile(folder / f"slow{samples}.f64")


if __name__ == "__main__":
    write(Path(sys.argv[1]))
