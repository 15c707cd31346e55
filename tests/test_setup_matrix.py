"""Every wrong setup on sessions of two engines of others, two and three segments, with and without the angles of a robot."""

from __future__ import annotations

import dataclasses
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import armrs
from armrs.io.dataset import Dataset
from armrs.io.plausibility import refuse_implausible
from armrs.workflows.setup_check import examine_setup
from gap_sessions import session as gap_session

pytestmark = pytest.mark.long

ROOT = Path(__file__).resolve().parents[1]
SEEDS = {"MuJoCo, two segments": 65005, "MuJoCo, three segments": 65004}
"""Development seeds of `bench/hidden/mujoco_world`, little-known arms."""
QUARTER, HALF = np.pi / 2, np.pi


def _added(joint: int, offset: float) -> Callable[[np.ndarray], np.ndarray]:
    return lambda q: q + offset * np.eye(q.shape[1])[joint - 1]


def _turned(joint: int) -> Callable[[np.ndarray], np.ndarray]:
    return lambda q: q * np.where(np.arange(q.shape[1]) == joint - 1, -1.0, 1.0)


ANGLES: dict[str, tuple[Callable[[np.ndarray], np.ndarray], str]] = {
    "mirrored": (lambda q: -q, "(mirrored?)"),
    "absolute": (lambda q: np.cumsum(q, axis=1), "(absolute angles?)"),
    "from the vertical": (_added(1, QUARTER), "(from the vertical downwards?)"),
    "absolute from the vertical": (lambda q: np.cumsum(_added(1, QUARTER)(q), axis=1), "(absolute angles, from the vertical downwards?)"),
    "from the vertical, mirrored": (lambda q: -_added(1, QUARTER)(q), "(from the vertical downwards, mirrored?)"),
    "shoulder by 180 degrees": (_added(1, HALF), "(another zero: q1 is 3."),
    "elbow by 90 degrees": (_added(2, QUARTER), "(another zero: q2 is 1."),
    "elbow by 180 degrees": (_added(2, HALF), "(another zero: q2 is 3."),
    "wrist by 90 degrees": (_added(3, QUARTER), "(another zero: q3 is 1."),
    "wrist by 180 degrees": (_added(3, HALF), "(another zero: q3 is 3."),
    "shoulder alone mirrored": (_turned(1), "q1 counter-clockwise like the others (this one mirrored?)"),
    "elbow alone mirrored": (_turned(2), "q2 counter-clockwise like the others (this one mirrored?)"),
    "wrist alone mirrored": (_turned(3), "q3 counter-clockwise like the others (this one mirrored?)"),
    "elbow between both segments": (lambda q: _added(2, HALF)(_turned(2)(q)), "(the angle between both segments?)"),
    "degrees": (np.degrees, "(degrees labelled as radians?)"),
    "swapped": (lambda q: q[:, ::-1], "(swapped columns?)"),
}
"""What the columns hold instead of the angles that are meant, and what the line says."""
FORCES = {
    "forces swapped": ([[0.0, 1.0], [1.0, 0.0]], "(swapped columns?)"),
    "Fy reversed": ([[-1.0, 0.0], [0.0, 1.0]], "column Fy"),
    "Fz reversed": ([[1.0, 0.0], [0.0, -1.0]], "column Fz"),
    "other body": ([[-1.0, 0.0], [0.0, -1.0]], "force_on: found "),
    "kN": ([[1e-3, 0.0], [0.0, 1e-3]], "(kN labelled as N, or N as mN?)"),
    "mN": ([[1e3, 0.0], [0.0, 1e3]], "(mN labelled as N, or N as kN?)"),
}
UNDECIDED = {
    "MuJoCo, three segments": {"wrist by 90 degrees", "wrist by 180 degrees", "wrist alone mirrored"},
    "rapier, two segments": {"absolute", "shoulder by 180 degrees"},
}
"""What the forces do not decide without robot angles, for a light hand or where springs do as well: there a warning must say so."""


@pytest.fixture(scope="module", params=[*SEEDS, "rapier, two segments"])
def session(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Dataset]:
    """Two trials of each movement."""
    if request.param not in SEEDS:
        data = gap_session(armrs.Effect("viscous", 2, parameters={"viscosity": 0.2}))
    else:
        pytest.importorskip("mujoco")
        folder = tmp_path_factory.mktemp("world")
        world = [sys.executable, str(ROOT / "bench" / "hidden" / "mujoco_world"), "--family", "little_known", "--count", "1"]
        subprocess.run([*world, "--seed", str(SEEDS[request.param]), "-o", str(folder)], check=True, timeout=300)
        data = armrs.load_dataset(next(folder.glob("m*")) / "data")
    return request.param, data.replace(trials=tuple(t for t in data.trials if t.repeat <= 2))


def asked(data: Dataset, robot: bool, change: Callable[[armrs.Trial], armrs.Trial]) -> tuple[str, list[str]]:
    """Return the refusal of changed data, empty where there is none, and the warnings."""
    trials = [change(t) for t in data.trials]
    changed = data.replace(trials=tuple(t if robot else dataclasses.replace(t, robot_q=None) for t in trials))
    try:
        refuse_implausible(changed)
        return "", examine_setup(changed)
    except armrs.BadInput as error:
        return str(error), []


@pytest.mark.parametrize("robot", [True, False], ids=["with robot angles", "without"])
def test_every_wrong_setup_is_named(robot: bool, session: tuple[str, Dataset]) -> None:
    where, data = session
    refused, warned = asked(data, robot, lambda trial: trial)
    assert refused == "" and (not robot or warned == [])
    silent = []
    for name, (angles, says) in ANGLES.items():
        if "wrist" in name and data.model.n_joints < 3:
            continue
        refused, warned = asked(data, robot, lambda trial, angles=angles: dataclasses.replace(trial, q=angles(trial.q)))  # type: ignore[misc]
        proved = robot or name not in UNDECIDED.get(where, ())
        if says not in (refused if proved else "".join([refused, *warned])) or "\n" in refused:
            silent.append((name, refused, warned))
    for name, (force, says) in FORCES.items():
        turn = np.array(force).T
        refused, warned = asked(data, robot, lambda t, turn=turn: dataclasses.replace(t, force_on_arm=t.force_on_arm @ turn))  # type: ignore[misc]
        if says not in refused:
            silent.append((name, refused, warned))
    assert silent == []
