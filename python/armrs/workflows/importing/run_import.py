"""The whole import: read, identify columns, decide conventions, write."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from dataclasses import replace as changed
from pathlib import Path
from typing import Any

import numpy as np

from ... import checks
from ...errors import BadInput, BadInputs, Sentence, Text, unknown_name
from ...io import files
from ...io.dataset import IMPORT_FILE, Dataset, load_dataset
from ...io.raw import RawTable
from ...io.raw.units import unit
from ...io.samples import write_samples
from ...model import Description, Model, Robot, Subject, Tolerance, TrialEntry, load_model
from ...result_warnings import with_warnings
from ...tabular import Tabular, Tidy
from ..setup_check import other_weight
from . import column_guess, conventions, file_remarks, file_roles, force_alignment, handle_positions
from . import raw_tables as raw
from .column_guess import symbol_of
from .raw_trial import LoadedTrial, arrays, by, on_clock, values
from .recipe import Channel, Convention, RawTrial, Recipe, load_recipe
from .sample_cleaning import cleaned

_SI = {"time": "s", "angle": "rad", "speed": "rad_s", "force": "N", "moment": "Nm"}
_PROBLEMS_HINT = "BadInputs.problems holds"
_READ, _DECIDED = 0.5, 0.9
"""Shares of the work after which recordings are read, and after which conventions are decided."""
_NAMED = 8
"""Columns that a line names at most."""
_About = tuple[Subject, Tolerance]
"""What a data set says besides its recordings: whose arm, and how well the devices are calibrated."""
_NOBODY: _About = (Subject(), Tolerance())


@dataclass(frozen=True)
class Imported(Tabular):
    """An imported data set.

    Attributes
    ----------
    folder : Path
        Where it was written.
    recipe : Recipe
        What was decided; `import.toml` holds it.
    notes : tuple of str
        Decisions and their reasons, a line each.
    warnings : tuple of str
        What was decided and may be wrong, a line each.
    """

    folder: Path
    recipe: Recipe
    notes: tuple[str, ...]
    warnings: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return f"Imported({str(self.folder)!r}, {len(self.recipe.trials)} trials, {self.recipe.convention.words()})"

    def tidy(self) -> Tidy:
        """Return the channels, one a row: which column became what, and why."""
        return Tidy({name: [getattr(c, name) for c in self.recipe.channels] for name in ("symbol", "column", "unit", "sign", "why")}, {})

    def to_dict(self) -> dict[str, Any]:
        """Return the result as plain data."""
        convention = self.recipe.convention
        return {
            "verb": "import",
            "folder": os.fspath(self.folder),
            "convention": {**vars(convention), "signs": list(convention.signs), "words": convention.words()},
            "channels": [dict(vars(c)) for c in self.recipe.channels],
            "trials": [dict(vars(t)) for t in self.recipe.trials],
            "notes": list(self.notes),
            "warnings": list(self.warnings),
        }


@with_warnings
def import_recordings(
    sources: Sequence[str | os.PathLike[str]],
    out: str | os.PathLike[str],
    *,
    model: Model | str | os.PathLike[str] | None = None,
    columns_map: str = "",
    angles: str | None = None,
    zero: str | None = None,
    clockwise: Sequence[int] | None = None,
    force_on: str | None = None,
    points: Sequence[str] = (),
    rate: float | None = None,
    replace: bool = False,
    progress: Callable[[str, float], None] | None = None,
) -> Imported:
    """Turn own recordings into a data set.

    Parameters
    ----------
    sources : sequence of path
        Recordings (CSV and other text, Excel, Parquet, MATLAB, MOT, STO, TRC, C3D), or one `import.toml`, which repeats an earlier import.
    out : path
        Folder of the data set.
    model : Model or path
        Literature values as `armrs init` writes them are enough: conventions are read off the balance. `[subject]` and `[tolerance]` of a
        `dataset.toml` beside it are kept. Only an `import.toml` needs none: then it is the `model.toml` beside that.
        A model without a robot gets the one that the recorded angles of a robot show (`handle.robot_of`), where they do.
    columns_map : str
        `t=COLUMN,q1=COLUMN,Fy=-COLUMN,…` for columns whose names do not show what they are; a minus turns the sign.
    angles : {"relative", "absolute"}, optional
    zero : {"horizontal", "hanging"}, optional
        Direction of the first segment at zero.
    clockwise : sequence of int, optional
        Joints whose angle is clockwise positive; an empty one states that none is.
    force_on : {"robot", "arm"}, optional
        What the recorded force acts on.
        The four above are read off the data where they are not given.
    points : sequence of str
        Markers of the joints, shoulder to handle, for C3D and TRC files. Without them the names of common marker sets are recognised.
    rate : float, optional
        Sample rate of recordings without a column of time [Hz].
    replace : bool
        Whether the data set of a former import may be replaced, whole and with what was edited in it.
    progress : callable, optional
        Called with the name of the stage and the share that is done, 0 to 1.

    Returns
    -------
    Imported

    Raises
    ------
    BadInput
        With every problem that was found (`BadInputs.problems`); nothing is written then.
    """
    checks.instance("sources", sources, list, tuple)
    paths = [checks.path("sources", source) for source in sources]
    points = checks.instances("points", points, str)
    rate = None if rate is None else checks.number("rate", rate, above=0.0, most=1e6, unit="Hz")
    if not paths:
        raise BadInput("sources", Text("nothing"), "one recording or more")
    former = _former(files.output_folder(out), checks.flag("replace", replace))
    tell = checks.progress(progress)
    loaded, about = (model, _NOBODY) if isinstance(model, Model) else _model_of(model_file(paths, model))
    if _is_recipe(paths):
        recipe = load_recipe(paths[0])
        reads = _reread(recipe, paths[0].parent)
        notes, doubts = [f"as {paths[0]} says"], list[str]()
    else:
        given = _given(angles, zero, clockwise, force_on, loaded.n_joints)
        recipe, reads, notes, doubts = _decided(paths, loaded, column_guess.parse_map(columns_map), given, tuple(points), rate, tell)
    reads = [changed(read, trial=changed(read.trial, remarks=_remarks(read, recipe.channels))) for read in reads]
    recipe = changed(recipe, trials=tuple(changed(t, remarks=r.trial.remarks) for t, r in zip(recipe.trials, reads, strict=True)))
    loaded, said = _led(loaded, recipe, reads)
    tell("writing", _DECIDED)
    folder = files.output_folder(out)
    doubts += _other_unit(_write(folder, former, loaded, recipe, reads, about))
    return Imported(folder, recipe, (*notes, *said), tuple(doubts))


def _other_unit(dataset: Dataset) -> list[str]:
    """Return that the weight of the arm shows another unit of the forces: in small movements springs and constant moments balance any."""
    weight = other_weight(dataset)
    return [str(weight)] if weight is not None and weight.units else []


def _model_of(file: Path) -> tuple[Model, _About]:
    return load_model(file), _about_of(file)


def _is_recipe(paths: Sequence[Path]) -> bool:
    return len(paths) == 1 and paths[0].suffix.lower() == ".toml"


def model_file(sources: Sequence[str | os.PathLike[str]], model: str | os.PathLike[str] | None) -> Path:
    """Return the model of an import: the one given, or the `model.toml` beside the only `import.toml`."""
    paths = [Path(source) for source in sources]
    if model is None and not _is_recipe(paths):
        raise BadInput("model", Text("nothing"), "--model with the model.toml of the arm, as armrs init writes it")
    return paths[0].parent / "model.toml" if model is None else checks.path("model", model, Model)


def _about_of(model: Path) -> _About:
    """Return `[subject]` and `[tolerance]` of the data set that a model lies in, as `armrs init` writes it."""
    path = model.parent / "dataset.toml"
    if not path.is_file():
        return _NOBODY
    found = Description.load(path)
    mine = found.model is not None and (path.parent / found.model).resolve() == model.resolve()
    return (found.subject, found.tolerance) if mine else _NOBODY


def _led(model: Model, recipe: Recipe, reads: Sequence[LoadedTrial]) -> tuple[Model, list[str]]:
    """Return a model with the robot that the recorded angles show, where it has none, and remarks on that."""
    channels = recipe.channels
    if model.robot is not None or not {"qr1", "qr2"} <= {c.symbol for c in channels}:
        return model, []
    pairs = []
    for read in reads:
        _, raw_angles, force = arrays(read, channels, model.n_joints)
        q = conventions.to_model_angles(raw_angles, recipe.convention)
        on_arm = force if force is None or recipe.convention.force_on == "arm" else -force
        pairs.append((q, np.column_stack([values(read.table, by(channels, f"qr{j}")) for j in (1, 2)]), on_arm))
    robot, apart = handle_positions.robot_of(model, pairs)
    off = f"{1e3 * apart:.1f} mm (root mean square)"
    if robot is None:
        said = f"hand and handle are {off} apart with the robot that suits best. Are its angles counted as armrs does (docs/files.md)?"
        return model, [f"[robot]: not in the model, and not to be estimated from the angles: {said}"]
    lengths, base = (" and ".join(f"{v:.3f}" for v in values) for values in (robot.lengths, robot.base))
    found = f"links of {lengths} m, base {base} m forward and up of that of the arm, elbow {robot.elbow}; hand and handle then {off} apart"
    return model.replace(robot=robot), [f"[robot]: not in the model, so estimated from the angles: {found}. Compare it with your robot"]


def _given(angles: str | None, zero: str | None, clockwise: Sequence[int] | None, force_on: str | None, n_joints: int) -> dict[str, object]:
    given: dict[str, object] = {}
    if angles is not None:
        given["reference"] = checks.choice("angles", angles, ("relative", "absolute"))
    if zero is not None:
        given["zero"] = checks.choice("zero", zero, ("horizontal", "hanging"))
    if clockwise is not None:
        checks.instance("clockwise", clockwise, list, tuple)
        numbers = [checks.whole("clockwise", j, least=1, most=n_joints) for j in clockwise]
        given["signs"] = tuple(-1 if j in numbers else 1 for j in range(1, n_joints + 1))
    if force_on is not None:
        given["force_on"] = checks.choice("force_on", force_on, ("robot", "arm"))
    return given


def _decided(
    paths: Sequence[Path],
    model: Model,
    mapped: Mapping[str, tuple[str, int]],
    given: Mapping[str, object],
    points: tuple[str, ...],
    rate: float | None,
    tell: Callable[[str, float], None],
) -> tuple[Recipe, list[LoadedTrial], list[str], list[str]]:
    """Return the contents of all files; every problem is collected before any is raised."""
    problems: list[BadInput] = []
    sought = 0 if any(symbol.startswith("q") for symbol in mapped) else model.n_joints
    sources = raw.read_all(paths, points, sought, problems, lambda stage, share: tell(stage, _READ * share))
    tables = sources.tables
    mapped_tables = [part for table in tables for part in cleaned(_renamed(table, mapped), rate, sources.notes)]
    named, left, roles = file_roles.arrange(mapped_tables)
    seen = next((t for t in left if t.markers is not None), None)
    if seen is not None and seen.markers is not None and not sources.points:
        names = ", ".join(dict.fromkeys(name.rpartition(":")[2] for name in seen.markers.names))
        wanted = f"{model.n_joints + 1} markers, of the joints from the shoulder on and of the handle, of {names}"
        problems.append(BadInput("--points", Text("nothing"), wanted, file=seen.path))
        left = [t for t in left if t.markers is None]
    elif not tables and not problems:
        found = Text("no recording of a movement" if sources.notes else "only a file that accompanies another recording")
        problems.append(BadInput("file", found, "the recording of the movement", file=paths[0], hint="; ".join(sources.notes) or None))
    elif not named:
        for table in mapped_tables[:1]:
            _complete(column_guess.guess([table], _present(mapped, table), problems), model.n_joints, table, problems)
    if not named:
        raise BadInputs.of(problems, _PROBLEMS_HINT)
    for table in left:
        if table.path in sources.in_folders:
            sources.notes.append(f"left out, since it holds neither joint angles nor forces: {table.path}")
        else:
            problems.append(BadInput("file", Text("neither joint angles nor forces"), "columns of one of them", file=table.path))
    named, projected = _in_plane(named, mapped)
    if all(n.table.plane is not None for n in named):
        given = {**given, conventions.OF_MARKERS: True}
    of_files = len(problems)  # files that are left out as a whole do not prevent the check of others
    channels = column_guess.guess([n.table for n in named], _present(mapped, named[0].table), problems)
    force_tables = [n.forces for n in named if n.forces is not None]
    if force_tables:
        own = column_guess.guess(force_tables, _present(mapped, force_tables[0]), problems)
        channels = [
            *channels,
            *(c for c in own if c.symbol[0] in "FM"),
            *(changed(c, symbol="t of forces") for c in own if c.symbol == "t"),
        ]
    _every_name_known(mapped, tables, problems)
    channels, partial = _whole(channels, model.n_joints)
    channels, axes = column_guess.plane(channels, force_tables or [n.table for n in named])
    _complete(channels, model.n_joints, named[0].table, problems)
    _alike([n.table for n in named], [c for c in channels if not force_tables or c.symbol[0] not in "FM"], problems)
    _alike(force_tables, [c for c in channels if c.symbol[0] in "FM"], problems)
    if len(problems) > of_files:
        raise BadInputs.of(problems, _PROBLEMS_HINT)
    tell("finding clocks and conventions", _READ)
    reads = force_alignment.aligned(named, channels, model, given, problems)
    clocks, doubts = list[str](), list[str]()
    if any(c.symbol == "Fy" for c in channels):
        reads, convention, clocks, doubts = force_alignment.settled(reads, channels, model, given, problems)
    else:
        signs = given.get("signs", (1,) * model.n_joints)
        why = "no contact force, so the balance cannot be used: the angles are taken in the convention of armrs"
        convention = Convention(str(given.get("reference", "relative")), str(given.get("zero", "horizontal")), signs, None, why)  # type: ignore[arg-type]
    if problems:
        raise BadInputs.of(problems, _PROBLEMS_HINT)
    origin = _origin(reads, channels, convention, model, axes)
    recipe = Recipe(tuple(channels), convention, tuple(r.trial for r in reads), sources.points, origin, rate)
    notes = [*sources.notes, *file_remarks.said(tables), *projected, *axes, *partial]
    notes += [f"{c.symbol}: column {c.column!r}, {c.why}" for c in channels]
    notes += _unused([t for n in named for t in (n.table, n.forces) if t is not None], channels)
    notes += [f"{convention.words()}: {convention.why}", f"roles: {roles}"]
    return recipe, reads, [*notes, *clocks], doubts


def _in_plane(named: Sequence[file_roles.Named], mapped: Mapping[str, object]) -> tuple[list[file_roles.Named], list[str]]:
    """Return trials with the forces of other files in the plane that their markers show, and remarks on it; mapped forces stay."""
    if any(symbol.startswith("F") for symbol in mapped):
        return list(named), []
    found = [n if n.forces is None else changed(n, forces=raw.in_plane(n.forces, n.table)) for n in named]
    # Remarks of their reader are given with all tables.
    told = [
        changed(after.forces, notes=after.forces.notes[len(before.forces.notes) :], remarks=())
        for before, after in zip(named, found, strict=True)
        if before.forces is not None and after.forces is not None
    ]
    return found, file_remarks.said(told)


def _alike(tables: Sequence[RawTable], channels: Sequence[Channel], problems: list[BadInput]) -> None:
    """Refuse tables that lack a column of the first, or have it in another unit: the one that it is in, or that its header states."""
    stated_first = {c.name: stated.text for table in tables[:1] for c in table.columns if (stated := unit(c.unit)) is not None}
    for table in tables[1:]:
        for channel in channels:
            if channel.symbol == "t of forces":
                continue
            there = table.find(channel.column)
            if there is None:
                found = Text(f"no column {channel.column!r}")
                problems.append(BadInput("columns", found, f"the columns of the first file: this one is {channel.symbol}", file=table.path))
                continue
            stated = unit(there.unit)
            if stated is not None and stated.text not in (channel.unit, stated_first.get(channel.column)):
                place, allowed = f"column {there.name!r}", f"{channel.unit}, as in the first file"
                problems.append(BadInput(place, there.unit, allowed, file=table.path, hint="import it by itself"))
            elif channel.symbol == "t" and (back := np.flatnonzero(np.diff(there.values) <= 0.0)).size:
                problems.append(column_guess.went_back(channel.column, there.values, int(back[0]), table))
            elif channel.symbol == "t" and not column_guess.is_clock(there.values, channel.unit):
                place, allowed = f"column {there.name!r}", f"time in {channel.unit}, as in the first file"
                problems.append(BadInput(place, Text("time stamps that are not"), allowed, file=table.path, hint="import it by itself"))


def _origin(
    reads: Sequence[LoadedTrial], channels: Sequence[Channel], convention: Convention, model: Model, notes: list[str]
) -> tuple[float, float] | None:
    """Return the origin of the handle's positions, None where there are none or the model has no robot."""
    if not {"Py", "Pz"} <= {c.symbol for c in channels} or any(c.symbol == "qr1" for c in channels):
        return None
    if model.robot is None:
        adds = "armrs init --robot-lengths-m A,B --robot-base-m Y,Z adds it"
        notes.append(f"positions of the handle: not used, since the model has no [robot] whose angles they would tell; {adds}")
        return None
    pairs = [
        (conventions.to_model_angles(arrays(read, channels, model.n_joints)[1], convention), _positions(read, channels)) for read in reads
    ]
    y, z = handle_positions.origin(model, pairs)
    place = f"their origin lies at ({y:.3f}, {z:.3f}) m from that of the model, as the angles of the arm say" if y or z else "as recorded"
    notes.append(f"qr1, qr2: from the positions of the handle, {place}")
    return y, z


