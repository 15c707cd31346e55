"""Coupled runs with pulses, vibrations and jumps of a partner, drawn at random: none may be called good with more error than is allowed.

The truth is a run of the same system with steps of 0.03 ms. `coupling_events.py [COUNT [SEED]]`, 240 runs of each kind by default; some
minutes.
"""

from __future__ import annotations

import collections
import math
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

from armrs.cosim import Slave
from armrs.cosim.coupled_run import CoupledRun
from armrs.cosim.error_estimate import run_checked
from armrs.cosim.master import run_system
from armrs.cosim.sources_and_controllers import BuiltInSlave
from armrs.cosim.system import System, couple
from armrs.errors import CoupledError
from armrs.model import load_model

ARM = load_model(Path(__file__).parents[1] / "examples" / "cosim" / "arm.toml")
START = np.radians([-60.0, 50.0])
DURATION, FINE = 0.4, 0.25e-3 / 8
HAND = float(Slave(ARM, start=START, rest=True).get("handle.r[1]")[0])


class Pushing(BuiltInSlave):
    """A force of time, with a spring to where the hand begins where its stiffness is not zero."""

    def __init__(self, force: Callable[[float], float], stiffness: float) -> None:
        super().__init__("partner", [("r", "m")] if stiffness else (), [("F", "N")])
        self.force, self.stiffness = force, stiffness

    def outputs(self) -> dict[str, float]:
        """Return the force on the hand."""
        return {"F": self.force(self.time) + self.stiffness * (HAND - self.inputs.get("r", HAND))}


def event(rng: np.random.Generator) -> Callable[[float], float]:
    """Draw a pulse, a vibration, a smooth bump, a jump, or a train of pulses."""
    width, size = 10.0 ** rng.uniform(math.log10(0.26e-3), -1.7), rng.uniform(5.0, 80.0)
    at, hertz, period = rng.uniform(0.01, DURATION - 0.01 - width), rng.uniform(5.0, 1500.0), rng.choice([1e-3, 2e-3, 4e-3, 5e-3, 1e-2])
    kinds: list[Callable[[float], float]] = [
        lambda t: size if at <= t < at + width else 0.0,
        lambda t: size * math.sin(2.0 * math.pi * hertz * t),
        lambda t: size * math.exp(-(((t - at) / width) ** 2)),
        lambda t: size if t >= at else 0.0,
        lambda t: size if (t / period + 0.3) % 1.0 < max(0.1, 0.27e-3 / period) else 0.0,
    ]
    return kinds[int(rng.integers(len(kinds)))]


def system(partner: Pushing, algorithm: str, step: float, shortest: float | None = None) -> System:
    """Couple an arm and a partner."""
    lines = [("arm.handle.r[1]", "partner.r")] if partner.stiffness else []
    slaves = [Slave(ARM, start=START, rest=True, name="arm"), partner]
    # A partner without inputs leads.
    ordered = slaves if partner.stiffness else slaves[::-1]
    settings = {"algorithm": algorithm, "step": step, "duration": DURATION, "shortest_step": shortest}
    return couple(ordered, [*lines, ("partner.F", "arm.handle.F[1]")], **settings)


def wrong(run: CoupledRun, fine: CoupledRun) -> list[str]:
    """Return the variables with more error than is allowed."""
    found = []
    for e in run.estimates:
        error = float(np.max(np.abs(run.columns[e.name] - np.interp(run.t, fine.t, fine.columns[e.name]))))
        if error > e.allowed:
            found.append(f"{e.name} is off by {error:.3g}, estimated {e.error:.3g}, allowed {e.allowed:.3g}")
    return found


def main() -> int:
    """Run all; 1 where one is good and is not."""
    count, seed = (int(text) for text in [*sys.argv[1:3], *["240", "1"][len(sys.argv) - 1 :]])
    bad = 0
    for fed_back in (False, True):
        rng = np.random.default_rng(seed + fed_back)
        verdicts: collections.Counter[str] = collections.Counter()
        for number in range(count):
            force, stiffness = event(rng), 10.0 ** rng.uniform(1.0, 3.0) if fed_back else 0.0
            step = float(rng.choice([0.5e-3, 1e-3, 2e-3, 5e-3, 1.0 / 60.0]))
            algorithm = str(rng.choice(["iterated", "gauss-seidel"]))
            shortest = None if number % 3 else min(step, 0.5e-3)
            try:
                run = run_checked(system(Pushing(force, stiffness), algorithm, step, shortest))
            except CoupledError as error:
                verdicts[error.run.verdict] += 1
                continue
            verdicts[run.verdict] += 1
            if run.verdict != "good":
                continue
            off = wrong(run, run_system(system(Pushing(force, stiffness), "iterated", FINE)))
            bad += bool(off)
            for text in off:
                print(f"{number}, {algorithm}, {1e3 * step:.3g} ms: good, and {text}")
        words = ", ".join(f"{n} {verdict}" for verdict, n in sorted(verdicts.items()))
        print(f"{count} runs, {'with' if fed_back else 'without'} a spring: {words}", flush=True)
    print(f"{bad} called good wrongly")
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())
