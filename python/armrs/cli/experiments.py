"""The verbs `simulate`, `plan`, `record` and `sweep`."""

from __future__ import annotations

import contextlib
import dataclasses
import enum
import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import BadInput, Text
from ..report import console
from .common import JsonFile, MaybeFolder, OutFolder, SamplesFormat, command_line, listed, present, quoted, samples_suffix, writable

if TYPE_CHECKING:
    from ..io.trial import Reading


class Engine(str, enum.Enum):
    """Engines of simulation."""

    native = "native"
    rapier = "rapier"


class Integrator(str, enum.Enum):
    """Integrators of the native engine."""

    rk4 = "rk4"
    euler = "euler"
    imex = "imex"


class Coupling(str, enum.Enum):
    """How the handle holds the tip."""

    compliant = "compliant"
    rigid = "rigid"


Step = Annotated[float | None, typer.Option(help="Step [s], above 0; when absent 0.00025, or shorter if steep dry friction requires it.")]
Accuracy = Annotated[
    float | None,
    typer.Option(help="Largest error of an angle [rad], instead of a step: a step that keeps it is found by comparing runs."),
]
NativeIntegrator = Annotated[
    Integrator | None,
    typer.Option(
        "--integrator",
        help="Native engine: rk4 (default, fourth order), euler (semi-implicit, first order), imex (second order, implicit friction).",
    ),
]
DrivingTrial = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Measured trial, CSV or Parquet, whose robot angles (or joint torques) drive the arm."),
]


def simulate(
    context: typer.Context,
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="model.toml")],
    movement: Annotated[
        Path | None, typer.Option(metavar="FILE", help="TOML file with a table [movement]: waypoints_deg, speed_rad_s, …")
    ] = None,
    trial: DrivingTrial = None,
    out: MaybeFolder = None,
    engine: Annotated[Engine, typer.Option(help="native: minimal coordinates; rapier: rigid bodies and joints.")] = Engine.native,
    dt: Step = None,
    accuracy_rad: Accuracy = None,
    rate_hz: Annotated[
        float, typer.Option(help="Recorded samples per second [Hz], 0.001 or more; the interval is a whole number of steps.")
    ] = 50.0,
    integrator: NativeIntegrator = None,
    coupling: Annotated[Coupling, typer.Option(help="How the handle holds the tip.")] = Coupling.compliant,
    duration_s: Annotated[
        float | None,
        typer.Option(help="Length of the run [s], a whole number of steps, at least 1/rate; that of the movement or trial when absent."),
    ] = None,
    check_step: Annotated[
        bool, typer.Option("--check-step", help="Simulate once more with half the step, and report the difference.")
    ] = False,
    to: SamplesFormat = None,
    json: JsonFile = None,
) -> int:
    """Simulate the closed-chain experiment: a robot leads the arm.

    A warning is given if the error of the energy balance reaches 0.1 % of the exchanged energy, or if half the step changes angles or
    forces by 0.1 %; exit status 1 from 1 % on. If smooth dry friction is too steep for the default step, a shorter one is used; a run that
    does not resolve it is compared with a run at half the step.
    """
    from ..model import load_model
    from ..report import sentences
    from ..workflows.movement import load_movement
    from ..workflows.result_data import simulated_data
    from ..workflows.simulate import is_doubtful
    from ..workflows.simulation_accuracy import WRONG, step_error
    from ..workflows.stiction import sticking_warnings
    from ..workflows.streamed_simulation import stream

    if (movement is None) == (trial is None):
        raise BadInput("--movement, --trial", Text("neither" if movement is None else "both"), "one of them")
    suffix, folder = samples_suffix(to, out), writable(out, json, verb="simulate")
    arm = load_model(model)
    reading = None if trial is None else _single_trial(trial, arm.n_joints)
    measured = None if reading is None else reading.trial
    drive = measured if movement is None else load_movement(movement, arm.n_joints)
    options: dict[str, Any] = {
        "engine": engine.value,
        "integrator": None if integrator is None else integrator.value,
        "rate": rate_hz,
        "duration": duration_s,
        "coupling": coupling.value,
    }
    with contextlib.ExitStack() as stack:
        with console.progress("simulating"):
            result = stack.enter_context(stream(arm, drive, folder, dt=dt, accuracy=accuracy_rad, **options))
        halved = None
        if check_step or is_doubtful(result) is not None:
            with (
                console.progress("simulating with half the step"),
                stream(arm, drive, folder, dt=0.5 * result.settings["dt_s"], **options) as half,
            ):
                halved = step_error(result.pieces(), half.pieces())
        plain = simulated_data(result, f"{model.name} along {(movement or trial or model).name}", command_line(context))
        if halved is not None:
            plain["half_step"] = dataclasses.asdict(halved)
        written = []
        if folder:
            from ..report.result_files import write_simulated

            written = write_simulated(result, plain, folder, suffix=suffix, trial=measured)
        warnings = [*sticking_warnings(arm), *result.warnings, *(() if halved is None else halved.warnings)]
    console.warn([*arm.warnings, *(() if reading is None else reading.warnings), *warnings])
    present(lambda: plain, json, lambda: sentences.simulated(plain, written))
    worst = max(plain["energy"]["error_share"], 0.0 if halved is None else halved.share)
    return 0 if worst < WRONG else 1


