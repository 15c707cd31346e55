"""The tables and figures of the thesis that no item recomputes, and why."""

from __future__ import annotations

from typing import Any

THESIS = (
    "Timotej Kodek: Estimation of Upper Extremity Biomechanical Parameters Using a Robot Manipulator. Ph. D. thesis, University of "
    "Ljubljana, Faculty of Electrical Engineering, September 2004."
)

_DRAWING = "a drawing or photograph: nothing is computed"
_ROWS = [
    ["Figures 1.1 to 1.3", "skeleton and muscles of the arm", _DRAWING],
    ["Table 2.1", "relative masses of segments by other authors", "quoted from the literature: nothing is computed"],
    ["Figures 3.1 to 3.3; B.3; C.1; D.2", "the experimental setup", _DRAWING],
    ["Figure 3.4; B.1; C.2; D.1", "geometric definitions of the arm", _DRAWING + "; docs/conventions.md has the definitions used here"],
    ["Figure 3.8", "block diagram of the experiment", _DRAWING + "; armrs record simulates what it shows"],
    ["Figure 3.11; C.3", "the mechanical arm", _DRAWING],
    ["Figures 3.13 to 3.15", "block diagrams and scheme of the simulation", _DRAWING + "; armrs simulate is what they show"],
    ["Figure B.4", "programmed trajectories of elbow and shoulder", "the same as figure 3.9, which is recomputed"],
    ["Figure D.3", "the programmed elbow trajectory", "the same as figure 3.5, which is recomputed"],
]


def table() -> dict[str, Any]:
    """Return what is left out as the plain data of a table."""
    return {"head": ["in the thesis", "shows", "why it is left out"], "rows": _ROWS, "left": 3}
