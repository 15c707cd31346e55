"""Marker trajectories into a planar arm, and OpenSim's files in and out."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import armrs
from armrs import BadInput
from armrs.cli import main
from armrs.io.markers import Markers
from armrs.io.opensim import Motion, read_motion, write_motion

C3D = "pyomeca_markers_analogs.c3d"
ARM = ["CLAV_AC", "EPICl+EPICm", "STYLr+STYLu"]


def rotation(seed: int) -> np.ndarray:
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


def planar_arm(n: int = 200) -> tuple[np.ndarray, np.ndarray]:
    """Angles of a two-link arm and its points in a plane through y and z, x along the normal."""
    t = np.linspace(0.0, 4.0, n)
    q = np.column_stack([-1.2 + 0.5 * np.sin(t), 1.0 + 0.6 * np.cos(1.7 * t)])
    angle = np.cumsum(q, axis=1)
    points = np.zeros((n, 3, 3))
    for j, length in enumerate((0.33, 0.26)):
        points[:, j + 1] = points[:, j]
        points[:, j + 1, 1] += length * np.cos(angle[:, j])
        points[:, j + 1, 2] += length * np.sin(angle[:, j])
    return q, points


def trc(path: Path, positions: np.ndarray, *, unit: str = "mm", names: tuple[str, ...] = ("S", "E", "H"), rate: float = 100.0) -> Path:
    scale = {"mm": 1e3, "m": 1.0}[unit]
    head = [
        f"PathFileType\t4\t(X/Y/Z)\t{path.name}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
        f"{rate}\t{rate}\t{len(positions)}\t{len(names)}\t{unit}\t{rate}\t1\t{len(positions)}",
        "Frame#\tTime\t" + "\t\t\t".join(names),
        "\t\t" + "\t".join(f"{axis}{k + 1}" for k in range(len(names)) for axis in "XYZ"),
    ]
    rows = [
        "\t".join([str(k), repr(k / rate), *("" if np.isnan(v) else repr(float(v)) for v in scale * row.ravel())])
        for k, row in enumerate(positions, 1)
    ]
    path.write_text("\n".join([*head, *rows, ""]), encoding="utf-8")
    return path


def test_angles_and_lengths_come_back_from_any_frame() -> None:
    q, points = planar_arm()
    for seed in range(5):
        turn = rotation(seed)
        frame = Markers(["S", "E", "H"], np.arange(len(q)) / 50.0, points @ turn.T + [0.4, -2.0, 1.0], up="z")
        # Up and forward are known only where the frame is; turn the plane about them by hand.
        own = Markers(frame.names, frame.t, frame.positions @ turn, up="z")
        motion = armrs.planar_motion(own, ["S", "E", "H"])
        np.testing.assert_allclose(motion.q, q, atol=1e-9)
        np.testing.assert_allclose(motion.lengths, [0.33, 0.26], atol=1e-12)
        np.testing.assert_allclose(armrs.planar_motion(frame, ["S", "E", "H"]).lengths, [0.33, 0.26], atol=1e-12)
        assert motion.out_of_plane < 1e-9 and motion.is_planar


def test_millimetres_metres_and_gaps(tmp_path: Path) -> None:
    q, points = planar_arm()
    upright = points[:, :, [1, 2, 0]]  # TRC: y is up, x forward
    upright[40:60, 2] = np.nan
    by_unit = [armrs.planar_motion(armrs.read_markers(trc(tmp_path / f"{u}.trc", upright, unit=u)), ["S", "E", "H"]) for u in ("mm", "m")]
    for motion in by_unit:
        np.testing.assert_allclose(motion.lengths, [0.33, 0.26], atol=1e-9)
        assert np.isnan(motion.q[40:60, 1]).all() and motion.missing == 0.1
        np.testing.assert_allclose(np.delete(motion.q, slice(40, 60), axis=0), np.delete(q, slice(40, 60), axis=0), atol=1e-9)


def test_a_movement_out_of_the_plane_is_said(tmp_path: Path) -> None:
    _, points = planar_arm()
    points[:, 2, 0] += 0.15 * np.sin(np.arange(len(points)) / 9.0)
    motion = armrs.planar_motion(Markers(["S", "E", "H"], np.arange(len(points)) / 50.0, points, up="z"), ["S", "E", "H"])
    assert not motion.is_planar
    assert "not a planar movement" in motion.warnings()[0]


def test_a_human_arm_in_c3d(data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("ezc3d")
    source = data / "raw" / "arm_files" / C3D
    options = ["--points", ",".join(ARM), "--to", "csv", "-o", str(tmp_path / "out"), "--json", str(tmp_path / "arm.json")]
    assert main(["convert", str(source), *options]) == 0
    plain = json.loads((tmp_path / "arm.json").read_text())
    assert plain["lengths_m"] == pytest.approx([0.330, 0.261], abs=0.001)
    assert plain["length_stds_m"] == pytest.approx([0.013, 0.007], abs=0.001)
    assert np.round(plain["flexion_deg"]).tolist() == [[19.0, 137.0]]
    captured = capsys.readouterr()
    assert "not planar" in captured.out and "warning: not a planar movement" in captured.err
    header = (tmp_path / "out" / C3D).with_suffix(".csv").read_text().splitlines()[0]
    assert header == "t_s,q1_rad,q2_rad"


@pytest.mark.parametrize(("stated", "said"), [("+Z", 0), ("-Z", 1), ("+Y", 1)])
def test_a_c3d_that_says_another_axis_points_up_is_told(stated: str, said: int, tmp_path: Path) -> None:
    ezc3d = pytest.importorskip("ezc3d")
    content = ezc3d.c3d()
    content["parameters"]["POINT"]["RATE"]["value"] = [100.0]
    content["parameters"]["POINT"]["LABELS"]["value"] = ["S", "E", "H"]
    content["parameters"]["POINT"]["UNITS"]["value"] = ["m"]
    content.add_parameter("POINT", "Y_SCREEN", [stated])
    content["data"]["points"] = np.concatenate([planar_arm(30)[1].transpose(2, 1, 0), np.ones((1, 3, 30))])
    content.write(str(tmp_path / "arm.c3d"))
    found = [line for line in armrs.read_markers(tmp_path / "arm.c3d").warnings if f"Y_SCREEN of the file is {stated}" in line]
    assert len(found) == said


def test_a_shoulder_in_trc(data: Path) -> None:
    markers = armrs.read_markers(data / "raw" / "arm_files" / "opensim_abdbonepin.trc")
    motion = armrs.planar_motion(markers, ["gu", "centelbow"])
    assert motion.lengths[0] == pytest.approx(0.2556, abs=1e-3)
    assert motion.length_stds[0] < 1e-5
    assert motion.is_planar
    assert markers.warnings == ("the header announces 3514 frames, 1991 are there",)


def test_motions_of_opensim_come_back_to_the_bit(data: Path, tmp_path: Path) -> None:
    for source in sorted((data / "raw" / "arm_files").glob("*.[ms][ot][to]")):
        first = read_motion(source)
        text = armrs.convert_motion(source, tmp_path / "csv", to="csv")
        again = read_motion(armrs.convert_motion(text, tmp_path / "sto", to="sto"))
        assert again.names == first.names
        assert again.values.tobytes() == first.values.tobytes() and again.t.tobytes() == first.t.tobytes()


def test_coordinates_become_joint_angles(data: Path, tmp_path: Path) -> None:
    source = data / "raw" / "arm_files" / "opensim_arm26_InverseKinematics.mot"
    out = ["--to", "csv", "-o", str(tmp_path)]
    assert main(["convert", str(source), "--coordinates", "r_shoulder_elev,r_elbow_flex", *out]) == 0
    lines = (tmp_path / source.name).with_suffix(".csv").read_text().splitlines()
    assert lines[0] == "t_s,q1_deg,q2_deg" and len(lines) == 122


def test_missing_samples_survive_a_motion_file(tmp_path: Path) -> None:
    values = np.array([[0.1, np.nan], [1 / 3, 2.0]])
    write_motion(tmp_path / "a.sto", Motion(["q1_rad", "x"], np.array([0.0, 0.02]), values, False))
    back = read_motion(tmp_path / "a.sto")
    np.testing.assert_array_equal(back.values, values)
    assert back.in_degrees is False


@pytest.fixture
def good(tmp_path: Path) -> Path:
    return trc(tmp_path / "good.trc", planar_arm(30)[1][:, :, [1, 2, 0]])


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("PathFileType", "Something", r"line 1: found no PathFileType"),
        ("\tmm\t", "\tinch\t", r"line 3, Units: found 'inch', allowed mm or m or cm"),
        ("\tmm\t", "\t\t", r"line 3, Units: found nothing, allowed mm or m or cm"),
        ("\n7\t0.07\t", "\n7\t0.05\t", r"line 12, time: found 0.05 s after 0.06 s"),
        ("\n7\t0.07\t0.0\t", "\n7\t0.07\tO.O\t", r"line 12, column S.X: found 'O.O', allowed a number"),
        ("\n7\t0.07\t0.0\t", "\n7\t0.07\tinf\t", r"line 12, column S.X: found 'inf', allowed a finite number"),
        ("\n7\t0.07\t0.0\t", "\n7\t0.07\t", r"line 12: found 10 cells, allowed 11 cells"),
    ],
)
def test_refuses_a_broken_trc(good: Path, old: str, new: str, message: str) -> None:
    text = good.read_text()
    assert text.count(old) == 1
    good.write_text(text.replace(old, new))
    with pytest.raises(BadInput, match=message):
        armrs.read_markers(good)


def test_a_marker_at_zero_in_some_samples_was_not_seen_there(tmp_path: Path) -> None:
    """It was taken for a place: status 0, and angles of 180 degrees."""
    _, positions, *_ = planar_arm(30)
    seen = armrs.planar_motion(armrs.read_markers(trc(tmp_path / "seen.trc", positions)), ["S", "E", "H"], up="z")
    lost = positions.copy()
    lost[7:9, 2] = 0.0
    found = armrs.planar_motion(armrs.read_markers(trc(tmp_path / "lost.trc", lost)), ["S", "E", "H"], up="z")
    assert np.flatnonzero(np.isnan(found.q[:, 1])).tolist() == [7, 8]
    assert found.lengths == pytest.approx(seen.lengths, abs=1e-9)
    assert any("markers are missing in 6.7 %" in line for line in found.warnings())
    # A first joint may be the origin of the file, with gaps.
    at_origin = positions - positions[:, :1]
    at_origin[3, 0] = np.nan
    found = armrs.planar_motion(armrs.read_markers(trc(tmp_path / "origin.trc", at_origin)), ["S", "E", "H"], up="z")
    assert np.flatnonzero(np.isnan(found.q[:, 0])).tolist() == [3]
    lost[:, 2] = 0.0
    lost[5, 2] = np.nan
    with pytest.raises(BadInput, match="points: found H at 0 0 0 in all samples"):
        armrs.planar_motion(armrs.read_markers(trc(tmp_path / "lost.trc", lost)), ["S", "E", "H"], up="z")


@pytest.mark.parametrize("factor", [1e3, 1e-3])
def test_lengths_that_no_arm_has_are_refused(factor: float, tmp_path: Path) -> None:
    """Millimetres that were called metres, or metres that were called millimetres."""
    path = trc(tmp_path / "unit.trc", factor * planar_arm(30)[1])
    with pytest.raises(BadInput, match=r"m from S to E, allowed 0.005 to 10 m \(is the unit of the file right\?\)"):
        armrs.planar_motion(armrs.read_markers(path), ["S", "E", "H"], up="z")


def test_a_name_that_a_file_has_twice_and_a_wrong_count_of_markers_are_told(tmp_path: Path) -> None:
    path = trc(tmp_path / "twice.trc", planar_arm(30)[1], names=("S", "E", "E"))
    with pytest.raises(BadInput, match="points: found 'E', allowed a name that the file has once, not 2 times"):
        armrs.planar_motion(armrs.read_markers(path), ["S", "E"])
    path.write_text(path.read_text().replace("\t30\t3\tmm", "\t30\t5\tmm"))
    assert "the header announces 5 markers, 3 are there" in armrs.read_markers(path).warnings


@pytest.mark.parametrize(
    ("points", "options", "message"),
    [
        ("S,E,Hand", [], "--points: found unknown marker 'Hand', allowed E, H, S"),
        ("S", [], "--points: found 1 points, allowed two or more"),
        ("S,S,H", [], "--points: found two neighbours at one place"),
        ("S,E,H", ["--up", "w"], "--up: found 'w', allowed x, y, z, -x, -y or -z"),
        ("S,E,H", ["--up", "z"], "--up: found a plane that lies flat"),
    ],
)
def test_refuses_points_and_axes(
    good: Path, tmp_path: Path, points: str, options: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["convert", str(good), "--points", points, *options, "-o", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert message in error and error.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_from_python_a_refusal_names_the_argument(good: Path, tmp_path: Path) -> None:
    markers = armrs.read_markers(good)
    with pytest.raises(BadInput, match=r"^points: found 1 points"):
        armrs.planar_motion(markers, ["S"])
    with pytest.raises(BadInput, match=r"^up: found 'w'"):
        armrs.planar_motion(markers, ["S", "E", "H"], up="w")
    (tmp_path / "m.mot").write_text("a\ninDegrees=yes\nendheader\ntime\tq\n0.0\t1.0\n0.1\t2.0\n")
    with pytest.raises(BadInput, match=r"m\.mot: coordinates: found unknown coordinate 'p'"):
        armrs.convert_motion(tmp_path / "m.mot", tmp_path / "out", to="csv", coordinates=["p"])


@pytest.mark.parametrize("stated", ["0", "-100", "nan", "inf", "fast", "50", "100000"])
def test_refuses_a_rate_that_the_time_stamps_do_not_have(tmp_path: Path, stated: str) -> None:
    _, points = planar_arm()
    path = trc(tmp_path / "m.trc", points, rate=100.0)
    path.write_text(path.read_text().replace("\n100.0\t", f"\n{stated}\t"))
    with pytest.raises(BadInput, match=f"m.trc: line 3, DataRate: found '?{stated}"):
        armrs.read_markers(path)


def test_rounded_time_stamps_and_lost_frames_have_the_rate_stated(tmp_path: Path) -> None:
    _, points = planar_arm()
    path = trc(tmp_path / "m.trc", points, rate=60.0)
    lines = path.read_text().splitlines()
    rounded = [line.split("\t") for line in lines[5:]]
    path.write_text("\n".join([*lines[:5], *("\t".join([r[0], f"{float(r[1]):.3f}", *r[2:]]) for r in rounded), ""]))
    assert len(armrs.read_markers(path).t) == len(points)
    path.write_text("\n".join([*lines[:20], *lines[60:], ""]))
    assert any("frames" in note for note in armrs.read_markers(path).warnings)


@pytest.mark.parametrize("keep", [0, 1, 100, 512, 4000, 60_000, 2_000_000])
def test_refuses_a_c3d_that_is_cut_off(data: Path, tmp_path: Path, keep: int, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("ezc3d")
    broken = tmp_path / "cut.c3d"
    broken.write_bytes((data / "raw" / "arm_files" / C3D).read_bytes()[:keep])
    assert main(["convert", str(broken), "--points", ",".join(ARM), "-o", str(tmp_path / "out")]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_refuses_broken_motions(tmp_path: Path) -> None:
    good = "a\nversion=1\nnRows=2\nnColumns=2\ninDegrees=yes\nendheader\ntime\tq\n0.0\t1.0\n0.1\t2.0\n"
    cases = [
        ("endheader\n", "", "header: found no line endheader"),
        ("time\tq", "q\ttime", "line 7: found columns q, time, allowed time first"),
        ("0.1\t2.0\n", "", r"found 1 rows, allowed 2 rows, as its header says \(the file is cut off\)"),
        ("inDegrees=yes", "inDegrees=maybe", "header, inDegrees: found 'maybe', allowed yes or no"),
        ("2.0", "two", "line 9, column q: found 'two', allowed a number"),
        ("0.1\t", "0.0\t", "line 9, time: found 0 s twice"),
        ("nColumns=2", "nColumns=3", "file: found 2 columns, allowed 3 columns, as its header says"),
        ("nRows=2", "nRows=3", "file: found 2 rows, allowed 3 rows, as its header says"),
        ("version=1", "inDegrees=no", "header, indegrees: found no and yes, allowed one of them"),
        ("nRows=2", "nRows=1", r"file: found 2 rows, allowed 1 rows, as its header says$"),
        ("version=1", "datacolumns 12", "file: found 2 columns, allowed 12 columns, as its header says"),
    ]
    for old, new, message in cases:
        assert good.count(old) == 1
        (tmp_path / "m.mot").write_text(good.replace(old, new))
        with pytest.raises(BadInput, match=message):
            armrs.convert_motion(tmp_path / "m.mot", tmp_path / "out", to="csv")
    (tmp_path / "m.mot").write_text(good.replace("inDegrees=yes\n", ""))
    with pytest.raises(BadInput, match="found no inDegrees"):
        armrs.convert_motion(tmp_path / "m.mot", tmp_path / "out", to="csv", coordinates=["q"])
    (tmp_path / "m.mot").write_text(good.replace("=yes", "=no").replace("2.0", "60.0"))
    with pytest.raises(BadInput, match=r"header: found inDegrees=no and an angle of 60, allowed .* \(looks like degrees\)"):
        armrs.convert_motion(tmp_path / "m.mot", tmp_path / "out", to="csv", coordinates=["q"])
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", ["segfault.c3d", "endless.c3d"])
def test_a_damaged_c3d_neither_crashes_nor_hangs(data: Path, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("ezc3d")
    from armrs.io import reader_process

    monkeypatch.setattr(reader_process, "LONGEST", 5.0)
    with pytest.raises(armrs.BadInput, match="a whole C3D file"):
        armrs.read_markers(data / "hostile" / name)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows limits no processor time")
def test_a_reader_that_waits_for_its_turn_is_not_taken_for_one_that_hangs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from armrs.io import reader_process

    (tmp_path / "late_reader.py").write_text(
        "import time\nfrom armrs.io import reader_process\n\ntime.sleep(3)\nreader_process.serve(lambda path: {'size': path.stat().st_size})\n"
    )
    (tmp_path / "data.bin").write_bytes(b"abc")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")]))
    monkeypatch.setattr(reader_process, "LONGEST", 2.0)
    with reader_process.content("late_reader", tmp_path / "data.bin", "anything") as arrays:
        assert arrays["size"] == 3


@pytest.mark.skipif(sys.platform == "win32", reason="Windows limits no processor time")
def test_a_file_is_read_under_the_lower_limits_of_a_batch_system(tmp_path: Path) -> None:
    """Raising a limit that the system had set ended in a traceback."""
    (tmp_path / "small_reader.py").write_text(
        "import resource\nfrom armrs.io import reader_process\n\nreader_process.serve(lambda path: {'most': resource.getrlimit(resource.RLIMIT_CPU)})\n"
    )
    read = (
        "import resource\nfrom pathlib import Path\nfrom armrs.io import reader_process\n\n"
        "resource.setrlimit(resource.RLIMIT_CPU, (40, 40))\n"
        "with reader_process.content('small_reader', Path('small_reader.py'), 'anything') as arrays:\n    print(*arrays['most'])\n"
    )
    path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        [sys.executable, "-c", read], capture_output=True, text=True, cwd=tmp_path, env={**os.environ, "PYTHONPATH": path}, timeout=60
    )
    assert done.stdout.split() == ["40", "40"], done.stderr


def test_a_first_point_that_moves_is_said_and_its_path_comes_back() -> None:
    t = np.arange(200) / 100.0
    base = np.column_stack([np.zeros(200), 0.02 * np.sin(3.0 * t), 0.5 + 0.01 * t])
    angles = np.column_stack([-0.5 + 0.3 * np.sin(2.0 * t), 1.0 + 0.4 * np.cos(2.0 * t)])
    absolute = np.cumsum(angles, axis=1)
    points = [base]
    for length, angle in zip((0.3, 0.25), absolute.T, strict=True):
        points.append(points[-1] + length * np.column_stack([np.zeros(200), np.cos(angle), np.sin(angle)]))
    names = ("shoulder", "elbow", "hand")
    for moved in (base, np.tile(base[0], (200, 1))):
        markers = armrs.Markers(list(names), t, np.stack([p - base + moved for p in points], axis=1), up="z")
        motion = armrs.planar_motion(markers, names, forward="y")
        assert np.allclose(motion.base, moved[:, 1:], atol=1e-12)
        assert any("so the trunk, moves by" in line for line in motion.warnings()) == (moved is base)
