"""What is measured, and what is aimed at."""

from __future__ import annotations

from dataclasses import dataclass

import problem

STEPS = round(problem.LONG / problem.STEP)
BATCH_STEPS = problem.RUNS * round(problem.SHORT / problem.STEP)
MOST = problem.SIZES[-1]


@dataclass(frozen=True)
class Measured:
    """One time of one tool."""

    workload: str
    tool: str
    task: str
    name: str = ""
    units: float = 1.0
    slow: bool = False
    ladder: tuple[str, ...] = ()
    """Steps from one sample to the next, or tolerances, of which the first that is right is measured; the task ends with it."""

    @property
    def key(self) -> str:
        """Return how results name it."""
        return f"{self.task}/{self.tool}"


def _kernels() -> list[Measured]:
    callers = (
        "armrs, Rust",
        "limit",
        "limit, nothing fused",
        "Pinocchio, C++",
        "MuJoCo, C",
        "armrs, Python",
        "Pinocchio, Python",
        "MuJoCo, Python",
        "numba",
    )
    once = [Measured("W1", tool, kernel) for kernel in ("inverse_dynamics", "forward_dynamics") for tool in callers]
    clock = [
        Measured("W1", "MuJoCo, Python", f"{kernel}:clock", "profiling clock on") for kernel in ("inverse_dynamics", "forward_dynamics")
    ]
    lanes = [
        Measured("W1", "armrs, Rust", f"{kernel}:lanes", "eight states side by side") for kernel in ("inverse_dynamics", "forward_dynamics")
    ]
    batch = [
        Measured("W1", "armrs, Python", f"{kernel}:batch", "100 000 states a call") for kernel in ("inverse_dynamics", "forward_dynamics")
    ]
    return once + clock + lanes + batch


def _each(workload: str, units: float, rows: list[tuple[str, str, str]], slow: bool = False) -> list[Measured]:
    return [Measured(workload, tool, task, name, units, slow) for tool, task, name in rows]


def _runs() -> list[Measured]:
    rows = [
        ("limit", "run", "one loop, the handle's path computed in every step"),
        ("limit", "run:table", "one loop, the path from a table"),
        ("limit, nothing fused", "run", "one loop, the handle's path computed in every step"),
        ("limit, nothing fused", "run:table", "one loop, the path from a table"),
        ("armrs, Rust", "run", "angles and speeds recorded at 50 Hz"),
        ("armrs, Rust", "run:all", "all 61 columns recorded at 50 Hz"),
        ("armrs, Rust", "run:ends", "first and last sample only"),
        ("armrs, Rust", "run:fourth", "fourth order, angles and speeds recorded at 50 Hz"),
        ("armrs, Python", "run", "armrs.simulate, all 61 columns recorded at 50 Hz"),
        ("numba", "run", "a loop compiled from Python, 50 Hz"),
        ("Pinocchio, C++", "run", "aba, path from a table"),
        ("MuJoCo, C", "run", "mj_step, path from a table"),
        ("MuJoCo, Python", "run", "rollout, profiling clock off"),
        ("MuJoCo, Python", "run:clock", "rollout, profiling clock on"),
    ]
    return _each("W2", STEPS, rows)


def _batches() -> list[Measured]:
    rows = [
        ("limit", "batch:scalar", "one run after another"),
        ("limit", "batch:avx2", "four runs in a register"),
        ("limit", "batch:avx512", "eight runs in a register or two"),
        ("limit, nothing fused", "batch:avx2", "four runs in a register"),
        ("armrs, Rust", "batch", "simulate_batch, one thread"),
        ("armrs, Rust", "batch:all", "simulate_batch, one thread, the equilibrium at the start found and all 61 columns recorded"),
        ("armrs, Rust", "batch:wall:1", "simulate_batch, one thread, wall clock"),
        ("armrs, Rust", "batch:wall:2", "simulate_batch, two threads, wall clock"),
        ("MuJoCo, Python", "batch", "rollout of 20 of the runs, profiling clock off"),
        ("MuJoCo, Python", "batch:clock", "rollout of 20 of the runs, profiling clock on"),
    ]
    return _each("W3", BATCH_STEPS, rows, slow=True)


def _ladder(*substeps: int) -> tuple[str, ...]:
    return tuple(str(n) for n in substeps)


EULER = ("80",)
"""Semi-implicit Euler as in W2 and W3, at 0.25 ms, whatever its error."""
COARSE = _ladder(*range(2, 17), *range(18, 41, 2))
"""From 10 ms to 0.5 ms, for methods of second and fourth order."""
FINEST = _ladder(*(80 * n for n in (16, 32, 48, 56, 60, 64, 72)))
"""Down to 3.5 µs, for semi-implicit Euler in the movements of W3."""
FINE = _ladder(*range(40, 161, 4))
"""From 0.5 ms to 0.125 ms, for methods of first order."""
FOUND = ("1e-6",)
"""The accuracy itself [rad]."""
TOLERANCES = tuple(f"{digit}e-{power}" for power in range(4, 11) for digit in (5, 2, 1))
"""Relative, and absolute [rad, rad/s]."""


