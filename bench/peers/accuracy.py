"""Time to accuracy: with which step or tolerance every angle of W2 or W3 at 50 Hz is right to 1e-6 rad."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from programs import Peer
from workloads import Measured

ALLOWED = 1e-6
"""Largest error of an angle in any joint, sample and run [rad]."""
AGREEMENT = 1e-10
"""Allowed difference of the two references [rad]: of the hand-written loop and of armrs."""
REFERENCE = "200"
"""Steps of the references from one sample to the next: 0.1 ms, fourth order."""


def references(peers: dict[str, Peer]) -> tuple[dict[str, np.ndarray], list[dict[str, Any]]]:
    """Return the right angles of each workload, by fourth order at a small step, and how well two programs agree on them."""
    found, checks = {}, []
    for prefix, method in (("", "rk4"), ("batch:", "rk4_avx2")):
        own = np.array(peers["armrs, Rust"].ask(f"check:{prefix}accurate:{REFERENCE}"))
        found[prefix] = own
        if "limit" in peers:
            off = float(np.abs(np.array(peers["limit"].ask(f"check:{prefix}accurate:{method}:{REFERENCE}")) - own).max())
            what = f"reference of the {'batch' if prefix else 'single run'}, fourth order at 0.1 ms [rad]"
            checks.append({"what": what, "tool": "limit", "found": off, "allowed": AGREEMENT, "agrees": off <= AGREEMENT})
    return found, checks


def choose(peers: dict[str, Peer], items: Iterable[Measured], right: dict[str, np.ndarray]) -> dict[str, dict[str, Any]]:
    """Return for every item with a ladder its largest rung that is right, with its error and that of the rung before.

    Where none is right, the last one is taken, with its error.
    """
    chosen: dict[str, dict[str, Any]] = {}
    for item in items:
        if not item.ladder or item.tool not in peers:
            continue
        before = None
        for rung in item.ladder:
            answer = peers[item.tool].ask(f"check:{item.task}:{rung}")
            if answer is None:
                break
            error = float(np.abs(np.array(answer) - right["batch:" if item.task.startswith("batch:") else ""]).max())
            chosen[item.key] = {"rung": rung, "error": error, "error_before": before}
            if error <= ALLOWED:
                break
            before = error
    return chosen
