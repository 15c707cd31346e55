"""The verbs `init`, `import` and `check`."""

from __future__ import annotations

import enum
import shlex
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer

from ..errors import BadInput, BadInputs, Text
from ..report import console
from .common import JsonFile, OutFolder, Source, command_line, listed, on_a_terminal, present, writable

if TYPE_CHECKING:
    from ..model import Robot
    from ..workflows.check_dataset import Checked
    from ..workflows.initialise import Worn


_Read = TypeVar("_Read")
_SCALED = "?,?,?"
"""Three segments whose lengths are scaled with height."""


class Sex(str, enum.Enum):
    """As the tables of the literature distinguish it."""

    male = "male"
    female = "female"


class Reference(str, enum.Enum):
    """What raw angles are counted against."""

    relative = "relative"
    absolute = "absolute"


class Zero(str, enum.Enum):
    """Where the first segment points at angle zero."""

    horizontal = "horizontal"
    hanging = "hanging"


class Elbow(str, enum.Enum):
    """Posture of a robot."""

    up = "up"
    down = "down"


class Arm(str, enum.Enum):
    """Which arm of a person."""

    left = "left"
    right = "right"


class Side(str, enum.Enum):
    """What raw forces act on."""

    robot = "robot"
    arm = "arm"


def init(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of the data set; created if it does not exist.")],
    body_mass: Annotated[float | None, typer.Option("--body-mass-kg", help="Body mass [kg].")] = None,
    height: Annotated[float | None, typer.Option("--height-m", help="Height [m].")] = None,
    sex: Annotated[Sex | None, typer.Option(help="Which table of the literature is used.")] = None,
    lengths: Annotated[
        str,
        typer.Option(
            "--lengths-m",
            metavar="L,L[,L]",
            help="Lengths of upper arm, forearm and hand [m], or of upper arm and elbow to handle; ? is scaled with height.",
        ),
    ] = _SCALED,
    handle: Annotated[float, typer.Option("--handle-kg", help="Mass of the handle in the hand [kg].")] = 0.0,
    orthosis: Annotated[
        str,
        typer.Option(metavar="SEGMENT:KG[@M],…", help="Masses worn on segments: number, mass [kg], distance from its joint [m]."),
    ] = "",
    robot_lengths: Annotated[
        str, typer.Option("--robot-lengths-m", metavar="A,B", help="Lengths of the two links of a robot that leads the hand [m].")
    ] = "",
    robot_base: Annotated[
        str, typer.Option("--robot-base-m", metavar="Y,Z", help="Its base, forward and up of the first joint of the arm [m].")
    ] = "",
    robot_elbow: Annotated[Elbow, typer.Option(help="Whether its elbow is above or below the line from base to hand.")] = Elbow.up,
    side: Annotated[Arm | None, typer.Option(help="Which arm is measured.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace files that exist.")] = False,
    json: JsonFile = None,
) -> None:
    """Write a commented data set and model of a person from body mass, height, sex and lengths.

    Masses, centres of mass and inertias come from the literature (de Leva 1996). The model has no joint laws: identify and gap
    determine stiffness, damping and friction. On a terminal, body mass, height and sex are asked for where they are not given.
    """
    from ..workflows.initialise import Worn, initialise

    if body_mass is None or height is None or sex is None:
        body_mass, height, sex, lengths = _person(body_mass, height, sex, lengths)
    worn = [_worn(part) for part in listed(orthosis)]
    measured = [_length(part) for part in listed(lengths)]
    if handle:
        worn.append(Worn(len(measured), handle))
    robot = _robot(robot_lengths, robot_base, robot_elbow)
    writable(folder, json)
    done = initialise(
        folder,
        body_mass=body_mass,
        height=height,
        sex=sex.value,
        lengths=measured,
        worn=worn,
        robot=robot,
        side=side and side.value,
        replace=force,
    )

    def human() -> None:
        print(f"Wrote {done.folder / 'model.toml'} and {done.folder / 'dataset.toml'}. Assumed:")
        for line in done.assumed:
            print(f"  {line}")

    present(done.to_dict, json, human, f"armrs import RAW… --model {shlex.quote(str(done.folder / 'model.toml'))} -o SESSION")


def _person(body_mass: float | None, height: float | None, sex: Sex | None, lengths: str) -> tuple[float, float, Sex, str]:
    """Return what describes a person: what is missing is asked for on a terminal, and refused elsewhere."""
    given = {"--body-mass-kg": body_mass, "--height-m": height, "--sex": sex}
    missing = [option for option, value in given.items() if value is None]
    if not on_a_terminal():
        raise BadInput(", ".join(missing), Text("nothing"), "these options, or a terminal to ask on")
    if body_mass is None:
        body_mass = _answer("Body mass [kg]", float, "a number")
    if height is None:
        height = _answer("Height [m]", float, "a number")
    if sex is None:
        sex = _answer("Sex, for the table of the literature", Sex, "male or female")
    if lengths == _SCALED:
        asked = "Lengths of upper arm, forearm and hand [m], or of upper arm and elbow to handle; ? is scaled with height"
        lengths = typer.prompt(asked, default=_SCALED, err=True)
    return body_mass, height, sex, lengths