def _accurate() -> list[Measured]:
    rows = [
        ("limit", "accurate:euler", "semi-implicit Euler at 0.25 ms", EULER),
        ("limit", "accurate:rk4", "fourth order", COARSE),
        ("limit", "accurate:rk4_table", "fourth order, the path from a table", COARSE),
        ("armrs, Rust", "accurate", "fourth order", COARSE),
        ("armrs, Rust", "accurate:found", "the step found by comparing runs, included", FOUND),
        ("armrs, Python", "accurate", "armrs.simulate, fourth order", COARSE),
        ("armrs, Python", "accurate:found", "armrs.simulate, the step found by comparing runs, included", FOUND),
        ("numba", "accurate:rk4", "fourth order", COARSE),
        ("numba", "accurate:dop853", "SciPy's DOP853", TOLERANCES),
        ("numba", "accurate:lsoda", "SciPy's LSODA (odeint)", TOLERANCES),
        ("Pinocchio, C++", "accurate:rk4", "fourth order, path from a table", COARSE),
        ("MuJoCo, C", "accurate:rk4", "RK4, path from a table in every stage", COARSE),
        ("MuJoCo, C", "accurate:implicitfast", "implicitfast, path from a table", FINE),
        ("MuJoCo, Python", "accurate:rk4", "rollout, RK4, path held over a step", COARSE),
        ("MuJoCo, Python", "accurate:implicitfast", "rollout, implicitfast, path held over a step", FINE),
    ]
    batch = [
        ("limit", "batch:accurate:euler", "semi-implicit Euler at 0.25 ms, four runs in a register", EULER),
        ("limit", "batch:accurate:fine", "semi-implicit Euler, four runs in a register", FINEST),
        ("limit", "batch:accurate:rk4_scalar", "fourth order, one run after another", COARSE),
        ("limit", "batch:accurate:rk4_avx2", "fourth order, four runs in a register", COARSE),
        ("limit", "batch:accurate:rk4_avx512", "fourth order, eight runs in a register or two", COARSE),
        ("armrs, Rust", "batch:accurate", "simulate_batch, fourth order, one thread", COARSE),
        ("armrs, Rust", "batch:accurate:found", "simulate_accurately, one thread", FOUND),
        ("MuJoCo, Python", "batch:accurate:rk4", "rollout of 20 of the runs, RK4, path held over a step", COARSE),
    ]
    single = [Measured("W2a", tool, task, name, ladder=ladder) for tool, task, name, ladder in rows]
    return single + [Measured("W3a", tool, task, name, slow=True, ladder=ladder) for tool, task, name, ladder in batch]


def _cascades() -> list[Measured]:
    found = []
    for size in problem.SIZES:
        slow = size == MOST
        found += [
            Measured("W4", "limit", f"gram:scalar:{size}", "one pass over the data, scalar"),
            Measured("W4", "limit", f"gram:avx2:{size}", "one pass over the data, AVX2"),
            Measured("W4", "armrs, Rust", f"cascade:{size}", "the whole cascade"),
            Measured("W4", "SciPy", f"cascade:lsq_linear:{size}", "lsq_linear, bvls", slow=slow),
            Measured("W4", "SciPy", f"cascade:least_squares:{size}", "least_squares, 2-point", slow=slow),
        ]
    return found


JOINTS = tuple(range(1, 7))
GROUPS = (1, 8, 64, 512)
"""Runs of the batches whose cost is plotted."""


def _sizes() -> list[Measured]:
    joints = [Measured("joints", "armrs, Rust", f"forward_dynamics:joints:{n}") for n in JOINTS]
    return joints + [Measured("runs", "armrs, Rust", f"batch:runs:{n}", units=n * BATCH_STEPS / problem.RUNS) for n in GROUPS]


MEASURED = [
    *_kernels(),
    *_runs(),
    *_batches(),
    *_accurate(),
    *_cascades(),
    *_sizes(),
    Measured("W6", "armrs, Python", "fit", "armrs.fit_by_simulation"),
    Measured("W6", "numba", "fit", "with SciPy least_squares", slow=True),
    Measured("W6", "MuJoCo, Python", "fit", "rollout with SciPy least_squares, profiling clock off", slow=True),
    Measured("W6", "MuJoCo, Python", "fit:clock", "rollout with SciPy least_squares, profiling clock on", slow=True),
]
"""Every measurement but those of imports."""


