"""Which raw column is which quantity, from names and units in several languages, with the reason."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import replace as changed
from itertools import pairwise

import numpy as np

from ... import checks
from ...errors import BadInput, Text, unknown_name
from ...io.raw import RawColumn, RawTable
from ...io.raw.units import UNITS, unit
from .angle_wrapping import TURN, lowest
from .recipe import Channel

_TIME = {
    "t",
    "time",
    "zeit",
    "zeitstempel",
    "timestamp",
    "temps",
    "tiempo",
    "tempo",
    "cas",
    "seconds",
    "sekunden",
    "elapsed",
    "xvalue",
    "messzeit",
    "laufzeit",
}
_JOINTS = (
    {"shoulder", "schulter", "epaule", "hombro", "spalla", "rame", "glenohumeral", "oberarm", "upperarm", "humerus", "armflex"},
    {
        "elbow", "ellbogen", "ellenbogen", "coude", "codo", "gomito", "komolec", "unterarm", "forearm", "avantbras", "antebrazo",
        "avambraccio",
    },
    {"wrist", "handgelenk", "poignet", "muneca", "polso", "zapestje"},
)  # fmt: skip
_LIMBS = {"bras": 1, "brazo": 1, "braccio": 1, "hand": 3, "handwinkel": 3, "main": 3, "mano": 3}
"""Words that name a joint only beside an angle, a speed or a torque: a hand has a force and a position too."""
_ROBOT = {"robot", "roboter", "rob", "manipulator", "actuator"}
_HANDLE = _ROBOT | {"handle", "griff", "hand", "tcp", "tip", "ee", "effector", "endeffector", "flange", "flansch", "poignee", "manico"}
_SPEED = {"velocity", "speed", "geschwindigkeit", "vitesse", "omega", "vel", "dq", "qd", "velocidad"}
_ACCELERATION = {"acceleration", "beschleunigung", "accel", "acc", "ddq", "qdd"}
_TORQUE = {"torque", "moment", "drehmoment", "tau", "couple", "trq"}
_FORCE = {"force", "kraft", "f", "forza", "fuerza", "sila"}
_ANGLE = {"angle", "winkel", "theta", "phi", "q", "joint", "gelenk", "flexion", "ang", "position", "pos", "j"}
_FORWARD = {
    "horizontal", "horizontale", "forward", "forwards", "vorwarts", "vorwaerts", "vorn", "vorne", "waagrecht", "waagerecht", "avant",
    "adelante", "avanti", "horiz", "fwd",
}  # fmt: skip
_UP = {
    "vertical",
    "vertikal",
    "vert",
    "verticale",
    "up",
    "upward",
    "upwards",
    "oben",
    "aufwarts",
    "aufwaerts",
    "senkrecht",
    "haut",
    "arriba",
    "alto",
}
_BACK = {"backward", "backwards", "ruckwarts", "rueckwarts", "rueckwaerts", "hinten", "arriere"}
_DOWN = {"down", "downward", "downwards", "unten", "abwarts", "abwaerts", "bas", "abajo"}
_AXES = {"x": "x", "y": "y", "z": "z", **dict.fromkeys(_FORWARD | _BACK, "y"), **dict.fromkeys(_UP | _DOWN, "z")}
_MUSCLES = {"biceps", "triceps", "brachialis", "brachioradialis", "deltoid", "deltoideus", "pectoralis", "trapezius"}
_CANONICAL = re.compile(r"(qr|dq|tau|q)(\d)|f([xyz])|m([xyz])|p([xyz])")
_DIMENSION = {"t": "time", "q": "angle", "qr": "angle", "dq": "speed", "tau": "moment", "F": "force", "Mx": "moment", "P": "length"}
_DEGREES_FROM = 7.0
"""An angle whose unit is not stated and that exceeds this [rad] is in degrees: no joint turns by more than a turn."""
_RATES = (4.0, 20000.0)
"""Sample rates that recordings have [Hz]."""
_FORWARD_AND_UP = {("x", "y"): ("x", "y"), ("x", "z"): ("x", "z"), ("y", "z"): ("y", "z"), ("x", "y", "z"): ("y", "z")}
"""Axes of a force sensor -> the one forward and the one up. Of three alike, the first is taken to point sideways."""
_SIDEWAYS = 0.05
"""Of three components, one that is at most this part of the largest points sideways (root mean square)."""
_DEFAULT_UNIT = {"angle": "rad", "speed": "rad/s", "force": "N", "moment": "Nm"}
_MILLIMETRES_FROM = 5.0
"""A position whose unit is not stated and that exceeds this [m] is in millimetres: no arm reaches farther."""


def dimension_of(symbol: str) -> str:
    """Return what a symbol measures: `time`, `angle`, `speed`, `force`, `moment`, `length`, or nothing for EMG."""
    stem = symbol[:1] if symbol[:1] in ("F", "P", "t") and not symbol.startswith("tau") else symbol.rstrip("0123456789")
    return _DIMENSION.get(stem, "")


def words(text: str) -> list[str]:
    """Return the words of a label in lower case without accents; digits are words of their own."""
    plain = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode().lower()
    return re.findall(r"[a-z]+|\d+", plain)


def _mentions(tokens: Sequence[str], names: set[str]) -> bool:
    """Whether a word or two in a row (upper arm) are one of the names, or a compound with a long one in it (Schulterwinkel)."""
    joined = (*tokens, *(a + b for a, b in pairwise(tokens)))
    return any(token in names or any(len(name) >= 5 and name in token for name in names) for token in joined)


def symbol_of(column: RawColumn) -> str | None:
    """Return the symbol of a column by its name and unit, or None.

    >>> import numpy as np
    >>> from armrs.io.raw.table import column
    >>> symbol_of(column("Ellbogen [°]", np.zeros(3)))
    'q2'
    """
    tokens = words(column.label)
    known = unit(column.unit) if column.unit else None
    dimension = known.dimension if known else None
    if not tokens:
        return None
    joined = "".join(tokens)
    if dimension in (None, "time") and (joined in _TIME or tokens[0] in _TIME or tokens[0].endswith("timestamp")):
        return "t"
    if tokens[0].startswith("emg") or _mentions(tokens, _MUSCLES) or dimension == "voltage":
        return "emg_" + "_".join(token for token in tokens if token != "emg") if len(tokens) > 1 or tokens[0] != "emg" else "emg_1"
    if match := _CANONICAL.fullmatch(joined):
        if match[3]:
            return f"F{match[3]}"
        if match[4]:
            return f"M{match[4]}"
        if match[5]:
            return f"P{match[5]}"
        return f"{match[1]}{match[2]}"
    if _mentions(tokens, _ACCELERATION):
        return None
    if any(token.startswith("cart") for token in tokens):  # of a robot's flange, as KUKA names them: cartForce1_X, cartTorque1_TauX
        return _force(tokens, dimension)
    return _force(tokens, dimension) or _position(tokens, dimension) or _joint(tokens, dimension)


def _force(tokens: Sequence[str], dimension: str | None) -> str | None:
    is_force = dimension == "force" or (dimension is None and _mentions(tokens, _FORCE - {"f"}))
    axis = next((_AXES[token] for token in reversed(tokens) if token in _AXES), None)
    # Of a force by its unit any letter may stand before the axis; OpenSim calls the components of a force vx, vy and vz.
    letters = "[a-z]" if dimension == "force" else "[fv]" if is_force else "f"
    fused = next((token for token in tokens if re.fullmatch(f"{letters}[xyz]", token)), None)
    if fused and dimension in (None, "force"):
        return f"F{fused[1]}"
    if is_force and axis:
        return f"F{axis}"
    return None


def _position(tokens: Sequence[str], dimension: str | None) -> str | None:
    """Return the symbol of a position of the handle: a length along an axis of a robot or its handle, or of nothing else."""
    axis = next((_AXES[token] for token in reversed(tokens) if token in _AXES), None)
    mine = set(tokens) <= {*_AXES, "pos", "position"} or _mentions(tokens, _HANDLE)
    return f"P{axis}" if axis and dimension in (None, "length") and mine and not _mentions(tokens, _SPEED | _TORQUE) else None


def _joint(tokens: Sequence[str], dimension: str | None) -> str | None:
    number = next((k for k, names in enumerate(_JOINTS, start=1) if _mentions(tokens, names)), None)
    if number is None and _mentions(tokens, _ANGLE | _SPEED | _TORQUE | _ROBOT):
        number = next((int(token) for token in tokens if token.isdigit()), None)
    if number is None and (dimension in ("angle", "speed", "moment") or _mentions(tokens, _ANGLE | _SPEED | _TORQUE)):
        number = next((_LIMBS[token] for token in tokens if token in _LIMBS and tokens[-1] not in "xyz"), None)
    if number is None:
        return None
    if _mentions(tokens, _ROBOT):
        return f"qr{number}" if dimension in (None, "angle") and not _mentions(tokens, _SPEED | _TORQUE) else None
    if dimension == "moment" or (dimension is None and _mentions(tokens, _TORQUE)):
        return f"tau{number}"
    if dimension == "speed" or (dimension is None and _mentions(tokens, _SPEED)):
        return f"dq{number}"
    return f"q{number}" if dimension in (None, "angle") else None


def parse_map(text: str) -> dict[str, tuple[str, int]]:
    """Return the columns and signs that `--map t=…,q1=…,Fy=-…` names, by symbol.

    Raises
    ------
    BadInput
        For a part that is not `SYMBOL=COLUMN`.
    """
    checks.instance("columns_map", text, str)
    found: dict[str, tuple[str, int]] = {}
    for part in re.split(r",(?=\s*(?:t|q\d|qr\d|dq\d|tau\d|F[yz]|P[yz]|Mx|emg_\w+)\s*=)", text):
        if not part.strip():
            continue
        symbol, equals, name = (piece.strip() for piece in part.partition("="))
        if not equals or not name or not (dimension_of(symbol) or symbol.startswith("emg_")):
            raise BadInput("--map", part.strip(), "SYMBOL=COLUMN with t, q1 …, Fy, Fz, Mx, tau1 …, qr1, qr2, Py, Pz, dq1 … or emg_NAME")
        found[symbol] = (name[1:].strip(), -1) if name.startswith("-") else (name, 1)
    return found


def guess(tables: Sequence[RawTable], given: Mapping[str, tuple[str, int]], problems: list[BadInput]) -> list[Channel]:
    """Return the channels of recordings that share their columns; what cannot be decided is added to `problems`.

    Parameters
    ----------
    tables : sequence of RawTable
        The columns of the first one are used; units that are not stated are inferred from the values of all.
    given : mapping of symbol to (column, sign)
        From `parse_map`; these are taken as they are.
    problems : list of BadInput
    """
    table = tables[0]
    by_name = {c.name: c for c in table.columns} | {c.label: c for c in table.columns}
    chosen: dict[str, tuple[RawColumn, int, str]] = {}
    for symbol, (name, sign) in given.items():
        if name in by_name:
            chosen[symbol] = (by_name[name], sign, "as --map says")
        else:
            problems.append(unknown_name("--map", name, [c.name for c in table.columns], what="column").within(file=table.path))
    taken = {id(c) for c, _, _ in chosen.values()}
    named: dict[str, list[RawColumn]] = {}
    for c in table.columns:
        said = None if id(c) in taken else symbol_of(c)
        if said and said not in chosen:
            named.setdefault(said, []).append(c)
    for symbol, columns in _from_one(named).items():
        if len(columns) > 1 and not symbol.startswith("emg_"):
            found = Text(" and ".join(repr(c.name) for c in columns))
            problems.append(
                BadInput("columns", found, f"one column for {symbol}", file=table.path, hint=f"--map '{symbol}={columns[0].name}'")
            )
        turned = symbol[0] in "FP" and bool((_BACK | _DOWN) & set(words(columns[0].label)))
        counted = "" if symbol in named and columns is named[symbol] else ", joints counted from zero"
        chosen[symbol] = (columns[0], -1 if turned else 1, f"by its name {columns[0].name!r}{counted}")
    channels = [_channel(symbol, c, sign, why, tables, problems) for symbol, (c, sign, why) in chosen.items()]
    return [_in_one_turn(channel, tables) for channel in channels if channel is not None]


def _from_one(named: Mapping[str, list[RawColumn]]) -> dict[str, list[RawColumn]]:
    """Return columns by symbols that count joints from one, also where names count them from zero (`position0`, as of ROS)."""
    found = {}
    for symbol, columns in named.items():
        kind, number = symbol.rstrip("0123456789"), symbol.lstrip("abcdefghijklmnopqrstuvwxyz")
        from_zero = kind in ("q", "qr", "dq", "tau") and f"{kind}0" in named
        found[f"{kind}{int(number) + 1}" if from_zero else symbol] = columns
    return found


def _is_unit(column: RawColumn) -> bool:
    """Whether a column states a unit, known or not: in square brackets, or in a row of units; in round ones it may be a remark."""
    return f"[{column.unit}]" in column.name or column.unit not in column.name


def _channel(symbol: str, column: RawColumn, sign: int, why: str, tables: Sequence[RawTable], problems: list[BadInput]) -> Channel | None:
    dimension = dimension_of(symbol)
    if not dimension:
        return Channel(symbol, column.name, column.unit, sign, why)
    stated = unit(column.unit) if column.unit else None
    if stated is not None and stated.dimension != dimension:
        place = f"column {column.name!r}"
        problems.append(BadInput(place, column.unit, f"a unit of {dimension} for {symbol}", file=tables[0].path))
        return None
    if stated is None and column.unit and _is_unit(column):
        known = ", ".join(dict.fromkeys(u.text for u in UNITS.values() if u.dimension == dimension))
        problems.append(BadInput(f"column {column.name!r}", column.unit, f"a unit of {dimension}: {known}", file=tables[0].path))
        return None
    values = [c.values for table in tables if (c := table.find(column.name)) is not None]
    if symbol == "t":
        return _time(column, stated.text if stated else "", values[0], why, tables[0], problems)
    most = max((float(np.nanmax(np.abs(v))) for v in values if np.isfinite(v).any()), default=0.0)
    if stated is not None and stated.text == "rad" and most > _DEGREES_FROM:
        return Channel(
            symbol, column.name, "deg", sign, f"{why}; values up to {most:.3g}, so in degrees, although its header says {stated.text}"
        )
    if stated is not None:
        # A unit from a row of its own is not in the name.
        return Channel(symbol, column.name, stated.text, sign, why if column.unit in column.name else f"{why}, in {stated.text}")
    if dimension == "angle":
        in_degrees = most > _DEGREES_FROM
        reason = f"no unit stated; values up to {most:.3g}, so in {'degrees' if in_degrees else 'radians'}"
        return Channel(symbol, column.name, "deg" if in_degrees else "rad", sign, f"{why}; {reason}")
    if dimension == "length":
        text = "mm" if most > _MILLIMETRES_FROM else "m"
        return Channel(symbol, column.name, text, sign, f"{why}; no unit stated; values up to {most:.3g}, so in {text}")
    return Channel(symbol, column.name, _DEFAULT_UNIT[dimension], sign, f"{why}; no unit stated, so {_DEFAULT_UNIT[dimension]}")


def _in_one_turn(channel: Channel, tables: Sequence[RawTable]) -> Channel:
    """Return a channel of angles with the turn in which all trials count it, where they are wrapped or whole turns off."""
    known = unit(channel.unit)
    if known is None or known.dimension != "angle":
        return channel
    low = lowest([c.values for table in tables if (c := table.find(channel.column)) is not None], TURN / known.factor)
    if low is None:
        return channel
    return changed(channel, lowest=low, why=f"{channel.why}; in the turn from {low:g} {channel.unit} on, without jumps over all trials")


def plane(channels: Sequence[Channel], tables: Sequence[RawTable]) -> tuple[list[Channel], list[str]]:
    """Return channels with forces and positions named in the plane of armrs, y forward and z up, and what was decided."""
    found, notes = list(channels), []
    for kind, said in (("F", "force"), ("P", "position")):
        own = {f"{kind}x", f"{kind}y", f"{kind}z"}
        names = {f"{kind}y": f"{kind}y", f"{kind}z": f"{kind}z"}
        three = [c for c in found if c.symbol in own]
        if not any(c.why.startswith("as --map") for c in three if c.symbol in names):
            axes = tuple(sorted(c.symbol[1] for c in three))
            sideways = _sideways(three, tables) if kind == "F" and len(axes) == len(own) else None
            if sideways is not None:
                axes = tuple(axis for axis in axes if axis != sideways)
            if axes in _FORWARD_AND_UP:
                forward, up = _FORWARD_AND_UP[axes]
                names = {f"{kind}{forward}": f"{kind}y", f"{kind}{up}": f"{kind}z"}
                if (forward, up) != ("y", "z"):
                    least = f", {sideways} as sideways, where next to no force acts" if sideways is not None else ""
                    notes.append(f"{said} axes: {forward} is taken as forward, {up} as up{least}")
        found = [changed(c, symbol=names.get(c.symbol, c.symbol)) for c in found if c.symbol in names or c.symbol not in own]
    return [c for c in found if c.symbol not in ("My", "Mz")], notes


def _sideways(three: Sequence[Channel], tables: Sequence[RawTable]) -> str | None:
    """Return the axis along which next to no force acts."""
    size = {c.symbol[1]: _root_mean_square(c, tables) * (known.factor if (known := unit(c.unit)) else 1.0) for c in three}
    least = min(size, key=lambda axis: size[axis])
    return least if size[least] <= _SIDEWAYS * max(size.values()) and sorted(size.values())[1] > _SIDEWAYS * max(size.values()) else None


def _root_mean_square(channel: Channel, tables: Sequence[RawTable]) -> float:
    values = np.concatenate([c.values for table in tables if (c := table.find(channel.column)) is not None] or [np.zeros(0)])
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else 0.0


def went_back(name: str, values: np.ndarray, sample: int, table: RawTable) -> BadInput:
    """Return the refusal of time stamps that do not increase after a sample."""
    after = values[np.isfinite(values)][sample : sample + 2]
    found = Text(f"{after[1]:g} after {after[0]:g} in sample {sample + 2}")
    return BadInput(f"column {name!r}", found, "time stamps that increase", file=table.path, hint="two recordings in one file? divide it")


def is_clock(values: np.ndarray, text: str) -> bool:
    """Whether time stamps in a unit increase at a rate that recordings have."""
    known = unit(text)
    step = _step(values) * (known.factor if known else 1.0)
    return step > 0.0 and _RATES[0] <= 1.0 / step <= _RATES[1]


def _step(values: np.ndarray) -> float:
    """Return the usual step of time stamps, in their unit; 0 where there is none."""
    steps = np.diff(values[np.isfinite(values)])
    return float(np.median(steps)) if steps.size else 0.0


def _time(column: RawColumn, stated: str, values: np.ndarray, why: str, table: RawTable, problems: list[BadInput]) -> Channel | None:
    """Return the time, in the unit in which the rate is one that recordings have."""
    step = _step(values)
    if step <= 0.0:
        problems.append(
            BadInput(f"column {column.name!r}", Text("time that does not increase"), "time stamps that increase", file=table.path)
        )
        return None
    back = np.flatnonzero(np.diff(values[np.isfinite(values)]) <= 0.0)
    if back.size:
        problems.append(went_back(column.name, values, int(back[0]), table))
        return None
    plausible = [text for text in ("s", "ms", "µs", "ns") if is_clock(values, text)]
    if stated in plausible or (stated and not plausible):
        return Channel("t", column.name, stated, 1, f"{why}; in {stated} as stated")
    if not plausible:
        found = Text(f"{step:g} between samples")
        problems.append(BadInput(f"column {column.name!r}", found, f"{_RATES[0]:g} to {_RATES[1]:g} samples a second", file=table.path))
        return None
    # Steps of one are samples of a millisecond far oftener than of a microsecond.
    chosen = plausible[0]
    contradicts = f", although its header says {stated}" if stated else ""
    return Channel("t", column.name, chosen, 1, f"{why}; steps of {step:g}, so in {chosen}{contradicts}")
