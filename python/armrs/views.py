"""The one door from a result to what draws it: named here, loaded when something is drawn.

Modules that compute import nothing that draws, and starting takes no time for figures that are not needed.
"""

from __future__ import annotations

import pkgutil
from typing import Any

DRAWN_BY = {
    "Checked": "report.data_sets:CHECKED",
    "Cohort": "report.clinic_results:COHORT",
    "Coupled": "cosim.outcome:COUPLED",
    "Demonstration": "workflows.demo:SHOWN",
    "GapFound": "workflows.gap.results:GAP",
    "History": "report.results:HISTORY",
    "Imported": "report.data_sets:IMPORTED",
    "Identified": "report.results:IDENTIFIED",
    "PassiveMoments": "report.results:PASSIVE",
    "Plan": "report.results:PLANNED",
    "Recorded": "report.data_sets:RECORDED",
    "Replay": "report.online:REPLAYED",
    "Spasticity": "report.clinic_results:SPASTICITY",
    "Simulated": "report.results:SIMULATED",
    "Swept": "montecarlo.results:SWEPT",
    "Trial": "report.recording",
}
"""What draws an object, by its class, below `armrs`."""
WORDS = {
    "check": "report.data_sets",
    "import": "report.data_sets",
    "cohort": "report.clinic_words",
    "gap": "workflows.gap.words",
    "spasticity": "report.clinic_words",
    "sweep": "montecarlo.words",
}
"""The module with sentences and tables about a result, by its verb, where it is not `armrs.report.words`."""


def of(drawn: object) -> Any:
    """Return what draws an object: it has a function `plot`, and `report` where there is a page."""
    return _load(next(DRAWN_BY[kind.__name__] for kind in type(drawn).__mro__ if kind.__name__ in DRAWN_BY))


def words_of(verb: str) -> Any:
    """Return the module with sentences and tables about the results of a verb. Its function `verdict` summarises one."""
    return _load(WORDS.get(verb, "report.words"))


def _load(name: str) -> Any:
    return pkgutil.resolve_name(f"{__package__}.{name}")
