"""Where an arm comes to rest from a start, against MuJoCo: the same arm, its joints strongly damped, left alone until it rests."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from armrs import cli
from armrs.cosim import Slave
from armrs.errors import BadInput
from armrs.model import Contact, Effect, Joint, Model, Segment

LINKS = ((0.322, 2.114, 0.186, 0.0165), (0.264, 1.264, 0.121, 0.0074), (0.18, 0.45, 0.07, 0.0012))
"""Length [m], mass [kg], centre of mass [m], inertia [kg m²]."""
STIFFNESS = 300.0
FREE, SPRUNG, WEAK = ((0.0, 0.0),) * 3, ((1.5, -1.2), (2.0, 0.9), (0.2, -0.3)), ((0.5, 0.3), (0.3, 0.5), (0.05, -0.4))
ARMS = {
    "two joints": (2, FREE, "force", 12),
    "two joints with springs": (2, SPRUNG, "force", 12),
    "three joints": (3, FREE, "force", 6),
    "three joints with weak springs": (3, WEAK, "force", 6),
    "two joints on a contact": (2, FREE, "motion", 12),
    "three joints on a contact": (3, FREE, "motion", 8),
    "three joints with springs on a contact": (3, SPRUNG, "motion", 8),
}
"""Joints, their stiffnesses [N m/rad] and rest angles [rad], port, starts: 64 in all."""


def arm(n: int, springs: tuple[tuple[float, float], ...], friction: float = 0.0) -> Model:
    segments = tuple(Segment(f"s{k}", *LINKS[k]) for k in range(n))
    joints = tuple(Joint(f"j{k}", stiffness=springs[k][0], rest=springs[k][1]) for k in range(n))
    dry = tuple(Effect("coulomb", joint=k + 1, parameters={"torque": friction, "smoothing": 0.0}) for k in range(n) if friction)
    return Model(segments, joints, contact=Contact((STIFFNESS, STIFFNESS), (5.0, 5.0)), effects=dry)


def world(n: int, springs: tuple[tuple[float, float], ...], joint: str, handle: tuple[float, float] | None = None) -> object:
    """Return the arm in MuJoCo; the handle pulls its tip by a tendon without length."""
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install mujoco")
    inside = ""
    for k in reversed(range(n)):
        length, mass, centre, inertia = LINKS[k]
        spring = f'stiffness="{springs[k][0]}" springref="{np.degrees(springs[k][1])}"'
        at = LINKS[k - 1][0] if k else 0.0
        tip = f'<site name="tip" pos="{length} 0 0"/>' if k == n - 1 else ""
        inside = (
            f'<body pos="{at} 0 0"><joint type="hinge" axis="0 -1 0" {spring} {joint}/>'
            f'<inertial pos="{centre} 0 0" mass="{mass}" diaginertia="{inertia} {inertia} {inertia}"/>{tip}{inside}</body>'
        )
    pull = ""
    if handle is not None:
        inside += f'<site name="handle" pos="{handle[0]} 0 {handle[1]}"/>'
        ends = '<site site="tip"/><site site="handle"/>'
        pull = f'<tendon><spatial stiffness="{STIFFNESS}" springlength="0">{ends}</spatial></tendon>'
    step = "0.005" if "damping" in joint else "0.0005"
    option = f'<option timestep="{step}" integrator="implicitfast" gravity="0 0 -9.81"><flag contact="disable"/></option>'
    return mujoco.MjModel.from_xml_string(f"<mujoco>{option}<worldbody>{inside}</worldbody>{pull}</mujoco>")


def settled(model: object, q: np.ndarray) -> np.ndarray:
    import mujoco

    data = mujoco.MjData(model)
    data.qpos[:] = q
    for _ in range(800):
        mujoco.mj_step(model, data, nstep=500)
        if np.abs(data.qvel).max() < 1e-8:
            return np.array(data.qpos)
    raise AssertionError("MuJoCo does not come to rest")


def angles(slave: Slave) -> np.ndarray:
    return np.array([slave.variables[f"q[{k + 1}]"].start for k in range(slave.model.n_joints)])


@pytest.mark.long
@pytest.mark.parametrize("case", ARMS)
def test_a_start_at_rest_is_where_a_damped_arm_settles_in_mujoco(case: str) -> None:
    n, springs, port, starts = ARMS[case]
    rng = np.random.default_rng(20261124)
    compared = 0
    for _ in range(starts):
        q = rng.uniform(-np.pi, np.pi, n)
        handle = None
        if port == "motion":
            held = np.cumsum(q + rng.uniform(-0.3, 0.3, n))
            lengths = [LINKS[k][0] for k in range(n)]
            handle = (float(lengths @ np.cos(held)), float(lengths @ np.sin(held)))
        expected = settled(world(n, springs, 'damping="20"', handle), q)
        if np.abs(expected - q).max() > np.pi:
            with pytest.raises(BadInput, match="more than half a turn"):
                Slave(arm(n, springs), port=port, start=q, rest=True, handle=handle)
            continue
        found = Slave(arm(n, springs), port=port, start=q, rest=True, handle=handle)
        np.testing.assert_allclose(angles(found), expected, rtol=0.0, atol=5e-6)
        compared += 1
    assert compared >= starts / 2


def test_an_arm_with_dry_friction_stays_in_mujoco_where_it_rests() -> None:
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install mujoco")
    rng = np.random.default_rng(20261125)
    model = world(2, FREE, 'frictionloss="0.8" solreffriction="0.001 1"')
    held = 0
    for _ in range(16):
        q = rng.uniform([-2.8, -1.2], [-0.3, 1.2])
        rest = angles(Slave(arm(2, FREE, friction=0.8), start=q, rest=True))
        held += rest[1] == q[1]
        data = mujoco.MjData(model)
        data.qpos[:] = rest
        # MuJoCo's friction creeps under its load: 0.3 s, in which an arm without friction falls by many degrees.
        mujoco.mj_step(model, data, nstep=600)
        np.testing.assert_allclose(data.qpos, rest, rtol=0.0, atol=2e-3)
    assert held >= 4


def test_what_friction_cannot_hold_slides_in_mujoco_to_where_it_can() -> None:
    """From where the other joints rest: how they come there would move the dry one as well."""
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install mujoco")
    rng = np.random.default_rng(20261126)
    springs = ((0.0, 0.0), (0.0, 0.0), (1.2, 0.2))

    def resting(friction: float, near: np.ndarray, handle: tuple[float, float]) -> np.ndarray:
        dry = (Effect("coulomb", joint=3, parameters={"torque": friction, "smoothing": 0.0}),)
        return angles(Slave(arm(3, springs).replace(effects=dry), port="motion", start=near, rest=True, handle=handle))

    slid = 0
    for _ in range(12):
        q = np.array([-1.0, 1.0, 0.3]) + rng.uniform(-0.3, 0.3, 3) + (0.0, 0.0, rng.uniform(-0.5, 0.5))
        at, lengths = np.cumsum(q), np.array([link[0] for link in LINKS])
        handle = (float(lengths @ np.cos(at)), float(lengths @ np.sin(at)))
        near = resting(50.0, q, handle)
        assert near[2] == q[2]
        rest = resting(0.3, near, handle)
        model = world(3, springs, 'damping="2"', handle)
        model.dof_frictionloss[2] = 0.3
        # As hard as its solver has it, MuJoCo's friction creeps by half a milliradian meanwhile.
        model.dof_solref[2], model.dof_solimp[2] = (0.001, 1.0), (0.99999, 0.99999, 0.001, 0.5, 2.0)
        data = mujoco.MjData(model)
        data.qpos[:] = near
        mujoco.mj_step(model, data, nstep=2600)
        np.testing.assert_allclose(rest, data.qpos, rtol=0.0, atol=2e-3)
        slid += abs(rest[2] - near[2]) > 0.01
    assert 4 <= slid < 12


@pytest.mark.parametrize("start", ["-60,50", "-60,80", "-45,45", "-90,90", "-10,-20"])
def test_the_example_hangs_from_every_start_near(start: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    example = Path(__file__).parents[1] / "examples" / "cosim" / "arm.toml"
    target = str(tmp_path / "arm.fmu")
    assert cli.main(["fmu", "export", str(example), "-o", target, f"--start-deg={start}", "--rest"]) == 0
    capsys.readouterr()
    assert cli.main(["fmu", "info", target]) == 0
    printed = {line.split()[0]: line.split()[-1] for line in capsys.readouterr().out.splitlines() if line.startswith("q[")}
    np.testing.assert_allclose([float(printed["q[1]"]), float(printed["q[2]"])], [-np.pi / 2, 0.0], rtol=0.0, atol=1e-9)


def test_what_does_not_rest_near_is_refused_by_name() -> None:
    """Upright it would fall either way; folded back it turns more than half; a moment that nothing balances turns it for ever."""
    with pytest.raises(BadInput, match=r"start: found an unstable equilibrium, such as .* allowed angles near which"):
        Slave(arm(2, FREE), start=np.radians([90.0, 0.0]), rest=True)
    with pytest.raises(BadInput, match=r"joint 2 comes to rest -190° from its angle.*rests at 270,-360°"):
        Slave(arm(2, FREE), start=np.radians([170.0, -170.0]), rest=True)
    np.testing.assert_allclose(angles(Slave(arm(2, FREE), start=np.radians([270.0, -360.0]), rest=True)), np.radians([270.0, -360.0]))
    driven = arm(2, FREE).replace(effects=(Effect("constant_moment", joint=1, parameters={"moment": 50.0}),))
    with pytest.raises(BadInput, match="joint 1 turns more than twice: no spring or weight holds it"):
        Slave(driven, start=np.radians([-60.0, 50.0]), rest=True)
