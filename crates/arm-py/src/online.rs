//! What a device runs, in Python: the estimator, the compensation and the monitor of the C interface, with its sizes and its order of
//! operations.

use std::sync::{Mutex, MutexGuard, PoisonError};

use arm_core::Compensation;
use arm_core::effect::{MAX_STATES, Motion};
use arm_core::estimator::{Decision, Estimator, Sample, SampleStatus, Settings};
use arm_core::monitor::{Channel, Monitor, Observation, Quantity, Times};
use arm_core::{GravityCompensation, Measured};
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arm::AnyChain;
use crate::convert::by_rows;
use crate::errors::{bad_input, invalid};
use crate::firmware::{DeviceEquation, EFFECTS, UNKNOWNS, device, too_long};
use crate::kernel::joints;
use crate::rig::Rig;

/// Channels that the C interface watches.
const CHANNELS: usize = 16;

/// What an estimate may rest on, by their numbers.
pub const DECISIONS: (&str, &str, &str) = (
    Decision::Data.name(),
    Decision::Prior.name(),
    Decision::Bound.name(),
);

/// What may become of a sample, by their numbers.
pub fn statuses() -> Vec<&'static str> {
    SampleStatus::ALL.iter().map(|s| s.name()).collect()
}

/// Numbers from Python, one row a sample.
type Table<'py> = PyReadonlyArray2<'py, f64>;

/// The settings of an estimator, by the names of the C interface.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Given {
    period: f64,
    cutoff: f64,
    window: f64,
    noise: Vec<f64>,
    dead_band: f64,
    range: Vec<[f64; 2]>,
    fastest: f64,
    steepest: f64,
    largest_force: f64,
    largest_torque: f64,
    gate: f64,
    frozen_after: f64,
    envelope: Vec<f64>,
    forgetting: f64,
}

/// Copies settings by their names.
macro_rules! copied {
    ($to:ident, $from:ident, $($name:ident),*) => { $($to.$name = $from.$name;)* };
}

impl Given {
    fn core<const N: usize>(&self, equation: &DeviceEquation<N>) -> PyResult<Settings<f64, N>> {
        fn each<T: Copy, const N: usize>(name: &str, values: &[T]) -> PyResult<[T; N]> {
            let found = format!("{} values", values.len());
            <[T; N]>::try_from(values)
                .map_err(|_| bad_input(name, found, &format!("{N}, one a joint")))
        }
        let mut s = Settings::new(equation.chain(), self.period);
        copied!(
            s,
            self,
            cutoff,
            window,
            dead_band,
            fastest,
            steepest,
            largest_force,
            largest_torque,
            gate,
            frozen_after,
            forgetting
        );
        s.noise = each("noise", &self.noise)?;
        s.range = each("range", &self.range)?;
        s.envelope = each("envelope", &self.envelope)?;
        Ok(s)
    }
}

/// Settings for an arm and a control period [s], as `armrs_estimator_settings` gives them.
#[pyfunction]
pub fn online_settings<'py>(
    py: Python<'py>,
    rig: &Rig,
    period: f64,
) -> PyResult<Bound<'py, PyDict>> {
    fn of<'py, const N: usize>(
        py: Python<'py>,
        equation: &DeviceEquation<N>,
        period: f64,
    ) -> PyResult<Bound<'py, PyDict>> {
        let s = Settings::new(equation.chain(), period);
        let told = PyDict::new(py);
        for (name, value) in [
            ("period", s.period),
            ("cutoff", s.cutoff),
            ("window", s.window),
            ("dead_band", s.dead_band),
            ("fastest", s.fastest),
            ("steepest", s.steepest),
            ("largest_force", s.largest_force),
            ("largest_torque", s.largest_torque),
            ("gate", s.gate),
            ("frozen_after", s.frozen_after),
            ("forgetting", s.forgetting),
        ] {
            told.set_item(name, value)?;
        }
        told.set_item("noise", s.noise.to_vec())?;
        told.set_item("range", s.range.to_vec())?;
        told.set_item("envelope", s.envelope.to_vec())?;
        Ok(told)
    }
    match &rig.arm.chain {
        AnyChain::Two(chain) => of(py, &device(chain, &rig.effects)?.0, period),
        AnyChain::Three(chain) => of(py, &device(chain, &rig.effects)?.0, period),
        _ => Err(too_long(rig)),
    }
}

