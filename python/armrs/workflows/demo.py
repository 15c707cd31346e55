"""The main job on built-in data: an experiment on the thesis' mechanical arm, a search for what its model lacks, the gap before and after.

Everything is simulated, and the given model lacks the brakes of both joints. The search over the whole catalogue has no information about
them; what it finds is added, and the gap before and after is measured on test trials.
"""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .._armrs import Readings
from ..analysis.quantities import value_in
from ..catalogue import title
from ..io import files
from ..io.dataset import Dataset, load_dataset, write_dataset
from ..io.trial import Trial
from ..model import Contact, Joint, Model, Robot, Segment
from ..report import figures, pages, plain, results
from ..report.view import View
from ..tabular import Tabular, Tidy
from .gap import GapFound, find_gap
from .gap.headline import effect_name, headline, joined
from .gap.results import gap_data, write_gap
from .gap.summary import summary
from .identify import Identified, identify
from .movement import Movement
from .passive import PassiveMoments, passive_moments
from .simulate import Sensors, simulate

BRAKES = (0.139, 0.161)
"""Dry friction of the brakes in shoulder and elbow, by their load cells [N m] (table 4.3)."""
POSTURES_DEG = {"low": (-60.0, 60.0), "high": (-20.0, 60.0), "between": (-42.0, 72.0)}
SWING_DEG = 6.0
SPEED = 0.04
"""[rad/s]"""
FIT_REPEATS = {"low": 5, "high": 5, "between": 0}
TEST_REPEATS = {"low": 1, "high": 1, "between": 2}
SEEDS = {"low": 1000, "high": 2000, "between": 3000}
"""Seed of the sensor noise of the first repeat; the next ones count on."""
LOOP = ((0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (0.0, 0.0), (0.0, 1.0), (0.0, -1.0), (0.0, 0.0))
"""Each joint to both sides and back while the other is held."""
ROUND = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.0), (1.0, 0.3), (-0.3, -0.6), (0.0, 0.0))


@dataclass(frozen=True)
class Course:
    """A movement of the session with two speeds: posture and swing [deg], speed [rad/s], seed of the noise of its first repeat."""

    posture_deg: tuple[float, float]
    swing_deg: float
    way: tuple[tuple[float, float], ...]
    speed: float
    seed: int


TWO_SPEEDS = {
    "slow-low": Course((-60.0, 60.0), SWING_DEG, LOOP, 0.1, 5000),
    "slow-high": Course((-20.0, 60.0), SWING_DEG, LOOP, 0.1, 6000),
    "quick": Course((-45.0, 65.0), 22.0, ROUND, 0.6, 7000),
}
"""Dry friction and viscosity resist alike at one speed: the search needs two."""
REPEATS = 4
"""Of each of these movements; the last is the test trial."""
SLOWEST = 0.2
"""Movements below are slow [rad/s]."""
TOO_HEAVY = 1.1
"""The model handed to the identification has all masses and inertias too large by this factor, and no brakes."""

THESIS = {"m1*l1 + a1*m2": 0.7185, "m2*l2": 0.125, "m2": 1.206, "l2": 0.104, "m1*l1": 0.265, "torque 1": 0.151, "torque 2": 0.145}
"""What the thesis identified on the real arm with brakes on, table 4.5; the first from m1*l1 and m2. The relative errors printed there
refer in part to rounded or unstated references, so they are computed again from these."""


@dataclass(frozen=True, eq=False)
class Demonstration(Tabular):
    """What `run_demo` came to.

    Attributes
    ----------
    truth : Model
        What was simulated.
    identified : Identified
        With dry friction at every joint.
    without_friction : Identified
        With the effects of the model handed over only.
    passive : PassiveMoments
    gap : GapFound
        What the search found in the session with two speeds.
    gap_of_slow : GapFound
        What it found in the slow movements of that session alone.
    files : tuple of Path
        What was written, the report last.
    """

    truth: Model
    identified: Identified
    without_friction: Identified
    passive: PassiveMoments
    gap: GapFound
    gap_of_slow: GapFound
    files: tuple[Path, ...]

    def __repr__(self) -> str:
        return f"Demonstration({self.gap.verdict}, {self.identified!r}, report {str(self.files[-1])!r})"

    def tidy(self) -> Tidy:
        """Return identified values beside known ones, one a row."""
        names = ("name", "kind", "joint", "value", "std", "reference", "error_percent", "unit", "decided_by")
        rows = comparison(self.truth, self.identified)
        return Tidy({name: [row[name] for row in rows] for name in names}, {})

    def to_dict(self) -> dict[str, Any]:
        """Return the result as plain data."""
        return _shown(self)[0]


