"""Data sets: what is accepted, what is refused and in which words, time grids, missing samples, signs and units."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet

import armrs
from armrs import BadInput
from conftest import DATASET, HEADER, Session, csv_lines, rows


def refusal(session: Session, file: str) -> str:
    """Load, expect one line about a file of the session, and return what follows the name of the file."""
    before = session.files()
    with pytest.raises(BadInput) as caught:
        armrs.load_dataset(session.folder)
    text = str(caught.value)
    assert "\n" not in text
    start = f"{session.folder / file}: "
    assert text.startswith(start)
    assert session.files() == before
    return text.removeprefix(start)


# ---- what is read


def test_reads_a_session(session: Session) -> None:
    data = armrs.load_dataset(session.folder)
    assert (data.name, data.force_on, data.sample_rate) == ("S1", "robot", 50.0)
    assert (data.subject.body_mass, data.subject.height, data.subject.sex) == (77.0, 1.8, "male")
    assert data.tolerance == armrs.Tolerance(force_bias_N=0.4)
    assert data.tolerance.angle_offset == pytest.approx(np.radians(0.3))
    assert data.model == armrs.load_model(session.folder / "model.toml")
    assert [t.file for t in data.fit_trials] == ["trials/slow_1.csv"]
    assert [t.file for t in data.test_trials] == ["trials/slow_2.csv"]
    assert data.warnings == ()
    assert armrs.load_dataset(session.folder / "dataset.toml").name == "S1"


def test_arrays_have_time_first_and_forces_act_on_the_arm(session: Session) -> None:
    trial = armrs.load_dataset(session.folder).trials[0]
    values = dict(zip(HEADER, rows(seed=0).T, strict=True))
    np.testing.assert_array_equal(trial.t, values["t_s"])
    np.testing.assert_array_equal(trial.q, np.column_stack([values["q1_rad"], values["q2_rad"]]))
    np.testing.assert_array_equal(trial.force_on_arm, -np.column_stack([values["Fy_N"], values["Fz_N"]]))
    np.testing.assert_array_equal(trial.moment_on_arm, -values["Mx_Nm"])
    np.testing.assert_array_equal(trial.robot_q, np.column_stack([values["qr1_rad"], values["qr2_rad"]]))
    np.testing.assert_array_equal(trial.emg["emg_biceps"], values["emg_biceps"])
    assert (trial.tau, trial.dq) == (None, None)
    assert (len(trial), trial.rate, trial.resampled) == (100, pytest.approx(50.0), False)
    assert trial.pieces() == [slice(0, 100)]
    assert not trial.filled.any()


def test_forces_on_the_arm_keep_their_sign(session: Session) -> None:
    on_robot = armrs.load_dataset(session.folder).trials[0].force_on_arm
    session.edit("dataset.toml", '"robot"', '"arm"')
    np.testing.assert_array_equal(armrs.load_dataset(session.folder).trials[0].force_on_arm, -on_robot)


def test_arrays_are_read_only(session: Session) -> None:
    trial = armrs.load_dataset(session.folder).trials[0]
    with pytest.raises(ValueError, match="read-only"):
        trial.q[0, 0] = 1.0


@pytest.mark.parametrize(
    ("column", "unit", "factor"),
    [
        ("q1_rad", "q1_deg", np.pi / 180),
        ("q1_rad", "q1_mrad", 1e-3),
        ("Fy_N", "Fy_kN", 1e3),
        ("Fy_N", "Fy_mN", 1e-3),
        ("Mx_Nm", "Mx_Nmm", 1e-3),
        ("Mx_Nm", "Mx_mNm", 1e-3),
        ("qr2_rad", "qr2_deg", np.pi / 180),
    ],
)
def test_units_are_those_of_the_column_name(session: Session, column: str, unit: str, factor: float) -> None:
    before = armrs.load_dataset(session.folder).trials[0].original[column]
    session.edit_lines(lambda lines: [lines[0].replace(column, unit), *lines[1:]])
    after = armrs.load_dataset(session.folder).trials[0].original[column]
    np.testing.assert_allclose(after, before * factor, rtol=1e-15)


def test_milliseconds(session: Session) -> None:
    values = rows()
    values[:, 0] *= 1e3
    header = ["t_ms", *HEADER[1:]]
    session.trial.write_text("\n".join(csv_lines(values, header)) + "\n", encoding="utf-8")
    assert armrs.load_dataset(session.folder).trials[0].rate == pytest.approx(50.0)


def test_torques_need_no_force_on(session: Session) -> None:
    session.edit("dataset.toml", 'force_on = "robot"\n', "")
    header = ["t_s", "q1_rad", "q2_rad", "tau1_Nm", "tau2_Nm", "dq1_rad_s", "dq2_rad_s"]
    for name in ("slow_1.csv", "slow_2.csv"):
        (session.folder / "trials" / name).write_text("\n".join(csv_lines(rows()[:, :7], header)), encoding="utf-8")
    data = armrs.load_dataset(session.folder)
    assert data.force_on is None
    assert data.trials[0].force_on_arm is None
    assert data.trials[0].tau.shape == data.trials[0].dq.shape == (100, 2)


def test_byte_order_mark_blank_lines_spaces_and_windows_line_ends_are_no_matter(session: Session) -> None:
    before = armrs.load_dataset(session.folder).trials[0].q
    lines = session.trial.read_text(encoding="utf-8").splitlines()
    lines[0] = lines[0].replace(",", ", ")
    session.trial.write_bytes(b"\xef\xbb\xbf" + "\r\n".join([*lines[:50], "", *lines[50:], "", ""]).encode())
    np.testing.assert_array_equal(armrs.load_dataset(session.folder).trials[0].q, before)


def test_parquet_reads_like_csv(session: Session) -> None:
    plain = armrs.load_dataset(session.folder).trials[0]
    table = pa.table(dict(zip(HEADER, rows(seed=0).T, strict=True)))
    parquet.write_table(table, session.folder / "trials/slow_1.parquet")
    session.edit("dataset.toml", "slow_1.csv", "slow_1.parquet")
    trial = armrs.load_dataset(session.folder).trials[0]
    assert trial.q.tobytes() == plain.q.tobytes()
    assert trial.force_on_arm.tobytes() == plain.force_on_arm.tobytes()


# ---- refused: dataset.toml

BROKEN_DESCRIPTION = {
    "unknown key": ("force_on", "forces_on", "found unknown key 'forces_on'", "(nearest known: force_on)"),
    "unknown key of a trial": ("repeat = 1", "repetition = 1", "[[trial]] 1: found unknown key 'repetition'", "(nearest known: repeat)"),
    "unknown key of the subject": ("height", "hight", "[subject]: found unknown key 'hight'", "(nearest known: height)"),
    "unknown key of the tolerance": ("force_bias_N", "force_bias", "[tolerance]: found unknown key 'force_bias'", "force_bias_N)"),
    "model not named": (
        'model = "model.toml"\n',
        "",
        "model: found nothing, allowed the file of the model, or a [subject] with body_mass, height, sex and lengths_m (lengths_m is missing in [subject])",
        "",
    ),
    "force on whom": ('"robot"', '"handle"', 'force_on: found \'handle\', allowed "robot" or "arm"', ""),
    "role": ('"test"', '"train"', '[[trial]] 2, role: found \'train\', allowed "fit" or "test"', ""),
    "no fit trial": ('role = "fit"', 'role = "test"', '[[trial]]: found no trial with role = "fit", allowed at least one', ""),
    "same repeat": (
        "repeat = 2",
        "repeat = 1",
        '[[trial]] 2, repeat: found repeat 1 of "slow", allowed each repeat once',
        "[[trial]] 1 has",
    ),
    "same file": ("slow_2.csv", "./slow_1.csv", "[[trial]] 2, file: found 'trials/./slow_1.csv', allowed each file once", ""),
    "repeat zero": ("repeat = 2", "repeat = 0", "[[trial]] 2, repeat: found 0, allowed a whole number >= 1", ""),
    "height in centimetres": ("1.80", "180", "[subject], height: found 180.0, allowed", "(centimetres?)"),
    "sex": ('"male"', '"m"', '[subject], sex: found \'m\', allowed "male" or "female"', ""),
    "tolerance negative": ("= 0.4", "= -0.4", "[tolerance], force_bias_N: found -0.4, allowed a finite number 0 to 10000", ""),
    "rate zero": ("= 50.0", "= 0", "sample_rate: found 0.0, allowed a finite number > 0", "Hz"),
    "empty file name": ('"trials/slow_1.csv"', '""', "[[trial]] 1, file: found '', allowed a text", ""),
    "not TOML": ("[subject]", "[subject", "line 6, column 9: found", "allowed TOML"),
}


@pytest.mark.parametrize("name", BROKEN_DESCRIPTION)
def test_refuses_the_description(session: Session, name: str) -> None:
    old, new, start, end = BROKEN_DESCRIPTION[name]
    session.edit("dataset.toml", old, new)
    text = refusal(session, "dataset.toml")
    assert start in text
    assert end in text


def test_refuses_no_trials(session: Session) -> None:
    (session.folder / "dataset.toml").write_text(DATASET.partition("[[trial]]")[0], encoding="utf-8")
    assert refusal(session, "dataset.toml") == "`trial` is missing"


def test_refuses_a_folder_without_description(tmp_path: Path) -> None:
    with pytest.raises(
        BadInput, match=r"file: found a folder that holds no data set, allowed the folder of a data set, with dataset.toml$"
    ):
        armrs.load_dataset(tmp_path)


def test_refuses_a_missing_model(session: Session) -> None:
    (session.folder / "model.toml").unlink()
    assert refusal(session, "model.toml") == "no such file"


def test_a_fault_in_the_model_is_named_there(session: Session) -> None:
    session.edit("model.toml", "mass = 2.114", "mass = -1")
    assert refusal(session, "model.toml").startswith("[[arm.segment]] 1, mass: found -1.0")


# ---- refused: trials


def lines_changed(change: Callable[[list[str]], list[str]]) -> Callable[[Session], None]:
    return lambda session: session.edit_lines(change)


def header(old: str, new: str) -> Callable[[Session], None]:
    return lines_changed(lambda lines: [lines[0].replace(old, new), *lines[1:]])


def cell(line: int, column: str, text: str) -> Callable[[Session], None]:
    return lambda session: session.set_cell(line, column, text)


def every_cell(column: str, text: str) -> Callable[[Session], None]:
    def change(lines: list[str]) -> list[str]:
        k = lines[0].split(",").index(column)
        return [lines[0], *(",".join([*c[:k], text, *c[k + 1 :]]) for c in (line.split(",") for line in lines[1:]))]

    return lines_changed(change)


def raw(content: bytes) -> Callable[[Session], None]:
    return lambda session: session.trial.write_bytes(content) and None


NUMBER = "allowed a finite number, or an empty cell where the sample is missing"
BROKEN_TRIAL: dict[str, tuple[Callable[[Session], None], str, str]] = {
    "no file": (lambda s: s.trial.unlink(), "no such file", ""),
    "empty file": (raw(b""), "line 1: found nothing, allowed a header", ""),
    "blank file": (raw(b"\n\n"), "line 1: found nothing, allowed a header", ""),
    "header only": (lines_changed(lambda lines: lines[:1]), "found no samples below the header, allowed at least 16 samples", ""),
    "too short": (lines_changed(lambda lines: lines[:16]), "file: found 15 samples, allowed at least 16 samples", ""),
    "binary": (raw(bytes(range(256))), "line 1: found binary data, allowed CSV text", ""),
    "null bytes": (raw(b"t_s\x00,q1_rad\n1,2\n"), "line 1: found binary data, allowed CSV text", ""),
    "not UTF-8": (raw("t_s,q1_rad,µ\n".encode("latin-1")), "line 1: found byte 0xb5, allowed UTF-8 text", ""),
    "not UTF-8 below": (lambda s: s.trial.write_bytes(s.trial.read_bytes() + b"\xb5\n") and None, "line 102: found byte 0xb5", ""),
    "semicolons": (lines_changed(lambda lines: [x.replace(",", ";") for x in lines]), "line 1: found semicolons, allowed commas", ""),
    "tabs": (lines_changed(lambda lines: [x.replace(",", "\t") for x in lines]), "line 1: found tabs, allowed commas", ""),
    "truncated last row": (lines_changed(lambda lines: [*lines[:-1], lines[-1][:20]]), "line 101: found", "cells, allowed 9 cells, one a column"),
    "cell too many": (lines_changed(lambda lines: [*lines[:9], lines[9] + ",1", *lines[10:]]), "line 10: found 10 cells, allowed 9", ""),
    "decimal comma": (cell(5, "q1_rad", "0,5"), "line 5: found 10 cells, allowed 9 cells", ""),
    "text": (cell(7, "q2_rad", "abc"), "line 7, column q2_rad: found 'abc', " + NUMBER, ""),
    "nan": (cell(7, "q2_rad", "nan"), "line 7, column q2_rad: found 'nan', " + NUMBER, ""),
    "NaN": (cell(7, "Fy_N", "NaN"), "line 7, column Fy_N: found 'NaN', " + NUMBER, ""),
    "NA": (cell(7, "Fy_N", "NA"), "line 7, column Fy_N: found 'NA', " + NUMBER, ""),
    "inf": (cell(101, "Fz_N", "-inf"), "line 101, column Fz_N: found -inf, " + NUMBER, ""),
    "beyond floats": (cell(9, "Fz_N", "1e999"), "line 9, column Fz_N: found", NUMBER),
    "time missing": (cell(8, "t_s", ""), "line 8, time: found an empty cell, allowed a time stamp in every row", ""),
    "time repeated": (cell(8, "t_s", "0.1"), "line 8, time: found 0.1 s twice, allowed time stamps that increase strictly", ""),
    "time backwards": (cell(8, "t_s", "0.05"), "line 8, time: found 0.05 s after 0.1 s, allowed time stamps that increase strictly", ""),
    "clock set during the recording": (cell(101, "t_s", "1e6"), "line 101, time: found 1000000 s after 1.96 s, allowed a recording of which", ""),
    "activity beyond reason": (cell(30, "emg_biceps", "1e300"), "line 30, column emg_biceps: found 1e+300, allowed -1e+12 to 1e+12", ""),
    "time in ms": (lines_changed(lambda lines: [lines[0], *(str(20 * k) + x[x.index(",") :] for k, x in enumerate(lines[1:]))]),
                   "time: found 20 s between samples, allowed less than 0.5 s", "(milliseconds?)"),
    "degrees": (cell(30, "q1_rad", "145.0"), "line 30, column q1_rad: found 145.0, allowed -25.1327 to 25.1327 rad", "(looks like degrees)"),
    "robot in degrees": (cell(30, "qr1_rad", "-145.0"), "line 30, column qr1_rad: found -145.0", "(looks like degrees)"),
    "millinewtons": (cell(30, "Fy_N", "25000"), "line 30, column Fy_N: found 25000.0, allowed -10000 to 10000 N", "(looks like millinewtons)"),
    "newton millimetres": (cell(30, "Mx_Nm", "25000"), "line 30, column Mx_Nm: found 25000.0", "(looks like newton millimetres)"),
    "all missing": (every_cell("Fz_N", ""), "column Fz_N: found no sample at all, allowed samples, or no such column", ""),
    "unknown column": (header("qr1_rad", "robot1_rad"), "header: found unknown column 'robot1_rad'", "(nearest known: "),
    "wrong case": (header("Fy_N", "FY_N"), "header: found unknown column 'FY_N'", "(nearest known: Fy_N)"),
    "unknown unit": (header("Fy_N", "Fy_lbf"), "header: found 'Fy_lbf', allowed a known unit: Fy_N, Fy_mN, Fy_kN", ""),
    "no unit": (header("Fy_N", "Fy"), "header: found 'Fy', allowed a known unit: Fy_N", ""),
    "same column": (header("q2_rad", "q1_rad"), "line 1: found column q1_rad twice, allowed each column once", ""),
    "two units": (header("q2_rad", "q1_deg"), "header: found q1_rad and q1_deg, allowed q1 once", ""),
    "unnamed column": (header("q2_rad", ""), "line 1, column 3: found no name, allowed a name for each column", ""),
    "joint missing": (header("q2_rad", "emg_x"), "header: found no column for q2, allowed an angle for each of the 2 joints of the model", ""),
    "joint too many": (header("emg_biceps", "q3_rad"), "header: found 'q3_rad', allowed q1 to q2: the model has 2 joints", ""),
    "robot joint": (header("qr2_rad", "qr3_rad"), "header: found 'qr3_rad', allowed qr1 to qr2: the robot has 2 joints", ""),
    "half a robot": (header("qr2_rad", "emg_x"), "header: found no column for qr2, allowed both angles of the robot or none", ""),
    "half a force": (header("Fz_N", "emg_x"), "header: found no column for Fz, allowed both Fy and Fz", ""),
    "one speed": (header("emg_biceps", "dq1_rad_s"), "header: found no column for dq2, allowed a speed for every joint or for none", ""),
    "one torque": (header("emg_biceps", "tau2_Nm"), "header: found no column for tau1, allowed a torque for every joint or for none", ""),
    "no time": (header("t_s", "emg_t"), "header: found no column for t, allowed time in a column t_s", ""),
    "nothing measured": (header("Fy_N,Fz_N,Mx_Nm", "emg_a,emg_b,emg_c"), "header: found neither forces nor torques, allowed Fy_N and Fz_N", ""),
    "force on whom": (lambda s: s.edit("dataset.toml", 'force_on = "robot"\n', ""), "column Fy: found forces in a data set without force_on", ""),
    "milliseconds by rate": (lambda s: s.edit("dataset.toml", "= 50.0", "= 50000"), "time: found 50 samples a second, allowed about sample_rate", ""),
}  # fmt: skip


@pytest.mark.parametrize("name", BROKEN_TRIAL)
def test_refuses_the_trial(session: Session, name: str) -> None:
    change, start, end = BROKEN_TRIAL[name]
    change(session)
    text = refusal(session, "trials/slow_1.csv")
    assert start in text
    assert end in text


def test_lines_are_counted_as_an_editor_does(session: Session) -> None:
    session.set_cell(8, "t_s", "0.1")
    session.edit_lines(lambda lines: [*lines[:3], "", "", *lines[3:]])
    assert refusal(session, "trials/slow_1.csv").startswith("line 10, time: found 0.1 s twice")


def test_refuses_another_format(session: Session) -> None:
    session.edit("dataset.toml", "slow_1.csv", "slow_1.xlsx")
    assert refusal(session, "trials/slow_1.xlsx") == "file: found suffix '.xlsx', allowed .csv or .parquet"


@pytest.mark.parametrize(
    ("content", "message"),
    [(b"not parquet", "found no Parquet mark at its start"), (b"PAR1 and then nothing", "allowed a whole Parquet file")],
)
def test_refuses_a_broken_parquet_file(session: Session, content: bytes, message: str) -> None:
    session.edit("dataset.toml", "slow_1.csv", "slow_1.parquet")
    (session.folder / "trials/slow_1.parquet").write_bytes(content)
    assert message in refusal(session, "trials/slow_1.parquet")


def test_refuses_text_and_infinity_in_parquet(session: Session) -> None:
    session.edit("dataset.toml", "slow_1.csv", "slow_1.parquet")
    path = session.folder / "trials/slow_1.parquet"
    table = dict(zip(HEADER, rows().T, strict=True))
    parquet.write_table(pa.table({**table, "Fy_N": [str(k) for k in range(100)]}), path)
    assert refusal(session, "trials/slow_1.parquet") == "column Fy_N: found type string, allowed numbers"
    table["Fy_N"][4] = np.inf
    parquet.write_table(pa.table(table), path)
    assert refusal(session, "trials/slow_1.parquet") == f"row 5, column Fy_N: found inf, {NUMBER}"


def test_an_unreadable_file_is_refused(session: Session) -> None:
    session.trial.chmod(0)
    if os.access(session.trial, os.R_OK):  # the superuser reads everything
        session.trial.unlink()
        session.trial.mkdir()
        assert refusal(session, "trials/slow_1.csv") == "file: found a folder, allowed a file that exists"
    else:
        assert "Permission denied" in refusal(session, "trials/slow_1.csv")


# ---- a test trial without samples does not stop the rest


def test_a_test_trial_without_samples_is_left_out_with_one_line(session: Session) -> None:
    (session.folder / "trials/slow_2.csv").write_text(",".join(HEADER) + "\n", encoding="utf-8")
    data = armrs.load_dataset(session.folder)
    assert [t.file for t in data.trials] == ["trials/slow_1.csv"]
    (line,) = data.warnings
    assert line.startswith("trials/slow_2.csv: file: found no samples below the header")
    assert line.endswith("this test trial is left out")
    assert "\n" not in line


def test_a_test_trial_without_samples_still_needs_a_sound_header(session: Session) -> None:
    (session.folder / "trials/slow_2.csv").write_text("time,angle\n", encoding="utf-8")
    assert refusal(session, "trials/slow_2.csv").startswith("header: found unknown column 'time'")


# ---- time and missing samples


def write_rows(session: Session, values: np.ndarray) -> None:
    session.trial.write_text("\n".join(csv_lines(values)) + "\n", encoding="utf-8")


def test_uneven_time_is_resampled_without_bias(session: Session) -> None:
    rng = np.random.default_rng(7)
    t = np.sort(np.arange(400) / 50.0 + rng.uniform(-0.006, 0.006, 400))
    signal = np.sin(2.0 * t)
    write_rows(session, np.column_stack([t, *[signal] * 8]))
    trial = armrs.load_dataset(session.folder).trials[0]
    assert trial.resampled
    assert trial.rate == pytest.approx(50.0)
    np.testing.assert_allclose(np.diff(trial.t), trial.dt, rtol=1e-9)
    truth = np.sin(2.0 * trial.t)
    # A straight line between samples would be up to 2e-4 too low at the crests, always on the same side; the cubic is not.
    np.testing.assert_allclose(trial.q[:, 0], truth, atol=2e-5)
    assert abs(np.mean((trial.q[:, 0] - truth) * truth)) < 1e-6
    # All channels alike: nothing is delayed against anything.
    np.testing.assert_array_equal(trial.q[:, 0], -trial.force_on_arm[:, 1])
    np.testing.assert_array_equal(trial.original_t, t)
    np.testing.assert_array_equal(trial.original["q1_rad"], signal)


def test_resampling_reproduces_parabolas(session: Session) -> None:
    t = np.sort(np.arange(200) / 50.0 + np.random.default_rng(3).uniform(-0.004, 0.004, 200))
    write_rows(session, np.column_stack([t, *[1.0 - t + 0.3 * t**2] * 8]))
    trial = armrs.load_dataset(session.folder).trials[0]
    np.testing.assert_allclose(trial.q[:, 0], 1.0 - trial.t + 0.3 * trial.t**2, atol=1e-13)


def test_a_stated_rate_that_the_stamps_do_not_show_is_reported(session: Session) -> None:
    session.edit("dataset.toml", "= 50.0", "= 100")
    data = armrs.load_dataset(session.folder)
    assert "trials/slow_1.csv and 1 more: time stamps give 50 Hz, sample_rate says 100 Hz: the time stamps are used" in data.warnings


def test_short_gaps_are_bridged_and_marked(session: Session) -> None:
    values = rows(200)
    values[:, 1] = np.sin(2.0 * values[:, 0])
    values[50:55, 1] = np.nan
    write_rows(session, values)
    trial = armrs.load_dataset(session.folder).trials[0]
    assert list(trial.filled_columns) == ["q1_rad"]
    np.testing.assert_array_equal(np.flatnonzero(trial.filled), range(50, 55))
    assert trial.valid.all()
    np.testing.assert_allclose(trial.q[50:55, 0], np.sin(2.0 * trial.t[50:55]), atol=1e-4)
    assert np.isnan(trial.original["q1_rad"][50:55]).all()
    assert np.delete(trial.q[:, 0], range(50, 55)).tobytes() == np.delete(values[:, 1], range(50, 55)).tobytes()


def test_many_bridged_samples_are_said(session: Session) -> None:
    values = rows(200)
    for k in range(3, 200, 10):
        values[k, 2] = np.nan
    write_rows(session, values)
    few = armrs.load_dataset(session.folder).warnings
    assert "trials/slow_1.csv: column q2_rad: 10% of the samples were missing and are bridged" in few[0]
    values[3:50, 2] = values[0, 2]
    write_rows(session, values)
    assert len([line for line in armrs.load_dataset(session.folder).warnings if "bridged" in line]) == 1
    values[:, 2] = np.where(np.arange(200) == 9, np.nan, 0.1)
    write_rows(session, values)
    assert armrs.load_dataset(session.folder).warnings == ()


def test_a_stated_rate_a_little_off_is_said(session: Session) -> None:
    session.edit("dataset.toml", "= 50.0", "= 48.0")
    data = armrs.load_dataset(session.folder)
    assert "time stamps give 50 Hz, sample_rate says 48 Hz: the time stamps are used" in data.warnings[0]
    assert data.trials[0].rate == pytest.approx(50.0)


def test_an_inertia_in_another_unit_is_said(session: Session) -> None:
    session.edit("model.toml", "inertia = 0.0165", "inertia = 165")
    line = armrs.load_dataset(session.folder).warnings[0]
    assert "inertia 165 kg m² of segment 'upper arm' is 753 times mass · length²" in line


def test_long_gaps_stay_open_and_are_reported(session: Session) -> None:
    values = rows(200)
    values[50:80, 3] = np.nan
    write_rows(session, values)
    data = armrs.load_dataset(session.folder)
    trial = data.trials[0]
    assert np.isnan(trial.force_on_arm[50:80, 0]).all()
    assert trial.pieces() == [slice(0, 50), slice(80, 200)]
    assert trial.gaps == (("Fy_N", 0.98, 1.6),)
    assert data.warnings == ("trials/slow_1.csv: column Fy_N: no samples from 0.98 to 1.6 s: left out",)
    values[50:80, 1:4] = np.nan
    write_rows(session, values)
    assert armrs.load_dataset(session.folder).warnings == (
        "trials/slow_1.csv: columns q1_rad, q2_rad, Fy_N: no samples from 0.98 to 1.6 s: left out",
    )


def test_samples_missing_at_the_ends_are_not_invented(session: Session) -> None:
    values = rows(200)
    values[:3, 1] = np.nan
    values[-2:, 4] = np.nan
    write_rows(session, values)
    trial = armrs.load_dataset(session.folder).trials[0]
    assert trial.pieces() == [slice(3, 198)]
    assert [gap[0] for gap in trial.gaps] == ["q1_rad", "Fz_N"]


def test_rows_that_are_not_there_are_a_gap(session: Session) -> None:
    values = np.delete(rows(200), np.r_[40:45, 100:140], axis=0)
    write_rows(session, values)
    trial = armrs.load_dataset(session.folder).trials[0]
    assert len(trial) == 200
    np.testing.assert_array_equal(np.flatnonzero(trial.filled), range(40, 45))
    assert trial.pieces() == [slice(0, 100), slice(140, 200)]


def test_a_missing_muscle_signal_does_not_cost_the_movement(session: Session) -> None:
    values = rows(200)
    values[50:150, HEADER.index("emg_biceps")] = np.nan
    write_rows(session, values)
    trial = armrs.load_dataset(session.folder).trials[0]
    assert trial.valid.all()
    assert np.isnan(trial.emg["emg_biceps"]).sum() == 100


def test_whole_turns_are_taken_out(session: Session) -> None:
    values = rows(200)
    smooth = np.linspace(2.0, 5.0, 200)
    values[:, 1] = np.round((smooth + np.pi) % (2 * np.pi) - np.pi, 12)
    write_rows(session, values)
    data = armrs.load_dataset(session.folder)
    np.testing.assert_allclose(data.trials[0].q[:, 0], smooth, atol=1e-11)
    assert data.warnings == ("trials/slow_1.csv: column q1_rad jumps by whole turns once: they were taken out",)


def test_a_warning_of_several_trials_is_one_line(session: Session) -> None:
    values = rows(200)
    values[:, 1] = np.round((np.linspace(2.0, 5.0, 200) + np.pi) % (2 * np.pi) - np.pi, 12)
    write_rows(session, values)
    (session.folder / "trials/slow_2.csv").write_text((session.folder / "trials/slow_1.csv").read_text())
    data = armrs.load_dataset(session.folder)
    assert data.warnings == ("trials/slow_1.csv and 1 more: column q1_rad jumps by whole turns once: they were taken out",)


def test_seconds_since_1970_are_welcome(session: Session) -> None:
    values = rows(200)
    values[:, 0] += 1.7e9
    write_rows(session, values)
    trial = armrs.load_dataset(session.folder).trials[0]
    assert not trial.resampled
    assert trial.rate == pytest.approx(50.0)


# ---- writing


@pytest.mark.parametrize("suffix", [None, ".csv", ".parquet"])
@pytest.mark.parametrize("force_on", ["robot", "arm"])
def test_writing_loses_nothing(session: Session, tmp_path: Path, suffix: str | None, force_on: str) -> None:
    session.edit("dataset.toml", '"robot"', f'"{force_on}"')
    values = rows(200)
    values[50:55, 1] = values[100:150, 4] = np.nan
    write_rows(session, values)
    first = armrs.load_dataset(session.folder)
    written = armrs.write_dataset(first, tmp_path / "out", suffix=suffix)
    again = armrs.load_dataset(written)
    assert (again.name, again.model, again.force_on, again.sample_rate) == (first.name, first.model, first.force_on, first.sample_rate)
    assert (again.subject, again.tolerance) == (first.subject, first.tolerance)
    for a, b in zip(first.trials, again.trials, strict=True):
        assert (a.configuration, a.repeat, a.role) == (b.configuration, b.repeat, b.role)
        for name in ("t", "q", "force_on_arm", "moment_on_arm", "robot_q", "valid"):
            assert getattr(a, name).tobytes() == getattr(b, name).tobytes(), name
        np.testing.assert_array_equal(a.filled, b.filled)


def test_does_not_write_over_its_own_input(session: Session) -> None:
    data = armrs.load_dataset(session.folder)
    before = session.files()
    with pytest.raises(BadInput, match="found an input of this command"):
        armrs.write_dataset(data, session.folder)
    assert session.files() == before


def test_trials_from_elsewhere_are_written_inside(session: Session, tmp_path: Path) -> None:
    session.trial.rename(tmp_path / "far.csv")
    session.edit("dataset.toml", "trials/slow_1.csv", "../far.csv")
    data = armrs.load_dataset(session.folder)
    armrs.write_dataset(data, tmp_path / "out" / "deep")
    assert sorted(p.name for p in (tmp_path / "out/deep/trials").iterdir()) == ["far.csv", "slow_2.csv"]
    assert (tmp_path / "far.csv").exists()


# ---- measured data

COUNTS = {
    "dfki_a0": (2, {"trials/track_1.csv": 9898, "trials/track_2.csv": 5098, "trials/release_1.csv": 1998}),
    "dfki_c1": (2, {"trials/swing_1.csv": 1997, "trials/swing_2.csv": 999}),
    "pendulum_single": (1, {"trials/swing_1.csv": 9167}),
    "pendulum_double": (2, {"trials/swing_1.csv": 14000, "trials/swing_2.csv": 3336}),
    "pendulum_triple": (3, {"trials/swing_1.csv": 7000, "trials/swing_2.csv": 1465}),
}


@pytest.mark.parametrize("name", COUNTS)
def test_measured_data_sets_load(data: Path, name: str) -> None:
    loaded = armrs.load_dataset(data / name)
    joints, counts = COUNTS[name]
    assert loaded.model.n_joints == joints
    assert {t.file: len(t.original_t) for t in loaded.trials} == counts
    assert len(loaded.fit_trials) == 1
    for trial in loaded.trials:
        assert trial.q.shape == trial.tau.shape == trial.dq.shape == (len(trial.t), joints)
        assert trial.valid.all()
        np.testing.assert_allclose(np.diff(trial.t), trial.dt, rtol=0.02)
        assert trial.resampled == (name.startswith("dfki") and trial.file != "trials/release_1.csv")
    expected = ["trials/swing_2.csv"] if name == "pendulum_single" else []
    assert [line.partition(":")[0] for line in loaded.warnings] == expected


@pytest.mark.parametrize(
    ("table", "message"),
    [
        (
            'segment = 3\nmass = 0.2\nat = 0.1\nconfigurations = ["slow"]',
            r"\[\[added\]\] 1, segment: found 3, allowed a whole number 1 to 2",
        ),
        (
            'segment = 1\nmass = 0.2\nat = 1.9\nconfigurations = ["slow"]',
            r"\[\[added\]\] 1, at: found 1\.9, allowed a finite number 0 to 0\.322 m",
        ),
    ],
)
def test_what_is_worn_has_to_be_on_the_arm(session: Session, table: str, message: str) -> None:
    with (session.folder / "dataset.toml").open("a", encoding="utf-8") as out:
        out.write(f"\n[[added]]\n{table}\n")
    with pytest.raises(BadInput, match=rf"dataset\.toml: {message}"):
        armrs.load_dataset(session.folder)


def test_a_tolerance_beyond_all_sensors_is_refused() -> None:
    with pytest.raises(BadInput, match="force_bias_N: found 1e\\+300, allowed a finite number 0 to 10000"):
        armrs.Tolerance(force_bias_N=1e300)
