"""The master algorithm: steps the slaves of a system together."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ..errors import ArmrsError, BadInput, CoupledError, SlaveError, Text
from ..fmu.slave_interface import Partner, Status
from .coupled_run import RESULTS, ConnectionReport, CoupledRun
from .intermediate_outputs import IntermediateOutputs
from .slave import Slave
from .step_control import StepControl
from .system import System, family, whole_range

MOST_CREATED = 0.02
"""Largest magnitude of the energy that the coupling may have created, against the largest that went through, before a run is unstable."""
MOST_IN_STEPS = 0.1
"""The same of the magnitudes summed over steps."""
WORTH_A_WARNING = 0.005
"""Share of the energy that went through, above which a coupling that stays stable has a warning."""
_PORT_INPUTS = ("handle.F[", "robot.v[")
_LITTLE = 1e-6
"""Energy below which a share is meaningless [J]."""
_ITERATIONS = 25
"""Most steps with one Jacobian at a communication point, which each step corrects."""
LITTLE = 1e-3
"""Least change of a variable that errors are compared with, in units of its nominal value."""


def run_system(system: System, *, resolution: float = np.inf, progress: Callable[[int], None] = lambda steps: None) -> CoupledRun:
    """Run a system from zero to its duration, without an estimate of its error: `armrs.cosim.error_estimate.run_checked` has one.

    Parameters
    ----------
    system : System
    resolution : float
        Slaves make their steps in parts no longer than this [s], where they can, so that what goes on between the communication points is
        seen.
    progress : callable, optional
        Called with the number of communication steps made since the last call.

    Returns
    -------
    CoupledRun

    Raises
    ------
    CoupledError
        When the run is no result: it diverged, the coupling creates energy, or the iteration did not converge. Its attribute `run` is the
        run as far as it went, for diagnosis.
    BadInput
        When the algorithm needs a feature that a slave does not have.
    SlaveError
        When a slave refuses a call.
    """
    run = _Run(system, resolution)
    run.initialize()
    # Numbers beyond all bounds are searched for, and reported in words.
    with np.errstate(all="ignore"):
        run.steps(progress)
        result = run.result()
    if result.verdict not in RESULTS:
        error = CoupledError(f"{result.verdict}: {result.why}")
        error.run = result
        raise error
    return result


class _Failed(Exception):
    """A step that could not be made."""


class _Ended(Exception):
    """A slave requested the end of the run; the step was made as far as it goes."""


class _Run:
    """One run: what the slaves are given, what they give, and what is kept of it."""

    def __init__(self, system: System, resolution: float) -> None:
        self.system = system
        self.slaves: list[Partner] = list(system.slaves.values())
        order = {name: i for i, name in enumerate(system.slaves)}
        connections = system.connections
        self.source = np.array([order[c.source[0]] for c in connections], dtype=int)
        self.target = np.array([order[c.target[0]] for c in connections], dtype=int)
        self.factor = np.array([c.factor for c in connections])
        self.offset = np.array([c.offset for c in connections])
        variables = [system.slaves[c.target[0]].variable(c.target[1]) for c in connections]
        self.nominal = np.array([abs(v.nominal) or 1.0 for v in variables])
        self.within = np.array([c.within for c in connections])
        self.into = [np.flatnonzero(self.target == i) for i in range(len(self.slaves))]
        self.out_of = [np.flatnonzero(self.source == i) for i in range(len(self.slaves))]
        self.between = IntermediateOutputs(self.out_of, [len(places) > 0 for places in self.into], len(connections), resolution)
        self.input_names = [[connections[k].target[1] for k in places] for places in self.into]
        self.ranges = [self._ranges(i, places) for i, places in enumerate(self.into)]
        self.output_names = [[connections[k].source[1] for k in places] for places in self.out_of]
        self.dual_of = [k for k, c in enumerate(connections) if c.dual is not None]
        # What goes back from a later slave to an earlier one, or to itself: only there the iteration has something to find.
        self.torn = np.flatnonzero((self.source >= self.target) & (self.within != "start"))
        self.y, self.raw = np.zeros(len(connections)), np.zeros(len(connections))
        self.before, self.last = self.y.copy(), 0.0
        self.span = LITTLE * self.nominal
        self.jacobian: np.ndarray | None = None
        self.evaluations = 0
        self.times: list[float] = []
        self.rows: list[np.ndarray] = []
        self.duals: list[np.ndarray] = []
        self.outputs: list[np.ndarray] = []
        self.used: list[np.ndarray] = []
        self.stopped: tuple[str, str] | None = None
        self.recorded = [
            [name for v in s.variables.values() if v.causality == "output" and family(v) is not None for name in v.elements]
            for s in self.slaves
        ]
        self._check()

    def _check(self) -> None:
        system = self.system
        steps = system.duration / system.step
        whole = abs(steps - round(steps)) < 1e-6
        for slave in self.slaves:
            if not (slave.can_vary_step or whole):
                allowed = f"a whole number of steps of {system.step:g} s, for {slave.name} cannot vary its step"
                raise BadInput("[system], duration_s", system.duration, allowed)
        if system.algorithm != "iterated" or not len(self.torn):
            return
        for slave in self.slaves[self._loop]:
            if not slave.can_rollback:
                found = Text(f"iterated, and {slave.name} does not support rollback (canGetAndSetFMUState is not true)")
                raise BadInput("[system], algorithm", found, "jacobi or gauss-seidel, or a partner that can")

    @property
    def _loop(self) -> slice:
        """The slaves that take part in the iteration."""
        return slice(int(self.target[self.torn].min()), int(self.source[self.torn].max()) + 1)

    def initialize(self) -> None:
        """Set start values, exchange outputs in initialization mode until all have what they need, and begin."""
        system = self.system
        for slave in self.slaves:
            given = system.starts.get(slave.name, {})
            try:
                if given:
                    slave.set(list(given), list(given.values()))
                slave.enter_initialization_mode(0.0, system.duration)
            except SlaveError as error:
                raise _refused_start(slave, given, error) from None
        for _ in self.slaves:
            for i in range(len(self.slaves)):
                self._give(i, self.y)
                self._take(i)
        for slave in self.slaves:
            try:
                slave.exit_initialization_mode()
            except SlaveError as error:  # noqa: PERF203 (each slave is named)
                raise _refused_start(slave, system.starts.get(slave.name, {}), error) from None
        for i in range(len(self.slaves)):
            self._take(i)
        self.before = self.y.copy()
        self._record(0.0)

    def steps(self, progress: Callable[[int], None]) -> None:
        """Make every step, or stop where one cannot be made."""
        pace = StepControl(self.system)
        while (end := pace.end) is not None:
            begin, start, raw = pace.begin, self.y.copy(), self.raw.copy()
            kept = self._keep() if pace.repeats else None
            self._step(begin, end)
            error = np.inf if self.stopped else self._error(start, end - begin)
            if kept is not None and self._verdict != "failed":
                again = self._verdict != "ended" and pace.shorten(error)
                self._let_go(kept, back=again)
                if again:
                    continue
            if self._verdict not in ("", "not converged"):
                return
            self.before, self.last = start, end - begin
            self.between.end(raw, end, self.raw)
            self._record(end)
            if self.stopped is not None:
                return
            progress(pace.go_on(error))
        try:
            self._terminate()
        except (SlaveError, _Failed) as error:
            # Every step was made: what was recorded stands.
            self.stopped = ("failed", f"after the last step: {error}")

    def _step(self, begin: float, end: float) -> None:
        """Make a step, or raise why it cannot be made."""
        make = {"jacobi": self._jacobi, "gauss-seidel": self._gauss_seidel, "iterated": self._iterated}[self.system.algorithm]
        try:
            used = make(begin, end - begin)
        except _Failed as failed:
            self.stopped = ("diverged", str(failed))
        except _Ended as ended:
            self.stopped = ("ended", str(ended))
        except SlaveError as error:
            self.stopped = ("failed", str(error))
        else:
            if np.isfinite(self.y).all():
                self.used.append(used)
                return
            bad = self.system.connections[int(np.flatnonzero(~np.isfinite(self.y))[0])].label
            self.stopped = ("diverged", f"{bad} is not finite at {end:.6g} s")

    def _error(self, start: np.ndarray, step: float) -> float:
        """Return the largest error of what was held in the last step, in units of what is allowed."""
        if self.system.shortest_step is None or not len(start):
            return 0.0
        bend = self.y - start - (start - self.before) * (step / (self.last or step))
        held = np.where(self.within == "start", 0.0, self.used[-1] - 0.5 * (start + self.y))
        self.span = np.maximum(self.span, np.abs(self.y - self.rows[0]))
        # What bends leaves an eighth of its second difference between its ends.
        off = np.maximum(np.abs(bend) / 8.0, np.abs(held)) / (self.system.accuracy * self.span)
        return float(np.max(off))

    @property
    def _verdict(self) -> str:
        """Verdict of a run that stopped; nothing while it goes on."""
        return "" if self.stopped is None else self.stopped[0]

    def _keep(self) -> tuple[list[Any], tuple[np.ndarray, ...], np.ndarray | None]:
        arrays = (self.y.copy(), self.raw.copy(), self.span.copy())
        return [slave.get_state() for slave in self.slaves], arrays, self.jacobian

    def _let_go(self, kept: tuple[list[Any], tuple[np.ndarray, ...], np.ndarray | None], *, back: bool) -> None:
        """Free what was kept of the beginning of a step, after going back to it or not."""
        states, arrays, jacobian = kept
        if back:
            # A row of `used` for each step that was made, one less than of times.
            del self.used[len(self.times) - 1 :]
            self.stopped, self.jacobian = None, jacobian
            self.y, self.raw, self.span = arrays
        for slave, state in zip(self.slaves, states, strict=True):
            if back:
                slave.set_state(state)
            slave.free_state(state)

    def _terminate(self) -> None:
        i = 0
        try:
            for i in range(len(self.slaves)):
                self.slaves[i].terminate()
        except SlaveError as error:
            raise self._not_done(i, error) from None

    # ---- algorithms: each returns what the inputs were held at
    def _jacobi(self, time: float, step: float) -> np.ndarray:
        used = self.y.copy()
        for i in range(len(self.slaves)):
            self._give(i, used)
            self._advance(i, time, step)
        for i in range(len(self.slaves)):
            self._take(i)
        return used

    def _gauss_seidel(self, time: float, step: float) -> np.ndarray:
        start = self.y.copy()
        used = start.copy()
        self._sweep(range(len(self.slaves)), (start, used), (time, step))
        return used

    def _iterated(self, time: float, step: float) -> np.ndarray:
        start = self.y.copy()
        used = start.copy()
        loop = range(len(self.slaves))[self._loop] if len(self.torn) else range(0)
        self._sweep(range(loop.start), (start, used), (time, step))
        states = [self.slaves[i].get_state() for i in loop]
        fresh = True

        def residual(guess: np.ndarray) -> np.ndarray:
            """Make the step with assumed inputs at its end, and return the inputs that result less the assumed ones."""
            nonlocal fresh
            if not fresh:
                for i, state in zip(loop, states, strict=True):
                    self.slaves[i].set_state(state)
            fresh = False
            self.y[self.torn] = guess
            self._sweep(loop, (start, used), (time, step))
            left: np.ndarray = self.y[self.torn] - guess
            return left

        try:
            if len(self.torn):
                ratio = step / self.last if self.system.varies and self.last else 1.0
                self._solve(residual, (1.0 + ratio) * start[self.torn] - ratio * self.before[self.torn], time)
        finally:
            for i, state in zip(loop, states, strict=True):
                self.slaves[i].free_state(state)
        self._sweep(range(loop.stop, len(self.slaves)), (start, used), (time, step))
        return used

    def _sweep(self, slaves: range, values: tuple[np.ndarray, np.ndarray], span: tuple[float, float]) -> None:
        """Step slaves one after the other, each with what those before it give at the end of the step."""
        start, used = values
        for i in slaves:
            held = {"start": start, "mean": 0.5 * (start + self.y), "end": self.y}
            for k in self.into[i]:
                used[k] = held[str(self.within[k])][k]
            self._give(i, used)
            self._advance(i, *span)
            self._take(i)

    def _solve(self, residual: Callable[[np.ndarray], np.ndarray], guess: np.ndarray, time: float) -> None:
        """Find the outputs at the end of a step by Newton's method; the Jacobian is kept from step to step after Broyden (1965)."""
        nominal = self.nominal[self.torn]

        def done(r: np.ndarray, z: np.ndarray) -> bool:
            return bool(np.all(np.abs(r) <= self.system.tolerance * np.maximum(nominal, np.abs(z))))

        r = residual(guess)
        for attempt in range(2):
            if done(r, guess):
                return
            if self.jacobian is None or attempt:
                self.jacobian = _differences(residual, guess, r, 1e-4 * np.maximum(nominal, np.abs(guess)))
                r = residual(guess)
            for _ in range(_ITERATIONS):
                if not (np.isfinite(self.jacobian).all() and np.isfinite(r).all()):
                    break
                change = np.linalg.lstsq(self.jacobian, -r, rcond=None)[0]
                if not np.isfinite(change).all() or not change.any():
                    break
                guess = guess + change
                new = residual(guess)
                self.jacobian = self.jacobian + np.outer(new - r - self.jacobian @ change, change) / (change @ change)
                r = new
                if done(r, guess):
                    return
        worst = int(np.argmax(np.abs(r) / nominal))
        label = self.system.connections[int(self.torn[worst])].label
        self.stopped = ("not converged", f"at {time:.6g} s the iteration leaves {abs(r[worst]):.3g} in {label}")

    # ---- one slave
    def _ranges(self, i: int, places: np.ndarray) -> list[tuple[int, int, int]]:
        """Return the integer inputs of a slave: connection, smallest and largest value."""
        kinds = [(int(k), self.slaves[i].variable(name).type) for k, name in zip(places, self.input_names[i], strict=True)]
        return [(k, *whole_range(kind)) for k, kind in kinds if kind.startswith(("Int", "UInt"))]

    def _give(self, i: int, values: np.ndarray) -> None:
        for k, least, most in self.ranges[i]:
            if not least <= values[k] <= most:
                text = f"{self.system.connections[k].label}: {values[k]:.0f}, allowed is an integer from {least} to {most}"
                raise SlaveError("set", Status.ERROR, text)
        if self.input_names[i]:
            try:
                self.slaves[i].set(self.input_names[i], values[self.into[i]])
            except SlaveError as error:
                raise self._not_done(i, error) from None

    def _take(self, i: int) -> None:
        if self.output_names[i]:
            places = self.out_of[i]
            self.raw[places] = self.slaves[i].get(self.output_names[i])
            self.y[places] = self.factor[places] * self.raw[places] + self.offset[places]

    def _advance(self, i: int, time: float, step: float) -> None:
        n = self.between.begin(i, self.slaves[i], step) if self.output_names[i] else 1
        self.evaluations += n
        for k in range(n):
            self._make(i, time + k * (step / n), step / n)
            if k + 1 < n:
                self.between.see(i, time + (k + 1) * (step / n), self.slaves[i].get(self.output_names[i]))

    def _make(self, i: int, time: float, step: float) -> None:
        try:
            done = self.slaves[i].do_step(time, step)
        except SlaveError as error:
            # Of a partner in another process an input that is discarded comes to light here.
            raise self._not_done(i, error) from None
        if done.terminate:
            raise _Ended(f"{self.slaves[i].name} requests the end of the run in the step from {time:.6g} s; the samples end there")
        if done.status == Status.DISCARD:
            reached = f", after reaching {done.last_successful_time:.6g} s" if done.last_successful_time > time else ""
            raise _Failed(f"{self.slaves[i].name} discards the step from {time:.6g} s{reached}: {done.message}")

    def _not_done(self, i: int, error: SlaveError) -> Exception:
        """Name the slave of a call that it did not do."""
        text = f"{self.slaves[i].name}: {error.message}"
        return _Failed(text) if error.status == Status.DISCARD else SlaveError(error.function, error.status, text)

    # ---- what is kept
    def _record(self, time: float) -> None:
        self.times.append(time)
        self.rows.append(self.y.copy())
        connections = self.system.connections
        self.duals.append(
            np.array([self.slaves[self.target[k]].get(str(connections[k].dual))[0] for k in self.dual_of] if self.dual_of else [])
        )
        self.outputs.append(np.concatenate([s.get(names) for s, names in zip(self.slaves, self.recorded, strict=True)]))

    def result(self) -> CoupledRun:
        """Return the run with its verdict."""
        n, count = len(self.used), len(self.system.connections)
        t = np.array(self.times)
        y, used = np.array(self.rows).reshape(len(self.rows), count), np.array(self.used).reshape(n, count)
        t, y = t[: n + 1], y[: n + 1]
        step = np.diff(t)[:, None]
        mean = 0.5 * (y[1:] + y[:-1])
        iterated = self.system.algorithm == "iterated"
        should = {"start": mean, "mean": mean, "end": y[1:] if iterated else mean}
        residual = np.stack([used[:, k] - should[str(w)][:, k] for k, w in enumerate(self.within)], axis=1) if count else used
        created = np.full((n + 1, count), np.nan)
        exchanged = np.full((n + 1, count), np.nan)
        duals = np.array(self.duals)[: n + 1]
        for j, k in enumerate(self.dual_of):
            dual = self.system.connections[k].sign * 0.5 * (duals[1:, j] + duals[:-1, j]) * step[:, 0]
            created[:, k] = np.append(0.0, np.cumsum((used[:, k] - mean[:, k]) * dual))
            exchanged[:, k] = np.append(0.0, np.cumsum(mean[:, k] * dual))
        outputs = np.array(self.outputs)[: n + 1]
        self.between.close()
        sources = [".".join(c.source) for c in self.system.connections]
        verdict, why, warnings = self._judge(created, exchanged, outputs)
        names = [f"{s.name}.{name}" for s, listing in zip(self.slaves, self.recorded, strict=True) for name in listing]
        return CoupledRun(
            system=self.system,
            verdict=verdict,
            why=why,
            t=t,
            columns={name: outputs[:, j] for j, name in enumerate(names)},
            used=used,
            residual=residual,
            created=created,
            connections=tuple(self._report(k, residual, created, exchanged) for k in range(count)),
            evaluations=self.evaluations / max(n, 1),
            warnings=(*self.system.warnings, *warnings),
            beyond={s: (size, at) for s, size, at in zip(sources, *self.between.beyond.tolist(), strict=True) if size > 0.0},
            jumps={s: found for s, found in zip(sources, self.between.jumps, strict=True) if found},
            resolution=self.between.longest or None,
        )

    def _judge(self, created: np.ndarray, exchanged: np.ndarray, outputs: np.ndarray) -> tuple[str, str, list[str]]:
        if self.stopped is not None:
            return *self.stopped, []
        if not self.dual_of:
            why = "no energy balance: no connection has a dual variable"
            return "stable", why, [why] if self.system.connections else []
        warnings = []
        for i in dict.fromkeys(self.target[self.dual_of].tolist()):
            # Inputs of one slave are checked together: y and z of one handle.
            places = [k for k in self.dual_of if self.target[k] == i]
            made, went = (np.nansum(energy[:, places], axis=1) for energy in (created, exchanged))
            most, through = float(np.max(np.abs(made))), max(float(np.max(np.abs(went))), _LITTLE)
            steps_made, steps_went = (float(np.sum(np.abs(np.diff(energy)))) for energy in (made, went))
            text = f"the coupling creates {most:.3g} J at {self.slaves[i].name}, where {through:.3g} J are transferred"
            # A coupling far beyond its limit has energy errors of both signs: then the sum of their sizes over steps counts.
            if most > MOST_CREATED * through or steps_made > MOST_IN_STEPS * max(steps_went, _LITTLE):
                return "unstable", f"{text}; take {self._stabler(i)}", []
            if most > WORTH_A_WARNING * through:
                warnings.append(text)
            inside = self._received(i, outputs)
            if inside is None:
                continue
            # The arm integrates what it received between the communication points, at any hold.
            places = [k for k in places if self._input(k).startswith(_PORT_INPUTS)]
            went = np.nansum(exchanged[:, places], axis=1)
            off, through = float(np.max(np.abs(inside - went))), max(float(np.max(np.abs(inside))), _LITTLE)
            differs = f"the work of its partners at the communication points differs by {off:.3g} J"
            text = f"{self.slaves[i].name} receives {through:.3g} J through its port; {differs}"
            if off > MOST_CREATED * through:
                return "not resolved", f"{text}; take a shorter step", []
            if off > WORTH_A_WARNING * through:
                warnings.append(text)
        return "stable", "the energy that the coupling creates is small", warnings

    def _stabler(self, i: int) -> str:
        """Return remedies against energy created by the coupling at a slave, of those that the partners support."""
        found = ["a shorter step"]
        iterating = [self.slaves[k] for k in range(len(self.slaves))[self._loop]] if len(self.torn) else []
        stuck = [slave.name for slave in iterating if not slave.can_rollback]
        if iterating and not stuck and self.system.algorithm != "iterated":
            found.append("the iterated algorithm")
        slave, givers = self.slaves[i], {int(self.source[k]) for k in self.into[i]}
        # An arm that pushes has its contact inside already.
        if isinstance(slave, Slave) and slave.port == "force" and not any(isinstance(self.slaves[k], Slave) for k in givers):
            found.append(f"the motion port of {slave.name} for a contact that is a spring and a damper")
        listing = " or ".join([", ".join(found[:-1]), found[-1]]) if len(found) > 1 else found[0]
        cannot = f" (no iteration is possible: no rollback in {' and '.join(stuck)})" if stuck else ""
        return f"{listing}{cannot}"

    def _input(self, k: int) -> str:
        """Name of the input at the end of a connection."""
        return self.system.connections[k].target[1]

    def _received(self, i: int, outputs: np.ndarray) -> np.ndarray | None:
        """Work through the port of an arm since the start [J], where all of the port is connected; None for other slaves."""
        port = {name for name in self.slaves[i].variables if name.startswith(_PORT_INPUTS)}
        given = {self._input(k) for k in self.dual_of if self.target[k] == i}
        if "work.port" not in self.recorded[i] or not port or not port <= given:
            return None
        at = sum(len(listing) for listing in self.recorded[:i]) + self.recorded[i].index("work.port")
        work: np.ndarray = outputs[:, at] - outputs[0, at]
        return work

    def _report(self, k: int, residual: np.ndarray, created: np.ndarray, exchanged: np.ndarray) -> ConnectionReport:
        connection = self.system.connections[k]
        off = residual[:, k] if len(residual) else np.zeros(1)
        has_dual = connection.dual is not None
        return ConnectionReport(
            connection=connection,
            unit=self.system.slaves[connection.target[0]].variable(connection.target[1]).unit or "",
            residual_max=float(np.max(np.abs(off))),
            residual_rms=float(np.sqrt(np.mean(off**2))),
            energy_exchanged=float(np.max(np.abs(exchanged[:, k]))) if has_dual else None,
            energy_created=float(created[-1, k]) + 0.0 if has_dual else None,
        )


def _refused_start(slave: Partner, given: Mapping[str, Any], error: SlaveError) -> ArmrsError:
    """Name the slave of a refusal before the first step: the start values of a system are an input."""
    if error.status == Status.FATAL or not given:
        return SlaveError(error.function, error.status, f"{slave.name}: {error.message}")
    return BadInput(f"{slave.name}, [slave.start]", Text(error.message), "values that the slave accepts")


def _differences(residual: Callable[[np.ndarray], np.ndarray], at: np.ndarray, r: np.ndarray, by: np.ndarray) -> np.ndarray:
    """Return the Jacobian of a residual by forward differences."""
    columns: list[Any] = []
    for k, size in enumerate(by):
        moved = at.copy()
        moved[k] += size
        columns.append((residual(moved) - r) / size)
    return np.array(columns).T
