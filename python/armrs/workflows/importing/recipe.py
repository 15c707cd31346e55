"""The decisions of an import in `import.toml`: column, unit and convention of each quantity, and the file of each trial."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ... import checks
from ...errors import BadInput
from ...io import tomlfile

REFERENCES = ("relative", "absolute")
ZEROS = ("horizontal", "hanging")


@dataclass(frozen=True)
class Channel:
    """Where one measured quantity comes from.

    Attributes
    ----------
    symbol : str
        `t`, `q1`, `Fy`, `tau1`, `qr1`, `dq1`, `emg_NAME`, as in the columns of a data set without the unit.
    column : str
        Name in the raw file.
    unit : str
        Of the raw values; empty for EMG without one.
    sign : {1, -1}
    why : str
        The reason for this choice.
    lowest : float or None
        Raw angles are brought into the turn from here on, in `unit`; None where they are not wrapped.
    """

    symbol: str
    column: str
    unit: str
    sign: int = 1
    why: str = field(default="", compare=False)
    lowest: float | None = None


@dataclass(frozen=True)
class Convention:
    """How the raw angles are counted, and what the raw forces act on.

    Attributes
    ----------
    reference : {"relative", "absolute"}
        Against the segment before, or against a fixed direction.
    zero : {"horizontal", "hanging"}
        Direction of the first segment (of every segment, for absolute angles) at zero: forward, or straight down.
    signs : tuple of {1, -1}
        By joint; -1 where clockwise is positive.
    force_on : {"robot", "arm"} or None
        None without forces.
    why : str
    """

    reference: str = "relative"
    zero: str = "horizontal"
    signs: tuple[int, ...] = ()
    force_on: str | None = "robot"
    why: str = field(default="", compare=False)

    def words(self) -> str:
        """Return the convention in words."""
        return f"angles {self.angles()}" + ("" if self.force_on is None else f"; forces on the {self.force_on}")

    def angles(self, joints: Sequence[str] = ()) -> str:
        """Return how angles are counted, in words, with the names of the joints where they are given."""
        names = joints or [f"q{j}" for j in range(1, len(self.signs) + 1)]
        flipped = [name for name, sign in zip(names, self.signs, strict=True) if sign < 0]
        turn = "counter-clockwise positive" if not flipped else f"clockwise positive in {', '.join(flipped)}"
        zero = "zero pointing forward" if self.zero == "horizontal" else "zero hanging down"
        reference = "relative to the segment before" if self.reference == "relative" else "absolute"
        return f"{reference}, {zero}, {turn}"


@dataclass(frozen=True)
class RawTrial:
    """One trial of the data set to be.

    Attributes
    ----------
    file : str
        The raw file, relative to `import.toml` or absolute.
    table : str
        Title of the table in it.
    configuration : str
    repeat : int
    role : {"fit", "test"}
    force_file : str, optional
        A further raw file, with the forces.
    force_shift : float
        Added to the time of the forces [s].
    force_table : str, optional
        Title of the table of forces in it; the first when absent.
    remarks : tuple of str
        Text of columns of words, with the time; for readers, an import takes them from the raw file again.
    """

    file: str
    table: str
    configuration: str
    repeat: int
    role: str
    force_file: str | None = None
    force_shift: float = 0.0
    force_table: str | None = None
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True)
class Recipe:
    """Everything that turns raw files into a data set."""

    channels: tuple[Channel, ...]
    convention: Convention
    trials: tuple[RawTrial, ...]
    points: tuple[str, ...] = ()
    origin: tuple[float, float] | None = None
    """Of the positions of the handle, seen from that of the model [m]; None where no angles of the robot are made of them."""
    rate: float | None = None
    """Sample rate of recordings without a column of time [Hz]."""

    def to_toml(self) -> str:
        """Return the text of `import.toml`."""
        c = self.convention
        blocks = ["# Written by armrs import. `armrs import import.toml -o DIR` repeats it without questions."]
        angles = {
            "reference": c.reference,
            "zero": c.zero,
            "signs": list(c.signs),
            "force_on": c.force_on,
            "points": list(self.points) or None,
            "rate_Hz": self.rate,
            "handle_origin": None if self.origin is None else list(self.origin),
        }
        blocks.append("\n".join([*_reason(c.why), "[convention]", *tomlfile.lines(angles)]))
        for channel in self.channels:
            table = {
                "symbol": channel.symbol,
                "column": channel.column,
                "unit": channel.unit,
                "sign": channel.sign,
                "lowest": channel.lowest,
            }
            blocks.append("\n".join([*_reason(channel.why), "[[channel]]", *tomlfile.lines(table)]))
        for trial in self.trials:
            shift = trial.force_shift if trial.force_file else None
            table = {**vars(trial), "force_shift": shift, "remarks": trial.remarks or None}
            blocks.append("\n".join(["[[trial]]", *tomlfile.lines(table)]))
        return "\n\n".join(blocks) + "\n"


def _reason(why: str) -> list[str]:
    return [f"# {' '.join(why.split())}"] if why else []


def load_recipe(path: Path) -> Recipe:
    """Read `import.toml`.

    Raises
    ------
    BadInput
        Names the file, the table and the key.
    """
    return tomlfile.load(path, lambda document, _: _recipe(document))


def _recipe(document: Mapping[str, Any]) -> Recipe:
    checks.keys("", document, required=["convention", "channel", "trial"], optional=[])
    angles = checks.table("[convention]", document["convention"])
    checks.keys(
        "[convention]", angles, required=["reference", "zero", "signs"], optional=["force_on", "points", "handle_origin", "rate_Hz"]
    )
    convention = Convention(
        checks.choice("[convention], reference", angles["reference"], REFERENCES),
        checks.choice("[convention], zero", angles["zero"], ZEROS),
        tuple(_sign("[convention], signs", sign) for sign in angles["signs"]),
        None if "force_on" not in angles else checks.choice("[convention], force_on", angles["force_on"], ("robot", "arm")),
    )
    channels = tuple(_channel(f"[[channel]] {k}", table) for k, table in enumerate(checks.tables("channel", document["channel"]), 1))
    trials = tuple(_trial(f"[[trial]] {k}", table) for k, table in enumerate(checks.tables("trial", document["trial"]), 1))
    points = tuple(checks.instances("[convention], points", angles.get("points", []), str))
    rate = angles.get("rate_Hz")
    rate = None if rate is None else checks.number("[convention], rate_Hz", rate, above=0.0, most=1e6, unit="Hz")
    return Recipe(channels, convention, trials, points, _origin(angles.get("handle_origin")), rate)


def _origin(value: object) -> tuple[float, float] | None:
    place = "[convention], handle_origin"
    if value is None:
        return None
    if not isinstance(value, list) or len(value) != 2:
        raise BadInput(place, value, "two numbers, forward and upward [m]")
    return checks.number(place, value[0], unit="m"), checks.number(place, value[1], unit="m")


def _sign(place: str, value: object) -> int:
    if value not in (1, -1) or isinstance(value, bool):
        raise BadInput(place, value, "1 or -1")
    return -1 if value == -1 else 1


def _channel(place: str, table: Mapping[str, Any]) -> Channel:
    checks.keys(place, table, required=["symbol", "column", "unit"], optional=["sign", "lowest"])
    text = {key: table[key] for key in ("symbol", "column", "unit")}
    for key, value in text.items():
        checks.instance(f"{place}, {key}", value, str)
    lowest = None if "lowest" not in table else checks.number(f"{place}, lowest", table["lowest"], unit=text["unit"])
    return Channel(**text, sign=_sign(f"{place}, sign", table.get("sign", 1)), lowest=lowest)


def _trial(place: str, table: Mapping[str, Any]) -> RawTrial:
    optional = ["force_file", "force_shift", "force_table", "remarks"]
    checks.keys(place, table, required=["file", "table", "configuration", "repeat", "role"], optional=optional)
    for key in ("file", "table", "configuration"):
        checks.text(f"{place}, {key}", table[key])
    return RawTrial(
        table["file"],
        table["table"],
        table["configuration"],
        checks.whole(f"{place}, repeat", table["repeat"], least=1),
        checks.choice(f"{place}, role", table["role"], ("fit", "test")),
        table.get("force_file"),
        checks.number(f"{place}, force_shift", table.get("force_shift", 0.0), unit="s"),
        table.get("force_table"),
        tuple(checks.instances(f"{place}, remarks", table.get("remarks", []), str)),
    )