def true_model() -> Model:
    """Return the mechanical arm of table 4.3 with its brakes, held by a robot that reaches the whole path."""
    # The thesis gives no inertias: those of uniform rods.
    return Model(
        segments=(
            Segment("upper arm", length=0.376, mass=1.440, com=0.184, inertia=1.440 * 0.376**2 / 12.0),
            Segment("forearm", length=0.239, mass=1.160, com=0.115, inertia=1.160 * 0.239**2 / 12.0),
        ),
        joints=(Joint("shoulder", coulomb=BRAKES[0]), Joint("elbow", coulomb=BRAKES[1])),
        segment_uncertainty=0.0,
        robot=Robot(lengths=(0.45, 0.45), base=(1.0, -0.1)),
        contact=Contact(stiffness=(10_000.0, 10_000.0), damping=(25.0, 25.0)),
    )


def handed_over(truth: Model) -> Model:
    """Return the model that the identification starts from: too heavy, and without brakes."""
    segments = tuple(Segment(s.name, s.length, TOO_HEAVY * s.mass, s.com, TOO_HEAVY * s.inertia) for s in truth.segments)
    return truth.replace(segments=segments, joints=tuple(Joint(j.name) for j in truth.joints), segment_uncertainty=TOO_HEAVY - 1.0)


def measure(truth: Model) -> Dataset:
    """Return the data set that the simulated experiment gives: slow movements, one joint at a time, read by realistic sensors."""
    trials = []
    for name, posture in POSTURES_DEG.items():
        count = FIT_REPEATS[name] + TEST_REPEATS[name]
        movement = Movement(_one_joint_at_a_time(posture), speed=SPEED, acceleration=0.2, pause=0.5, shape="smooth")
        run = simulate(truth, movement, sensors=Sensors.realistic(), seeds=range(SEEDS[name], SEEDS[name] + count))
        for repeat, read in enumerate(run.readings, start=1):
            trials.append(_trial(name, repeat, "fit" if repeat <= FIT_REPEATS[name] else "test", read))
    return Dataset(
        name="Mechanical arm of table 4.3, brakes on",
        model=handed_over(truth),
        trials=tuple(trials),
        force_on="robot",
        sample_rate=Sensors.realistic().rate,
        synthetic=True,
    )


def measure_two_speeds(truth: Model) -> Dataset:
    """Return the data set of a second session on the same arm: slow movements of one joint at a time, and quick ones of both."""
    trials = []
    for name, course in TWO_SPEEDS.items():
        waypoints = np.radians(np.array(course.posture_deg) + course.swing_deg * np.array(course.way))
        movement = Movement(waypoints, speed=course.speed, acceleration=5.0 * course.speed, pause=0.3, shape="smooth")
        run = simulate(truth, movement, sensors=Sensors.realistic(), seeds=range(course.seed, course.seed + REPEATS))
        trials += [_trial(name, repeat, "test" if repeat == REPEATS else "fit", read) for repeat, read in enumerate(run.readings, start=1)]
    return Dataset(
        name="Mechanical arm of table 4.3, brakes on, two speeds",
        model=handed_over(truth),
        trials=tuple(trials),
        force_on="robot",
        sample_rate=Sensors.realistic().rate,
        synthetic=True,
    )


def slow_movements(session: Dataset) -> Dataset:
    """Return the slow movements of the session with two speeds."""
    return session.replace(trials=tuple(t for t in session.trials if TWO_SPEEDS[t.configuration].speed < SLOWEST))


def _trial(name: str, repeat: int, role: str, read: Readings) -> Trial:
    return Trial(
        file=f"trials/{name}_{repeat}.csv", configuration=name, repeat=repeat, role=role, t=read.time, q=read.q,
        force_on_arm=read.force_on_arm, moment_on_arm=None, robot_q=read.robot_q,
    )  # fmt: skip


def run_demo(
    folder: str | os.PathLike[str], *, command: str | None = None, tell: Callable[[str, float], None] = lambda stage, share: None
) -> Demonstration:
    """Simulate, write data sets, read them back, search for what the model lacks, identify it, and report the gap before and after.

    Parameters
    ----------
    folder : path
        Everything is written below it.
    command : str, optional
        For the report: how to repeat this.
    tell : callable
        Called with the name of the stage and the share of the stages that are done, 0 to 1.

    Returns
    -------
    Demonstration
    """
    results_of: list[Demonstration] = []

    def write(out: Path) -> list[Path]:
        made = _demonstrate(out, command, tell)
        results_of.append(made)
        return list(made.files)

    written = files.write_whole(folder, write)
    made = results_of[0]
    home = written[0].parent
    dataset = made.identified.dataset.replace(folder=home, model_path=home / "model.toml")
    return Demonstration(
        truth=made.truth,
        identified=dataclasses.replace(made.identified, dataset=dataset),
        without_friction=dataclasses.replace(made.without_friction, dataset=dataset),
        passive=dataclasses.replace(made.passive, dataset=dataset),
        gap=dataclasses.replace(made.gap, dataset=_moved(made.gap.dataset, home.parent / "session")),
        gap_of_slow=dataclasses.replace(made.gap_of_slow, dataset=_moved(made.gap_of_slow.dataset, home.parent / "session")),
        files=tuple(written),
    )


