"""Check a plan by repetition: predicted standard deviations beside the scatter of what is identified.

    python scripts/check_plan.py [repetitions] [evaluations] [segments] [first seed]

Each repetition draws the believed masses, centres of mass and inertias and the calibration from what is promised of them, simulates the
planned trials with noise, and identifies. Shared by tests/test_plan.py.

With three segments the hand hangs between wrist and handle and moves by half a degree: springs, friction and inertia of the wrist are read
from little, and what they change of the motion counts (`arm_ident::regression::sensitivity`).
"""

from __future__ import annotations

import sys

import numpy as np

import armrs
from armrs import Dataset, Effect, Joint, Model, Movement, Segment, Sensors, Tolerance, Trial
from armrs.demo import true_model
from armrs.workflows.plan import Instruments, Limits, Plan, forecast, plan

TOLERANCE = Tolerance(handle_placement_m=0.0)
"""Where the handle is held is not drawn, and so not promised either."""
UNCERTAINTY = 0.1
RECORDED = 1000.0
"""Samples a second of which the sensors read 50 [Hz]: what a delayed channel reads lies between samples."""
THESIS = Movement(np.radians([[-60.0, 50.0], [-48.6, 61.5], [-60.0, 50.0]]), speed=0.2, acceleration=0.6)
"""The composite movement of thesis figure 3.12: 11.4° and 11.5°."""
LIMITS = Limits(((-1.4, -0.17), (0.35, 1.92)), speed=2.5, acceleration=10.0)
THREE_THESIS = Movement(np.radians([[-60.0, 60.0, 0.0], [-48.0, 63.4, 1.8], [-60.0, 60.0, 0.0]]), speed=0.2, acceleration=0.6)
"""The same of the human arm: 12°, 3.4° and 1.8°."""
THREE_LIMITS = Limits(((-1.4, -0.17), (0.35, 1.92), (-0.2, 0.2)), speed=2.5, acceleration=10.0)


def truth(segments: int = 2) -> Model:
    """Return an arm with friction and some viscosity, in the fitted effects of which nothing is at a bound.

    Two segments are the mechanical arm with its brakes, three the human arm of table 4.10 with the hand strapped to the handle.
    """
    if segments == 3:
        from armrs.thesis.simulated_arms import TABLE_4_10, WORKING_ROBOT

        joints = (
            Joint("shoulder", viscosity=0.20, coulomb=0.20),
            Joint("elbow", viscosity=0.15, coulomb=0.15),
            Joint("wrist", viscosity=0.10, coulomb=0.05, stiffness=12.0),
        )
        contact = true_model().contact
        return Model(TABLE_4_10, joints, segment_uncertainty=UNCERTAINTY, robot=WORKING_ROBOT, contact=contact)
    arm = true_model()
    joints = tuple(Joint(j.name, viscosity=v, coulomb=j.coulomb) for j, v in zip(arm.joints, (0.10, 0.06), strict=True))
    return arm.replace(joints=joints, segment_uncertainty=UNCERTAINTY)


def repetition(arm: Model, planned: Plan, seed: int) -> dict[tuple[str, int | None], float]:
    """Return the estimates of one repetition by name and joint, relative to the truth by difference."""
    draw = np.random.default_rng(seed)
    faults = [
        *(
            Effect("angle_offset", j, parameters={"offset": np.radians(TOLERANCE.angle_offset_deg) * draw.standard_normal()})
            for j in range(1, arm.n_joints + 1)
        ),
        *(Effect("force_bias", channel=c, parameters={"bias": TOLERANCE.force_bias_N * draw.standard_normal()}) for c in ("Fy", "Fz")),
        *(Effect("force_gain", channel=c, parameters={"gain": TOLERANCE.force_gain * draw.standard_normal()}) for c in ("Fy", "Fz")),
        Effect("time_delay", parameters={"delay": TOLERANCE.time_delay_s * draw.standard_normal()}),
    ]
    measured = arm.replace(effects=(*arm.effects, *faults))
    trials = []
    for number, movement in enumerate(planned.movements):
        seeds = range(1000 * seed + 100 * number, 1000 * seed + 100 * number + planned.repeats)
        run = armrs.simulate(measured, movement, rate=RECORDED, sensors=Sensors.realistic(), seeds=seeds)
        for k, read in enumerate(run.readings, 1):
            name = f"planned {number}"
            trials.append(Trial(f"{name} {k}.csv", name, k, "fit", read.time, read.q, read.force_on_arm, None, read.robot_q))
    # Given values as far from the truth as the standard deviations of the model allow, moment by moment as in identification.
    segments = []
    for s in arm.segments:
        a, b, c = draw.standard_normal(3)
        mass = s.mass * (1 + UNCERTAINTY * a)
        com = s.mass * s.com * (1 + np.sqrt(2.0) * UNCERTAINTY * b) / mass
        about = (s.inertia + s.mass * s.com**2) * (1 + 2.0 * UNCERTAINTY * c)
        segments.append(Segment(s.name, s.length, mass, min(com, s.length), max(about - mass * com**2, 1e-5)))
    joints = tuple(Joint(j.name, viscosity=0.01, coulomb=0.01, stiffness=0.9 * j.stiffness) for j in arm.joints)
    believed = arm.replace(segments=tuple(segments), joints=joints)
    found = armrs.identify(Dataset("planned", believed, tuple(trials), "robot", tolerance=TOLERANCE, synthetic=True))
    listed = [*found.combinations, *(p for p in found.parameters if p.kind not in ("segment", "combination"))]
    return {(e.name, e.joint if e.kind not in ("segment", "combination") else None): e.value for e in listed}


def compare(
    repetitions: int, evaluations: int, segments: int = 2, first: int = 1
) -> tuple[Plan, Plan, list[tuple[str, float, float, float, float]]]:
    """Return plan, thesis' movement, and for each parameter name, value, predicted and found standard deviation, and bias."""
    arm = truth(segments)
    limits, movement = (THREE_LIMITS, THREE_THESIS) if segments == 3 else (LIMITS, THESIS)
    instruments = Instruments(tolerance=TOLERANCE)
    planned = plan(arm, limits, evaluations=evaluations, instruments=instruments)
    thesis = forecast(arm, [movement], repeats=10, instruments=instruments)
    found = [repetition(arm, planned, seed) for seed in range(first, first + repetitions)]
    rows = []
    for p in planned.predictions:
        values = np.array([f[(p.name, p.joint)] for f in found])
        name = p.name if p.joint is None else f"{p.kind} {p.joint}"
        rows.append((name, p.value, p.std, float(values.std(ddof=1)), float(values.mean() - p.value)))
    return planned, thesis, rows


def main() -> None:
    """Print the comparison."""
    given = [int(a) for a in sys.argv[1:]]
    repetitions, evaluations, segments, first = (*given, *(200, 300, 2, 1)[len(given) :])
    planned, thesis, rows = compare(repetitions, evaluations, segments, first)
    for name, p in (("thesis", thesis), ("plan", planned)):
        print(f"{name}: worst relative deviation {p.worst:.4f} in {p.duration:.0f} s")
    for name, value, predicted, scatter, bias in rows:
        print(
            f"{name:28} {value:8.4f}  predicted {predicted:.5f}  scatter {scatter:.5f}  ratio {scatter / predicted:.2f}  bias {bias:+.5f}"
        )


if __name__ == "__main__":
    main()