def plan(
    context: typer.Context,
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="model.toml: your model of the arm, and the robot.")],
    angles_deg: Annotated[str, typer.Option(metavar="LOW:HIGH,…", help="Range of each joint [deg], first joint first.")],
    out: MaybeFolder = None,
    with_: Annotated[
        str | None,
        typer.Option(
            "--with",
            metavar="KIND,…",
            help="Kinds of joint effects (see armrs effects) to be fitted besides those of the model, or none. When absent, as identify: "
            "elastic, viscous and coulomb in joints without a law.",
        ),
    ] = None,
    speed_rad_s: Annotated[float, typer.Option(help="Largest speed of a joint [rad/s].")] = 2.0,
    acceleration_rad_s2: Annotated[float, typer.Option(help="Largest acceleration of a joint [rad/s²].")] = 8.0,
    robot_speed_rad_s: Annotated[float, typer.Option(help="Largest speed of a joint of the robot [rad/s].")] = 4.0,
    robot_acceleration_rad_s2: Annotated[float, typer.Option(help="Largest acceleration of a joint of the robot [rad/s²].")] = 60.0,
    force_n: Annotated[float, typer.Option(help="Largest force on the arm [N].")] = 60.0,
    duration_s: Annotated[float, typer.Option(help="Longest trial [s], above 0 to 600.")] = 20.0,
    repeats: Annotated[int, typer.Option(help="Trials of each movement.")] = 5,
    compare: Annotated[Path | None, typer.Option(metavar="FILE", help="Movement file to compare the plan with.")] = None,
    evaluations: Annotated[int, typer.Option(help="Movements to try.")] = 300,
    seed: Annotated[int, typer.Option(help="Seed of the search.")] = 1,
    spasticity: Annotated[
        int | None,
        typer.Option(metavar="JOINT", min=1, help="Propose stretches of this joint, from 1, at five speeds for armrs spasticity instead."),
    ] = None,
    json: JsonFile = None,
) -> int:
    """Propose movements that make the parameters identifiable, and predict how well each will be known.

    With --spasticity: stretches of one joint from 15 °/s to as fast as the limits allow, and how well they will show threshold, gain and
    latency of its reflex; the other joints are held in the middle of their ranges.

    A movement that would exceed the speed or the acceleration of the robot, or the force on the arm, is slowed along its own path, to the
    longest trial allowed or a tenth of its pace at the most.

    Exit status 1 when a parameter will stay uncertain by more than half its value.
    """
    from ..model import load_model
    from ..report import sentences
    from ..workflows import plan as planning
    from ..workflows.gap import detectable
    from ..workflows.movement import load_movement
    from ..workflows.plan_stretches import plan_stretches

    folder = writable(out, json, verb="plan")
    arm = load_model(model)
    limits = planning.Limits(
        planning.angles_of(angles_deg),
        speed=speed_rad_s,
        acceleration=acceleration_rad_s2,
        robot_speed=robot_speed_rad_s,
        robot_acceleration=robot_acceleration_rad_s2,
        force=force_n,
        duration=duration_s,
    )
    other = None if compare is None else load_movement(compare, arm.n_joints)
    kinds = None if with_ is None else [kind for kind in listed(with_) if kind != "none"]
    if spasticity is not None and (other is not None or kinds):
        raise BadInput("--spasticity", Text("--compare or --with beside it"), "one of them: stretches are planned for the reflex alone")
    with console.progress("planning"):
        found = (
            planning.plan(arm, limits, repeats=repeats, with_effects=kinds, evaluations=evaluations, seed=seed)
            if spasticity is None
            else plan_stretches(arm, limits, spasticity, repeats=repeats)
        )
        beside = None if other is None else planning.forecast(arm, [other], repeats=repeats, with_effects=kinds)
    smallest: tuple[Any, ...] = ()
    if arm.robot is not None and repeats > 1 and spasticity is None:
        with console.progress("looking for the smallest effects that they would show"):
            smallest = detectable(arm, found.movements, repeats=repeats)
    plain = planning.plan_data(found, beside, smallest, name=f"a plan for {model.name}", command=command_line(context))
    if folder:
        from ..report.result_files import write_planned
    written = write_planned(found, plain, folder) if folder else []
    present(lambda: plain, json, lambda: sentences.planned(plain, written))
    return 0 if found.worst <= planning.MOST_UNCERTAIN else 1


