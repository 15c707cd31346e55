"""The estimated error of coupled runs against runs of the same arm with the spring inside, in many systems."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from armrs.cosim import Slave
from armrs.cosim.error_estimate import estimates, run_checked
from armrs.cosim.master import run_system
from armrs.cosim.system import System, couple
from armrs.errors import CoupledError
from armrs.fmu.slave_interface import Partner, Status, StepResult, Variable, listed
from armrs.model import Contact, Joint, Model, Segment

NEWTON, METRE, SPEED = (1, 1, -2, 0), (0, 1, 0, 0), (0, 1, -1, 0)


class Spring(Partner):
    """A spring and damper from a fixed point to the hand; without a state of its own."""

    can_rollback = True

    def __init__(self, stiffness: float, damping: float, anchor: np.ndarray) -> None:
        self.name, self.stiffness, self.damping, self.anchor = "spring", stiffness, damping, anchor
        self.values = dict.fromkeys(["r[1]", "r[2]", "v[1]", "v[2]"], 0.0)
        rows = [(f"{stem}[{k}]", "input", unit, powers) for stem, unit, powers in (("r", "m", METRE), ("v", "m/s", SPEED)) for k in (1, 2)]
        rows += [(f"F[{k}]", "output", "N", NEWTON) for k in (1, 2)]
        self.variables = {n: Variable(n, i, c, "continuous", unit=u, exponents=p) for i, (n, c, u, p) in enumerate(rows)}

    def enter_initialization_mode(self, start: float = 0.0, stop: float | None = None, tolerance: float | None = None) -> None: ...

    def exit_initialization_mode(self) -> None: ...

    def set(self, names: Sequence[str] | str, values: Any) -> None:
        self.values.update(zip(listed(names), np.atleast_1d(values).tolist(), strict=True))

    def get(self, names: Sequence[str] | str) -> np.ndarray:
        v = self.values
        force = {f"F[{k + 1}]": self.stiffness * (self.anchor[k] - v[f"r[{k + 1}]"]) - self.damping * v[f"v[{k + 1}]"] for k in (0, 1)}
        return np.array([(v | force)[name] for name in listed(names)])

    def do_step(self, time: float, step: float) -> StepResult:
        return StepResult(Status.OK, time + step)

    def get_state(self) -> Any:
        return dict(self.values)

    def set_state(self, state: Any) -> None:
        self.values = dict(state)

    def terminate(self) -> None: ...

    def reset(self) -> None:
        self.values = dict.fromkeys(self.values, 0.0)


LASTS = {"iterated": 0.6, "gauss-seidel": 0.2}
"""Duration of the runs whose error is estimated [s]: an explicit coupling takes twenty thousand steps for the longer."""


def cases() -> list[tuple[int, str, float]]:
    """Thirty systems: arms of one to three joints, springs, algorithms, steps, drawn once."""
    rng = np.random.default_rng(20261122)
    drawn = [(int(rng.integers(1, 4)), "iterated" if k % 3 else "gauss-seidel", float(rng.choice([1e-3, 2e-3, 4e-3]))) for k in range(30)]
    # An explicit coupling is stable with much shorter steps alone.
    return [
        (joints, algorithm, step) if algorithm == "iterated" else (1 + joints % 2, algorithm, step / 32)
        for joints, algorithm, step in drawn
    ]


def made(number: int, joints: int, algorithm: str, step: float, duration: float = 0.6) -> tuple[System, Slave]:
    """Return a coupled system, and the same arm with the spring inside."""
    rng = np.random.default_rng(number)
    parts = tuple(Segment(f"s{k}", *(rng.uniform(0.8, 1.2) * np.array([0.3, 1.5, 0.15, 0.012]))) for k in range(joints))
    hinges = tuple(Joint(f"j{k}", viscosity=float(rng.uniform(0.3, 0.6))) for k in range(joints))
    stiffness = float(rng.uniform(200.0, 800.0))
    damping = float(rng.uniform(0.5, 3.0))
    arm = Model(parts, hinges, contact=Contact((stiffness, stiffness), (damping, damping)))
    start = rng.uniform(-1.2, -0.4, joints)
    free = Slave(arm, port="force", start=start, name="arm")
    anchor = free.get(["handle.r[1]", "handle.r[2]"]) + rng.uniform(-0.05, 0.05, 2)
    whole = Slave(arm, port="motion", start=start, handle=(float(anchor[0]), float(anchor[1])))
    lines = [("arm.handle.r", "spring.r"), ("arm.handle.v", "spring.v"), ("spring.F", "arm.handle.F")]
    system = couple([free, Spring(stiffness, damping, anchor)], lines, algorithm=algorithm, step=step, duration=duration)
    return system, whole


def truth(whole: Slave, t: np.ndarray, joints: int) -> dict[str, np.ndarray]:
    """Run the arm with the spring inside; return angles and forces on the arm at the given times."""
    names = [f"q[{k + 1}]" for k in range(joints)] + ["contact.F[1]", "contact.F[2]"]
    whole.enter_initialization_mode()
    whole.exit_initialization_mode()
    rows = [whole.get(names)]
    for a, b in pairwise(t):
        whole.do_step(float(a), float(b - a))
        rows.append(whole.get(names))
    table = np.array(rows).T
    found = {f"arm.{name}": values for name, values in zip(names, table, strict=True) if name.startswith("q")}
    # What the contact does to the robot it does not do to the arm.
    return found | {f"spring.F[{k}]": -table[joints + k - 1] for k in (1, 2)}


@pytest.mark.long
@pytest.mark.parametrize("number", range(30))
def test_the_estimate_is_within_a_factor_of_two_of_the_error(number: int) -> None:
    joints, algorithm, step = cases()[number]
    system, whole = made(number, joints, algorithm, step, LASTS[algorithm])
    run = run_system(system)
    for slave in system.slaves.values():
        slave.reset()
    finer = couple(
        system.slaves.values(),
        [("arm.handle.r", "spring.r"), ("arm.handle.v", "spring.v"), ("spring.F", "arm.handle.F")],
        algorithm=algorithm,
        step=0.5 * step,
        duration=LASTS[algorithm],
    )
    again = run_system(finer)
    expected = truth(whole, run.t, joints)
    seen = 0
    for estimate in estimates(run, again):
        if estimate.name in expected:
            error = float(np.max(np.abs(run.columns[estimate.name] - expected[estimate.name])))
            assert 0.5 * error <= estimate.error <= 2.0 * error, (estimate, error)
            seen += 1
    assert seen == joints + 2


def test_no_run_is_good_with_more_than_its_accuracy() -> None:
    """Far beyond the steps that resolve the motion the run may be anything but good."""
    for number in range(30):
        joints, algorithm, _ = cases()[number]
        for step in (0.02, 0.06):
            system, whole = made(number, joints, algorithm, step)
            try:
                run = run_checked(system)
            except CoupledError:
                continue
            expected = truth(whole, run.t, joints)
            for estimate in run.estimates:
                if run.verdict == "good" and estimate.name in expected:
                    error = float(np.max(np.abs(run.columns[estimate.name] - expected[estimate.name])))
                    assert error <= estimate.allowed, (number, step, estimate, error)


@pytest.mark.parametrize("inner", [0.01, 0.025, 0.05])
def test_steps_inside_of_an_arm_are_estimated_too(inner: float) -> None:
    """With inner steps that stay as they are, halved communication steps would have the same bits, and no error would be seen."""
    joints, algorithm, _ = cases()[1]

    def swinging(step: float) -> Slave:
        return Slave(made(1, joints, algorithm, 0.1)[1].model, start=[-1.2, 0.4], step=step, name="arm")

    system = couple([swinging(inner)], [], step=0.2, duration=2.0)
    run = run_system(system)
    finer = couple([system.slaves["arm"].finer()], [], step=0.1, duration=2.0)
    expected = run_system(couple([swinging(1e-4)], [], step=0.2, duration=2.0)).columns
    found = estimates(run, run_system(finer))
    assert len(found) == joints
    for estimate in found:
        error = float(np.max(np.abs(run.columns[estimate.name] - expected[estimate.name])))
        assert 0.5 * error <= estimate.error <= 2.0 * error, (estimate, error)
