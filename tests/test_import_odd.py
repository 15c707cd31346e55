"""Tables as spreadsheets, recorders and programs leave them: each becomes the samples of the true recording, or is refused with what to do."""

from __future__ import annotations

import datetime
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import armrs
from armrs.errors import BadInput
from test_import import DEGREE, KNOWN, SI, Recording, recording, repeated, table, write_text

__all__ = ["recording"]
GERMAN = ["Zeit [ms]", "Schulter [°]", "Ellbogen [°]", "Kraft y [N]", "Kraft z [N]"]
START = datetime.datetime(2026, 3, 14, 23, 59, 58)
Writer = Callable[[Recording, Path], Path]


def values(r: Recording, *, t: float = 1.0, angle: float = DEGREE) -> np.ndarray:
    return np.column_stack([r.t * t, r.q * angle, r.force_on_robot])


def rows(samples: np.ndarray, separator: str = ";", decimal: str = ",") -> list[str]:
    return [separator.join(f"{x:.9g}".replace(".", decimal) for x in row) for row in samples]


def text(make: Callable[[Recording], list[str]], name: str = "slow_1.csv", encoding: str = "utf-8", end: str = "\n") -> Writer:
    def write(r: Recording, folder: Path) -> Path:
        (folder / name).write_bytes((end.join(make(r)) + end).encode(encoding))
        return folder / name

    return write


def german(r: Recording) -> list[str]:
    return [";".join(GERMAN), *rows(values(r, t=1e3))]


JAPANESE = ("時間 [ms]", "肩角度 [deg]", "肘角度 [deg]", "前方力 [N]", "上方力 [N]")


def japanese(r: Recording) -> list[str]:
    return [",".join(JAPANESE), *rows(values(r, t=1e3), ",", ".")]


def thousands(r: Recording) -> list[str]:
    marked = [f"{t:,.1f}".replace(",", "_").replace(".", ",").replace("_", ".") for t in 1e3 * r.t]
    return [";".join(GERMAN), *(f"{t};{row}" for t, row in zip(marked, rows(values(r)[:, 1:]), strict=True))]


def quoted(r: Recording) -> list[str]:
    return [",".join(f'"{name}"' for name in GERMAN), *(",".join(f'"{cell}"' for cell in row.split(";")) for row in rows(values(r, t=1e3)))]


def timed(stamp: Callable[[float], str], name: str) -> Callable[[Recording], list[str]]:
    def make(r: Recording) -> list[str]:
        samples = rows(values(r)[:, 1:], ",", ".")
        return [f"{name},shoulder_deg,elbow_deg,Fy_N,Fz_N", *(f"{stamp(t)},{row}" for t, row in zip(r.t, samples, strict=True))]

    return make


def day(t: float) -> str:
    return (START + datetime.timedelta(seconds=t)).isoformat(sep=" ", timespec="microseconds")


def with_means(r: Recording) -> list[str]:
    return [*german(r), "Mittelwert;1,2;3,4;5,6;7,8", "SD;0,1;0,2;0,3;0,4"]


def twice_headed(r: Recording) -> list[str]:
    lines = german(r)
    return [*lines[:200], lines[0], *lines[200:]]


def grouped(r: Recording) -> list[str]:
    return [";Winkel [°];;Kraft [N];", "Zeit [ms];Schulter;Ellbogen;y;z", *rows(values(r, t=1e3))]


def with_errors(r: Recording) -> list[str]:
    lines = german(r)
    for k, cell in ((100, "#DIV/0!"), (101, "****")):
        lines[k] = lines[k].rpartition(";")[0] + f";{cell}"
    return lines


def with_codes(r: Recording) -> list[str]:
    samples = values(r)
    samples[100:104, 1] = samples[250, 3] = -9999.0
    return ["t_s,shoulder_deg,elbow_deg,Fy_N,Fz_N", *rows(samples, ",", ".")]


def with_short_codes(r: Recording) -> list[str]:
    samples = values(r)
    samples[100:104, 1] = samples[250, 3] = -999.0
    return ["t_s,shoulder_deg,elbow_deg,Fy_N,Fz_N", *rows(samples, ",", ".")]


