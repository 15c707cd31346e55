"""Recordings as laboratories have them become the same data set as the true one; hopeless ones are refused with all their problems at once."""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import armrs
from armrs import cli
from armrs.errors import BadInput, BadInputs
from armrs.io.raw import RawTable
from armrs.io.raw.table import column
from armrs.workflows.importing import file_roles

SEGMENTS = (armrs.Segment("upper arm", 0.322, 2.114, 0.186, 0.0165), armrs.Segment("forearm", 0.264, 1.264, 0.121, 0.0074))
JOINTS = (armrs.Joint("shoulder", stiffness=0.6, rest=-0.9, viscosity=0.15), armrs.Joint("elbow", stiffness=0.4, rest=0.7, viscosity=0.1))
ROBOT = armrs.Robot((0.45, 0.45), (1.05, -0.10))
TRUE = armrs.Model(SEGMENTS, JOINTS, robot=ROBOT)
KNOWN = armrs.Model(SEGMENTS, (armrs.Joint("shoulder"), armrs.Joint("elbow")))
"""What a laboratory knows: no joint law."""


@dataclass(frozen=True)
class Recording:
    """One trial in SI units and the conventions of armrs."""

    t: np.ndarray
    q: np.ndarray
    force_on_robot: np.ndarray


@pytest.fixture(scope="module")
def recording() -> Recording:
    """A led arm at 100 Hz, rounded to what files hold: 0.1 ms, 1e-6 rad, 1e-5 N."""
    points = np.radians([[-60, 40], [-25, 75], [-70, 90], [-40, 30], [-60, 40]])
    run = armrs.simulate(TRUE, armrs.Movement(points, speed=0.5, acceleration=2.0), rate=100.0)
    return Recording(np.round(run.t, 4), np.round(run.q, 6), np.round(-run.force_on_arm, 5))


def table(r: Recording, *, names: list[str], t: float = 1.0, angle: float = 1.0, force: float = 1.0) -> tuple[list[str], np.ndarray]:
    """Return names and values with factors on time, angles and forces."""
    return names, np.column_stack([r.t * t, r.q * angle, r.force_on_robot * force])


def write_text(
    path: Path, names: list[str], values: np.ndarray, *, sep: str = ",", decimal: str = ".", encoding: str = "utf-8", above: str = ""
) -> Path:
    rows = [sep.join(f"{x:.9g}".replace(".", decimal) if np.isfinite(x) else "" for x in row) for row in values]
    path.write_bytes((above + sep.join(names) + "\n" + "\n".join(rows) + "\n").encode(encoding))
    return path


def repeated(values: np.ndarray, repeat: int) -> np.ndarray:
    """Return samples as another repeat has them: with other noise on all channels."""
    return values + 1e-4 * np.random.default_rng(repeat).standard_normal(values.shape) * [0, 1, 1, 1, 1]


SI = ["t_s", "q1_rad", "q2_rad", "Fy_N", "Fz_N"]
DEGREE = 180.0 / np.pi
Writer = Callable[[Recording, Path], Path]


def german_spreadsheet(r: Recording, folder: Path) -> Path:
    names = ["Zeit [ms]", "Schulter [°]", "Ellbogen [°]", "Kraft y [N]", "Kraft z [N]", "Bemerkung"]
    _, values = table(r, names=names, t=1e3, angle=DEGREE)
    lines = [";".join([*(f"{x:.9g}".replace(".", ",") for x in row), "ruhig" if k % 50 == 0 else ""]) for k, row in enumerate(values)]
    path = folder / "langsam_1.csv"
    path.write_bytes((";".join(names) + "\r\n" + "\r\n".join(lines) + "\r\n").encode("cp1252"))
    return path


def us_excel(r: Recording, folder: Path) -> Path:
    return _excel(
        folder / "slow_1.xlsx", *table(r, names=["Time (s)", "Shoulder (deg)", "Elbow (deg)", "Force Y (N)", "Force Z (N)"], angle=DEGREE)
    )


def german_excel(r: Recording, folder: Path) -> Path:
    names, values = table(r, names=["Zeit", "Schulterwinkel", "Ellbogenwinkel", "Kraft y", "Kraft z"], t=1e3, angle=DEGREE)
    return _excel(folder / "langsam_1.xlsx", names, values, units=["ms", "°", "°", "N", "N"], above=["Proband 7", "rechter Arm"])


