"""What a partner does between the communication points of a run and of its second run: no such run is good."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from armrs.cosim import Slave
from armrs.cosim.coupled_run import CoupledRun
from armrs.cosim.error_estimate import run_checked
from armrs.cosim.haptic_wall import Wall
from armrs.cosim.intermediate_outputs import outliers, parts
from armrs.cosim.master import run_system
from armrs.cosim.sources_and_controllers import BuiltInSlave, Wave
from armrs.cosim.system import System, couple
from armrs.errors import BadInput, CoupledError, SlaveError
from armrs.fmu.imported_slave import ImportedSlave
from armrs.fmu.isolated_slave import IsolatedSlave
from armrs.fmu.slave_interface import Partner, Status
from armrs.model import load_model
from pythonfmu_builds import built

ARM = Path(__file__).parents[1] / "examples" / "cosim" / "arm.toml"
NEAR = np.radians([-60.0, 50.0])
PULSE = """
from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class Pulse(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.time, self.at, self.width = 0.0, 0.1001, 0.0008
        tunable = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.tunable}
        self.register_variable(Real("at", start=0.1001, **tunable))
        self.register_variable(Real("width", start=0.0008, **tunable))
        on = lambda: 40.0 if self.at <= self.time < self.at + self.width else 0.0
        self.register_variable(Real("F", causality=Fmi2Causality.output, getter=on))

    def do_step(self, current_time, step_size):
        self.time = current_time + step_size
        return True
"""


@pytest.fixture(scope="module")
def pulse(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A partner that pushes for a moment, made by PythonFMU."""
    return built(tmp_path_factory.mktemp("pulse"), PULSE, "Pulse")


def pushed(partner: Partner, step: float, **settings: float) -> System:
    arm = Slave(load_model(ARM), start=NEAR, rest=True, name="arm")
    [output] = [v.name for v in partner.variables.values() if v.causality == "output"]
    return couple([partner, arm], [(f"{partner.name}.{output}", "arm.handle.F[1]")], step=step, duration=0.2, **settings)


def smooth() -> Wave:
    return Wave("sine", amplitude=2.0, frequency=1.5, unit="N", name="wave")


def refused(system: System) -> CoupledRun:
    with pytest.raises(CoupledError) as error:
        run_checked(system)
    run: CoupledRun = error.value.run
    return run


@pytest.mark.parametrize(("at", "width"), [(0.1001, 0.0008), (0.1503, 0.0004), (0.02055, 0.0003)])
@pytest.mark.parametrize("step", [0.002, 0.01, 1.0 / 60.0])
def test_a_pulse_between_the_points_of_both_runs_is_seen(at: float, width: float, step: float, pulse: Path) -> None:
    with ImportedSlave(pulse, name="pulse") as partner:
        partner.set(["at", "width"], [at, width])
        partner.reset = lambda: None  # type: ignore[method-assign]  (it would take the parameters back, too)
        run = refused(pushed(partner, step))
    assert run.verdict == "not accurate"
    [found] = [e for e in run.estimates if e.at is not None]
    assert (found.name, found.error) == ("pulse.F", 40.0)
    assert at <= found.at < at + width
    assert run.why.startswith(f"pulse.F goes 40 beyond its values at the neighbouring communication points at {found.at:.6g} s")


def test_a_pulse_shorter_than_the_resolution_is_seen_with_a_finer_one(pulse: Path) -> None:
    """By default an event of less than 0.25 ms may be missed, and the verdict says so."""
    with ImportedSlave(pulse, name="pulse") as partner:
        partner.set(["at", "width"], [0.10005, 0.0001])
        partner.reset = lambda: None  # type: ignore[method-assign]
        run = run_checked(pushed(partner, 0.002))
        assert run.verdict == "good"
        assert run.why.endswith("an event of a partner shorter than 0.25 ms can be missed")
        assert run.resolution == pytest.approx(0.25e-3)
        assert refused(pushed(partner, 0.002, resolution=0.05e-3)).verdict == "not accurate"


class Shaking(BuiltInSlave):
    """A sine that both runs see at its zeros alone."""

    def __init__(self) -> None:
        super().__init__("shaking", (), [("F", "N")])

    def outputs(self) -> dict[str, float]:
        return {"F": 5.0 * np.sin(2e3 * np.pi * self.time)}


def test_a_vibration_that_looks_like_rest_is_seen() -> None:
    run = refused(pushed(Shaking(), 0.002))
    [found] = [e for e in run.estimates if e.at is not None]
    assert found.error == pytest.approx(5.0, rel=1e-3)


def test_a_smooth_force_is_good_as_before() -> None:
    run = run_checked(pushed(smooth(), 0.002))
    assert run.verdict == "good"
    # Between the communication points a sine has its peak.
    assert max(e.error for e in run.estimates if e.name == "wave.y") < 1e-3


