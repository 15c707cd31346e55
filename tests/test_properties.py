"""Properties of readers and writers for random input, found by hypothesis; the same cases in every run."""

from __future__ import annotations

import string
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from armrs._armrs import verdict_of
from armrs.io import tomlfile
from armrs.io.raw.text_table import decoded_lines, table_of
from armrs.io.samples import read_samples, write_samples
from armrs.report import html, interactive_series

hypothesis = pytest.importorskip("hypothesis")
st = hypothesis.strategies

FINITE = st.floats(allow_nan=False, allow_infinity=False, width=64)
steady = hypothesis.settings(max_examples=60, deadline=None, derandomize=True)
NAMES = st.lists(st.text(string.ascii_letters + string.digits + "_", min_size=1, max_size=8), min_size=1, max_size=4, unique_by=str.lower)
VALUES = st.lists(st.lists(st.one_of(FINITE, st.just(float("nan"))), min_size=4, max_size=4), min_size=1, max_size=20)


@contextmanager
def folder() -> Iterator[Path]:
    with tempfile.TemporaryDirectory() as name:
        yield Path(name)


@steady
@hypothesis.given(rows=VALUES, names=NAMES, suffix=st.sampled_from([".csv", ".parquet"]))
def test_samples_come_back_to_the_bit(rows: list[list[float]], names: list[str], suffix: str) -> None:
    # As every file has; a row of one column that is empty would be no row.
    table = {"t_s": np.arange(len(rows)) / 7.0} | {f"{name}_V": np.array(rows)[:, k] for k, name in enumerate(names)}
    with folder() as out:
        write_samples(out / f"x{suffix}", list(table), list(table.values()))
        read = read_samples(out / f"x{suffix}")
    assert list(read.names) == list(table)
    for got, given in zip(read.values, table.values(), strict=True):
        assert np.array_equal(np.asarray(got), given, equal_nan=True)
        assert np.array_equal(np.signbit(got)[~np.isnan(given)], np.signbit(given)[~np.isnan(given)])


@steady
@hypothesis.given(
    values=st.lists(st.lists(st.floats(-1e6, 1e6), min_size=3, max_size=3), min_size=4, max_size=12),
    look=st.sampled_from([(",", "."), (";", ","), (";", "."), ("\t", "."), ("\t", ",")]),
    encoding=st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "cp1252"]),
    end=st.sampled_from(["\n", "\r\n"]),
)
def test_a_spreadsheet_is_read_as_it_was_written(values: list[list[float]], look: tuple[str, str], encoding: str, end: str) -> None:
    separator, mark = look
    lines = [separator.join(["Zeit (s)", "Höhe", "Kraft y"]), *(separator.join(repr(v).replace(".", mark) for v in row) for row in values)]
    with folder() as out:
        path = out / "x.csv"
        path.write_bytes((end.join(lines) + end).encode(encoding))
        read = table_of(path, *decoded_lines(path))
    assert [c.name for c in read.columns] == ["Zeit (s)", "Höhe", "Kraft y"]
    assert np.array_equal(np.column_stack([c.values for c in read.columns]), np.array(values))


SCALARS = st.one_of(st.booleans(), st.integers(-(2**53), 2**53), FINITE, st.text(st.characters(exclude_categories=["Cs"]), max_size=20))


@steady
@hypothesis.given(
    table=st.dictionaries(st.text(string.ascii_lowercase + "_", min_size=1, max_size=8), st.one_of(SCALARS, st.lists(FINITE)), max_size=6)
)
def test_toml_comes_back_as_it_was_written(table: dict[str, object]) -> None:
    with folder() as out:
        (out / "x.toml").write_text("\n".join([*tomlfile.lines(table), ""]), encoding="utf-8")
        assert tomlfile.read(out / "x.toml") == table


@steady
@hypothesis.given(values=st.lists(FINITE, min_size=2, max_size=60), repeats=st.integers(1, 200))
def test_thinned_lines_keep_both_ends_of_what_they_show(values: list[float], repeats: int) -> None:
    course = np.tile(np.array(values), repeats)
    made = interactive_series.series(
        "", "", np.arange(len(course)) * 0.01, [interactive_series.Panel("", "", (interactive_series.Line("a", "#000", course),))]
    )
    line = made["panels"][0]["lines"][0]["values"]
    assert len(line) == len(made["t_s"]) <= max(interactive_series.MOST_SAMPLES + 2, 2)
    rounded = [float(f"{v:.{interactive_series.DIGITS}g}") for v in (course.min(), course.max())]
    assert [min(line), max(line)] == rounded


@steady
@hypothesis.given(names=st.lists(st.text(max_size=30), min_size=3, max_size=6))
def test_headings_of_any_name_make_contents_without_markup(names: list[str]) -> None:
    engine = html.environment()
    made = engine.from_string("{{ contents }}{% for n in names %}<h2>{{ n }}</h2>{% endfor %}").render(contents=html.CONTENTS, names=names)
    page = html.with_contents(html.Markup(made), 1)
    assert page.count("<h2 id=") == page.count("<li><a href=") == len(names)
    assert "<script" not in page


@steady
@hypothesis.given(named=st.booleans(), is_open=st.booleans(), z=st.floats(-5, 50), ratio=st.floats(0, 50), share=st.floats(0, 1))
def test_more_that_is_left_never_makes_a_verdict_better(named: bool, is_open: bool, z: float, ratio: float, share: float) -> None:
    said = verdict_of(named=named, is_open=is_open, z=z, ratio=ratio, share=share)
    assert (said == "nothing_missing") <= (not named) and (said == "explained") <= named
    worse = verdict_of(named=named, is_open=is_open, z=z + 1.0, ratio=ratio + 1.0, share=min(1.0, share + 0.1))
    assert said != "unexplained" or worse == "unexplained"