def _excel(
    path: Path, names: list[str], values: np.ndarray | list[list[str]], units: list[str] | None = None, above: list[str] | None = None
) -> Path:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for line in above or []:
        book.active.append([line])
    book.active.append(names)
    if units:
        book.active.append(units)
    for row in values.tolist() if isinstance(values, np.ndarray) else values:
        book.active.append(row)
    book.save(path)
    return path


def matlab_5(r: Recording, folder: Path) -> Path:
    from scipy.io import savemat

    savemat(folder / "slow_1.mat", {"t": r.t, "q": r.q, "Fy": r.force_on_robot[:, 0], "Fz": r.force_on_robot[:, 1], "subject": "S1"})
    return folder / "slow_1.mat"


def matlab_7_3(r: Recording, folder: Path) -> Path:
    h5py = pytest.importorskip("h5py")
    with h5py.File(folder / "slow_1.mat", "w", userblock_size=512) as file:
        for name, value in (("t", r.t[None]), ("q", r.q.T), ("Fy", r.force_on_robot[None, :, 0]), ("Fz", r.force_on_robot[None, :, 1])):
            file[name] = np.ascontiguousarray(value)
            file[name].attrs["MATLAB_class"] = np.bytes_("double")
    return folder / "slow_1.mat"


def matlab_7_3_with_units(r: Recording, folder: Path) -> Path:
    """HDF5 as MATLAB reads and h5py writes it: milliseconds, degrees and kilonewtons, said by attributes alone."""
    h5py = pytest.importorskip("h5py")
    _, values = table(r, names=SI, t=1e3, angle=DEGREE, force=1e-3)
    with h5py.File(folder / "slow_1.mat", "w") as file:
        group = file.create_group("trial")
        parts = (("t", values[:, 0], b"ms"), ("q", values[:, 1:3], "deg"), ("Fy", values[:, 3], np.array(["kN"], dtype=object)))
        for name, part, unit in (*parts, ("Fz", values[:, 4], np.bytes_("kN"))):
            group[name] = part
            group[name].attrs["units" if name != "q" else "Unit"] = unit
    return folder / "slow_1.mat"


def hdf5_groups(r: Recording, folder: Path) -> Path:
    """A group for each trial with arrays of the same names, of which only the first group was read; one of them is a table."""
    h5py = pytest.importorskip("h5py")
    _, values = table(r, names=SI)
    with h5py.File(folder / "session.h5", "w") as file:
        rows = np.zeros(len(values), dtype=[(name, "f8") for name in SI])
        for name, column in zip(SI, values.T, strict=True):
            rows[name] = column
            file[f"trials/slow_2/{name}"] = np.r_[column, column[-1] + 0.01 * (name == "t_s")]
        file["trials/slow_1/samples"] = rows
    return folder / "session.h5"


def c3d_with_analogs(r: Recording, folder: Path, *, labels: Sequence[str] = ("SHO", "ELB", "HAND")) -> Path:
    """Markers at 100 Hz and the force on analog channels at 200 Hz, as ezc3d writes them."""
    ezc3d = pytest.importorskip("ezc3d")
    absolute = np.cumsum(r.q, axis=1)
    elbow = np.stack([0.322 * np.cos(absolute[:, 0]), 0.322 * np.sin(absolute[:, 0])])
    hand = elbow + np.stack([0.264 * np.cos(absolute[:, 1]), 0.264 * np.sin(absolute[:, 1])])
    points = np.zeros((4, 3, len(r.t)))
    points[0, 1], points[2, 1] = elbow
    points[0, 2], points[2, 2] = hand
    points[3] = 1.0
    content = ezc3d.c3d()
    content["parameters"]["POINT"]["RATE"]["value"] = [100.0]
    content["parameters"]["POINT"]["LABELS"]["value"] = list(labels)
    content["parameters"]["POINT"]["UNITS"]["value"] = ["m"]
    content["data"]["points"] = points
    twice = np.arange(2 * len(r.t)) / 200.0
    content["parameters"]["ANALOG"]["RATE"]["value"] = [200.0]
    content["parameters"]["ANALOG"]["LABELS"]["value"] = ["Force Y", "Force Z"]
    content["parameters"]["ANALOG"]["UNITS"]["value"] = ["N", "N"]
    content["data"]["analogs"] = np.stack([np.interp(twice, r.t, f) for f in r.force_on_robot.T])[None]
    content.write(str(folder / "slow_1.c3d"))
    return folder / "slow_1.c3d"


def motion_file(r: Recording, folder: Path) -> Path:
    path = folder / "slow_1.sto"
    names, values = table(r, names=["time", "shoulder", "elbow", "force_y", "force_z"])
    head = f"slow\nversion=1\nnRows={len(values)}\nnColumns={len(names)}\ninDegrees=no\nendheader\n"
    return write_text(path, names, values, sep="\t", above=head)


