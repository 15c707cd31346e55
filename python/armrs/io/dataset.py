"""A data set: a folder with `dataset.toml`, a model and trials."""

from __future__ import annotations

import dataclasses
import math
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .. import checks
from ..errors import ArmrsError, BadInput, Text, unknown_name
from ..model import Model, load_model, part_of
from . import files, tomlfile
from .muscle_activity import comparable, mark_activity
from .plausibility import still_angles
from .samples import SUFFIXES, write_samples
from .trial import FEWEST_SAMPLES, Trial, read_trial

FILE = "dataset.toml"


@dataclass(frozen=True)
class Subject:
    """Whose arm it is; body mass, height and sex are used for the literature values, the name for a history.

    Attributes
    ----------
    name : str, optional
    body_mass : float, optional
        [kg]
    height : float, optional
        [m]
    sex : {"male", "female"}, optional
    """

    body_mass: float | None = None
    height: float | None = None
    sex: str | None = None
    name: str | None = None

    def __post_init__(self) -> None:
        if self.name is not None:
            checks.text("name", self.name)
        if self.body_mass is not None:
            mass = checks.number("body_mass", self.body_mass, least=1.0, most=500.0, unit="kg")
            object.__setattr__(self, "body_mass", mass)
        if self.height is not None:
            height = checks.number("height", self.height, least=0.3, most=3.0, unit="m", hint="centimetres?")
            object.__setattr__(self, "height", height)
        if self.sex is not None:
            checks.choice("sex", self.sex, ("male", "female"))


_MOST = {"angle_offset_deg": 180.0, "force_bias_N": 1e4, "force_gain": 10.0, "time_delay_s": 10.0, "handle_placement_m": 10.0}
"""What no calibration promises less than."""


@dataclass(frozen=True)
class Tolerance:
    """What the calibration promises. Smaller deviations are absorbed and reported, larger ones are named.

    Attributes
    ----------
    angle_offset_deg : float
        [deg]; `angle_offset` is the same in radians.
    force_bias_N : float
        [N]
    force_gain : float
        Relative.
    time_delay_s : float
        Force against angles [s].
    handle_placement_m : float
        [m]
    """

    angle_offset_deg: float = 0.3
    force_bias_N: float = 0.2
    force_gain: float = 0.01
    time_delay_s: float = 0.005
    handle_placement_m: float = 0.001

    def __post_init__(self) -> None:
        for f in dataclasses.fields(self):
            object.__setattr__(self, f.name, checks.number(f.name, getattr(self, f.name), least=0.0, most=_MOST[f.name]))

    @property
    def angle_offset(self) -> float:
        """Offset of an angle sensor [rad]."""
        return math.radians(self.angle_offset_deg)


@dataclass(frozen=True)
class Added:
    """A mass that is fixed to a segment in some configurations, such as one part of an orthosis.

    Attributes
    ----------
    segment : int
        Number of the segment, from 1.
    mass : float
        [kg]
    at : float
        From the segment's proximal joint [m].
    configurations : tuple of str
        Where it is worn.
    """

    segment: int
    mass: float
    at: float
    configurations: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        checks.whole("segment", self.segment, least=1)
        object.__setattr__(self, "mass", checks.number("mass", self.mass, above=0.0, most=20.0, unit="kg"))
        object.__setattr__(self, "at", checks.number("at", self.at, least=0.0, most=2.0, unit="m", hint="millimetres?"))
        names: object = self.configurations
        if not isinstance(names, (list, tuple)) or not all(isinstance(name, str) for name in names):
            raise BadInput("configurations", names, "a list of names")
        object.__setattr__(self, "configurations", tuple(names))


