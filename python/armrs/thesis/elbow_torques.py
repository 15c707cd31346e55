"""Inertial, Coriolis, centrifugal and gravity torques of an elbow movement at four speeds (figure 3.7, appendix D)."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from .. import _armrs
from ..model import Joint, Model, Segment
from ..report import plotting
from ..report.figures import Drawn
from ..report.tables import Table
from ..workflows.experiment import THESIS_CONTACT
from ..workflows.movement import Movement
from ..workflows.simulate import Simulated, simulate
from . import shared_figures
from .report_item import Found, Group, Sheet
from .simulated_arms import RATE, TABLE_4_10, WORKING_ROBOT, WRIST, arm, transverse
from .virtual_sessions import SHOULDER_HELD, holding, subject_one

if TYPE_CHECKING:
    from matplotlib.figure import Figure

GROUP = Group("dynamics", "Slow and fast (3.2, D)")

SPEEDS = (0.25, 0.3, 0.65, 1.0)
"""[rad/s]"""
HAND_SPEEDS = (0.1, 0.125, 0.25, 0.375)
"""Speeds of the handle that section 2.2 of appendix D gives for them, in this order [m/s]."""
SHOULDER, ELBOW = -68.0, (25.0, 85.0)
"""The shoulder's angle is the thesis'; the elbow's range is chosen [deg]."""
REVERSAL = 1.2
"""Largest acceleration at the slowest speed, section 3.2 [rad/s²]; faster movements get as much more as they are faster."""
PRINTED = {"inertial": 0.2, "velocity": 0.001}
"""At the slowest speed, section 3.2 [N m]."""
JOINTS = tuple(shared_figures.JOINTS)
REPEATABILITY = (0.05, 0.1, 0.2)
"""Standard deviations of the angles over six trials, section 3 of appendix D [rad]."""
LENGTHS = (0.32, 0.25, 0.09)
"""Table 1 of appendix D with a2 + a3 = 0.34 m [m]."""
TRANSVERSE = transverse(LENGTHS)
"""Moments of inertia about the axis that turns, after de Leva, the hand with the handle [kg m²]."""


def subject(inertias: tuple[float, ...]) -> Model:
    """Return the arm of table 1 of appendix D with the moments of inertia given."""
    rows = zip(("upper arm", "forearm", "hand and handle"), LENGTHS, (2.09, 1.25, 0.75), (0.19, 0.12, 0.08), inertias, strict=True)
    joints = (Joint("shoulder"), Joint("elbow"), WRIST)
    return Model(tuple(Segment(*row) for row in rows), joints, robot=WORKING_ROBOT, contact=THESIS_CONTACT)


@functools.cache
def movement(speed: float, inertias: tuple[float, ...] = TRANSVERSE) -> Simulated:
    """Simulate the elbow from one end to the other and back."""
    path = np.radians([[SHOULDER, end, 0.0] for end in (ELBOW[0], ELBOW[1], ELBOW[0])])
    return simulate(subject(inertias), Movement(path, speed=speed, acceleration=REVERSAL * speed / SPEEDS[0], shape="smooth"), rate=RATE)


def parts(run: Simulated) -> dict[str, np.ndarray]:
    """Return the torques of the items of this part, each (n, 3) [N m]."""
    return {name: run.columns[f"torque.{name}"] for name in ("inertial", "centrifugal", "coriolis", "gravity")}


def _by_speed(columns: Mapping[str, Sequence[np.ndarray]]) -> Figure:
    """Draw quantities of the joints over time: a row for each speed, a column for each quantity, named with its unit."""
    figure = plotting.figure(10.4, 9.2)
    axes = figure.subplots(len(SPEEDS), len(columns), sharex="row")
    for column, (name, quantities) in zip(axes.T, columns.items(), strict=True):
        for ax, speed, values in zip(column, SPEEDS, quantities, strict=True):
            for j, (joint, colour) in enumerate(shared_figures.JOINTS.items()):
                ax.plot(movement(speed).t, values[:, j], plotting.DASHES[j], color=colour, label=joint, lw=1.3)
        column[0].set_title(name)
        column[-1].set_xlabel("time [s]")
    for ax, speed in zip(axes[:, 0], SPEEDS, strict=True):
        ax.set_ylabel(f"{speed:g} rad/s")
    shared_figures.legend(figure, axes[0, 0])
    return figure