def saved_again(r: Recording, folder: Path) -> Path:
    """A motion file that a spreadsheet program saved: commas between the cells, and after the lines of the header."""
    path = motion_file(r, folder)
    head, _, rows = path.read_text().partition("endheader\n")
    lines = [*(line + ",,,," for line in (*head.splitlines(), "endheader")), *rows.replace("\t", ",").splitlines()]
    path.write_text("\n".join(lines) + "\n")
    return path


def numbers_as_text(r: Recording, folder: Path) -> Path:
    names, values = table(r, names=["Zeit", "Schulter", "Ellbogen", "Kraft y", "Kraft z"], t=1e3, angle=DEGREE)
    rows = [[f"{x:.12g}".replace(".", ",") for x in row] for row in values.tolist()]
    return _excel(folder / "langsam_1.xlsx", names, rows, units=["ms", "°", "°", "N", "N"], above=["Proband 7"])


def parquet(r: Recording, folder: Path) -> Path:
    from armrs.io.samples import write_samples

    names, values = table(r, names=SI)
    write_samples(folder / "slow_1.parquet", names, list(values.T))
    return folder / "slow_1.parquet"


def text(name: str = "slow_1.csv", names: list[str] = SI, **options: object) -> Writer:
    factors = {key: options.pop(key) for key in ("t", "angle", "force") if key in options}
    return lambda r, folder: write_text(folder / name, *table(r, names=names, **factors), **options)  # type: ignore[arg-type]


def turned(change: Callable[[np.ndarray], np.ndarray]) -> Writer:
    def write(r: Recording, folder: Path) -> Path:
        return write_text(folder / "slow_1.csv", SI, np.column_stack([r.t, change(r.q), r.force_on_robot]))

    return write


def hanging(q: np.ndarray) -> np.ndarray:
    return q + np.array([0.5 * np.pi, 0.0])


def with_gaps(r: Recording, folder: Path) -> Path:
    names, values = table(r, names=SI)
    values = values.copy()
    values[200:206, 1] = np.nan
    return write_text(folder / "slow_1.csv", names, values)


def force_on_its_own_clock(r: Recording, folder: Path) -> Path:
    """The force device runs at 250 Hz and started 1.3 s earlier."""
    write_text(folder / "slow_1.csv", ["time [s]", "shoulder [rad]", "elbow [rad]"], np.column_stack([r.t, r.q]))
    clock = np.arange(0.0, r.t[-1] + 2.0, 0.004)
    force = np.column_stack([np.interp(clock - 1.3, r.t, f) for f in r.force_on_robot.T])
    write_text(folder / "slow_1_force.csv", ["time [s]", "Fy [N]", "Fz [N]"], np.column_stack([clock, force]))
    return folder


CASES: dict[str, tuple[Writer, dict[str, object], float]] = {
    "si": (text(), {}, 0.0),
    "German spreadsheet": (german_spreadsheet, {}, 1e-7),
    "US Excel": (us_excel, {}, 1e-12),
    "German Excel with a row of units": (german_excel, {}, 1e-12),
    "Excel with numbers as text": (numbers_as_text, {}, 1e-10),
    "OpenSim storage that a spreadsheet saved": (saved_again, {}, 0.0),
    "MATLAB 5": (matlab_5, {}, 0.0),
    "MATLAB 7.3": (matlab_7_3, {}, 0.0),
    "MATLAB 7.3 with attributes for units": (matlab_7_3_with_units, {}, 1e-12),
    "C3D with analogs": (c3d_with_analogs, {}, 3e-6),
    "C3D with markers of other names": (partial(c3d_with_analogs, labels=("M1", "M2", "M3")), {"points": ("M1", "M2", "M3")}, 3e-6),
    "OpenSim storage": (motion_file, {}, 0.0),
    "Parquet": (parquet, {}, 0.0),
    "tabs": (text("slow_1.txt", sep="\t"), {}, 0.0),
    "blanks": (text("slow_1.dat", sep=" "), {}, 0.0),
    "milliseconds without a unit": (text(names=["time", "q1", "q2", "Fy", "Fz"], t=1e3), {}, 0.0),
    "microseconds": (text(names=["t [µs]", "q1", "q2", "Fy", "Fz"], t=1e6), {}, 0.0),
    "degrees without a unit": (text(names=["t", "shoulder", "elbow", "Fy", "Fz"], angle=DEGREE), {}, 1e-7),
    "kilonewtons": (text(names=["t_s", "q1_rad", "q2_rad", "Fy [kN]", "Fz [kN]"], force=1e-3), {}, 1e-7),
    "comment rows": (text(above="# subject 7\n# right arm, 2026-03-14\n\n"), {}, 0.0),
    "UTF-16": (text(encoding="utf-16"), {}, 0.0),
    "Latin-1 names": (text(names=["Zeit (s)", "Schulter (rad)", "Ellbogen (rad)", "Kraft_y", "Kraft_z"], encoding="latin-1"), {}, 0.0),
    "gaps": (with_gaps, {}, 0.0),
    "mirrored": (turned(lambda q: -q), {}, 1e-9),
    "absolute": (turned(lambda q: np.cumsum(q, axis=1)), {}, 1e-9),
    "from the vertical": (turned(hanging), {}, 1e-8),
    "mirrored and from the vertical": (turned(lambda q: -hanging(q)), {}, 1e-8),
    # The offset is found to 0.93 ms, and the force changes by up to 86 N/s, 3.2 times its largest value in a second.
    "force on its own clock": (force_on_its_own_clock, {}, 4e-3),
}