def lost_at_zero(r: Recording) -> list[str]:
    """As a goniometer or a marker that is lost leaves angles; they were taken for measured, 70 degrees off."""
    samples = values(r)
    samples[100:104, 1:3] = 0.0
    return ["t_s,shoulder_deg,elbow_deg,Fy_N,Fz_N", *rows(samples, ",", ".")]


def numpy_header(r: Recording) -> list[str]:
    """As `numpy.savetxt` writes a header of several lines."""
    return ["# Subject 7", "# right arm, 2026", "# time shoulder elbow Fy Fz", "# s deg deg N N", *rows(values(r), " ", ".")]


def time_deltas(r: Recording) -> list[str]:
    """An index of pandas, whose column has no name."""
    cells = rows(values(r)[:, 1:], ",", ".")
    stamps = [f"0 days {datetime.timedelta(seconds=3600.0 + t)!s:0>8}" for t in r.t.tolist()]
    return [",shoulder_deg,elbow_deg,Fy_N,Fz_N", *(f"{stamp},{row}" for stamp, row in zip(stamps, cells, strict=True))]


def index_below(r: Recording) -> list[str]:
    """Columns of two levels, as pandas writes them: the name of the index stands below."""
    return [",Angle,Angle,Force,Force", ",shoulder [deg],elbow [deg],y [N],z [N]", "Time [s],,,,", *rows(values(r), ",", ".")]


def swiss(r: Recording) -> list[str]:
    cells = rows(values(r)[:, 1:], ";", ".")
    marked = [f"{t:,.1f}".replace(",", "\u2019") for t in 1e3 * r.t]
    return [";".join(GERMAN), *(f"{t};{row}" for t, row in zip(marked, cells, strict=True))]


def whole_thousands(r: Recording) -> list[str]:
    """Whole numbers with marks for thousands and no decimal mark: 12.345 mN was read as a fraction."""
    cells = [";".join(f"{x:.9g}".replace(".", ",") for x in row) for row in values(r)[:, 1:3]]
    whole = [[f"{round(x):,}".replace(",", ".") for x in (1e6 * t, *(1e3 * f))] for t, f in zip(r.t, r.force_on_robot, strict=True)]
    return [
        "Zeit [µs];Schulter [°];Ellbogen [°];Kraft y [mN];Kraft z [mN]",
        *(f"{t};{angles};{y};{z}" for angles, (t, y, z) in zip(cells, whole, strict=True)),
    ]


def doubled(r: Recording) -> list[str]:
    lines = german(r)
    return [*lines[:50], lines[49], *lines[50:]]


def labelled_rad(r: Recording) -> list[str]:
    return ["t_s,q1_rad,q2_rad,Fy_N,Fz_N", *rows(values(r), ",", ".")]


def nanoseconds(r: Recording) -> list[str]:
    samples = rows(values(r, angle=1.0)[:, 1:], ",", ".")
    stamps = [1_773_482_102_000_000_000 + round(1e9 * t) for t in r.t]
    return ["rosbagTimestamp,position_1,position_2,force_y,force_z", *(f"{t},{row}" for t, row in zip(stamps, samples, strict=True))]


def from_zero(r: Recording) -> list[str]:
    """Joints as ROS numbers them: position1 was the first, and position0 none."""
    names = "time,field.position0,field.position1,field.wrench.force.y,field.wrench.force.z"
    return [names, *rows(values(r, angle=1.0), ",", ".")]


def italian(r: Recording) -> list[str]:
    return ["Tempo [s];Spalla [gradi];Gomito [gradi];Forza Y [N];Forza Z [N]", *rows(values(r))]


def labchart(r: Recording) -> list[str]:
    head = ["Interval=\t0.01 s", "ChannelTitle=\tShoulder\tElbow\tForce y\tForce z", "Range=\t180 deg\t180 deg\t100 N\t100 N"]
    return [*head, "UnitName=\tdeg\tdeg\tN\tN", *rows(values(r), "\t", ".")]


