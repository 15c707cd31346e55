"""Masses, centres of mass and inertias of a person's arm, from body mass, height, sex and measured lengths, as the literature has them.

Tables of de Leva (1996), J. Biomech. 29, and standard deviations by the regressions of Zatsiorsky and Seluyanov (1983, 1985).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from . import _armrs, checks
from .errors import BadInput, Text
from .model import Joint, Model, Segment, Subject

SEGMENTS = ("upper arm", "forearm", "hand")
JOINTS = ("shoulder", "elbow", "wrist")
UNCERTAINTY = 0.10
"""Relative standard deviation of masses, centres of mass and inertias from body mass and height: between people of one build, after de Leva
(1996) and Zatsiorsky and Seluyanov (1983)."""


@dataclass(frozen=True)
class Expected:
    """What the literature expects of one segment.

    Attributes
    ----------
    name : str
    length : float
        Measured, or scaled with height [m].
    mass, com, inertia : (float, float)
        Mean and standard deviation among people: [kg], from the proximal joint [m], about the centre of mass [kg m²].
    """

    name: str
    length: float
    mass: tuple[float, float]
    com: tuple[float, float]
    inertia: tuple[float, float]

    def segment(self) -> Segment:
        """Return the segment with the expected values."""
        return Segment(self.name, self.length, self.mass[0], self.com[0], self.inertia[0])


def segment_expectations(
    body_mass: float, height: float, sex: str, lengths: Sequence[float | None] = (None, None, None)
) -> tuple[Expected, ...]:
    """Return what the literature expects of upper arm, forearm and hand.

    Parameters
    ----------
    body_mass : float
        [kg]
    height : float
        [m]
    sex : {"male", "female"}
    lengths : sequence of (float or None)
        Measured lengths of one to three segments, proximal first [m]; None is scaled with height.

    Returns
    -------
    tuple of Expected
        One for each of `lengths`.

    Raises
    ------
    BadInput
        For values out of range.

    Notes
    -----
    Means: de Leva (1996), J. Biomech. 29, table 4. Standard deviations: regressions of Zatsiorsky and Seluyanov (1983, 1985).

    Examples
    --------
    >>> import armrs
    >>> round(armrs.segment_expectations(78.0, 1.80, "male", [0.322])[0].mass[0], 3)
    2.114
    """
    body_mass = checks.number("body_mass", body_mass, least=1.0, most=500.0, unit="kg")
    height = checks.number("height", height, least=0.3, most=3.0, unit="m", hint="centimetres?")
    checks.choice("sex", sex, ("male", "female"))
    check_lengths(lengths)
    return tuple(Expected(**item) for item in _armrs.literature(body_mass, height, sex, list(lengths)))


def check_lengths(lengths: Sequence[float | None]) -> None:
    """Refuse what are no lengths of one to three segments [m], None where one is scaled with height."""
    checks.instance("lengths", lengths, list, tuple)
    if not 1 <= len(lengths) <= len(SEGMENTS):
        raise BadInput("lengths", Text(f"{len(lengths)} lengths"), f"1 to {len(SEGMENTS)}: {', '.join(SEGMENTS)}")
    for k, length in enumerate(lengths, start=1):
        if length is not None:
            checks.number(f"lengths, {k}", length, above=0.0, most=1.0, unit="m", hint="centimetres or millimetres?")


def literature_model(subject: Subject, lengths: Sequence[float | None] | None = None) -> Model:
    """Return the arm of a person by de Leva's tables, its joints without laws.

    Parameters
    ----------
    subject : Subject
        Body mass, height and sex.
    lengths : sequence of (float or None), optional
        Of one to three segments [m], None scaled with height; `subject.lengths_m` when absent, or three that are scaled.

    Raises
    ------
    BadInput
        When values of the subject are missing.

    Examples
    --------
    >>> import armrs
    >>> armrs.anthropometry.literature_model(armrs.Subject(78.0, 1.80, "male", lengths_m=[0.322, 0.345])).n_joints
    2
    """
    lengths = list(lengths if lengths is not None else subject.lengths_m or [None] * len(SEGMENTS))
    segments, _ = literature_arm(subject, lengths)
    return Model(segments, tuple(Joint(name) for name in JOINTS[: len(segments)]), segment_uncertainty=UNCERTAINTY)


def literature_arm(subject: Subject, lengths: list[float | None]) -> tuple[tuple[Segment, ...], Sequence[Mapping[str, Any]]]:
    """Return the segments of a person by de Leva's tables, and the tables' values with their deviations.

    With two lengths the hand belongs to the forearm, which then reaches from elbow to handle.
    """
    missing = [name for name in ("body_mass", "height", "sex") if getattr(subject, name) is None]
    if missing:
        raise BadInput(f"[subject], {missing[0]}", Text("nothing"), "a value: the literature needs it")
    assert subject.body_mass is not None and subject.height is not None and subject.sex is not None
    check_lengths(lengths)
    parts = _armrs.literature(subject.body_mass, subject.height, subject.sex, [lengths[0], None, None] if len(lengths) == 2 else lengths)
    return tuple(segments_of(parts, lengths)), parts


def segments_of(parts: Sequence[Mapping[str, Any]], lengths: list[float | None]) -> list[Segment]:
    """Return segments from the tables' values; with two lengths, forearm and hand are one."""
    single = [Segment(p["name"], p["length"], p["mass"][0], p["com"][0], p["inertia"][0]) for p in parts]
    if len(lengths) != 2:
        return single
    upper, fore, hand = single
    mass = fore.mass + hand.mass
    at = fore.length + hand.com
    com = (fore.mass * fore.com + hand.mass * at) / mass
    inertia = fore.inertia + fore.mass * (fore.com - com) ** 2 + hand.inertia + hand.mass * (at - com) ** 2
    # The handle lies in the hand, about where its centre of mass is.
    length = lengths[1] if lengths[1] is not None else at
    return [upper, Segment("forearm and hand", length, mass, min(com, length), inertia)]