@dataclass(frozen=True, eq=False)
class Dataset:
    """A model and the trials that challenge it.

    Attributes
    ----------
    name : str
    model : Model
    trials : tuple of Trial
        In the order of the file, those without a single sample left out.
    force_on : {"robot", "arm"} or None
        What the forces in the files act on. In the trials they are forces on the arm, whatever this says.
    sample_rate : float or None
        As stated [Hz].
    subject : Subject
    tolerance : Tolerance
    folder : Path or None
        Where it was read.
    model_path : Path or None
        Where the model was read.
    warnings : tuple of str
        What the user should know, one line each.
    synthetic : bool
        Whether the trials were simulated; reports say so.
    added : tuple of Added
        Masses that are worn in some configurations besides the model.
    """

    name: str
    model: Model
    trials: tuple[Trial, ...]
    force_on: str | None = None
    sample_rate: float | None = None
    subject: Subject = Subject()
    tolerance: Tolerance = Tolerance()
    folder: Path | None = None
    model_path: Path | None = None
    warnings: tuple[str, ...] = ()
    synthetic: bool = False
    added: tuple[Added, ...] = ()

    def __post_init__(self) -> None:
        checks.instance("model", self.model, Model)
        trials = checks.instances("trials", self.trials, Trial)
        for trial in trials:
            if trial.q.shape[1] != self.model.n_joints:
                raise BadInput("angles", Text(f"{trial.q.shape[1]} joints"), f"{self.model.n_joints}, as the model has", file=trial.file)
        if self.force_on is not None:
            checks.choice("force_on", self.force_on, ("robot", "arm"))
        if self.sample_rate is not None:
            checks.number("sample_rate", self.sample_rate, above=0.0, unit="Hz")
        checks.instance("subject", self.subject, Subject)
        checks.instance("tolerance", self.tolerance, Tolerance)
        for name in ("folder", "model_path"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, checks.path(name, getattr(self, name)))
        object.__setattr__(self, "name", checks.text("name", self.name))
        object.__setattr__(self, "trials", trials)
        object.__setattr__(self, "warnings", checks.instances("warnings", self.warnings, str))
        object.__setattr__(self, "synthetic", checks.flag("synthetic", self.synthetic))
        object.__setattr__(self, "added", checks.instances("added", self.added, Added))

    @property
    def fit_trials(self) -> tuple[Trial, ...]:
        """Trials on which things may be chosen and fitted."""
        return tuple(trial for trial in self.trials if trial.role == "fit")

    @property
    def test_trials(self) -> tuple[Trial, ...]:
        """Trials on which nothing is chosen or fitted."""
        return tuple(trial for trial in self.trials if trial.role == "test")

    def __repr__(self) -> str:
        counts = f"{len(self.fit_trials)} fit and {len(self.test_trials)} test trials"
        return f"Dataset({self.name!r}, {self.model.n_joints} joints, {counts}, {len(self.warnings)} warnings)"

    def model_of(self, configuration: str) -> Model:
        """Return the model with what was worn in a configuration."""
        model = self.model
        for item in self.added:
            if configuration in item.configurations:
                model = model.with_mass(item.segment, item.mass, item.at)
        return model

    def replace(self, **changes: Any) -> Dataset:
        """Return a data set with some attributes changed."""
        return dataclasses.replace(self, **changes)


@dataclass(frozen=True)
class Entry:
    """What `dataset.toml` says of one trial."""

    file: str
    configuration: str
    repeat: int
    role: str


@dataclass(frozen=True)
class Description:
    """The content of `dataset.toml`, before any trial is read."""

    path: Path
    name: str
    model: str
    entries: tuple[Entry, ...]
    force_on: str | None
    sample_rate: float | None
    subject: Subject
    tolerance: Tolerance
    synthetic: bool
    added: tuple[Added, ...]

    @property
    def model_path(self) -> Path:
        """Where the model is."""
        return self.path.parent / self.model

    def trial_path(self, entry: Entry) -> Path:
        """Where a trial is."""
        return self.path.parent / entry.file


def load_dataset(source: str | os.PathLike[str]) -> Dataset:
    """Read a data set: check it, bring it to SI units, to forces on the arm, and to uniform time.

    Parameters
    ----------
    source : path
        The folder, or its `dataset.toml`.

    Returns
    -------
    Dataset

    Raises
    ------
    BadInput
        Names the file, the place, the value found and the value allowed.

    Notes
    -----
    Uneven time stamps are resampled at the median rate, see `armrs.io.resample`; the samples as read stay in `Trial.original`.
    Missing samples are bridged over at most 0.25 s; longer gaps stay NaN and are reported in `warnings`.
    """
    description = describe(source)
    model_path = description.model_path
    model = load_model(model_path)
    for number, item in enumerate(description.added, start=1):
        _on(model, item, f"[[added]] {number}", description.path)
    trials: list[Trial] = []
    warnings = list(model.warnings)
    for entry in description.entries:
        path = description.trial_path(entry)
        try:
            reading = read_trial(
                path,
                n_joints=model.n_joints,
                force_on=description.force_on,
                sample_rate=description.sample_rate,
                **dataclasses.asdict(entry),
            )
            if reading is None:
                refusal = BadInput("file", Text("no samples below the header"), f"at least {FEWEST_SAMPLES} samples")
                if entry.role == "fit":
                    raise refusal
                warnings.append(f"{refusal.within(file=entry.file)}: this test trial is left out")
                continue
        except BadInput as error:
            raise error.within(file=path) from None
        trials.append(reading.trial)
        warnings += [f"{entry.file}: {line}" for line in reading.warnings]
    marked, lines = mark_activity(trials)
    warnings += lines
    return Dataset(
        name=description.name,
        model=model,
        trials=comparable(marked),
        force_on=description.force_on,
        sample_rate=description.sample_rate,
        subject=description.subject,
        tolerance=description.tolerance,
        folder=description.path.parent,
        model_path=model_path,
        warnings=(*warnings, *still_angles(tuple(trials))),
        synthetic=description.synthetic,
        added=description.added,
    )


