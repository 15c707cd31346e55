"""Warnings of results, issued through the module `warnings`."""

from __future__ import annotations

import functools
import sys
import warnings
from collections.abc import Callable, Iterable
from typing import ParamSpec, TypeVar

from .errors import ArmrsWarning

_Given = ParamSpec("_Given")
_Result = TypeVar("_Result")


def with_warnings(function: Callable[_Given, _Result]) -> Callable[_Given, _Result]:
    """Return a function that also warns of what its result, and a data set that it read itself, hold in `warnings`.

    Only calls from outside of this package warn: verbs print these lines, and what calls inside of another call find is its affair.
    """

    @functools.wraps(function)
    def warned(*args: _Given.args, **kwargs: _Given.kwargs) -> _Result:
        result = function(*args, **kwargs)
        caller = str(sys._getframe(1).f_globals.get("__name__"))
        if caller.partition(".")[0] != __package__:
            for line in _lines(result, [*args, *kwargs.values()]):
                warnings.warn(line, ArmrsWarning, stacklevel=2)
        return result

    return warned


def _lines(result: object, given: Iterable[object]) -> list[str]:
    """Return the warnings of a result; those of a given data set were shown when it was read."""
    own = list(getattr(result, "warnings", ()))
    dataset = getattr(result, "dataset", None)
    if dataset is None or any(value is dataset for value in given):
        return own
    return [*dataset.warnings, *own]
