"""One small accepted file of every format, and the commands that read it."""

from __future__ import annotations

import contextlib
import io
import shutil
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import armrs
import armrs.cosim
from armrs import cli
from armrs.fmu.shared_library import platform_folder

HERE = Path(__file__).parent
CORPUS = HERE / "corpus"
"""Files that once did harm, and one of each format that is not written here."""

MOVEMENT = "[movement]\nwaypoints_deg = [[-60, 60], [-50, 70]]\nspeed_rad_s = 1.0\nacceleration_rad_s2 = 4.0\n"
SYSTEM = """\
[system]
step_s = 0.002
duration_s = 0.05
algorithm = "iterated"

[[slave]]
name = "arm"
model = "model.toml"
port = "force"
start_deg = [-150.0, 20.0]

[[slave]]
name = "wall"
wall = { axis = "y", position_m = 0.1, stiffness = 3000.0, damping = 3000.0 }

[[connection]]
from = "arm.handle.r"
to = "wall.r"

[[connection]]
from = "arm.handle.v"
to = "wall.v"

[[connection]]
from = "wall.F"
to = "arm.handle.F"
"""
MARKERS = ("S", "E", "H")


@dataclass(frozen=True)
class Seed:
    """A file below the working folder that is changed, and the commands that are to read it.

    Attributes
    ----------
    file : str
    commands : tuple of tuple of str
        Arguments of armrs; of one that stands here more often, more cases are made.
    every : int
        One in so many turns of the format is its own: 3 where a command computes or draws, 12 where it starts a process; the others
        are those of formats that take a tenth of the time.
    """

    file: str
    commands: tuple[tuple[str, ...], ...]
    every: int = 1


SIMULATE = ("simulate", "model.toml", "--movement", "movement.toml", "--duration-s", "0.1", "-o", "OUT")
CHECK = ("check", "session")


def _imported(name: str, *more: str) -> tuple[str, ...]:
    return ("import", f"raw/{name}", "--model", "model.toml", "-o", "OUT", *more)


SEEDS = (
    Seed("model.toml", (SIMULATE, ("convert", "model.toml", "--to", "urdf", "-o", "OUT")), every=3),
    Seed("movement.toml", (SIMULATE,), every=3),
    Seed("session/dataset.toml", (CHECK, *(("convert", "session", "--to", "parquet", "-o", "OUT"),) * 3)),
    Seed("session/trials/slow_1.csv", (CHECK, ("convert", "session/trials/slow_1.csv", "--to", "parquet", "-o", "OUT")), every=3),
    Seed("session/trials/slow_2.parquet", (CHECK, ("convert", "session/trials/slow_2.parquet", "--to", "csv", "-o", "OUT")), every=3),
    Seed("raw/slow_1.csv", (_imported("slow_1.csv"),), every=3),
    Seed("raw/slow_1.xlsx", (_imported("slow_1.xlsx"),), every=3),
    Seed("raw/slow_1.mat", (_imported("slow_1.mat"),), every=12),
    Seed("raw/slow_7.mat", (_imported("slow_7.mat"),), every=12),
    Seed(
        "raw/slow_1.sto",
        (_imported("slow_1.sto"), *(("convert", "raw/slow_1.sto", "--to", "csv", "--coordinates", "shoulder,elbow", "-o", "OUT"),) * 3),
    ),
    Seed("raw/slow_1.trc", (("convert", "raw/slow_1.trc", "--points", ",".join(MARKERS), "--to", "csv", "-o", "OUT"),)),
    Seed("raw/good.c3d", (("convert", "raw/good.c3d", "--points", ",".join(MARKERS), "--to", "csv", "-o", "OUT"),), every=12),
    Seed("other/model.urdf", (("convert", "other/model.urdf", "--to", "toml", "-o", "OUT"),)),
    Seed("other/model.xml", (("convert", "other/model.xml", "--to", "toml", "-o", "OUT"),)),
    Seed("result.json", (("report", "result.json", "-o", "OUT"),)),
    Seed("passive.json", (("report", "passive.json", "-o", "OUT"), ("report", "result.json", "passive.json", "-o", "OUT"))),
    Seed("history.sqlite", (("identify", "session", "--motion", "measured", "--history", "history.sqlite"),), every=3),
    Seed("arm.fmu", (("fmu", "info", "arm.fmu"), ("fmu", "check", "--no-library", "arm.fmu"))),
    Seed("system.toml", (("fmu", "run", "system.toml", "--no-estimate", "-o", "OUT"),), every=3),
    Seed("experiment.toml", (("record", "experiment.toml", "-o", "OUT"),), every=3),
)
"""`OUT` is a folder that does not exist before."""


