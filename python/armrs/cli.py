"""The command line: `armrs <verb>`.

A verb parses, calls one public function and writes. `main` is the only place that turns errors into lines and exit statuses:
0 done, 1 ran and found something that needs the user, 2 bad input (one line, nothing written).

To add a verb, write a function with `@app.command()`; its docstring is the help. Return 1 for a finding, nothing otherwise.
"""

from __future__ import annotations

import contextlib
import enum
import math
import os
import shlex
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from . import console, files
from .errors import ArmrsError, BadInput, Text, one_line, unknown_name

if TYPE_CHECKING:
    from .trial import Reading

fmu = typer.Typer(
    name="fmu", help="Functional mock-up units: export the arm, look at a file, check it, couple several.", no_args_is_help=True
)
app = typer.Typer(name="armrs", add_completion=False, rich_markup_mode=None, context_settings={"help_option_names": ["-h", "--help"]})

JsonFile = Annotated[Path | None, typer.Option("--json", metavar="FILE", help="Write the result as JSON; - is standard output.")]
OutFolder = Annotated[Path, typer.Option("-o", "--out", metavar="DIR", help="Folder to write below; made when it does not exist.")]
MaybeFolder = Annotated[
    Path | None, typer.Option("-o", "--out", metavar="DIR", help="Folder to write files and report below; made when it does not exist.")
]
Source = Annotated[Path, typer.Argument(metavar="DATASET", help="Folder with dataset.toml, or that file.")]

_STDOUT = Path("-")
# Typer brings its own copy of click in newer versions and uses the package in older ones; this is the class that both raise.
_USAGE: type[Exception] = next(c for c in typer.BadParameter.__mro__ if c.__name__ == "ClickException")


class Format(str, enum.Enum):
    """Formats of trial files."""

    csv = "csv"
    parquet = "parquet"


class TableFormat(str, enum.Enum):
    """Formats of tables over time."""

    csv = "csv"
    parquet = "parquet"
    mot = "mot"
    sto = "sto"


class Method(str, enum.Enum):
    """Methods of identification."""

    joint = "joint"
    cascade = "cascade"


class Engine(str, enum.Enum):
    """Engines of simulation."""

    native = "native"
    rapier = "rapier"


class Integrator(str, enum.Enum):
    """Integrators of the native engine."""

    rk4 = "rk4"
    euler = "euler"


class Coupling(str, enum.Enum):
    """How the handle holds the tip."""

    compliant = "compliant"
    rigid = "rigid"


class Port(str, enum.Enum):
    """Ports through which an arm is coupled to other simulators."""

    force = "force"
    motion = "motion"


class Fmi(str, enum.Enum):
    """Versions of the FMI standard."""

    two = "2"
    three = "3"


class Motion(str, enum.Enum):
    """Sources of speeds and accelerations."""

    auto = "auto"
    measured = "measured"
    simulated = "simulated"


def present(data: Callable[[], Any], to: Path | None, human: Callable[[], None]) -> None:
    """Give a result to the user: JSON where `--json` says, and words on standard output unless the JSON is there.

    Parameters
    ----------
    data : callable
        Makes the result as plain data; called only when JSON is asked for.
    to : Path or None
        The value of `--json`.
    human : callable
        Prints the result in words.
    """
    if to == _STDOUT:
        sys.stdout.write(files.json_text(data()))
        return
    if to is not None:
        files.write_json(to, data())
    human()


def _version(wanted: bool) -> None:
    if wanted:
        import armrs

        print(f"armrs {armrs.__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and end.")] = False,
) -> None:
    """Find out what an arm is made of, when a robot leads it.

    Simulate the experiment, identify the arm, and name what the model lacks. SI units and radians unless a name says otherwise.

    Exit status: 0 done, 1 found something that needs you, 2 bad input.
    """