@dataclass(frozen=True)
class Goal:
    """One time over another, or beyond another, or alone; and what it should be."""

    line: int
    what: str
    over: str
    under: str | None
    limit: float
    at_most: bool
    beyond: str | None = None
    unfused: str | None = None
    """Key of the hand-written loop without fused operations, which replaces the numerator: armrs promises equal bits and cannot fuse."""

    def judge(self, medians: dict[str, float]) -> dict[str, object]:
        """Return the goal with what was found; None where a tool is missing."""
        value = unfused = None
        if all(key in medians for key in (self.over, self.under, self.beyond) if key):
            value = (medians[self.over] - (medians[self.beyond] if self.beyond else 0.0)) / (medians[self.under] if self.under else 1.0)
        if self.unfused in medians and self.under in medians:
            unfused = medians[self.unfused] / medians[self.under]
        met = None if value is None else (value <= self.limit if self.at_most else value >= self.limit)
        return {
            "line": self.line,
            "what": self.what,
            "found": value,
            "unfused": unfused,
            "limit": self.limit,
            "at_most": self.at_most,
            "met": met,
        }


def _most(line: int, what: str, over: str, under: str | None, limit: float, unfused: str | None = None) -> Goal:
    return Goal(line, what, over, under, limit, True, unfused=unfused and f"{unfused}/limit, nothing fused")


def _least(line: int, what: str, over: str, under: str, limit: float) -> Goal:
    return Goal(line, what, over, under, limit, False)


GOALS = [
    _most(1, "single run: armrs / limit", "run/armrs, Rust", "run/limit", 1.5, "run"),
    _most(1, "single run: armrs / limit with the path from a table", "run/armrs, Rust", "run:table/limit", 1.5, "run"),
    _least(1, "single run: MuJoCo from C / armrs", "run/MuJoCo, C", "run/armrs, Rust", 12),
    _least(1, "single run: Pinocchio from C++ / armrs", "run/Pinocchio, C++", "run/armrs, Rust", 12),
    _most(1, "single run from Python, 50 Hz: armrs / numba", "run/armrs, Python", "run/numba", 0.8, "run"),
    _least(1, "single run from Python: MuJoCo's rollout / armrs", "run/MuJoCo, Python", "run/armrs, Python", 10),
    _most(2, "batch: armrs / limit with AVX2", "batch/armrs, Rust", "batch:avx2/limit", 1.5, "batch:avx2"),
    _least(2, "batch: MuJoCo's rollout / armrs", "batch/MuJoCo, Python", "batch/armrs, Rust", 80),
    _least(2, "batch: one thread / two threads, wall clock", "batch:wall:1/armrs, Rust", "batch:wall:2/armrs, Rust", 1.7),
    _most(2, "single run right to 1e-6 rad: armrs / limit by Euler at 0.25 ms", "accurate/armrs, Rust", "accurate:euler/limit", 0.3),
    _most(2, "batch right to 1e-6 rad: armrs / limit by Euler", "batch:accurate/armrs, Rust", "batch:accurate:fine/limit", 0.3),
    _most(3, "inverse dynamics: armrs / limit", "inverse_dynamics/armrs, Rust", "inverse_dynamics/limit", 2, "inverse_dynamics"),
    _most(3, "forward dynamics: armrs / limit", "forward_dynamics/armrs, Rust", "forward_dynamics/limit", 1.5, "forward_dynamics"),
    _most(
        3,
        "inverse dynamics, a call from Python: armrs / Pinocchio",
        "inverse_dynamics/armrs, Python",
        "inverse_dynamics/Pinocchio, Python",
        1,
    ),
    _most(
        3,
        "forward dynamics, a call from Python: armrs / Pinocchio",
        "forward_dynamics/armrs, Python",
        "forward_dynamics/Pinocchio, Python",
        1,
    ),
    _least(
        3,
        "inverse dynamics from Python: Pinocchio / armrs in a batch",
        "inverse_dynamics/Pinocchio, Python",
        "inverse_dynamics:batch/armrs, Python",
        30,
    ),
    _least(
        3,
        "forward dynamics from Python: Pinocchio / armrs in a batch",
        "forward_dynamics/Pinocchio, Python",
        "forward_dynamics:batch/armrs, Python",
        30,
    ),
    _least(4, "cascade of a million samples: lsq_linear / armrs", f"cascade:lsq_linear:{MOST}/SciPy", f"cascade:{MOST}/armrs, Rust", 40),
    _least(
        4, "cascade of a million samples: least_squares / armrs", f"cascade:least_squares:{MOST}/SciPy", f"cascade:{MOST}/armrs, Rust", 100
    ),
    _most(4, "cascade of a million samples: armrs / one AVX2 pass", f"cascade:{MOST}/armrs, Rust", f"gram:avx2:{MOST}/limit", 4),
    _most(5, "fit by simulation: armrs [s]", "fit/armrs, Python", None, 0.15),
    _least(5, "fit by simulation: MuJoCo with SciPy / armrs", "fit/MuJoCo, Python", "fit/armrs, Python", 30),
    Goal(6, "import armrs beyond import numpy [s]", "import/armrs", None, 0.010, True, beyond="import/numpy"),
]