@pytest.mark.parametrize("case", CASES)
def test_a_recording_becomes_the_true_data_set(case: str, recording: Recording, tmp_path: Path) -> None:
    write, options, rounding = CASES[case]
    raw = tmp_path / "raw"
    raw.mkdir()
    path = write(recording, raw)
    sources = sorted(path.iterdir()) if path.is_dir() else [path]
    done = armrs.import_recordings(sources, tmp_path / "session", model=KNOWN, **options)  # type: ignore[arg-type]
    (trial,) = armrs.load_dataset(done.folder).trials
    same = np.isfinite(trial.force_on_arm).all(axis=1)
    assert same.mean() > 0.9
    n = len(trial.t)
    assert np.abs(trial.t - recording.t[:n]).max() <= 1e-9
    assert np.abs(trial.q - recording.q[:n])[same].max() <= rounding + (1e-3 if case == "gaps" else 0.0)
    worst = np.abs(trial.force_on_arm + recording.force_on_robot[:n])[same].max()
    assert worst <= max(rounding, 1e-9) * np.abs(recording.force_on_robot).max()
    assert trial.configuration in ("slow", "langsam") and trial.repeat == 1


def test_a_group_of_hdf5_is_a_trial(recording: Recording, tmp_path: Path) -> None:
    done = armrs.import_recordings([hdf5_groups(recording, tmp_path)], tmp_path / "session", model=KNOWN)
    written = armrs.load_dataset(done.folder).trials
    assert [(t.configuration, t.repeat, len(t)) for t in written] == [("slow", 1, len(recording.t)), ("slow", 2, len(recording.t) + 1)]
    for trial in written:
        assert np.abs(trial.q[: len(recording.t)] - recording.q).max() <= 1e-12


@pytest.mark.parametrize("within", [False, True])
def test_a_struct_of_matlab_is_a_trial_as_a_group_of_hdf5_is(within: bool, recording: Recording, tmp_path: Path) -> None:
    """Of two structs with the same fields the first was imported, and the other was left out in silence."""
    from scipy.io import savemat

    r = recording
    fields = {"t": r.t, "q": r.q, "Fy": r.force_on_robot[:, 0], "Fz": r.force_on_robot[:, 1]}
    both = {"slow_1": fields, "slow_2": {name: column[:-1] for name, column in fields.items()}}
    savemat(tmp_path / "session.mat", {"session": both} if within else both)
    done = armrs.import_recordings([tmp_path / "session.mat"], tmp_path / "session", model=KNOWN)
    found = armrs.load_dataset(done.folder).trials
    assert [(t.configuration, t.repeat, len(t)) for t in found] == [("slow", 1, len(r.t)), ("slow", 2, len(r.t) - 1)]
    for trial in found:
        assert np.abs(trial.q - r.q[: len(trial)]).max() <= 1e-12


