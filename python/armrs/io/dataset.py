"""A data set: a folder with `dataset.toml`, a model and trials."""

from __future__ import annotations

import dataclasses
import hashlib
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from .. import checks
from ..anthropometry import literature_model
from ..errors import NO_FILE, ArmrsError, BadInput, BadInputs, Text, nearest
from ..model import AddedMass, Description, Model, Muscle, Subject, Tolerance, TrialEntry, load_model
from ..result_warnings import with_warnings
from ..tabular import Framed, Labelled, Series, Tidy, over_trials
from . import files
from .dataset_errors import dataset_errors_of
from .muscle_activity import channel_faults, joint_activity, mark_activity
from .samples import SUFFIXES, write_samples
from .trial import FEWEST_SAMPLES, Reading, Trial, moving_bases, read_trial, still_angles

FILE = "dataset.toml"
IMPORT_FILE = "import.toml"
"""Beside it, the decisions of `armrs import` where that wrote the data set."""
NO_MODEL = "no model is named: the arm is that of the subject by the literature (de Leva 1996)"

_MOST_SEGMENTS = 3
"""Of an arm that is simulated, identified and searched; `each_short_length` of the core has the same limit."""


_CHANNELS = {
    "q": ("joint", "rad"), "dq": ("joint", "rad/s"), "tau": ("joint", "N m"), "force_on_arm": ("axis", "N"), "base": ("axis", "m"),
    "moment_on_arm": ("", "N m"), "robot_q": ("robot_joint", "rad"), "activity": ("joint", "1"),
}  # fmt: skip
"""What trials hold: the dimension beside that of samples, and the unit."""


@dataclass(frozen=True, eq=False)
class Dataset(Framed, Series):
    """A model and the trials that challenge it.

    Attributes
    ----------
    name : str
    model : Model
    trials : tuple of Trial
        In the order of the file, those without a single sample left out.
    force_on : {"robot", "arm"} or None
        What the forces in the files act on. In the trials they are always forces on the arm.
    sample_rate : float or None
        As stated [Hz].
    subject : Subject
    tolerance : Tolerance
    folder : Path or None
        Where it was read.
    model_path : Path or None
        Where the model was read.
    warnings : tuple of str
        Remarks for the user, one line each.
    synthetic : bool
        Whether the trials were simulated; reports state it.
    added : tuple of AddedMass
        Masses that are worn in some configurations besides the model.
    muscles : tuple of Muscle
        The muscles of the activity channels.
    """

    name: str
    model: Model
    trials: tuple[Trial, ...]
    force_on: str | None = None
    sample_rate: float | None = None
    subject: Subject = field(default_factory=Subject)
    tolerance: Tolerance = field(default_factory=Tolerance)
    folder: Path | None = None
    model_path: Path | None = None
    warnings: tuple[str, ...] = ()
    synthetic: bool = False
    added: tuple[AddedMass, ...] = ()
    muscles: tuple[Muscle, ...] = ()

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
        object.__setattr__(self, "added", checks.instances("added", self.added, AddedMass))
        object.__setattr__(self, "muscles", checks.instances("muscles", self.muscles, Muscle))

    @property
    def fit_trials(self) -> tuple[Trial, ...]:
        """Trials on which things may be chosen and fitted."""
        return tuple(trial for trial in self.trials if trial.role == "fit")

    @property
    def test_trials(self) -> tuple[Trial, ...]:
        """Trials on which nothing is chosen or fitted."""
        return tuple(trial for trial in self.trials if trial.role == "test")

    @property
    def most_moving(self) -> Trial:
        """The trial whose joints move most."""
        if not self.trials:
            raise BadInput("trials", Text("none"), "a data set with trials")
        return max(self.trials, key=lambda t: float(np.sum(np.ptp(t.q[t.valid], axis=0))))

    def __repr__(self) -> str:
        counts = f"{len(self.fit_trials)} fit and {len(self.test_trials)} test trials"
        return f"Dataset({self.name!r}, {self.model.n_joints} joints, {counts}, {len(self.warnings)} warnings)"

    def tidy(self) -> Tidy:
        """Return the trials, one a row."""
        columns: dict[str, list[Any]] = {n: [getattr(t, n) for t in self.trials] for n in ("file", "configuration", "repeat", "role")}
        columns |= {"samples": [len(t) for t in self.trials], "rate": [t.rate for t in self.trials]}
        columns |= {"duration": [float(t.t[-1] - t.t[0]) for t in self.trials], "missing": [int((~t.valid).sum()) for t in self.trials]}
        held = [[name for name in _CHANNELS if getattr(t, name) is not None] for t in self.trials]
        columns["channels"] = [", ".join([*names, *t.emg]) for names, t in zip(held, self.trials, strict=True)]
        return Tidy(columns, {"rate": "Hz", "duration": "s"})

    def labelled(self) -> tuple[Mapping[str, Any], Mapping[str, Labelled]]:
        """Return the channels that any trial has, over trial and sample; NaN where a trial lacks one. Forces act on the arm."""
        size = {"joint": self.model.n_joints, "axis": 2, "robot_joint": 2}
        found = {"time": Labelled(("trial", "sample"), over_trials([t.t for t in self.trials], {})["time"], "s")}
        for name, (dimension, unit) in _CHANNELS.items():
            columns = [getattr(t, name) for t in self.trials]
            if all(values is None for values in columns):
                continue
            shape = (size[dimension],) if dimension else ()
            filled = [np.full((len(t), *shape), np.nan) if v is None else v for t, v in zip(self.trials, columns, strict=True)]
            dims = ("trial", "sample", dimension) if dimension else ("trial", "sample")
            found[name] = Labelled(dims, over_trials([t.t for t in self.trials], {name: filled})[name], unit)
        coordinates: dict[str, Any] = {"trial": [t.file for t in self.trials], "joint": [j.name for j in self.model.joints]}
        axes = {"axis": ["y", "z"], "robot_joint": [1, 2]}
        return coordinates | {name: values for name, values in axes.items() if any(name in q.dims for q in found.values())}, found

    def plot(self) -> np.ndarray:
        """Draw the trial whose joints move most, with the arm in five instants, where notebooks and windows show it; returns the Axes."""
        return self.most_moving.plot(self.model)

    def model_of(self, configuration: str) -> Model:
        """Return the model with what was worn in a configuration."""
        model = self.model
        for item in self.added:
            if configuration in item.configurations:
                model = model.with_mass(item.segment, item.mass, item.at)
        return model

    def digest(self) -> str | None:
        """Return the SHA-256 of the files one after the other: `dataset.toml`, the model, the trials; None where they are not on disk."""
        if self.folder is None:
            return None
        whole = hashlib.sha256()
        models = [] if self.model_path is None else [self.model_path]
        try:
            for path in (self.folder / FILE, *models, *(self.folder / t.file for t in self.trials)):
                whole.update(path.read_bytes())
        except OSError:
            return None
        return whole.hexdigest()

    def replace(self, **changes: Any) -> Dataset:
        """Return a data set with some attributes changed."""
        return dataclasses.replace(self, **changes)