def labview(r: Recording) -> list[str]:
    head = ["LabVIEW Measurement", "Separator\tTab", "***End_of_Header***", "Channels\t4", "***End_of_Header***"]
    return [*head, "X_Value\tShoulder\tElbow\tForce y\tForce z\tComment", *rows(values(r), "\t", ".")]


def frames(r: Recording) -> list[str]:
    samples = rows(values(r)[:, 1:])
    return ["Frame;Schulter [°];Ellbogen [°];Kraft y [N];Kraft z [N]", *(f"{k};{row}" for k, row in enumerate(samples, start=1))]


def two_devices(r: Recording) -> list[str]:
    """Angles and forces side by side in one sheet, each with its own time; the forces at twice the rate."""
    clock = np.arange(2 * len(r.t) - 1) / 200.0
    force = rows(np.column_stack([clock, *(np.interp(clock, r.t, f) for f in r.force_on_robot.T)]), ",", ".")
    angles = rows(values(r)[:, :3], ",", ".") + [",,"] * (len(force) - len(r.t))
    return ["time,shoulder_deg,elbow_deg,time,Fy_N,Fz_N", *(f"{a},{f}" for a, f in zip(angles, force, strict=True))]


def workbook(fill: Callable[[Recording], list[list[object]]]) -> Writer:
    def write(r: Recording, folder: Path) -> Path:
        openpyxl = pytest.importorskip("openpyxl")
        book = openpyxl.Workbook()
        for row in fill(r):
            book.active.append(row)
        book.save(folder / "slow_1.xlsx")
        return folder / "slow_1.xlsx"

    return write


def aside(r: Recording) -> list[list[object]]:
    """A table that begins in the third column, with a title above and means below."""
    table: list[list[object]] = [[None, None, *row] for row in values(r).tolist()]
    head: list[list[object]] = [[None, None, "Subject 7"], [], [None, None, "t [s]", "Shoulder [deg]", "Elbow [deg]", "Fy [N]", "Fz [N]"]]
    return [*head, *table, [None, None, "Mean", 1.0, 2.0, 3.0, 4.0]]


def dated(r: Recording) -> list[list[object]]:
    samples = [[START + datetime.timedelta(seconds=t), *row] for t, row in zip(r.t.tolist(), values(r)[:, 1:].tolist(), strict=True)]
    return [["Time", "Shoulder (deg)", "Elbow (deg)", "Fy (N)", "Fz (N)"], *samples]


def merged(r: Recording) -> list[list[object]]:
    """A title of each group over its columns, and the time over both rows."""
    head: list[list[object]] = [
        ["Time", "Angles", None, "Force", None],
        [None, "Shoulder", "Elbow", "y", "z"],
        ["ms", "deg", "deg", "N", "N"],
    ]
    return [["Subject 7"], *head, *values(r, t=1e3).tolist()]


def german_text(r: Recording) -> list[list[object]]:
    cells = [line.split(";") for line in thousands(r)]
    return [list(row) for row in cells]


def archive(r: Recording, folder: Path) -> Path:
    np.savez(folder / "slow_1.npz", t=r.t, q=r.q, force=r.force_on_robot)
    return folder / "slow_1.npz"


def structs(r: Recording, folder: Path) -> Path:
    """A cell array of structs, a trial each, with the force as a matrix."""
    from scipy.io import savemat

    cells = np.empty(2, dtype=object)
    for k in range(2):
        cells[k] = {"t": r.t, "q": r.q + 1e-3 * k, "force": r.force_on_robot}
    savemat(folder / "slow.mat", {"trials": cells})
    return folder / "slow.mat"


