"""Rules of the standards for ModelStructure: which unknowns are listed, and their dependencies."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from .description import Description, Unknown
from .slave_interface import Variable

_KINDS = {
    2: ("dependent", "constant", "fixed", "tunable", "discrete"),
    3: ("independent", "constant", "fixed", "tunable", "discrete", "dependent"),
}
Broken = tuple[str, str]


def broken(description: Description) -> Iterator[Broken]:
    """Give every rule that ModelStructure breaks, with its place."""
    variables = {v.name: v for v in description.variables}
    yield from _outputs(description)
    yield from _derivatives(description, variables)
    yield from _initial_unknowns(description)
    for unknown in description.structure:
        for text in _dependencies(unknown, description, variables):
            yield f"ModelStructure, {unknown.kind} {unknown.name}", text
    for kind in {u.kind for u in description.structure}:
        for name, count in Counter(u.name for u in description.unknowns(kind)).items():
            if count > 1 and name != "?":
                yield "ModelStructure", f"{name} is listed {count} times as {kind}"
            if name == "?":
                yield "ModelStructure", f"an {kind} that is not a variable"


def _outputs(description: Description) -> Iterator[Broken]:
    # Variables with one value reference are one variable with several names in FMI 2.0; it is enough to list one of them.
    outputs = {v.name: v.reference for v in description.variables if v.causality == "output"}
    listed = {u.name for u in description.unknowns("Output")}
    references = {v.reference for v in description.variables if v.name in listed}
    for name, reference in sorted(outputs.items()):
        if name not in listed and not (description.fmi == 2 and reference in references):
            yield "ModelStructure", f"the output {name} is not listed"
    for name in sorted(listed - set(outputs) - {"?"}):
        yield "ModelStructure", f"{name} is listed as output but is not one"


def _derivatives(description: Description, variables: dict[str, Variable]) -> Iterator[Broken]:
    """Every derivative that is listed states of what."""
    elements = description.root.iterfind("ModelVariables/*")
    named = {e.get("name"): e.find("Real") if description.fmi == 2 else e for e in elements}
    for unknown in description.unknowns("ContinuousStateDerivative"):
        element = named.get(unknown.name)
        if unknown.name in variables and (element is None or element.get("derivative") is None):
            yield "ModelStructure", f"{unknown.name} is listed as derivative but has no attribute derivative"


def _initial_unknowns(description: Description) -> Iterator[Broken]:
    wanted = {v.name for v in description.variables if _is_initial_unknown(v)}
    states = {u.name for u in description.unknowns("ContinuousStateDerivative")}
    by_name = {v.name: v for v in description.variables}
    if description.fmi == 3:
        by_reference = {v.reference: v for v in description.variables}
        for element in description.root.iterfind("ModelVariables/*"):
            if element.get("name") in states and (element.get("derivative") or "").isdigit():
                state = by_reference.get(int(element.get("derivative") or 0))
                wanted |= {v.name for v in (by_name.get(element.get("name", "")), state) if v is not None and _is_free(v)}
    clocked = {e.get("name") for e in description.root.iterfind("ModelVariables/*") if e.get("clocks")}
    known = {u.name for u in description.unknowns("InitialUnknown")}
    references = {by_name[name].reference for name in known if name in by_name}
    for name in sorted(wanted - known - clocked):
        if not (description.fmi == 2 and by_name[name].reference in references):
            yield "ModelStructure", f"{name} is calculated at initialization but is not listed as InitialUnknown"
    allowed = wanted | {v.name for v in description.variables if _is_free(v)}
    for name in sorted(known - allowed - {"?"}):
        yield "ModelStructure", f"{name} is listed as InitialUnknown but is not calculated at initialization"


def _is_free(v: Variable) -> bool:
    """Whether the initialization calculates a variable."""
    exact = v.causality in ("input", "parameter", "structuralParameter", "independent") or v.variability == "constant"
    return not exact and v.initial in (None, "approx", "calculated")


def _is_initial_unknown(v: Variable) -> bool:
    if v.type == "Clock":
        return False
    return v.causality == "calculatedParameter" or (v.causality == "output" and _is_free(v))


def _dependencies(unknown: Unknown, description: Description, variables: dict[str, Variable]) -> Iterator[str]:
    given, kinds = unknown.dependencies, unknown.kinds
    if kinds is not None and given is None:
        yield "dependenciesKind without dependencies"
    if kinds is not None and given is not None and len(kinds) != len(given):
        yield f"{len(given)} dependencies and {len(kinds)} dependenciesKind"
    for kind in kinds or ():
        if kind not in _KINDS[description.fmi]:
            yield f"dependenciesKind {kind!r}, allowed are {', '.join(_KINDS[description.fmi])}"
        elif unknown.kind == "InitialUnknown" and kind in ("fixed", "tunable", "discrete"):
            yield f"dependenciesKind {kind!r}, which is not allowed in initialization mode"
    for name in given or ():
        if name == "?":
            yield "it depends on something that is not a variable"
        elif name == unknown.name and unknown.kind == "InitialUnknown":
            yield "it depends on itself"
    if given is not None and len(set(given)) != len(given):
        yield "a dependency is listed twice"