def _answer(question: str, read: Callable[[str], _Read], allowed: str) -> _Read:
    """Ask until the answer can be read."""
    while True:
        given = str(typer.prompt(question, err=True)).strip()
        try:
            return read(given)
        except ValueError:
            print(f"found {given!r}, allowed {allowed}", file=sys.stderr)


def _robot(lengths: str, base: str, elbow: Elbow) -> Robot | None:
    """Return the robot that options describe, None where they describe none."""
    from ..model import Robot

    if not lengths and not base:
        return None
    numbers = []
    for option, text, what in (("--robot-lengths-m", lengths, "lengths of both links"), ("--robot-base-m", base, "forward and up")):
        try:
            first, second = (float(part) for part in text.split(","))
        except ValueError:
            raise BadInput(option, text or Text("nothing"), f"two numbers [m], {what}, such as 0.47,0.45") from None
        numbers.append((first, second))
    return Robot(numbers[0], numbers[1], elbow.value)


def _length(text: str) -> float | None:
    if text == "?":
        return None
    try:
        return float(text)
    except ValueError:
        raise BadInput("--lengths-m", text, "a length [m], or ? for a length scaled with body height") from None


def _worn(text: str) -> Worn:
    from ..workflows.initialise import Worn

    segment, _, rest = text.partition(":")
    mass, at, place = rest.partition("@")
    try:
        return Worn(int(segment), float(mass), float(place) if at else None)
    except ValueError:
        raise BadInput("--orthosis", text, "SEGMENT:KG or SEGMENT:KG@M in kg and m, such as 2:0.35@0.12") from None


def import_(
    context: typer.Context,
    sources: Annotated[list[Path], typer.Argument(metavar="RAW…", help="Recordings, folders of recordings, or one import.toml.")],
    out: OutFolder,
    model: Annotated[
        Path | None,
        typer.Option(
            metavar="MODEL", help="model.toml of the arm, as armrs init writes it; for import.toml, the one beside it when absent."
        ),
    ] = None,
    columns: Annotated[
        str,
        typer.Option("--map", metavar="t=NAME,q1=NAME,Fy=-NAME,…", help="Columns not recognised by name; a minus reverses the sign."),
    ] = "",
    angles: Annotated[Reference | None, typer.Option(help="Angles relative to the previous segment, or to a fixed direction.")] = None,
    zero: Annotated[Zero | None, typer.Option(help="Direction of the first segment at angle zero.")] = None,
    clockwise: Annotated[str | None, typer.Option(metavar="1,2,…|none", help="Joints whose angle is clockwise positive.")] = None,
    force_on: Annotated[Side | None, typer.Option("--force-on", help="Body on which the recorded force acts.")] = None,
    points: Annotated[
        str, typer.Option(metavar="A,B+C,…", help="Markers from the first joint to the handle; B+C is the midpoint. By name when absent.")
    ] = "",
    rate_hz: Annotated[float | None, typer.Option(help="Sample rate of recordings without a column of time [Hz].")] = None,
    ask: Annotated[bool, typer.Option("--ask", help="Ask for each column on the terminal, with a guess and its reason.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Replace the data set of a former import, including your edits.")] = False,
    json: JsonFile = None,
) -> int:
    """Convert recordings (CSV, Excel, Parquet, MATLAB, C3D, TRC, MOT, STO, exports of Vicon, Qualisys, OptiTrack) into a data set.

    Separators, decimal commas, encodings, units and columns are recognised. The angle convention and the body on which the force acts
    are inferred from the balance of the arm, unless options state them. Every decision is printed and saved in import.toml, which
    repeats the import. Exit status 1 if the clock of a force recording or the unit of forces is in doubt, or if more than 10 % of the
    contact torques remain unexplained: the data set is written, and a line states the doubt.
    """
    from ..io.dataset import load_dataset
    from ..report.recording import write_recording
    from ..workflows.importing import import_recordings, model_file

    writable(out, json)
    arm = model_file(sources, model)
    joints = None if clockwise is None else [_joint(part) for part in listed(clockwise) if part != "none"]
    options = {
        "angles": angles and angles.value, "zero": zero and zero.value, "clockwise": joints,
        "force_on": force_on and force_on.value, "points": listed(points), "rate": rate_hz,
        "replace": force,
    }  # fmt: skip
    talking = on_a_terminal()
    if ask and not talking:
        raise BadInput("--ask", Text("no terminal"), "a terminal to ask on, or --map")
    if ask:
        columns = ",".join(filter(None, [_ask_columns(sources, tuple(listed(points)), arm), columns]))
    try:
        with console.stages("importing") as tell:
            done = import_recordings(sources, out, model=arm, columns_map=columns, progress=tell, **options)  # type: ignore[arg-type]
    except BadInput as error:
        if ask or columns or not talking or not _about_columns(error):
            raise
        for problem in error.problems if isinstance(error, BadInputs) else (error,):
            print(f"armrs: {problem}", file=sys.stderr)
        columns = _ask_columns(sources, tuple(listed(points)), arm)
        done = import_recordings(sources, out, model=arm, columns_map=columns, **options)  # type: ignore[arg-type]

    picture = write_recording(load_dataset(done.folder), done.folder)

    def data() -> Any:
        from ..report.dataset_pages import imported_data

        return imported_data(done, command_line(context))

    def human() -> None:
        for note in done.notes:
            print(f"  {note}")
        for line in done.warnings:
            print(f"  in doubt: {line}")
        print("  (t: time; q1 …: joint angles, from the base on; Fy, Fz: force forward and upward)")
        count = len(done.recipe.trials)
        print(f"Wrote {count} trial{'s' * (count > 1)} to {done.folder}.")
        print(f"Look at {picture}: does the arm stand as in the laboratory, and does the force support it?")

    present(data, json, human, f"armrs check {shlex.quote(str(done.folder))}")
    return 1 if done.warnings else 0


