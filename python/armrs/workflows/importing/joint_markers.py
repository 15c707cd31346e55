"""Markers of the joints, by the names of common marker sets."""

from __future__ import annotations

import re
from collections.abc import Sequence

_SHOULDER = ("gh", "sho", "shoulder", "schulter", "acromion", "acr", "acro", "acrotip", "ac", "sae")
_ELBOW = (
    "elbl+elbm", "elbowl+elbowm", "elblat+elbmed", "elbowlat+elbowmed", "elbowlateral+elbowmedial", "el+em", "elb+elbm", "elb+mel",
    "elbo+elbi", "hle+hme", "lep+mep", "epicl+epicm", "humerusepicondyle", "ej", "elb", "elbow", "ellbogen",
)  # fmt: skip
_WRIST = (
    "wra+wrb", "wril+wrim", "wristl+wristm", "wrilat+wrimed", "wristlat+wristmed", "wristlateral+wristmedial", "wristradius+wristulna",
    "wrr+wru", "rs+us", "rsp+usp", "stylr+stylu", "radiusstyloid+ulnastyloid", "radiusstyloid", "wj", "wri", "wrist", "handgelenk",
)  # fmt: skip
_HANDLE = ("handle", "grip", "griff", "hand", "hm3", "mc3", "mcp3", "fin", "finger", "knuckle", "tip", "hm2", "mc2")
"""Names of markers without side, blanks and marks; `A+B` is the point half way. The first that is there is taken."""
_PLACES = {2: (_SHOULDER, _ELBOW, (*_HANDLE, *_WRIST)), 3: (_SHOULDER, _ELBOW, _WRIST, _HANDLE)}
"""Number of joints -> the points from the shoulder to the handle."""
_SIDES = (("right", "r"), ("left", "l"))


def guess(names: Sequence[str], n_joints: int) -> tuple[str, ...]:
    """Return the points from the shoulder to the handle as `--points` has them.

    Nothing is returned where a name is missing, where both arms have all of them, and for arms of other than two or three joints.
    """
    found = set()
    for side in _SIDES:
        known = {stem: name for name in reversed(names) for stem in _stems(name, side)}
        points = tuple(_first(known, choices) for choices in _PLACES.get(n_joints, ()))
        if points and all(points):
            found.add(points)
    return found.pop() if len(found) == 1 else ()


def _stems(name: str, side: Sequence[str]) -> set[str]:
    """Return a name in lower case without subject and marks, with and without a side."""
    plain = re.sub(r"[\W_]+", "", name.rpartition(":")[2].lower())
    return {plain, *(plain.removeprefix(word) for word in side), *(plain.removesuffix(word) for word in side)}


def _first(known: dict[str, str], choices: Sequence[str]) -> str:
    for choice in choices:
        parts = choice.split("+")
        if all(part in known for part in parts):
            return "+".join(known[part].rpartition(":")[2] for part in parts)
    return ""
