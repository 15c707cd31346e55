"""The model of an arm and the description of a data set: the classes of the compiled core, which reads, checks and writes them.

Values are checked where they are made, so an object that exists is valid, wherever it came from. All are frozen, equal by value, hashable
and picklable; `.replace(...)` and `copy.replace` return another one with some attributes changed.
"""

from __future__ import annotations

from ._armrs import (
    AddedMass,
    Contact,
    Description,
    Effect,
    Joint,
    Model,
    Muscle,
    ParameterId,
    ParameterInfo,
    Robot,
    Segment,
    Subject,
    Tolerance,
    TrialEntry,
    load_model,
)

__all__ = [
    "AddedMass",
    "Contact",
    "Description",
    "Effect",
    "Joint",
    "Model",
    "Muscle",
    "ParameterId",
    "ParameterInfo",
    "Robot",
    "Segment",
    "Subject",
    "Tolerance",
    "TrialEntry",
    "load_model",
]