@pytest.mark.parametrize("within", ["struct", "array"])
def test_structs_within_structs_of_matlab_are_trials_of_their_own(within: str, recording: Recording, tmp_path: Path) -> None:
    """Of two arms below one condition the first was imported, and the other was left out in silence."""
    from scipy.io import savemat

    r = recording
    fields = {"t": r.t, "q": r.q, "Fy": r.force_on_robot[:, 0], "Fz": r.force_on_robot[:, 1]}
    cut = [{name: column[: len(column) - k] for name, column in fields.items()} for k in range(4)]
    slow, fast = {"left": cut[0], "right": cut[1]}, {"left": cut[2], "right": cut[3]}
    sessions = {"slow": slow, "fast": fast} if within == "struct" else {"conditions": np.array([slow, fast], dtype=object)}
    savemat(tmp_path / "session.mat", sessions)
    done = armrs.import_recordings([tmp_path / "session.mat"], tmp_path / "session", model=KNOWN)
    found = armrs.load_dataset(done.folder).trials
    assert sorted(len(r.t) - len(t) for t in found) == [0, 1, 2, 3]


def test_a_whole_number_of_a_workbook_may_be_beyond_all_floats(recording: Recording, tmp_path: Path) -> None:
    """It ended with a traceback."""
    names, values = table(recording, names=SI)
    values[7, 1] = 777777.0
    path = _excel(tmp_path / "slow_1.xlsx", names, values)
    with zipfile.ZipFile(path) as book:
        parts = {name: book.read(name) for name in book.namelist()}
    with zipfile.ZipFile(path, "w") as book:
        for name, content in parts.items():
            book.writestr(name, content.replace(b"777777", b"7" * 400))
    done = armrs.import_recordings([path], tmp_path / "session", model=KNOWN)
    (trial,) = armrs.load_dataset(done.folder).trials
    assert np.abs(trial.q - recording.q).max() <= 1e-3, "the sample is bridged"


def test_the_offset_of_a_clock_is_found_to_a_thousandth_of_a_second(recording: Recording, tmp_path: Path) -> None:
    done = armrs.import_recordings(sorted(force_on_its_own_clock(recording, tmp_path).iterdir()), tmp_path / "session", model=KNOWN)
    (trial,) = done.recipe.trials
    assert trial.force_shift == pytest.approx(-1.3, abs=1e-3)


