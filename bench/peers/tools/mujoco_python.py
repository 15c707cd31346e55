"""MuJoCo from Python: kernels, roll-outs, and the fit by simulation with SciPy.

The package installs a profiling clock as it is imported (the global `mjcb_time` of its library). Its API cannot take it off; here it is
set to nothing through ctypes, and put back for the figures with it.
"""

from __future__ import annotations

import copy
import ctypes
import sys
from functools import partial
from pathlib import Path

import line
import mujoco
import numpy as np
from mujoco import rollout

sys.path.insert(0, str(Path(__file__).parents[1]))
import problem

FOLDER = Path(sys.argv[1])
_LIBRARY = ctypes.CDLL(str(next(Path(mujoco.__file__).parent.glob("libmujoco*"))))
_CLOCK = ctypes.c_void_p.in_dll(_LIBRARY, "mjcb_time")
_INSTALLED = _CLOCK.value


def clock(on: bool) -> None:
    """Have the profiling clock that the package installs, or none."""
    _CLOCK.value = _INSTALLED if on else None


free_arm = mujoco.MjModel.from_xml_path(str(FOLDER / "free.xml"))
led = mujoco.MjModel.from_xml_path(str(FOLDER / "led.xml"))
free_data, led_data = mujoco.MjData(free_arm), mujoco.MjData(led)
q, qd, third = problem.states()
starts = np.fromfile(FOLDER / "starts.f64").reshape(-1, 3)
FULL = mujoco.mjtState.mjSTATE_FULLPHYSICS


def first_state(start: np.ndarray) -> np.ndarray:
    """Return the full state of the led arm at rest."""
    mujoco.mj_resetData(led, led_data)
    led_data.qpos[:] = start
    state = np.empty(mujoco.mj_stateSize(led, FULL))
    mujoco.mj_getState(led, led_data, state, FULL)
    return state


def rolled(models: list[mujoco.MjModel], initial: np.ndarray, duration: float) -> np.ndarray:
    """Return the states of runs, shape (runs, steps, size), the path of the handle the same for all."""
    steps = round(duration / problem.STEP)
    path = problem.handle(duration, steps)[:steps]
    states, _ = rollout.rollout(models, led_data, initial, np.broadcast_to(path, (len(initial), steps, 2)))
    return states


def forward(check: bool) -> object:
    """Time one call of `mj_forward` with its arguments set, or return all accelerations."""
    if check:
        out = []
        for i in range(problem.STATES):
            free_data.qpos[:], free_data.qvel[:], free_data.qfrc_applied[:] = q[i], qd[i], third[i]
            mujoco.mj_forward(free_arm, free_data)
            out += free_data.qacc.tolist()
        return out
    return line.seconds_of(lambda: mujoco.mj_forward(free_arm, free_data))


def inverse() -> object:
    """Time one call of `mj_inverse`."""
    return line.seconds_of(lambda: mujoco.mj_inverse(free_arm, free_data))


def run(check: bool = False) -> object:
    """Time the single run of 20 s, or return its angles at 50 Hz."""
    initial = first_state(starts[0])[None]
    if not check:
        return line.seconds_of(lambda: rolled([led], initial, problem.LONG))
    states = rolled([led], initial, problem.LONG)[0]
    # Time comes first, then the angles; the state after step k.
    angles = np.vstack([starts[:1], states[problem.RECORD - 1 :: problem.RECORD, 1:4]])
    return angles.ravel().tolist()


def scaled(index: int) -> mujoco.MjModel:
    """Return the model of one run of the batch."""
    scale = 1.0 + 1e-4 * index
    model = mujoco.MjModel.from_xml_path(str(FOLDER / "led.xml"))
    model.body_mass[1:] *= scale
    model.jnt_stiffness[:] *= scale
    model.dof_damping[:] *= scale
    return model


def batch(runs: int = 20) -> object:
    """Time a part of the batch on one thread, as of all of it."""
    models = [scaled(i) for i in range(runs)]
    initial = np.array([first_state(s) for s in starts[1 : 1 + runs]])
    once = line.seconds_of(lambda: rolled(models, initial, problem.SHORT))
    return {"seconds": once["seconds"] * problem.RUNS / runs}