def _on(model: Model, item: Added, place: str, file: Path) -> None:
    """Refuse a mass that is on no segment of a model."""
    try:
        checks.whole("segment", item.segment, least=1, most=model.n_joints)
        model.with_mass(item.segment, item.mass, item.at)
    except BadInput as error:
        raise error.within(place=place, file=file) from None


@contextmanager
def naming_trials(trials: Sequence[Trial]) -> Iterator[None]:
    """Let errors of the core, which counts trials, name their files."""
    try:
        yield
    except ArmrsError as error:
        if error.trial is None:
            raise
        file = trials[error.trial].file
        raise error.within(file=file) if isinstance(error, BadInput) else type(error)(f"{file}: {error}") from None


def describe(source: str | os.PathLike[str]) -> Description:
    """Read `dataset.toml` alone."""
    path = checks.path("source", source)
    if not os.path.lexists(path):
        raise BadInput("file", Text("No such file or directory"), f"a folder with {FILE}, or that file", file=source)
    trial = path.suffix.lower() in SUFFIXES and path.is_file()
    if trial or (path.is_dir() and not os.path.lexists(path / FILE)):
        above = next((folder for folder in (path.parent, path.parent.parent) if (folder / FILE).is_file()), None)
        hint = None if above is None else f"that is {above}"
        found = "a trial" if trial else "a folder that holds no data set"
        raise BadInput("file", Text(found), f"the folder of {'its' if trial else 'a'} data set, with {FILE}", file=source, hint=hint)
    path = path / FILE if path.is_dir() else path
    with suppress(OSError):  # a data set may lie where nothing can be written
        files.recover(path.parent)
    return tomlfile.load(path, _description)


def _description(document: dict[str, Any], path: Path) -> Description:
    optional = ["name", "force_on", "sample_rate", "synthetic", "subject", "tolerance", "added"]
    checks.keys("", document, required=["model", "trial"], optional=optional)
    tables = checks.tables("trial", document["trial"])
    entries = tuple(_entry(f"[[trial]] {k}", table) for k, table in enumerate(tables, 1))
    _check_entries(entries)
    rate = document.get("sample_rate")
    force_on = document.get("force_on")
    return Description(
        path=path,
        name=checks.text("name", document.get("name", path.resolve().parent.name or "data set")),
        model=checks.text("model", document["model"]),
        entries=entries,
        force_on=None if force_on is None else checks.choice("force_on", force_on, ("robot", "arm")),
        sample_rate=None if rate is None else checks.number("sample_rate", rate, above=0.0, most=1e6, unit="Hz"),
        subject=part_of(Subject, "[subject]", document.get("subject", {})),
        tolerance=part_of(Tolerance, "[tolerance]", document.get("tolerance", {})),
        added=_added(document.get("added", []), entries),
        synthetic=checks.flag("synthetic", document.get("synthetic", False)),
    )


def _added(tables: object, entries: tuple[Entry, ...]) -> tuple[Added, ...]:
    known = {entry.configuration for entry in entries}
    added: list[Added] = []
    for number, table in enumerate(checks.tables("added", tables), start=1):
        item: Added = part_of(Added, f"[[added]] {number}", table)
        for name in item.configurations:
            if name not in known:
                raise unknown_name(f"[[added]] {number}, configurations", name, known, what="configuration")
        added.append(item)
    return tuple(added)


def _entry(place: str, table: dict[str, Any]) -> Entry:
    checks.keys(place, table, required=["file", "configuration", "role"], optional=["repeat"])
    try:
        return Entry(
            file=checks.text("file", table["file"]),
            configuration=checks.text("configuration", table["configuration"]),
            repeat=checks.whole("repeat", table.get("repeat", 1), least=1),
            role=checks.choice("role", table["role"], ("fit", "test")),
        )
    except BadInput as error:
        raise error.within(place=place) from None


def _check_entries(entries: tuple[Entry, ...]) -> None:
    by_file: dict[str, int] = {}
    by_repeat: dict[tuple[str, int], int] = {}
    for number, entry in enumerate(entries, start=1):
        first = by_file.setdefault(os.path.normpath(entry.file), number)
        if first != number:
            raise BadInput(f"[[trial]] {number}, file", entry.file, f"each file once: [[trial]] {first} has it already")
        first = by_repeat.setdefault((entry.configuration, entry.repeat), number)
        if first != number:
            found = Text(f'repeat {entry.repeat} of "{entry.configuration}"')
            raise BadInput(f"[[trial]] {number}, repeat", found, f"each repeat once: [[trial]] {first} has it already")
    if not any(entry.role == "fit" for entry in entries):
        raise BadInput("[[trial]]", Text('no trial with role = "fit"'), "at least one")


