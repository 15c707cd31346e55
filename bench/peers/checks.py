"""Whether all tools solve the same problem: each against armrs."""

from __future__ import annotations

from typing import Any

import numpy as np
import problem
from programs import Peer

KERNEL, TRAJECTORY, OPTIMUM = 1e-12, 1e-6, 1e-9
"""Allowed difference: of a kernel relative to its largest value, of a trajectory [rad], of a residual relative to the reference's."""
SAMPLES = str(problem.SIZES[2])


def run(peers: dict[str, Peer]) -> list[dict[str, Any]]:
    """Return every comparison with what was found and allowed."""
    rust = peers["armrs, Rust"]
    found = []

    def note(what: str, tool: str, difference: float, allowed: float) -> None:
        found.append({"what": what, "tool": tool, "found": difference, "allowed": allowed, "agrees": bool(difference <= allowed)})

    for task, what, allowed in (
        ("inverse_dynamics", "inverse dynamics, relative", KERNEL),
        ("forward_dynamics", "forward dynamics, relative", KERNEL),
        ("run", "angles of 20 s [rad]", TRAJECTORY),
        ("batch", "last angles of the batch [rad]", TRAJECTORY),
    ):
        reference = np.array(rust.ask(f"check:{task}"))
        for tool, peer in peers.items():
            answer = peer.ask(f"check:{task}") if peer is not rust else None
            if answer is not None:
                off = float(np.abs(np.array(answer) - reference).max())
                note(what, tool, off / float(np.abs(reference).max()) if allowed == KERNEL else off, allowed)
    euler, fourth = (np.array(rust.ask(task)) for task in ("check:run", "check:run:fourth"))
    # The scheme that all share has an error of its own, the same for all.
    note("semi-implicit Euler against fourth order, angles [rad]", "armrs, Rust", float(np.abs(euler - fourth).max()), 1.5e-6)
    note("a run of the batch has the bits of a single run (0: yes)", "armrs, Rust", 0.0 if rust.ask("check:bits") else 1.0, 0.0)
    own = rust.ask(f"check:cascade:{SAMPLES}")
    for solver in ("lsq_linear", "least_squares"):
        other = peers["SciPy"].ask(f"check:cascade:{solver}:{SAMPLES}") if "SciPy" in peers else None
        if other is not None:
            # The first joint to be solved is the same problem for all; the others start from its estimate.
            worse = (own["rms"][2] - other["rms"][2]) / other["rms"][2]
            note(f"residual of the wrist above that of {solver}, relative", "armrs, Rust", max(float(worse), 0.0), OPTIMUM)
            off = np.abs(np.array(own["first_moments"]) - other["first_moments"]).max() / np.abs(own["first_moments"]).max()
            note("base parameters, relative", f"SciPy {solver}", float(off), 1e-6)
    fits = {tool: peer.ask("fit") for tool, peer in peers.items()}
    fits = {tool: fit for tool, fit in fits.items() if fit is not None}
    best = min((fit["cost"] for fit in fits.values()), default=0.0)
    for tool, fit in fits.items():
        note("sum of squares of the fit by simulation above the best, relative", tool, fit["cost"] / best - 1.0, 1e-6)
    return found