@GROUP.item(
    "figures-D.4-D.5",
    "Figures 4 and 5 of appendix D: how repeatable the movement is, and its angles, speeds and accelerations",
    "appendix D, section 3",
    "Six trials at 0.25 rad/s, whose angles have standard deviations within 0.05 rad (shoulder), 0.1 rad (elbow) and 0.2 rad (wrist); "
    "angle, speed and acceleration at four speeds, differences of first order of angles that a Butterworth low-pass of 8 Hz has "
    "smoothed.",
)
def kinematics() -> Found:
    """Draw the spread of six trials, and the movement at four speeds."""
    found, name = subject_one(), holding("shoulder", SHOULDER_HELD[0])
    own = [trial for trial in found.dataset.trials if trial.configuration == name]
    q = np.array([trial.q for trial in own])
    spread = np.std(q, axis=0, ddof=1).max(axis=0)
    repeats = plotting.figure(9.4, 3.4)
    for j, (ax, (joint, colour)) in enumerate(zip(repeats.subplots(1, 3), shared_figures.JOINTS.items(), strict=True)):
        shared_figures.over_trials(ax, own[0].t, np.degrees(q[:, :, [j]]), {joint: colour})
        ax.set(title=joint, xlabel="time [s]", ylabel="angle [°]")
    runs = [movement(speed) for speed in SPEEDS]
    profiles = _by_speed(
        {
            "angle [°]": [np.degrees(run.q) for run in runs],
            "speed [rad/s]": [run.qd for run in runs],
            "acceleration [rad/s²]": [run.qdd for run in runs],
        }
    )
    rows = [[joint, f"{printed:g}", f"{ours:.4f}"] for joint, printed, ours in zip(JOINTS, REPEATABILITY, spread, strict=True)]
    still = [max(np.abs(run.qd[:, j]).max() for run in runs) for j in (0, 2)]
    return Found(
        ours=(
            f"Angles of six virtual trials have standard deviations up to {spread[0]:.3f}, {spread[1]:.3f} and {spread[2]:.3f} rad. "
            f"While the elbow moves, the shoulder turns at up to {still[0]:.2f} rad/s and the wrist at up to {still[1]:.2f} rad/s."
        ),
        why=(
            "A virtual robot repeats its path exactly and a virtual subject sits as before; only the tone of the muscles and the "
            "sensors differ between trials, so that angles scatter by a part of what the thesis measured. The six trials are those of "
            "figure 4.1, at 0.3 rad/s. Speeds and accelerations are those of the simulation and need no filter; the ripples after each "
            "start are the hand on the stiffness of the contact. The thesis calls its profiles trapezoidal; here their corners are "
            "rounded."
        ),
        values={f"angle_std_{joint}_rad": float(v) for joint, v in zip(JOINTS, spread, strict=True)},
        sheets=[Sheet("Largest standard deviations of the angles [rad]", Table(["joint", "printed, within", "ours"], rows))],
        figures=[
            Drawn("figure-D.4", "Figure 4 of appendix D: repeatability", "Means of six trials, bars of one standard deviation.", repeats),
            Drawn("figure-D.5", "Figure 5 of appendix D: the movement at four speeds", "Rows are speeds; scales differ.", profiles),
        ],
    )


