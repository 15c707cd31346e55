//! Simulation of a rig under a drive: the recording, and the sensor readings of it.

use std::ops::ControlFlow;

use arm_core::{Chain, Joints, Limits, Shape};
use arm_sim::{
    Coupling, Drive, Engine, Experiment, HandlePath, Integrator, Interpolation, Movement, Piece,
    SensorChannel, Sensors, Series, Start,
};
use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArrayDyn};
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;

use crate::arm::{AnyChain, each_short_length};
use crate::arrays::{by_rows, rows};
use crate::errors::{bad_input, simulation};
use crate::results::{Readings, Recording as Recorded};
use crate::rig::Rig;

/// How the arm is driven, a Python `CoreDrive`; what belongs to another kind of drive is `None`.
#[derive(FromPyObject)]
pub struct Driven<'py> {
    /// "movement", "robot", "handle", "torque" or "free".
    kind: String,
    /// Waypoints of a movement [rad]; samples of the robot's angles [rad], the handle [m] or joint torques [N m].
    values: Option<PyReadonlyArray2<'py, f64>>,
    /// Times of the samples [s].
    times: Option<PyReadonlyArray1<'py, f64>>,
    shape: String,
    speed: f64,
    acceleration: f64,
    pause: f64,
    rigid: bool,
    /// How far the first joint is from its place at the times [m].
    base: Option<PyReadonlyArray2<'py, f64>>,
    /// Activity of the muscles of each joint at the times, 0 to 1.
    activity: Option<PyReadonlyArray2<'py, f64>>,
}

/// Numerical settings, a Python `CoreRun`.
#[derive(FromPyObject)]
pub struct RunSettings {
    engine: String,
    integrator: String,
    dt: f64,
    duration: Option<f64>,
    output_interval: Option<f64>,
    /// Where it starts; the static equilibrium near it when a handle leads and no speed is given.
    q: Option<Vec<f64>>,
    qd: Option<Vec<f64>>,
}

impl RunSettings {
    fn engine(&self) -> PyResult<Engine> {
        match self.engine.as_str() {
            "native" => Ok(Engine::Native),
            "rapier" => Ok(Engine::Rapier),
            other => Err(bad_input("engine", other, "native or rapier")),
        }
    }
}

/// Noise and limits of a kind of channel, a Python `Channel`.
#[derive(FromPyObject)]
pub struct Limited {
    deviation: f64,
    correlation_time: f64,
    range: f64,
    bits: Option<u32>,
}

/// Python `Sensors`.
#[derive(FromPyObject)]
pub struct Sensing {
    rate: f64,
    angle: Limited,
    force: Limited,
    moment: Limited,
    robot: Limited,
    torque: Limited,
}

impl Sensing {
    fn sensors<const N: usize>(&self, seed: u64) -> Sensors<N> {
        let channel = |of: &Limited| SensorChannel {
            deviation: of.deviation,
            correlation_time: of.correlation_time,
            range: of.range,
            bits: of.bits,
        };
        Sensors {
            rate: self.rate,
            seed,
            angle: [channel(&self.angle); N],
            force: [channel(&self.force); 2],
            moment: channel(&self.moment),
            robot: [channel(&self.robot); 2],
            torque: [channel(&self.torque); N],
        }
    }
}

/// Simulates an experiment; see `armrs.simulate`.
#[pyfunction]
#[pyo3(signature = (rig, drive, settings, sensing=None))]
pub fn simulate<'py>(
    py: Python<'py>,
    rig: &Rig,
    drive: Driven<'py>,
    settings: RunSettings,
    sensing: Option<(Sensing, Vec<u64>)>,
) -> PyResult<Recorded> {
    fn run<'py, const N: usize>(
        py: Python<'py>,
        chain: &Chain<f64, N>,
        rig: &Rig,
        (drive, settings, sensing): (&Driven<'py>, &RunSettings, Option<&(Sensing, Vec<u64>)>),
    ) -> PyResult<Recorded> {
        let experiment = experiment(chain, rig, drive, settings)?;
        let engine = settings.engine()?;
        let outcome = py.detach(|| arm_sim::simulate_with(engine, &experiment));
        crate::custom_effects::failed()?;
        recorded(py, &experiment, outcome.map_err(simulation)?, sensing)
    }
    each_short_length!(&rig.arm.chain, c => run(py, c, rig, (&drive, &settings, sensing.as_ref())))
}

