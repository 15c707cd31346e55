"""How errors propagate (appendix A): the printed formulas, the Jacobian and Monte Carlo."""

from __future__ import annotations

import numpy as np

from ..analysis import uncertainty
from ..report import plotting
from ..report.figures import Drawn
from ..report.tables import Table
from .report_item import Found, Group, Sheet
from .virtual_sessions import subject_one

GROUP = Group("propagation", "Errors (A)")

A2 = 0.239
ANGLE, FORCE, LENGTH = np.radians(0.1), 0.2, 0.0005
"""Standard deviations of angles [rad], forces [N] and the forearm's length [m]."""
CONTACT = (3.0, 10.0)
"""Contact force of the examples [N]."""
FIRST_MOMENT = 0.1334
DRAWS = 20_000
SEED = 51


def _torque(
    a2: np.ndarray | float, q1: np.ndarray | float, q2: np.ndarray | float, fy: np.ndarray | float, fz: np.ndarray | float
) -> np.ndarray:
    """Return τ_end2, the function f1 of equation 5.2 [N m]."""
    return np.asarray(a2 * (-np.sin(q1 + q2) * fy + np.cos(q1 + q2) * fz))


def _at(q1: float, q2: float) -> tuple[float, float, float]:
    """Return standard deviations of f1 by Monte Carlo, by the Jacobian and by equation 5.3 [N m]."""
    point = np.array([A2, q1, q2, *CONTACT])
    sizes = np.array([LENGTH, ANGLE, ANGLE, FORCE, FORCE])
    draws = point + sizes * np.random.default_rng(SEED).standard_normal((DRAWS, 5))
    sampled = float(_torque(*draws.T).std(ddof=1))
    steps = 1e-6 * np.eye(5)
    slopes = np.array([(_torque(*(point + s)) - _torque(*(point - s))) / 2e-6 for s in steps])
    value = float(_torque(*point))
    with np.errstate(divide="ignore"):
        printed = abs(value) * float(np.sqrt(np.sum((sizes / point) ** 2)))
    return sampled, float(np.sqrt(np.sum((slopes * sizes) ** 2))), printed


@GROUP.item(
    "equation-5.3",
    "Equations 5.3 and 5.8: the error of a torque",
    "appendix A",
    "δf = f·√Σ(δx/x)² over lengths, angles and forces alike.",
    virtual=False,
)
def torque_errors() -> Found:
    """Compare the printed propagation with the Jacobian and Monte Carlo."""
    near = np.geomspace(0.01, 1.0, 25)
    angles = np.radians(np.concatenate([np.linspace(-60.0, -1.0, 60), -near[-2::-1], near, np.linspace(2.0, 30.0, 29)]))
    curves = np.array([_at(q1, np.radians(60.0)) for q1 in angles])
    figure = plotting.figure(7.4, 3.6)
    ax = figure.subplots()
    for k, (label, colour, look) in enumerate(
        (("Monte Carlo", plotting.SILVER, "-"), ("Jacobian", plotting.BLUE, "--"), ("equation 5.3", plotting.RED, "-"))
    ):
        ax.semilogy(np.degrees(angles), curves[:, k], look, color=colour, lw=3.0 if k == 0 else 1.5, label=label)
    # Without mathematics, in which a logarithmic axis would write powers of ten.
    ax.yaxis.set_major_formatter("{x:g}")
    ax.yaxis.set_minor_formatter("")
    ax.set(xlabel="shoulder [°]", ylabel="standard deviation [N m]")
    ax.legend(loc="upper left", bbox_to_anchor=(0.0, 0.92))
    rows = [[f"{q1:g}", *(f"{v:.4f}" for v in _at(np.radians(q1), np.radians(60.0)))] for q1 in (-60.0, -30.0, -10.0, -1.0, -0.01)]
    worst = float(np.max(np.abs(curves[:, 1] / curves[:, 0] - 1)))
    return Found(
        ours=(
            f"The Jacobian agrees with Monte Carlo within {100 * worst:.1f} % everywhere (about {curves[:, 1].mean():.3f} N m). Equation "
            f"5.3 gives {rows[0][3]} N m at −60° and {rows[-1][3]} N m at −0.01°."
        ),
        why=(
            "Relative errors add up for products of the quantities themselves. A torque holds sines and cosines of angles, and an angle "
            "has no relative error: where it crosses zero 5.3 grows without bound, and where the torque does it vanishes. Var f = Σ "
            "(∂f/∂x)² σ² is right, and is what `armrs passive` uses."
        ),
        values={"jacobian_over_monte_carlo_most_off": worst},
        sheets=[
            Sheet(
                "Standard deviation of τ_end2 [N m], elbow at 60°",
                Table(["shoulder [°]", "Monte Carlo", "Jacobian", "equation 5.3"], rows, left=0),
            )
        ],
        figures=[
            Drawn(
                "appendix-A-5.3",
                "Equation 5.3: error of the elbow's torque",
                "Elbow at 60°. 0.1°, 0.2 N and 0.5 mm of standard deviation.",
                figure,
            )
        ],
    )


