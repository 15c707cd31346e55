//! The torque that carries an arm, identified online or elsewhere.

use arm_core::effect::{MAX_STATES, Motion};
use arm_core::{Compensation, GravityCompensation, Real};
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray2, PyReadonlyArray1};
use pyo3::prelude::*;

use super::rows::{Table, row_of};
use super::settings::is_single;
use crate::arrays::by_rows;
use crate::errors::{bad_input, invalid};
use crate::firmware::{DeviceEquation, EFFECTS, UNKNOWNS, with_equation};
use crate::rig::Rig;

/// An arm of some length, which gives the torque that carries it.
pub trait GravityCompensator: Send {
    fn joints(&self) -> usize;
    /// Torques and standard deviations; None where a device would write none.
    fn carry(&self, time: f64, q: &[f64], qd: &[f64]) -> Option<(Vec<f64>, Vec<f64>)>;
}

/// As `armrs_motion` and `write_carry`: what is not finite, or not within the envelope, is not written.
pub(super) fn compensation_torque<T: Real, const N: usize>(
    time: f64,
    q: &[f64],
    qd: &[f64],
    carry: impl FnOnce(&Motion<T, N>) -> GravityCompensation<T, N>,
) -> Option<(Vec<f64>, Vec<f64>)> {
    let finite = |values: &[f64]| values.iter().all(|v| v.is_finite());
    if !(time.is_finite() && finite(q) && finite(qd)) {
        return None;
    }
    let found = carry(&Motion::new(T::of(time), row_of(q), row_of(qd)));
    let [torque, sd] = [&found.torque, &found.sd].map(|v| v.iter().map(|v| v.to_f64()).collect());
    let (torque, sd): (Vec<f64>, Vec<f64>) = (torque, sd);
    (found.within && finite(&torque) && finite(&sd)).then_some((torque, sd))
}

/// Torques and standard deviations, one row a row of the motion.
pub(super) type TorqueAndSd<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>);

/// Adds torques and standard deviations to two columns, or that there are none.
pub(super) fn push_torque(
    found: Option<(Vec<f64>, Vec<f64>)>,
    joints: usize,
    to: [&mut Vec<f64>; 2],
) {
    let none = || (vec![f64::NAN; joints], vec![f64::NAN; joints]);
    let (torque, sd) = found.unwrap_or_else(none);
    let [torques, sds] = to;
    torques.extend(torque);
    sds.extend(sd);
}

pub(super) fn along<'py>(
    py: Python<'py>,
    arm: &dyn GravityCompensator,
    [time, q, qd]: [&[f64]; 3],
) -> PyResult<TorqueAndSd<'py>> {
    let (n, mut torque, mut sd) = (arm.joints(), Vec::new(), Vec::new());
    for ((time, q), qd) in time.iter().zip(q.chunks(n)).zip(qd.chunks(n)) {
        push_torque(arm.carry(*time, q, qd), n, [&mut torque, &mut sd]);
    }
    Ok((table(py, torque, n)?, table(py, sd, n)?))
}

/// Rows of `width` numbers.
pub(super) fn table<T: numpy::Element>(
    py: Python<'_>,
    values: Vec<T>,
    width: usize,
) -> PyResult<Bound<'_, PyArray2<T>>> {
    let rows = values.len() / width;
    let made = Array2::from_shape_vec((rows, width), values);
    let made = made.map_err(|e| bad_input("rows", e, "rows of one length"))?;
    Ok(made.into_pyarray(py))
}

/// An identified arm of some length, and what carries it.
struct Identified<T, const N: usize>(Compensation<T, N, UNKNOWNS, EFFECTS>);

impl<T: Real + Send, const N: usize> GravityCompensator for Identified<T, N> {
    fn joints(&self) -> usize {
        N
    }
    fn carry(&self, time: f64, q: &[f64], qd: &[f64]) -> Option<(Vec<f64>, Vec<f64>)> {
        compensation_torque(time, q, qd, |motion| {
            self.0.carry(motion, &[[T::ZERO; MAX_STATES]; EFFECTS])
        })
    }
}

/// The compiled part of `armrs.online.Compensation`.
#[pyclass(frozen, module = "armrs._armrs")]
pub struct OnlineCompensation {
    pub inner: Box<dyn GravityCompensator + Sync>,
}

#[pymethods]
impl OnlineCompensation {
    /// Values of the unknowns as those of the rig; the covariance of those in use, by rows, as `armrs export-c` writes it.
    #[new]
    fn new(rig: &Rig, covariance: Vec<Vec<f64>>, precision: &str) -> PyResult<Self> {
        let inner =
            with_equation!(rig, is_single(precision), equation => made(equation, &covariance))?;
        Ok(Self { inner })
    }

    /// As of `OnlineEstimator`.
    fn carry<'py>(
        &self,
        py: Python<'py>,
        time: PyReadonlyArray1<'py, f64>,
        q: Table<'py>,
        qd: Table<'py>,
    ) -> PyResult<TorqueAndSd<'py>> {
        along(
            py,
            &*self.inner,
            [time.as_slice()?, &by_rows(&q), &by_rows(&qd)],
        )
    }
}

fn made<T: Real + Send + Sync, const N: usize>(
    equation: DeviceEquation<T, N>,
    given: &[Vec<f64>],
) -> PyResult<Box<dyn GravityCompensator + Sync>> {
    let used = equation.used();
    if given.len() != used || given.iter().any(|row| row.len() != used) {
        let found = format!("{} rows", given.len());
        return Err(bad_input("covariance", found, &format!("{used} by {used}")));
    }
    let mut covariance = [[T::ZERO; UNKNOWNS]; UNKNOWNS];
    for (to, from) in covariance.iter_mut().zip(given) {
        for (to, &from) in to.iter_mut().zip(from) {
            *to = T::of(from);
        }
    }
    let values = equation.priors(T::ZERO).map(|prior| prior.mean);
    let made = Compensation::new(equation, values, &covariance).map_err(invalid)?;
    Ok(Box::new(Identified(made)))
}
