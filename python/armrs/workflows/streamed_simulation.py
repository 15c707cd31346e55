"""Simulated runs of any length in bounded memory: pieces are kept on disk until they are drawn and written."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import IO, Any

import numpy as np

from .. import _armrs
from ..errors import SimulationError
from ..io import files
from ..io.trial import Trial
from ..model import Model
from .movement import Movement
from .simulate import PIECE, Doubted, Simulated, digested, is_doubtful, resolve, simulate_in_pieces
from .stiction import steps_to_try, sticking


class Streamed(Doubted):
    """A run that is read a piece at a time; made by `stream`.

    Attributes
    ----------
    model : Model
    settings : dict
        As of `Simulated`.
    samples : int
    """

    def __init__(self, model: Model, near: Path | None, stack: contextlib.ExitStack) -> None:
        self.model = model
        self.settings: dict[str, Any] = {}
        self.samples = 0
        self._near = near
        self._stack = stack
        self._first: Simulated | None = None
        self._file: IO[bytes] | None = None

    def _add(self, piece: Simulated) -> None:
        """Take the next samples; the first piece stays in memory as long as it is the only one."""
        if self._first is None:
            self._first = piece
            self.settings = piece.settings
        else:
            if self._file is None:
                self._file = self._stack.enter_context(files.unnamed(self._near))
                self._append(self._first)
                # What does not change, and shapes.
                self._first = next(self._first.pieces(1))
            self._append(piece)
        self.samples += len(piece.t)

    def _append(self, piece: Simulated) -> None:
        """Write the columns of a piece behind those of the pieces before."""
        assert self._file is not None
        with files.as_bad_input(self._near):
            for values in _arrays(piece).values():
                self._file.write(np.ascontiguousarray(values).data)

    def pieces(self) -> Iterator[Simulated]:
        """Give the samples in order, as runs of at most `PIECE` of them."""
        assert self._first is not None
        if self._file is None:
            yield from self._first.pieces()
            return
        for start in range(0, self.samples, PIECE):
            columns = dict(self._first.columns)
            columns |= {name: self._read(name, start) for name in _arrays(self._first)}
            yield self._first.with_columns(columns)

    def _read(self, name: str, start: int) -> np.ndarray:
        """Return a column of the piece that begins at a sample."""
        assert self._first is not None and self._file is not None
        count = min(PIECE, self.samples - start)
        forms = _arrays(self._first)
        before = list(forms)[: list(forms).index(name)]
        place = start * sum(form.nbytes for form in forms.values()) + count * sum(forms[other].nbytes for other in before)
        with files.as_bad_input(self._near):
            self._file.seek(place)
            values = np.frombuffer(self._file.read(count * forms[name].nbytes))
        return values.reshape(count, *forms[name].shape[1:])

    @cached_property
    def digest(self) -> str:
        """Digest of the recorded bits, that of `Simulated`."""
        assert self._first is not None
        if self._file is None:
            return self._first.digest
        digest = _armrs.Digest(self._first.columns["effects"])
        for name in digested(self._first.columns):
            form = self._first.columns[name]
            digest.column(name, 0 if form is None else self.samples * form.size)
            if form is not None:
                for start in range(0, self.samples, PIECE):
                    digest.values(self._read(name, start))
        return digest.value()


def _arrays(piece: Simulated) -> dict[str, np.ndarray]:
    return {name: values for name, values in piece.columns.items() if isinstance(values, np.ndarray)}


@contextlib.contextmanager
def stream(
    model: Model, drive: Movement | Trial | None, near: Path | None = None, *, accuracy: float | None = None, **options: Any
) -> Iterator[Streamed]:
    """Simulate a run of any length, while pieces of it are consumed.

    Parameters
    ----------
    model, drive, options
        As of `simulate`; nothing that sensors read.
    accuracy : float, optional
        As of `simulate`; the run is made once more with the step that is found.
    near : path, optional
        On whose disk samples may be kept for that time: this folder, or where it is to be.
    """
    model = sticking(model)
    dt, found = options.pop("dt", None), {}
    if accuracy is not None:
        found = resolve(model, drive, accuracy, dt=dt, **options)
        dt = found["dt_s"]
    tried = steps_to_try(model, engine=options.get("engine", "native"), integrator=options.get("integrator"), dt=dt)
    for step in tried:
        with contextlib.ExitStack() as stack:
            run = Streamed(model, near, stack)
            try:
                simulate_in_pieces(model, drive, run._add, samples=PIECE, dt=step, **options)
            except SimulationError:
                if step == tried[-1]:
                    raise
                continue  # a step that is too long may end the run
            run.settings = run.settings | found
            if step == tried[-1] or is_doubtful(run) is None:
                yield run
                return