@app.command()
def effects(
    kind: Annotated[str | None, typer.Argument(metavar="KIND", help="Only this kind.")] = None,
    json: JsonFile = None,
) -> None:
    """Print the catalogue of effects: where each acts, its formula, its parameters with units and bounds."""
    from .catalogue import catalogue

    known = catalogue()
    if not known:
        raise ArmrsError("the compiled module armrs._armrs is missing: build it with make, or install the wheel")
    if kind is not None and kind not in known:
        raise unknown_name("KIND", kind, known, what="kind of effect")
    chosen = list(known.values()) if kind is None else [known[kind]]

    def data() -> Any:
        import dataclasses

        return {"effects": [dataclasses.asdict(entry) for entry in chosen]}

    def human() -> None:
        for entry in chosen:
            needs = f", needs {entry.address}" if entry.address else ""
            print(f"{entry.kind} ({entry.where}{needs}): {entry.summary}")
            print(f"    {entry.formula}    [{entry.reference}]")
            for p in entry.parameters:
                print(f"    {p.name}: {_range(p.min, p.max)} {p.unit}, default {p.default:g}")
            print()

    present(data, json, human)


@app.command()
def convert(
    source: Annotated[
        Path, typer.Argument(metavar="SOURCE", help="Data set folder, dataset.toml, or one .csv, .parquet, .mot, .sto, .c3d or .trc file.")
    ],
    out: OutFolder,
    to: Annotated[TableFormat, typer.Option("--to", help="Format to write.")] = TableFormat.parquet,
    points: Annotated[
        str, typer.Option(metavar="A,B+C,…", help="Markers of the joints, first joint to handle; B+C is the point half way.")
    ] = "",
    up: Annotated[
        str | None, typer.Option(metavar="AXIS", help="Axis of the markers that points up: z in C3D, y in TRC when absent.")
    ] = None,
    forward: Annotated[
        str | None, typer.Option(metavar="AXIS", help="Axis that points forward; where the arm reaches when absent.")
    ] = None,
    coordinates: Annotated[str, typer.Option(metavar="NAME,…", help="Joint angles of a MOT or STO file, first joint first.")] = "",
    json: JsonFile = None,
) -> None:
    """Convert between file formats, every value kept to the bit; turn marker trajectories into joint angles and segment lengths."""
    from . import motions, words
    from .conversion import convert as run_conversion
    from .markers import MARKER_SUFFIXES
    from .opensim import MOTION_SUFFIXES

    suffix = "" if source.is_dir() else source.suffix.lower()
    chosen, named = _listed(points), _listed(coordinates)
    if suffix in MARKER_SUFFIXES:
        _folder(out, json)
        file, motion, notes = motions.convert_markers(source, out, to=to.value, points=chosen, up=up, forward=forward)
        console.warn(notes)
        present(
            lambda: {"files": [file], "points": chosen, **motion.to_dict(), "warnings": notes},
            json,
            lambda: words.planar(motion, chosen, file),
        )
        return
    for option, given in (("--points", points), ("--up", up), ("--forward", forward)):
        if given:
            raise BadInput(option, Text(f"a {suffix or 'data set'} source"), f"{option} with {' or '.join(MARKER_SUFFIXES)} files only")
    if suffix in MOTION_SUFFIXES or f".{to.value}" in MOTION_SUFFIXES or named:
        written = [motions.convert_motion(source, out, to=to.value, coordinates=named)]
    else:
        written = run_conversion(source, out, to=to.value)
    present(lambda: {"files": written}, json, lambda: print("\n".join(os.fspath(path) for path in written)))


@app.command()
def demo(context: typer.Context, out: OutFolder = Path("armrs-demo"), json: JsonFile = None) -> None:
    """Do the main job on built-in data: simulate the experiment, identify the arm, compare with what is known, write a report."""
    from . import words
    from .demo import run_demo
    from .report import read_result

    _folder(out, json)
    with console.progress("demo"):
        result = run_demo(out, command=_command(context))
    plain = read_result(out / "demo.json")
    present(lambda: plain, json, lambda: words.demo(plain, result.files))


