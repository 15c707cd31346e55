"""Check the clocks that `armrs import` gives to forces: sessions with known offsets, and how far off what is found is.

    python scripts/check_clock.py [first seed] [sessions]

Each session is one arm with springs, viscosity and, in six of ten, dry friction, moved in one to six trials: from point to point, in
circles that begin and end at rest, in circles without beginning or end, or by turns. Speeds are 0.15 to 2 rad/s, angles are read at 50 to
200 Hz and forces at 100 to 1500 Hz, with noise; the clock of the forces drifts by up to 50 ppm and is up to 20 s off, in half of the
sessions by the same in all trials. Shared by tests/test_import_clock.py.
"""

from __future__ import annotations

import sys
import tempfile
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import armrs
from armrs import Arm, Model

KINDS = ("points", "circle", "endless", "by turns")
"""Kinds of movement, by the remainder of the seed."""
PERIOD_OFF = 0.35
"""An offset so wrong is that of another part of the movement [s]."""


@dataclass(frozen=True)
class Case:
    """One trial of a session: its name, what must be added to the time of its forces [s], and the longest step between its samples [s]."""

    name: str
    shift: float
    step: float


def _blend(t: np.ndarray, start: float, duration: float) -> np.ndarray:
    s = np.clip((t - start) / duration, 0.0, 1.0)
    return np.asarray(s**3 * (10.0 - 15.0 * s + 6.0 * s * s))


def _points(rng: np.random.Generator, t: np.ndarray, rest: float, speed: float, amplitude: float, q0: np.ndarray) -> np.ndarray:
    """Return a movement between three postures and the first, with pauses."""
    q, now, at, k = np.tile(q0, (len(t), 1)), q0.copy(), rest, 0
    targets = [q0 + rng.uniform(-1.0, 1.0, 2) * amplitude for _ in range(3)]
    while at < t[-1]:
        to = targets[k % 3] if k % 4 != 3 else q0
        duration = max(1.875 * np.abs(to - now).max() / speed, 0.3)
        q = q + np.outer(_blend(t, at, duration), to - now)
        now, at, k = to, at + duration + rng.choice([0.0, 0.3, 1.0]), k + 1
    return q


def _circle(
    rng: np.random.Generator, t: np.ndarray, rest: float, speed: float, amplitude: float, q0: np.ndarray, *, endless: bool = False
) -> np.ndarray:
    """Return circles in the joints."""
    rate = speed / amplitude
    period = 2.0 * np.pi / rate
    size = np.ones(len(t)) if endless else _blend(t, rest, min(period, 2.0))
    phase, apart = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(0.3, np.pi - 0.3)
    turn = rate * (t if endless else t - rest) + phase
    return np.asarray(q0 + size[:, None] * amplitude * np.column_stack([np.sin(turn), np.sin(turn + apart)]))