@GROUP.item(
    "figure-3.7",
    "Figure 3.7 and figure 6 of appendix D: torques at four speeds",
    "section 3.2, appendix D",
    "At 0.25 rad/s inertial torques reach 0.2 N m and Coriolis torques 0.001 N m; gravity does not depend on the speed. The curves "
    "themselves are pictures without numbers.",
)
def at_four_speeds() -> Found:
    """Recompute figure 3.7."""
    runs = {speed: movement(speed) for speed in SPEEDS}
    rows, most = [], {}
    for speed, run in runs.items():
        torques = parts(run)
        velocity = torques["centrifugal"] + torques["coriolis"]
        for j, joint in enumerate(JOINTS):
            values = [np.abs(x[:, j]).max() for x in (torques["inertial"], torques["centrifugal"], torques["coriolis"], torques["gravity"])]
            rows.append([f"{speed:g} rad/s", joint, *(f"{v:.4f}" for v in values)])
        most[speed] = (np.abs(torques["inertial"]).max(), np.abs(velocity).max(), np.abs(velocity[:, 0]).max())
    slow, fast = most[SPEEDS[0]], most[SPEEDS[-1]]
    figure = _by_speed(
        {
            "inertial [N m]": [parts(run)["inertial"] for run in runs.values()],
            "centrifugal and Coriolis [N m]": [parts(run)["centrifugal"] + parts(run)["coriolis"] for run in runs.values()],
            "gravity [N m]": [parts(run)["gravity"] for run in runs.values()],
        }
    )
    return Found(
        ours=(
            f"At 0.25 rad/s inertial torques reach {slow[0]:.2f} N m, centrifugal and Coriolis torques together {slow[1]:.4f} N m. At 1 "
            f"rad/s it is {fast[0]:.2f} and {fast[1]:.3f} N m, beside {np.abs(parts(runs[1.0])['gravity']).max():.1f} N m of gravity."
        ),
        why=(
            f"The inertial torque is of the printed size. That of the velocities is {slow[1] / PRINTED['velocity']:.0f} times the "
            "printed one; both are negligible at this speed. The thesis calls the diagonal of C centrifugal and the rest Coriolis; it "
            "is the other way round, and with the elbow moving alone nearly all is centrifugal. It acts in the shoulder: appendix D "
            "says mostly in the elbow, where a speed of the elbow itself makes none. The elbow's range and the ramps are chosen, since "
            "they are not printed."
        ),
        values={
            f"{name}_most_at_{speed:g}_rad_s_Nm": float(value)
            for speed, (inertial, velocity, _) in most.items()
            for name, value in (("inertial", inertial), ("velocity", velocity))
        },
        sheets=[Sheet("Largest torques [N m]", Table(["speed", "joint", "inertial", "centrifugal", "Coriolis", "gravity"], rows, left=2))],
        figures=[
            Drawn(
                "figure-3.7",
                "Figure 3.7: torques at four speeds",
                "Rows are speeds, as in the thesis, where the second column shows Coriolis torques; scales differ.",
                figure,
            )
        ],
    )


@GROUP.item(
    "table-D.1",
    "Table 1 of appendix D: moments of inertia",
    "appendix D",
    "I1 = 0.005, I2 = 0.001, I3 = 0.006 kg m², called transversal and taken from Zatsiorsky.",
)
def inertias() -> Found:
    """Compare the printed moments of inertia with transverse ones."""
    printed = (0.005, 0.001, 0.006)
    rows = [
        [name, f"{p:.4f}", f"{t:.4f}", f"{p / t:.2f}"]
        for name, p, t in zip(("upper arm", "forearm", "hand and handle"), printed, TRANSVERSE, strict=True)
    ]
    changes = [np.abs(parts(movement(1.0, i))["inertial"]).max(axis=0) for i in (printed, TRANSVERSE)]
    effect = [[joint, f"{a:.3f}", f"{b:.3f}"] for joint, a, b in zip(JOINTS, *changes, strict=True)]
    return Found(
        ours=(
            f"Transverse moments of inertia after de Leva for 77 kg and these lengths: {TRANSVERSE[0]:.4f}, {TRANSVERSE[1]:.4f} and "
            f"{TRANSVERSE[2]:.4f} kg m², the last with the handle as a point."
        ),
        why=(
            "The first two that are printed are those about the long axes of the segments, about which nothing turns in the plane; the "
            "third is that of a forearm. With the elbow moving alone this hardly shows, since the forearm's and the hand's errors cancel "
            "at the elbow; in a movement of the shoulder it would."
        ),
        values={f"transverse_{k}_kgm2": value for k, value in enumerate(TRANSVERSE, 1)},
        sheets=[
            Sheet("Moments of inertia about the centre of mass [kg m²]", Table(["segment", "printed", "transverse", "ratio"], rows)),
            Sheet("Largest inertial torques at 1 rad/s [N m]", Table(["joint", "printed values", "transverse values"], effect)),
        ],
    )