def check_batch() -> list[float]:
    """Return the last angles of the last four runs."""
    last = range(problem.RUNS - 4, problem.RUNS)
    states = rolled([scaled(i) for i in last], np.array([first_state(starts[1 + i]) for i in last]), problem.SHORT)
    return states[:, -1, 1:4].ravel().tolist()


INTEGRATORS = {"rk4": mujoco.mjtIntegrator.mjINT_RK4, "implicitfast": mujoco.mjtIntegrator.mjINT_IMPLICITFAST}


def accurate(method: str, substeps: str, runs: range | None = None, check: bool = False) -> object:
    """Time the single run or a part of the batch by another method and step, or return the angles at 50 Hz.

    A roll-out holds what drives it over a step. For each method the path is taken where its error is smaller: at the middle of the step,
    or for the one of first order at its start.
    """
    duration, step = (problem.SHORT if runs else problem.LONG), problem.RECORD * problem.STEP / int(substeps)
    models, first = ([scaled(i) for i in runs], starts[1:][runs]) if runs else ([copy.copy(led)], starts[:1])
    for model in models:
        model.opt.integrator, model.opt.timestep = INTEGRATORS[method], step
    steps = round(duration / step)
    times = (np.arange(steps) + (0.5 if method == "rk4" else 0.0)) * step
    path = problem.tip(problem.FROM + problem.fraction(times, duration)[:, None] * (problem.TO - problem.FROM))
    initial, control = np.array([first_state(s) for s in first]), np.broadcast_to(path, (len(first), steps, 2))
    if not check:
        once = line.seconds_of(lambda: rollout.rollout(models, led_data, initial, control))
        return {"seconds": once["seconds"] * (problem.RUNS / len(runs) if runs else 1.0)}
    states, _ = rollout.rollout(models, led_data, initial, control)
    return np.concatenate([first[:, None], states[:, int(substeps) - 1 :: int(substeps), 1:4]], axis=1).ravel().tolist()


def fit() -> object:
    """Time the fit of viscosities and stiffnesses by simulation."""
    from scipy.optimize import least_squares

    data = np.fromfile(FOLDER / "fit.f64").reshape(-1, 5)
    path = problem.handle(problem.LONG, round(problem.LONG / problem.STEP))[:: problem.RECORD]

    def residual(x: np.ndarray) -> np.ndarray:
        led.dof_damping[:], led.jnt_stiffness[:] = x[::2], x[1::2]
        start = problem.equilibrium(joints=x)
        states = rolled([led], first_state(start)[None], problem.LONG)[0]
        angles = np.vstack([start[None], states[problem.RECORD - 1 :: problem.RECORD, 1:4]])
        force = problem.SPRING * (path - problem.tip(angles))
        return ((np.hstack([angles, force]) - data) / problem.NOISE).ravel()

    found = {}

    def solve() -> None:
        result = least_squares(residual, problem.GUESS, bounds=(np.zeros(6), problem.UPPER), x_scale="jac")
        found.update(x=result.x.tolist(), cost=2.0 * float(result.cost))

    timed = line.seconds_of(solve, warm=False)
    led.dof_damping[:], led.jnt_stiffness[:] = problem.VISCOSITY, problem.STIFFNESS
    return timed | found


def with_clock(task: line.Task) -> line.Task:
    """Return the task as it runs with the profiling clock on."""

    def ticking(*arguments: str) -> object:
        clock(True)
        try:
            return task(*arguments)
        finally:
            clock(False)

    return ticking


clock(False)
timed = {"forward_dynamics": lambda: forward(False), "inverse_dynamics": inverse, "run": run, "batch": batch, "fit": fit}
some = range(0, problem.RUNS, problem.EVERY)
steps = {
    f"{check}{part}accurate:{method}": partial(accurate, method, runs=runs, check=bool(check))
    for check in ("", "check:")
    for part, runs in (("", None), ("batch:", some))
    for method in INTEGRATORS
}
line.serve(
    timed
    | steps
    | {f"{name}:clock": with_clock(task) for name, task in timed.items()}
    | {"check:run": lambda: run(True), "check:forward_dynamics": lambda: forward(True), "check:batch": check_batch}
)