@app.command()
def identify(
    context: typer.Context,
    dataset: Source,
    out: MaybeFolder = None,
    method: Annotated[Method, typer.Option(help="All joints at once with physical constraints, or one after the other.")] = Method.joint,
    with_: Annotated[
        str | None,
        typer.Option("--with", metavar="KIND,…", help="Kinds of joint effects that are fitted at every joint besides the model's."),
    ] = None,
    cutoff_hz: Annotated[float | None, typer.Option(help="Cutoff of the common low-pass [Hz]; chosen from the data when absent.")] = None,
    motion: Annotated[Motion, typer.Option(help="Where speeds and accelerations come from.")] = Motion.auto,
    level: Annotated[float, typer.Option(help="Probability of the intervals, 0.5 to 1.")] = 0.95,
    history: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Add the result to the history of this subject, a file of SQLite, and show it.")
    ] = None,
    date: Annotated[
        str | None, typer.Option(metavar="YYYY-MM-DD", help="Date of the session; that in the data set's name, or today, when absent.")
    ] = None,
    json: JsonFile = None,
) -> int:
    """Identify body segment and joint parameters, each with an interval and what decided it.

    Exit status 1 when the solver did not quite get there, when the result cannot be true of this arm and these sensors, or when
    speeds are noise to a good part. Such a result is not added to a history.
    """
    from . import history as sessions
    from . import results, words
    from .dataset import load_dataset
    from .identification import identify as run_identification

    folder = _folder(out, json)
    data = load_dataset(dataset)
    if history is None and date is not None:
        raise BadInput("--date", date, "--date together with --history")
    day = sessions.session_date(data.name, date)
    if history is not None:
        sessions.check(history, data.model.n_joints)
    with console.progress("identifying"):
        result = run_identification(
            data,
            method=method.value,
            with_effects=() if with_ is None else with_,
            cutoff=cutoff_hz,
            motion=motion.value,
            level=level,
        )
    plain = results.identified_data(result, _command(context))
    with contextlib.ExitStack() as kept:
        # What is added to the history stays only if everything else could be written.
        if history is not None and result.is_sound:
            plain["history"] = [course.to_dict() for course in kept.enter_context(sessions.adding(history, result, day))]
        written = results.write_identified(result, plain, folder) if folder else []
        console.warn([*data.warnings, *result.warnings])
        if history is not None and not result.is_sound:
            console.warn([f"{history}: not added to the history, since the result is not sound"])
        present(lambda: plain, json, lambda: words.identified(plain, written))
    return 0 if result.is_sound else 1


@app.command()
def gap(
    context: typer.Context,
    dataset: Source,
    out: MaybeFolder = None,
    quick: Annotated[
        bool,
        typer.Option("--quick", help="A first answer only: calibrate, and list what may be missing; nothing is named or written below -o."),
    ] = False,
    threads: Annotated[int | None, typer.Option(min=1, help="Threads; all cores when absent. The result does not depend on it.")] = None,
    json: JsonFile = None,
) -> int:
    """Find where model and data disagree, name the effect that is missing, and show the gap before and after.

    Everything is chosen and fitted on the fit trials; the gap is measured on the test trials. Exit status 1 when something is left
    that no effect of the catalogue explains.
    """
    from .dataset import load_dataset
    from .discrepancy import calibrate, find_gap, words
    from .discrepancy.results import gap_data, write_gap

    if quick and out is not None:
        raise BadInput("--quick", Text("-o beside it"), "--json, or nothing: a first answer has no report")
    folder = _folder(out, json)
    data = load_dataset(dataset)
    if quick:
        with console.stages("a first look") as tell:
            first = calibrate(data, threads=threads, progress=tell)
        console.warn([*data.warnings, *first.warnings])
        present(lambda: first.to_dict(_command(context)), json, lambda: words.quick(first.to_dict()))
        return 0
    with console.stages("looking for what is missing") as tell:
        result = find_gap(data, threads=threads, progress=tell)
    plain = gap_data(result, _command(context))
    written = write_gap(result, plain, folder) if folder else []
    console.warn([*data.warnings, *result.warnings])
    present(lambda: plain, json, lambda: words.show(plain, written))
    return 1 if result.verdict == "unexplained" else 0


