"""The results of a sweep on disk: parts while it runs, two Parquet files when it is done."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ..errors import BadInput, Text
from ..io import files
from ..io.samples import write_table
from .case import Row
from .sweep_file import Sweep

KINDS = ("estimates", "cases")
"""The two tables, and their order on the way to the disk; the second is written last, so that where it is, the first is whole."""
_ROW_GROUP = 1000
"""Cases in a row group of the final files."""
_PARTS = 200
"""So many parts at least, where there are as many cases: each worker gets its share."""
_LARGEST_PART = 20
"""Cases that are lost at most when a worker is; some seconds."""


class Store:
    """The folder of one sweep.

    A part holds some cases in a row. How many depends on the number of cases alone, never on who computes them, so that the final files
    have the same bytes however the work was shared.

    Raises
    ------
    BadInput
        When the folder holds another sweep.
    """

    def __init__(self, sweep: Sweep, folder: Path) -> None:
        self.sweep = sweep
        self.folder = folder
        self.parts = folder / "parts"
        self.mark = folder / "sweep-input.json"
        self.size = max(1, min(sweep.cases // _PARTS, _LARGEST_PART))
        self.schemas = {"cases": _cases(sweep), "estimates": _estimates()}
        self._check_owner()

    def _check_owner(self) -> None:
        if not self.mark.exists():
            return
        try:
            digest = json.loads(self.mark.read_text(encoding="utf-8"))["sha256"]
        except (OSError, ValueError, TypeError, KeyError):
            raise BadInput("file", Text("no digest of a sweep"), "what armrs sweep wrote, or another folder", file=self.mark) from None
        if digest != self.sweep.digest:
            found = Text("results of another sweep")
            raise BadInput("-o", found, "the folder of this SWEEP.toml, its experiment and this version of armrs", file=self.folder)

    def ranges(self) -> list[tuple[int, int]]:
        """Return the first and last case of each part."""
        return [(k, min(k + self.size - 1, self.sweep.cases)) for k in range(1, self.sweep.cases + 1, self.size)]

    def begin(self) -> None:
        """Mark the folder as that of this sweep and remove what an interrupted write left."""
        if not self.mark.exists():
            # Of whatever sweep these were, it is not known to be this one.
            shutil.rmtree(self.parts, ignore_errors=True)
            for kind in KINDS:
                files.may_replace(self.final(kind), ".parquet")
                self.final(kind).unlink(missing_ok=True)
            files.write_json(self.mark, {"sha256": self.sweep.digest, "cases": self.sweep.cases, "name": self.sweep.name})
        for left in (*self.folder.glob(".*.part"), *self.parts.glob(".*.part")):
            left.unlink(missing_ok=True)

    def final(self, kind: str) -> Path:
        """Return the path of a final file."""
        return self.folder / f"{kind}.parquet"

    @property
    def is_done(self) -> bool:
        """Whether the final files are there."""
        return self.mark.exists() and all(self.final(kind).exists() for kind in KINDS)

    def missing(self) -> list[tuple[int, int]]:
        """Return the parts that are still to be computed."""
        return [] if self.is_done else [part for part in self.ranges() if not self._part(part, "cases").exists()]

    def add(self, part: tuple[int, int], rows: tuple[list[Row], list[Row]]) -> None:
        """Write the rows of a part."""
        import pyarrow as pa

        cases, estimates = rows
        # In the order of KINDS: a part counts as done when its cases are there.
        for kind, content in zip(KINDS, (estimates, cases), strict=True):
            write_table(self._part(part, kind), pa.Table.from_pylist(content, schema=self.schemas[kind]))

    def finish(self) -> None:
        """Put all parts together, in the order of the cases, and remove them."""
        if not self.is_done:
            for kind in KINDS:
                self._join(kind)
        shutil.rmtree(self.parts, ignore_errors=True)

    def tables(self, kind: str) -> Iterator[Any]:
        """Give the rows of a final file in bounded pieces, as Arrow tables."""
        from pyarrow import parquet

        with parquet.ParquetFile(self.final(kind)) as file:
            for group in range(file.num_row_groups):
                yield file.read_row_group(group)

    def _join(self, kind: str) -> None:
        import pyarrow as pa
        from pyarrow import parquet

        ranges, together = self.ranges(), -(-_ROW_GROUP // self.size)
        with files.replacing(self.final(kind)) as temporary, parquet.ParquetWriter(temporary, self.schemas[kind]) as writer:
            for k in range(0, len(ranges), together):
                pieces = [self._read(self._part(part, kind)) for part in ranges[k : k + together]]
                table = pa.concat_tables(pieces).combine_chunks()
                writer.write_table(table, row_group_size=max(1, table.num_rows))

    def _read(self, path: Path) -> Any:
        import pyarrow as pa
        from pyarrow import parquet

        try:
            return parquet.read_table(path)
        except (pa.ArrowException, OSError) as error:
            raise BadInput(
                "file", Text(str(error).splitlines()[0]), "a whole part: remove it, and it is computed again", file=path
            ) from None

    def _part(self, part: tuple[int, int], kind: str) -> Path:
        return self.parts / f"{part[0]:07d}-{kind}.parquet"


def _cases(sweep: Sweep) -> Any:
    import pyarrow as pa

    columns = [("case", pa.int64()), ("seed", pa.int64()), ("status", pa.string()), ("reason", pa.string())]
    columns += [(v.key, pa.float64() if v.numeric else pa.string()) for v in sweep.vary]
    columns += [("trials", pa.int32()), ("stopped", pa.int32()), ("force_max_N", pa.float64()), ("force_rms_N", pa.float64())]
    if sweep.question is not None:
        columns += [("solver", pa.string()), ("sound", pa.bool_()), ("rank", pa.int32()), ("unknowns", pa.int32())]
        columns += [("residual_fit_Nm", pa.float64()), ("residual_test_Nm", pa.float64())]
    return pa.schema(columns)


def _estimates() -> Any:
    import pyarrow as pa

    words, numbers = pa.string(), pa.float64()
    columns = [("case", pa.int64()), ("name", words), ("kind", words), ("joint", pa.int32()), ("unit", words)]
    columns += [(name, numbers) for name in ("truth", "given", "value", "std", "low", "high")]
    columns += [("decided_by", words), ("bootstraps", pa.int32())]
    columns += [(name, numbers) for name in ("bootstrap_std", "bootstrap_low", "bootstrap_high")]
    return pa.schema(columns)
