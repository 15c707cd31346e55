"""The types of the report: an item of the thesis (table or figure), and its recomputed values."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from ..report.figures import Drawn
from ..report.tables import Table


@dataclass(frozen=True)
class Sheet:
    """A table with its title."""

    title: str
    table: Table


@dataclass(frozen=True)
class Found:
    """What came out for an item.

    Attributes
    ----------
    ours : str
        What we get.
    why : str
        Why it differs from what is printed, or why it does not.
    values : mapping
        Plain numbers for machines, units in the names.
    sheets, figures, animations
        Animations are plain data as `animation.film` makes them.
    """

    ours: str
    why: str
    values: Mapping[str, Any] = field(default_factory=dict)
    sheets: Sequence[Sheet] = ()
    figures: Sequence[Drawn] = ()
    animations: Sequence[Mapping[str, Any]] = ()


@dataclass(frozen=True)
class Item:
    """A table, a figure or a group of figures of the thesis.

    Attributes
    ----------
    key : str
        Stable name, which is also the anchor in the page.
    title : str
    place : str
        Section of the thesis; its text has no page numbers.
    printed : str
        What is printed.
    make : callable
        Recomputes it.
    virtual : bool
        Whether it rests on simulated data.
    """

    key: str
    title: str
    place: str
    printed: str
    make: Callable[[], Found]
    virtual: bool


class Group:
    """The items of one part of the thesis, in the order in which they are added."""

    def __init__(self, key: str, title: str) -> None:
        self.key, self.title = key, title
        self.items: list[Item] = []

    def item(
        self, key: str, title: str, place: str, printed: str, *, virtual: bool = True
    ) -> Callable[[Callable[[], Found]], Callable[[], Found]]:
        """Add what the decorated function recomputes."""

        def add(make: Callable[[], Found]) -> Callable[[], Found]:
            self.items.append(Item(key, title, place, printed, make, virtual))
            return make

        return add