def record(
    context: typer.Context,
    experiment: Annotated[Path, typer.Argument(metavar="EXPERIMENT", help="EXPERIMENT.toml: subject, robot, sensors, movements.")],
    out: OutFolder,
    json: JsonFile = None,
) -> int:
    """Run an experiment in the virtual laboratory; write a data set, the markers and, in a separate folder, the true values.

    With [sensors.six_axis], the force is made of the readings of a six-axis force sensor, which are in wrench/. Exit status 1 when the
    safety supervisor stopped a trial; that trial is not in the data set.
    """
    from ..analysis.stretch_sessions import stretched_joint
    from ..report import sentences
    from ..report.result_files import write_recorded
    from ..workflows.experiment import load_experiment
    from ..workflows.record import record as run_record
    from ..workflows.result_data import origin
    from ..workflows.stiction import sticking_warnings

    writable(out, json, verb="record")
    planned = load_experiment(experiment)
    with console.progress("recording", sum(run.repeats + run.tests for run in planned.runs)) as step:
        result = run_record(planned, out, step=step)
    plain = result.to_dict() | {"made_by": origin(command_line(context))}
    report = write_recorded(result, plain, out)[-1]
    console.warn(sticking_warnings(planned.truth))
    apart = "" if any(run.tests for run in planned.runs) else "; tests = 1 in [[movement]] records a test trial, which no fit uses"
    worn = ", ".join(run.configuration for run in planned.runs if run.worn)
    alike = f"remove [[added]] and the trials of {worn} from {quoted(out / 'dataset.toml')}, then " if worn else ""
    following = f"{alike}armrs gap {quoted(out)} -o gap{apart}"
    if stretched_joint(result.dataset.trials) is not None:
        following = f"{alike}armrs check {quoted(out)}, then armrs spasticity {quoted(out)} -o spasticity"
    present(lambda: plain, json, lambda: sentences.recorded(plain, report), following)
    return 1 if result.stopped else 0


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

    Writes two Parquet tables, with one row per case and per estimate. After an interruption, the same command continues. Exit status
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
    from ..montecarlo import load_sweep, sentences
    from ..montecarlo import sweep as run_sweep
    from ..workflows.stiction import sticking_warnings

    writable(out, json, verb="sweep")
    if cluster is not None and jobs is not None:
        raise BadInput("--jobs", jobs, "no --jobs beside --cluster: the cluster has its own workers")
    planned = load_sweep(source)
    count = os.cpu_count() or 1 if jobs is None else jobs
    with console.progress("cases", planned.cases) as step:
        result = run_sweep(planned, out, jobs=count, cluster=cluster, step=step, command=command_line(context))
    if planned.dataset is None:
        console.warn(sticking_warnings(planned.experiment(planned.seed_of(1), []).truth))
    present(
        lambda: result.data | {"run": result.run, "files": list(result.files)},
        json,
        lambda: sentences.swept(result.data, result.run, result.files),
    )
    return 1 if result.failed else 0


def _single_trial(path: Path, n_joints: int) -> Reading:
    """Read a trial that stands alone. Its forces drive nothing; they are shown where the data set around it says what they act on."""
    from ..io.trial import read_trial

    force_on = _force_on(path)
    try:
        reading = read_trial(
            path,
            n_joints=n_joints,
            force_on=force_on or "arm",
            sample_rate=None,
            file=path.name,
            configuration=path.stem,
            repeat=1,
            role="test",
            loads=False,
        )
    except BadInput as error:
        raise error.within(file=path) from None
    if reading is None:
        raise BadInput("file", Text("no samples below the header"), "samples", file=path)
    if force_on is None:
        return dataclasses.replace(reading, trial=dataclasses.replace(reading.trial, force_on_arm=None))
    return reading


def _force_on(path: Path) -> str | None:
    """Return what the forces of a trial act on, from the data set in its folder or the one above; nothing where there is none."""
    from ..io import tomlfile

    for folder in (path.parent, path.parent.parent):
        description = folder / "dataset.toml"
        if description.is_file():
            said = tomlfile.read(description).get("force_on")
            return said if said in ("robot", "arm") else None
    return None
