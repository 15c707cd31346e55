"""One conformance suite for the slave in Python and in FMUs of both versions: life cycle, states, bits."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from armrs import Joint, Model, simulate
from armrs.cosim import Partner, Slave, Status
from armrs.cosim.fmu_export import export_fmu
from armrs.demo import true_model
from armrs.errors import BadInput, SlaveError
from armrs.fmu.imported_slave import ImportedSlave
from armrs.model import Contact, Effect, Segment

KINDS = ("python", "fmi2", "fmi3")
START = np.radians([-60.0, 50.0])
ENDS = ("q[1]", "q[2]", "qd[1]", "qd[2]", "energy")
Make = Callable[..., Partner]


def model() -> Model:
    """Brakes, a spring, a state of its own: everything that a state must keep."""
    effects = (
        Effect("relaxation", 1, parameters={"stiffness": 2.0, "time": 0.5}),
        Effect("tremor", 2, parameters={"amplitude": 0.02, "frequency": 6.0}),
    )
    return true_model().replace(contact=Contact((2000.0, 2000.0), (20.0, 20.0)), effects=(*true_model().effects, *effects))


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[tuple[str, str], Path]:
    folder = tmp_path_factory.mktemp("dir with ä 100% space")
    return {
        (port, f"fmi{fmi}"): export_fmu(model(), folder / f"{port}{fmi}.fmu", fmi=fmi, port=port, start=START, name="arm")
        for port in ("force", "motion")
        for fmi in (2, 3)
    }


@pytest.fixture(params=KINDS)
def make(request: pytest.FixtureRequest, files: dict[tuple[str, str], Path]) -> Iterator[Make]:
    made: list[Partner] = []

    def new(port: str = "force", kind: str = request.param) -> Partner:
        slave = Slave(model(), port=port, start=START) if kind == "python" else ImportedSlave(files[port, kind], name="arm")
        made.append(slave)
        return slave

    yield new
    for slave in made:
        slave.free()


def ready(slave: Partner, stop: float | None = None) -> Partner:
    slave.enter_initialization_mode(0.0, stop)
    slave.exit_initialization_mode()
    return slave


def run(slave: Partner, step: float, steps: int, first: int = 0) -> list[str]:
    """Steps under inputs that depend on time alone, and the bits of what comes out."""
    inputs = [name for name in slave.variables if name.startswith(("handle.F", "robot.v"))]
    for k in range(first, first + steps):
        slave.set(inputs, [0.01 * (k % 7), -0.02 * (k % 3)])
        assert slave.do_step(k * step, step).status == Status.OK
    return [float(v).hex() for v in slave.get(ENDS)]


@pytest.mark.parametrize("port", ["force", "motion"])
def test_every_start_value_is_that_of_the_description(make: Make, port: str) -> None:
    slave = make(port)
    known = [v for v in slave.variables.values() if v.start is not None]
    assert len(known) > 20
    for v in known:
        assert float(slave.get(v.name)[0]).hex() == float(v.start).hex(), v.name


def test_calculated_values_before_the_first_step(make: Make) -> None:
    slave = make()
    at = slave.get(["handle.r[1]", "handle.r[2]"])
    slave.enter_initialization_mode(2.0)
    slave.set("q[2]", 0.0)
    assert not np.array_equal(slave.get(["handle.r[1]", "handle.r[2]"]), at)
    slave.set("q[2]", START[1])
    assert np.array_equal(slave.get(["handle.r[1]", "handle.r[2]"]), at)
    slave.exit_initialization_mode()
    assert slave.do_step(2.0, 0.01).last_successful_time == 2.01


CALLS: dict[str, Callable[[Partner], object]] = {
    "enter": lambda s: s.enter_initialization_mode(0.0),
    "exit": lambda s: s.exit_initialization_mode(),
    "set input": lambda s: s.set("handle.F[1]", 1.0),
    "set parameter": lambda s: s.set("body[1].m", 1.5),
    "set start": lambda s: s.set("q[1]", -1.0),
    "set output": lambda s: s.set("handle.r[1]", 0.0),
    "set constant": lambda s: s.set("solver.h", 1e-3),
    "get": lambda s: s.get(["q[1]", "handle.r[1]", "energy", "handle.F[1]", "body[1].m"]),
    "derivatives": lambda s: s.get_output_derivatives(["q[1]"]),  # type: ignore[attr-defined]
    "step": lambda s: s.do_step(0.0, 0.01),
    "state": lambda s: s.set_state(s.get_state()),
    "terminate": lambda s: s.terminate(),
    "reset": lambda s: s.reset(),
}
ALLOWED = {
    "instantiated": {"enter", "set input", "set parameter", "set start", "get", "state", "reset"},
    "initialization": {"exit", "set input", "set parameter", "set start", "get", "state", "reset"},
    "step": {"set input", "get", "derivatives", "step", "state", "terminate", "reset"},
    "terminated": {"get", "derivatives", "state", "reset"},
    "failed": {"get", "state", "reset"},
}
WAYS: dict[str, list[str]] = {
    "instantiated": [],
    "initialization": ["enter"],
    "step": ["enter", "exit"],
    "terminated": ["enter", "exit", "terminate"],
    "failed": ["enter", "exit", "set constant"],
}


@pytest.mark.parametrize("state", ALLOWED)
@pytest.mark.parametrize("call", CALLS)
def test_every_call_in_every_state(make: Make, state: str, call: str) -> None:
    slave = make()
    for way in WAYS[state]:
        if way == "set constant":
            with pytest.raises(SlaveError):
                CALLS[way](slave)
        else:
            CALLS[way](slave)
    if call in ALLOWED[state]:
        CALLS[call](slave)
        return
    with pytest.raises(SlaveError) as refused:
        CALLS[call](slave)
    assert refused.value.status == Status.ERROR
    assert "slave is" in refused.value.message or "slave cannot" in refused.value.message
    # After an error it can be reset, and lives again.
    slave.reset()
    ready(slave)
    assert slave.do_step(0.0, 0.01).status == Status.OK


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_values_that_are_no_numbers_are_discarded_and_nothing_is_set(make: Make, bad: float) -> None:
    slave = ready(make())
    slave.set(["handle.F[1]", "handle.F[2]"], [1.0, 2.0])
    with pytest.raises(SlaveError, match=r"handle.F\[2\] is .*allowed is a finite number") as refused:
        slave.set(["handle.F[1]", "handle.F[2]"], [3.0, bad])
    assert refused.value.status == Status.DISCARD
    assert list(slave.get(["handle.F[1]", "handle.F[2]"])) == [1.0, 2.0]
    assert slave.do_step(0.0, 0.01).status == Status.OK


def test_values_out_of_range_are_discarded(make: Make) -> None:
    slave = make()
    # The least is that of a positive number, since the core takes no mass of zero.
    for bad in (-1.0, 0.0):
        with pytest.raises(SlaveError, match=r"allowed is a finite number, 1.1754943508222875e-38 to inf kg") as refused:
            slave.set("body[1].m", bad)
        assert refused.value.status == Status.DISCARD
    ready(slave)
    assert slave.do_step(0.0, 0.01).status == Status.OK


@pytest.mark.parametrize(
    ("time", "step", "message"),
    [
        (0.1, 0.01, "a step from 0.1 s was asked for, the slave is at 0 s"),
        (0.0, 0.0, "communication step is 0"),
        (0.0, -0.01, "communication step is -0.01"),
        (0.0, 1e9, "to 1000000000 s was asked for, the run ends at 1 s"),
        (0.0, 1.5, "to 1.5 s was asked for, the run ends at 1 s"),
        (np.nan, 0.01, "NaN"),
        (0.0, np.nan, "NaN"),
    ],
)
def test_steps_that_are_refused(make: Make, time: float, step: float, message: str) -> None:
    slave = ready(make(), stop=1.0)
    with pytest.raises(SlaveError, match=message) as refused:
        slave.do_step(time, step)
    assert refused.value.status == Status.ERROR


@pytest.mark.parametrize("offset", [0.0, 0.5e-3, 2e-3])
def test_with_unix_time_a_step_from_a_wrong_time_is_refused(make: Make, offset: float) -> None:
    slave, start = make(), 1.7e9
    slave.enter_initialization_mode(start)
    slave.exit_initialization_mode()
    slave.do_step(start, 1e-3)
    with pytest.raises(SlaveError, match=r"was asked for, the slave is at 1700000000\.001 s"):
        slave.do_step(start + offset, 1e-3)


@pytest.mark.parametrize(("start", "stop"), [(np.nan, None), (np.inf, None), (1.0, 0.5), (0.0, np.nan)])
def test_times_that_are_refused(make: Make, start: float, stop: float | None) -> None:
    with pytest.raises(SlaveError, match="time is"):
        make().enter_initialization_mode(start, stop)


def test_a_step_that_diverges_is_discarded_and_leaves_no_trace(make: Make) -> None:
    slave = ready(make())
    before = run(slave, 0.01, 5)
    slave.set(["handle.F[1]", "handle.F[2]"], [1e300, 1e300])
    done = slave.do_step(0.05, 0.01)
    assert done.status == Status.DISCARD
    assert done.last_successful_time == pytest.approx(0.05)
    assert "not finite" in done.message
    assert [float(v).hex() for v in slave.get(ENDS)] == before


@pytest.mark.parametrize("port", ["force", "motion"])
def test_going_back_gives_the_same_bits(make: Make, port: str) -> None:
    slave = ready(make(port))
    run(slave, 0.01, 50)
    state = slave.get_state()
    once = run(slave, 0.01, 50, first=50)
    slave.set_state(state)
    assert run(slave, 0.01, 50, first=50) == once
    other = make(port)  # a state goes into another instance of the same arm, in whatever mode it is
    with pytest.raises(SlaveError):
        other.exit_initialization_mode()
    other.set_state(state)
    assert run(other, 0.01, 50, first=50) == once
    slave.free_state(state)


def test_states_keep_parameters_and_inputs(make: Make) -> None:
    slave = make()
    slave.enter_initialization_mode(0.0)
    slave.set("body[2].m", 2.0)
    slave.exit_initialization_mode()
    slave.set("handle.F[1]", 3.0)
    state = slave.get_state()
    once = float(slave.get("energy")[0]).hex()
    slave.reset()
    assert slave.get("body[2].m")[0] != 2.0
    slave.set_state(state)
    assert list(slave.get(["body[2].m", "handle.F[1]"])) == [2.0, 3.0]
    assert float(slave.get("energy")[0]).hex() == once
    slave.free_state(state)


def test_bytes_of_a_state_are_the_same_everywhere(make: Make) -> None:
    slave = ready(make("motion"))
    run(slave, 0.01, 50)
    state = slave.get_state()
    written = slave.serialize_state(state)  # type: ignore[attr-defined]
    slave.free_state(state)
    once = run(slave, 0.01, 50, first=50)
    for kind in KINDS:
        other = make("motion", kind)
        read = other.deserialize_state(written)  # type: ignore[attr-defined]
        other.set_state(read)
        other.free_state(read)
        assert run(other, 0.01, 50, first=50) == once


def test_bytes_that_are_no_state_are_refused(make: Make) -> None:
    slave, other = ready(make("motion")), ready(make("force"))
    state = slave.get_state()
    good = slave.serialize_state(state)  # type: ignore[attr-defined]
    slave.free_state(state)
    bad = [b"", b"x", bytes(200), good[:-1], good + b"\0", good[:40] + b"\1" + good[41:], good[: len(good) // 2]]
    for content in bad:
        with pytest.raises(SlaveError):
            slave.deserialize_state(content)  # type: ignore[attr-defined]
    foreign = other.deserialize_state(good)  # type: ignore[attr-defined]
    with pytest.raises(SlaveError, match="the state belongs to"):
        other.set_state(foreign)
    other.free_state(foreign)
    assert other.do_step(0.0, 0.01).status == Status.OK


def test_a_state_goes_into_a_new_process(files: dict[tuple[str, str], Path], tmp_path: Path) -> None:
    with ImportedSlave(files["motion", "fmi3"]) as slave:
        ready(slave)
        run(slave, 0.01, 10)
        state = slave.get_state()
        (tmp_path / "state").write_bytes(slave.serialize_state(state))
        slave.free_state(state)
        once = run(slave, 0.01, 10, first=10)
    script = (
        "import sys; sys.path.insert(0, sys.argv[3]); from pathlib import Path; from armrs.fmu.imported_slave import ImportedSlave; from test_slave import run\n"
        "with ImportedSlave(sys.argv[1]) as s:\n"
        "    state = s.deserialize_state(Path(sys.argv[2]).read_bytes()); s.set_state(state); s.free_state(state)\n"
        "    print(run(s, 0.01, 10, first=10))"
    )
    arguments = [str(files["motion", "fmi3"]), str(tmp_path / "state"), str(Path(__file__).parent)]
    done = subprocess.run([sys.executable, "-c", script, *arguments], capture_output=True, text=True, check=False)
    assert done.stdout.strip() == str(once), done.stderr


# What 120 steps of 1/60 s end with. Renew it where the core, the integrator or the cutting of steps changes, and say so.
GOLDEN = {
    "force": ("-0x1.c66ecd910fbcep+0", "-0x1.8189fe33dc90fp-3", "0x1.320c07d0ffffap+0", "0x1.07d6868c18e59p-7", "-0x1.ec67df1cf74a3p+2"),
    "motion": ("-0x1.0f3f38e578dccp+0", "0x1.c5b31efd9465fp-1", "0x1.dabe477158a93p-13", "-0x1.bef354eb4ca66p-15", "-0x1.8d12ee0fad58dp+2"),
}


@pytest.mark.parametrize("port", ["force", "motion"])
def test_steps_of_any_length_have_the_same_bits_everywhere(port: str, files: dict[tuple[str, str], Path]) -> None:
    ends = {}
    for kind in KINDS:
        made = Slave(model(), port=port, start=START) if kind == "python" else ImportedSlave(files[port, kind])
        with made as slave:
            for step, steps in ((1e-3, 2000), (0.01, 200), (0.1, 20), (0.02, 100)):
                ready(slave)
                for k in range(steps):
                    slave.do_step(k * step, step)
                ends[kind, step] = tuple(float(v).hex() for v in slave.get(ENDS))
                slave.reset()
            ready(slave)
            for k in range(120):
                slave.do_step(k / 60, 1 / 60)
            ends[kind, 1 / 60] = tuple(float(v).hex() for v in slave.get(ENDS))
    # Whole inner steps: the communication step does not matter to the last bit.
    assert len({ends[kind, step] for kind in KINDS for step in (1e-3, 0.01, 0.1, 0.02)}) == 1
    uneven = {ends[kind, 1 / 60] for kind in KINDS}
    assert uneven == {GOLDEN[port]}
    near = [float.fromhex(v) for v in ends["python", 0.01]]
    np.testing.assert_allclose([float.fromhex(v) for v in uneven.pop()], near, atol=1e-6)


def test_the_bits_are_those_of_the_native_simulator(make: Make) -> None:
    """Free motion, the arm swinging with all its effects: the same run as `armrs.simulate`."""
    reference = simulate(model(), None, start=START, start_speed=np.zeros(2), duration=2.0, rate=100.0)
    slave = ready(make("force"))
    for k in range(200):
        slave.do_step(k * 0.01, 0.01)
        if k % 40 == 39:
            assert [v.hex() for v in slave.get(["q[1]", "q[2]", "qd[1]", "qd[2]"]).tolist()] == [
                v.hex() for v in [*reference.q[k + 1].tolist(), *reference.qd[k + 1].tolist()]
            ]


@pytest.mark.parametrize("kind", KINDS)
def test_at_rest_the_contact_carries_the_weight(kind: str, tmp_path: Path) -> None:
    """F on the robot = −J⁻ᵀ G, from the textbook's formulas of two links; the same after a second."""
    (a1, l1, m1), (a2, l2, m2) = (0.322, 0.186, 2.114), (0.264, 0.121, 1.264)
    segments = (Segment("upper arm", a1, m1, l1, 0.0165), Segment("forearm", a2, m2, l2, 0.0074))
    arm = Model(segments, (Joint("shoulder"), Joint("elbow")), contact=Contact((10000.0, 10000.0), (25.0, 25.0)))
    slave: Partner = Slave(arm, port="motion", start=START, rest=True)
    if kind != "python":
        slave = ImportedSlave(export_fmu(slave, tmp_path / "arm.fmu", fmi=int(kind[-1])))
    with slave:
        ready(slave)
        for at in range(2):
            q1, q2 = slave.get(["q[1]", "q[2]"])
            (c1, s1), (c12, s12) = ((np.cos(q), np.sin(q)) for q in (q1, q1 + q2))
            gravity = 9.81 * np.array([m1 * l1 * c1 + m2 * (a1 * c1 + l2 * c12), m2 * l2 * c12])
            jacobian = np.array([[-a1 * s1 - a2 * s12, -a2 * s12], [a1 * c1 + a2 * c12, a2 * c12]])
            on_arm = np.linalg.solve(jacobian.T, gravity)
            assert np.abs(on_arm).max() > 5.0
            np.testing.assert_allclose(slave.get(["contact.F[1]", "contact.F[2]"]), -on_arm, rtol=0.0, atol=1e-9)
            if at == 0:
                slave.do_step(0.0, 1.0)


