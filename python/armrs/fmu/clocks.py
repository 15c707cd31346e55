"""Clocks of FMI 3.0 (sections 2.2.8 and 2.4): rules for their descriptions, and tests of the library.

Clocks tick in the event mode of co-simulation and Model Exchange, and activate the partitions of a model in scheduled execution.
"""

from __future__ import annotations

import ctypes
import itertools
import math
from collections.abc import Callable, Iterator
from ctypes import byref, c_bool, c_double, c_int, c_size_t
from dataclasses import dataclass, field

from ..errors import SlaveError
from . import variable_access
from .description import Description, finite
from .imported_slave import ImportedSlave
from .probe_context import ProbeContext
from .shared_library import UPDATE_CLOCKS_3

Broken = tuple[str, str]
Call = Callable[..., None]
"""Calls a function of the standard on an instance, named without its prefix; raises `SlaveError`."""

_PERIODIC = ("constant", "fixed", "tunable")
_CHANGED = 2
_MOST_TICKS = 100
_SHORTEST = 1e-9
"""Intervals below this are no period [s]."""


@dataclass(frozen=True)
class Clock:
    """A clock of a description.

    Attributes
    ----------
    name : str
    reference : int
    causality : str
    kind : str
        Its `intervalVariability`.
    interval, shift : float, optional
        Interval and first tick [s] as the description has them.
    priority : str, optional
    """

    name: str
    reference: int
    causality: str
    kind: str
    interval: float | None
    shift: float | None
    priority: str | None

    @property
    def set_by_library(self) -> bool:
        """Whether only the library has the interval."""
        return self.kind in ("changing", "countdown") or (self.kind in _PERIODIC and self.interval is None)


def clocks(description: Description) -> list[Clock]:
    """Return the clocks of a description; attributes that a variable lacks may be in its declared type."""
    types = {t.get("name"): t for t in description.root.iterfind("TypeDefinitions/ClockType")}
    found = []
    for element in description.root.iterfind("ModelVariables/Clock"):
        declared = types.get(element.get("declaredType"))
        said = {**({} if declared is None else declared.attrib), **element.attrib}
        reference = said.get("valueReference", "").strip()
        found.append(
            Clock(
                said.get("name", ""),
                int(reference) if reference.isdigit() else -1,
                said.get("causality", "local"),
                said.get("intervalVariability", ""),
                _time(said, "interval"),
                _time(said, "shift"),
                said.get("priority"),
            )
        )
    return found


def _time(said: dict[str, str], word: str) -> float | None:
    """Return an interval or a shift [s], given as a number or as a fraction."""
    counter, resolution = finite(said.get(f"{word}Counter")), finite(said.get("resolution"))
    return finite(said.get(f"{word}Decimal")) if counter is None or not resolution else counter / resolution


def broken(description: Description) -> Iterator[Broken]:
    """Give every rule that the clocks of a description break."""
    known = clocks(description)
    for clock in known:
        place = f"clock {clock.name}"
        if clock.kind != "triggered" and clock.causality != "input":
            yield place, f"causality {clock.causality} of a time-based clock, allowed is input"
        if clock.kind == "constant" and clock.interval is None:
            yield place, "no interval, which a constant clock requires"
        if clock.interval is not None and not clock.interval > 0.0:
            yield place, f"interval {clock.interval:g} s, allowed is a positive number"
        if clock.shift is not None and clock.shift < 0.0:
            yield place, f"shift {clock.shift:g} s, allowed is a number from 0"
        if "ScheduledExecution" in description.interfaces and clock.causality == "input" and clock.priority is None:
            yield place, "no priority, which an input clock requires in scheduled execution"
        if clock.causality == "output" and clock.priority is not None:
            yield place, f"priority {clock.priority} of an output clock, allowed is none"
    references = {str(clock.reference) for clock in known}
    for element in description.root.iterfind("ModelVariables/*"):
        for reference in (element.get("clocks") or "").split():
            if reference not in references:
                yield f"variable {element.get('name')}", f"clocks refers to {reference}, which is not a clock"


def intervals(
    probe: ProbeContext, call: Call, when: str, kinds: tuple[str, ...] = (*_PERIODIC, "changing", "countdown")
) -> dict[str, float]:
    """Query the intervals that only the library has; return them."""
    found = {}
    for clock in clocks(probe.description):
        if clock.kind not in kinds or not clock.set_by_library:
            continue
        interval, qualifier = c_double(), c_int(-1)
        call("GetIntervalDecimal", _references(clock), c_size_t(1), byref(interval), byref(qualifier))
        if qualifier.value not in (0, 1, _CHANGED):
            probe.find(
                f"clock {clock.name}", f"its interval has the qualifier {qualifier.value} {when}, allowed is 0, 1 or 2", sort="clocks"
            )
        elif qualifier.value == _CHANGED and not (math.isfinite(interval.value) and interval.value >= 0.0):
            probe.find(f"clock {clock.name}", f"its interval is {interval.value:g} s {when}, allowed is a number from 0", sort="clocks")
        elif qualifier.value == _CHANGED:
            found[clock.name] = interval.value
    return found


