"""URDF and MJCF come back as they went, and the exported arm moves in MuJoCo, Pinocchio and OpenSim as it does here."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import armrs
from armrs import cli
from armrs._armrs import Rig
from armrs.io.multibody import read_model

SEGMENTS = (
    armrs.Segment("upper arm", 0.322, 2.114, 0.186, 0.0165),
    armrs.Segment("forearm", 0.264, 1.264, 0.121, 0.0074, com_normal=0.01),
    armrs.Segment("hand", 0.093, 0.753, 0.071, 0.0016),
)
JOINTS = (
    armrs.Joint("shoulder", stiffness=1.2, rest=-0.7, viscosity=0.25),
    armrs.Joint("elbow", stiffness=0.8, rest=0.6, viscosity=0.2),
    armrs.Joint("wrist", stiffness=0.5, viscosity=0.1),
)
SMOOTH = armrs.Model(SEGMENTS, JOINTS, base=(0.1, 0.4))
"""What every format with springs holds."""
RICH = armrs.Model(
    SEGMENTS,
    (*JOINTS[:2], armrs.Joint("wrist", viscosity=0.1, coulomb=0.05)),
    effects=(armrs.Effect("motor_inertia", 1, parameters={"inertia": 0.02}), armrs.Effect("biarticular", 2, parameters={"stiffness": 0.7, "ratio": 0.8, "rest": 0.3})),
)  # fmt: skip
DAMPED = armrs.Model(SEGMENTS, tuple(armrs.Joint(j.name, viscosity=j.viscosity) for j in JOINTS))
START = np.array([-0.9, 0.5, 0.2])
STEP, STEPS = 5e-4, 4000


def swing(model: armrs.Model) -> np.ndarray:
    """A free swing of 2 s by the kernels of armrs and fourth-order Runge-Kutta, shape (STEPS + 1, n) [rad]."""
    kernels, resisting = armrs.Arm.from_model(model), Rig(model)

    def rate(state: np.ndarray) -> np.ndarray:
        q, qd = state[None, :3], state[None, 3:]
        torque = -resisting.resisting(q, qd, np.zeros((1, 3)), 1.0).reshape(1, -1)
        joints = [0, 0, 1, 1, 2, 2] if torque.shape[1] == 6 else [0, 1, 2]
        total = np.zeros((1, 3))
        for j, value in zip(joints, torque[0], strict=True):
            total[0, j] += value
        return np.concatenate([qd[0], kernels.forward_dynamics(q, qd, total)[0]])

    states = [np.concatenate([START, np.zeros(3)])]
    for _ in range(STEPS):
        x = states[-1]
        a = rate(x)
        b = rate(x + 0.5 * STEP * a)
        c = rate(x + 0.5 * STEP * b)
        d = rate(x + STEP * c)
        states.append(x + STEP / 6.0 * (a + 2.0 * b + 2.0 * c + d))
    return np.array(states)[:, :3]


def test_mujoco_moves_the_exported_arm_as_we_do(tmp_path: Path) -> None:
    mujoco = pytest.importorskip("mujoco")
    done = armrs.export_model(SMOOTH, tmp_path / "arm.xml")
    assert done.lost == ()
    model = mujoco.MjModel.from_xml_path(str(done.path))
    data = mujoco.MjData(model)
    data.qpos[:] = START
    angles = [START]
    for _ in range(STEPS):
        mujoco.mj_step(model, data)
        angles.append(data.qpos.copy())
    assert np.abs(np.array(angles) - swing(SMOOTH)).max() < 1e-6


def test_pinocchio_moves_the_exported_arm_as_we_do(tmp_path: Path) -> None:
    pin = pytest.importorskip("pinocchio")
    done = armrs.export_model(DAMPED, tmp_path / "arm.urdf")
    model = pin.buildModelFromUrdf(str(done.path))
    model.gravity.linear = np.array([0.0, 0.0, -9.81])
    data = model.createData()
    damping = np.array([j.viscosity for j in DAMPED.joints])
    # Pinocchio reads continuous joints as cosine and sine; their speeds are ours.
    q = np.array([f(a) for a in START for f in (np.cos, np.sin)])
    angles, qd = START.copy(), np.zeros(3)
    expected = swing(DAMPED)

    def rate(x: np.ndarray) -> np.ndarray:
        at = np.array([f(a) for a in x[:3] for f in (np.cos, np.sin)])
        return np.concatenate([x[3:], pin.aba(model, data, at, x[3:], -damping * x[3:])])

    x = np.concatenate([angles, qd])
    assert len(q) == model.nq
    worst = 0.0
    for k in range(STEPS):
        a = rate(x)
        b = rate(x + 0.5 * STEP * a)
        c = rate(x + 0.5 * STEP * b)
        d = rate(x + STEP * c)
        x = x + STEP / 6.0 * (a + 2.0 * b + 2.0 * c + d)
        worst = max(worst, float(np.abs(x[:3] - expected[k + 1]).max()))
    assert worst < 1e-6


@pytest.mark.parametrize("suffix", [".urdf", ".xml"])
def test_what_a_format_holds_comes_back_to_the_bit(suffix: str, tmp_path: Path) -> None:
    model = RICH if suffix == ".xml" else armrs.Model(SEGMENTS, (*DAMPED.joints[:2], RICH.joints[2]), base=(0.1, 0.4))
    again = armrs.import_model(armrs.export_model(model, tmp_path / f"arm{suffix}").path)
    assert again.segments == model.segments
    assert again.joints == model.joints
    assert sorted(again.effects, key=str) == sorted(model.effects, key=str)
    assert again.base == model.base


def test_what_a_format_cannot_hold_is_listed(tmp_path: Path) -> None:
    with_robot = RICH.replace(robot=armrs.Robot((0.45, 0.45), (1.05, -0.1)))
    lost = armrs.export_model(with_robot, tmp_path / "arm.urdf").lost
    for words in ("stiffness 1.2 N m/rad", "rotor inertia 0.02", "biarticular of joint 2", "the robot", "gravity"):
        assert any(words in line for line in lost), words
    lost = armrs.export_model(with_robot, tmp_path / "arm.osim").lost
    for words in ("dry friction 0.05", "rotor inertia", "biarticular"):
        assert any(words in line for line in lost), words


@pytest.mark.parametrize(
    ("suffix", "old", "new", "said"),
    [
        (".urdf", 'type="continuous"', 'type="revolute"', "shoulder"),
        (".xml", '<joint name="shoulder"', '<joint name="shoulder" range="-1 1"', "shoulder"),
        (".xml", '<joint name="shoulder"', '<joint name="shoulder" range="-1 1" limited="false"', None),
    ],
)
def test_stops_of_a_file_are_said_to_be_left_out(suffix: str, old: str, new: str, said: str | None, tmp_path: Path) -> None:
    path = armrs.export_model(DAMPED, tmp_path / f"arm{suffix}").path
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    notes = [note for note in read_model(path).notes if "the range of motion is left out" in note]
    assert [note.split(":")[0] for note in notes] == ([] if said is None else [said])


def edited(change: Callable[[str], str]) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        path = armrs.export_model(DAMPED, folder / "arm.urdf").path
        path.write_text(change(path.read_text()))
        return path

    return write


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda s: "<!DOCTYPE x [<!ENTITY a 'b'>]>" + s.split("?>")[1], "document type"),
        (lambda s: s.replace('xyz="1 0 0"', 'xyz="0 1 0"', 1), "as of the first joint: the arm moves in one plane"),
        (lambda s: s.replace('xyz="1 0 0"', 'xyz="0 0 1"'), "a horizontal axis"),
        (lambda s: s.replace('xyz="1 0 0"', 'xyz="0 0 0"'), "a direction"),
        (lambda s: s.replace('type="continuous"', 'type="prismatic"', 1), "continuous, revolute or fixed"),
        (lambda s: s.replace("<robot", "<sdf", 1).replace("</robot", "</sdf"), "<robot>"),
        (lambda s: s.replace('value="2.114"', 'value="heavy"'), "finite number"),
        (lambda s: s[: len(s) // 2], "well-formed"),
        (lambda s: s.replace('<axis xyz="1 0 0"', '<axis xyz="0 0 1" /><axis xyz="1 0 0"', 1), "<axis>: found 2 of them"),
        (lambda s: s.replace("<origin ", '<origin quat_xyzw="1 0 0 0" ', 1), "<origin>: found quat_xyzw"),
        (
            lambda s: s.replace("</robot>", '<gazebo reference="elbow"><springStiffness>10</springStiffness></gazebo></robot>'),
            "<gazebo 'elbow'> <springStiffness>: found '10', allowed 0",
        ),
        (
            lambda s: s.replace("</robot>", '<gazebo reference="fore"><gravity>0</gravity></gazebo></robot>'),
            "<gazebo 'fore'> <gravity>: found '0', allowed true",
        ),
    ],
)
def test_a_chain_that_is_not_planar_is_refused_by_name(change: Callable[[str], str], words: str, tmp_path: Path) -> None:
    with pytest.raises(armrs.BadInput, match=words):
        armrs.import_model(edited(change)(tmp_path))


FOREIGN = [
    ("<worldbody>", '<option><flag gravity="disable"/></option><worldbody>', "<flag> gravity: found 'disable'"),
    ("<worldbody>", '<option viscosity="5" density="1000"/><worldbody>', "<option> viscosity"),
    ("<worldbody>", '<compiler settotalmass="30"/><worldbody>', "<compiler> settotalmass"),
    ("<worldbody>", '<compiler inertiafromgeom="true"/><worldbody>', "<compiler> inertiafromgeom"),
    ("<worldbody>", '<option/><option gravity="0 0 -1"/><worldbody>', "<option>: found 2 of them"),
    ("<worldbody>", '<default/><default><joint damping="7"/></default><worldbody>', "<default>"),
    ('name="f"', 'name="f" gravcomp="1"', "<body> gravcomp"),
    ('<body name="f"', '<frame pos="0 0.1 0"/><body name="f"', "<body>: found <frame>"),
    ('<body name="f"', '<attach model="m" body="b" prefix="p"/><body name="f"', "<body>: found <attach>"),
    ("</mujoco>", '<tendon><spatial stiffness="9"><site site="hand"/></spatial></tendon></mujoco>', "<tendon>: found <spatial>"),
    ("</mujoco>", '<tendon><fixed stiffness="1" damping="5"/></tendon></mujoco>', "<tendon>: found damping"),
    (
        'diaginertia="0.01 0.01 0.01"',
        'diaginertia="0.01 0.01 0.03"',
        "<body 'u'>: found principal moments of inertia 0.01, 0.01, 0.03 kg m²",
    ),
]


@pytest.mark.parametrize(("old", "new", "words"), FOREIGN, ids=[words for _, _, words in FOREIGN])
def test_what_changes_the_arm_and_is_not_read_is_refused(old: str, new: str, words: str, tmp_path: Path) -> None:
    """All of these were left out in silence: another arm than MuJoCo's, with status 0."""
    inertial = '<inertial pos="0 0.1 0" mass="1" diaginertia="0.01 0.01 0.01"/>'
    chain = f"""<mujoco><worldbody><body name="u"><joint axis="1 0 0"/>{inertial}<body name="f" pos="0 0.3 0">
        <joint axis="1 0 0"/>{inertial}<site name="hand" pos="0 0.25 0"/></body></body></worldbody></mujoco>"""
    path = tmp_path / "arm.xml"
    path.write_text(chain)
    assert len(armrs.import_model(path).segments) == 2
    path.write_text(chain.replace(old, new, 1))
    with pytest.raises(armrs.BadInput, match=re.escape(words)):
        armrs.import_model(path)


