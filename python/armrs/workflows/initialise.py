"""A first data set and model of a person, from lengths, height and body mass."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .. import checks
from ..anthropometry import SEGMENTS, UNCERTAINTY, check_lengths, literature_model
from ..errors import BadInput, Text
from ..io import files
from ..model import Model, Robot, Segment, Subject
from ..tabular import Framed, Tidy

_NO_ROBOT = """
# The robot that leads the hand, for simulation and for the gap: two links, lengths and base in metres.
# [robot]
# lengths = [0.45, 0.45]
# base = [1.05, -0.10]
# elbow = "up"
"""


@dataclass(frozen=True)
class Worn:
    """A mass that moves with a segment, such as a part of an orthosis or the handle in the hand.

    Attributes
    ----------
    segment : int
        From 1.
    mass : float
        [kg]
    at : float, optional
        From the segment's proximal joint [m]; its end when absent.
    """

    segment: int
    mass: float
    at: float | None = None

    def __post_init__(self) -> None:
        checks.whole("segment", self.segment, least=1)
        object.__setattr__(self, "mass", checks.number("mass", self.mass, above=0.0, most=20.0, unit="kg"))
        if self.at is not None:
            object.__setattr__(self, "at", checks.number("at", self.at, least=0.0, most=2.0, unit="m", hint="millimetres?"))


@dataclass(frozen=True)
class Initialised(Framed):
    """What `armrs init` wrote, and what it assumed.

    Attributes
    ----------
    folder : Path
    model : Model
    assumed : tuple of str
        A line each.
    """

    folder: Path
    model: Model
    assumed: tuple[str, ...]

    def tidy(self) -> Tidy:
        """Return the segments, one a row."""
        names = ("name", "length", "mass", "com", "inertia")
        columns = {name: [getattr(s, name) for s in self.model.segments] for name in names}
        return Tidy(columns, {"length": "m", "mass": "kg", "com": "m", "inertia": "kg m^2"})

    def to_dict(self) -> dict[str, Any]:
        """Return the result as plain data."""
        segments = [{n: getattr(s, n) for n in ("name", "length", "mass", "com", "inertia")} for s in self.model.segments]
        return {"verb": "init", "folder": os.fspath(self.folder), "segments": segments, "assumed": list(self.assumed)}


def initialise(
    folder: str | os.PathLike[str],
    *,
    body_mass: float,
    height: float,
    sex: str,
    lengths: Sequence[float | None] = (None, None, None),
    worn: Sequence[Worn] = (),
    robot: Robot | None = None,
    side: str | None = None,
    replace: bool = False,
) -> Initialised:
    """Write a commented `dataset.toml` and `model.toml` of a person whose arm is not known yet.

    Parameters
    ----------
    folder : path
        Made when it does not exist.
    body_mass, height, sex, lengths
        As in `segment_expectations`; the number of lengths is that of the segments.
    worn : sequence of Worn
        Handle and parts of an orthosis; they become part of their segments.
    robot : Robot, optional
        The robot that leads the hand. Without it `armrs import` estimates it from the recorded angles of a robot.
    side : {"left", "right"}, optional
        Which arm is measured.
    replace : bool
        Whether existing files may be replaced.

    Returns
    -------
    Initialised

    Raises
    ------
    BadInput
        For values that no person has, and for a folder that holds a data set already.

    Notes
    -----
    No joint has a law: stiffness, damping and friction are unknown, and belong to what `identify` and `gap` find.
    With two lengths the hand belongs to the forearm, which then reaches from elbow to handle.
    """
    target = files.output_folder(folder)
    checks.flag("replace", replace)
    check_lengths(lengths)
    worn = checks.instances("worn", worn, Worn)
    if robot is not None:
        checks.instance("robot", robot, Robot)
    for name in ("dataset.toml", "model.toml"):
        if (target / name).exists() and not replace:
            raise BadInput("folder", Text(f"a {name} that exists"), "a folder without one, or --force", file=folder)
    model = literature_model(Subject(body_mass, height, sex, side=side), lengths).replace(robot=robot)
    segments = model.segments
    for item in worn:
        model = model.with_mass(item.segment, item.mass, item.at)
    assumed = _assumed(segments, lengths, worn, robot)

    def write(part: Path) -> list[Path]:
        files.write_text(part / "model.toml", _model_text(model, assumed), kind=".toml")
        files.write_text(part / "dataset.toml", _dataset_text(target, body_mass, height, sex, side), kind=".toml")
        return [part / "model.toml", part / "dataset.toml"]

    files.write_whole(target, write)
    return Initialised(target, model, assumed)


def _assumed(
    segments: Sequence[Segment],
    lengths: Sequence[float | None],
    worn: Sequence[Worn],
    robot: Robot | None,
) -> tuple[str, ...]:
    lines = []
    for s, measured in zip(segments, lengths, strict=True):
        source = "measured" if measured is not None else "scaled with height"
        lines.append(f"{s.name}: length {s.length:.3f} m ({source}), mass {s.mass:.3f} kg, centre of mass {s.com:.3f} m from its joint")
    lines += [f"{SEGMENTS[w.segment - 1]}: {w.mass:g} kg worn at {'its end' if w.at is None else f'{w.at:g} m'}" for w in worn]
    lines.append(f"masses, centres of mass, inertias: uncertain by {100 * UNCERTAINTY:.0f} % (one standard deviation, segment_uncertainty)")
    if len(segments) == len(SEGMENTS) - 1:
        lines.append(
            "the hand belongs to the forearm, which reaches from the elbow to the handle; three lengths make it a segment of its own"
        )
    elif len(segments) == len(SEGMENTS):
        lines.append(
            "the hand is a segment of its own, counted to the third knuckle; two lengths (--lengths-m ?,?) make an arm without a wrist"
        )
    lines.append("the grip is neutral (thumb up)")
    lines.append("joint laws are unknown: stiffness, damping and friction are left to be identified")
    if robot is None:
        lines.append("no robot leads the hand, unless recordings hold its angles: armrs import then estimates links and base from them")
    return tuple(lines)


def _model_text(model: Model, assumed: Sequence[str]) -> str:
    head = "".join(f"# {line}\n" for line in ("Literature values (de Leva 1996), as a first guess:", *assumed))
    tail = _NO_ROBOT if model.robot is None else ""
    return head + model.to_toml() + tail


def _dataset_text(folder: Path, body_mass: float, height: float, sex: str, side: str | None) -> str:
    which = '# side = "left"' if side is None else f'side = "{side}"'
    return f"""# A data set: one folder, one model, one file for each trial. `armrs check` says what is missing or wrong.
name = "{folder.resolve().name}"
model = "model.toml"
force_on = "robot"              # what the recorded force acts on: "robot" (the arm pushes the handle) or "arm"
# sample_rate = 50.0            # Hz, where time stamps are uneven

[subject]
body_mass = {body_mass!r}
height = {height!r}
sex = "{sex}"
{which:32}# which arm: "left" or "right"; a history compares sessions of one arm

# What the calibration promises, each as one standard deviation; the values shown are the defaults.
# [tolerance]
# angle_offset_deg = 0.3
# force_bias_N = 0.2
# force_gain = 0.01
# time_delay_s = 0.005
# handle_placement_m = 0.001

# One table for each trial: columns t_s, q1_rad …, Fy_N, Fz_N; repeats of a movement carry one configuration.
# `armrs import RAW… --model {folder.name}/model.toml -o DIR` writes all of this from your own recordings.
[[trial]]
file = "trials/slow_1.csv"
configuration = "slow"
repeat = 1
role = "fit"                    # nothing is ever fitted on a "test" trial
"""