def _positions(read: LoadedTrial, channels: Sequence[Channel]) -> np.ndarray:
    return np.column_stack([values(read.table, by(channels, symbol)) for symbol in ("Py", "Pz")])


def _unused(tables: Sequence[RawTable], channels: Sequence[Channel]) -> list[str]:
    """Return a line that names the columns of which nothing is read; none where there are none."""
    used = [table.find(channel.column) for table in tables for channel in channels]
    names = list(dict.fromkeys(c.name for table in tables for c in table.columns if not any(c is one for one in used)))
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    return [f"not used: {', '.join(repr(name) for name in names[:_NAMED])}{more}"] if names else []


def _renamed(table: RawTable, mapped: Mapping[str, tuple[str, int]]) -> RawTable:
    """Return a table whose mapped columns carry their symbols as labels, so that they are recognised everywhere."""
    symbols = {name: symbol for symbol, (name, _) in mapped.items()}
    renamed = tuple(changed(c, label=symbols.get(c.name, symbols.get(c.label, c.label))) for c in table.columns)
    return changed(table, columns=renamed)


def _present(mapped: Mapping[str, tuple[str, int]], table: RawTable) -> dict[str, tuple[str, int]]:
    """Return what is mapped to columns of this table, by their full names."""
    labels = {c.label: c.name for c in table.columns}
    names = {c.name for c in table.columns}
    found = {}
    for symbol, (name, sign) in mapped.items():
        full = labels.get(symbol, name)
        if full in names:
            found[symbol] = (full, sign)
    return found