def tick(probe: ProbeContext, call: Call) -> None:
    """Activate, in the event mode at the start, the clocks that tick then, and query which clocks of the FMU do."""
    for clock in clocks(probe.description):
        if clock.causality == "input" and (clock.kind == "triggered" or (clock.kind in _PERIODIC and clock.interval and not clock.shift)):
            call("SetClock", _references(clock), c_size_t(1), byref(c_bool(True)))
    ticking(probe, call)


def ticking(probe: ProbeContext, call: Call) -> None:
    """Query which clocks of the FMU tick."""
    for clock in clocks(probe.description):
        if clock.causality == "output":
            call("GetClock", _references(clock), c_size_t(1), byref(c_bool()))


@dataclass
class _Scheduler:
    """The importer's end of scheduled execution."""

    probe: ProbeContext
    slave: ImportedSlave | None = None
    locked: int = 0
    countdown: dict[str, float] = field(default_factory=dict)

    def update(self, _: object) -> None:
        """Take news of clocks; what is wrong is a finding, because nothing can be raised through foreign code."""
        if self.slave is None:
            return
        try:
            ticking(self.probe, self.slave.call)
            self.countdown |= intervals(self.probe, self.slave.call, "in a clock update", ("countdown",))
        except SlaveError as error:
            self.probe.find("ScheduledExecution", f"a clock update fails: {error}", sort="clock update")

    def lock(self) -> None:
        """Begin what must not be interrupted."""
        self.locked += 1

    def unlock(self) -> None:
        """End it."""
        self.locked -= 1


def scheduled_execution(probe: ProbeContext) -> None:
    """Initialize an instance for scheduled execution, and activate its partitions when their clocks tick."""
    flags = probe.description.interfaces.get("ScheduledExecution")
    if flags is None or flags.get("needsExecutionTool") in ("true", "1"):
        return
    probe.step("creating an instance for scheduled execution")
    scheduler = _Scheduler(probe)
    without = ctypes.CFUNCTYPE(None)
    callbacks = (UPDATE_CLOCKS_3(scheduler.update), without(scheduler.lock), without(scheduler.unlock))
    try:
        slave = probe.make(scheduled=callbacks)
    except SlaveError as error:
        probe.find("library, instantiate", f"scheduled execution is refused: {error}")
        return
    variable_access.set_all(probe, slave, variable_access.settable_at_start(probe), "before the initialization")
    probe.step("initializing for scheduled execution")
    slave.enter_initialization_mode(probe.start)
    variable_access.starts(probe, slave)
    known = intervals(probe, slave.call, "in the initialization")
    slave.exit_initialization_mode()
    scheduler.slave = slave
    probe.step("activating the partitions of scheduled execution")
    for time, clock in _schedule(probe, known):
        _activate(probe, scheduler, time, clock)
    for clock in clocks(probe.description):
        if (wait := scheduler.countdown.get(clock.name)) is not None:
            _activate(probe, scheduler, probe.start + 2.0 * probe.size + wait, clock)
    variable_access.reads(probe, slave)
    slave.terminate()
    slave.free()


def _schedule(probe: ProbeContext, known: dict[str, float]) -> list[tuple[float, Clock]]:
    """Return the ticks of input clocks within two steps, in the order of times and priorities."""
    ticks = []
    end = probe.start + 2.0 * probe.size
    for clock in clocks(probe.description):
        if clock.causality != "input" or (clock.kind in ("changing", "countdown") and clock.name not in known):
            continue
        interval = known.get(clock.name, clock.interval)
        first = known[clock.name] if clock.kind in ("changing", "countdown") else clock.shift or 0.0
        periodic = clock.kind in _PERIODIC and interval is not None and interval > _SHORTEST
        times = itertools.count(probe.start + first, interval) if periodic and interval else iter([probe.start + first])
        ticks += [(time, clock) for time in itertools.islice(itertools.takewhile(lambda t: t <= end, times), _MOST_TICKS)]
    # What is no number is a finding of the schema.
    return sorted(ticks, key=lambda pair: (pair[0], finite(pair[1].priority) or 0.0))


def _activate(probe: ProbeContext, scheduler: _Scheduler, time: float, clock: Clock) -> None:
    assert scheduler.slave is not None
    scheduler.locked = 0
    try:
        scheduler.slave.call("ActivateModelPartition", ctypes.c_uint32(clock.reference), c_double(time))
    except SlaveError as error:
        probe.find(f"clock {clock.name}", f"its partition cannot be activated at {time:g} s: {error}", sort="partition")
    if scheduler.locked:
        text = f"its partition returns with {scheduler.locked} more preemption locks than unlocks"
        probe.find(f"clock {clock.name}", text, sort="preemption")


def _references(clock: Clock) -> ctypes.Array[ctypes.c_uint32]:
    return (ctypes.c_uint32 * 1)(clock.reference)
