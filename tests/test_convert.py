"""Conversion between CSV and Parquet: every column and value to the bit, or a refusal and nothing written."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet

import armrs
from armrs import BadInput, cli
from conftest import DATASET, Session, csv_lines, rows

HARD = [0.1 + 0.2, -0.0, 5e-324, 1.7976931348623157e308, 1 / 3, 123456789.12345679, 1e-5, 3.0]


def bits(path: Path, column: str) -> bytes:
    return np.asarray(parquet.read_table(path).column(column).to_numpy(), dtype=np.float64).tobytes()


def test_every_float_survives_both_ways(tmp_path: Path) -> None:
    first = tmp_path / "hard.parquet"
    parquet.write_table(pa.table({"x": HARD, "emg_a b": HARD[::-1]}), first)
    (text,) = armrs.convert(first, tmp_path / "csv", to="csv")
    (again,) = armrs.convert(text, tmp_path / "parquet", to="parquet")
    assert (text.name, again.name) == ("hard.csv", "hard.parquet")
    assert parquet.read_table(again).column_names == ["x", "emg_a b"]
    for name in ("x", "emg_a b"):
        assert bits(again, name) == bits(first, name)


def test_text_whole_numbers_and_empty_cells_survive(tmp_path: Path) -> None:
    first = tmp_path / "mixed.csv"
    content = 'n,label,x\n9007199254740993,"a ""b"", c",1.5\n-1,,\n2,"",-0.0\n'
    first.write_text(content, encoding="utf-8")
    (middle,) = armrs.convert(first, tmp_path / "parquet", to="parquet")
    table = parquet.read_table(middle)
    assert table.column("n").to_pylist() == [9007199254740993, -1, 2]
    assert table.column("label").to_pylist() == ['a "b", c', None, ""]
    assert table.column("x").to_pylist() == [1.5, None, 0.0]
    (last,) = armrs.convert(middle, tmp_path / "csv", to="csv")
    assert last.read_text(encoding="utf-8") == content.replace("-0.0", "-0").replace("9007199254740993,", "9007199254740993,")


def test_narrow_numbers_are_widened_without_loss(tmp_path: Path) -> None:
    first = tmp_path / "narrow.parquet"
    narrow = np.array([0.1, 1e-30, -3.5], dtype=np.float32)
    parquet.write_table(pa.table({"f": narrow, "i": np.array([1, -2, 3], dtype=np.int16)}), first)
    (text,) = armrs.convert(first, tmp_path / "csv", to="csv")
    (again,) = armrs.convert(text, tmp_path / "parquet", to="parquet")
    assert bits(again, "f") == narrow.astype(np.float64).tobytes()
    assert parquet.read_table(again).column("i").to_pylist() == [1, -2, 3]


def test_digits_with_a_leading_zero_are_a_name(tmp_path: Path) -> None:
    first = tmp_path / "names.csv"
    first.write_text("t_s,label\n0,007\n1,012\n", encoding="utf-8")
    (middle,) = armrs.convert(first, tmp_path / "parquet", to="parquet")
    assert parquet.read_table(middle).column("label").to_pylist() == ["007", "012"]
    parquet.write_table(pa.table({"label": ["7", "12"]}), tmp_path / "text.parquet")
    with pytest.raises(BadInput, match="column label: found values that do not come back"):
        armrs.convert(tmp_path / "text.parquet", tmp_path / "csv", to="csv")


def test_a_file_with_a_header_only_keeps_its_header(tmp_path: Path) -> None:
    first = tmp_path / "empty.csv"
    first.write_text("t_s,q1_rad\n", encoding="utf-8")
    (middle,) = armrs.convert(first, tmp_path / "parquet", to="parquet")
    (last,) = armrs.convert(middle, tmp_path / "csv", to="csv")
    assert last.read_text(encoding="utf-8") == "t_s,q1_rad\n"


def test_a_data_set_converts_as_a_whole(session: Session, tmp_path: Path) -> None:
    values = rows(200)
    values[50:55, 1] = values[100:150, 4] = np.nan
    session.trial.write_text("\n".join(csv_lines(values)), encoding="utf-8")
    before = armrs.load_dataset(session.folder)
    written = armrs.convert(session.folder, tmp_path / "out", to="parquet")
    names = sorted(p.relative_to(tmp_path / "out").as_posix() for p in written)
    assert names == ["dataset.toml", "model.toml", "trials/slow_1.parquet", "trials/slow_2.parquet"]
    assert sorted(p for p in (tmp_path / "out").rglob("*") if p.is_file()) == sorted(written)
    after = armrs.load_dataset(tmp_path / "out")
    assert (after.model, after.subject, after.tolerance) == (before.model, before.subject, before.tolerance)
    for a, b in zip(before.trials, after.trials, strict=True):
        assert a.original_t.tobytes() == b.original_t.tobytes()
        for name in a.original:
            np.testing.assert_array_equal(a.original[name], b.original[name])


def test_a_fault_in_the_last_trial_writes_nothing(session: Session, tmp_path: Path) -> None:
    last = session.folder / "trials/slow_2.csv"
    last.write_text(last.read_text(encoding="utf-8") + "1,2\n", encoding="utf-8")
    with pytest.raises(BadInput, match=r"slow_2\.csv: line 102: found 2 cells, allowed 9 cells"):
        armrs.convert(session.folder, tmp_path / "out", to="parquet")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", [".", "..", "/", "trials/.."])
def test_a_trial_without_a_file_name_is_refused(session: Session, tmp_path: Path, name: str) -> None:
    """`.` ended in a traceback: a folder has no suffix that could be changed."""
    description = session.folder / "dataset.toml"
    description.write_text(description.read_text(encoding="utf-8").replace("trials/slow_1.csv", name), encoding="utf-8")
    with pytest.raises(BadInput, match=rf"\[\[trial\]\] 1, file: found '{name}', allowed the name of a file"):
        armrs.convert(session.folder, tmp_path / "out", to="parquet")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"x": [[1.0], [2.0]]}, "column x: found type list"),
        ({"x": [True, False]}, "column x: found type bool, allowed numbers or text"),
        ({"x": np.array(["2026-01-01", "2026-01-02"], dtype="datetime64[s]")}, "column x: found type timestamp"),
        ({" x": [1.0]}, "header, column 1: found ' x', allowed a name without line ends and blanks around it"),
        ({"x": ["007", "008"]}, ""),
    ],
)
def test_refuses_what_csv_cannot_hold(tmp_path: Path, table: dict[str, object], message: str) -> None:
    first = tmp_path / "odd.parquet"
    parquet.write_table(pa.table(table), first)
    if not message:  # text that looks like a number stays text in CSV
        (text,) = armrs.convert(first, tmp_path / "out", to="csv")
        assert text.read_text(encoding="utf-8") == 'x\n"007"\n"008"\n'
        return
    with pytest.raises(BadInput, match=message):
        armrs.convert(first, tmp_path / "out", to="csv")
    assert not (tmp_path / "out").exists()


def test_refuses_nan_written_out(tmp_path: Path) -> None:
    first = tmp_path / "nan.csv"
    first.write_text("x,y\n1,2\n3,nan\n", encoding="utf-8")
    with pytest.raises(BadInput, match=r"nan\.csv: line 3, column y: found 'nan', allowed a finite number, or an empty cell"):
        armrs.convert(first, tmp_path / "out", to="parquet")


def test_does_not_write_over_its_own_input(session: Session) -> None:
    before = session.files()
    with pytest.raises(BadInput, match="found an input of this command"):
        armrs.convert(session.folder, session.folder, to="parquet")
    with pytest.raises(BadInput, match="found an input of this command"):
        armrs.convert(session.trial, session.trial.parent, to="csv")
    assert session.files() == before


def test_an_output_that_is_a_file_is_refused(session: Session, tmp_path: Path) -> None:
    (tmp_path / "out").write_text("x", encoding="utf-8")
    with pytest.raises(BadInput, match="folder: found a file, allowed a folder"):
        armrs.convert(session.folder, tmp_path / "out", to="parquet")


def test_measured_data_come_back_to_the_bit(data: Path, tmp_path: Path) -> None:
    for name in ("dfki_a0", "pendulum_single"):
        armrs.convert(data / name, tmp_path / name / "parquet", to="parquet")
        armrs.convert(tmp_path / name / "parquet", tmp_path / name / "csv", to="csv")
        first, last = armrs.load_dataset(data / name), armrs.load_dataset(tmp_path / name / "csv")
        assert [w.partition(":")[2] for w in first.warnings] == [w.partition(":")[2] for w in last.warnings]
        for a, b in zip(first.trials, last.trials, strict=True):
            assert a.original_t.tobytes() == b.original_t.tobytes()
            assert all(a.original[column].tobytes() == b.original[column].tobytes() for column in a.original)


def test_another_data_set_is_not_replaced(session: Session, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A conversion wrote its dataset.toml and model.toml over those of the data set that was there."""
    other = Session(tmp_path / "other")
    other.edit("dataset.toml", DATASET.splitlines()[0], 'name = "another"')
    before = (other.folder / "dataset.toml").read_bytes()
    assert cli.main(["convert", str(session.folder), "-o", str(other.folder)]) == 2
    assert "this folder holds another data set; choose another -o" in capsys.readouterr().err
    assert (other.folder / "dataset.toml").read_bytes() == before
    assert [cli.main(["convert", str(session.folder), "-o", str(tmp_path / "new")]) for _ in range(2)] == [0, 0]


def test_a_model_that_exists_is_replaced_only_by_force(session: Session, capsys: pytest.CaptureFixture[str]) -> None:
    """From model.toml to model.urdf and back, the way back took the place of the first."""
    model = session.folder / "model.toml"
    before = model.read_bytes()
    assert cli.main(["convert", str(model), "--to", "urdf", "-o", str(session.folder)]) == 0
    back = ["convert", str(session.folder / "model.urdf"), "--to", "toml", "-o", str(session.folder)]
    assert cli.main(back) == 2
    assert "-o: found a model.toml that exists, allowed a folder without one, or --force" in capsys.readouterr().err
    assert model.read_bytes() == before
    assert cli.main([*back, "--force"]) == 0 and model.read_bytes() != before