def _every_name_known(mapped: Mapping[str, tuple[str, int]], tables: Sequence[RawTable], problems: list[BadInput]) -> None:
    """Refuse a name of `--map` that no table has; beside a column that is recognised by itself it would be passed over."""
    known = {name for table in tables for c in table.columns for name in (c.name, c.label)}
    for name, _ in mapped.values():
        if name not in known:
            problems.append(unknown_name("--map", name, {c.name for table in tables for c in table.columns}, what="column"))


def _whole(channels: Sequence[Channel], n_joints: int) -> tuple[list[Channel], list[str]]:
    """Return channels without speeds and torques that are there for some joints only, and a line for those."""
    kept, notes = list(channels), []
    for kind, said in (("dq", "speeds"), ("tau", "torques")):
        own = [c for c in channels if c.symbol.removeprefix(kind).isdigit()]
        if own and {c.symbol for c in own} != {f"{kind}{j}" for j in range(1, n_joints + 1)}:
            kept = [c for c in kept if c not in own]
            notes.append(f"{said} of some joints only, so not used: {', '.join(repr(c.column) for c in own)}")
    return kept, notes


def _complete(channels: Sequence[Channel], n_joints: int, table: RawTable, problems: list[BadInput]) -> None:
    symbols = {c.symbol for c in channels}
    # A column that was refused for its unit or its values is not missing.
    refused = {symbol_of(c) for c in table.columns for p in problems if repr(c.name) in p.place}
    offered = ", ".join(repr(c.name) for c in table.columns)
    angles = [f"q{j}" for j in range(1, n_joints + 1)]
    there = [symbol for symbol in angles if symbol in symbols]
    if 0 < len(there) < n_joints and there == angles[: len(there)]:
        found, allowed = Text(f"angles of {len(there)} joint{'s' * (len(there) > 1)}"), f"{n_joints}, as the model has"
        hint = f"a model of {len(there)}: armrs init --lengths-m {','.join('?' * len(there))}; or --map {angles[len(there)]}=COLUMN"
        problems.append(BadInput("columns", found, allowed, file=table.path, hint=hint))
        angles = there
    needed = ["t", *angles]
    if symbols & {"Fy", "Fz"} or not any(s.startswith("tau") for s in symbols):
        needed += ["Fy", "Fz"]
    lacking = [symbol for symbol in needed if symbol not in symbols and symbol not in refused]
    if lacking:
        found = Text(f"no column for {', '.join(lacking)}")
        even = ", or --rate-hz HZ for samples at a constant rate" if "t" in lacking else ""
        hint = f"--map {','.join(f'{symbol}=COLUMN' for symbol in lacking)}{even}"
        problems.append(BadInput("columns", found, f"columns for these; there are {offered}", file=table.path, hint=hint))
    for c in channels:
        number = c.symbol.removeprefix("q")
        if number.isdigit() and int(number) > n_joints:
            found, allowed = Text(f"an angle of joint {number} ({c.column!r})"), f"{n_joints} joints, as the model has"
            problems.append(BadInput("columns", found, allowed, file=table.path))