/// An arm of some length that tells the torque which carries it.
pub trait Carries: Send {
    fn joints(&self) -> usize;
    /// Torques and standard deviations; None where a device would write none.
    fn carry(&self, time: f64, q: &[f64], qd: &[f64]) -> Option<(Vec<f64>, Vec<f64>)>;
}

/// As `armrs_motion` and `write_carry`: what is not finite, or not within the envelope, is not written.
fn carried<const N: usize>(
    time: f64,
    q: &[f64],
    qd: &[f64],
    carry: impl FnOnce(&Motion<f64, N>) -> GravityCompensation<f64, N>,
) -> Option<(Vec<f64>, Vec<f64>)> {
    let finite = |values: &[f64]| values.iter().all(|v| v.is_finite());
    if !(time.is_finite() && finite(q) && finite(qd)) {
        return None;
    }
    let found = carry(&Motion::new(time, joints(q), joints(qd)));
    let (torque, sd) = (
        found.torque.as_slice().to_vec(),
        found.sd.as_slice().to_vec(),
    );
    (found.within && finite(&torque) && finite(&sd)).then_some((torque, sd))
}

/// An estimator of some length.
trait Learns: Carries {
    fn used(&self) -> usize;
    fn update(&mut self, sample: Option<Read<'_>>) -> SampleStatus;
    /// Values, standard deviations, and what each rests on.
    fn estimates(&self) -> Vec<(f64, f64, Decision)>;
    fn health(&self) -> (Vec<f64>, f64, f64, u32);
}

/// One row of a log: angles, torques, force in y and z, moment.
struct Read<'a> {
    q: &'a [f64],
    lead: Option<&'a [f64]>,
    torque: &'a [f64],
    hand: &'a [f64],
}

impl<const N: usize> Carries for Estimator<f64, N, UNKNOWNS, EFFECTS> {
    fn joints(&self) -> usize {
        N
    }
    fn carry(&self, time: f64, q: &[f64], qd: &[f64]) -> Option<(Vec<f64>, Vec<f64>)> {
        carried(time, q, qd, |motion| Estimator::carry(self, motion))
    }
}

impl<const N: usize> Learns for Estimator<f64, N, UNKNOWNS, EFFECTS> {
    fn used(&self) -> usize {
        self.equation().used()
    }
    fn update(&mut self, sample: Option<Read<'_>>) -> SampleStatus {
        let sample = sample.map(|row| Sample {
            q: joints(row.q),
            lead: row.lead.map(joints),
            measured: Measured {
                torque: joints(row.torque),
                force_on_arm: [row.hand[0], row.hand[1]],
                moment_on_arm: row.hand[2],
            },
        });
        Estimator::update(self, sample.as_ref())
    }
    fn estimates(&self) -> Vec<(f64, f64, Decision)> {
        let all = Estimator::estimates(self).iter().take(self.used());
        all.map(|e| (e.value, e.sd, e.decided_by)).collect()
    }
    fn health(&self) -> (Vec<f64>, f64, f64, u32) {
        let found = Estimator::health(self);
        (
            found.residual.to_vec(),
            found.excess,
            found.age,
            found.restarts,
        )
    }
}

/// The compiled part of `armrs.online.Estimator`.
#[pyclass(frozen, module = "armrs._armrs")]
pub struct OnlineEstimator {
    inner: Mutex<Box<dyn Learns>>,
}

/// What a thread that panicked left is as good as what any other left.
fn locked<T: ?Sized>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[pymethods]
impl OnlineEstimator {
    #[new]
    fn new(rig: &Rig, uncertainty: f64, settings: Given) -> PyResult<Self> {
        fn made<const N: usize>(
            equation: DeviceEquation<N>,
            uncertainty: f64,
            settings: &Given,
        ) -> PyResult<Box<dyn Learns>> {
            let priors = equation.priors(uncertainty);
            let settings = settings.core(&equation)?;
            let estimator = Estimator::new(equation, priors, &settings).map_err(invalid)?;
            Ok(Box::new(estimator))
        }
        let inner = match &rig.arm.chain {
            AnyChain::Two(c) => made(device(c, &rig.effects)?.0, uncertainty, &settings)?,
            AnyChain::Three(c) => made(device(c, &rig.effects)?.0, uncertainty, &settings)?,
            _ => return Err(too_long(rig)),
        };
        let inner = Mutex::new(inner);
        Ok(Self { inner })
    }

