"""Which module draws each result. The module is loaded only when something is drawn.

Modules that compute import nothing that draws, and starting takes no time for figures that are not needed.
"""

from __future__ import annotations

import pkgutil
from typing import Any

DRAWN_BY = {
    "Calibrated": "report.gap.stage_figures:CALIBRATED",
    "Checked": "report.dataset_pages:CHECKED",
    "Cohort": "report.clinic_figures:COHORT",
    "Compared": "report.gap.stage_figures:COMPARED",
    "CoupledRun": "cosim.coupled_output:COUPLED",
    "Demonstration": "demo.run:SHOWN",
    "GapFound": "report.gap.result_files:GAP",
    "History": "report.result_files:HISTORY",
    "Imported": "report.dataset_pages:IMPORTED",
    "Identified": "report.result_files:IDENTIFIED",
    "PassiveMoments": "report.result_files:PASSIVE",
    "Plan": "report.result_files:PLANNED",
    "Recorded": "report.dataset_pages:RECORDED",
    "Replay": "report.replay:REPLAYED",
    "Spasticity": "report.clinic_figures:SPASTICITY",
    "Simulated": "report.result_files:SIMULATED",
    "Swept": "montecarlo.result_files:SWEPT",
    "Trial": "report.recording",
}
"""What draws an object, by its class, below `armrs`."""
WORDS = {
    "check": "report.dataset_pages",
    "import": "report.dataset_pages",
    "cohort": "report.clinic_sentences",
    "gap": "report.gap.sentences",
    "spasticity": "report.clinic_sentences",
    "sweep": "montecarlo.sentences",
}
"""The module with sentences and tables about a result, by its verb, where it is not `armrs.report.sentences`."""


def of(drawn: object) -> Any:
    """Return what draws an object: it has a function `plot`, and `report` where there is a page."""
    return _load(next(DRAWN_BY[kind.__name__] for kind in type(drawn).__mro__ if kind.__name__ in DRAWN_BY))


def words_of(verb: str) -> Any:
    """Return the module with sentences and tables about the results of a verb. Its function `verdict` summarises one."""
    return _load(WORDS.get(verb, "report.sentences"))


def _load(name: str) -> Any:
    return pkgutil.resolve_name(f"{__package__}.{name}")
