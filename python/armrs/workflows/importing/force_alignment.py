"""Trials with their forces on the clock of the angles: by posture first, then by the equation of motion."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace as changed

import numpy as np

from ...errors import BadInput
from ...io.files import first_of
from ...model import Model
from . import clock_offset, conventions, file_roles, offset_search
from .raw_trial import LoadedTrial, angles_of, arrays, by, forces_of, values
from .recipe import Channel, Convention, RawTrial

_LIKELY = 6
"""Most conventions in which clocks are aligned."""
_CLEAR = 0.05
"""With less than this unexplained, clocks and convention are right [share of the contact torques]."""


def aligned(
    named: Sequence[file_roles.Named], channels: Sequence[Channel], model: Model, given: Mapping[str, object], problems: list[BadInput]
) -> list[LoadedTrial]:
    """Return trials with their forces near the clock of their angles: where the movement explains them best."""
    reads = []
    for n in named:
        trial = RawTrial(os.fspath(n.table.path), n.table.title, n.configuration, n.repeat, n.role)
        if n.forces is not None:
            trial = changed(trial, force_file=os.fspath(n.forces.path), force_table=n.forces.title, force_shift=0.0)
        reads.append(LoadedTrial(trial, n.table, n.forces))
    apart, matches = [k for k, read in enumerate(reads) if read.forces is not None], []
    for read in (reads[k] for k in apart):
        t, q = values(read.table, by(channels, "t")), angles_of(read, channels)
        clock_of_forces, own = forces_of(read, channels)
        within = clock_offset.NEAR if clock_offset.together(t, clock_of_forces) else np.inf
        matches.append(offset_search.Match.of(t, q, clock_of_forces, own, within))
        try:
            matches[-1].check()
        except BadInput as error:
            problems.append(error.within(file=read.trial.force_file))
    if problems or not apart:
        return reads
    for k, offsets in zip(apart, offset_search.together(matches), strict=True):
        tried = [changed(reads[k], trial=changed(reads[k].trial, force_shift=s), others=tuple(offsets)) for s in offsets]
        # What the posture of a single recording does not decide, the balance of the arm may.
        reads[k] = tried[0] if len(apart) > 1 or len(tried) == 1 else min(tried, key=lambda r: _unexplained(r, channels, model, given))
    return reads


def _unexplained(read: LoadedTrial, channels: Sequence[Channel], model: Model, given: Mapping[str, object]) -> float:
    """Return what a trial leaves unexplained in the convention that suits its clock best, after that was refined in it."""
    t, q, force = arrays(read, channels, model.n_joints)
    if force is None:
        return 1.0
    found = conventions.ranked(model, [(t, q, force)], given)[0]
    recording = _recording(read, channels, found.convention)
    nearer = changed(read, trial=changed(read.trial, force_shift=clock_offset.refine(model, [recording])[0]))
    t, q, force = arrays(nearer, channels, model.n_joints)
    return min(found.unexplained, conventions.ranked(model, [(t, q, force)], given)[0].unexplained) if force is not None else 1.0


def _recording(read: LoadedTrial, channels: Sequence[Channel], convention: Convention) -> clock_offset.Recording:
    """Return a trial as `clock` takes it."""
    t, q = values(read.table, by(channels, "t")), conventions.to_model_angles(angles_of(read, channels), convention)
    clock_of_forces, own = forces_of(read, channels)
    on_arm = own * (1.0 if convention.force_on == "arm" else -1.0)
    same = read.trial.force_file == read.trial.file
    return clock_offset.Recording(t, q, clock_of_forces, on_arm, read.trial.force_shift, same, read.others)


def settled(
    reads: Sequence[LoadedTrial], channels: Sequence[Channel], model: Model, given: Mapping[str, object], problems: list[BadInput]
) -> tuple[list[LoadedTrial], Convention, list[str], list[str]]:
    """Return trials on the clock of their angles, the convention in which the arm balances, remarks on clocks; doubts."""
    lines, doubts = list[str](), list[str]()
    apart = [k for k, read in enumerate(reads) if read.forces is not None]
    if apart and not problems:
        if len(apart) > 1:
            reads = _matched(reads, apart, channels, model, given)
        reads, lines, doubts = _refined(reads, channels, _decided(reads, channels, model, given, [], []), model)
    return list(reads), _decided(reads, channels, model, given, problems, doubts), lines, doubts


def _matched(
    reads: Sequence[LoadedTrial], apart: Sequence[int], channels: Sequence[Channel], model: Model, given: Mapping[str, object]
) -> list[LoadedTrial]:
    """Return trials near the clock of their angles in the likely convention that then leaves least unexplained.

    With wrong clocks, the arm may balance better in a wrong convention: so the clocks are found in each that is likely.
    """
    best, kept = np.inf, list(reads)
    for likely in conventions.ranked(model, _recorded(reads, channels, model), given)[:_LIKELY]:
        tried = list(reads)
        shifts = clock_offset.matched(model, [_recording(reads[k], channels, likely.convention) for k in apart])
        for k, offsets in zip(apart, shifts, strict=True):
            tried[k] = changed(reads[k], trial=changed(reads[k].trial, force_shift=offsets[0]), others=tuple(offsets))
        left = conventions.ranked(model, _recorded(tried, channels, model), given)[0].unexplained
        if left < best:
            best, kept = left, tried
        if best < _CLEAR:
            break
    return kept


def _refined(
    reads: Sequence[LoadedTrial], channels: Sequence[Channel], convention: Convention, model: Model
) -> tuple[list[LoadedTrial], list[str], list[str]]:
    """Return trials with their forces on the clock of the angles, by the equation of motion; remarks on it; doubts."""
    apart = [k for k, read in enumerate(reads) if read.forces is not None]
    recordings = [_recording(reads[k], channels, convention) for k in apart]
    found = dict(zip(apart, clock_offset.certain(model, recordings, clock_offset.refine(model, recordings)), strict=True))
    new = [r if k not in found else changed(r, trial=changed(r.trial, force_shift=found[k].seconds)) for k, r in enumerate(reads)]
    shifts, doubts = dict[str, list[str]](), dict[str, list[str]]()
    for k, shift in found.items():
        file = str(reads[k].trial.force_file)
        exactly = f" ± {shift.std:.3f} s" if np.isfinite(shift.std) else " (a delay and the friction of the joints look alike in it)"
        shifts.setdefault(f"{shift.seconds:+.3f} s{exactly}", []).append(file)
        if shift.others:
            rivals = " or ".join(f"{s:+.3f} s" for s in shift.others)
            why = "explain them about as well, as where a movement repeats itself; if one of these is right, write it into import.toml"
            said = f"forces shifted by {shift.seconds:+.3f} s, but {rivals} {why} (force_shift) and import that"
            doubts.setdefault(said, []).append(file)
    doubted = [f"{first_of(files)}: {said}" for said, files in doubts.items()]
    count = sum(map(len, doubts.values()))
    if 2 * count >= len(found) > count and len({shift.seconds for shift in found.values()}) > 1:
        doubted.append("the clocks of the other recordings were found together with these, and are in doubt as well")
    return new, [f"forces shifted by {', '.join(f'{by} ({first_of(files)})' for by, files in shifts.items())}"] if shifts else [], doubted


def _decided(
    reads: Sequence[LoadedTrial],
    channels: Sequence[Channel],
    model: Model,
    given: Mapping[str, object],
    problems: list[BadInput],
    doubts: list[str],
) -> Convention:
    """Return the convention in which the arm balances."""
    return conventions.decide(model, _recorded(reads, channels, model), given, problems, doubts)


def _recorded(reads: Sequence[LoadedTrial], channels: Sequence[Channel], model: Model) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    return [(t, q, f) for t, q, f in (arrays(read, channels, model.n_joints) for read in reads) if f is not None]