@GROUP.item(
    "equation-5.5",
    "Equations 5.5 and 5.10: the error of an identified parameter",
    "appendix A",
    "δπ = 2N(δf1 + δf2) for N samples.",
    virtual=False,
)
def parameter_errors() -> Found:
    """Compare the printed error of a fitted parameter with least squares and Monte Carlo."""
    random = np.random.default_rng(SEED)
    q1, q2 = np.radians(-45.0), np.radians(55.0)
    _, sigma, printed_f1 = _at(q1, q2)
    printed_f2 = 9.81 * np.cos(q1 + q2) * FIRST_MOMENT * np.hypot(ANGLE / q1, ANGLE / q2)
    rows = []
    for count in (50, 200, 800, 3200):
        theta = np.radians(np.linspace(0.0, 11.5, count))
        column = 9.81 * np.cos(theta)
        noise = sigma * random.standard_normal((500, count))
        sampled = (FIRST_MOMENT + noise @ column / (column @ column)).std(ddof=1)
        right = sigma / np.sqrt(column @ column)
        rows.append([count, f"{sampled:.6f}", f"{right:.6f}", f"{2 * count * (printed_f1 + printed_f2):.1f}"])
    return Found(
        values={"printed_per_sample_Nm": float(2.0 * (printed_f1 + printed_f2)), "sigma_Nm": sigma},
        ours=f"The deviation of m2·l2 falls with the root of the number of samples, to {rows[-1][2]} kg m with 3200 of them.",
        why=(
            "The printed error grows with the number of samples, has the unit of a torque, and has lost the inverse of the normal matrix. "
            "Cov π = σ²(YᵀY)⁻¹ is right for independent samples; `armrs identify` takes it from the scatter between stretches, since "
            "samples are correlated."
        ),
        sheets=[
            Sheet("Standard deviation of m2·l2 [kg m]", Table(["samples", "Monte Carlo", "σ/√(YᵀY)", "equation 5.5 [N m]"], rows, left=0))
        ],
    )