CASES: dict[str, tuple[Writer, dict[str, object], str]] = {
    "marks for thousands": (text(thousands, encoding="cp1252"), {}, "decimal comma"),
    "every cell in quotes, commas within and between": (text(quoted), {}, "cells between commas, decimal comma"),
    "date and time of day, over midnight": (text(timed(day, "timestamp")), {}, "in s as stated"),
    "time of day": (text(timed(lambda t: f"10:15:{2.0 + t:06.3f}", "Time")), {}, "in s as stated"),
    "means below the samples": (text(with_means, encoding="cp1252"), {}, "2 rows without a time"),
    "a header that stands twice": (text(twice_headed), {}, "Zeit [ms]: cells without a number, which count as missing: 1"),
    "groups above the names": (text(grouped), {}, "'Kraft y'"),
    "error messages of a spreadsheet": (text(with_errors), {}, "Kraft z [N]: cells without a number, which count as missing: 2"),
    "codes for missing values": (text(with_codes), {}, "-9999 counts as missing"),
    "short codes for missing values": (text(with_short_codes), {}, "-999 counts as missing"),
    "angles lost at zero": (text(lost_at_zero), {}, "0 counts as missing, 4 times"),
    "names and units in comments": (text(numpy_header), {}, "cells between blanks"),
    "time as days and time of day": (text(time_deltas), {}, "column 'time'"),
    "the name of an index below the names": (text(index_below), {}, "'y [N]'"),
    "apostrophes for thousands": (text(swiss), {}, "decimal point"),
    "whole numbers with marks for thousands": (text(whole_thousands), {}, "decimal comma"),
    "a row twice": (text(doubled), {}, "1 row that repeats the row before"),
    "degrees under the name of radians": (text(labelled_rad), {}, "in degrees, although its header says rad"),
    "Shift-JIS": (
        text(japanese, encoding="cp932"),
        {"columns_map": ",".join(f"{symbol}={name}" for symbol, name in zip(("t", "q1", "q2", "Fy", "Fz"), JAPANESE, strict=True))},
        "text in Shift-JIS",
    ),
    "UTF-16 without its mark": (text(german, encoding="utf-16-le"), {}, "text in UTF-16"),
    "line ends of an old Macintosh": (text(german, end="\r"), {}, "decimal comma"),
    "nanoseconds since 1970": (text(nanoseconds), {}, "so in ns"),
    "joints counted from zero": (text(from_zero), {}, "'field.position0', joints counted from zero"),
    "Italian degrees": (text(italian, encoding="utf-16"), {}, "column 'Gomito [gradi]'"),
    "LabChart": (text(labchart, "slow_1.txt"), {}, "export of LabChart"),
    "LabVIEW": (text(labview, "slow_1.lvm"), {}, "cells between tabs"),
    "text under the suffix of a workbook": (text(german, "slow_1.xls"), {}, "decimal comma"),
    "frames instead of time": (text(frames), {"rate": 100.0}, "samples at 100 Hz, as stated"),
    "two devices side by side": (text(two_devices), {}, "2 columns of time"),
    "workbook with a table aside": (workbook(aside), {}, "1 row without a time"),
    "workbook with merged names": (workbook(merged), {}, "in ms as stated"),
    "workbook of numbers as text with marks for thousands": (workbook(german_text), {}, "in ms as stated"),
    "workbook with dates": (workbook(dated), {}, "in s as stated"),
    "NumPy archive": (archive, {}, "'force y'"),
    "cell array of structs": (structs, {}, "'force z'"),
}


WITHIN = {"two devices side by side": 0.05, "whole numbers with marks for thousands": 5.001e-4}
"""Differences of forces by interpolation and rounding [N]."""


@pytest.mark.parametrize("case", CASES)
def test_an_odd_table_becomes_the_true_samples(case: str, recording: Recording, tmp_path: Path) -> None:
    write, options, said = CASES[case]
    done = armrs.import_recordings([write(recording, tmp_path)], tmp_path / "set", model=KNOWN, **options)  # type: ignore[arg-type]
    assert any(said in note for note in done.notes), done.notes
    trial = armrs.load_dataset(done.folder).trials[0]
    assert len(trial.t) == len(recording.t) and np.abs(trial.t - trial.t[0] - recording.t).max() < 1e-6
    measured = ~trial.filled & trial.valid
    assert measured.mean() > 0.97
    assert np.abs(trial.q - recording.q)[measured].max() < 1e-8
    assert trial.force_on_arm is not None
    assert np.abs(trial.force_on_arm + recording.force_on_robot)[measured].max() < WITHIN.get(case, 1e-8)
    again = armrs.import_recordings([done.folder / "import.toml"], tmp_path / "again", model=KNOWN)
    assert all((again.folder / t.file).read_bytes() == (done.folder / t.file).read_bytes() for t in armrs.load_dataset(done.folder).trials)


