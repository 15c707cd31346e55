"""Base classes of results: data frames, labelled arrays, JSON, display in notebooks."""

from __future__ import annotations

import html
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from . import view_registry
from .errors import ArmrsError
from .io import files

if TYPE_CHECKING:
    import numpy as np
    import pandas
    import xarray

_SHOWN = 30
"""Rows that a notebook shows; `to_dataframe` has all."""
_SMALLEST = 1e-12
"""Probabilities below are not distinguished."""
SYMBOLS = (
    "m is the mass of a segment, l the distance of its centre of mass from the joint, I its inertia about the centre of mass and a its "
    "length; the number is that of the segment, counted from the base. The elastic law of a joint is stiffness times its angle from rest; "
    "stiffness·rest is the torque of that spring at angle zero."
)
"""What the names of inertial parameters and springs mean."""


@dataclass(frozen=True)
class Tidy:
    """A tidy table: one row an observation.

    Attributes
    ----------
    columns : mapping of str to sequence
        All of one length.
    units : mapping of str to str
        Of the columns whose unit is the same in every row.
    """

    columns: Mapping[str, Sequence[Any] | np.ndarray]
    units: Mapping[str, str]

    @property
    def n_rows(self) -> int:
        """Number of rows."""
        return max(map(len, self.columns.values()), default=0)


class Framed:
    """What is also a table: a data frame, and rows in a notebook. Subclasses define it by `tidy`."""

    symbols: ClassVar[str] = ""
    """What the symbols in the names mean, for readers of the table."""

    def tidy(self) -> Tidy:
        """Return the result as a tidy table."""
        raise NotImplementedError

    def __iter__(self) -> Iterator[dict[str, Any]]:
        """Give the rows of the table, so that `pandas.DataFrame(result)` works."""
        columns = self.tidy().columns
        for row in zip(*columns.values(), strict=True):
            yield dict(zip(columns, row, strict=True))

    def to_dataframe(self) -> pandas.DataFrame:
        """Return a tidy pandas DataFrame; `attrs["units"]` has the units of its columns.

        Raises
        ------
        ArmrsError
            When pandas, of the extra `notebook`, is not installed.
        """
        try:
            import pandas
        except ImportError:
            raise ArmrsError('data frames need pandas: pip install "armrs[notebook]"') from None
        table = self.tidy()
        frame = pandas.DataFrame(dict(table.columns))
        frame.attrs["units"] = dict(table.units)
        return frame

    def _repr_html_(self) -> str:
        """Return the summary line and the first rows, for notebooks."""
        table = self.tidy()
        names = list(table.columns)
        head = "".join(f"<th>{_text(name)}{_text(_unit(table.units.get(name)))}</th>" for name in names)
        shown = min(table.n_rows, _SHOWN)
        rows = "".join(
            "<tr>" + "".join(f"<td>{_marked(table.columns[name][k], name)}</td>" for name in names) + "</tr>" for k in range(shown)
        )
        more = f"<p>{table.n_rows - shown} more rows: to_dataframe()</p>" if table.n_rows > shown else ""
        meaning = f"<p>{_text(self.symbols)}</p>" if self.symbols else ""
        table_html = f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"
        # A table wider than the page is scrolled by itself, also with keys.
        label = _text(f"table of {type(self).__name__}")
        scrolled = f'<div role="region" tabindex="0" aria-label="{label}" style="overflow-x: auto">{table_html}</div>'
        return f"<p>{_text(repr(self))}</p>{scrolled}{meaning}{more}"


class Tabular(Framed):
    """The result of a verb: a table, a picture, a page and JSON. Subclasses have `to_dict`; `views` names what draws them."""

    def plot(self, name: str | None = None) -> np.ndarray:
        """Draw a figure of the report where notebooks and windows show it.

        Parameters
        ----------
        name : str, optional
            Which figure; the first when absent. A name that is unknown is refused with the list of names.

        Returns
        -------
        ndarray of matplotlib Axes, shape (n,)
            `axes[0].figure` is the figure.

        Raises
        ------
        BadInput
            For a name that is unknown, and a result without anything to draw.
        """
        axes: np.ndarray = view_registry.of(self).plot(self, name)
        return axes

    def report(self, path: str | os.PathLike[str]) -> Path:
        """Write the report that the command writes below `-o`, as one self-contained HTML page; return its path.

        Raises
        ------
        BadInput
            When the name does not end with `.html`, or cannot be written.
        """
        written: Path = view_registry.of(self).report(self, path)
        return written

    def to_json(self, path: str | os.PathLike[str] | None = None) -> str:
        """Return the result as JSON text, and write it to `path` where one is given."""
        data = self.to_dict()  # type: ignore[attr-defined]
        if path is not None:
            files.write_json(path, data)
        return files.json_text(data)


@dataclass(frozen=True)
class Labelled:
    """An array with a name for each of its dimensions, and a unit."""

    dims: tuple[str, ...]
    values: np.ndarray
    unit: str


class Series:
    """What holds series over time, of quantities that have several components."""

    def labelled(self) -> tuple[Mapping[str, Any], Mapping[str, Labelled]]:
        """Return coordinates by dimension, and quantities by name."""
        raise NotImplementedError

    def to_xarray(self) -> xarray.Dataset:
        """Return an xarray Dataset; each variable has its unit in `attrs["units"]`.

        Raises
        ------
        ArmrsError
            When xarray, of the extra `notebook`, is not installed.
        """
        try:
            import xarray
        except ImportError:
            raise ArmrsError('labelled arrays need xarray: pip install "armrs[notebook]"') from None
        coordinates, quantities = self.labelled()
        variables = {name: (q.dims, q.values, {"units": q.unit}) for name, q in quantities.items()}
        made = xarray.Dataset(variables, coords=dict(coordinates))
        made["time"].attrs["units"] = "s"
        return made


def over_trials(times: Sequence[np.ndarray], series: Mapping[str, Sequence[np.ndarray]]) -> dict[str, np.ndarray]:
    """Return series of trials of different length as arrays over trial and sample; what lies behind the end of a trial is NaN.

    Parameters
    ----------
    times : sequence of ndarray, shape (n_samples_of_trial,)
        [s]
    series : mapping of str to sequence of ndarray, shape (n_samples_of_trial, …)
        One array for each trial.

    Returns
    -------
    dict of str to ndarray, shape (n_trials, n_samples, …)
        The times are under `time`.
    """
    import numpy as np

    most = max(map(len, times), default=0)

    def stacked(arrays: Sequence[np.ndarray]) -> np.ndarray:
        whole = np.full((len(arrays), most, *np.shape(arrays[0])[1:]), np.nan)
        for k, values in enumerate(arrays):
            whole[k, : len(values)] = values
        return whole

    return {name: stacked(arrays) for name, arrays in {"time": times, **series}.items() if arrays}


def _text(value: object) -> str:
    return html.escape(str(value))


def _unit(unit: str | None) -> str:
    return f" [{unit}]" if unit else ""


def _marked(value: object, name: str) -> str:
    """Return a cell as HTML; names are set as code, in which I and l look different."""
    text = _text(_cell(value, name))
    return f"<code>{text}</code>" if name == "name" and text else text


def _cell(value: object, name: str) -> str:
    if value is None or value != value:
        return ""
    if isinstance(value, float) and name.startswith("p_") and value < _SMALLEST:
        return f"< {_SMALLEST:g}"
    return f"{value + 0.0:.4g}" if isinstance(value, float) else str(value)  # of minus zero its sign goes
