"""The verbs `identify`, `gap` and `passive`."""

from __future__ import annotations

import contextlib
import enum
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import BadInput, Text
from ..report import console
from .common import JsonFile, MaybeFolder, Source, command_line, present, quoted, writable

if TYPE_CHECKING:
    from ..io.dataset import Dataset
    from ..workflows.history import Followed


HistoryFile = Annotated[
    Path | None,
    typer.Option("--history", metavar="FILE", help="Add the result to the history of this subject, an SQLite file, and show it."),
]
SessionDate = Annotated[
    str | None,
    typer.Option("--date", metavar="YYYY-MM-DD", help="Date of the session; that in the data set's name, or today, when absent."),
]


def day_of(data: Dataset, history: Path | None, date: str | None) -> str:
    """Return the date of a session; a history that cannot be added to is refused before any work is done."""
    from ..workflows import history as sessions

    if history is None and date is not None:
        raise BadInput("--date", Text("no --history"), "--date beside --history FILE: the date is kept only there")
    day = sessions.session_date(data.name, date)
    if history is not None:
        sessions.refuse_future(day)
        sessions.check(history, data.model.n_joints, sessions.subject_of(data), data, day)
    return day


@contextlib.contextmanager
def kept(history: Path | None, result: Followed, day: str, plain: dict[str, Any]) -> Iterator[None]:
    """Add a result to a history, and the history to the result; both stay only if all that is written in the block could be."""
    with contextlib.ExitStack() as stack:
        if history is not None:
            from ..workflows import history as sessions

            followed = stack.enter_context(sessions.adding(history, result, day))
            console.warn(followed.warnings)
            plain["history"], plain["session"] = followed.to_dict()["courses"], followed.session()
        yield


class Method(str, enum.Enum):
    """Methods of identification."""

    joint = "joint"
    cascade = "cascade"


class Motion(str, enum.Enum):
    """Sources of speeds and accelerations."""

    auto = "auto"
    measured = "measured"
    simulated = "simulated"


def identify(
    context: typer.Context,
    dataset: Source,
    out: MaybeFolder = None,
    method: Annotated[Method, typer.Option(help="All joints at once with physical constraints, or one after the other.")] = Method.joint,
    with_: Annotated[
        str | None,
        typer.Option(
            "--with",
            metavar="KIND,…",
            help="Kinds of joint effects (see armrs effects) that are fitted at every joint besides the model's, or none. When absent: "
            "elastic, viscous and coulomb in joints without a law.",
        ),
    ] = None,
    cutoff_hz: Annotated[
        float | None,
        typer.Option(help="Cutoff of the common low-pass [Hz], above 0, below 0.4 of the sample rate; chosen from the data when absent."),
    ] = None,
    motion: Annotated[Motion, typer.Option(help="Where speeds and accelerations come from.")] = Motion.auto,
    level: Annotated[float, typer.Option(help="Probability of the intervals, from 0.5 to 0.999999.")] = 0.95,
    history: HistoryFile = None,
    date: SessionDate = None,
    json: JsonFile = None,
) -> int:
    """Identify body segment and joint parameters, each with an interval and what determined it.

    Exit status 1 in four cases: the solver did not converge fully; the result is impossible for this arm and these sensors; more than half
    of the variation of a joint's torque remains unexplained (above a fifth there is a warning); or noise is a large part of the speeds. A
    result with status 1 is not added to a history.
    """
    from ..io.dataset import load_dataset
    from ..report import sentences
    from ..workflows.identify import identify as run_identification
    from ..workflows.result_data import identified_data

    folder = writable(out, json, verb="identify")
    data = load_dataset(dataset)
    day = day_of(data, history, date)
    with console.progress("identifying"):
        result = run_identification(
            data,
            method=method.value,
            with_effects=() if with_ == "none" else with_,
            cutoff=cutoff_hz,
            motion=motion.value,
            level=level,
        )
    plain = identified_data(result, command_line(context))
    with kept(history if result.is_sound else None, result, day, plain):
        written = []
        if folder:
            from ..report.result_files import write_identified

            written = write_identified(result, plain, folder)
        console.warn([*data.warnings, *result.warnings])
        if history is not None and not result.is_sound:
            console.warn([f"{history}: not added to the history, since the result is not sound"])
        step = f"armrs gap {quoted(dataset)} -o gap"
        if not result.is_sound:
            step = f"armrs check {quoted(dataset)} lists problems of the recordings; {step} looks for what the model lacks"
        present(lambda: plain, json, lambda: sentences.identified(plain, written), step)
    return 0 if result.is_sound else 1


