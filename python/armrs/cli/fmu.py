"""The verbs of `armrs fmu`."""

from __future__ import annotations

import enum
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import BadInput, Text
from ..io import files
from ..report import console
from .common import ArchiveFile, JsonFile, MaybeFolder, OutFile, SamplesFormat, command_line, present, samples_suffix, writable

if TYPE_CHECKING:
    from ..cosim.system import System

Libraries = Annotated[
    Path | None,
    typer.Option("--library", metavar="DIR", help="Libraries of several platforms, such as DIR/x86_64-windows/arm_fmu.dll."),
]
Step = Annotated[float | None, typer.Option("--step", metavar="S", help="Communication step of an SSP system [s].")]
Duration = Annotated[float | None, typer.Option("--duration", metavar="S", help="Length of the run of an SSP system [s].")]

File = Annotated[Path, typer.Argument(metavar="FILE.fmu", help="Any FMU of FMI 2.0 or 3.0.")]

app = typer.Typer(name="fmu", help="Functional mock-up units (FMUs): export an arm; describe, check and couple FMUs of any tool.")


class Port(str, enum.Enum):
    """Ports through which an arm is coupled to other simulators."""

    force = "force"
    motion = "motion"


class Fmi(str, enum.Enum):
    """Versions of the FMI standard."""

    two = "2"
    three = "3"


@app.command("export", short_help="Export an arm as an FMU.")
def fmu_export(
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="model.toml")],
    out: OutFile = None,
    version: Annotated[Fmi, typer.Option("--fmi", help="Version of the standard: FMI 2.0 or 3.0.")] = Fmi.three,
    port: Annotated[Port, typer.Option(help="Input: force on the arm [N], or motion of the robot's handle [m, m/s].")] = Port.force,
    start_deg: Annotated[str, typer.Option(metavar="Q1,…", help="Joint angles at the start [deg]; 0 when absent.")] = "",
    rest: Annotated[bool, typer.Option("--rest", help="Start at the equilibrium reached from these angles.")] = False,
    dt: Annotated[float, typer.Option(help="Inner step [s], above 0.")] = 0.25e-3,
    library: Libraries = None,
    force: Annotated[bool, typer.Option("--force", help="Replace an FMU that armrs did not write.")] = False,
    json: JsonFile = None,
) -> None:
    """Export an arm as a functional mock-up unit (FMU) for co-simulation and Model Exchange; no compiler is needed.

    Exports of the same model are byte-identical. The FMU contains the parameters of the arm as plain text; its token reveals edits.
    """
    from ..cosim.fmu_export import export_fmu
    from ..cosim.slave import Slave
    from ..fmu.bundled_libraries import collected
    from ..workflows.stiction import too_steep_warnings

    writable(None, json)
    target = out if out is not None else Path(model.with_suffix(".fmu").name)
    start = _angles("--start-deg", start_deg)
    try:
        slave = Slave(model, port=port.value, start=start, rest=rest, step=dt, name=model.stem)
    except BadInput as error:
        option = {"step": "--dt", "start": "--start-deg"}.get(error.place)
        raise error if option is None or error.file else BadInput(option, error.found, error.allowed) from None
    written = export_fmu(slave, target, fmi=int(version.value), libraries=library, replace=force)
    binaries, _, without = collected(int(version.value), library)
    if without:
        console.warn([f"left out: {', '.join(without)}, because FMI 2.0 has no folder for them; export with --fmi 3"])
    if slave.left_out:
        console.warn([f"left out, because they act in sensors or contact, outside this port: {', '.join(slave.left_out)}"])
    console.warn(too_steep_warnings(slave.model, slave.internal_step))
    data = {
        "verb": "fmu export",
        "file": written,
        "fmi": int(version.value),
        "port": port.value,
        "token": slave.token,
        "left_out": slave.left_out,
        "machines": [place for place, _ in binaries],
    }
    present(lambda: data, json, lambda: print(written))


@app.command("info", short_help="Print capabilities, variables and units of an FMU.")
def fmu_info(
    file: File,
    json: JsonFile = None,
) -> None:
    """Print what the description of an FMU declares: capabilities, variables, units."""
    from ..fmu.info import about, info_words

    writable(None, json)
    data = about(file)
    present(lambda: data, json, lambda: info_words(data))


@app.command("check", short_help="Check file, description and library of an FMU.")
def fmu_check(
    file: File,
    library: Annotated[bool, typer.Option(help="Load and test the library; its native code runs with your rights.")] = True,
    json: JsonFile = None,
) -> int:
    """Check an FMU: file, description and library against the standard and against one another.

    The library runs in a separate process with limits on memory, output and time. On Linux 5.13 and later it may write only to its
    temporary folder and to devices; it may read your files and use the network. Check files from strangers with --no-library first.
    The exit status is 1 if an error is found.
    """
    import dataclasses

    from ..fmu.check import check_fmu

    writable(None, json)
    with console.progress("checking"):
        found = check_fmu(file, library=library)
    wrong = sum(f.level == "error" for f in found)

    def human() -> None:
        for finding in found:
            print(finding)
        print(f"{file.name}: {wrong} {'error' if wrong == 1 else 'errors'} found" if wrong else f"{file.name}: no errors found")

    present(lambda: {"verb": "fmu check", "file": file, "findings": [dataclasses.asdict(f) for f in found]}, json, human)
    return 1 if wrong else 0


