//! The estimator.

use std::sync::Mutex;

use arm_core::estimator::{Decision, Estimator, Sample, SampleStatus};
use arm_core::{Measured, Real};
use numpy::{IntoPyArray, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::compensation::{
    GravityCompensator, TorqueAndSd, along, compensation_torque, push_torque, table,
};
use super::rows::{Table, locked, row_of};
use super::settings::Given;
use crate::arrays::by_rows;
use crate::errors::invalid;
use crate::firmware::{DeviceEquation, EFFECTS, UNKNOWNS, with_equation};
use crate::rig::Rig;

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

/// An estimator of some length.
trait Learns: GravityCompensator {
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

impl<T: Real + Send, const N: usize> GravityCompensator for Estimator<T, N, UNKNOWNS, EFFECTS> {
    fn joints(&self) -> usize {
        N
    }
    fn carry(&self, time: f64, q: &[f64], qd: &[f64]) -> Option<(Vec<f64>, Vec<f64>)> {
        compensation_torque(time, q, qd, |motion| Estimator::carry(self, motion))
    }
}

impl<T: Real + Send, const N: usize> Learns for Estimator<T, N, UNKNOWNS, EFFECTS> {
    fn used(&self) -> usize {
        self.equation().used()
    }
    fn update(&mut self, sample: Option<Read<'_>>) -> SampleStatus {
        let sample = sample.map(|row| Sample {
            q: row_of(row.q),
            lead: row.lead.map(row_of),
            measured: Measured {
                torque: row_of(row.torque),
                force_on_arm: [row.hand[0], row.hand[1]].map(T::of),
                moment_on_arm: T::of(row.hand[2]),
            },
        });
        Estimator::update(self, sample.as_ref())
    }
    fn estimates(&self) -> Vec<(f64, f64, Decision)> {
        let all = Estimator::estimates(self).iter().take(self.used());
        all.map(|e| (e.value.to_f64(), e.sd.to_f64(), e.decided_by))
            .collect()
    }
    fn health(&self) -> (Vec<f64>, f64, f64, u32) {
        let found = Estimator::health(self);
        (
            found.residual.map(T::to_f64).to_vec(),
            found.excess.to_f64(),
            found.age.to_f64(),
            found.restarts,
        )
    }
}

/// The compiled part of `armrs.online.Estimator`.
#[pyclass(frozen, module = "armrs._armrs")]
pub struct OnlineEstimator {
    inner: Mutex<Box<dyn Learns>>,
}

fn made<T: Real + Send, const N: usize>(
    equation: DeviceEquation<T, N>,
    uncertainty: f64,
    settings: &Given,
) -> PyResult<Box<dyn Learns>> {
    let priors = equation.priors(T::of(uncertainty));
    let settings = settings.core(&equation)?;
    let estimator = Estimator::new(equation, priors, &settings).map_err(invalid)?;
    Ok(Box::new(estimator))
}

#[pymethods]
impl OnlineEstimator {
    #[new]
    fn new(rig: &Rig, uncertainty: f64, settings: Given) -> PyResult<Self> {
        let single = settings.single();
        let inner =
            with_equation!(rig, single, equation => made(equation, uncertainty, &settings))?;
        let inner = Mutex::new(inner);
        Ok(Self { inner })
    }

    /// Processes the rows of a log, one control period each, and returns its state after every `every`-th of them.
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
        recorded.into_dict(py, status, [estimator.joints(), estimator.used()])
    }

    /// Torques that carry the arm at rows of a motion, and their standard deviations; NaN where a device would give none.
    fn carry<'py>(
        &self,
        py: Python<'py>,
        time: PyReadonlyArray1<'py, f64>,
        q: Table<'py>,
        qd: Table<'py>,
    ) -> PyResult<TorqueAndSd<'py>> {
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
        let estimates = all.into_iter();
        estimates
            .map(|(value, sd, decided)| (value, sd, decided.name()))
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
        let torque = estimator.carry(time, q, &vec![0.0; n]);
        push_torque(torque, n, [&mut self.torque, &mut self.torque_sd]);
        let (residual, excess, age, restarts) = estimator.health();
        self.residual.extend(residual);
        self.excess.push(excess);
        self.age.push(age);
        self.restarts.push(restarts);
    }

    fn into_dict(
        self,
        py: Python<'_>,
        status: Vec<u8>,
        [joints, used]: [usize; 2],
    ) -> PyResult<Bound<'_, PyDict>> {
        let columns = PyDict::new(py);
        columns.set_item("status", status.into_pyarray(py))?;
        columns.set_item("value", table(py, self.value, used)?)?;
        columns.set_item("sd", table(py, self.sd, used)?)?;
        columns.set_item("decided", table(py, self.decided, used)?)?;
        columns.set_item("torque", table(py, self.torque, joints)?)?;
        columns.set_item("torque_sd", table(py, self.torque_sd, joints)?)?;
        columns.set_item("residual", table(py, self.residual, joints)?)?;
        columns.set_item("excess", self.excess.into_pyarray(py))?;
        columns.set_item("age", self.age.into_pyarray(py))?;
        columns.set_item("restarts", self.restarts.into_pyarray(py))?;
        Ok(columns)
    }
}