def test_forces_that_balance_the_arm_roughly_are_in_doubt(recording: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """12 % unexplained was accepted without a word: here a force sensor that shows 8 N too much forward."""
    KNOWN.write(tmp_path / "model.toml")
    for name, bias, status in (("right", 0.0, 0), ("biased", 8.0, 1)):
        raw = write_text(
            tmp_path / f"{name}.csv", SI, np.column_stack([recording.t, recording.q, recording.force_on_robot + np.array([bias, 0.0])])
        )
        arguments = ["import", str(raw), "--model", str(tmp_path / "model.toml"), "-o", str(tmp_path / name)]
        assert cli.main(arguments) == status
        doubted = [line for line in capsys.readouterr().out.splitlines() if line.startswith("  in doubt: ")]
        assert len(doubted) == status and all("% of the contact torques unexplained, more than 10 %" in line for line in doubted)


def test_import_toml_repeats_an_import(recording: Recording, tmp_path: Path) -> None:
    raw = german_spreadsheet(recording, tmp_path)
    first = armrs.import_recordings([raw], tmp_path / "a", model=KNOWN)
    second = armrs.import_recordings([first.folder / "import.toml"], tmp_path / "b", model=KNOWN)
    for name in ("trials/langsam_1.csv", "dataset.toml"):
        a, b = ((folder / name).read_text().replace('"a"', "").replace('"b"', "") for folder in (first.folder, second.folder))
        assert a == b
    assert 'column = "Zeit [ms]"' in (first.folder / "import.toml").read_text()


def test_the_last_of_three_repeats_is_kept_as_test(recording: Recording, tmp_path: Path) -> None:
    names, values = table(recording, names=SI)
    files = [write_text(tmp_path / f"slow_{k}.csv", names, repeated(values, k)) for k in (1, 2, 3)]
    done = armrs.import_recordings(files, tmp_path / "session", model=KNOWN)
    assert [(t.repeat, t.role) for t in done.recipe.trials] == [(1, "fit"), (2, "fit"), (3, "test")]


NOISE = np.random.default_rng(3)
HOPELESS: dict[str, tuple[Writer, tuple[str, ...]]] = {
    "no angles": (text(names=["t_s", "a", "b", "Fy_N", "Fz_N"]), ("no column for q1, q2",)),
    "no names at all": (text(names=["a", "b", "c", "d", "e"]), ("no column for t, q1, q2, Fy, Fz",)),
    "no time and one force": (text(names=["frame", "q1_rad", "q2_rad", "Fy_N", "other"]), ("no column for t, Fz",)),
    "two angles in other units": (
        text(names=["t_s", "q1 [N]", "q2 [mm]", "Fy_N", "Fz_N"]),
        ("a unit of angle for q1", "a unit of angle for q2"),
    ),
    "two shoulders and no elbow": (
        text(names=["t_s", "shoulder_rad", "shoulder [rad]", "Fy_N", "Fz_N"]),
        ("one column for q1", "found angles of 1 joint, allowed 2"),
    ),
    "frozen clock, force in metres": (
        lambda r, folder: write_text(
            folder / "slow_1.csv", ["t", "q1", "q2", "Fy [m]", "Fz"], np.column_stack([0.0 * r.t, r.q, r.force_on_robot])
        ),
        ("time that does not increase", "a unit of force for Fy"),
    ),
    "markers without their names": (partial(c3d_with_analogs, labels=("M1", "M2", "M3")), ("and of the handle, of M1, M2, M3",)),
    "a picture, words and a table": (
        lambda r, folder: _three_wrong(r, folder),
        ("binary data", "no block of rows", "found angles of 1 joint,"),
    ),
    "no workbook": (lambda r, folder: _written(folder / "slow_1.xlsx", b"PK\x03\x04 broken"), ("no readable workbook",)),
    "damaged HDF5": (lambda r, folder: _damaged(matlab_7_3(r, folder)), ("no readable MATLAB file",)),
    "MATLAB 5 with data of a kind that is none": (lambda r, folder: _of_kind_11(matlab_5(r, folder)), ("a MATLAB file of version 5",)),
    "no MATLAB file": (lambda r, folder: _written(folder / "slow_1.mat", b"MATLAB 5.0 " + b"x" * 600), ("MATLAB",)),
    "units that nobody knows": (
        text(names=["t [fortnight]", "q1 [gon]", "q2 [rad]", "Fy [N]", "Fz [bar]"]),
        (
            "column 't [fortnight]': found 'fortnight', allowed a unit of time: s, min, ms, µs, ns",
            "column 'q1 [gon]': found 'gon', allowed a unit of angle: rad, deg, mrad",
            "column 'Fz [bar]': found 'bar', allowed a unit of force: N, kN, mN, daN, kgf, lbf",
        ),
    ),
    "forces of noise": (
        lambda r, folder: write_text(folder / "slow_1.csv", SI, np.column_stack([r.t, r.q, NOISE.standard_normal((len(r.t), 2))])),
        ("unexplained",),
    ),
    "one angle and one force": (text(names=["t_s", "q1_rad", "b", "Fy_N", "c"]), ("no column for Fz", "found angles of 1 joint,")),
}


def _three_wrong(r: Recording, folder: Path) -> Path:
    _written(folder / "a.csv", b"\x89PNG\r\n\x1a\n\0\0\0" * 20)
    _written(folder / "b.csv", b"hello\nworld\n")
    text(names=["t_s", "q1_rad", "elbow flex? [N]", "Fy_N", "Fz_N"])(r, folder)
    return folder


def _of_kind_11(path: Path) -> Path:
    """Change the kind of the first numbers, which crashes SciPy 1.17 and ended armrs with a segmentation fault."""
    content = path.read_bytes()
    at = content.index(b"\x09\x00\x00\x00", 176)
    path.write_bytes(content[:at] + b"\x0b" + content[at + 1 :])
    return path


def _damaged(path: Path) -> Path:
    """Change the version of an object's header: the file opens, and h5py raised RuntimeError later, which ended in a traceback."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "r") as file:
        header = file.userblock_size + h5py.h5o.get_info(file["q"].id).addr
    content = bytearray(path.read_bytes())
    content[header] = 0xFF
    path.write_bytes(content)
    return path


def _written(path: Path, content: bytes) -> Path:
    path.write_bytes(content)
    return path


@pytest.mark.parametrize("case", HOPELESS)
def test_a_hopeless_recording_is_refused_with_all_problems_at_once(case: str, recording: Recording, tmp_path: Path) -> None:
    """Each beside a file of words: neither hides the other's problems, also those that only the balance of the arm shows."""
    if case == "no workbook":
        pytest.importorskip("openpyxl")
    write, words = HOPELESS[case]
    path = write(recording, tmp_path)
    sources = [*(sorted(path.iterdir()) if path.is_dir() else [path]), _written(tmp_path / "words.csv", b"hello\nworld\n")]
    with pytest.raises(BadInput) as refused:
        armrs.import_recordings(sources, tmp_path / "session", model=KNOWN)
    assert isinstance(refused.value, BadInputs)
    listed = [str(problem) for problem in refused.value.problems]
    expected = (*words, f"{tmp_path / 'words.csv'}: file: found no block of rows")
    assert [said for said in expected if not any(said in line for line in listed)] == [], listed
    assert len(listed) == len(expected), listed
    assert all(str(tmp_path) in line or "angles and forces" in line for line in listed)
    assert not (tmp_path / "session").exists()


def test_all_problems_are_said_at_once(recording: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = text(names=["frame", "q1 [N]", "q2_rad", "Fy_N", "other"])(recording, tmp_path)
    KNOWN.write(tmp_path / "model.toml")
    assert cli.main(["import", str(path), "--model", str(tmp_path / "model.toml"), "-o", str(tmp_path / "session")]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2 and all(line.startswith("armrs: ") for line in lines)
    assert "a unit of angle for q1" in lines[0] and "no column for t, Fz" in lines[1]


def test_the_name_of_a_movement_keeps_its_letters(recording: Recording) -> None:
    """`shoulder 1` was the movement `shoulde`."""
    expected = {
        "shoulder 1": ("shoulder", 1),
        "fast2": ("fast", 2),
        "Schulter_r3": ("schulter", 3),
        "slow trial 04": ("slow", 4),
        "run7": ("movement", 7),
    }
    columns = tuple(
        column(name, values) for name, values in zip(SI, np.column_stack([recording.t, recording.q, recording.q]).T, strict=True)
    )
    named, left, _ = file_roles.arrange([RawTable(Path(f"{title}.csv"), title, columns, ()) for title in expected])
    assert [(n.configuration, n.repeat) for n in named] == list(expected.values()) and not left


def _bare(title: str, channels: str) -> RawTable:
    names = {"angles": SI[:3], "forces": [SI[0], *SI[3:]], "both": SI}[channels]
    return RawTable(Path(f"{title}.csv"), title, tuple(column(name, np.arange(5.0)) for name in names), ())


@pytest.mark.parametrize(
    ("angles", "forces", "expected"),
    [
        (("slow_1_angles", "slow_2_angles"), ("slow_1_force", "slow_2_force"), [("slow", 1), ("slow", 2)]),
        (("slow_1_mocap", "fast_1_mocap"), ("slow_1_ati", "fast_1_ati"), [("slow", 1), ("fast", 1)]),
        (("slow_1_mocap", "slow_2_mocap"), ("slow_1_mini40", "slow_2_mini40"), [("slow", 1), ("slow", 2)]),
        (
            ("Winkel_S7_langsam_1", "Winkel_S7_langsam_2"),
            ("Kraft S7 langsam 1", "Kraft S7 langsam 2"),
            [("s7-langsam", 1), ("s7-langsam", 2)],
        ),
    ],
)
def test_forces_in_files_of_their_own_keep_the_repeats(angles: tuple[str, ...], forces: tuple[str, ...], expected: list[object]) -> None:
    """Words of what was measured, and of the device, made each file a movement of its own."""
    named, left, _ = file_roles.arrange([*(_bare(a, "angles") for a in angles), *(_bare(f, "forces") for f in forces)])
    assert [(n.configuration, n.repeat) for n in named] == expected and not left
    assert [n.forces and n.forces.title for n in named] == list(forces)


def test_a_word_of_the_role_is_no_movement() -> None:
    """`slow_3_test` was the movement `slow-3-test`, beside which `slow` had two repeats; `Test 1` and `Test 2` were all kept apart."""
    named, _, why = file_roles.arrange([_bare(t, "both") for t in ("slow_1", "slow_2", "slow_3_test", "fast_1", "fast_2_probe")])
    found = [(n.configuration, n.repeat, n.role) for n in named]
    expected = [("slow", 1, "fit"), ("slow", 2, "fit"), ("slow", 3, "test"), ("fast", 1, "fit"), ("fast", 2, "test")]
    assert (found, why) == (expected, "from the names of the files")
    named, _, _ = file_roles.arrange([_bare(t, "both") for t in ("Test 1", "Test 2", "Test 3")])
    assert [(n.configuration, n.repeat, n.role) for n in named] == [("test", 1, "fit"), ("test", 2, "fit"), ("test", 3, "test")]
    named, _, _ = file_roles.arrange(
        [*(_bare(t, "angles") for t in ("slow_1", "slow_2_test")), *(_bare(f"slow_{k}_kraft", "forces") for k in (1, 2))]
    )
    assert [(n.repeat, n.role, n.forces and n.forces.title) for n in named] == [(1, "fit", "slow_1_kraft"), (2, "test", "slow_2_kraft")]


def test_sheets_of_a_workbook_are_trials_by_their_titles(recording: Recording, tmp_path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active.append(["subject 7, right arm"])
    names, values = table(recording, names=["Zeit [ms]", "Schulter [°]", "Ellbogen [°]", "Kraft y [N]", "Kraft z [N]"], t=1e3, angle=DEGREE)
    for k, title in enumerate(("Schulter 1", "Schulter 2", "Ellbogen 1")):
        sheet = book.create_sheet(title)
        for row in (names, *repeated(values, k).tolist()):
            sheet.append(row)
    book.save(tmp_path / "Messung.xlsx")
    done = armrs.import_recordings([tmp_path / "Messung.xlsx"], tmp_path / "set", model=KNOWN)
    assert [(t.configuration, t.repeat) for t in done.recipe.trials] == [("schulter", 1), ("schulter", 2), ("ellbogen", 1)]
    assert done.notes[0] == "sheets 'Schulter 1', 'Schulter 2', 'Ellbogen 1'; no table in 'Sheet'"
    again = armrs.import_recordings([done.folder / "import.toml"], tmp_path / "again", model=KNOWN)
    assert [t.configuration for t in again.recipe.trials] == ["schulter", "schulter", "ellbogen"]


def test_a_model_of_more_joints_than_were_recorded(recording: Recording, tmp_path: Path) -> None:
    arm = armrs.initialise(tmp_path / "subject", body_mass=78.0, height=1.80, sex="male")
    with pytest.raises(
        BadInput, match=r"found angles of 2 joints, allowed 3, as the model has \(a model of 2: armrs init --lengths-m \?,\?"
    ):
        armrs.import_recordings([text()(recording, tmp_path)], tmp_path / "set", model=arm.model)
    two = armrs.initialise(tmp_path / "two", body_mass=78.0, height=1.80, sex="male", lengths=(None, None)).model.segments
    assert sum(s.mass for s in two) == pytest.approx(sum(s.mass for s in arm.model.segments))
    _, other, hand = arm.model.segments
    assert two[1].mass * two[1].com == pytest.approx(other.mass * other.com + hand.mass * (other.length + hand.com))


def test_repeats_that_are_counted_from_zero(recording: Recording, tmp_path: Path) -> None:
    """`slow_0` and `slow_1` were both written as the first repeat, and the data set refused."""
    names, values = table(recording, names=SI)
    sources = [write_text(tmp_path / f"slow_{k}.csv", names, repeated(values, k)) for k in range(3)]
    made = armrs.import_recordings(sources, tmp_path / "set", model=KNOWN)
    assert [(t.repeat, t.role) for t in armrs.load_dataset(made.folder).trials] == [(1, "fit"), (2, "fit"), (3, "test")]


def test_an_import_replaces_a_former_one_whole_and_nothing_of_another_origin(recording: Recording, tmp_path: Path) -> None:
    """What was edited was lost; trials of a former import stayed beside those of the next; and the model of `armrs init` was replaced."""
    names, values = table(recording, names=SI)
    sources = [write_text(tmp_path / f"slow_{k}.csv", names, repeated(values, k)) for k in (1, 2, 3)]
    made = armrs.import_recordings(sources, tmp_path / "set", model=KNOWN)
    with (made.folder / "dataset.toml").open("a", encoding="utf-8") as file:
        file.write("\n[tolerance]\nforce_bias_N = 0.5\n")
    for again in (sources[:1], [made.folder / "import.toml"]):
        with pytest.raises(
            BadInput,
            match=r"set: this folder holds the data set of a former import; choose another -o, or --force, which replaces it whole",
        ):
            armrs.import_recordings(again, tmp_path / "set", model=KNOWN)
    assert armrs.load_dataset(made.folder).tolerance.force_bias_N == 0.5 and len(list((made.folder / "trials").iterdir())) == 3
    armrs.import_recordings(sources[:1], tmp_path / "set", model=KNOWN, replace=True)
    assert [path.name for path in (tmp_path / "set" / "trials").iterdir()] == ["slow_1.csv"]
    subject = armrs.initialise(tmp_path / "subject", body_mass=78.0, height=1.80, sex="male", lengths=(0.322, 0.264))
    before = (subject.folder / "model.toml").read_bytes()
    with pytest.raises(BadInput, match="a data set that armrs import did not write"):
        armrs.import_recordings(sources, subject.folder, model=subject.model)
    assert (subject.folder / "model.toml").read_bytes() == before and not (subject.folder / "import.toml").exists()