@GROUP.item(
    "equation-5.12",
    "Equations 5.12 to 5.16: products and passive moments",
    "appendix A",
    "δ(Yπ) = Yπ·√(δY/Y + δπ/π); δτ_p = 2δX.",
    virtual=False,
)
def product_errors() -> Found:
    """Compare the printed error of a product, and of a mean size, with Monte Carlo."""
    random = np.random.default_rng(SEED)
    y, pi, dy, dpi = 9.81 * np.cos(np.radians(10.0)), FIRST_MOMENT, 0.05, 0.0022
    sampled = float(((y + dy * random.standard_normal(DRAWS)) * (pi + dpi * random.standard_normal(DRAWS))).std(ddof=1))
    squares, printed = y * pi * np.sqrt((dy / y) ** 2 + (dpi / pi) ** 2), y * pi * np.sqrt(dy / y + dpi / pi)
    sigma, count = 0.03, 50
    means = np.abs(sigma * random.standard_normal((DRAWS, count))).mean(axis=1)
    rows = [
        ["δ(Yπ) [N m]", f"{sampled:.4f}", f"{squares:.4f}", f"{printed:.4f}"],
        ["τ_p by equation 3.32 where there is none [N m]", f"{means.mean():.4f}", f"{sigma * np.sqrt(2 / np.pi):.4f}", "0"],
        ["its deviation [N m]", f"{means.std(ddof=1):.4f}", f"{sigma * np.sqrt((1 - 2 / np.pi) / count):.4f}", f"{2 * sigma:.4f}"],
    ]
    return Found(
        ours=f"With squares the product's error is {squares:.4f} N m, as Monte Carlo has it; as printed {printed:.3f} N m.",
        why=(
            "Squares are missing, and the factor 2 follows from nothing. More important than the scatter of equation 3.32 is its bias: the "
            "mean size of noise is 0.8 of its deviation, friction or not."
        ),
        sheets=[Sheet("Noise of 0.03 N m, 50 samples", Table(["quantity", "Monte Carlo", "right formula", "as printed"], rows))],
    )


@GROUP.item(
    "passive-moment-uncertainty",
    "What passive moments rest on",
    "sections 4.1.3 and 3.4, appendix B",
    "“Segment length and centre of gravity location errors do not affect the result greatly”, since they cancel between G and JᵀF; "
    "masses do.",
)
def passive_uncertainty() -> Found:
    """Compute shares of each source in the uncertainty of the passive moments, by Jacobian and Monte Carlo."""
    found = subject_one()
    trial = found.dataset.trials[0]
    model = found.dataset.model_of(trial.configuration)
    there = slice(0, len(trial.t), 20)
    q, force = trial.q[there], trial.force_on_arm[there] if trial.force_on_arm is not None else None
    deviations = uncertainty.Deviations.of(found.dataset)
    parts = uncertainty.sensitivity(model, q, force, deviations)
    jacobian = uncertainty.by_jacobian(parts).mean(axis=0)
    sampled = uncertainty.by_monte_carlo(model, q, force, deviations, draws=2000, seed=SEED).mean(axis=0)
    sources = ("masses, 5 %", "centres of mass, 5 %", "lengths, 2 mm", "angles, 0.3°", "force bias, 0.2 N", "force gain, 1 %")
    ends = np.cumsum([3, 3, 3, 3, 2, 2])
    blocks = [uncertainty.by_jacobian(block).mean(axis=0) for block in np.split(parts, ends[:-1])]
    share = float(blocks[1][0] / blocks[0][0])
    rows = [[name, *(f"{v:.3f}" for v in block)] for name, block in zip(sources, blocks, strict=True)]
    rows += [["all, Jacobian", *(f"{v:.3f}" for v in jacobian)], ["all, Monte Carlo", *(f"{v:.3f}" for v in sampled)]]
    ratio = float(np.max(np.abs(jacobian / sampled - 1)))
    return Found(
        ours=(
            f"At the shoulder masses make {rows[0][1]} N m, centres of mass {rows[1][1]}, lengths {rows[2][1]}; all together "
            f"{jacobian[0]:.2f} N m. Jacobian and Monte Carlo agree within {100 * ratio:.1f} %."
        ),
        why=(
            "Lengths and centres of mass cancel only if both are wrong by the same factor. A centre of mass alone, which comes from a "
            f"table while the length is measured, contributes {share:.0%} of what the masses do at the shoulder. J does not contain any "
            "l_j, as appendix B says it does."
        ),
        values={"jacobian_over_monte_carlo_most_off": ratio, "com_share_of_mass_at_shoulder": share},
        sheets=[
            Sheet(
                f"Standard deviations of the passive moments [N m], {trial.configuration}°, mean over the movement",
                Table(["source", "shoulder", "elbow", "wrist"], rows),
            )
        ],
    )