    /// Takes the rows of a log in, one control period each, and tells its state after every `every`-th of them.
    ///
    /// Parameters
    /// ----------
    /// log : tuple of ndarray
    ///     Times, shape (n,); angles and torques, shape (n, n_joints); force in y and z and moment, shape (n, 3); rows of which
    ///     nothing is read, shape (n,).
    /// lead : ndarray, shape (n, n_joints), or None
    /// every : int
    ///     At least 1.
    fn run<'py>(
        &self,
        py: Python<'py>,
        log: Log<'py>,
        lead: Option<Table<'py>>,
        every: usize,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (time, q, torque, hand, missing) = &log;
        let (time, missing) = (time.as_slice()?, missing.as_slice()?);
        let (q, torque, hand) = (by_rows(q), by_rows(torque), by_rows(hand));
        let lead = lead.as_ref().map(by_rows);
        let mut status = Vec::with_capacity(time.len());
        let mut recorded = Recorded::default();
        py.detach(|| {
            let mut estimator = locked(&self.inner);
            let n = estimator.joints();
            for k in 0..time.len() {
                let span = k * n..(k + 1) * n;
                let row = (!missing[k]).then(|| Read {
                    q: &q[span.clone()],
                    lead: lead.as_ref().map(|lead| &lead[span.clone()]),
                    torque: &torque[span.clone()],
                    hand: &hand[3 * k..3 * (k + 1)],
                });
                let found = estimator.update(row);
                let place = SampleStatus::ALL.iter().position(|s| *s == found);
                status.push(place.unwrap_or(SampleStatus::ALL.len()) as u8);
                if (k + 1) % every == 0 {
                    recorded.add(&**estimator, time[k], &q[span]);
                }
            }
        });
        let estimator = locked(&self.inner);
        recorded.told(py, status, [estimator.joints(), estimator.used()])
    }

    /// Torques that carry the arm at rows of a motion, and their standard deviations; NaN where a device would give none.
    fn carry<'py>(
        &self,
        py: Python<'py>,
        time: PyReadonlyArray1<'py, f64>,
        q: Table<'py>,
        qd: Table<'py>,
    ) -> PyResult<Carried<'py>> {
        let estimator = locked(&self.inner);
        along(
            py,
            &**estimator,
            [time.as_slice()?, &by_rows(&q), &by_rows(&qd)],
        )
    }

    /// Values and standard deviations of the unknowns in use, and what each rests on.
    fn estimates(&self) -> Vec<(f64, f64, &'static str)> {
        let all = locked(&self.inner).estimates();
        let told = all.into_iter();
        told.map(|(value, sd, decided)| (value, sd, decided.name()))
            .collect()
    }

    /// Usual unexplained torque by joint [N m], excess, age [s] and restarts.
    fn health(&self) -> (Vec<f64>, f64, f64, u32) {
        locked(&self.inner).health()
    }
}

/// Times, angles, torques, loads of the hand, and rows that are missing.
type Log<'py> = (
    PyReadonlyArray1<'py, f64>,
    Table<'py>,
    Table<'py>,
    Table<'py>,
    PyReadonlyArray1<'py, bool>,
);
/// Torques and standard deviations, one row a row of the motion.
type Carried<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>);

/// Adds torques and standard deviations to two columns, or that there are none.
fn add_carried(found: Option<(Vec<f64>, Vec<f64>)>, joints: usize, to: [&mut Vec<f64>; 2]) {
    let none = || (vec![f64::NAN; joints], vec![f64::NAN; joints]);
    let (torque, sd) = found.unwrap_or_else(none);
    let [torques, sds] = to;
    torques.extend(torque);
    sds.extend(sd);
}

fn along<'py>(
    py: Python<'py>,
    arm: &dyn Carries,
    [time, q, qd]: [&[f64]; 3],
) -> PyResult<Carried<'py>> {
    let (n, mut torque, mut sd) = (arm.joints(), Vec::new(), Vec::new());
    for ((time, q), qd) in time.iter().zip(q.chunks(n)).zip(qd.chunks(n)) {
        add_carried(arm.carry(*time, q, qd), n, [&mut torque, &mut sd]);
    }
    Ok((table(py, torque, n)?, table(py, sd, n)?))
}

