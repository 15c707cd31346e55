"""Usual ranges: read from `norms.toml`, and written from the norm bands of a cohort."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .. import checks
from ..errors import BadInput, Text
from ..io import arm_side, tomlfile
from .clinic_quantities import QUANTITIES, SLOW, Key

if TYPE_CHECKING:
    from ..workflows.cohort import Cohort, Quantity


@dataclass(frozen=True)
class Norm:
    """The usual range of a parameter: `low` to `high`, in SI units, and its source; of one movement and one side where they are stated."""

    kind: str
    name: str
    joint: int
    low: float
    high: float
    source: str
    movement: str | None = None
    side: str | None = None


def load_norms(path: str | os.PathLike[str]) -> tuple[Norm, ...]:
    """Read what is usual: `[[norm]]` tables with `kind`, `name`, `joint`, `low`, `high` in SI, `source`; `movement`, `side` may be."""
    return tomlfile.load(path, _norms)


def _norms(document: Mapping[str, Any], _: Path) -> tuple[Norm, ...]:
    checks.keys("", document, required=["norm"])
    norms = []
    for k, table in enumerate(checks.tables("norm", document["norm"]), start=1):
        place = f"[[norm]] {k}"
        checks.keys(place, table, required=["kind", "name", "joint", "low", "high", "source"], optional=["movement", "side"])
        known = [(q.kind, q.parameter) for q in (*QUANTITIES, *SLOW)]
        if (table["kind"], table["name"]) not in known:
            allowed = " or ".join(f"{kind} {parameter}" for kind, parameter in known)
            raise BadInput(place, Text(f"{table['kind']} {table['name']}"), allowed)
        low = checks.number(f"{place}, low", table["low"])
        norms.append(
            Norm(
                table["kind"],
                table["name"],
                checks.whole(f"{place}, joint", table["joint"], least=1),
                low,
                checks.number(f"{place}, high", table["high"], above=low),
                checks.text(f"{place}, source", table["source"]),
                None if "movement" not in table else checks.text(f"{place}, movement", table["movement"]),
                arm_side.side_of(f"{place}, side", table.get("side")),
            )
        )
    return tuple(norms)


def usual_of(norms: Sequence[Norm], result: Mapping[str, Any], movement: str | None = None) -> dict[Key, Norm]:
    """Return the usual ranges that hold for the arm of a result, and for one of its movements."""
    side = result["data"].get("side")
    holds = [n for n in norms if n.side in (None, side) and n.movement in (None, movement)]
    # One of this movement and this side says more than one of any.
    return {(n.kind, n.name, n.joint): n for n in sorted(holds, key=lambda n: (n.movement is not None, n.side is not None))}


def norms_of(cohort: Cohort) -> dict[str, str]:
    """Return the norm bands of a cohort as texts of `norms.toml`, by the name of the file: one for each group."""
    tables: dict[str, list[str]] = {}
    alone = len({q.group for q in cohort.quantities}) < 2
    for q in cohort.quantities:
        named, si = _as_norm(q)
        if named is None or si is None or _plain(q.unit) not in ("", _plain(si)) or not q.norm[0] < q.norm[1]:
            continue
        group = "" if alone else f" of group {q.group}"
        source = f"armrs cohort {cohort.name}: {q.subjects} subjects{group}, {q.sessions} sessions"
        table = {"kind": named["kind"], "name": named["name"], "joint": int(named["joint"]), "movement": named["movement"]}
        table |= {"side": arm_side.written_side(q.side), "low": q.norm[0], "high": q.norm[1], "source": source}
        tables.setdefault(q.group, []).append("\n".join(["[[norm]]", *tomlfile.lines(table)]))
    return {"norms.toml" if alone else f"norms-{_in_a_name(group)}.toml": "\n\n".join(own) + "\n" for group, own in tables.items()}


def in_other_units(cohort: Cohort) -> list[str]:
    """Return the quantities of a cohort that would have norms if their unit were that of results, a line each."""
    units = {(q.name, q.unit): si for q in cohort.quantities if (si := _as_norm(q)[1]) and _plain(q.unit) not in ("", _plain(si))}
    return [f"{name}: found {unit}, allowed {si}: no norms for armrs report" for (name, unit), si in units.items()]


def _as_norm(quantity: Quantity) -> tuple[re.Match[str] | None, str | None]:
    """Return the parts of a quantity's name and its unit, as results have them; None where it is no quantity of a result."""
    named = _NAMED.fullmatch(quantity.name)
    return named, None if named is None else _SI.get((named["kind"], named["name"]))


def _plain(unit: str) -> str:
    """Return a unit without the marks of a product."""
    return re.sub(r"[ ·*]", "", unit)


_NAMED = re.compile(r"(?P<kind>\w+) (?P<name>\w+)(?: in (?P<movement>.+))? of joint (?P<joint>[1-9]\d*)")
"""A quantity of a cohort, as results name it."""
_SI = {(q.kind, q.parameter): q.si for q in (*QUANTITIES, *SLOW) if q.parameter != "range"}
"""Units of what a usual range can be given for; how far a joint was moved was chosen."""


def _in_a_name(group: str) -> str:
    """Return a group as part of the name of a file."""
    return re.sub(r"[^\w-]+", "-", group).strip("-") or "group"