def _quietly(*arguments: str) -> int:
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        return cli.main(arguments)


def _table(names: list[str], values: np.ndarray, separator: str = ",") -> str:
    return separator.join(names) + "\n" + "".join(separator.join(f"{v:.9g}" for v in row) + "\n" for row in values)


def plant(folder: Path) -> tuple[Seed, ...]:
    """Write all seeds below a folder, and return those that armrs accepts here: not every reader need be installed."""
    for below in ("session/trials", "raw", "other"):
        (folder / below).mkdir(parents=True, exist_ok=True)
    _quietly("init", str(folder / "model"), "--body-mass-kg", "78", "--height-m", "1.8", "--sex", "male", "--lengths-m", "0.322,0.264")
    shutil.copy(folder / "model" / "model.toml", folder / "model.toml")
    shutil.copy(folder / "model" / "model.toml", folder / "session" / "model.toml")
    (folder / "movement.toml").write_text(MOVEMENT)
    (folder / "system.toml").write_text(SYSTEM)
    there_and_back = np.radians([[-60, 60], [-25, 60], [-60, 95], [-30, 70], [-60, 60]])
    run = armrs.simulate(folder / "model.toml", armrs.Movement(there_and_back, speed=0.4, acceleration=2.0), rate=20.0)
    force = run.force_on_arm
    names = ["t_s", "q1_rad", "q2_rad", "Fy_N", "Fz_N", "qr1_rad", "qr2_rad"]
    columns = [run.t, *run.q.T, *-force.T, *np.asarray(run.columns["robot_q"]).T] if run.columns.get("robot_q") is not None else None
    if columns is None:
        names, columns = names[:5], [run.t, *run.q.T, *-force.T]
    values = np.column_stack(columns)
    trials = folder / "session" / "trials"
    noise = np.random.default_rng(2)
    for k in (1, 2):
        # A repeat is a measurement of its own.
        measured = np.column_stack([values[:, :3], values[:, 3:5] + noise.normal(0.0, 0.05, (len(values), 2)), values[:, 5:]])
        (trials / f"slow_{k}.csv").write_text(_table(names, measured))
    rate = 1.0 / (run.t[1] - run.t[0])
    head = f'name = "S1"\nmodel = "model.toml"\nforce_on = "robot"\nsample_rate = {rate:.9g}\n\n[tolerance]\nforce_bias_N = 0.4\n'
    entry = '\n[[trial]]\nfile = "trials/slow_{}.{}"\nconfiguration = "slow"\nrepeat = {}\nrole = "{}"\n'
    entries = (entry.format(1, "csv", 1, "fit"), entry.format(2, "parquet", 2, "test"))
    (folder / "session" / "dataset.toml").write_text(head + "".join(entries))
    _quietly("convert", str(trials / "slow_2.csv"), "--to", "parquet", "-o", str(trials))
    (trials / "slow_2.csv").unlink()
    _raw(folder / "raw", values[:, :5])
    for kind, suffix in (("urdf", "urdf"), ("mjcf", "xml")):
        _quietly("convert", str(folder / "model.toml"), "--to", kind, "-o", str(folder / "other"))
        assert (folder / "other" / f"model.{suffix}").exists(), kind
    session = str(folder / "session")
    history = ("--history", str(folder / "history.sqlite"), "--date", "2026-01-02")
    _quietly("identify", session, "--motion", "measured", "--json", str(folder / "result.json"), *history)
    _quietly("passive", session, "--json", str(folder / "passive.json"))
    # What travels in a unit but its library, which none of the commands loads.
    slave = armrs.cosim.Slave(armrs.load_model(folder / "model.toml"), port="force")
    description, terminals = slave.compiled.description(3)
    with zipfile.ZipFile(folder / "arm.fmu", "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in (("modelDescription.xml", description), ("terminalsAndIcons/terminalsAndIcons.xml", terminals or "")):
            archive.writestr(name, content)
        archive.writestr(f"binaries/{platform_folder(3)[0]}/arm.txt", "no library")
    shutil.copy(HERE.parent / "sweep" / "EXPERIMENT.toml", folder / "experiment.toml")
    return tuple(seed for seed in SEEDS if (folder / seed.file).exists())


def _raw(folder: Path, values: np.ndarray) -> None:
    names = ["time", "shoulder", "elbow", "force_y", "force_z"]
    (folder / "slow_1.csv").write_text(_table(["Time (s)", "Shoulder (rad)", "Elbow (rad)", "Force Y (N)", "Force Z (N)"], values))
    head = f"slow\nversion=1\nnRows={len(values)}\nnColumns={len(names)}\ninDegrees=no\nendheader\n"
    (folder / "slow_1.sto").write_text(head + _table(names, values, "\t"))
    shutil.copy(CORPUS / "good.c3d", folder)
    absolute = np.cumsum(values[:, 1:3], axis=1)
    elbow = 0.322 * np.stack([np.cos(absolute[:, 0]), np.sin(absolute[:, 0])])
    hand = elbow + 0.264 * np.stack([np.cos(absolute[:, 1]), np.sin(absolute[:, 1])])
    rate = 1.0 / (values[1, 0] - values[0, 0])
    points = np.stack([np.zeros_like(elbow), elbow, hand])  # SHO ELB HAND, forward and up
    rows = "".join(
        "\t".join([str(k + 1), f"{t:.6f}", *(f"{v:.6f}" for p in points for v in (p[0, k], p[1, k], 0.0))]) + "\n"
        for k, t in enumerate(values[:, 0])
    )
    (folder / "slow_1.trc").write_text(
        "PathFileType\t4\t(X/Y/Z)\tslow_1.trc\nDataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames\n"
        f"{rate:g}\t{rate:g}\t{len(values)}\t3\tm\t{rate:g}\t1\t{len(values)}\nFrame#\tTime\t" + "\t\t\t".join(MARKERS) + "\t\t\n"
        "\t\t" + "\t".join(f"{a}{k}" for k in (1, 2, 3) for a in "XYZ") + "\n\n" + rows
    )
    with contextlib.suppress(ImportError):
        from scipy.io import savemat

        savemat(folder / "slow_1.mat", {"t": values[:, 0], "q": values[:, 1:3], "Fy": values[:, 3], "Fz": values[:, 4]})
    with contextlib.suppress(ImportError):
        import h5py

        with h5py.File(folder / "slow_7.mat", "w", userblock_size=512) as file:
            for name, value in (("t", values[None, :, 0]), ("q", values[:, 1:3].T), ("Fy", values[None, :, 3]), ("Fz", values[None, :, 4])):
                file[name] = np.ascontiguousarray(value)
                file[name].attrs["MATLAB_class"] = np.bytes_("double")
    with contextlib.suppress(ImportError):
        import openpyxl

        book = openpyxl.Workbook()
        book.active.append(["Time (s)", "Shoulder (rad)", "Elbow (rad)", "Force Y (N)", "Force Z (N)"])
        for row in values.tolist():
            book.active.append(row)
        book.save(folder / "slow_1.xlsx")