def write_dataset(dataset: Dataset, folder: str | os.PathLike[str], *, suffix: str | None = None) -> Path:
    """Write a data set: `dataset.toml`, `model.toml` and the trials, in SI units and with the signs of `force_on`.

    Parameters
    ----------
    dataset : Dataset
    folder : path
        Made when it does not exist. Nothing is written outside of it.
    suffix : {".csv", ".parquet"}, optional
        Format of all trials. Without it each keeps its own.

    Returns
    -------
    Path
        The `dataset.toml` written. Everything is written or nothing.

    Notes
    -----
    Samples that were missing are written as empty cells, not as measured.
    """
    checks.instance("dataset", dataset, Dataset)
    out = files.output_folder(folder)
    if suffix is not None:
        checks.choice("suffix", suffix, SUFFIXES)
    if dataset.force_on is None and any(trial.force_on_arm is not None for trial in dataset.trials):
        dataset = dataset.replace(force_on="arm")
    names = output_names([trial.file for trial in dataset.trials], suffix)
    inputs = [] if dataset.folder is None else [dataset.folder / FILE, *(dataset.folder / t.file for t in dataset.trials)]
    inputs += [dataset.model_path] if dataset.model_path else []
    files.not_an_input([out / FILE, out / "model.toml", *(out / name for name in names)], inputs)
    entries = [Entry(name, t.configuration, t.repeat, t.role) for t, name in zip(dataset.trials, names, strict=True)]
    content = description_text(dataset, "model.toml", entries)

    def write(part: Path) -> list[Path]:
        for trial, name in zip(dataset.trials, names, strict=True):
            table = trial_columns(trial, dataset.force_on)
            write_samples(part / name, list(table), list(table.values()))
        dataset.model.write(part / "model.toml")
        files.write_text(part / FILE, content, kind=".toml")
        return [*(part / name for name in names), part / "model.toml", part / FILE]

    return files.write_whole(out, write)[-1]


def output_names(names: list[str], suffix: str | None) -> list[str]:
    """Return where below an output folder trials go: under their own names when these stay inside, else in `trials/`."""
    result: list[str] = []
    for name in names:
        path = Path(name)
        inside = not path.is_absolute() and ".." not in path.parts
        path = path if inside else Path("trials") / path.name
        path = path.with_suffix(suffix) if suffix else path
        if path.as_posix() in result:
            raise BadInput("output", path.as_posix(), "names that differ by more than suffix and folder")
        result.append(path.as_posix())
    return result


def trial_columns(trial: Trial, force_on: str | None) -> dict[str, np.ndarray]:
    """Return the columns of a trial as they stand in a file, by name; NaN where a sample was missing."""
    sign = 1.0 if force_on == "arm" else -1.0
    table: dict[str, np.ndarray] = {"t_s": trial.t}

    def add(form: str, values: np.ndarray | None) -> None:
        if values is not None:
            table.update({form.format(j + 1): values[:, j] for j in range(values.shape[1])})

    add("q{}_rad", trial.q)
    add("dq{}_rad_s", trial.dq)
    if trial.force_on_arm is not None:
        table["Fy_N"], table["Fz_N"] = sign * trial.force_on_arm.T
    if trial.moment_on_arm is not None:
        table["Mx_Nm"] = sign * trial.moment_on_arm
    add("qr{}_rad", trial.robot_q)
    add("tau{}_Nm", trial.tau)
    table.update(trial.emg)
    return {name: np.where(trial.filled_columns[name], np.nan, v) if name in trial.filled_columns else v for name, v in table.items()}


def description_text(source: Dataset | Description, model: str, entries: list[Entry]) -> str:
    """Return the text of `dataset.toml`."""
    head: dict[str, object] = {"name": source.name, "model": model, "force_on": source.force_on, "sample_rate": source.sample_rate}
    if source.synthetic:
        head["synthetic"] = True
    blocks = [tomlfile.lines(head)]
    subject = tomlfile.lines(dataclasses.asdict(source.subject))
    if subject:
        blocks.append(["[subject]", *subject])
    if source.tolerance != Tolerance():
        blocks.append(["[tolerance]", *tomlfile.lines(dataclasses.asdict(source.tolerance))])
    blocks += [["[[added]]", *tomlfile.lines(dataclasses.asdict(item))] for item in source.added]
    blocks += [["[[trial]]", *tomlfile.lines(dataclasses.asdict(entry))] for entry in entries]
    return "\n\n".join("\n".join(block) for block in blocks) + "\n"