REFUSED: dict[str, tuple[str, bytes, str]] = {
    "a workbook of the old format": ("slow_1.xls", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(600), "save it as .xlsx"),
    "OpenDocument": ("slow_1.ods", b"PK\x03\x04", "save it as .xlsx or .csv"),
    "compressed": ("slow_1.csv.gz", b"\x1f\x8b", "unpack it first"),
    "NumPy objects": ("slow_1.npz", b"PK\x05\x06" + bytes(18), "no numeric vector"),
    "damaged archive": ("slow_1.npz", b"PK\x03\x04 broken", "no readable NumPy archive"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_read_says_what_to_do(case: str, tmp_path: Path) -> None:
    name, content, step = REFUSED[case]
    (tmp_path / name).write_bytes(content)
    with pytest.raises(BadInput) as refused:
        armrs.import_recordings([tmp_path / name], tmp_path / "set", model=KNOWN)
    assert step in str(refused.value) and str(tmp_path / name) in str(refused.value)


def test_two_recordings_in_one_file_are_refused(recording: Recording, tmp_path: Path) -> None:
    """They were written as one trial, which no verb could read."""
    samples = values(recording, t=1e3)
    samples[300:, 0] -= samples[300, 0]
    path = text(lambda _: [";".join(GERMAN), *rows(samples)])(recording, tmp_path)
    with pytest.raises(BadInput, match=r"found 0 after 2990 in sample 301, allowed time stamps that increase \(two recordings in one file"):
        armrs.import_recordings([path], tmp_path / "set", model=KNOWN)
    assert not (tmp_path / "set").exists()


def test_files_that_all_state_a_wrong_unit_are_alike(recording: Recording, tmp_path: Path) -> None:
    """The first was read by the size of its values, and the others were refused for the unit that its own header states."""
    names, values = table(recording, names=["Zeit [s]", *SI[1:]], t=1e3, angle=DEGREE)
    files = [write_text(tmp_path / f"slow_{k}.csv", names, repeated(values, k)) for k in (1, 2)]
    imported = armrs.import_recordings(files, tmp_path / "set", model=KNOWN)
    assert len(imported.recipe.trials) == 2
    # Where one header states what the others only hold, it is the same column.
    third = write_text(tmp_path / "slow_3.csv", [names[0], "q1_deg", *names[2:]], repeated(values, 3))
    assert len(armrs.import_recordings([*files, third], tmp_path / "three", model=KNOWN).recipe.trials) == 3
    other = write_text(tmp_path / "slow_4.csv", [names[0], "q1_mrad", *names[2:]], repeated(values, 4))
    with pytest.raises(armrs.BadInput, match=r"slow_4\.csv: column 'q1_mrad': found 'mrad', allowed deg, as in the first file"):
        armrs.import_recordings([*files, other], tmp_path / "other", model=KNOWN)


def test_what_could_not_be_read_again_is_not_written(tmp_path: Path, recording: Recording) -> None:
    """Angles counted five turns away, as import.toml has them: the data set was written, refused, and left behind."""
    samples = values(recording)
    samples[:, 1] += 1800.0
    source = tmp_path / "slow_1.csv"
    source.write_text("\n".join([";".join(["time [s]", *GERMAN[1:]]), *rows(samples, decimal=".")]) + "\n", encoding="utf-8")
    decided = armrs.import_recordings([source], tmp_path / "set", model=KNOWN).folder / "import.toml"
    text, count = re.subn(r"lowest = \S+", "lowest = 1620.0", decided.read_text(encoding="utf-8"))
    decided.write_text(text, encoding="utf-8")
    with pytest.raises(BadInput, match=r"out/trials/slow_1\.csv.*looks like degrees"):
        armrs.import_recordings([decided], tmp_path / "out", model=KNOWN)
    assert count == 1 and not (tmp_path / "out").exists()


def test_a_name_that_no_table_has_is_refused(recording: Recording, tmp_path: Path) -> None:
    """Beside a column that is recognised by itself, what --map said was passed over."""
    path = write_text(tmp_path / "slow_1.csv", *table(recording, names=SI))
    with pytest.raises(BadInput, match=r"--map: found unknown column 'Fy_corrected', allowed Fy_N, Fz_N, q1_rad, q2_rad, t_s"):
        armrs.import_recordings([path], tmp_path / "set", model=KNOWN, columns_map="Fy=Fy_corrected")


@pytest.mark.parametrize("name", ["shoulder_torque", "elbow_velocity"])
def test_torques_or_speeds_of_some_joints_are_left_out(name: str, recording: Recording, tmp_path: Path) -> None:
    """A torque of one joint was refused in a file that nobody had written; a speed of one ended with a traceback."""
    samples = np.column_stack([table(recording, names=SI)[1], np.sin(recording.t)])
    path = write_text(tmp_path / "slow_1.csv", [*SI, name], samples)
    done = armrs.import_recordings([path], tmp_path / "set", model=KNOWN)
    assert any(f"of some joints only, so not used: '{name}'" in note for note in done.notes)
    (trial,) = armrs.load_dataset(done.folder).trials
    assert trial.tau is None and trial.dq is None


def test_states_of_opensim_are_angles_and_speeds(recording: Recording, tmp_path: Path) -> None:
    """Names are paths, speeds are in the unit of the angles a second, and `arm_flex` is the shoulder."""
    joints = ("/jointset/shoulder/arm_flex_r", "/jointset/elbow/elbow_flex_r")
    names = [
        "time",
        *(f"{joint}/{what}" for joint in joints for what in ("value", "speed")),
        "hand_force_vx",
        "hand_force_vy",
        "hand_torque_x",
    ]
    speeds = np.gradient(recording.q, recording.t, axis=0)
    states = np.stack([recording.q, speeds], axis=2).reshape(len(speeds), 4)
    samples = np.column_stack([recording.t, states, recording.force_on_robot, 0.0 * recording.t])
    head = f"slow\nversion=3\nOpenSimVersion=4.4\nnRows={len(samples)}\nnColumns={len(names)}\ninDegrees=no\nendheader\n"
    path = write_text(tmp_path / "slow_1.sto", names, samples, sep="\t", above=head)
    done = armrs.import_recordings([path], tmp_path / "set", model=KNOWN)
    units = {c.symbol: c.unit for c in done.recipe.channels}
    assert [units[symbol] for symbol in ("q1", "q2", "dq1", "dq2")] == ["rad", "rad", "rad/s", "rad/s"]
    assert not any(c.symbol.startswith("tau") for c in done.recipe.channels)
    assert np.abs(armrs.load_dataset(done.folder).trials[0].q - recording.q).max() < 1e-8


def test_forces_of_a_motion_file_are_not_in_degrees(recording: Recording, tmp_path: Path) -> None:
    """`Fy` of a file that says inDegrees=yes was refused: found 'deg', allowed a unit of force."""
    names = ["time", "q1", "q2", "Fy", "Fz"]
    samples = np.column_stack([recording.t, recording.q * DEGREE, recording.force_on_robot])
    head = f"slow\nversion=1\nnRows={len(samples)}\nnColumns={len(names)}\ninDegrees=yes\nendheader\n"
    path = write_text(tmp_path / "slow_1.mot", names, samples, sep="\t", above=head)
    done = armrs.import_recordings([path], tmp_path / "set", model=KNOWN)
    assert {c.symbol: c.unit for c in done.recipe.channels if c.symbol[0] == "q"} == {"q1": "deg", "q2": "deg"}
    assert np.abs(armrs.load_dataset(done.folder).trials[0].q - recording.q).max() < 1e-8


def _one_turn(r: Recording, folder: Path, wrap: Callable[[np.ndarray], np.ndarray]) -> list[Path]:
    """Two repeats in degrees, which begin at 0 s and 1 s of the recording, as a recorder writes angles that it wraps."""
    made = []
    for repeat in (1, 2):
        samples = repeated(np.column_stack([r.t, r.q * DEGREE, r.force_on_robot]), repeat)[100 * (repeat - 1) :]
        samples[:, 1:3] = wrap(samples[:, 1:3])
        made.append(write_text(folder / f"slow_{repeat}.csv", ["t_s", "q1_deg", "q2_deg", "Fy_N", "Fz_N"], samples))
    return made


@pytest.mark.parametrize(
    ("wrap", "wrapped"),
    [
        (lambda q: np.mod(q, 360.0), "0 to 360°"),
        (lambda q: np.mod(q + (offset := np.array([45.0, -60.0])), 360.0) - offset, "wrapped within the movement"),
        (lambda q: q + 360.0 * (q[0] < [-50.0, 50.0]), "whole turns off in some trials"),
    ],
)
def test_angles_are_counted_in_one_turn_in_all_trials(
    wrap: Callable[[np.ndarray], np.ndarray], wrapped: str, recording: Recording, tmp_path: Path
) -> None:
    """Each trial was unwrapped from its own first sample, and the same movement stood a turn apart in two trials."""
    done = armrs.import_recordings(_one_turn(recording, tmp_path, wrap), tmp_path / "set", model=KNOWN)
    again = armrs.import_recordings([done.folder / "import.toml"], tmp_path / "again", model=KNOWN)
    assert again.recipe.channels == done.recipe.channels
    assert any(c.lowest is not None and "turn from" in c.why for c in done.recipe.channels), wrapped
    for made in (done, again):
        for k, trial in enumerate(armrs.load_dataset(made.folder).trials):
            assert np.abs(trial.q - recording.q[100 * k :]).max() < 1e-5  # the noise of `repeated` is 1e-4 degrees


def test_angles_within_a_turn_are_left_as_they_are(recording: Recording, tmp_path: Path) -> None:
    done = armrs.import_recordings(_one_turn(recording, tmp_path, lambda q: q), tmp_path / "set", model=KNOWN)
    assert [c.lowest for c in done.recipe.channels] == [None] * 5 and "lowest" not in (done.folder / "import.toml").read_text()


@pytest.mark.parametrize(
    ("newtons", "words"),
    [
        (4.4482216, "(forces stated in N that are lbf? Then 0."),
        (1e3, "forces stated in N that are kN?"), (1e-3, "forces stated in kN that are N?"),
    ],
)  # fmt: skip
def test_forces_in_another_unit_are_not_taken_for_another_convention(
    newtons: float, words: str, recording: Recording, tmp_path: Path
) -> None:
    """The refusal named two conventions that explain the forces equally well, and nothing else."""
    path = write_text(tmp_path / "slow_1.csv", *table(recording, names=SI, force=1.0 / newtons))
    with pytest.raises(BadInput) as refused:
        armrs.import_recordings([path], tmp_path / "set", model=KNOWN)
    assert words in str(refused.value)


def test_kilograms_force_are_told_where_a_convention_is_taken_or_contradicted(recording: Recording, tmp_path: Path) -> None:
    """They were imported in a wrong convention without a hint, and who stated the right one was advised not to."""
    path = write_text(tmp_path / "slow_1.csv", *table(recording, names=SI, force=1.0 / 9.80665))
    said = "forces stated in N that are kgf? Then 0."
    with pytest.warns(armrs.ArmrsWarning, match=re.escape(said)):
        armrs.import_recordings([path], tmp_path / "set", model=KNOWN)
    stated = {"angles": "relative", "zero": "horizontal", "clockwise": (), "force_on": "robot"}
    with pytest.raises(BadInput, match="in every convention that agrees with it") as refused:
        armrs.import_recordings([path], tmp_path / "again", model=KNOWN, **stated)
    assert said in str(refused.value) and "leave the option out" not in str(refused.value)


def test_noise_is_no_other_unit(recording: Recording, tmp_path: Path) -> None:
    names, values = table(recording, names=SI)
    values[:, 3:] = np.random.default_rng(1).standard_normal((len(values), 2))
    with pytest.raises(BadInput, match="unexplained by the best convention") as refused:
        armrs.import_recordings([write_text(tmp_path / "slow_1.csv", names, values)], tmp_path / "set", model=KNOWN)
    assert "that are" not in str(refused.value)