@pytest.mark.parametrize("rest", [-1.0, 0.3])
def test_the_spring_of_two_joints_rests_where_mujoco_takes_it_to(rest: float, tmp_path: Path) -> None:
    """MuJoCo takes a length of -1, or none, for that at the rest angles of the joints; they were read as -1 and 0."""
    mujoco = pytest.importorskip("mujoco")
    spring = armrs.Effect("biarticular", 2, parameters={"stiffness": 2.0, "ratio": 0.8, "rest": rest})
    model = armrs.Model(SEGMENTS, JOINTS, effects=(spring,))
    path = armrs.export_model(model, tmp_path / "arm.xml").path
    theirs = mujoco.MjModel.from_xml_path(str(path))
    assert theirs.tendon_lengthspring[0, 0] == pytest.approx(rest, abs=1e-12)
    assert armrs.import_model(path).effects[0].parameters["rest"] == pytest.approx(rest, abs=1e-12)
    for absent in ("", ' springlength="-1"'):
        at_rest = re.sub(r' springlength="[^"]*"', absent, path.read_text())
        (tmp_path / "rest.xml").write_text(at_rest)
        expected = mujoco.MjModel.from_xml_string(at_rest).tendon_lengthspring[0, 0]
        assert expected == pytest.approx(0.04)
        assert armrs.import_model(tmp_path / "rest.xml").effects[0].parameters["rest"] == pytest.approx(expected)


