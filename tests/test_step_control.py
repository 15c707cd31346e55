"""Step control: communication steps whose lengths follow from their errors."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from armrs.cosim import Slave
from armrs.cosim.coupled_run import CoupledRun
from armrs.cosim.error_estimate import run_checked
from armrs.cosim.haptic_wall import Wall
from armrs.cosim.master import run_system
from armrs.cosim.sources_and_controllers import Wave
from armrs.cosim.ssp import load_ssp
from armrs.cosim.ssp_export import export_ssp
from armrs.cosim.step_control import StepControl
from armrs.cosim.system import System, couple, load_system
from armrs.errors import BadInput, CoupledError, SlaveError
from armrs.fmu.slave_interface import Partner

EXAMPLES = Path(__file__).parents[1] / "examples" / "cosim"


def against_a_wall(step: float, shortest: float | None, wall: Partner | None = None, algorithm: str = "iterated") -> System:
    arm = load_system(EXAMPLES / "wall.toml").slaves["arm"]
    wall = wall or Wall("y", 0.1, 3000.0, 3000.0)
    lines = [("arm.handle.r", "wall.r"), ("arm.handle.v", "wall.v"), ("wall.F", "arm.handle.F")]
    return couple([arm, wall], lines, algorithm=algorithm, step=step, duration=2.0, shortest_step=shortest)


@pytest.fixture(scope="module")
def fine() -> CoupledRun:
    return run_system(against_a_wall(0.125e-3, None))


def off(run: CoupledRun, fine: CoupledRun, name: str) -> float:
    return float(np.max(np.abs(run.columns[name] - np.interp(run.t, fine.t, fine.columns[name]))))


def test_short_steps_are_made_where_they_are_needed(fine: CoupledRun) -> None:
    """An arm swings against a wall: one length of 1 ms throughout is no better than 712 steps of 1 to 16 ms."""
    run = run_checked(against_a_wall(0.016, 0.001))
    assert run.verdict == "good"
    steps = np.diff(run.t)
    assert steps.max() == pytest.approx(0.016)
    assert len(steps) < 0.5 * 2.0 / 0.001
    # Shorter while it touches than while it swings freely.
    touches = run.columns["wall.F[1]"][1:] < 0.0
    assert np.mean(steps[touches]) < 0.5 * np.mean(steps[~touches])
    even = run_system(against_a_wall(0.004, None))
    assert len(even.t) < len(run.t)
    assert off(run, fine, "wall.F[1]") < 0.2 * off(even, fine, "wall.F[1]")
    for estimate in run.estimates:
        if estimate.name in ("arm.q[1]", "arm.q[2]", "wall.F[1]"):
            error = off(run, fine, estimate.name)
            assert 0.5 * error <= estimate.error <= 2.0 * error
            assert error <= estimate.allowed


def test_without_it_all_steps_are_as_before() -> None:
    arm = load_system(EXAMPLES / "wall.toml").slaves["arm"]
    run = run_system(couple([arm], [], step=0.03, duration=0.1))
    assert run.t.tolist() == [0.0, 0.03, 0.06, 0.09, 0.1]


@pytest.mark.parametrize("duration", [0.1, 0.1003, 0.0997])
def test_steps_are_whole_numbers_of_the_shortest(duration: float) -> None:
    system = dataclasses.replace(against_a_wall(0.01, 0.0005), duration=duration)
    pace = StepControl(system)
    ends = []
    for error in [*np.random.default_rng(1).uniform(0.0, 3.0, 1000)]:
        if (end := pace.end) is None:
            break
        ends.append(end)
        assert 0.0 < end - pace.begin < 0.0100001
        pace.go_on(float(error))
    assert pace.end is None
    assert ends[-1] == duration
    whole = np.array(ends[:-1]) / 0.0005
    np.testing.assert_allclose(whole, np.round(whole), atol=1e-9)


def test_a_step_is_shortened_until_there_is_no_shorter_one() -> None:
    pace = StepControl(against_a_wall(0.004, 0.001))
    for _ in range(4):
        pace.go_on(0.0)
    assert pace.end == pytest.approx(pace.begin + 0.004)
    assert not pace.shorten(1.9)
    assert pace.shorten(4.0)
    assert pace.end == pytest.approx(pace.begin + 0.001)
    assert not pace.shorten(1e9)


def test_partners_that_cannot_go_back_repeat_nothing() -> None:
    class Onward(Wave):
        can_rollback = False

        def set_state(self, state: object) -> None:
            raise AssertionError("it cannot go back")

    arm = Slave(EXAMPLES / "arm.toml", start=np.radians([-60.0, 50.0]), rest=True, name="arm")
    wave = Onward("sine", amplitude=2.0, frequency=1.0, unit="N", name="wave")
    run = run_checked(couple([wave, arm], [("wave.y", "arm.handle.F[1]")], step=0.016, duration=1.0, shortest_step=0.001))
    assert run.verdict == "good"
    assert len(set(np.diff(run.t).round(9))) > 3


class Ending(Wall):
    """A wall that fails at 0.5 s, in one of several ways."""

    def __init__(self, way: str) -> None:
        super().__init__("y", 10.0, 1.0)
        self.way = way

    def get(self, names: object) -> np.ndarray:
        if self.way == "nan" and self._time > 0.5:
            return np.full_like(super().get(names), np.nan)  # type: ignore[arg-type]
        if self.way == "fatal" and self._time > 0.5:
            raise SlaveError("get", 4, "it is gone")
        return super().get(names)  # type: ignore[arg-type]

    def set_state(self, state: object) -> None:
        if self.way == "fatal" and self._time > 0.5:
            raise AssertionError("it is gone")
        super().set_state(state)


@pytest.mark.parametrize(("way", "verdict"), [("nan", "diverged"), ("fatal", "failed")])
def test_a_partner_that_fails_ends_the_run_as_before(way: str, verdict: str) -> None:
    with pytest.raises(CoupledError, match=verdict) as error:
        run_system(against_a_wall(0.016, 0.001, Ending(way)))
    assert 0.48 < error.value.run.t[-1] <= 0.501


@pytest.mark.parametrize(
    ("shortest", "words"), [(0.0, "shortest_step_s: found 0.0"), (0.1, "shortest_step_s: found 0.1"), (1e-9, "at most 10000000")]
)
def test_a_shortest_step_that_is_none_is_refused(shortest: float, words: str) -> None:
    with pytest.raises(BadInput, match=words):
        against_a_wall(0.016, shortest)


def test_a_partner_that_cannot_vary_its_step_is_named() -> None:
    wall = Wall("y", 0.1, 3000.0)
    wall.can_vary_step = False
    with pytest.raises(BadInput, match=r"shortest_step_s: found 0.001, allowed none, for wall cannot vary its step"):
        against_a_wall(0.016, 0.001, wall)


def test_it_goes_into_an_archive_and_comes_back(tmp_path: Path) -> None:
    arm = Slave(EXAMPLES / "arm.toml", start=np.radians([-60.0, 50.0]), name="arm")
    other = Slave(EXAMPLES / "arm.toml", name="other")
    system = couple([arm, other], [], step=0.01, duration=0.1, shortest_step=0.0005, resolution=0.001)
    read = load_ssp(export_ssp(system, tmp_path / "two.ssp"))
    assert (read.shortest_step, read.resolution) == (0.0005, 0.001)
    read.free()