/// A recording, and what sensors read of it.
fn recorded<const N: usize>(
    py: Python<'_>,
    experiment: &Experiment<N>,
    recording: arm_sim::Recording<N>,
    sensing: Option<&(Sensing, Vec<u64>)>,
) -> PyResult<Recorded> {
    let mut readings = Vec::new();
    if let Some((sensing, seeds)) = sensing {
        for &seed in seeds {
            let sensors = sensing.sensors::<N>(seed);
            let read = sensors.read(experiment, &recording);
            readings.push(Readings::of(py, read.map_err(simulation)?)?);
        }
    }
    let piece = Piece::from(&recording);
    arm_sim::definite(&piece).map_err(simulation)?;
    let energy_error = piece.energy_error();
    Recorded::of(py, recording, energy_error, readings)
}

/// Simulates an experiment so that angles are right to an accuracy [rad]; the recording, its step [s] and the estimated error [rad].
#[pyfunction]
#[pyo3(signature = (rig, drive, settings, accuracy, sensing=None))]
pub fn simulate_accurately<'py>(
    py: Python<'py>,
    rig: &Rig,
    drive: Driven<'py>,
    settings: RunSettings,
    accuracy: f64,
    sensing: Option<(Sensing, Vec<u64>)>,
) -> PyResult<(Recorded, f64, f64)> {
    fn run<'py, const N: usize>(
        py: Python<'py>,
        chain: &Chain<f64, N>,
        rig: &Rig,
        (drive, settings, accuracy): (&Driven<'py>, &RunSettings, f64),
        sensing: Option<&(Sensing, Vec<u64>)>,
    ) -> PyResult<(Recorded, f64, f64)> {
        let mut experiment = experiment(chain, rig, drive, settings)?;
        let one = std::slice::from_ref(&experiment);
        let outcome = py.detach(|| arm_sim::simulate_accurately(one, accuracy, 1).remove(0));
        crate::custom_effects::failed()?;
        let (recording, resolved) = outcome.map_err(simulation)?;
        experiment.dt = resolved.dt;
        let recorded = recorded(py, &experiment, recording, sensing)?;
        Ok((recorded, resolved.dt, resolved.error))
    }
    each_short_length!(&rig.arm.chain, c => run(py, c, rig, (&drive, &settings, accuracy), sensing.as_ref()))
}

/// The step [s] of [`simulate_accurately`] and the estimated error [rad]; no recording is kept.
#[pyfunction]
pub fn resolve<'py>(
    py: Python<'py>,
    rig: &Rig,
    drive: Driven<'py>,
    settings: RunSettings,
    accuracy: f64,
) -> PyResult<(f64, f64)> {
    fn run<'py, const N: usize>(
        py: Python<'py>,
        chain: &Chain<f64, N>,
        rig: &Rig,
        (drive, settings, accuracy): (&Driven<'py>, &RunSettings, f64),
    ) -> PyResult<(f64, f64)> {
        let experiment = experiment(chain, rig, drive, settings)?;
        let mut interrupted = None;
        let mut go_on = || match Python::attach(|py| py.check_signals()) {
            Ok(()) => ControlFlow::Continue(()),
            Err(signal) => {
                interrupted = Some(signal);
                ControlFlow::Break(())
            }
        };
        let outcome = py.detach(|| arm_sim::resolve(&experiment, accuracy, &mut go_on));
        crate::custom_effects::failed()?;
        let broken_off = || interrupted.unwrap_or_else(|| PyKeyboardInterrupt::new_err(()));
        let resolved = outcome.map_err(simulation)?.ok_or_else(broken_off)?;
        Ok((resolved.dt, resolved.error))
    }
    each_short_length!(&rig.arm.chain, c => run(py, c, rig, (&drive, &settings, accuracy)))
}

/// Simulates an experiment and calls `take` with the columns of every so many samples; what it raises ends the run.
#[pyfunction]
pub fn simulate_in_pieces<'py>(
    py: Python<'py>,
    rig: &Rig,
    drive: Driven<'py>,
    settings: RunSettings,
    samples: usize,
    take: Py<PyAny>,
) -> PyResult<()> {
    fn run<'py, const N: usize>(
        py: Python<'py>,
        chain: &Chain<f64, N>,
        rig: &Rig,
        (drive, settings): (&Driven<'py>, &RunSettings),
        (samples, take): (usize, &Py<PyAny>),
    ) -> PyResult<()> {
        let experiment = experiment(chain, rig, drive, settings)?;
        let engine = settings.engine()?;
        let mut raised = None;
        let mut give = |piece: &Piece<'_, N>| {
            let given = Python::attach(|py| {
                arm_sim::definite(piece).map_err(simulation)?;
                let (recording, readings) = (piece.recording.clone(), Vec::new());
                let recorded = Recorded::of(py, recording, piece.energy_error(), readings)?;
                take.call1(py, (recorded,)).map(|_| ())
            });
            given.map_or_else(
                |error| {
                    raised = Some(error);
                    ControlFlow::Break(())
                },
                ControlFlow::Continue,
            )
        };
        let outcome =
            py.detach(|| arm_sim::simulate_in_pieces(engine, &experiment, samples, &mut give));
        crate::custom_effects::failed()?;
        raised.map_or(Ok(()), Err)?;
        outcome.map_err(simulation)
    }
    each_short_length!(&rig.arm.chain, c => run(py, c, rig, (&drive, &settings), (samples, &take)))
}