def test_opensim_balances_the_exported_arm_as_we_do(tmp_path: Path) -> None:
    """Accelerations from rest at three postures; OpenSim is no dependency, so this runs where it is installed."""
    opensim = pytest.importorskip("opensim", reason="OpenSim is not installed (pip install opensim)")
    model = opensim.Model(str(armrs.export_model(SMOOTH, tmp_path / "arm.osim").path))
    state = model.initSystem()
    kernels, resisting = armrs.Arm.from_model(SMOOTH), Rig(SMOOTH)
    for q in (START, START + 0.5, -START):
        for k, name in enumerate(("shoulder", "elbow", "wrist")):
            model.getCoordinateSet().get(name).setValue(state, float(q[k]), False)
        model.realizeAcceleration(state)
        found = [model.getCoordinateSet().get(n).getAccelerationValue(state) for n in ("shoulder", "elbow", "wrist")]
        torque = -resisting.resisting(q[None], np.zeros((1, 3)), np.zeros((1, 3)), 1.0).reshape(3, 2).sum(axis=1)
        assert found == pytest.approx(kernels.forward_dynamics(q[None], np.zeros((1, 3)), torque[None])[0], rel=1e-9)


def test_the_command_converts_models_both_ways(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    RICH.write(tmp_path / "arm.toml")
    assert cli.main(["convert", str(tmp_path / "arm.toml"), "--to", "mjcf", "-o", str(tmp_path / "out")]) == 0
    assert "dry friction" in capsys.readouterr().err
    assert cli.main(["convert", str(tmp_path / "out" / "arm.xml"), "--to", "toml", "-o", str(tmp_path / "back")]) == 0
    assert armrs.load_model(tmp_path / "back" / "arm.toml").joints == RICH.joints
    assert cli.main(["convert", str(tmp_path / "out" / "arm.xml"), "--to", "osim", "-o", str(tmp_path / "back")]) == 2


TILTED = """<robot name="hanging">
  <joint name="weld" type="fixed"><parent link="world"/><child link="stand"/><origin xyz="0.1 0.2 0.9" rpy="0 0 0"/></joint>
  <link name="stand"/>
  <joint name="one" type="continuous"><parent link="stand"/><child link="upper"/><origin xyz="0.02 0.03 0"/><axis xyz="0 2 0"/>
    <dynamics damping="0.1" friction="0"/></joint>
  <link name="upper"><inertial><origin xyz="0.01 0 -0.15" rpy="0.1 0.2 0.3"/><mass value="2"/>
    <inertia ixx="0.02" iyy="0.03" izz="0.025" ixy="0.001" ixz="0.002" iyz="-0.001"/></inertial></link>
  <joint name="clamp" type="fixed"><parent link="upper"/><child link="weight"/><origin xyz="0.05 0.02 -0.2" rpy="0 0.4 0"/></joint>
  <link name="weight"><inertial><origin xyz="0 0 0.01"/><mass value="0.5"/>
    <inertia ixx="0.001" iyy="0.002" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="two" type="continuous"><parent link="weight"/><child link="fore"/><origin xyz="0 0 -0.1" rpy="0 1.0 0"/>
    <axis xyz="0 1 0"/></joint>
  <link name="fore"><inertial><origin xyz="0.1 0 0.02"/><mass value="1"/>
    <inertia ixx="0.01" iyy="0.011" izz="0.012" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="hand" type="fixed"><parent link="fore"/><child link="tip"/><origin xyz="0.25 0 0.05"/></joint><link name="tip"/>
</robot>"""
"""As other tools write chains: an axis along y, links that hang at zero, turned frames, and a weight that is fixed to a link."""


def test_a_chain_of_another_tool_moves_as_pinocchio_moves_it(tmp_path: Path) -> None:
    """Public files were all refused: axes along y, a `world` without a link, links along z."""
    pin = pytest.importorskip("pinocchio")
    path = tmp_path / "hanging.urdf"
    path.write_text(TILTED)
    with pytest.warns(armrs.ArmrsWarning, match="one: its angle is that of the file") as told:
        ours = armrs.import_model(path)
    assert [str(line.message).split(":")[0] for line in told] == ["forward is -1.0 0.0 0.0 of the file", "one", "two"]
    # Pinocchio wants the link that other readers supply.
    theirs = pin.buildModelFromXML(TILTED.replace('<link name="stand"/>', '<link name="stand"/><link name="world"/>'))
    data, rng, zeros = theirs.createData(), np.random.default_rng(1), np.array(read_model(path).zeros)
    assert ours.joints[0].viscosity == 0.1
    for _ in range(5):
        q, qd, torque = rng.uniform(-1.0, 1.0, (3, 2))
        expected = pin.aba(theirs, data, np.array([f(a) for a in q for f in (np.cos, np.sin)]), qd, torque)
        found = armrs.Arm.from_model(ours).forward_dynamics((q + zeros)[None], qd[None], torque[None])[0]
        assert found == pytest.approx(expected, rel=1e-9)


HUNG = """<mujoco><compiler angle="degree" balanceinertia="true"/><option gravity="0 0 -9.81"/><worldbody>
  <body name="upper" pos="0.1 0 1"><joint name="one" axis="0 1 0" stiffness="3" springref="20" damping="0.2"/>
    <inertial pos="0.01 0.02 -0.15" quat="0.9 0.1 0.2 0.3" mass="2" diaginertia="0.02 0.03 0.025"/>
    <body name="fore" pos="0 0.05 -0.3" quat="0.8 0 0.6 0"><joint name="two" axis="0 1 0"/>
      <inertial pos="0.1 0 0.02" mass="1" fullinertia="0.01 0.011 0.012 0.001 0 0"/><site name="hand" pos="0.25 0 0.05"/>
  </body></body></worldbody>
  <tendon><fixed stiffness="2" springlength="0.3"><joint joint="one" coef="0.8"/><joint joint="two" coef="1"/></fixed></tendon></mujoco>"""


def test_a_chain_of_another_tool_moves_as_mujoco_moves_it(tmp_path: Path) -> None:
    mujoco = pytest.importorskip("mujoco")
    path = tmp_path / "hung.xml"
    path.write_text(HUNG)
    found, theirs, rng = read_model(path), mujoco.MjModel.from_xml_string(HUNG), np.random.default_rng(2)
    data, zeros, spring = mujoco.MjData(theirs), np.array(found.zeros), found.model.joints[0]
    both = found.model.effects[0].parameters
    for _ in range(5):
        q, qd, torque = rng.uniform(-1.0, 1.0, (3, 2))
        data.qpos[:], data.qvel[:], data.qfrc_applied[:] = q, qd, 0.0
        mujoco.mj_forward(theirs, data)
        passive = -spring.stiffness * (q[0] + zeros[0] - spring.rest) - spring.viscosity * qd[0]
        pull = -both["stiffness"] * (both["ratio"] * (q[0] + zeros[0]) + q[1] + zeros[1] - both["rest"])
        assert data.qfrc_passive == pytest.approx([passive + both["ratio"] * pull, pull])
        data.qfrc_applied[:] = torque - data.qfrc_passive
        mujoco.mj_forward(theirs, data)
        moved = armrs.Arm.from_model(found.model).forward_dynamics((q + zeros)[None], qd[None], torque[None])[0]
        assert moved == pytest.approx(data.qacc, rel=1e-9)