def _about_columns(error: BadInput) -> bool:
    """Whether a refusal is about columns alone, which the user can name."""
    problems = error.problems if isinstance(error, BadInputs) else (error,)
    return all(problem.place == "columns" for problem in problems)


def _joint(text: str) -> int:
    if not text.isdigit():
        raise BadInput("--clockwise", text, "joint numbers such as 1,2, or none")
    return int(text)


def _ask_columns(sources: list[Path], points: tuple[str, ...], model: Path) -> str:
    """Ask which column is what, each with a guess; returns the answers as `--map` has them."""
    from ..model import load_model
    from ..workflows.importing.column_questions import questions

    table, asked = questions(sources, points, [joint.name for joint in load_model(model).joints])
    names = [c.name for c in table.columns]
    print(f"{table.path} has these columns; first value in brackets:", file=sys.stderr)
    for number, c in enumerate(table.columns, start=1):
        print(f"  {number}  {c.name}  [{c.values[0]:.4g}]", file=sys.stderr)
    print("Answer with a name or a number; Enter takes the guess, 0 leaves it out, a minus turns the sign.", file=sys.stderr)
    answers = []
    for question in asked:
        why = f" ({question.why})" if question.guess else ""
        while True:
            given = typer.prompt(f"{question.symbol}, {question.meaning}{why}", default=question.guess or "0", err=True).strip()
            sign, name = ("-", given[1:].strip()) if given.startswith("-") and given not in names else ("", given)
            if name.isdigit() and name not in names and 0 <= int(name) <= len(names):
                name = names[int(name) - 1] if int(name) else "0"
            if name == "0" or name in names:
                break
            print(f"found {given!r}, allowed a name or number of the list", file=sys.stderr)
        answers += [] if name == "0" else [f"{question.symbol}={sign}{name}"]
    return ",".join(answers)


def _after_check(done: Checked, dataset: Path) -> str:
    place = shlex.quote(str(dataset))
    if done.errors:
        return f"correct the errors above, then armrs check {place} again"
    if any(v.verb == "spasticity" and v.able for v in done.verbs):
        return f"armrs spasticity {place} -o spasticity, then armrs passive {place} -o passive: a joint is stretched at several speeds"
    able = [
        f"armrs {v.verb} {place} -o {'identified' if v.verb == 'identify' else v.verb}"
        for v in done.verbs
        if v.able and v.verb != "passive"
    ]
    return ", then ".join(able) or "record forces or joint torques beside the angles"


def check(context: typer.Context, dataset: Source, json: JsonFile = None) -> int:
    """List every problem of a data set at once, and what each verb can determine from it.

    Exit status 1 if a problem prevents a verb from using the data.
    """
    from ..workflows.check_dataset import check_dataset, grouped

    with console.stages("checking") as tell:
        done = check_dataset(dataset, progress=tell)

    def data() -> Any:
        from ..report.dataset_pages import checked_data

        return checked_data(done, command_line(context))

    def human() -> None:
        for problem in grouped(done.problems):
            print(f"{problem.level}: {problem}")
        if done.problems:
            print()
        console.table(("verb", "can use the data", "why"), [(v.verb, "yes" if v.able else "no", v.why) for v in done.verbs], left=3)

    present(data, json, human, _after_check(done, dataset))
    return 1 if done.errors else 0