def gap(
    context: typer.Context,
    dataset: Source,
    out: MaybeFolder = None,
    quick: Annotated[
        bool,
        typer.Option(
            "--quick", help="A first answer only: calibrate, and list what may be missing; nothing is named, and -o is not written."
        ),
    ] = False,
    threads: Annotated[int | None, typer.Option(min=1, help="Threads; all cores when absent. The result does not depend on it.")] = None,
    history: HistoryFile = None,
    date: SessionDate = None,
    json: JsonFile = None,
) -> int:
    """Find where model and data disagree, name the effect that is missing, and show the gap before and after.

    Everything is chosen and fitted on the fit trials; the gap is measured on the test trials. Exit status 1 when something is left
    that no effect of the catalogue explains.
    """
    from ..io.dataset import load_dataset
    from ..report.gap import sentences
    from ..workflows.gap import calibrate, find_gap

    if quick and out is not None:
        raise BadInput("--quick", Text("-o beside it"), "--json, or nothing: a first answer has no report")
    if quick and history is not None:
        raise BadInput("--quick", Text("--history beside it"), "one of them: a first answer names nothing that could be followed")
    folder = writable(out, json, verb="gap")
    data = load_dataset(dataset)
    day = day_of(data, history, date)
    if quick:
        with console.stages("a first look") as tell:
            first = calibrate(data, threads=threads, progress=tell)
        console.warn([*data.warnings, *first.warnings])
        present(lambda: first.to_dict(command_line(context)), json, lambda: sentences.quick(first.to_dict()))
        return 0
    with console.stages("looking for what is missing") as tell:
        result = find_gap(data, threads=threads, progress=tell)
    from ..report.gap.result_files import gap_data, write_gap

    plain = gap_data(result, command_line(context))
    with kept(history, result, day, plain):
        written = write_gap(result, plain, folder) if folder else []
        console.warn([*data.warnings, *result.warnings])
        step = after_gap(plain, dataset, folder, data)
        present(lambda: plain, json, lambda: sentences.show(plain, written), step)
    return 1 if result.verdict == "unexplained" else 0


def after_gap(result: Mapping[str, Any], dataset: Path, folder: Path | None, data: Dataset) -> str:
    """Return the next step after a search: a page for the clinician only where the arm is that of a person."""
    from ..model import Subject

    if folder is None:
        return f"armrs gap {quoted(dataset)} -o gap writes a report with figures, and the amended model"
    if result["verdict"] == "unexplained":
        shown = "when and in which channel the gap is open" if result["open"] else "where model and data disagree"
        return f"{folder / 'report.html'} shows {shown}; armrs check {quoted(dataset)} lists problems of the recordings"
    if data.subject != Subject() or data.muscles:
        return f"armrs report {quoted(folder / 'gap.json')} --summary -o clinic writes one page in plain words"
    if not result["effects"]:
        return f"armrs identify {quoted(dataset)} -o identified"
    shown = f"{folder / 'report.html'} shows the gap before and after"
    driven = next((t for t in (*data.test_trials, *data.trials) if t.robot_q is not None or t.tau is not None), None)
    if driven is None or data.folder is None:
        return shown
    amended, trial = quoted(folder / "amended.toml"), quoted(data.folder / driven.file)
    return f"{shown}; armrs simulate {amended} --trial {trial} -o simulated simulates a trial with the amended model"


def passive(
    context: typer.Context,
    dataset: Source,
    out: MaybeFolder = None,
    cutoff_hz: Annotated[
        float, typer.Option(help="Cutoff of the low-pass of angles and forces [Hz], from 0.001 to below half the sample rate.")
    ] = 1.0,
    bins: Annotated[int, typer.Option(help="Angle bins over the range of a joint, 2 to 1000.")] = 24,
    history: HistoryFile = None,
    date: SessionDate = None,
    json: JsonFile = None,
) -> int:
    """Compute passive joint moments of slow movements: elastic mean and hysteresis against the angle.

    Only the weight and inertia of the model are subtracted, none of its springs, friction or other effects.

    Exit status 1 when no joint moved long enough in both directions.
    """
    from ..io.dataset import load_dataset
    from ..report import sentences
    from ..workflows.passive import passive_moments
    from ..workflows.result_data import passive_data

    folder = writable(out, json, verb="passive")
    data = load_dataset(dataset)
    day = day_of(data, history, date)
    with console.stages("passive moments") as tell:
        result = passive_moments(data, cutoff=cutoff_hz, bins=bins, progress=tell)
    plain = passive_data(result, command_line(context))
    with kept(history, result, day, plain):
        written = []
        if folder:
            from ..report.result_files import write_passive

            written = write_passive(result, plain, folder)
        console.warn([*data.warnings, *result.warnings])
        present(lambda: plain, json, lambda: sentences.passive(plain, written))
    return 0 if result.curves else 1