/// What of the energy of a piece of a run is not accounted for: the largest error, the sum of all exchanged and the largest stored energy
/// [J]; and the energies at its last sample, for the next piece.
///
/// * `before` - the last of these of the piece before
#[pyfunction]
#[pyo3(signature = (columns, before=None))]
pub fn energy_balance(
    columns: &Bound<'_, PyAny>,
    before: Option<[f64; 5]>,
) -> PyResult<(f64, f64, f64, [f64; 5])> {
    const STORED: [&str; 3] = ["energy.kinetic", "energy.potential", "energy.contact"];
    const WORK: [&str; 4] = ["work.handle", "work.drive", "work.resisted", "work.damped"];
    let column = |name| {
        columns
            .get_item(name)?
            .extract::<PyReadonlyArray1<'_, f64>>()
    };
    let largest = |most: f64, v: &f64| {
        // What is not a number stays, however large the others are.
        if v.is_nan() || most.is_nan() {
            f64::NAN
        } else {
            most.max(v.abs())
        }
    };
    let most = |name| PyResult::Ok(column(name)?.as_array().iter().fold(0.0, largest));
    let error = most("energy_error")?;
    let mut stored = 0.0;
    for name in STORED {
        stored = f64::max(stored, most(name)?);
    }
    let (mut exchanged, mut last) = (0.0, [0.0; 5]);
    for (i, name) in STORED[..1].iter().chain(&WORK).enumerate() {
        let flow = column(name)?;
        let mut then = before.map(|all| all[i]);
        for &now in flow.as_array() {
            exchanged += f64::abs(now - then.unwrap_or(now));
            then = Some(now);
        }
        last[i] = then.unwrap_or(0.0);
    }
    Ok((error, exchanged, stored, last))
}

/// The experiment that Python describes.
pub fn experiment<const N: usize>(
    chain: &Chain<f64, N>,
    rig: &Rig,
    drive: &Driven<'_>,
    settings: &RunSettings,
) -> PyResult<Experiment<N>> {
    let base = base_path(drive)?;
    let feels_activity = rig.effects.iter().any(|e| e.kind.feels_activity());
    let activity = if feels_activity {
        activity::<N>(drive)?
    } else {
        None
    };
    let (drive, first, natural) = driven(chain, rig, drive)?;
    // A whole number of recorded samples: not beyond the last sample of a drive, and up to the end of a movement.
    let whole = |d: f64| {
        settings
            .output_interval
            .map_or(d, |i| (d / i + 1e-9).floor() * i)
    };
    let natural = match natural {
        Some(Natural::Samples(d)) => Some(whole(d)),
        Some(Natural::Movement(d)) => Some(whole(
            d + settings.output_interval.unwrap_or(0.0) * (1.0 - 2e-9),
        )),
        None => None,
    };
    let duration = settings.duration.or(natural);
    let Some(duration) = duration else {
        return Err(bad_input(
            "duration",
            "none",
            "a time in seconds for an arm that swings freely",
        ));
    };
    let mut experiment = Experiment::new(rig.setup(chain), drive, duration);
    experiment.effects = rig.effects.clone();
    experiment.robot = rig.robot;
    experiment.base = base;
    experiment.activity = activity;
    experiment.dt = settings.dt;
    experiment.output_interval = settings.output_interval;
    experiment.integrator = match settings.integrator.as_str() {
        "rk4" => Integrator::Rk4,
        "euler" => Integrator::SemiImplicitEuler,
        "imex" => Integrator::Imex,
        other => return Err(bad_input("integrator", other, "rk4, euler or imex")),
    };
    let given = |name: &str, values: &Option<Vec<f64>>| match values {
        Some(v) if v.len() == N => Ok(Some(Joints::<f64, N>::from_column_slice(v))),
        Some(v) => Err(bad_input(
            name,
            format!("{} values", v.len()),
            &format!("{N}, one a joint"),
        )),
        None => Ok(None),
    };
    let (q, qd) = (
        given("start angles", &settings.q)?,
        given("start speeds", &settings.qd)?,
    );
    let led = matches!(experiment.drive, Drive::Handle { .. });
    experiment.start = match (q.or(first), qd) {
        (Some(near), None) if led => Start::Equilibrium { near },
        (q, qd) => Start::Given {
            q: q.unwrap_or_else(Joints::zeros),
            qd: qd.unwrap_or_else(Joints::zeros),
        },
    };
    Ok(experiment)
}