class Edges(BuiltInSlave):
    """A force between two times, with a spring to the hand or without."""

    def __init__(self, begin: float, end: float, *, spring: bool) -> None:
        super().__init__("edges", [("r", "m")] if spring else (), [("F", "N")])
        self.begin, self.until = begin, end

    def outputs(self) -> dict[str, float]:
        return {"F": (5.0 if self.begin <= self.time < self.until else 0.0) - 100.0 * self.inputs.get("r", 0.0)}


def with_edges(begin: float, end: float, step: float, *, spring: bool, **settings: float) -> System:
    arm = Slave(load_model(ARM), start=NEAR, rest=True, name="arm")
    lines = [("edges.F", "arm.handle.F[1]"), *([("arm.handle.r[1]", "edges.r")] if spring else [])]
    algorithm = "iterated" if spring else "gauss-seidel"
    return couple([Edges(begin, end, spring=spring), arm], lines, step=step, duration=0.2, algorithm=algorithm, accuracy=0.05, **settings)


@pytest.mark.parametrize("spring", [False, True])
def test_jumps_within_a_communication_step_are_told(spring: bool) -> None:
    """A force of 2.27 ms counts as 2 ms in the run with 1 ms and in that with 0.5 ms: their difference tells nothing."""
    run = run_checked(with_edges(0.10039, 0.12266, 0.001, spring=spring))
    assert run.verdict == "stable"
    assert run.estimates == ()
    [text] = [w for w in run.warnings if "not estimated" in w]
    assert text.startswith("the error is not estimated: edges.F jumps by 5 N within the communication step at 0.1")


@pytest.mark.parametrize("spring", [False, True])
def test_jumps_at_communication_points_are_no_harm(spring: bool) -> None:
    assert run_checked(with_edges(0.1, 0.15, 0.001, spring=spring)).verdict == "good"


def test_two_jumps_near_communication_points_are_known_to_within_the_resolution() -> None:
    """A force from 0.0998 to 0.1029 s counts as 3 ms in both runs, and lasts 3.1 ms."""
    run = run_checked(with_edges(0.0998, 0.1029, 0.001, spring=False))
    assert run.verdict == "stable"
    assert any("edges.F jumps, and stays from 0.1 to 0.103 s, known to within 0.25 ms" in text for text in run.warnings), run.warnings
    # A finer look shows that they are not at the points.
    run = run_checked(with_edges(0.0998, 0.1029, 0.001, spring=False, resolution=0.05e-3))
    assert any("within the communication step" in text for text in run.warnings), run.warnings


def test_refinement_puts_a_communication_point_at_a_jump() -> None:
    run = run_checked(with_edges(0.1005, 0.1505, 0.001, spring=False, refine=1))
    assert run.verdict == "good"
    assert run.system.step == 0.0005


def test_what_is_a_jump() -> None:
    t = np.linspace(0.0, 1.0, 21)
    smooth, kink, jump, pulse = np.sin(3.0 * t), np.abs(t - 0.5), t + (t > 0.42), 1.0 * (np.abs(t - 0.5) < 0.01)
    found = outliers(np.diff(np.column_stack([smooth, kink, jump, pulse]), axis=0))
    assert np.flatnonzero(found.any(axis=0)).tolist() == [2]  # a pulse of one row is seen as what goes beyond both ends
    assert np.flatnonzero(found[:, 2]).tolist() == [8]
    assert outliers(np.array([[1.0]])).tolist() == [[0.0]]


@pytest.mark.parametrize("begin", [0.1004, 0.1006])
def test_a_jump_is_told_from_what_the_inputs_do(begin: float) -> None:
    """Before and just after the middle of a communication step, of a partner whose spring follows the hand at once."""
    run = run_checked(with_edges(begin, 0.1601, 0.001, spring=True))
    assert run.verdict == "stable"
    assert any("edges.F jumps by" in text for text in run.warnings), run.warnings


@pytest.mark.parametrize("spring", [False, True])
def test_two_runs_tell_what_a_jump_just_after_a_communication_point_does(spring: bool) -> None:
    run = run_checked(with_edges(0.1001, 0.1601, 0.001, spring=spring))
    assert run.verdict == "good"
    fine = run_system(with_edges(0.1001, 0.1601, 2e-5, spring=spring))
    for estimate in run.estimates:
        truth = np.interp(run.t, fine.t, fine.columns[estimate.name])
        assert np.abs(run.columns[estimate.name] - truth).max() <= estimate.allowed, estimate


