"""Plots: what is on the Axes, with units; hollow markers for what was not measured; a look that leaves no trace."""

from __future__ import annotations

import io
from itertools import pairwise

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text

from armrs import demo, formatting, plotting
from armrs.io.trial import Trial
from armrs.report import figures
from armrs.report.sketch import sketch

T = np.linspace(0.0, 2.0, 101)


@pytest.fixture
def ax() -> matplotlib.axes.Axes:
    return plotting.figure(5, 4).subplots()


def labels(ax: matplotlib.axes.Axes) -> tuple[str, str]:
    return ax.get_xlabel(), ax.get_ylabel()


def legend(ax: matplotlib.axes.Axes) -> list[str]:
    return [text.get_text() for text in ax.get_legend().get_texts()]


def test_torque(ax: matplotlib.axes.Axes) -> None:
    assert plotting.torque(T, np.sin(T), np.cos(T), ax, title="elbow") is ax
    assert labels(ax) == ("time [s]", "torque [N m]")
    assert legend(ax) == ["measured", "fitted"]
    assert np.array_equal(ax.lines[1].get_ydata(), np.cos(T))


def test_a_line_breaks_where_samples_are_missing(ax: matplotlib.axes.Axes) -> None:
    t = np.concatenate([T[:40], T[60:]])
    plotting.torque(t, np.sin(t), np.sin(t), ax)
    y = ax.lines[0].get_ydata()
    assert np.isnan(y).sum() == 1
    assert np.isnan(y[40])


def test_residual_tells_fit_from_test(ax: matplotlib.axes.Axes) -> None:
    plotting.residual([(T, np.sin(T), "fit"), (T, np.cos(T), "fit"), (T, T, "test")], ax)
    assert legend(ax) == ["fit trials", "test trials"]
    assert labels(ax) == ("time [s]", "residual [N m]")
    assert len({line.get_color() for line in ax.lines[:3]}) == 2


ITEMS = [
    {"name": "m2*l2", "value": 0.13, "interval": (0.12, 0.14), "unit": "kg m", "decided_by": "data", "given": 0.15, "reference": 0.133},
    {"name": "m2", "value": 1.2, "interval": (1.0, 1.4), "unit": "kg m", "decided_by": "prior", "given": None},
    {"name": "I2", "value": 0.0, "interval": (0.0, 0.1), "unit": "kg m", "decided_by": "bound"},
]


def test_what_was_not_measured_has_a_hollow_marker(ax: matplotlib.axes.Axes) -> None:
    plotting.intervals(ITEMS, ["a", "b", "c"], ax)
    estimates = [line for line in ax.lines if line.get_marker() in "oD" and line.get_linestyle() == "None"]
    fills = [matplotlib.colors.to_hex(line.get_markerfacecolor()) for line in estimates]
    assert fills[0] == plotting.BLUE.lower()
    assert fills[1:] == ["#ffffff", "#ffffff"]
    assert [line.get_marker() for line in estimates] == ["o", "o", "D"]
    assert [line.get_marker() for line in ax.lines].count("x") == 1
    assert [line.get_marker() for line in ax.lines].count("|") == 1
    assert [tick.get_text() for tick in ax.get_yticklabels()] == ["a", "b", "c"]
    assert ax.get_xlabel() == "[kg m]"
    assert ax.yaxis_inverted()


def test_the_legend_of_intervals_explains_what_occurs() -> None:
    figure = plotting.figure(10, 4)
    plotting.interval_legend(figure, ITEMS[:1])
    assert [t.get_text() for t in figure.legends[0].get_texts()] == ["decided by the measurement", "model as given", "known value"]


def test_symbols_tell_i_from_l() -> None:
    assert formatting.typeset("I1 + m1*l1^2") == "I₁ + m₁·ℓ₁²"


def test_angles_are_in_degrees(ax: matplotlib.axes.Axes) -> None:
    q = np.column_stack([T, -T])
    plotting.angles(T, q, ["shoulder", "elbow"], ax, measured=q)
    assert labels(ax) == ("time [s]", "angle [°]")
    assert np.allclose(ax.lines[1].get_ydata(), np.degrees(T))
    assert legend(ax) == ["measured", "shoulder", "elbow"]


def test_force_and_contributions(ax: matplotlib.axes.Axes) -> None:
    plotting.force(T, np.column_stack([T, T]), ax)
    assert labels(ax) == ("time [s]", "force [N]")
    other = plotting.contributions(T, dict.fromkeys("abcde", T), plotting.figure(5, 4).subplots(), title="elbow")
    assert labels(other) == ("time [s]", "torque [N m]")
    looks = {(line.get_color(), line.get_linestyle()) for line in other.lines[:5]}
    assert len(looks) == 5