def _remarks(read: LoadedTrial, channels: Sequence[Channel]) -> tuple[str, ...]:
    """Return the remarks beside the samples of a trial, on the clock of its angles."""
    own = file_remarks.timed(read.table, values(read.table, by(channels, "t")))
    if read.forces is None:
        return own
    return (*own, *file_remarks.timed(read.forces, values(read.forces, by(channels, "t of forces")) + read.trial.force_shift))


def _reread(recipe: Recipe, folder: Path) -> list[LoadedTrial]:
    """Return the trials of a recipe with their tables."""
    problems: list[BadInput] = []
    reads = []
    clocks = {c.symbol[:1]: (c.column, 1) for c in recipe.channels if c.symbol in ("t", "t of forces")}

    def table_of(file: str, title: str | None, points: tuple[str, ...]) -> RawTable:
        tables = [part for t in raw.read(Path(file), points) for part in cleaned(_renamed(t, clocks), recipe.rate, [])]
        found = next((t for t in tables if title in (t.title, None)), None)
        if found is None:
            raise BadInput("table", title, "the title of a table in it", file=file)
        return found

    for kept in recipe.trials:
        forces = kept.force_file and os.fspath(folder / kept.force_file)
        trial = changed(kept, file=os.fspath(folder / kept.file), force_file=forces)
        try:
            table = table_of(trial.file, trial.table, recipe.points)
            own = table_of(trial.force_file, trial.force_table, ()) if trial.force_file else None
            if own is not None and any(own.find(c.column) is None for c in recipe.channels if c.symbol == "Fy"):
                own = raw.in_plane(own, table)
            reads.append(LoadedTrial(trial, table, own))
        except BadInput as error:
            problems.append(error)
    if problems:
        raise BadInputs.of(problems, _PROBLEMS_HINT)
    return reads