# ---- partners that compute their outputs in a step alone
LATE = """
from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class Pd(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.q, self.w, self.u, self.on, self.steps = 0.0, 0.0, 0.0, False, 0.0
        for name in ("q", "w"):
            self.register_variable(Real(name, causality=Fmi2Causality.input))
        self.register_variable(Boolean("on", causality=Fmi2Causality.input, variability=Fmi2Variability.discrete))
        for name in ("u", "steps"):
            self.register_variable(Real(name, causality=Fmi2Causality.output))

    def do_step(self, current_time, step_size):
        self.u = 40.0 * (-1.0 - self.q) - 4.0 * self.w if self.on else 0.0
        self.steps += 1.0
        return True
"""


@pytest.fixture(scope="module")
def late(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A controller as most are written for PythonFMU: its output is computed in do_step."""
    return built(tmp_path_factory.mktemp("late"), LATE, "Pd")


def controlled(partner: Partner, step: float, **settings: float) -> System:
    arm = Slave(load_model(ARM), start=np.radians([-60.0, 20.0]), name="arm")
    lines = [("arm.q[1]", "pd.q"), ("arm.qd[1]", "pd.w"), ("pd.u", "arm.tau[1]")]
    return couple([partner, arm], lines, step=step, duration=0.5, starts={"pd": {"on": True}}, **settings)


def test_an_output_that_the_initialization_does_not_compute_is_named_and_its_effect_is_estimated(late: Path) -> None:
    """It keeps its start value during the first step; the second run halves that step, too."""
    with ImportedSlave(late, name="pd") as partner:
        system = controlled(partner, 0.0005, accuracy=0.02)
        run = run_checked(system)
        partner.reset()
        fine = run_system(controlled(partner, 2e-5))
    assert run.verdict == "good"
    [text] = [w for w in run.warnings if "first step" in w]
    assert text == "pd.u jumps by 1.89 in the first step of its slave; if its initialization does not compute it, compute it there"
    # Nothing is driven but the truth value, which was given.
    assert system.unconnected == ["arm.handle.F[1]", "arm.handle.F[2]", "arm.tau[2]"]
    for estimate in run.estimates:
        # Where it begins, the output is its start value in every run.
        truth = np.interp(run.t[1:], fine.t, fine.columns[estimate.name])
        assert np.abs(run.columns[estimate.name][1:] - truth).max() <= estimate.most * 1.05, estimate


@pytest.mark.parametrize("refine", [0, 1])
def test_a_run_that_is_not_accurate_names_the_output_that_begins_too_late(late: Path, refine: int) -> None:
    """A shorter step alone would not tell where the error comes from."""
    with ImportedSlave(late, name="pd") as partner, pytest.raises(CoupledError, match="not accurate") as refused:
        run_checked(controlled(partner, 0.004, accuracy=0.001, refine=refine))
    run = refused.value.run
    assert run is not None
    assert [w for w in run.warnings if w.startswith("pd.u jumps by 1.89 in the first step of its slave")]


def test_the_samples_of_a_refined_run_are_of_the_run_that_is_reported(late: Path) -> None:
    """Its partner makes one step for each communication step, as in any run."""
    with ImportedSlave(late, name="pd") as partner:
        run = run_checked(controlled(partner, 0.004, accuracy=0.08, refine=3))
    assert run.verdict == "good"
    assert run.system.step < 0.004
    assert run.columns["pd.steps"].tolist() == list(range(len(run.t)))
    assert run.evaluations == 2.0


def test_a_partner_that_fails_is_named(tmp_path: Path) -> None:
    text = LATE.replace("self.steps += 1.0", "self.steps = 1.0 / (0.05 - current_time if current_time < 0.05 else 0.0)")
    with IsolatedSlave(built(tmp_path, text, "Pd"), name="pd") as partner, pytest.raises(CoupledError) as error:
        run_checked(controlled(partner, 0.01))
    assert str(error.value).startswith("failed: do_step: fatal error: pd: ")


def test_differences_of_rounding_are_no_finding() -> None:
    """An arm that hangs still: the two runs are the same but for rounding."""
    still = Slave(load_model(ARM), start=np.radians([-90.0, 0.0]), name="arm")
    run = run_checked(couple([still, Slot()], [("arm.handle.r[2]", "slot.r")], step=0.01, duration=0.1))
    assert run.verdict == "good"
    assert all(estimate.error == 0.0 for estimate in run.estimates)
    assert "; both runs are equal except for rounding; an event" in run.why


class Slot(BuiltInSlave):
    """Takes a position and does nothing."""

    def __init__(self) -> None:
        super().__init__("slot", [("r", "m")], [("F", "N")])

    def outputs(self) -> dict[str, float]:
        return {"F": 0.0}


@pytest.mark.parametrize(
    ("inner", "varies", "step", "expected"),
    [
        (None, True, 1e-3, 4),
        (None, True, 0.2e-3, 1),
        (None, True, 1.1e-3, 5),
        (0.125e-3, True, 1e-3, 4),  # eight inner steps: two in a part
        (0.25e-3, False, 1e-3, 4),
        (0.5e-3, False, 1e-3, 2),  # no part is shorter than the inner step
        (1e-3, False, 1e-3, 1),
        (0.1e-3, False, 0.7e-3, 7),  # seven inner steps have no other equal parts
        (0.3e-3, False, 1e-3, 1),
        (0.3e-3, True, 1e-3, 4),
    ],
)
def test_parts_of_a_step_are_made_of_inner_steps(inner: float | None, varies: bool, step: float, expected: int) -> None:
    slave = Wall("y", 0.0, 1.0)
    slave.internal_step, slave.can_vary_step = inner, varies
    assert parts(slave, step, 0.25e-3) == expected


def test_looking_leaves_a_run_as_it_is() -> None:
    """Parts of whole inner steps give the same bits."""
    runs = [run_system(pushed(smooth(), 0.002), resolution=r) for r in (np.inf, 0.25e-3)]
    assert runs[0].columns["arm.q[1]"].tobytes() == runs[1].columns["arm.q[1]"].tobytes()


@pytest.mark.parametrize("value", [0.0, 1e-9, -1.0, float("nan")])
def test_a_resolution_that_is_none_is_refused(value: float) -> None:
    with pytest.raises(BadInput, match="resolution_s: found"):
        pushed(Shaking(), 0.002, resolution=value)


# ---- what an unstable run is advised to do
class Stiff(BuiltInSlave):
    """A spring from where the hand begins."""

    def __init__(self, *, can_rollback: bool) -> None:
        super().__init__("spring", [("r", "m")], [("F", "N")])
        self.can_rollback, self.anchor = can_rollback, float(Slave(load_model(ARM), start=NEAR).get("handle.r[1]")[0]) + 0.01

    def outputs(self) -> dict[str, float]:
        return {"F": 1e4 * (self.anchor - self.inputs["r"])}


@pytest.mark.parametrize("can_rollback", [True, False])
def test_the_advice_names_what_the_partners_can_do(can_rollback: bool) -> None:
    arm = Slave(load_model(ARM), start=NEAR, name="arm")
    lines = [("arm.handle.r[1]", "spring.r"), ("spring.F", "arm.handle.F[1]")]
    with pytest.raises(CoupledError, match="unstable") as error:
        run_system(couple([arm, Stiff(can_rollback=can_rollback)], lines, step=0.005, duration=1.0))
    advice = "the motion port of arm for a contact that is a spring and a damper"
    if can_rollback:
        assert str(error.value).endswith(f"take a shorter step, the iterated algorithm or {advice}")
    else:
        assert str(error.value).endswith(f"take a shorter step or {advice} (no iteration is possible: no rollback in spring)")


def test_an_arm_that_pushes_has_its_contact_inside_already() -> None:
    arms = [
        Slave(load_model(ARM), port=port, start=NEAR, rest=port == "motion", name=name)
        for name, port in (("led", "force"), ("leading", "motion"))
    ]
    lines = [("led.handle.r", "leading.robot.r"), ("led.handle.v", "leading.robot.v"), ("leading.contact.F", "led.handle.F")]
    with pytest.raises(CoupledError, match=r"take a shorter step or the iterated algorithm$"):
        run_system(couple(arms, lines, step=0.001, duration=0.5))


def test_what_ends_with_an_error_keeps_the_run_that_was_made() -> None:
    wave = smooth()

    def hang() -> None:
        raise SlaveError("terminate", Status.FATAL, "it does not return within 3 s")

    wave.terminate = hang  # type: ignore[method-assign]
    with pytest.raises(CoupledError) as error:
        run_system(pushed(wave, 0.01))
    run: CoupledRun = error.value.run
    assert run.verdict == "failed"
    assert "wave: it does not return within 3 s" in str(error.value)
    assert len(run.t) == 21


COUNTER = """
from pythonfmu3 import Fmi3Causality, Fmi3Slave, Fmi3Variability, Int32, Int64


class Counter(Fmi3Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.taken, self.given = 0, 3_000_000_000
        settings = {"variability": Fmi3Variability.discrete}
        self.register_variable(Int32("taken", causality=Fmi3Causality.input, start=0, **settings))
        self.register_variable(Int64("given", causality=Fmi3Causality.output, start=3_000_000_000, **settings))

    def do_step(self, current_time, step_size):
        return True
"""


def test_an_integer_that_its_input_cannot_hold_is_refused_and_not_wrapped(tmp_path: Path) -> None:
    counter = built(tmp_path, COUNTER, "Counter", fmi=3)
    with ImportedSlave(counter, name="a") as a, ImportedSlave(counter, name="b") as b:
        system = couple([a, b], [("a.given", "b.taken")], step=0.1, duration=0.2)
        with pytest.raises((CoupledError, SlaveError), match="3000000000, allowed is an integer from -2147483648 to 2147483647"):
            run_system(system)