def refuse_other_arms(dataset: Dataset) -> None:
    """Refuse arms that nothing identifies: with masses worn in some configurations, which would be ignored, or of too many segments.

    The core refuses long arms as well, but only after reading the samples, which takes long for them.
    """
    if dataset.model.n_joints > _MOST_SEGMENTS:
        allowed = f"1 to {_MOST_SEGMENTS} segments; only kernels, passive moments and co-simulation take more"
        raise BadInput("[[arm.segment]]", dataset.model.n_joints, allowed, file=dataset.model_path)
    if dataset.added:
        worn = ", ".join(dict.fromkeys(name for item in dataset.added for name in item.configurations)) or "all of them"
        allowed = "one arm in all trials: remove [[added]] and these trials, or add what is worn in all trials to the model"
        file = None if dataset.folder is None else dataset.folder / FILE
        raise BadInput("[[added]]", Text(f"masses worn in some configurations ({worn})"), allowed, file=file)


@with_warnings
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

    Examples
    --------
    >>> import armrs
    >>> data = armrs.load_dataset("session")
    >>> data.trials[0].q.shape
    (100, 2)
    """
    path, description = describe(source)
    folder = path.parent
    model_path = None if description.model is None else folder / description.model
    model = described_model(folder, description)
    for number, item in enumerate(description.added, start=1):
        _on(model, item, f"[[added]] {number}", path)
    trials: list[Trial] = []
    warnings = list(model.warnings)
    alike: dict[str, list[str]] = {}
    if model_path is None:
        warnings.append(NO_MODEL)
    for entry in description.trials:
        trial_path = folder / entry.file
        reading = read_entry(trial_path, entry, model.n_joints, description)
        if reading is None:
            warnings.append(left_out(entry))
            continue
        trials.append(reading.trial)
        for line in reading.warnings:
            alike.setdefault(line, []).append(entry.file)
    warnings += [f"{files.first_of(those)}: {line}" for line, those in alike.items()]
    marked, lines = mark_activity(trials)
    try:
        marked, relative = joint_activity(marked, description.muscles, model.n_joints)
    except BadInput as error:
        raise error.within(file=path) from None
    warnings += [*channel_faults(trials), *lines, *relative]
    return Dataset(
        name=name_of(path, description),
        model=model,
        trials=marked,
        force_on=description.force_on,
        sample_rate=description.sample_rate,
        subject=description.subject,
        tolerance=description.tolerance,
        folder=folder,
        model_path=model_path,
        warnings=(*warnings, *still_angles(tuple(trials)), *moving_bases(trials)),
        synthetic=description.synthetic,
        added=description.added,
        muscles=description.muscles,
    )


def described_model(folder: Path, description: Description) -> Model:
    """Return the model that a data set names, or that of its subject by the literature."""
    return literature_model(description.subject) if description.model is None else load_model(folder / description.model)


def read_entry(path: Path, entry: TrialEntry, n_joints: int, description: Description) -> Reading | None:
    """Return the trial of an entry as it was read, None for a test trial without samples; a refusal names its file."""
    try:
        reading = read_trial(
            path,
            n_joints=n_joints,
            force_on=description.force_on,
            sample_rate=description.sample_rate,
            file=entry.file,
            configuration=entry.configuration,
            repeat=entry.repeat,
            role=entry.role,
        )
    except BadInput as error:
        raise (_missing(path, entry, description) if error.kind == "missing_file" else error.within(file=path)) from None
    if reading is None and entry.role == "fit":
        raise _empty(path)
    return reading


def left_out(entry: TrialEntry) -> str:
    """Return the warning of a test trial without samples."""
    return f"{_empty(entry.file)}: this test trial is left out"


def _empty(file: str | Path) -> BadInput:
    return BadInput("file", Text("no samples below the header"), f"at least {FEWEST_SAMPLES} samples", file=file)


def _missing(path: Path, entry: TrialEntry, description: Description) -> BadInput:
    """Return the refusal of a trial without a file: which entry names it, and which file that no entry names is called most like it."""
    named = [one.file for one in description.trials]
    taken, near = {Path(file).name for file in named}, None
    with suppress(OSError):
        there = [one.name for one in path.parent.iterdir() if one.suffix.lower() in SUFFIXES]
        near = nearest(path.name, [name for name in there if name not in taken])
    hint = near and f"in that folder and in no entry: {near}"
    return BadInput(
        f"[[trial]] {named.index(entry.file) + 1} of {FILE}, file", NO_FILE, "a file that exists", file=path, hint=hint, kind="missing_file"
    )


def name_of(path: Path, description: Description) -> str:
    """Return the name of a data set; one that states none is called after its folder."""
    return description.name or path.resolve().parent.name or "data set"


def _on(model: Model, item: AddedMass, place: str, file: Path) -> None:
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


def describe(source: str | os.PathLike[str]) -> tuple[Path, Description]:
    """Return the path of a `dataset.toml` and its contents."""
    path = checks.path("source", source)
    if not os.path.lexists(path):
        raise BadInput("file", NO_FILE, f"a folder with {FILE}, or that file", file=source, kind="missing_source")
    trial = path.suffix.lower() in SUFFIXES and path.is_file()
    if trial or (path.is_dir() and not os.path.lexists(path / FILE)):
        above = next((folder for folder in (path.parent, path.parent.parent) if (folder / FILE).is_file()), None)
        hint = None if above is None else f"that is {above}"
        found = "a trial" if trial else "a folder that holds no data set"
        raise BadInput("file", Text(found), f"the folder of {'its' if trial else 'a'} data set, with {FILE}", file=source, hint=hint)
    path = path / FILE if path.is_dir() else path
    with suppress(OSError):  # a data set may lie where nothing can be written
        files.recover(path.parent)
    try:
        return path, Description.load(path)
    except BadInput as first:
        raise BadInputs.of(dataset_errors_of(path).found or [first]) from None


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

    Raises
    ------
    BadInput
        For a format that is none of these, and a folder that is a file.

    Notes
    -----
    Samples that were missing are written as empty cells, not as measured.

    Examples
    --------
    >>> import armrs
    >>> armrs.write_dataset(armrs.load_dataset("session"), "copy", suffix=".parquet").name
    'dataset.toml'
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
    entries = [TrialEntry(name, t.configuration, t.repeat, t.role) for t, name in zip(dataset.trials, names, strict=True)]
    content = Description(
        dataset.name,
        "model.toml",
        entries,
        force_on=dataset.force_on,
        sample_rate=dataset.sample_rate,
        subject=dataset.subject,
        tolerance=dataset.tolerance,
        synthetic=dataset.synthetic,
        added=dataset.added,
        muscles=dataset.muscles,
    )

    def write(part: Path) -> list[Path]:
        for trial, name in zip(dataset.trials, names, strict=True):
            table = trial_columns(trial, dataset.force_on)
            write_samples(part / name, list(table), list(table.values()))
        dataset.model.write(part / "model.toml")
        files.write_text(part / FILE, content.to_toml(), kind=".toml")
        return [*(part / name for name in names), part / "model.toml", part / FILE]

    return files.write_whole(out, write)[-1]


def output_names(names: list[str], suffix: str | None) -> list[str]:
    """Return where below an output folder trials go: under their own names when these stay inside, else in `trials/`."""
    result: list[str] = []
    for number, name in enumerate(names, 1):
        path = Path(name)
        if path.name in ("", ".."):
            raise BadInput(f"[[trial]] {number}, file", name, "the name of a file")
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
    if trial.base is not None:
        table["by_m"], table["bz_m"] = trial.base.T
    table.update(trial.emg)
    return {name: np.where(trial.filled_columns[name], np.nan, v) if name in trial.filled_columns else v for name, v in table.items()}