def test_hysteresis_and_spread(ax: matplotlib.axes.Axes) -> None:
    plotting.hysteresis([(T, T)], [(T, -T)], ax)
    assert labels(ax) == ("joint angle [°]", "passive moment [N m]")
    assert legend(ax) == ["rising", "falling"]
    plotting.mean_and_spread(T, T, np.full(T.shape, np.nan), ax, label="elastic mean")
    assert legend(ax) == ["rising", "falling", "elastic mean"]
    assert len(ax.collections) == 1


def test_by_direction_explains_every_colour(ax: matplotlib.axes.Axes) -> None:
    plotting.by_direction(T, T, np.sign(T - 1).astype(int), ax, quantity="left [N m]")
    assert labels(ax) == ("joint angle [°]", "left [N m]")
    assert sum(len(line.get_xdata()) for line in ax.lines[:3]) == len(T)
    assert legend(ax) == ["neither", "rising", "falling"]


def test_labels_of_large_numbers_do_not_collide() -> None:
    items = [{"value": v, "interval": (0.8 * v, 1.2 * v), "unit": "N/m", "decided_by": "data"} for v in (1e5, 1.25e5, 1.5e5)]
    with plotting.style():
        ax = plotting.intervals(items, ["a", "b", "c"], plotting.figure(3.0, 2.0).subplots())
        ax.figure.draw_without_rendering()
        boxes = [tick.get_window_extent() for tick in ax.get_xticklabels() if tick.get_text()]
    assert len(boxes) > 2
    assert all(left.x1 < right.x0 for left, right in pairwise(boxes))
    assert ax.xaxis.get_offset_text().get_text() == "1e5"


@pytest.mark.parametrize(("count", "shape"), [(0, (1, 1)), (1, (1, 1)), (3, (1, 3)), (4, (2, 2)), (5, (2, 3)), (7, (3, 3))])
def test_a_grid_leaves_few_places_empty(count: int, shape: tuple[int, int]) -> None:
    """Four panels were three, and one below."""
    assert plotting.grid(count) == shape


def test_what_was_on_a_sheet_before_leaves_no_trace() -> None:
    def image(scale: float, repeats: int) -> bytes:
        figure, axes = plotting.pairs(["elbow"], 5.0, 4.6, 2.0)
        plotting.torque(scale * T, scale * np.sin(T), np.cos(T), axes[0, 0], title=f"{repeats}")
        plotting.residual([(T, scale * np.sin(T), "fit")] * repeats, axes[1, 0])
        if scale > 1.0:
            plotting.mean_and_spread(T, T, np.ones_like(T), axes[1, 0], label="band")
        else:
            axes[1, 0].set_ylim(bottom=0.0)
        png = io.BytesIO()
        plotting.write_png(figure, png)
        return png.getvalue()

    sheets = [(1.0, 3), (1e6, 1), (1e-3, 2)]
    with plotting.style():
        alone = [image(*sheet) for sheet in sheets]
        with plotting.same_sheet():
            assert [image(*sheet) for sheet in sheets] == alone
            assert plotting.pairs(["elbow"], 5.0, 4.6, 2.0)[0] is plotting.pairs(["knee"], 5.0, 4.6, 2.0)[0]


@pytest.mark.parametrize("count", [1, 3])
def test_panels_of_intervals_keep_apart(count: int) -> None:
    labels = ["a long name of a parameter", "b", "c"]
    with plotting.style():
        figure = plotting.interval_panels([[(ITEMS, labels)] * count, [(ITEMS[:1], labels[:1])]])
        figure.draw_without_rendering()
        boxes = [box for box in [*(ax.get_tightbbox() for ax in figure.axes), figure.legends[0].get_window_extent()] if box is not None]
    assert not any(one.overlaps(other) for k, one in enumerate(boxes) for other in boxes[:k])
    assert all(figure.bbox.contains(*corner) for box in boxes for corner in (box.min, box.max))


def test_without_axes_a_figure_is_made(monkeypatch: pytest.MonkeyPatch) -> None:
    matplotlib.use("Agg")
    from matplotlib import pyplot

    made = plotting.force(T, np.column_stack([T, T]))
    assert isinstance(made.figure, Figure)
    pyplot.close(made.figure)