@app.command()
def simulate(
    context: typer.Context,
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="model.toml")],
    movement: Annotated[
        Path | None, typer.Option(metavar="FILE", help="TOML file with a table [movement]: waypoints_deg, speed_rad_s, …")
    ] = None,
    trial: Annotated[
        Path | None,
        typer.Option(metavar="CSV", help="Measured trial, CSV or Parquet, whose robot angles (or joint torques) drive the arm."),
    ] = None,
    out: MaybeFolder = None,
    engine: Annotated[Engine, typer.Option(help="Minimal coordinates, or rigid bodies and joints.")] = Engine.native,
    dt: Annotated[float, typer.Option(help="Step [s].")] = 0.25e-3,
    rate_hz: Annotated[float, typer.Option(help="Samples a second that are recorded [Hz].")] = 50.0,
    integrator: Annotated[Integrator, typer.Option(help="Fourth order, or semi-implicit first order.")] = Integrator.rk4,
    coupling: Annotated[Coupling, typer.Option(help="How the handle holds the tip.")] = Coupling.compliant,
    duration_s: Annotated[float | None, typer.Option(help="Length of the run [s]; that of the movement when absent.")] = None,
    to: Annotated[Format, typer.Option("--to", help="Format of the samples written.")] = Format.csv,
    json: JsonFile = None,
) -> None:
    """Simulate the closed-chain experiment: a robot leads the arm."""
    from . import results, words
    from .model import load_model
    from .simulation import load_movement
    from .simulation import simulate as run_simulation

    if (movement is None) == (trial is None):
        found = Text("neither" if movement is None else "both")
        raise BadInput("--movement, --trial", found, "one of them")
    folder = _folder(out, json)
    arm = load_model(model)
    reading = None if trial is None else _single_trial(trial, arm.n_joints)
    measured = None if reading is None else reading.trial
    drive = measured if movement is None else load_movement(movement, arm.n_joints)
    with console.progress("simulating"):
        result = run_simulation(
            arm,
            drive,
            engine=engine.value,
            integrator=integrator.value,
            dt=dt,
            rate=rate_hz,
            duration=duration_s,
            coupling=coupling.value,
        )
    plain = results.simulated_data(result, f"{model.name} along {(movement or trial or model).name}", _command(context))
    written = results.write_simulated(result, plain, folder, suffix=f".{to.value}", trial=measured) if folder else []
    console.warn([*arm.warnings, *(() if reading is None else reading.warnings)])
    present(lambda: plain, json, lambda: words.simulated(plain, written))


@app.command()
def passive(
    context: typer.Context,
    dataset: Source,
    out: MaybeFolder = None,
    cutoff_hz: Annotated[float, typer.Option(help="Cutoff of the low-pass of angles and forces [Hz].")] = 1.0,
    bins: Annotated[int, typer.Option(help="Angle bins over the range of a joint.")] = 24,
    json: JsonFile = None,
) -> int:
    """Compute passive joint moments of slow movements: elastic mean and hysteresis against the angle.

    Of the model only the rigid arm counts, none of its springs, friction or other effects.

    Exit status 1 when no joint moved long enough in both directions.
    """
    from . import results, words
    from .dataset import load_dataset
    from .moments import passive_moments

    folder = _folder(out, json)
    data = load_dataset(dataset)
    with console.progress("passive moments"):
        result = passive_moments(data, cutoff=cutoff_hz, bins=bins)
    plain = results.passive_data(result, _command(context))
    written = results.write_passive(result, plain, folder) if folder else []
    console.warn([*data.warnings, *result.warnings])
    present(lambda: plain, json, lambda: words.passive(plain, written))
    return 0 if result.curves else 1


@app.command()
def plan(
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="model.toml: the arm as it is believed to be, and the robot.")],
    angles_deg: Annotated[str, typer.Option(metavar="LOW:HIGH,…", help="Range of each joint [deg], first joint first.")],
    out: MaybeFolder = None,
    with_: Annotated[
        str, typer.Option("--with", metavar="KIND,…", help="Kinds of joint effects to be fitted besides those of the model.")
    ] = "",
    speed_rad_s: Annotated[float, typer.Option(help="Largest speed of a joint [rad/s].")] = 2.0,
    acceleration_rad_s2: Annotated[float, typer.Option(help="Largest acceleration of a joint [rad/s²].")] = 8.0,
    robot_speed_rad_s: Annotated[float, typer.Option(help="Largest speed of a joint of the robot [rad/s].")] = 4.0,
    force_n: Annotated[float, typer.Option(help="Largest force on the arm [N].")] = 60.0,
    duration_s: Annotated[float, typer.Option(help="Longest trial [s].")] = 20.0,
    repeats: Annotated[int, typer.Option(help="Trials of each movement.")] = 5,
    compare: Annotated[Path | None, typer.Option(metavar="FILE", help="Movement file to compare the plan with.")] = None,
    evaluations: Annotated[int, typer.Option(help="Movements to try.")] = 300,
    seed: Annotated[int, typer.Option(help="Seed of the search.")] = 1,
    json: JsonFile = None,
) -> int:
    """Propose movements that make the parameters identifiable, and say before the experiment how well each will be known.

    Exit status 1 when a parameter will stay uncertain by more than half its value.
    """
    from . import planning, words
    from .discrepancy import detectable
    from .model import load_model
    from .simulation import load_movement

    folder = _folder(out, json)
    arm = load_model(model)
    limits = planning.Limits(planning.angles_of(angles_deg), speed_rad_s, acceleration_rad_s2, robot_speed_rad_s, force_n, duration_s)
    other = None if compare is None else load_movement(compare, arm.n_joints)
    kinds = _listed(with_)
    with console.progress("planning"):
        found = planning.plan(arm, limits, repeats=repeats, with_effects=kinds, evaluations=evaluations, seed=seed)
        beside = None if other is None else planning.forecast(arm, [other], repeats=repeats, with_effects=kinds)
    smallest: tuple[Any, ...] = ()
    if arm.robot is not None and repeats > 1:
        with console.progress("looking for the smallest effects that they would show"):
            smallest = detectable(arm, found.movements, repeats=repeats)
    plain = planning.plan_data(found, beside, smallest)
    written = planning.write_plan(found, plain, folder) if folder else []
    present(lambda: plain, json, lambda: words.planned(plain, written))
    return 0 if found.worst <= 0.5 else 1