def _moved(dataset: Dataset, home: Path) -> Dataset:
    return dataset.replace(folder=home, model_path=home / "model.toml")


def _demonstrate(out: Path, command: str | None, tell: Callable[[str, float], None]) -> Demonstration:
    truth = true_model()
    tell("simulating the experiment", 0.0)
    description = write_dataset(measure(truth), out / "data")
    second = write_dataset(measure_two_speeds(truth), out / "session")
    files.write_text(
        out / "truth.toml", f"# SYNTHETIC: what was simulated. The identification never reads it.\n{truth.to_toml()}", kind=".toml"
    )
    dataset, session = load_dataset(description), load_dataset(second)
    tell("searching for what the model lacks", 1 / 7)
    gap = find_gap(session, separate=False)
    tell("searching in the slow movements alone", 2 / 7)
    slow = find_gap(slow_movements(session), separate=False)
    tell("passive moments", 3 / 7)
    passive = passive_moments(dataset)
    tell("identifying the model as it was handed over", 4 / 7)
    as_given = identify(dataset, with_effects=())
    tell("identifying with what was found", 5 / 7)
    found = identify(dataset, with_effects=found_in_joints(gap))
    made = Demonstration(truth, found, as_given, passive, gap, slow, (description, second))
    tell("writing the report", 6 / 7)
    return dataclasses.replace(made, files=(description, second, *_write(out, made, command)))


def found_in_joints(gap: GapFound) -> list[str]:
    """Return the kinds that the search named in joints, each once: what the identification then fits in every joint."""
    return list(dict.fromkeys(e.kind for e in gap.effects if e.joint is not None and e.trial is None))


def comparison(truth: Model, found: Identified) -> list[dict[str, Any]]:
    """Return identified values beside known ones, as plain data: what the thesis compares in table 4.5, and what the data determine."""
    rows: list[dict[str, Any]] = []
    seen = set()
    data = plain.identified_data(found)
    for item in [*data["combinations"], *data["parameters"]]:
        key = item["name"] if item["kind"] in ("segment", "combination") else f"{item['name']} {item['joint']}"
        reference = value_in(truth, item["name"], kind=item["kind"], joint=item["joint"])
        if key in seen or not reference or (key not in THESIS and item["decided_by"] != "data"):
            continue
        seen.add(key)
        errors = [None if v is None else 100.0 * (v - reference) / reference for v in (item["value"], THESIS.get(key))]
        rows.append(item | {"reference": reference, "error_percent": errors[0], "thesis_error_percent": errors[1]})
    return sorted(rows, key=lambda row: row["decided_by"] != "data")


def _one_joint_at_a_time(posture_deg: tuple[float, float]) -> np.ndarray:
    """Return waypoints: each joint to both sides and back while the other is held [rad]."""
    return np.radians(np.array(posture_deg) + SWING_DEG * np.array(LOOP))


def _left_over(found: Identified, passive: PassiveMoments) -> list[figures.Part]:
    """Return angle, unexplained torque and direction of motion of the test trials, each (n, n_joints)."""
    parts = []
    for explained, moments in zip(found.explained, passive.trials, strict=True):
        if explained.trial.role == "test":
            at = np.searchsorted(moments.trial.t, explained.t)
            parts.append((moments.q[at], explained.measured - explained.fitted, moments.direction[at]))
    return parts


def _shown(made: Demonstration, command: str | None = None) -> tuple[dict[str, Any], figures.Figures]:
    """Return text and figures of a demonstration."""
    found, passive = made.identified, made.passive
    rows = comparison(made.truth, found)
    joints = [joint.name for joint in made.truth.joints]
    left = [_left_over(fit, passive) for fit in (made.without_friction, found)]
    drawn: figures.Figures = {
        "summary": lambda: summary(made.gap),
        "known": lambda: figures.known(rows, joints, found.level),
        "directions": lambda: figures.direction_of_motion(left[0], left[1], joints),
    }
    return _demo_data(made, rows, [_half_gap(parts) for parts in left], command), drawn


SHOWN = View(lambda made: _shown(made)[0], lambda made, _: _shown(made)[1])


def _write(out: Path, made: Demonstration, command: str | None) -> list[Path]:
    found, passive = made.identified, made.passive
    data, shown = _shown(made, command)
    drawn = figures.draw(shown)
    gap = write_gap(made.gap, gap_data(made.gap, command), out / "gap")
    identified = results.write_identified(found, plain.identified_data(found, command), out / "identified")
    moments = results.write_passive(passive, plain.passive_data(passive, command), out / "passive")
    own = results.write_result(out, "demo", data, drawn)
    documents = [path for path in (*own, *gap, *identified, *moments) if path.suffix == ".json" and path.parent.name != "figures"]
    page = pages.write_report(documents, out / "report.html", maker="demo")
    return [*(path for path in (*gap, *identified, *moments, *own) if path != page), page]


