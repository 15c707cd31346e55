"""Virtual patients stretched in two sessions: whether reflexes are recovered, changes between the sessions seen, and only those.

    python bench/virtual_patients.py [--patients 200] [--seed 61001] [--laboratory | --passive] [--json FILE]

Each patient of `bench/patients.py` (laws written there anew, tone that drifts from trial to trial, muscle activity) is drawn, and recorded
twice. In every second one the reflex' gain is a fifth larger or smaller in the second session. Both sessions go through `armrs spasticity`
and its history; what it calls changed is compared with the truth. With `--laboratory` it is the virtual laboratory of `armrs record` that
records them: an arm of two segments led by a controlled robot, with cameras, a force sensor, tone and EMG. Markers, the clock of the
cameras, the place of the shoulder and the compliance of the contact are wrong anew in each session. There the passive stiffness of the last
two of four patients changes too, and `armrs passive` is run as well; `--passive` runs that alone.

Exit status: 0 when every figure holds, 1 when one does not.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import tempfile
from pathlib import Path

import numpy as np

import armrs
import patients
from armrs.workflows import history

CHANGE = 1.2
"""Factor of the gain in the second session, or one over it."""
FEWEST = 8
"""Trials, of fifteen, that the safety monitor of the laboratory must let end."""
TRUE = {"gain": "gain", "threshold": "threshold", "latency": "latency", "viscosity": "viscosity", "torque": "dry"}
"""The patient's attribute of each quantity that a history keeps."""


def session(patient: patients.Patient, seed: int) -> armrs.Dataset:
    """Return a session whose laws the tests write themselves."""
    return patients.session(patient, seed, emg=True)


def pair(number: int, seed: int, kind: str, counts: dict[str, list[bool]]) -> None:
    """Record one patient twice and count what was found right."""
    draw = np.random.default_rng(seed)
    first, laboratory = patients.Patient.drawn(draw), kind != "dynamometer"
    factor = (1.0, CHANGE, 1.0, 1.0 / CHANGE)[number % 4]
    stiffer = (1.0, 1.0, CHANGE, 1.0 / CHANGE)[number % 4] if laboratory else 1.0
    second = dataclasses.replace(first, gain=factor * first.gain, stiffness=stiffer * first.stiffness)
    with tempfile.TemporaryDirectory() as folder:
        for visit, patient in enumerate((first, second)):
            data, date = (patients.recorded if laboratory else session)(patient, 2 * seed + visit), f"2026-0{visit + 1}-03"
            if kind != "passive":
                if laboratory and len(data.trials) < FEWEST:
                    # A strong reflex with a long latency and little viscosity oscillates by itself, as a clonus does.
                    print(f"patient {seed}: the safety monitor stopped all but {len(data.trials)} trials; not counted")
                    return
                found = armrs.spasticity(data)
                judge(found, patient, counts)
                courses = history.add(Path(folder) / "reflex.sqlite", found, date).courses
            if laboratory:
                passive = history.add(Path(folder) / "passive.sqlite", armrs.passive_moments(data), date).courses
    if laboratory:
        # In faster movements the reflex is in the moments. How far a joint was moved was chosen.
        slow = [c for c in passive if c.joint == 2 and "stretch 0" in c.name and not c.name.startswith("range")]
        said = {c.name.split(" ")[0] for c in slow if c.before.clear}
        if stiffer != 1.0:
            counts["change of the stiffness seen"].append("stiffness" in said)
        counts["no passive moment called changed that is not"].append(not said - ({"stiffness"} if stiffer != 1.0 else set()))
        stiffness = next(c for c in slow if c.name.startswith("stiffness"))
        error = stiffness.before.value - (second.stiffness - first.stiffness)
        counts["interval of the change of stiffness holds"].append(abs(error) <= 1.96 * stiffness.before.std)
    if kind == "passive":
        return
    called = {c.name for c in courses if c.before.clear and c.joint == max(c.joint or 0 for c in courses)}
    if factor != 1.0:
        counts["change of the gain seen"].append("gain" in called)
    else:
        counts["nothing called changed where nothing is"].append(not called)
    counts["nothing else called changed"].append(not called - {"gain"})


def judge(found: armrs.Spasticity, patient: patients.Patient, counts: dict[str, list[bool]]) -> None:
    """Compare the reflex of one session with the truth."""
    # The shoulder, which is held, is not tested.
    joint = max(j.joint for j in found.joints)
    seen = next(j.reflex for j in found.joints if j.joint == joint)
    estimates = {**(seen.parameters if seen.found else {}), "viscosity": seen.viscosity, "torque": seen.dry}
    counts["reflex found"].append("gain" in estimates)
    for name, attribute in TRUE.items():
        if name not in estimates:
            continue
        true, e = getattr(patient, attribute), estimates[name]
        if name in ("gain", "threshold"):
            counts[f"{name} within 10 %"].append(abs(e.value - true) <= 0.1 * true)
        if name == "latency":
            counts["latency within 5 ms"].append(abs(e.value - true) <= 5e-3)
        counts[f"interval of {attribute} holds"].append(e.interval[0] <= true <= e.interval[1])


def holds(name: str, share: float) -> bool:
    """Return whether a share is as it should be."""
    if name.startswith("interval"):
        return 0.9 <= share <= 0.98
    return share >= (0.95 if "called" in name else 0.9)


def main() -> int:
    """Run."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--patients", type=int, default=200)
    parser.add_argument("--seed", type=int, default=61001)
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--laboratory", dest="kind", action="store_const", const="laboratory", default="dynamometer")
    which.add_argument("--passive", dest="kind", action="store_const", const="passive")
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    names = []
    if options.kind != "passive":
        names += ["reflex found", "gain within 10 %", "threshold within 10 %", "latency within 5 ms"]
        names += [f"interval of {attribute} holds" for attribute in TRUE.values()]
        names += ["change of the gain seen", "nothing called changed where nothing is", "nothing else called changed"]
    if options.kind != "dynamometer":
        names += [
            "change of the stiffness seen",
            "no passive moment called changed that is not",
            "interval of the change of stiffness holds",
        ]
    counts: dict[str, list[bool]] = {name: [] for name in names}
    for number in range(options.patients):
        pair(number, options.seed + number, options.kind, counts)
    shares = {name: (sum(right), len(right)) for name, right in counts.items()}
    for name, (right, of) in shares.items():
        print(f"{name:45s} {right:4d} of {of:4d} = {right / max(of, 1):6.1%} {'' if of and holds(name, right / of) else '  short'}")
    if options.json:
        options.json.write_text(json.dumps(shares, indent=1) + "\n", encoding="utf-8")
    return 0 if all(of and holds(name, right / of) for name, (right, of) in shares.items()) else 1


if __name__ == "__main__":
    raise SystemExit(main())