@app.command()
def record(
    experiment: Annotated[Path, typer.Argument(metavar="EXPERIMENT", help="EXPERIMENT.toml: subject, robot, sensors, movements.")],
    out: OutFolder,
    json: JsonFile = None,
) -> int:
    """Run an experiment in the virtual laboratory; writes a data set, the markers, and the truth in a folder of its own.

    Exit status 1 when the safety supervisor stopped a trial; that trial is not in the data set.
    """
    from . import words
    from .experiment import load_experiment
    from .laboratory import record as run_record

    _folder(out, json)
    planned = load_experiment(experiment)
    with console.progress("recording", sum(run.repeats + run.tests for run in planned.runs)) as step:
        result = run_record(planned, out, step=step)
    present(result.to_dict, json, lambda: words.recorded(result.to_dict()))
    return 1 if result.stopped else 0


@app.command()
def sweep(
    context: typer.Context,
    source: Annotated[
        Path, typer.Argument(metavar="SWEEP", help="SWEEP.toml: an experiment or a data set, how many cases, and what varies.")
    ],
    out: OutFolder,
    jobs: Annotated[int | None, typer.Option(help="Processes; all cores when absent. The results do not depend on it.")] = None,
    cluster: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Dask scheduler that does the work, such as tcp://host:8786.")
    ] = None,
    json: JsonFile = None,
) -> int:
    """Simulate and identify many cases with subjects, sensors and movements drawn at random, or resamples of a data set.

    Writes two Parquet tables, a row a case and a row an estimate. The same command goes on where an interrupted one stopped. Exit status
    1 when cases failed.

    A SWEEP.toml; docs/files.md has every key:

    \b
      cases = 200
      seed = 1
      experiment = "EXPERIMENT.toml"    # as for `armrs record`
      [identify]
      with = ["coulomb"]
      [[vary]]
      key = "joint[2].coulomb"
      range = [0.0, 0.3]                # uniform
    """  # noqa: D301 (click reads this backspace as: leave the lines as they are)
    from .montecarlo import load_sweep, words
    from .montecarlo import sweep as run_sweep

    _folder(out, json)
    if cluster is not None and jobs is not None:
        raise BadInput("--jobs", jobs, "no --jobs beside --cluster: the cluster has its own workers")
    planned = load_sweep(source)
    count = os.cpu_count() or 1 if jobs is None else jobs
    with console.progress("cases", planned.cases) as step:
        result = run_sweep(planned, out, jobs=count, cluster=cluster, step=step, command=_command(context))
    present(
        lambda: result.data | {"run": result.run, "files": list(result.files)},
        json,
        lambda: words.swept(result.data, result.run, result.files),
    )
    return 1 if result.failed else 0


@app.command()
def reproduce(context: typer.Context, out: OutFolder = Path("armrs-thesis"), json: JsonFile = None) -> None:
    """Compute every table and figure of the thesis that a machine can: what is printed, what comes out, and why they differ."""
    from . import words
    from .reproduce import run_reproduce

    _folder(out, json)
    with console.stages("the thesis") as tell:
        result = run_reproduce(out, command=_command(context), tell=tell)
    present(lambda: result.data, json, lambda: words.reproduced(result.data, result.files))


