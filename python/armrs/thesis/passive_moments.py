"""Passive moments of one subject (section 4.1.1): figures 3.10 and 4.1 to 4.10, tables 4.1 and 4.2."""

from __future__ import annotations

import numpy as np

from .. import _armrs
from ..analysis.passive_curve import PassiveCurve
from ..formatting import minus
from ..report import plotting
from ..report.figures import Drawn
from ..report.tables import Table
from . import shared_figures
from .report_item import Found, Group, Sheet
from .virtual_sessions import ELBOW_STD, SHOULDER_HELD, SHOULDER_STD, Session, configurations, holding, session, subject_one

GROUP = Group("passive", "Passive moments (4.1)")
JOINTS = tuple(shared_figures.JOINTS)


def curve_of(found: Session, name: str, joint: int) -> PassiveCurve:
    """Return the curve of one joint in one configuration."""
    return next(c for c in found.moments.curves if c.configuration == name and c.joint == joint)


def hidden(found: Session, name: str, joint: int, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the elastic and dissipative moments that were simulated in the first trial, at the angles given [N m]."""
    run, j = found.runs[name], joint - 1
    total = run.columns["torque.resisting"][:, j]
    ways = []
    for own in (run.qd[:, j] > 0.05, run.qd[:, j] < -0.05):
        order = np.argsort(run.q[own, j])
        ways.append(np.interp(angle, run.q[own, j][order], total[own][order]))
    return 0.5 * (ways[0] + ways[1]), 0.5 * (ways[0] - ways[1])


@GROUP.item(
    "figure-3.10",
    "Figure 3.10 and figure 8 of appendix B: the hysteresis of the elbow",
    "section 3.4.1",
    "A loop against the elbow's angle with the shoulder at −68°; the upper branch belongs to flexion, the mean of both is the elastic "
    "moment. The curve rises with the angle, “at small angles sometimes a descending one”.",
)
def hysteresis() -> Found:
    """Recompute figure 3.10 from one trial."""
    found, name = subject_one(), holding("shoulder", SHOULDER_HELD[0])
    first = next(m for m in found.moments.trials if m.trial.configuration == name)
    curve = curve_of(found, name, 2)
    elastic, half = hidden(found, name, 2, curve.angle)
    ours, width = curve.elastic_repeats[0], curve.half_width_repeats[0]
    there = np.isfinite(ours)
    figure = plotting.figure(9.4, 4.0)
    left, right = figure.subplots(1, 2, width_ratios=(1.5, 1.0))
    left.plot(np.degrees(first.q[:, 1]), first.moment[:, 1], color=plotting.BLUE, label="passive moment")
    left.plot(np.degrees(curve.angle), ours, "--", color=plotting.INK, label="elastic moment")
    left.plot(np.degrees(curve.angle), elastic, color=plotting.GREEN, lw=1.0, label="elastic moment as simulated")
    at = len(first.q) // 4
    left.annotate(
        "", (np.degrees(first.q[at + 12, 1]), first.moment[at + 12, 1]), (np.degrees(first.q[at, 1]), first.moment[at, 1]),
        arrowprops={"arrowstyle": "-|>", "color": plotting.BLUE, "lw": 2},
    )  # fmt: skip
    left.set(xlabel="elbow [°]", ylabel="passive moment of the elbow [N m]")
    figure.legend(*left.get_legend_handles_labels(), loc="outside upper left", ncols=3)
    shared_figures.stick(right, found.runs[name].model, found.runs[name].q[: len(found.runs[name].q) // 2])
    gravity = _armrs.Arm.from_model(found.runs[name].model).gravity(found.runs[name].q[[0, len(first.q) // 2]])[:, 1]
    tilt = -0.1 * float(gravity[1] - gravity[0])
    error = float(np.sqrt(np.mean((ours - elastic)[there] ** 2)))
    return Found(
        ours=(
            f"The same loop, rising with the angle. Half its width is {np.nanmean(width):.3f} N m, where {np.mean(half[there]):.3f} N m of "
            f"friction were simulated; the elastic moment is within {error:.3f} N m (rms) of what was simulated, this trial's tone "
            "included."
        ),
        why=(
            "The method works as described. Nothing descends here, since the virtual elbow has no such part and its masses are exact. "
            f"Masses that are 10 % too large would tilt the loop by {minus(f'{tilt:.2f}')} N m over its range: enough to make the flat "
            "part of a soft elbow descend, as the thesis suspects."
        ),
        values={
            "half_width_Nm": float(np.nanmean(width)),
            "half_width_simulated_Nm": float(np.mean(half[there])),
            "elastic_rms_error_Nm": error,
        },
        figures=[
            Drawn(
                "figure-3.10",
                "Figure 3.10: hysteresis of the elbow",
                "One trial; the arrow is the direction of motion. Samples near the reversals are rounded by the low-pass. Right, the "
                "movement.",
                figure,
            )
        ],
    )


@GROUP.item(
    "figures-4.1-4.5",
    "Figures 4.1 to 4.5 and figure 5 of appendix B: contact forces and angles of ten configurations",
    "section 4.1.1",
    "Averages of six trials with bars of their standard deviations; forces scatter more than angles, M_x is almost zero because of the "
    "bearing.",
)
def forces_and_angles() -> Found:
    """Draw means and deviations over trials of forces and angles."""
    found = subject_one()
    rows, figures, most = [], [], []
    for number, (pair, title) in enumerate(_pairs(), start=1):
        figure = plotting.figure(9.4, 7.4)
        axes = figure.subplots(3, 2, height_ratios=(1.0, 1.0, 0.9))
        for (top, middle, bottom), name in zip(axes.T, pair, strict=True):
            own = [t for t in found.dataset.trials if t.configuration == name]
            t = own[0].t
            force = -np.array([trial.force_on_arm for trial in own])
            q = np.degrees([trial.q for trial in own])
            shared_figures.over_trials(top, t, force, shared_figures.FORCES)
            shared_figures.over_trials(middle, t, q, shared_figures.JOINTS)
            top.set(title=name + "°", ylabel="force on the robot [N]", xlabel="time [s]")
            middle.set(ylabel="angle [°]", xlabel="time [s]")
            shared_figures.stick(bottom, found.runs[name].model, found.runs[name].q[: len(q[0]) // 2])
            deviations = [np.std(x, axis=0, ddof=1).max(axis=0) for x in (force, q)]
            most.append([x.max() for x in deviations])
            rows.append([name + "°", *(f"{v:.2f}" for v in (*deviations[0], *deviations[1]))])
        shared_figures.legend(figure, axes[0, 0], axes[1, 0])
        figures.append(
            Drawn(f"figure-4.{number}", f"Figure 4.{number}: {title}", "Bars are one standard deviation over six trials.", figure)
        )
    head = ["configuration", "F_y [N]", "F_z [N]", "shoulder [°]", "elbow [°]", "wrist [°]"]
    return Found(
        ours=(
            f"The same pictures of a virtual subject. Standard deviations of forces reach {min(f for f, _ in most):.0f} to "
            f"{max(f for f, _ in most):.0f} N, those of angles {min(q for _, q in most):.1f} to {max(q for _, q in most):.1f}°."
        ),
        why=(
            "What differs between trials is the tone of the muscles, drawn so that it is as large as tables 4.1 and 4.2 say, while the "
            "robot repeats its path. A force that points nearly through the shoulder has to be large to bear a tone there: it scatters "
            "most where the arm is stretched. Shapes follow from weight and path; sizes depend on the chosen subject. M_x is not "
            "simulated: the handle turns freely."
        ),
        sheets=[Sheet("Largest standard deviations over six trials", Table(head, rows))],
        figures=figures,
    )


def _pairs() -> list[tuple[tuple[str, str], str]]:
    """Return the configurations of each figure, the elbow's movement first, and their title."""
    names = [name for name, *_ in configurations()]
    return [((a, b), f"{a}°, {b}°") for a, b in zip(names[::2], names[1::2], strict=True)]


@GROUP.item(
    "figures-4.6-4.10",
    "Figures 4.6 to 4.10 and figure 6 of appendix B: passive moments over time",
    "section 4.1.1",
    "Averages of six trials with bars; deviations are largest for the shoulder and smallest for the wrist.",
)
def over_time() -> Found:
    """Draw means and deviations over trials of the passive moments."""
    found = subject_one()
    rows, figures, most = [], [], list[np.ndarray]()
    for number, (pair, title) in enumerate(_pairs(), start=6):
        figure = plotting.figure(9.4, 3.8)
        axes = figure.subplots(1, 2)
        for ax, name in zip(axes, pair, strict=True):
            own = [m for m in found.moments.trials if m.trial.configuration == name]
            values = np.array([m.moment for m in own])
            shared_figures.over_trials(ax, own[0].trial.t, values, shared_figures.JOINTS)
            ax.set(title=name + "°", xlabel="time [s]", ylabel="passive moment [N m]")
            deviation = np.nanstd(values, axis=0, ddof=1).max(axis=0)
            most.append(deviation)
            rows.append([name + "°", *(f"{v:.2f}" for v in deviation)])
        shared_figures.legend(figure, axes[0])
        figures.append(
            Drawn(f"figure-4.{number}", f"Figure 4.{number}: {title}", "Bars are one standard deviation over six trials.", figure)
        )
    return Found(
        ours=(
            f"The joint that moves scatters most, the shoulder by up to {max(m[0] for m in most):.1f} N m and the elbow by up to "
            f"{max(m[1] for m in most):.1f} N m, since that is where the tone was put; the wrist by at most "
            f"{max(m[2] for m in most):.1f} N m."
        ),
        why=(
            "The thesis puts larger deviations at the shoulder down to the number of multiplications in Jᵀ F. It is the lever arm: a "
            "newton at the hand is half a newton metre at the shoulder and a tenth of one at the wrist."
        ),
        sheets=[Sheet("Largest standard deviations over six trials [N m]", Table(["configuration", *JOINTS], rows))],
        figures=figures,
    )


@GROUP.item(
    "tables-4.1-4.2",
    "Tables 4.1 and 4.2 and tables 1 and 2 of appendix B: the scatter of trials",
    "section 4.1.1",
    "Largest standard deviation over six trials, elbow 0.7, 1.1, 1.0, 0.4, 1.1 N m; shoulder 4.4, 3.6, 2.7, 3.0, 2.2 N m. Put down to the "
    "scatter of the contact force.",
)
def scatter() -> Found:
    """Compare the printed scatter with what sensors and calibration can explain."""
    with_tone, without = subject_one(), session(1, tone=False)
    rows, most = [], 0.0
    for (name, joint, *_), printed in zip(_ordered(), (*ELBOW_STD, *SHOULDER_STD), strict=True):
        values = [_largest(found, name, joint) for found in (with_tone, without)]
        curve = curve_of(with_tone, name, joint)
        systematic = float(np.nanmax(curve.elastic_systematic))
        most = max(most, values[1] / printed)
        rows.append([name + "°", JOINTS[joint - 1], f"{printed:.1f}", f"{values[0]:.2f}", f"{values[1]:.3f}", f"{systematic:.2f}"])
    head = ["configuration", "joint", "printed", "with tone", "sensors alone", "from masses, lengths, calibration"]
    return Found(
        ours=(
            "With a tone drawn at the printed size the deviations of six trials come out alike, within the chance of six draws. The noise "
            f"of force sensor and cameras alone makes at most {100 * most:.0f} % of what is printed."
        ),
        why=(
            "The printed scatter is not that of the sensors: 0.2 N and 0.1° make about a tenth of a newton metre. Nor does a wrong mass or "
            "length show in it, since it is the same in every trial; the last column says how much such errors, promised as 5 % of mass "
            "and centre of mass, 2 mm, 0.3°, 0.2 N and 1 %, would shift all trials together. What is left is what differed between days: "
            "tone, seat and grip. Appendix B prints the same deviations for other angles of the elbow (20 to 59°). The caption of table "
            "4.2 says shoulder where it means elbow."
        ),
        values={"sensors_alone_most_share": float(most)},
        sheets=[Sheet("Largest standard deviations [N m]", Table(head, rows, left=2))],
    )


def _ordered() -> list[tuple[str, int]]:
    return [(name, joint) for joint in (2, 1) for name, moved, *_ in configurations() if moved == joint]


def _largest(found: Session, name: str, joint: int) -> float:
    values = np.array([m.moment[:, joint - 1] for m in found.moments.trials if m.trial.configuration == name])
    return float(np.nanstd(values, axis=0, ddof=1).max())
