"""Sessions of one arm: the recordings of another day, which a history takes for another session."""

from __future__ import annotations

import dataclasses
import shutil
from pathlib import Path
from typing import Any

import armrs
from armrs.io.dataset import write_dataset


def another(dataset: armrs.Dataset, number: int) -> armrs.Dataset:
    """Return the data set as recorded again: its clock is later by less than any estimate shows."""
    return dataset.replace(trials=tuple(dataclasses.replace(t, t=t.t + 2.0**-30 * number) for t in dataset.trials))


def again(result: Any, number: int) -> Any:
    """Return a result of another recording with the same estimates."""
    return dataclasses.replace(result, dataset=another(result.dataset, number))


def folder_again(folder: Path, to: Path, number: int = 1) -> Path:
    """Write the data set of a folder as recorded again, with the same files besides."""
    shutil.copytree(folder, to)
    write_dataset(another(armrs.load_dataset(folder), number), to)
    return to
