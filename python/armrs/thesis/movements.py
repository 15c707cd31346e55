"""Trajectories of sections 3.4 and 3.5, and the bodies of equations 3.14 and 3.20."""

from __future__ import annotations

import numpy as np

from .. import _armrs
from ..analysis.passivity_checks import muscles_silent
from ..io.trial import Trial
from ..report import plotting
from ..report.figures import Drawn
from ..report.stick_figures import points
from ..report.tables import Table
from ..workflows.record import muscle_activity
from ..workflows.simulate import Simulated
from . import shared_figures
from .report_item import Found, Group, Sheet
from .simulated_arms import HANDLE, ORTHOSIS, SUBJECT_ONE, TABLE_4_10, arm, mechanical
from .simulation_comparison import HUMAN_PATH, MECHANICAL_PATH
from .virtual_sessions import ELBOW_HELD, SEED, SHOULDER_HELD, holding, subject_one

GROUP = Group("movements", "Movements (3.1, 3.4, 3.5)")


@GROUP.item(
    "figure-3.9",
    "Figure 3.9: movements of elbow and shoulder",
    "section 3.4.1",
    "The elbow from one end of its range to the other and back with the shoulder held at −68, −40, −16, −10 or −36°; the shoulder with the "
    "elbow held at 27, 40, 50, 60 or 70° by an orthosis. Curves without numbers.",
)
def movements() -> Found:
    """Draw both kinds of movement."""
    session = subject_one()
    figure = plotting.figure(9.4, 5.6)
    axes = figure.subplots(2, 2)
    for (above, below), name in zip(axes.T, (holding("shoulder", SHOULDER_HELD[0]), holding("elbow", ELBOW_HELD[0])), strict=True):
        run = session.runs[name]
        for j, (joint, colour) in enumerate(shared_figures.JOINTS.items()):
            above.plot(run.t, np.degrees(run.q[:, j]), plotting.DASHES[j], color=colour, label=joint)
        above.set(title=name + "°", xlabel="time [s]", ylabel="angle [°]")
        shared_figures.stick(below, run.model, run.q[: len(run.q) // 2 + 1])
    shared_figures.legend(figure, axes[0, 0])
    drift = max(np.ptp(np.degrees(session.runs[holding("shoulder", held)].q[:, 0])) for held in SHOULDER_HELD)
    wrist = max(np.abs(np.degrees(run.q[:, 2])).max() for run in session.runs.values())
    rows = [
        ["main text, section 3.4.2", "−68, −40, −16, −10, −36", "27, 40, 50, 60, 70"],
        ["figures 4.1 to 4.5, tables 4.1, 4.2", "−68, −40, −16, 10, 36", "27, 40, 50, 60, 70"],
        ["appendix B, text", "−68, −40, +16, +10, +36", "20, 30, 41, 49, 59"],
        ["appendix B, tables", "−69, −40, −16, 10, 35", "20, 30, 40, 49, 59"],
    ]
    return Found(
        ours=(
            f"The same movements, led by a robot along the path for the angles wanted. The shoulder then stays within {drift:.1f}° and the "
            f"wrist within {wrist:.1f}° of neutral: “a few degrees”, as the thesis says, with a strap of 12 N m/rad."
        ),
        why=(
            "Four lists of the fixation angles are printed, and no two agree. Those of figures 4.1 to 4.5 are used here. The range of the "
            "moving joint is not printed: 25 to 85° for the elbow and −65 to −15° for the shoulder are chosen, where a robot reaches."
        ),
        values={"shoulder_drift_deg": float(drift), "wrist_most_deg": float(wrist)},
        sheets=[Sheet("Fixation angles as printed", Table(["where", "shoulder [°]", "elbow [°]"], rows))],
        figures=[
            Drawn(
                "figure-3.9",
                "Figure 3.9: movements",
                "Left the elbow moves, right the shoulder. Below, the arm at six instants on the way there; the first is drawn in full.",
                figure,
            )
        ],
    )


@GROUP.item(
    "figures-3.5-3.6",
    "Figures 3.5 and 3.6 and figure 2 of appendix B: silent muscles while a robot leads the arm",
    "section 3.2, appendix B",
    "The elbow's movement, and surface EMG of biceps (long and short head), triceps and brachioradialis in one voluntary flexion and one "
    "movement led by the robot: “practically no EMG activity”. Signals without numbers, recorded once.",
)
def muscles() -> Found:
    """Let electrodes read an arm that is led, and the same movement made by its own muscles."""
    run = subject_one().runs[holding("shoulder", SHOULDER_HELD[0])]
    acceleration = np.gradient(run.qd, run.t, axis=0)
    needed = _armrs.Arm.from_model(run.model).inverse_dynamics(run.q, run.qd, acceleration) + run.columns["torque.resisting"]
    draw = np.random.default_rng([SEED, 36])
    ways = {"voluntary movement": muscle_activity(needed, draw), "led by the robot": muscle_activity(np.zeros_like(needed), draw)}
    names = [f"emg_{joint}_{side}_uV" for joint in ("elbow", "shoulder") for side in ("flexor", "extensor")]
    path = plotting.figure(9.4, 3.0)
    left, right = path.subplots(1, 2, width_ratios=(1.5, 1.0))
    left.plot(run.t, np.degrees(run.q[:, 1]), color=plotting.ORANGE)
    left.set(xlabel="time [s]", ylabel="elbow [°]")
    shared_figures.stick(right, run.model, run.q[: len(run.q) // 2 + 1])
    figure = plotting.figure(9.4, 6.8)
    axes = figure.subplots(4, 2, sharex=True, sharey="row")
    for column, (way, columns) in zip(axes.T, ways.items(), strict=True):
        column[0].set_title(way)
        column[-1].set_xlabel("time [s]")
        for ax, name in zip(column, names, strict=True):
            ax.plot(run.t, columns[name], color=plotting.BLUE, lw=0.8)
    for ax, name in zip(axes[:, 0], names, strict=True):
        _, joint, side, _ = name.split("_")
        ax.set_ylabel(f"{side},\n{joint} [µV]")
        ax.set_ylim(bottom=0.0)
    mean = {way: [float(np.mean(columns[name])) for name in names] for way, columns in ways.items()}
    rows = [
        [f"{side} of the {joint}", *(f"{mean[way][k]:.1f}" for way in ways)]
        for k, (joint, side) in enumerate(name.split("_")[1:3] for name in names)
    ]
    led = muscles_silent([_with_activity(run, ways["led by the robot"])])
    return Found(
        ours=(
            f"A virtual recording: the elbow's flexor has {mean['voluntary movement'][0]:.0f} µV on average where it bears forearm and "
            f"hand itself, and {mean['led by the robot'][0]:.1f} µV, its rest, where the robot does. The check of `armrs passive` says of "
            f"the movement that is led: “{led.text}”"
        ),
        why=(
            "The figures cannot be recomputed: no signals are printed, and EMG says nothing of mechanics by itself. What is drawn is the "
            "virtual laboratory's amplitude, 3 µV at rest and 20 µV for each newton metre, both chosen, of one flexor and one extensor of "
            "each joint: a model of a joint does not know the two heads of the biceps apart. The virtual muscles of the arm that is led "
            "are silent because they were made so; whether a subject's are has to be measured. The thesis measured it once."
        ),
        values={f"{way.split()[0]}_uV": dict(zip(names, values, strict=True)) for way, values in mean.items()},
        sheets=[Sheet("Mean activity [µV]", Table(["muscle", *ways], rows))],
        figures=[
            Drawn(
                "figure-3.5",
                "Figure 3.5: the movement",
                "The elbow is led from one end to the other and back; right, the arm on the way there.",
                path,
            ),
            Drawn("figure-3.6", "Figure 3.6: muscle activity", "Left the arm moves itself, right the robot leads it.", figure),
        ],
    )


def _with_activity(run: Simulated, emg: dict[str, np.ndarray]) -> Trial:
    return Trial("the movement", "led", 1, "fit", run.t, run.q, run.force_on_arm, emg=emg)


@GROUP.item(
    "figure-3.12",
    "Figure 3.12 and figure 5 of appendix C: the small movements of the identification",
    "section 3.5.2",
    "Composite photographs: the mechanical arm turns by 11.4 and 11.5°, the human arm by 12, 3.4 and 1.8°.",
)
def small_movements() -> Found:
    """Draw both movements and return what they can show."""
    figure = plotting.figure(9.4, 3.6)
    rows: list[list[str | None]] = []
    for ax, model, path, title in zip(
        figure.subplots(1, 2),
        (mechanical(False), arm(TABLE_4_10)),
        (MECHANICAL_PATH, HUMAN_PATH),
        ("mechanical arm", "human arm"),
        strict=True,
    ):
        q = np.linspace(path.waypoints[0], path.waypoints[1], 50)
        shared_figures.stick(ax, model, q, title=title)
        hand = points(model, q)[:, -1]
        for j, (joint, ends) in enumerate(zip(model.joints, np.cumsum(path.waypoints[:2], axis=1).T, strict=True)):
            low, high = sorted(ends)
            theta = np.linspace(low, high, 200)
            columns = np.column_stack([np.cos(theta), np.ones_like(theta)])
            condition = np.linalg.cond(columns / np.linalg.norm(columns, axis=0))
            rows.append(
                [title, joint.name, f"{np.degrees(np.ptp(path.waypoints[:, j])):.1f}", f"{np.degrees(high - low):.1f}", f"{condition:.0f}"]
            )
        rows[-1].append(f"{1e3 * np.linalg.norm(hand[-1] - hand[0]):.0f}")
    rows = [[*row, *[None] * (6 - len(row))] for row in rows]
    return Found(
        ours="The same ranges. The last column but one says how badly gravity (cos θ) and a constant passive moment can be distinguished.",
        why=(
            "Within so few degrees the cosine is all but constant: a condition number of 100 means that a hundredth of the torque as noise "
            "moves weight and passive moment by their whole size. This is why the thesis had to hold τ_p near zero for the mechanical arm, "
            "and where the masses of tables 4.6 to 4.8 come from. It says ±12°; the data are ±6° and less."
        ),
        sheets=[
            Sheet(
                "Ranges",
                Table(
                    ["arm", "joint", "range of the joint [°]", "range of the segment [°]", "condition", "way of the hand [mm]"],
                    rows,
                    left=2,
                ),
            )
        ],
        figures=[
            Drawn(
                "figure-3.12",
                "Figure 3.12: the movements of the identification",
                "Six instants of each, the first drawn in full; where they are made is chosen.",
                figure,
            )
        ],
    )


@GROUP.item(
    "equations-3.14-3.20",
    "Equations 3.14 and 3.20: hand with handle, arm with orthosis",
    "sections 3.1 and 3.4.1",
    "l_handle = 0.844 m and m_handle = 0.277 kg; l1 = a1 − (l_ua·m_ua + l_uo·m_uo)/(m_ua + m_uo).",
    virtual=False,
)
def bodies() -> Found:
    """Compute the joined bodies as printed and as meant."""
    # Section 3.1: 79 % of the length of the hand and 0.61 % of the mass of the body.
    upper, hand, m_hand = TABLE_4_10[0], 0.79 * TABLE_4_10[2].length, 0.0061 * (SUBJECT_ONE.body_mass or 0.0)
    mass, place = HANDLE

    def joined(at: float, handle: float = mass) -> float:
        return (m_hand * hand + handle * at) / (m_hand + handle)

    _, m_uo, l_uo = ORTHOSIS[0]
    printed = upper.length - (upper.com * upper.mass + l_uo * m_uo) / (upper.mass + m_uo)
    right = (upper.com * upper.mass + (upper.length - l_uo) * m_uo) / (upper.mass + m_uo)
    masses = [[f"{w:g}", f"{m:.3f}", f"{m - 0.0061 * w:.3f}"] for w, m in ((77.0, 0.663), (68.0, 0.608), (82.0, 0.693))]
    return Found(
        ours=(
            f"With the handle at {place:g} m the hand's centre of mass is at {joined(place):.4f} m; at 0.844 m it would be at "
            f"{joined(0.844):.3f} m, far outside a hand of 0.093 m. With the orthosis the upper arm's is at {right:.4f} m from the "
            f"shoulder; as printed it would be {printed:.4f} m, a moment of {9.81 * (right - printed) * (upper.mass + m_uo):.2f} N m less "
            "at the shoulder."
        ),
        why=(
            "0.844 has the decimal point a place too far. Equation 3.20 holds if both centres of mass count from the elbow, while "
            "everything else in the thesis counts the upper arm's from the shoulder. Tables 4.6 to 4.8 rest on a handle of 0.193 kg, not "
            "of 0.277."
        ),
        values={"l3_m": joined(place), "l3_printed_m": joined(0.844), "l1_m": float(right), "l1_printed_m": float(printed)},
        sheets=[
            Sheet(
                "The handle behind the references of tables 4.6 to 4.8",
                Table(["body mass [kg]", "m3 printed [kg]", "less 0.61 % of the body: the handle [kg]"], masses, left=0),
            )
        ],
    )