def session(seed: int, folder: Path) -> tuple[Model, list[Case]]:
    """Write the recordings of a session; returns what literature says of its arm, and the truth of its clocks."""
    rng = np.random.default_rng(seed)
    sex = str(rng.choice(["male", "female"]))
    lengths = [rng.uniform(0.26, 0.36), rng.uniform(0.26, 0.40)]
    given = armrs.anthropometry.literature_model(armrs.Subject(rng.uniform(50, 100), rng.uniform(1.55, 1.95), sex, lengths_m=lengths))
    heavier = rng.uniform(0.9, 1.1, 2)
    segments = [s.replace(mass=s.mass * k, inertia=s.inertia * k) for s, k in zip(given.segments, heavier, strict=True)]
    arm = Arm.from_model(given.replace(segments=segments))
    trials, common = int(rng.choice([1, 2, 3, 6])), bool(rng.random() < 0.5)
    rate, force_rate = float(rng.choice([50, 100, 120, 200])), float(rng.choice([100, 250, 1000, 1500]))
    drift = float(rng.choice([0.0, 50e-6, -50e-6]))
    stiffness, viscosity = rng.uniform(0.0, 3.0, 2), rng.uniform(0.05, 0.6, 2)
    friction, at_rest = rng.uniform(0.0, 0.5, 2) * (rng.random() < 0.6), np.array([-0.7, 1.0]) + rng.uniform(-0.5, 0.5, 2)
    noise, force_noise = np.radians(rng.choice([0.005, 0.02, 0.05])), rng.choice([0.02, 0.1, 0.3])
    duration = float(rng.choice([8, 15, 30, 60]))
    offset = rng.uniform(-20.0, 20.0) if rng.random() < 0.7 else rng.uniform(-0.3, 0.3)
    cases = []
    for k in range(trials):
        speed, amplitude = float(rng.choice([0.15, 0.4, 1.0, 2.0])), float(rng.uniform(0.1, 0.5))
        rest, q0 = float(rng.choice([0.0, 0.5, 2.0])), np.array([rng.uniform(-1.2, -0.3), rng.uniform(0.5, 1.5)])
        before, after = rng.uniform(-0.08, 0.15) * duration, rng.uniform(-0.08, 0.15) * duration
        t = np.arange(-before - 1.0, duration + after + 1.0, 0.001)
        kind = KINDS[seed % 4]
        if kind == "points" or (kind == "by turns" and k % 2 == 0):
            q = _points(rng, t, rest, speed, amplitude, q0)
        else:
            q = _circle(rng, t, rest, speed, amplitude, q0, endless=kind == "endless")
        qd = np.gradient(q, t, axis=0)
        laws = stiffness * (q - at_rest) + viscosity * qd + friction * np.tanh(qd / 0.01)
        torque = arm.inverse_dynamics(q, qd, np.gradient(qd, t, axis=0)) + laws
        on_arm = np.linalg.solve(np.swapaxes(arm.jacobian(q), 1, 2), torque[..., None])[..., 0]
        at, force_at = np.arange(0.0, duration, 1.0 / rate), np.arange(-before, duration + after, 1.0 / force_rate)
        ahead = offset if common else offset + rng.uniform(-3.0, 3.0)
        angles = np.column_stack([np.interp(at, t, c) for c in q.T]) + rng.normal(0.0, noise, (len(at), 2))
        force = rng.normal(0.0, force_noise, (len(force_at), 2)) - np.column_stack([np.interp(force_at, t, c) for c in on_arm.T])
        _write(folder / f"move{k}_1_angles.csv", "time [s],shoulder [deg],elbow [deg]", at, np.degrees(angles))
        _write(folder / f"move{k}_1_force.csv", "time [s],Fy [N],Fz [N]", force_at * (1.0 + drift) + ahead, force)
        cases.append(Case(f"move{k}", -(ahead + 0.5 * drift * duration), 1.0 / min(rate, force_rate)))
    return given, cases


def _write(path: Path, header: str, t: np.ndarray, values: np.ndarray) -> None:
    np.savetxt(path, np.column_stack([t, values]), delimiter=",", header=header, comments="", fmt="%.6f")


def found(seed: int, folder: Path) -> list[tuple[Case, float, bool]]:
    """Import a session; returns of each trial the error of its shift [s], and whether that was said to be in doubt."""
    (folder / "raw").mkdir()
    given, cases = session(seed, folder / "raw")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", armrs.errors.ArmrsWarning)
        done = armrs.import_recordings([folder / "raw"], folder / "session", model=given)
    shifts = {trial.configuration: trial.force_shift for trial in done.recipe.trials}
    doubts = [[c for c in cases if f"{c.name}_1_force" in line or "other recordings" in line] for line in done.warnings]
    return [(c, shifts[c.name] - c.shift, any(c in doubted for doubted in doubts)) for c in cases]


def main(arguments: Sequence[str]) -> None:
    """Print what is found, a line a session, and the counts."""
    first, count = int(arguments[0]) if arguments else 1, int(arguments[1]) if len(arguments) > 1 else 120
    counts = dict.fromkeys(("trials", "within one sample", "in doubt", "off by more", "of them in doubt", "sessions refused"), 0)
    for seed in range(first, first + count):
        with tempfile.TemporaryDirectory() as folder:
            try:
                results = found(seed, Path(folder))
            except armrs.BadInput as error:
                counts["sessions refused"] += 1
                print(f"{seed} {KINDS[seed % 4]}: refused, {error}", flush=True)
                continue
        for case, error, doubted in results:
            counts["trials"] += 1
            counts["within one sample"] += abs(error) <= case.step
            counts["in doubt"] += doubted
            counts["off by more"] += abs(error) > PERIOD_OFF
            counts["of them in doubt"] += abs(error) > PERIOD_OFF and doubted
        print(f"{seed} {KINDS[seed % 4]}:", ", ".join(f"{1e3 * e:+.1f} ms{' in doubt' * d}" for _, e, d in results), flush=True)
    print(", ".join(f"{name}: {number}" for name, number in counts.items()), f"(more: {PERIOD_OFF:g} s)")


if __name__ == "__main__":
    main(sys.argv[1:])