def _write(folder: Path, former: set[str], model: Model, recipe: Recipe, reads: Sequence[LoadedTrial], about: _About) -> Dataset:
    """Write the data set whole or not at all, with `import.toml` in it, without other trials of a former import, and return it."""
    kept = changed(recipe, trials=tuple(_relative_to(folder, read.trial) for read in reads))
    datasets = []

    def write(part: Path) -> list[Path]:
        written = []
        entries = []
        for read in reads:
            name = _name_of(read.trial)
            table = _si_columns(read, recipe, model.n_joints, model.robot)
            (part / name).parent.mkdir(exist_ok=True)
            write_samples(part / name, list(table), list(table.values()))
            written.append(part / name)
            entries.append(TrialEntry(name, read.trial.configuration, read.trial.repeat, read.trial.role))
        model.write(part / "model.toml")
        force_on, (subject, tolerance) = recipe.convention.force_on, about
        content = Description(folder.resolve().name, "model.toml", entries, force_on=force_on, subject=subject, tolerance=tolerance)
        files.write_text(part / "dataset.toml", content.to_toml(), kind=".toml")
        files.write_text(part / IMPORT_FILE, kept.to_toml(), kind=".toml")
        try:
            datasets.append(load_dataset(part))
        except BadInput as error:  # what could not be read again is not written
            problems = error.problems if isinstance(error, BadInputs) else (error,)
            raise BadInputs.of([p.within(file=folder / Path(p.file or part).relative_to(part)) for p in problems]) from None
        return [*written, part / "model.toml", part / "dataset.toml", part / IMPORT_FILE]

    written = files.write_whole(folder, write)
    for name in former - {path.relative_to(folder).as_posix() for path in written}:
        (folder / name).unlink(missing_ok=True)
    return datasets[0]