def test_free_motion_keeps_its_energy() -> None:
    bare = true_model().replace(joints=tuple(type(j)(j.name) for j in true_model().joints), effects=())
    slave = ready(Slave(bare, start=START))
    before = slave.get("energy")[0]
    for k in range(200):
        slave.do_step(k * 0.01, 0.01)
    assert abs(slave.get("energy")[0] - before) < 1e-6


def test_work_and_energy_balance_through_the_motion_port(make: Make) -> None:
    slave = ready(make("motion"))
    names = ["energy", "work.port", "work.tau", "work.resisted", "work.damped"]
    slave.set("robot.v[1]", 0.05)
    before = slave.get(names)
    slave.do_step(0.0, 1.0)
    energy, port, tau, resisted, damped = slave.get(names) - before
    assert abs(port) > 1e-2
    assert energy == pytest.approx(port + tau - resisted - damped, abs=1e-6)


def test_derivatives_are_those_of_the_outputs(make: Make) -> None:
    slave = ready(make("motion"))
    slave.set(["robot.v[1]", "robot.v[2]"], [0.05, 0.02])
    slave.do_step(0.0, 0.1)
    names = [v.name for v in slave.variables.values() if v.causality == "output"]
    rates, before = slave.get_output_derivatives(names), slave.get(names)  # type: ignore[attr-defined]
    slave.do_step(0.1, 1e-6)
    # A forward difference: off by half a step times the second derivative.
    np.testing.assert_allclose((slave.get(names) - before) / 1e-6, rates, atol=2e-2 * np.abs(rates).max(), rtol=1e-2)
    with pytest.raises(SlaveError, match="allowed is 1"):
        slave.get_output_derivatives(names[:1], [2])  # type: ignore[attr-defined]


def test_two_instances_do_not_touch_each_other(make: Make) -> None:
    alone = run(ready(make("motion")), 0.01, 40)
    a, b = ready(make("motion")), ready(make("motion"))
    for k in range(40):
        last = run(a, 0.01, 1, first=k)
        run(b, 0.01, 1, first=k)
    assert last == alone


def test_names_that_are_not_known(make: Make) -> None:
    with pytest.raises(BadInput, match=r"nearest known: q\[1\]"):
        make().get("q1")
