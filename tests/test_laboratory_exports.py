"""Text exports of laboratory programs, written as these programs write them, become the data set of what they recorded.

Layouts: Vicon Nexus (sections, each with its rate), Qualisys Track Manager (keys above the rows, plates in files beside), OptiTrack Motive
(type, name and component above each column), KUKA's DataRecorder (time in two columns), Biodex (one joint), Delsys (refused).
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import armrs
from armrs.errors import BadInput
from armrs.io.raw import read_raw
from armrs.workflows.importing import joint_markers

LENGTHS = (0.322, 0.264)
SEGMENTS = (
    armrs.Segment("upper arm", LENGTHS[0], 2.114, 0.186, 0.0165),
    armrs.Segment("forearm", LENGTHS[1], 1.264, 0.121, 0.0074),
)
KNOWN = armrs.Model(SEGMENTS, (armrs.Joint("shoulder"), armrs.Joint("elbow")))
RATE = 100.0
PER_FRAME = 5
"""Samples of the devices in each frame of the cameras."""


@pytest.fixture(scope="module")
def run() -> armrs.Simulation:
    joints = (
        armrs.Joint("shoulder", stiffness=0.6, rest=-0.9, viscosity=0.15),
        armrs.Joint("elbow", stiffness=0.4, rest=0.7, viscosity=0.1),
    )
    model = armrs.Model(SEGMENTS, joints, robot=armrs.Robot((0.45, 0.45), (1.05, -0.10)))
    points = np.radians([[-60, 40], [-25, 75], [-70, 90], [-40, 30], [-60, 40]])
    return armrs.simulate(model, armrs.Movement(points, speed=0.5, acceleration=2.0), rate=RATE)


def markers(run: armrs.Simulation, *, up: int, forward: int) -> np.ndarray:
    """Return shoulder, elbow and hand in millimetres, shape (n, 3, 3), in a laboratory whose axes are these."""
    absolute = np.cumsum(run.q, axis=1)
    at = np.zeros((len(run.t), 3, 3))
    at[:, :, :] = (1200.0, 800.0, 950.0)
    for k, length in enumerate(LENGTHS, start=1):
        for point in range(k, 3):
            at[:, point, forward] += 1e3 * length * np.cos(absolute[:, k - 1])
            at[:, point, up] += 1e3 * length * np.sin(absolute[:, k - 1])
    return at


def forces(run: armrs.Simulation, *, up: int, forward: int) -> np.ndarray:
    """Return the force on the robot in the same axes, shape (n, 3) [N]."""
    found = np.zeros((len(run.t), 3))
    found[:, forward], found[:, up] = -run.force_on_arm.T
    return found


def rows(values: np.ndarray, sep: str, digits: int = 9) -> list[str]:
    return [sep.join("" if np.isnan(x) else f"{x:.{digits}g}" for x in row) for row in values]


def written(path: Path, lines: list[str], end: str = "\r\n") -> Path:
    path.write_bytes((end.join(lines) + end).encode("utf-8"))
    return path


def vicon(run: armrs.Simulation, folder: Path, *, first: int = 1, forward: int = 1, sep: str = ",") -> Path:
    """Devices at five times the rate of the cameras, then the markers: 500 and 100 Hz."""
    at, force = markers(run, up=2, forward=forward), forces(run, up=2, forward=forward)
    n = len(run.t)
    frame, sub = np.divmod(np.arange(PER_FRAME * n), PER_FRAME)
    fine = np.column_stack([np.interp(np.arange(PER_FRAME * n) / (PER_FRAME * RATE), run.t, f) for f in force.T])
    devices = np.column_stack([frame + first, sub, fine, 0.0 * fine])
    cameras = np.column_stack([np.arange(n) + first, np.zeros(n), at.reshape(n, 9)])
    blank = [""] * 2
    group = "Imported AMTI OR6 Series Force Plate #1"
    lines = [
        "Devices", f"{PER_FRAME * RATE:g}", sep.join([*blank, f"{group} - Force", *blank, f"{group} - Moment", *blank]),
        sep.join(["Frame", "Sub Frame", "Fx", "Fy", "Fz", "Mx", "My", "Mz"]), sep.join([*blank, *["N"] * 3, *["N.mm"] * 3]),
        *rows(devices, sep), "",
        "Trajectories", f"{RATE:g}", sep.join([*blank, "S7:SHO", *blank, "S7:ELB", *blank, "S7:HAND", *blank]),
        sep.join(["Frame", "Sub Frame", *["X", "Y", "Z"] * 3]), sep.join([*blank, *["mm"] * 9]),
        *rows(cameras, sep),
    ]  # fmt: skip
    return written(folder / "slow_1.csv", lines)


def qualisys(run: armrs.Simulation, folder: Path) -> Path:
    """Markers, and the plate in a file of its own at five times their rate."""
    at, force = markers(run, up=2, forward=0), forces(run, up=2, forward=0)
    n = len(run.t)
    head = [
        f"NO_OF_FRAMES\t{n}", "NO_OF_CAMERAS\t8", "NO_OF_MARKERS\t3", f"FREQUENCY\t{RATE:g}", "NO_OF_ANALOG\t0", "ANALOG_FREQUENCY\t0",
        "DESCRIPTION\t--", "TIME_STAMP\t2026-03-14, 15:49:44.620\t25975.44751328", "DATA_INCLUDED\t3D", "MARKER_NAMES\tSHO\tELB\tHAND",
        "TRAJECTORY_TYPES\tMeasured\tMeasured\tMeasured",
    ]  # fmt: skip
    written(folder / "slow_1.tsv", [*head, *rows(at.reshape(n, 9), "\t")])
    clock = np.arange(PER_FRAME * n) / (PER_FRAME * RATE)
    fine = np.column_stack([np.interp(clock, run.t, f) for f in force.T])
    plate = [
        f"NO_OF_SAMPLES\t{len(clock)}", f"FREQUENCY\t{PER_FRAME * RATE:g}", "TIME_STAMP\t2026-03-14, 15:49:44.620\t25975.44751328",
        "FIRST_SAMPLE\t1", "DESCRIPTION\tForce data in world (lab) coordinates", "DATA_INCLUDED\tForce", "FORCE_PLATE_NAME\tForce-plate 1",
        "\t".join(["SAMPLE", "TIME", *(f"{what}_{axis}" for what in ("Force", "Moment", "COP") for axis in "XYZ")]),
    ]  # fmt: skip
    numbers = np.column_stack([np.arange(len(clock)) + 1, clock, fine, np.zeros((len(clock), 6))])
    written(folder / "slow_1_f_1.tsv", [*plate, *rows(numbers, "\t")])
    return folder


def motive(run: armrs.Simulation, folder: Path, *, of_markers: bool = False) -> Path:
    """Markers with y up, as Motive exports them, and the force of another device on its own clock, in its axes or in those of the markers."""
    at = 1e-3 * markers(run, up=1, forward=2)
    n = len(run.t)
    names = [name for name in ("Arm:SHO", "Arm:ELB", "Arm:HAND") for _ in "XYZ"]
    head = [
        f"Format Version,1.23,Take Name,slow 1,Take Notes,,Capture Frame Rate,{RATE:f},Export Frame Rate,{RATE:f},"
        f"Capture Start Time,2026-03-14 12.09.45.344 PM,Total Exported Frames,{n},Rotation Type,Quaternion,Length Units,Meters,"
        "Coordinate Space,Global",
        "",
        ",".join(["", "Type", *["Marker"] * 9]), ",".join(["", "Name", *names]), ",".join(["", "ID", *["A1:10001"] * 9]),
        ",".join(["", "", *["Position"] * 9]), ",".join(["Frame", "Time (Seconds)", *["X", "Y", "Z"] * 3]),
    ]  # fmt: skip
    written(folder / "slow_1.csv", [*head, *rows(np.column_stack([np.arange(n), run.t, at.reshape(n, 9)]), ",")])
    clock = np.arange(0.0, run.t[-1] + 2.0, 0.004)
    own = forces(run, up=1, forward=2) if of_markers else -run.force_on_arm
    force = np.column_stack([np.interp(clock - 1.3, run.t, f) for f in own.T])
    names = [f"F{axis} [N]" for axis in ("xyz" if of_markers else "yz")]
    written(folder / "slow_1_force.csv", [",".join(["time [s]", *names]), *rows(np.column_stack([clock, force]), ",")])
    return folder


def kuka(run: armrs.Simulation, folder: Path) -> Path:
    """Angles of the arm in a table, and what the robot recorded: seconds and nanoseconds of its own clock."""
    written(folder / "slow_1.csv", ["time [s],shoulder [rad],elbow [rad]", *rows(np.column_stack([run.t, run.q]), ",")])
    clock = np.arange(0.0, run.t[-1], 0.005)
    force = np.column_stack([np.zeros(len(clock)), *(np.interp(clock, run.t, f) for f in -run.force_on_arm.T)])
    seconds, rest = np.divmod(np.round(1e9 * (clock + 0.25)).astype(np.int64), 1_000_000_000)
    axes = [f"axisQMsr_LBR_iiwa_7_R800_1[{k}]" for k in range(7)]
    names = ["ZeitInSec", "ZeitInNanoSec", *axes, *(f"cartForce1_{a}" for a in "XYZ"), *(f"cartTorque1_Tau{a}" for a in "XYZ")]
    lines = [
        " ".join([str(1_773_500_000 + int(s)), str(int(r)), *["0.25"] * 7, *(f"{x:.9g}" for x in f), *["0.0"] * 3])
        for s, r, f in zip(seconds, rest, force, strict=True)
    ]
    written(folder / "slow_1_kuka.log", ["% " + " ".join(names), *lines], end="\n")
    return folder


MARKERS = {"points": ("SHO", "ELB", "HAND")}
CASES: dict[str, tuple[Callable[..., Path], dict[str, object], float]] = {
    "Vicon": (vicon, MARKERS, 1e-6),
    "Vicon, forward is x": (lambda run, folder: vicon(run, folder, forward=0), MARKERS, 1e-6),
    "Vicon with tabs, from frame 101": (lambda run, folder: vicon(run, folder, first=101, sep="\t"), MARKERS, 1e-6),
    "Qualisys": (qualisys, MARKERS, 1e-6),
    "OptiTrack": (motive, MARKERS, 2e-2),
    "OptiTrack, force in the axes of the markers": (lambda run, folder: motive(run, folder, of_markers=True), MARKERS, 2e-2),
    "KUKA": (kuka, {}, 2e-2),
}
"""Writer, options of the import, and the error of the forces as a share of the largest: of those with a clock of their own, as documented."""


@pytest.mark.parametrize("case", CASES)
def test_an_export_becomes_the_data_set(case: str, run: armrs.Simulation, tmp_path: Path) -> None:
    write, options, rounding = CASES[case]
    raw = tmp_path / "raw"
    raw.mkdir()
    path = write(run, raw)
    sources = sorted(path.iterdir()) if path.is_dir() else [path]
    done = armrs.import_recordings(sources, tmp_path / "session", model=KNOWN, **options)  # type: ignore[arg-type]
    (trial,) = armrs.load_dataset(done.folder).trials
    n = len(trial.t)
    same = np.isfinite(trial.force_on_arm).all(axis=1)
    assert same.mean() > 0.9
    assert np.abs((trial.t - trial.t[0]) - (run.t - run.t[0])[:n]).max() < 1e-6
    assert np.abs(trial.q - run.q[:n]).max() < 1e-6
    assert np.abs(trial.force_on_arm - run.force_on_arm[:n])[same].max() <= rounding * np.abs(run.force_on_arm).max()
    again = armrs.import_recordings([done.folder / "import.toml"], tmp_path / "again", model=KNOWN)
    assert (again.folder / "trials" / "slow_1.csv").read_bytes() == (done.folder / "trials" / "slow_1.csv").read_bytes()


def test_a_frame_that_a_marker_was_not_seen_in_stays_empty(run: armrs.Simulation, tmp_path: Path) -> None:
    text = vicon(run, tmp_path).read_text().splitlines()
    place = next(k for k, line in enumerate(text) if line == "Trajectories")
    cells = text[place + 25].split(",")
    text[place + 25] = ",".join([*cells[:5], "", "", "", *cells[8:]])
    (table,) = read_raw(written(tmp_path / "gap.csv", text))
    assert table.markers is not None
    assert np.isnan(table.markers.positions[20, 1]).all() and np.isfinite(table.markers.positions[[19, 21]]).all()
    qualisys(run, tmp_path)
    lines = (tmp_path / "slow_1.tsv").read_text().splitlines()
    lines[-1] = "\t".join(["0.000"] * 3 + lines[-1].split("\t")[3:])
    (table,) = read_raw(written(tmp_path / "zeros.tsv", lines))
    assert table.markers is not None and np.isnan(table.markers.positions[-1, 0]).all()


def test_joint_angles_of_model_outputs_need_to_be_chosen(run: armrs.Simulation, tmp_path: Path) -> None:
    """A model of Nexus gives three angles a joint; which of them is that of the plane, `--map` says."""
    n = len(run.t)
    q = np.degrees(run.q)
    angles = np.column_stack([np.arange(n) + 1, np.zeros(n), q[:, 0], 0 * q, q[:, 1], 0 * q])
    head = [
        "Model Outputs",
        f"{RATE:g}",
        ",,S7:RShoulderAngles,,,S7:RElbowAngles,,",
        "Frame,Sub Frame,X,Y,Z,X,Y,Z",
        ",,deg,deg,deg,deg,deg,deg",
    ]
    lines = vicon(run, tmp_path).read_text().splitlines()
    devices = lines[: next(k for k, line in enumerate(lines) if line == "Trajectories")]
    path = written(tmp_path / "slow_1.csv", [*devices, *head, *rows(angles, ","), ""])
    with pytest.raises(BadInput, match=r"one column for q1.*--map 'q1=S7:RShoulderAngles X'") as refused:
        armrs.import_recordings([path], tmp_path / "no", model=KNOWN)
    assert "one column for q2" in str(getattr(refused.value, "problems", ""))
    chosen = "q1=S7:RShoulderAngles X,q2=S7:RElbowAngles X"
    done = armrs.import_recordings([path], tmp_path / "session", model=KNOWN, columns_map=chosen)
    (trial,) = armrs.load_dataset(done.folder).trials
    assert np.abs(trial.q - run.q).max() < 1e-6


def test_markers_are_recognised_by_their_names(run: armrs.Simulation, tmp_path: Path) -> None:
    done = armrs.import_recordings([vicon(run, tmp_path)], tmp_path / "session", model=KNOWN)
    assert done.recipe.points == ("SHO", "ELB", "HAND")
    assert "joints and handle are the markers SHO, ELB, HAND, by their names; --points names others" in done.notes
    again = armrs.import_recordings([done.folder / "import.toml"], tmp_path / "again", model=KNOWN)
    assert np.array_equal(armrs.load_dataset(again.folder).trials[0].q, armrs.load_dataset(done.folder).trials[0].q)
    assert np.abs(armrs.load_dataset(done.folder).trials[0].q - run.q).max() < 1e-5


def test_markers_of_unknown_names_are_listed(run: armrs.Simulation, tmp_path: Path) -> None:
    path = vicon(run, tmp_path)
    path.write_text(path.read_text().replace("S7:ELB", "S7:M2"))
    allowed = "3 markers, of the joints from the shoulder on and of the handle, of SHO, M2, HAND"
    with pytest.raises(BadInput, match=f"--points: found nothing, allowed {allowed}"):
        armrs.import_recordings([path], tmp_path / "session", model=KNOWN)


@pytest.mark.parametrize(
    ("names", "n_joints", "points"),
    [
        ("LSHO RSHO RUPA RELB RWRA RWRB RFIN", 2, "RSHO RELB RFIN"),
        ("LSHO RSHO RUPA RELB RWRA RWRB RFIN", 3, "RSHO RELB RWRA+RWRB RFIN"),
        ("LSHO LELB LFIN RSHO RELB RFIN", 2, ""),
        ("P1:R.Shoulder P1:R.Elbow P1:R.Wrist", 2, "R.Shoulder R.Elbow R.Wrist"),
        ("ac_r el_r em_r rs_r us_r hm3_r", 3, "ac_r el_r+em_r rs_r+us_r hm3_r"),
        ("Shoulder_L Elbow_Lat_L Elbow_Med_L Handle", 2, "Shoulder_L Elbow_Lat_L+Elbow_Med_L Handle"),
        ("r_acromion r_humerus_epicondyle r_radius_styloid", 2, "r_acromion r_humerus_epicondyle r_radius_styloid"),  # OpenSim's arm26
        ("CLAV_AC ACRO_tip EPICl EPICm STYLr STYLr_up STYLu", 2, "ACRO_tip EPICl+EPICm STYLr+STYLu"),
        ("RSHO LSHO RELB LELB Handle", 2, ""),
        ("RSHO RELB RWRA", 2, ""),
        ("SHO ELB WRI HAND", 1, ""),
    ],
)
def test_marker_sets_that_are_known(names: str, n_joints: int, points: str) -> None:
    assert joint_markers.guess(names.split(), n_joints) == tuple(points.split())


BIODEX = [
    "Biodex Medical Systems",
    "Patient: 7",
    "Protocol: passive",
    "",
    "Elbow, right",
    "    TIME    TORQUE  POSITION  POS (ANAT)  VELOCITY",
]


@pytest.mark.parametrize(("unit", "factor"), [("N-M", 1.0), ("FT-LBS", 1.3558179483314)])
def test_a_dynamometer_gives_one_joint(unit: str, factor: float, tmp_path: Path) -> None:
    t = np.arange(0, 8000, 10)
    q = 60.0 + 30.0 * np.sin(1e-3 * t)
    torque = 4.0 + 2.0 * np.cos(np.radians(q))
    lines = [
        f"{k:8d}{m / factor:12.6f}{a:12.5f}{a - 90:12.5f}{v:12.5f}" for k, m, a, v in zip(t, torque, q, np.gradient(q, 0.01), strict=True)
    ]
    path = written(tmp_path / "passive_1.txt", [*BIODEX, f"    mSec {unit} DEGREES DEGREES DEG/SEC", *lines])
    one = armrs.Model((armrs.Segment("forearm", 0.35, 1.7, 0.16, 0.02),), (armrs.Joint("elbow"),))
    done = armrs.import_recordings([path], tmp_path / "session", model=one)
    (trial,) = armrs.load_dataset(done.folder).trials
    assert np.abs(trial.t - 1e-3 * t).max() < 1e-9
    assert np.abs(trial.q[:, 0] - np.radians(q)).max() < 1e-6
    assert np.abs(trial.tau[:, 0] - torque).max() < 1e-5
    assert any("Biodex" in note and "torque is taken as that on the arm" in note for note in done.notes)
    with pytest.raises(BadInput, match=r"angles of 1 joint.*allowed 2"):
        armrs.import_recordings([path], tmp_path / "two", model=KNOWN)


DELSYS = {
    "EMGworks": ['Label: Biceps Sampling frequency: 1925.93 Unit: V Domain: Time', 'X[s],"Biceps: EMG 1 [V]",X[s],"Triceps: EMG 2 [V]"', *["0.0,1e-6,0.0,2e-6"] * 20],
    "Trigno Discover": ["Application:,Trigno Discover (1.7.0)", "Date/Time:,14/03/2026", "Collection Length (seconds):,10.2", "Biceps (81729),", "sensor mode: 50,",
                        "EMG 1 Time Series (s),EMG 1 (mV)", ",2148.148 Hz", "", *["0.0,0.01"] * 20],
}  # fmt: skip


@pytest.mark.parametrize("program", DELSYS)
def test_muscle_activity_alone_is_refused_by_name(program: str, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"slow_1.csv: file: found an export of Delsys.*emg_NAME"):
        armrs.import_recordings([written(tmp_path / "slow_1.csv", DELSYS[program])], tmp_path / "session", model=KNOWN)


DAMAGED: dict[str, tuple[Callable[[list[str]], list[str]], str]] = {
    "a word among numbers": (lambda lines: [*lines[:9], lines[9].replace("1.", "x", 1), *lines[10:]], "a number, or an empty cell"),
    "no rate": (lambda lines: [lines[0], "fast", *lines[2:]], "the rate in Hz below the title"),
    "no rows": (lambda lines: lines[:5], "an export with Trajectories, Model Outputs or Devices"),
    "feet": (lambda lines: [line.replace(",mm", ",ft") for line in lines], "mm or m or cm"),
}


@pytest.mark.parametrize("case", DAMAGED)
def test_a_damaged_export_is_refused(case: str, run: armrs.Simulation, tmp_path: Path) -> None:
    change, words = DAMAGED[case]
    lines = change(vicon(run, tmp_path).read_text().splitlines())
    with pytest.raises(BadInput, match=words):
        armrs.import_recordings([written(tmp_path / "bad_1.csv", lines)], tmp_path / "session", model=KNOWN, points=("SHO", "ELB", "HAND"))
