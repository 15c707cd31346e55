"""What several tests share: measured data, an accepted model and an accepted session."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

# Before NumPy is loaded, here and in processes that tests start. Its matrices are small here, and threads that wait for one another take
# ten times the processor time where there are as many processes as cores.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import pytest

from browser import shared

LARGEST = (
    "test_reproduce.py", "test_pages.py", "test_setup_matrix.py", "test_demo.py", "test_fmu_defects.py", "test_sweep.py", "test_first_day.py",
    "test_friction.py", "test_passive_moments.py",
)  # fmt: skip
"""Files that take longest. They come first, so that no process works on one of them alone at the end."""

MODEL = """\
[arm]
gravity = 9.81
base = [0.0, 0.0]
segment_uncertainty = 0.05

[[arm.segment]]
name = "upper arm"
length = 0.322
mass = 2.114
com = 0.186
inertia = 0.0165

[[arm.segment]]
name = "forearm"
length = 0.264
mass = 1.264
com = 0.121
inertia = 0.0074

[[arm.joint]]
name = "shoulder"
stiffness = 1.2
rest = -0.785
viscosity = 0.25
coulomb = 0.0

[[arm.joint]]
name = "elbow"

[robot]
lengths = [0.45, 0.45]
base = [1.05, -0.10]
elbow = "up"

[contact]
stiffness = [10000.0, 10000.0]
damping = [25.0, 25.0]

[[effect]]
kind = "coulomb"
joint = 2
torque = 0.161
"""

DATASET = """\
name = "S1"
model = "model.toml"
force_on = "robot"
sample_rate = 50.0

[subject]
body_mass = 77.0
height = 1.80
sex = "male"

[tolerance]
force_bias_N = 0.4

[[trial]]
file = "trials/slow_1.csv"
configuration = "slow"
repeat = 1
role = "fit"

[[trial]]
file = "trials/slow_2.csv"
configuration = "slow"
repeat = 2
role = "test"
"""

HEADER = ["t_s", "q1_rad", "q2_rad", "Fy_N", "Fz_N", "Mx_Nm", "qr1_rad", "qr2_rad", "emg_biceps"]


def rows(n: int = 100, rate: float = 50.0, seed: int = 0) -> np.ndarray:
    """Samples of a smooth movement under `HEADER`, rounded as a file would hold them."""
    rng = np.random.default_rng(seed)
    t = np.arange(n) / rate
    phase = rng.uniform(0.0, 6.0, len(HEADER) - 1)
    waves = 0.5 * np.sin(2.0 * t[:, None] + phase)
    return np.column_stack([t, np.round(waves, 6)])


def csv_lines(values: np.ndarray, header: list[str] | None = None) -> list[str]:
    """Lines of a CSV file; NaN is an empty cell."""
    cells = [",".join("" if np.isnan(v) else repr(float(v)) for v in row) for row in values]
    return [",".join(header or HEADER), *cells]


class Session:
    """An accepted data set in a folder, to break one thing in."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.trial = folder / "trials" / "slow_1.csv"
        self.trial.parent.mkdir(parents=True)
        (folder / "model.toml").write_text(MODEL, encoding="utf-8")
        (folder / "dataset.toml").write_text(DATASET, encoding="utf-8")
        for seed, name in enumerate(["slow_1.csv", "slow_2.csv"]):
            (folder / "trials" / name).write_text("\n".join(csv_lines(rows(seed=seed))) + "\n", encoding="utf-8")

    def edit(self, name: str, old: str, new: str) -> None:
        """Replace text that stands exactly once in a file."""
        path = self.folder / name
        content = path.read_text(encoding="utf-8")
        assert content.count(old) == 1, f"{old!r} stands {content.count(old)} times in {name}"
        path.write_text(content.replace(old, new), encoding="utf-8")

    def edit_lines(self, change: Callable[[list[str]], list[str]]) -> None:
        """Rewrite the first trial from its lines; `lines[0]` is the header, `lines[k]` stands on line k + 1."""
        lines = self.trial.read_text(encoding="utf-8").splitlines()
        self.trial.write_text("\n".join(change(lines)) + "\n", encoding="utf-8")

    def set_cell(self, line: int, column: str, text: str) -> None:
        """Write one cell; `line` counts from 1 with the header."""

        def change(lines: list[str]) -> list[str]:
            cells = lines[line - 1].split(",")
            cells[lines[0].split(",").index(column)] = text
            lines[line - 1] = ",".join(cells)
            return lines

        self.edit_lines(change)

    def files(self) -> dict[str, bytes]:
        """Everything below the folder, to see that nothing was written."""
        return {str(p.relative_to(self.folder)): p.read_bytes() for p in sorted(self.folder.rglob("*")) if p.is_file()}


@pytest.fixture(autouse=True)
def figures_closed() -> Iterator[None]:
    """A figure that a test made is closed after it: pyplot keeps them all and warns, in whichever test makes the twenty-first."""
    yield
    pyplot = sys.modules.get("matplotlib.pyplot")
    if pyplot is not None:
        pyplot.close("all")


@pytest.fixture
def session(tmp_path: Path) -> Session:
    return Session(tmp_path / "session")


@pytest.fixture(scope="session")
def data() -> Path:
    """The folder of measured data."""
    folder = Path(os.environ.get("ARMRS_DATA", Path(__file__).parents[2] / "shared" / "data"))
    if not folder.is_dir():
        reason = f"no measured data: set ARMRS_DATA, or put them in {folder}"
        if os.environ.get("CI") == "true":
            pytest.fail(reason)
        pytest.skip(reason)
    return folder


MOVEMENT = """\
[movement]
waypoints_deg = [[-60, 60], [-45, 60], [-60, 60], [-60, 75], [-60, 60]]
speed_rad_s = 0.1
acceleration_rad_s2 = 1.0
pause_s = 0.2
shape = "smooth"
"""


@pytest.fixture(scope="session")
def slow_arm(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small synthetic data set of a slow arm with dry friction that its model lacks; `truth.toml` and `movement.toml` lie beside it."""
    from armrs import Dataset, Sensors, Trial, simulate, write_dataset
    from armrs.demo import given_model, true_model
    from armrs.workflows.movement import load_movement

    folder = tmp_path_factory.mktemp("slow")
    truth = true_model()
    truth.write(folder / "truth.toml")
    (folder / "movement.toml").write_text(MOVEMENT, encoding="utf-8")
    run = simulate(truth, load_movement(folder / "movement.toml", 2), sensors=Sensors.realistic(), seeds=range(4))
    trials = tuple(
        Trial(
            f"trials/slow_{k}.csv",
            "slow",
            k,
            "fit" if k < 4 else "test",
            read.time,
            read.q,
            read.force_on_arm,
            None,
            read.robot_q,
        )
        for k, read in enumerate(run.readings, start=1)
    )
    write_dataset(Dataset("slow arm", given_model(truth), trials, "robot", synthetic=True), folder)
    return folder


@pytest.fixture(autouse=True)
def no_lines_of_progress(monkeypatch: pytest.MonkeyPatch) -> None:
    """How far a command is, it says after five seconds: what a test reads would depend on how busy the machine is."""
    monkeypatch.setattr("armrs.report.console.FIRST_LINE", 3600.0)


@pytest.fixture(scope="module", autouse=True)
def one_browser() -> Iterator[None]:
    """All pages of a file are opened in one browser."""
    with shared():
        yield


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    items.sort(key=lambda item: item.path.name not in LARGEST)