@app.command("run", short_help="Couple arms, FMUs of any tool, and walls.")
def fmu_run(
    context: typer.Context,
    system: Annotated[Path, typer.Argument(metavar="SYSTEM", help="SYSTEM.toml, or .ssp or .ssd of SSP 1.0: slaves, connections, step.")],
    out: MaybeFolder = None,
    step: Step = None,
    duration: Duration = None,
    to: SamplesFormat = None,
    estimate: Annotated[bool, typer.Option(help="Estimate the error from a second run with half the step.")] = True,
    json: JsonFile = None,
) -> int:
    """Couple arms, FMUs of any tool and walls, and estimate the error of the coupling.

    FMUs run their native code with your rights, each in a separate process with limits on memory, output and time.

    The error is estimated from a second run with half the step, which also reads the outputs between the communication points. A run is
    good if the error of every connected output and of every arm's angles is within the accuracy. The exit status is 1, without samples,
    if the run gives no result: it is not accurate, not resolved, or diverged; the coupling created energy; the iteration did not
    converge; or a slave failed. It is 1, with samples, if a slave ended the run early or the error could not be estimated.
    """
    from ..cosim.coupled_output import coupled_data, write_coupled
    from ..cosim.coupled_run import RESULTS
    from ..cosim.error_estimate import run_checked
    from ..cosim.master import run_system
    from ..cosim.slave import Slave
    from ..errors import CoupledError
    from ..report import sentences
    from ..workflows.stiction import too_steep_warnings

    suffix = samples_suffix(to, out)
    folder = writable(out, json, verb="fmu run")
    loaded = _loaded(system, step, duration)
    arms = {name: slave for name, slave in loaded.slaves.items() if isinstance(slave, Slave)}
    console.warn([f"{name}: {said}" for name, arm in arms.items() for said in too_steep_warnings(arm.model, arm.internal_step)])
    try:
        # How often a system halves its step until the errors are within its accuracy is not known before.
        total = None if estimate and loaded.refine else loaded.count * (3 if estimate else 1)
        with console.progress("coupling", total=total) as advance:
            run = run_checked(loaded, progress=advance) if estimate else run_system(loaded, progress=advance)
    except CoupledError as error:
        run = error.run
    except BadInput as error:
        raise error if error.file else error.within(file=system) from None
    finally:
        loaded.free()
    plain = coupled_data(run, system.name, command_line(context))
    written = write_coupled(run, plain, folder, suffix=suffix) if folder else []
    console.warn(run.warnings)
    if run.verdict not in RESULTS:
        console.warn([f"{run.verdict}, no result: {run.why}"])
    elif run.verdict == "ended":
        console.warn([run.why])
    present(lambda: plain, json, lambda: sentences.coupled(plain, written))
    return 0 if run.verdict == "good" or (run.verdict == "stable" and not estimate) else 1


@app.command("ssp", short_help="Write a coupled system as an SSP 1.0 archive.")
def fmu_ssp(
    system: Annotated[Path, typer.Argument(metavar="SYSTEM.toml", help="Slaves, connections, algorithm, step and duration.")],
    out: ArchiveFile = None,
    version: Annotated[Fmi, typer.Option("--fmi", help="FMI version of the exported arms: 2.0 or 3.0.")] = Fmi.two,
    library: Libraries = None,
    force: Annotated[bool, typer.Option("--force", help="Replace an archive that armrs did not write.")] = False,
    json: JsonFile = None,
) -> None:
    """Write a system as an .ssp archive of SSP 1.0, for OMSimulator, libcosim, ecos, FMPy and others.

    Arms are exported as FMUs; FMUs are copied. Walls, signals and controllers are refused, because no other tool could run them.
    """
    from ..cosim.ssp_export import export_ssp

    writable(None, json)
    target = out if out is not None else Path(system.with_suffix(".ssp").name)
    files.not_an_input([target], [system])
    loaded = _loaded(system, None, None)
    try:
        written = export_ssp(loaded, target, fmi=int(version.value), libraries=library, replace=force)
    except BadInput as error:
        raise error if error.file else error.within(file=system) from None
    finally:
        loaded.free()
    data = {"verb": "fmu ssp", "file": written, "fmi": int(version.value), "slaves": list(loaded.slaves)}
    present(lambda: data, json, lambda: print(written))


def _loaded(path: Path, step: float | None, duration: float | None) -> System:
    """Read a system from a TOML file, or from one of SSP."""
    from ..cosim.ssp import load_ssp
    from ..cosim.system import load_system

    if path.suffix.lower() in (".ssp", ".ssd"):
        return load_ssp(path, step=step, duration=duration)
    if step is not None or duration is not None:
        raise BadInput("--step, --duration", Text("with a TOML file"), "step_s and duration_s in [system]")
    return load_system(path)


def _angles(option: str, text: str) -> list[float] | None:
    """Read angles in degrees, separated by commas, as radians."""
    if not text.strip():
        return None
    try:
        return [math.radians(float(part)) for part in text.split(",")]
    except ValueError:
        raise BadInput(option, text, "numbers separated by commas") from None