@GROUP.item(
    "appendix-D-speeds",
    "Speeds of the handle and of the elbow",
    "appendix D, section 2.2",
    "v1 = 0.375, v2 = 0.25, v3 = 0.125, v4 = 0.1 m/s belong to about 1, 0.65, 0.3 and 0.25 rad/s of the elbow, with the hand on an arc of "
    "a2 + a3 = 0.34 m. Figures 4 to 6 number the speeds in the opposite order.",
    virtual=False,
)
def speeds() -> Found:
    """Compare printed speeds of the handle with those of the elbow."""
    radius = LENGTHS[1] + LENGTHS[2]
    rows = [[f"{v:g}", f"{w:g}", f"{v / radius:.2f}", f"{v / w:.3f}"] for v, w in zip(HAND_SPEEDS, SPEEDS, strict=True)]
    return Found(
        ours=f"On an arc of {radius:g} m those speeds of the hand turn the elbow at {', '.join(row[2] for row in rows)} rad/s.",
        why=(
            "The printed pairs ask for an arc of 0.375 to 0.417 m: the handle lies further from the elbow than a2 + a3 says, or a2 is too "
            "short (0.25 m here, 0.264 m in table 4.10 for the same subject)."
        ),
        sheets=[
            Sheet(
                "Speeds",
                Table(["hand [m/s]", "elbow, printed [rad/s]", "hand / 0.34 m [rad/s]", "arc that fits both [m]"], rows, left=0),
            )
        ],
    )


@GROUP.item(
    "equations-3.4-3.10",
    "Equations 3.4, 3.6, 3.10 and g2 of appendix B as printed",
    "section 3.1, appendices B and D",
    "B, C and Jᵀ of a planar arm of three segments, element by element.",
    virtual=False,
)
def printed_equations() -> Found:
    """Compute the size of the misprints of the equations of motion for the arm of table 4.10."""
    model = arm(TABLE_4_10)
    (a1, a2, _), (_, l2, l3), m3 = (s.length for s in TABLE_4_10), (s.com for s in TABLE_4_10), TABLE_4_10[2].mass
    q, qd, force = np.radians([-40.0, 50.0, 10.0]), np.array([0.2, 0.5, 0.3]), np.array([5.0, 10.0])
    chain = _armrs.Arm.from_model(model)
    b11, excess = chain.inertia(q)[0, 0], m3 * (l2**2 - l3**2)
    s3, s23 = np.sin(q[2]), np.sin(q[1] + q[2])
    last = l3 * m3 * np.array([a2 * s3 + a1 * s23, a2 * s3]) * (qd.sum() - q[0] * qd[2]) * qd[2]
    right = chain.coriolis(q, qd)
    right = right @ qd if right.ndim == 2 else right
    wrist = chain.static_torque(q, force)[2]
    rows = [
        ["3.4, b11 [kg m²]", "l2² where l3² belongs in the term of m3", f"{b11 + excess:.4f}", f"{b11:.4f}"],
        ["3.6, shoulder [N m]", "q1·q̇3 where q̇1+q̇2+q̇3 belongs", f"{right[0] + last[0]:.4f}", f"{right[0]:.4f}"],
        ["3.6, elbow [N m]", "the same", f"{right[1] + last[1]:.4f}", f"{right[1]:.4f}"],
        ["3.10, wrist, (5, 10) N [N m]", "signs of the third row", f"{-wrist:.3f}", f"{wrist:.3f}"],
        [
            "appendix B, g2 [N m]",
            "a2·m3 stands twice",
            f"{chain.gravity(q)[1] + a2 * 9.81 * m3 * np.cos(q[0] + q[1]):.2f}",
            f"{chain.gravity(q)[1]:.2f}",
        ],
    ]
    return Found(
        ours="The same quantities from a Lagrangian, at q = (−40, 50, 10)° and q̇ = (0.2, 0.5, 0.3) rad/s, with the arm of table 4.10.",
        why="Misprints. The functions of this package are derived, not transcribed; tests hold them against the corrected print.",
        values={"b11_excess_kgm2": excess, "wrist_torque_Nm": float(wrist)},
        sheets=[Sheet("As printed and right", Table(["equation", "what is wrong", "as printed", "right"], rows, left=2))],
    )