def test_files_of_figures_keep_their_letters_and_stay_apart() -> None:
    """`épaule` was `paule`, and two names of another script were one file."""
    assert [figures.slug(name) for name in ("épaule 1", "vérification", "slow/fast")] == ["epaule-1", "verification", "slow-fast"]
    assert len({figures.slug(name) for name in ("快", "慢")}) == 2


def test_the_style_leaves_no_trace() -> None:
    before = dict(matplotlib.rcParams)
    with plotting.style():
        assert not matplotlib.rcParams["axes.spines.top"]
    assert dict(matplotlib.rcParams) == before


@pytest.mark.parametrize("name", ["elbow $x^2$", r"elbow $\frac{1}$", "$", r"5 \$"])
def test_names_are_shown_as_they_stand(name: str) -> None:
    with plotting.style():
        figure = plotting.figure(5, 4)
        ax = plotting.angles(T, np.column_stack([T, T]), [name, "other"], figure.subplots())
        ax.set(title=name, xlabel=name)
        ax.set_yticks([0.0, 1.0], [name, "other"])
        figure.draw_without_rendering()
    shown = figure.findobj(lambda artist: isinstance(artist, Text) and artist.get_text() == name)
    # Title, axis, tick on both sides, and legend.
    assert len(shown) == 5
    assert not any(text.get_parse_math() for text in shown)


def test_the_palette_tells_neighbours_apart_in_grey() -> None:
    """The first colours differ in lightness, for prints without colour."""
    light = [np.dot(matplotlib.colors.to_rgb(c), [0.2126, 0.7152, 0.0722]) for c in plotting.CYCLE[:2]]
    assert abs(light[0] - light[1]) > 0.2


@pytest.mark.parametrize("count", [1, 4, 11])
def test_names_above_the_sketch_cross_neither_arm_nor_robot(count: int, ax: matplotlib.axes.Axes) -> None:
    model = demo.true_model()
    t = np.array([0.0, 0.02, 0.04])
    q, robot_q = np.tile(np.radians([-40.0, 60.0]), (3, 1)), np.tile(np.radians([120.0, 90.0]), (3, 1))
    trial = Trial("a.csv", "a", 1, "fit", t, q, np.zeros((3, 2)), None, robot_q)
    sketch(model, [trial], {("joint", 0)}, [(f"1  shoulder: coulomb torque 0.1385 ± 0.0013 N m, {k}", "black") for k in range(count)], ax)
    ax.get_figure().draw_without_rendering()
    boxes = [text.get_window_extent() for text in ax.texts if len(text.get_text()) > 2]
    assert len(boxes) == count + 1  # and that of the robot
    for line in ax.lines:
        if line.get_alpha() is None and len(line.get_xdata()) > 1:
            path = line.get_path().transformed(line.get_transform())
            assert not any(path.intersects_bbox(box, filled=False) for box in boxes)


@pytest.mark.parametrize("title", ["shoulder", "left shoulder", "MMMMMMMM", "flexion of the left elbow"])
def test_labels_of_pairs_of_panels_stay_apart_whatever_they_say(title: str) -> None:
    t = np.linspace(0.0, 10.0, 50)
    with plotting.style():
        figure, axes = plotting.pairs([title, title], 4.9, 5.6, 1.7)
        for above, below in axes.T:
            plotting.hysteresis([(t, -0.0025 * t)], [(t, -0.001 * t)], above, title=title)
            plotting.mean_and_spread(t, -0.0025 * t, t, above, label="elastic mean")
            above.set_xlabel("")
            plotting.mean_and_spread(t, -0.0025 * t, 0.0 * t, below, label="half width (dissipative)")
        figure.draw_without_rendering()
    shown = []
    for ax in axes.ravel():
        low, high = ax.get_ylim()
        ticks = [tick for tick in ax.get_yticklabels() if low <= tick.get_position()[1] <= high]
        shown += [text for text in (ax.yaxis.label, ax.xaxis.label, *ticks) if text.get_text()]
        shown.append(ax.get_legend())
    shown += [ax.title if ax.get_title() else ax._left_title for ax in axes[0]]
    boxes = [text.get_window_extent() for text in shown] + [ax.get_window_extent() for ax in axes.ravel()]
    whole = figure.bbox
    assert all(whole.x0 <= b.x0 and b.x1 <= whole.x1 and whole.y0 <= b.y0 and b.y1 <= whole.y1 for b in boxes)
    overlaps = [(a, b) for k, a in enumerate(boxes) for b in boxes[:k] if a.overlaps(b)]
    assert not overlaps