@app.command()
def report(
    sources: Annotated[list[Path], typer.Argument(metavar="RESULT.json…", help="Results that other verbs wrote.")],
    out: OutFolder = Path(),
) -> None:
    """Make one self-contained HTML report, report.html, of any results."""
    from .report import write_report

    print(write_report(sources, files.output_folder(out, "-o") / "report.html"))


app.add_typer(fmu)


@fmu.command("export")
def fmu_export(
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="model.toml")],
    out: Annotated[Path | None, typer.Option("-o", "--out", metavar="FILE", help="The FMU to write; MODEL.fmu when absent.")] = None,
    version: Annotated[Fmi, typer.Option("--fmi", help="Version of the standard: FMI 2.0 or 3.0.")] = Fmi.three,
    port: Annotated[Port, typer.Option(help="Force on the arm in, or motion of the robot's handle in.")] = Port.force,
    start_deg: Annotated[str, typer.Option(metavar="Q1,…", help="Joint angles at the start [deg]; zero when absent.")] = "",
    rest: Annotated[bool, typer.Option("--rest", help="Start in equilibrium near these angles.")] = False,
    dt: Annotated[float, typer.Option(help="Inner step [s].")] = 0.25e-3,
    json: JsonFile = None,
) -> None:
    """Export an arm as a functional mock-up unit for co-simulation: no compiler is needed.

    The same model gives the same bytes. Personal values travel inside and are protected by the token of the description.
    """
    from .cosim.slave import Slave
    from .fmu.export import export_fmu

    _folder(None, json)
    target = out if out is not None else Path(model.with_suffix(".fmu").name)
    start = _angles("--start-deg", start_deg)
    slave = Slave(model, port=port.value, start=start, rest=rest, step=dt, name=model.stem)
    written = export_fmu(slave, target, fmi=int(version.value))
    data = {"verb": "fmu export", "file": written, "fmi": int(version.value), "port": port.value, "token": slave.token}
    present(lambda: data, json, lambda: print(written))


@fmu.command("info")
def fmu_info(
    file: Annotated[Path, typer.Argument(metavar="FILE.fmu", help="Any FMU for co-simulation, FMI 2.0 or 3.0.")],
    json: JsonFile = None,
) -> None:
    """Print what an FMU says of itself: capabilities, variables, units."""
    from .fmu.info import about, info_words

    _folder(None, json)
    data = about(file)
    present(lambda: data, json, lambda: info_words(data))


@fmu.command("check")
def fmu_check(
    file: Annotated[Path, typer.Argument(metavar="FILE.fmu", help="Any FMU for co-simulation, FMI 2.0 or 3.0.")],
    json: JsonFile = None,
) -> int:
    """Check an FMU: file, description and library against the standard and against one another.

    The library is loaded and makes a step, in a process of its own. Exit status 1 when something is wrong.
    """
    import dataclasses

    from .fmu.check import check_fmu

    _folder(None, json)
    with console.progress("checking"):
        found = check_fmu(file)
    wrong = sum(f.level == "error" for f in found)

    def human() -> None:
        for finding in found:
            print(finding)
        print(f"{file.name}: {wrong} wrong" if wrong else f"{file.name}: nothing wrong found")

    present(lambda: {"verb": "fmu check", "file": file, "findings": [dataclasses.asdict(f) for f in found]}, json, human)
    return 1 if wrong else 0


@fmu.command("run")
def fmu_run(
    context: typer.Context,
    system: Annotated[Path, typer.Argument(metavar="SYSTEM.toml", help="Slaves, connections, algorithm, step and duration.")],
    out: MaybeFolder = None,
    to: Annotated[Format, typer.Option("--to", help="Format of the samples written.")] = Format.csv,
    json: JsonFile = None,
) -> int:
    """Couple arms, FMUs of any tool and walls, and say whether the numbers may be believed.

    Exit status 1 when the run is no result: it diverged, the coupling creates energy, or the iteration did not converge. Then only the
    diagnosis is written, and no samples.
    """
    from . import words
    from .cosim.master import run_system
    from .cosim.outcome import coupled_data, write_coupled
    from .cosim.system import load_system
    from .errors import CoupledError

    folder = _folder(out, json)
    loaded = load_system(system)
    try:
        with console.progress("coupling", total=loaded.count) as advance:
            run = run_system(loaded, progress=advance)
    except CoupledError as error:
        run = error.run
    finally:
        loaded.free()
    plain = coupled_data(run, system.name, _command(context))
    written = write_coupled(run, plain, folder, suffix=f".{to.value}") if folder else []
    console.warn(run.warnings)
    if run.verdict != "good":
        console.warn([f"{run.verdict}, no result: {run.why}"])
    present(lambda: plain, json, lambda: words.coupled(plain, written))
    return 0 if run.verdict == "good" else 1