/// The measured path of the base, where there is one.
fn base_path(drive: &Driven<'_>) -> PyResult<Option<Series<2>>> {
    let (Some(base), Some(times)) = (&drive.base, &drive.times) else {
        return Ok(None);
    };
    let (times, points) = (times.as_array().to_vec(), rows("path of the base", base)?);
    let series = Series::new("path of the base", &times, &points, Interpolation::Cubic);
    Ok(Some(series.map_err(simulation)?))
}

/// The measured activity of muscles, where there is some; from sample to sample in straight lines, as no overshoot is one.
fn activity<const N: usize>(drive: &Driven<'_>) -> PyResult<Option<Series<N>>> {
    let (Some(activity), Some(times)) = (&drive.activity, &drive.times) else {
        return Ok(None);
    };
    let (times, points) = (times.as_array().to_vec(), rows("activity", activity)?);
    let series = Series::new("muscle activity", &times, &points, Interpolation::Linear);
    Ok(Some(series.map_err(simulation)?))
}

/// How long a drive lasts of itself [s].
enum Natural {
    Movement(f64),
    Samples(f64),
}

type Begun<const N: usize> = (Drive<N>, Option<Joints<f64, N>>, Option<Natural>);

/// The drive, the angles it starts from if it states them, and its duration.
fn driven<const N: usize>(
    chain: &Chain<f64, N>,
    rig: &Rig,
    drive: &Driven<'_>,
) -> PyResult<Begun<N>> {
    let coupling = if drive.rigid {
        Coupling::Rigid
    } else {
        Coupling::Compliant
    };
    let Some(values) = &drive.values else {
        return match drive.kind.as_str() {
            "free" => Ok((Drive::Torque(None), None, None)),
            _ => Err(bad_input("drive", "no values", "samples or waypoints")),
        };
    };
    let times = drive
        .times
        .as_ref()
        .map(|t| t.as_array().to_vec())
        .unwrap_or_default();
    let last = times.last().copied().map(Natural::Samples);
    match drive.kind.as_str() {
        "movement" => {
            let waypoints: Vec<Joints<f64, N>> = rows("waypoints", values)?
                .into_iter()
                .map(Joints::from)
                .collect();
            let shape = match drive.shape.as_str() {
                "trapezoid" => Shape::Trapezoid,
                "smooth" => Shape::Smooth,
                other => return Err(bad_input("shape", other, "trapezoid or smooth")),
            };
            let limits = Limits {
                speed: drive.speed,
                acceleration: drive.acceleration,
            };
            let movement = Movement::within(shape, &waypoints, &[limits; N], drive.pause)
                .map_err(simulation)?;
            let (first, duration) = (waypoints.first().copied(), movement.duration());
            Ok((
                Drive::Handle {
                    path: HandlePath::of_arm(*chain, movement),
                    coupling,
                },
                first,
                Some(Natural::Movement(duration)),
            ))
        }
        "robot" => {
            let Some(robot) = rig.robot else {
                return Err(bad_input(
                    "[robot]",
                    "none in the model",
                    "a robot with lengths, base and elbow",
                ));
            };
            let path = HandlePath::of_robot(robot, &times, &rows("robot angles", values)?)
                .map_err(simulation)?;
            Ok((Drive::Handle { path, coupling }, None, last))
        }
        "handle" => {
            let path = HandlePath::through_points(&times, &rows("handle positions", values)?)
                .map_err(simulation)?;
            Ok((Drive::Handle { path, coupling }, None, last))
        }
        "torque" => {
            let samples = rows::<N>("joint torques", values)?;
            let series = Series::new("joint torques", &times, &samples, Interpolation::Linear)
                .map_err(simulation)?;
            Ok((Drive::Torque(Some(series)), None, last))
        }
        other => Err(bad_input(
            "drive",
            other,
            "movement, robot, handle, torque or free",
        )),
    }
}

/// Digest of every bit of a run, which takes a quarter as long as the run; see `armrs.Simulated`.
#[pyclass(module = "armrs._armrs")]
pub struct Digest(arm_sim::Digest);

#[pymethods]
impl Digest {
    /// Begins with kind and joint of each effect.
    #[new]
    fn new(effects: Vec<(String, usize)>) -> Self {
        let effects = effects.iter().map(|(kind, joint)| (kind.as_str(), *joint));
        Self(arm_sim::Digest::of_effects(effects))
    }

    /// Begins a column with so many values.
    fn column(&mut self, name: &str, length: usize) {
        self.0.column(name, length);
    }

    /// Adds values of the column that was begun last.
    fn values(&mut self, values: PyReadonlyArrayDyn<'_, f64>) {
        self.0.values(&by_rows(&values));
    }

    /// The digest of all that was added.
    fn value(&self) -> String {
        format!("{:016x}", self.0.value())
    }
}