/// Rows of `width` numbers.
fn table<T: numpy::Element>(
    py: Python<'_>,
    values: Vec<T>,
    width: usize,
) -> PyResult<Bound<'_, PyArray2<T>>> {
    let rows = values.len() / width;
    let made = Array2::from_shape_vec((rows, width), values);
    let made = made.map_err(|e| bad_input("rows", e, "rows of one length"))?;
    Ok(made.into_pyarray(py))
}

/// The state of an estimator after some of the rows.
#[derive(Default)]
struct Recorded {
    value: Vec<f64>,
    sd: Vec<f64>,
    decided: Vec<u8>,
    torque: Vec<f64>,
    torque_sd: Vec<f64>,
    residual: Vec<f64>,
    excess: Vec<f64>,
    age: Vec<f64>,
    restarts: Vec<u32>,
}

impl Recorded {
    fn add(&mut self, estimator: &dyn Learns, time: f64, q: &[f64]) {
        for (value, sd, decided) in estimator.estimates() {
            self.value.push(value);
            self.sd.push(sd);
            self.decided.push(decided as u8);
        }
        let n = estimator.joints();
        let carried = estimator.carry(time, q, &vec![0.0; n]);
        add_carried(carried, n, [&mut self.torque, &mut self.torque_sd]);
        let (residual, excess, age, restarts) = estimator.health();
        self.residual.extend(residual);
        self.excess.push(excess);
        self.age.push(age);
        self.restarts.push(restarts);
    }

    fn told(
        self,
        py: Python<'_>,
        status: Vec<u8>,
        [joints, used]: [usize; 2],
    ) -> PyResult<Bound<'_, PyDict>> {
        let told = PyDict::new(py);
        told.set_item("status", status.into_pyarray(py))?;
        told.set_item("value", table(py, self.value, used)?)?;
        told.set_item("sd", table(py, self.sd, used)?)?;
        told.set_item("decided", table(py, self.decided, used)?)?;
        told.set_item("torque", table(py, self.torque, joints)?)?;
        told.set_item("torque_sd", table(py, self.torque_sd, joints)?)?;
        told.set_item("residual", table(py, self.residual, joints)?)?;
        told.set_item("excess", self.excess.into_pyarray(py))?;
        told.set_item("age", self.age.into_pyarray(py))?;
        told.set_item("restarts", self.restarts.into_pyarray(py))?;
        Ok(told)
    }
}

/// An identified arm of some length, and what carries it.
struct Identified<const N: usize>(Compensation<f64, N, UNKNOWNS, EFFECTS>);

impl<const N: usize> Carries for Identified<N> {
    fn joints(&self) -> usize {
        N
    }
    fn carry(&self, time: f64, q: &[f64], qd: &[f64]) -> Option<(Vec<f64>, Vec<f64>)> {
        carried(time, q, qd, |motion| {
            self.0.carry(motion, &[[0.0; MAX_STATES]; EFFECTS])
        })
    }
}

/// The compiled part of `armrs.online.Compensation`.
#[pyclass(frozen, module = "armrs._armrs")]
pub struct OnlineCompensation {
    pub inner: Box<dyn Carries + Sync>,
}

#[pymethods]
impl OnlineCompensation {
    /// Values of the unknowns as those of the rig; standard deviations without correlations, as `armrs export-c` writes them.
    #[new]
    fn new(rig: &Rig, sd: Vec<f64>) -> PyResult<Self> {
        fn made<const N: usize>(
            equation: DeviceEquation<N>,
            sd: &[f64],
        ) -> PyResult<Box<dyn Carries + Sync>> {
            let used = equation.used();
            if sd.len() != used {
                let found = format!("{} values", sd.len());
                return Err(bad_input("sd", found, &format!("{used}, one an unknown")));
            }
            let mut covariance = [[0.0; UNKNOWNS]; UNKNOWNS];
            for (k, sd) in sd.iter().enumerate() {
                covariance[k][k] = sd * sd;
            }
            let values = equation.priors(0.0).map(|prior| prior.mean);
            let made = Compensation::new(equation, values, &covariance).map_err(invalid)?;
            Ok(Box::new(Identified(made)))
        }
        let inner = match &rig.arm.chain {
            AnyChain::Two(c) => made(device(c, &rig.effects)?.0, &sd)?,
            AnyChain::Three(c) => made(device(c, &rig.effects)?.0, &sd)?,
            _ => return Err(too_long(rig)),
        };
        Ok(Self { inner })
    }