def _half_gap(parts: list[figures.Part]) -> list[float]:
    """Return for each joint half the difference of the mean unexplained torque between both directions [N m]."""
    _, left, sign = (np.concatenate(items) for items in zip(*parts, strict=True))
    return [0.5 * abs(np.mean(left[sign[:, j] > 0, j]) - np.mean(left[sign[:, j] < 0, j])) for j in range(left.shape[1])]


def search_verdict(gap: GapFound) -> str:
    """Return what the search found beside what was hidden, in two sentences."""
    said = headline(gap_data(gap))
    hidden = {("coulomb", joint) for joint in range(1, len(BRAKES) + 1)}
    if {(e.kind, e.joint) for e in gap.effects} != hidden or len(gap.effects) != len(hidden):
        return f"The search did not name what was hidden, Coulomb friction in both joints. {said}"
    brakes = joined([f"{torque:.3f}" for torque in BRAKES])
    return f"The search found both brakes ({brakes} N m were hidden). {said}"


def of_slow_movements(slow: GapFound) -> list[str]:
    """Return what the slow movements alone separate, a line for each effect that is named: first those that they do not separate."""
    torn, separated = [], []
    for effect in gap_data(slow)["effects"]:
        rivals = dict.fromkeys(a["kind"] for a in effect["alternatives"] if a["joint"] == effect["joint"])
        name = effect_name(effect, [j.name for j in slow.dataset.model.joints])
        if rivals:
            torn.append(f"{name}: cannot be distinguished from {joined([title(kind) for kind in rivals], 'or')} by these movements")
        else:
            separated.append(f"{name}: no other effect explains the movements as well")
    return torn + separated


def _demo_data(made: Demonstration, rows: list[dict[str, Any]], gaps: list[list[float]], command: str | None) -> dict[str, Any]:
    data, session = made.identified.dataset, made.gap.dataset
    measured = [row for row in rows if row["decided_by"] == "data"]
    worst = max(abs(row["error_percent"]) for row in measured)
    slow, quick = (joined([n for n, c in TWO_SPEEDS.items() if (c.speed < SLOWEST) == is_slow]) for is_slow in (True, False))
    return {
        "verb": "demo",
        "data": plain.data_of(session),
        "verdict": search_verdict(made.gap),
        "story": [
            "The mechanical arm of table 4.3 of the thesis was simulated with its brakes, a robot of two links of 0.45 m and a contact of "
            "10 kN/m and 25 N s/m. The thesis gives no inertias: those of uniform rods were taken.",
            f"The model handed over was {100 * (TOO_HEAVY - 1):.0f} % too heavy and had no brakes.",
            f"Two speeds (folder session): {slow} at {TWO_SPEEDS['slow-low'].speed:g} rad/s, one joint at a time, and {quick} at "
            f"{TWO_SPEEDS['quick'].speed:g} rad/s, both joints. {len(session.fit_trials)} trials were fitted, {len(session.test_trials)} "
            "kept as test trials. The search had no information on the brakes.",
            f"The thesis (folder data): the robot swung one joint at a time by ±{SWING_DEG:g}° about three postures at {SPEED:g} "
            f"rad/s. {len(data.fit_trials)} trials were fitted with the effects that the search had found; {len(data.test_trials)} are "
            "test trials, some of them about a posture that was never fitted.",
            f"Sensors read both: 0.1° of noise on angles, 0.2 N on forces, 12 bits over ±110 N, {data.sample_rate:g} Hz. Repeats differ by "
            "sensor noise alone; in a laboratory they differ by more.",
        ],
        "slow_alone": {"verdict": headline(gap_data(made.gap_of_slow)), "lines": of_slow_movements(made.gap_of_slow)},
        "comparison": rows,
        "comparison_text": (
            f"Identified with the effects found, on the slow session of the thesis: everything that its movements determine is within "
            f"{worst:.1f} % of the simulated value. The table also has the relative errors of the thesis' own identification of the real "
            "arm with brakes on (table 4.5). Slow movements determine the first moments and the friction, not the masses: those come "
            "from the given model."
        ),
        "missing_text": (
            "Where friction is missing, the residual torque on the test trials differs between the directions of motion. Half of this "
            "difference, without and with the effects found: "
            + ", ".join(f"{j.name} {a:.3f} and {b:.3f} N m" for j, a, b in zip(data.model.joints, *gaps, strict=True))
            + "."
        ),
        "made_by": plain.origin(command),
    }