def _angles(option: str, text: str) -> list[float] | None:
    """Read angles in degrees, separated by commas, as radians."""
    if not text.strip():
        return None
    try:
        return [math.radians(float(part)) for part in text.split(",")]
    except ValueError:
        raise BadInput(option, text, "numbers separated by commas") from None


def _single_trial(path: Path, n_joints: int) -> Reading:
    """Read a trial that stands alone. Its forces are not used, so that it does not matter what they act on."""
    from .trial import read_trial

    try:
        reading = read_trial(
            path, n_joints=n_joints, force_on="arm", sample_rate=None, file=path.name, configuration=path.stem, repeat=1, role="test"
        )
    except BadInput as error:
        raise error.within(file=path) from None
    if reading is None:
        raise BadInput("file", Text("no samples below the header"), "samples", file=path)
    return reading


def _listed(text: str) -> list[str]:
    return [part.strip() for part in text.split(",") if part.strip()]


def _folder(out: Path | None, json: Path | None = None) -> Path | None:
    """Refuse outputs that cannot be written before any work is done."""
    if json is not None and json != _STDOUT:
        files.may_replace(json, ".json")
        files.must_be_writable(json)
    if out is None:
        return None
    files.must_be_writable(out)
    return files.output_folder(out, "-o")


def _command(context: typer.Context) -> str:
    return shlex.join(["armrs", *(context.find_root().obj or [])])


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    command = typer.main.get_command(app)
    try:
        # Not `command.main`, which turns some errors into exits of its own.
        with command.make_context("armrs", given or ["--help"], obj=tuple(given)) as context:
            result = command.invoke(context)
        sys.stdout.flush()
    except typer.Exit as end:
        return end.exit_code
    except BadInput as error:
        return _refuse(str(_of_option(error)))
    except ArmrsError as error:
        print(f"armrs: {one_line(error)}", file=sys.stderr)
        return 1
    except _USAGE as error:
        inside = getattr(error, "ctx", None)
        return _refuse(f"{_usage_text(error)} (see {inside.command_path if inside else 'armrs'} --help)")
    except (KeyboardInterrupt, typer.Abort):
        print("armrs: interrupted", file=sys.stderr)
        return 130
    except BrokenPipeError:
        # The reader of our output has seen enough. Standard output is turned away, or its last flush would complain.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    return result if isinstance(result, int) else 0


def run() -> None:
    """Entry point of the command `armrs`."""
    sys.exit(main())


_OPTIONS = {
    "with_effects": "--with", "cutoff": "--cutoff-hz", "rate": "--rate-hz", "duration": "--duration-s",
    "robot_speed": "--robot-speed-rad-s",
    **{name: f"--{name}" for name in ("bins", "coupling", "dt", "engine", "integrator", "jobs", "level", "method", "motion")},
}  # fmt: skip
"""What the command line calls an argument of a function."""


def _of_option(error: BadInput) -> BadInput:
    """Return a refusal with the name that the argument has on the command line."""
    if error.file is not None or error.place not in _OPTIONS:
        return error
    return BadInput(_OPTIONS[error.place], error.found, error.allowed, hint=error.hint)


def _refuse(line: str) -> int:
    print(f"armrs: {one_line(line)}", file=sys.stderr)
    return 2


def _usage_text(error: Exception) -> str:
    text: str = getattr(error, "format_message", error.__str__)()
    return text.rstrip(".").replace("Value error, ", "")


def _range(low: float, high: float) -> str:
    if math.isinf(low) and math.isinf(high):
        return "any"
    if math.isinf(high):
        return f">= {low:g}"
    return f"<= {high:g}" if math.isinf(low) else f"{low:g} to {high:g}"