    /// As of `OnlineEstimator`.
    fn carry<'py>(
        &self,
        py: Python<'py>,
        time: PyReadonlyArray1<'py, f64>,
        q: Table<'py>,
        qd: Table<'py>,
    ) -> PyResult<Carried<'py>> {
        along(
            py,
            &*self.inner,
            [time.as_slice()?, &by_rows(&q), &by_rows(&qd)],
        )
    }
}

/// What one channel must not do, by the names of the C interface; times in microseconds, zero for no limit.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Limits {
    quantity: String,
    min: f64,
    max: f64,
    fastest: f64,
    farthest: f64,
    frozen_after: u64,
}

impl Limits {
    fn core(&self) -> PyResult<Channel<f64>> {
        use Quantity::{Acceleration, Angle, Force, Power, Speed};
        let all = [Angle, Speed, Acceleration, Force, Power];
        let Some(quantity) = all.into_iter().find(|q| q.name() == self.quantity) else {
            let allowed = all.map(Quantity::name).join(", ");
            return Err(bad_input("quantity", &self.quantity, &allowed));
        };
        let any = |change: f64| if change == 0.0 { f64::INFINITY } else { change };
        let mut channel = Channel::range(quantity, self.min, self.max)
            .fastest(any(self.fastest))
            .farthest(any(self.farthest));
        channel.frozen_after = (self.frozen_after > 0).then_some(self.frozen_after);
        Ok(channel)
    }
}

/// The row of a log, why, the channel, what was found, the limit, and when [µs].
type Stopped = (usize, &'static str, Option<usize>, f64, f64, u64);

/// The compiled part of `armrs.online.Monitor`.
#[pyclass(frozen, module = "armrs._armrs")]
pub struct OnlineMonitor {
    inner: Mutex<Monitor<f64, CHANNELS>>,
    channels: usize,
}

#[pymethods]
impl OnlineMonitor {
    #[new]
    fn new(channels: Vec<Limits>, oldest: u64, period: u64) -> PyResult<Self> {
        let count = channels.len();
        if count == 0 || count > CHANNELS {
            return Err(bad_input("channels", format!("{count} of them"), "1 to 16"));
        }
        let mut kept = [Channel::magnitude(Quantity::Force, f64::INFINITY); CHANNELS];
        for (place, limits) in kept.iter_mut().zip(&channels) {
            *place = limits.core()?;
        }
        let monitor = Monitor::new(kept, Times { oldest, period }).and_then(|m| m.watching(count));
        Ok(Self {
            inner: Mutex::new(monitor.map_err(invalid)?),
            channels: count,
        })
    }

    /// Looks at control periods until the first that is not allowed, and from then on at none.
    ///
    /// Parameters
    /// ----------
    /// times : tuple of ndarray of uint64, shape (n,)
    ///     The clock, and when the values were measured [µs].
    /// values : ndarray, shape (n, n_channels)
    /// moving : ndarray of bool, shape (n, n_channels)
    fn run(
        &self,
        times: (PyReadonlyArray1<'_, u64>, PyReadonlyArray1<'_, u64>),
        values: Table<'_>,
        moving: PyReadonlyArray2<'_, bool>,
    ) -> PyResult<Option<Stopped>> {
        let (now, stamp) = (times.0.as_slice()?, times.1.as_slice()?);
        let (values, moving) = (by_rows(&values), by_rows(&moving));
        let mut monitor = locked(&self.inner);
        for row in 0..now.len() {
            let span = row * self.channels..(row + 1) * self.channels;
            let mut seen = Observation {
                now: now[row],
                stamp: stamp[row],
                values: [0.0; CHANNELS],
                moving: [false; CHANNELS],
            };
            seen.values[..self.channels].copy_from_slice(&values[span.clone()]);
            seen.moving[..self.channels].copy_from_slice(&moving[span]);
            if let Err(stop) = monitor.check(&seen) {
                let reason = stop.reason.name();
                return Ok(Some((
                    row,
                    reason,
                    stop.channel,
                    stop.value,
                    stop.limit,
                    stop.at,
                )));
            }
        }
        Ok(None)
    }

    /// Lets a stopped device start again.
    fn reset(&self) {
        locked(&self.inner).reset();
    }
}
