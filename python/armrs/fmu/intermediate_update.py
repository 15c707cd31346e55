"""Tests of intermediate updates and early returns of FMI 3.0 (sections 2.2.10 and 4.2)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from ..errors import SlaveError
from .imported_slave import ImportedSlave
from .probe_context import ProbeContext
from .shared_library import UPDATE_3
from .slave_interface import StepResult, Variable

_UPDATE, _EARLY, _ON_REQUEST = "providesIntermediateUpdate", "mightReturnEarlyFromDoStep", "canReturnEarlyAfterIntermediateUpdate"
_MOST_STEPS = 100
"""Steps in which an early return is waited for."""
_LATE = 1e-9
"""Rounding that a time may have, relative to the step and to the time."""


@dataclass
class _Watch:
    """The importer's end of intermediate updates.

    Attributes
    ----------
    trial : Trial
    readable, settable : list of Variable
        Variables that the instance was made to give and to take meanwhile.
    early : bool
        Whether the instance was allowed to return early; then it has to, as soon as it can.
    """

    probe: ProbeContext
    readable: list[Variable]
    settable: list[Variable]
    early: bool
    slave: ImportedSlave | None = None
    begin: float = 0.0
    end: float = 0.0
    times: list[float] = field(default_factory=list)
    finished: float = -float("inf")
    asked: float | None = None

    def step(self, begin: float, size: float) -> StepResult:
        """Make a communication step."""
        assert self.slave is not None
        self.begin, self.end, self.finished, self.asked = begin, begin + size, begin, None
        return self.slave.do_step(begin, size)

    def __call__(self, _: Any, time: float, wants: bool, gives: bool, finished: bool, can_return: bool, asked: Any, at: Any) -> None:
        """Take a call of the FMU; what is wrong is a finding, because nothing can be raised through foreign code."""
        self.times.append(time)
        self._timed(time, finished=finished)
        if gives:
            self._each(self.readable, "read", lambda slave, v: slave.values(v.name))
        if wants:
            self._each(self.settable, "set", lambda slave, v: slave.set(v.name, v.start))
        if can_return and not self.early:
            self._find("it offers early return, which was not allowed at instantiation")
        elif can_return and asked and at and self.asked is None and time > self.begin:
            self.asked = at[0] = time
            asked[0] = True

    def _timed(self, time: float, *, finished: bool) -> None:
        late = _LATE * max(self.end - self.begin, abs(self.end)) + self.probe.lag
        if not self.begin - late <= time <= self.end + late:
            self._find(f"the callback is called for {time:g} s in the step from {self.begin:g} s to {self.end:g} s")
        elif time < self.finished - late:
            self._find(f"the callback is called for {time:g} s after the steps up to {self.finished:g} s were finished")
        elif finished:
            self.finished = time

    def _each(self, variables: list[Variable], word: str, do: Callable[[ImportedSlave, Variable], Any]) -> None:
        for v in variables:
            try:
                if self.slave is not None:
                    do(self.slave, v)
            except SlaveError as error:  # noqa: PERF203 (every variable is tried)
                self._find(f"{v.name} cannot be {word} in an intermediate update that allows it: {error}")

    def _find(self, text: str) -> None:
        self.probe.find(f"CoSimulation, {_UPDATE}", text, sort="intermediate")


def intermediate_update(probe: ProbeContext) -> None:
    """Make steps with a callback for intermediate updates where they are promised; compare them with steps without."""
    if probe.fmi == 2 or probe.wants_events or not probe.flag(_UPDATE):
        return
    probe.step("creating an instance with an intermediate update")
    expected = None if probe.only_once else _without(probe)
    watch = _watched(probe, early=False)
    if watch is None or watch.slave is None:
        return
    probe.begin(watch.slave)
    probe.step("doing a step with an intermediate update")
    watch.step(probe.start, probe.size)
    if not watch.times:
        probe.find(f"CoSimulation, {_UPDATE}", f"the callback is not called in a step of {probe.size:g} s", level="note")
    if expected is not None:
        probe.compare(f"CoSimulation, {_UPDATE}", expected, probe.outputs(watch.slave), "with intermediate updates")
    watch.slave.terminate()
    watch.slave.free()


def _without(probe: ProbeContext) -> dict[str, list[Any]]:
    """Return the outputs after a step without a callback."""
    slave = probe.make()
    probe.begin(slave)
    slave.do_step(probe.start, probe.size)
    found = probe.outputs(slave)
    slave.free()
    return found


def early_return(probe: ProbeContext) -> None:
    """Make an instance that may return early if it declares so, request that where it can, and continue from there."""
    if probe.fmi == 2 or probe.wants_events or not (probe.flag(_EARLY) or probe.flag(_ON_REQUEST)):
        return
    probe.step("creating an instance that may return early")
    watch = _watched(probe, early=True)
    if watch is None or watch.slave is None:
        return
    probe.begin(watch.slave)
    probe.step("doing steps that may return early")
    time = probe.start
    offered = False
    for _ in range(_MOST_STEPS):
        done = watch.step(time, probe.size)
        wrong = _wrong(probe, watch, done)
        offered |= watch.asked is not None
        if wrong is not None:
            probe.find(*wrong)
        if wrong is not None or done.terminate or done.status > 1:
            break
        time = done.last_successful_time if done.early_return else time + probe.size
        if done.early_return:
            watch.step(time, probe.size)
            break
    if probe.flag(_ON_REQUEST) and probe.flag(_UPDATE) and not offered:
        probe.find(f"CoSimulation, {_ON_REQUEST}", f"no early return is offered in {_MOST_STEPS} steps of {probe.size:g} s", level="note")
    watch.slave.terminate()
    watch.slave.free()


def _wrong(probe: ProbeContext, watch: _Watch, done: StepResult) -> tuple[str, str] | None:
    """Return place and text of what is wrong with how a step returned."""
    reached, place = done.last_successful_time, "library, DoStep"
    if done.early_return and not watch.begin < reached <= watch.end + probe.lag:
        return place, f"it returns early from the step from {watch.begin:g} s to {watch.end:g} s with lastSuccessfulTime {reached:g} s"
    if watch.asked is not None and not done.early_return and watch.asked < watch.end - probe.lag - _LATE * abs(watch.end):
        return f"CoSimulation, {_ON_REQUEST}", f"it offered early return but did not return early when requested at {watch.asked:g} s"
    if done.early_return and watch.asked is None and not probe.flag(_EARLY):
        # It was allowed to: an importer that reads the description alone would not have expected it.
        probe.find(f"CoSimulation, {_EARLY}", "is not true, but it returns early without a request", level="note")
    return None


def _watched(probe: ProbeContext, *, early: bool) -> _Watch | None:
    """Return an instance with a callback; None where it is refused."""
    marked = {e.get("name") for e in probe.description.root.iterfind("ModelVariables/*") if e.get("intermediateUpdate") in ("true", "1")}
    variables = [v for v in probe.readable() if v.name in marked]
    # The same value again leaves a step as it is.
    settable = [v for v in variables if v.causality == "input" and v.is_signal and v.start is not None]
    watch = _Watch(probe, [v for v in variables if v.causality != "input"], settable, early)
    required = [v.reference for v in (*watch.readable, *settable)]
    update = UPDATE_3(watch) if probe.flag(_UPDATE) else None
    try:
        watch.slave = probe.make(intermediate=update, early=early, required=required)
    except SlaveError as error:
        word = _ON_REQUEST if early and probe.flag(_ON_REQUEST) else _EARLY if early else _UPDATE
        probe.find(f"CoSimulation, {word}", f"an instance with {'early returns' if early else 'a callback'} is refused: {error}")
        return None
    return watch
