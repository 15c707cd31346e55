"""What was recorded is drawn before anything is computed: by `armrs import`, and by `Trial.plot`."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest

import armrs
from armrs import cli
from armrs.report import plotting, recording


@pytest.fixture(scope="module")
def data(slow_arm: Path) -> armrs.Dataset:
    return armrs.load_dataset(slow_arm)


def test_the_arm_stands_where_its_angles_put_it(data: armrs.Dataset) -> None:
    trial, model = data.trials[0], data.model
    with plotting.style():
        ax = plotting.figure(6.0, 4.0).subplots()
        recording.postures(trial, model, ax)
    arms = [line.get_xydata() for line in ax.lines if len(np.asarray(line.get_xydata())) == model.n_joints + 1]
    tips = np.array([np.asarray(points)[-1] for points in arms])
    at = np.linspace(0, len(trial) - 1, 5).astype(int)
    np.testing.assert_allclose(tips, armrs.Arm.from_model(model).forward_kinematics(trial.q[at])[:, :2], atol=1e-12)
    assert "N on the arm" in ax.get_title(loc="left")


def test_every_channel_has_a_panel_with_its_unit(data: armrs.Dataset, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(mpl.rcParams, "backend", "agg")
    axes = data.trials[0].plot()
    assert [ax.get_title(loc="left") for ax in axes] == [
        "q1, angle [°]", "q2, angle [°]", "force on the arm, forward [N]", "force on the arm, up [N]",
        "robot's joint 1, angle [°]", "robot's joint 2, angle [°]",
    ]  # fmt: skip
    np.testing.assert_allclose(axes[0].lines[0].get_ydata(), np.degrees(data.trials[0].q[:, 0]))
    assert len(data.trials[0].plot(data.model)) == 7
    with pytest.raises(armrs.BadInput, match="model: found 1 joints, allowed 2"):
        data.trials[0].plot(armrs.Model(data.model.segments[:1], data.model.joints[:1]))


def test_import_draws_what_it_read(slow_arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "session"
    assert cli.main(["import", str(slow_arm / "trials"), "--model", str(slow_arm / "model.toml"), "-o", str(out)]) == 0
    assert (out / "recording.png").read_bytes().startswith(b"\x89PNG")
    assert f"Look at {out / 'recording.png'}" in capsys.readouterr().out
    assert len(armrs.load_dataset(out).trials) == 4