def _former(folder: Path, replaced: bool) -> set[str]:
    """Return the trials that a former import left in a folder, where it may be replaced; a data set of another origin never may."""
    if not (folder / "dataset.toml").exists():
        return set()
    if not (folder / IMPORT_FILE).is_file():
        raise BadInput("-o", Sentence("this folder holds a data set that armrs import did not write"), files.ANOTHER, file=folder)
    if not replaced:
        instead = f"{files.ANOTHER}, or --force, which replaces it whole, with all that was edited in it"
        raise BadInput("-o", Sentence("this folder holds the data set of a former import"), instead, file=folder)
    return {_name_of(trial) for trial in load_recipe(folder / IMPORT_FILE).trials}


def _name_of(trial: RawTrial) -> str:
    """Return the file of a trial below the data set."""
    return f"trials/{trial.configuration}_{trial.repeat}.csv"


def _relative_to(folder: Path, trial: RawTrial) -> RawTrial:
    """Return a trial whose files are named relative to the folder that `import.toml` is in."""
    here = folder.resolve()
    force_file = None if trial.force_file is None else os.path.relpath(Path(trial.force_file).resolve(), here)
    return changed(trial, file=os.path.relpath(Path(trial.file).resolve(), here), force_file=force_file)


def _si_columns(read: LoadedTrial, recipe: Recipe, n_joints: int, robot: Robot | None) -> dict[str, np.ndarray]:
    """Return the columns of a trial file: SI units, the angles of armrs, the sign of `force_on`."""
    t, q, force = arrays(read, recipe.channels, n_joints)
    angles = conventions.to_model_angles(q, recipe.convention)
    table = {"t_s": t} | {f"q{j}_rad": np.ascontiguousarray(angles[:, j - 1]) for j in range(1, n_joints + 1)}
    if force is not None:
        table |= {"Fy_N": np.ascontiguousarray(force[:, 0]), "Fz_N": np.ascontiguousarray(force[:, 1])}
    if any(c.symbol == "dq1" for c in recipe.channels):
        raw = np.column_stack([values(read.table, by(recipe.channels, f"dq{j}")) for j in range(1, n_joints + 1)])
        speeds = conventions.to_model_speeds(raw, recipe.convention)
        table |= {f"dq{j}_rad_s": np.ascontiguousarray(speeds[:, j - 1]) for j in range(1, n_joints + 1)}
    if recipe.origin is not None and robot is not None:
        angles = handle_positions.robot_angles(robot, _positions(read, recipe.channels) + recipe.origin)
        table |= {f"qr{j}_rad": np.ascontiguousarray(angles[:, j - 1]) for j in (1, 2)}
    for channel in recipe.channels:
        symbol = channel.symbol
        if symbol in ("t", "t of forces", "Fy", "Fz", "Py", "Pz") or (symbol[0] == "q" and symbol[1:].isdigit()):
            continue
        own = on_clock(read, t, recipe.channels, symbol)
        if symbol.startswith("dq"):
            continue
        if symbol.startswith("tau"):
            own = own * recipe.convention.signs[int(symbol[-1]) - 1]
        table[symbol if symbol.startswith("emg_") else f"{symbol}_{_SI[column_guess.dimension_of(symbol)]}"] = own
    return table
