//! The result of an identification.

use std::sync::Arc;

use arm_core::estimator::Decision;
use arm_ident::results as core;
use numpy::{PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2, ToPyArray};
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use super::class::{digits, nested, result_class};

result_class! {
    /// One estimated quantity.
    Estimate of core::Estimate, in "armrs.workflows.identify" {
        /// Parameter of a segment (`m2`, `m2*l2`, `l2`, `I2`) or of an effect (`torque`), or a combination of parameters.
        name: String, "";
        /// Joint or segment, from 1.
        joint: Option<usize>, "";
        /// "segment", "combination", "calibration", or the kind of effect.
        kind: String, "";
        /// Estimate, in `unit`.
        value: f64, "";
        /// Standard deviation, in `unit`.
        std: f64, "";
        /// SI unit.
        unit: String, "";
        /// Interval at the requested level.
        interval: (f64, f64), "";
        /// What the value rests on: "data", "prior" or "bound". A prior's value is an assumption that the data left open, not a measurement.
        decided_by: Decision, "";
        /// Why `std` and `interval` promise too much, where something known is wrong with what the value rests on.
        caveat: Option<String>, "", or None;
    }
}

#[pymethods]
impl Estimate {
    fn __str__(&self, py: Python<'_>) -> PyResult<String> {
        let of = &self.0;
        let own = ["segment", "combination", "calibration"].contains(&of.kind.as_str());
        let kind = if own {
            String::new()
        } else {
            format!("{} ", of.kind)
        };
        let (value, std) = (digits(py, of.value, ".4g")?, digits(py, of.std, ".2g")?);
        Ok(format!("{kind}{} = {value} ± {std} {}", of.name, of.unit))
    }
}

/// How a fitted model explains one trial, after the common low-pass.
///
/// Parameters
/// ----------
/// samples : ndarray of int, shape (m,)
///     Positions of the samples that were used in the trial.
/// measured, fitted : ndarray, shape (m, n_joints)
///     Joint torques that follow from the measurement, and those of the fitted model [N m].
#[pyclass(frozen, eq, module = "armrs.workflows.identify")]
#[derive(Clone, PartialEq)]
pub struct Fit(pub Arc<core::Fit>);

nested!(Arc<core::Fit> => Fit);

fn table<'py>(py: Python<'py>, rows: &[Vec<f64>]) -> Bound<'py, PyArray2<f64>> {
    let shape = (rows.len(), rows.first().map_or(0, Vec::len));
    numpy::ndarray::Array2::from_shape_fn(shape, |(i, j)| rows[i][j]).to_pyarray(py)
}

fn rows(table: &PyReadonlyArray2<'_, f64>) -> Vec<Vec<f64>> {
    let table = table.as_array();
    table.rows().into_iter().map(|row| row.to_vec()).collect()
}

#[pymethods]
impl Fit {
    #[new]
    fn new(
        samples: PyReadonlyArray1<'_, usize>,
        measured: PyReadonlyArray2<'_, f64>,
        fitted: PyReadonlyArray2<'_, f64>,
    ) -> Self {
        Self(Arc::new(core::Fit {
            samples: samples.as_array().to_vec(),
            measured: rows(&measured),
            fitted: rows(&fitted),
        }))
    }
    /// Positions of the samples that were used in the trial, shape (m,).
    #[getter]
    fn samples<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<usize>> {
        self.0.samples.to_pyarray(py)
    }
    /// Joint torques that follow from the measurement [N m], shape (m, n_joints).
    #[getter]
    fn measured<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        table(py, &self.0.measured)
    }
    /// Joint torques of the fitted model [N m], shape (m, n_joints).
    #[getter]
    fn fitted<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        table(py, &self.0.fitted)
    }
    fn __repr__(&self) -> String {
        let joints = self.0.measured.first().map_or(0, Vec::len);
        format!("Fit({} samples, {joints} joints)", self.0.samples.len())
    }
    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let values = ["samples", "measured", "fitted"].map(|name| slf.getattr(name));
        let values = values.into_iter().collect::<PyResult<Vec<_>>>()?;
        Ok((slf.get_type().into_any(), PyTuple::new(slf.py(), values)?))
    }
}

result_class! {
    /// What an identification came to, without the data set.
    Identification of core::Identification, in "armrs.workflows.identify" {
        /// "joint" or "cascade".
        method: String, "";
        /// How the solver ended: "solved", "almost_solved".
        status: String, "";
        /// How many combinations of the unknowns the data determine.
        rank: usize, "";
        /// Number of unknowns, calibration not counted.
        unknowns: usize, "";
        /// The unknowns and what follows from them.
        parameters: Vec<core::Estimate>, "";
        /// The base parameters: what a planar chain can show at all.
        combinations: Vec<core::Estimate>, "";
        /// Small imperfections of the measurement that were refitted within the declared tolerance.
        calibration: Vec<core::Estimate>, "";
        /// Names of the quantities between which `correlations` are; none where each joint was fitted by itself.
        correlated: Vec<String>, "";
        /// Correlations of the errors of the combinations and of the parameters of effects, by rows.
        correlations: Vec<Vec<f64>>, "";
        /// What in the result cannot be true of this arm and these sensors.
        contradictions: Vec<String>, "";
        /// What the fitted model does not describe well, and speeds that are noise.
        misfits: Vec<String>, "";
        /// What of the model the method does not take into account, or finds nothing about in these movements.
        left_out: Vec<String>, "";
        /// Which unknowns the movements cannot distinguish, in words.
        trades: Vec<String>, "";
        /// Whether no torque acted: all parameters are known up to one common factor, which was taken from the model.
        scale_free: bool, "";
        /// Probability of the intervals.
        level: f64, "";
        /// Cutoff of the zero-phase low-pass that motion and torque share, -3 dB of both passes [Hz].
        cutoff: f64, "Hz";
        /// Root mean square of the torque residual after the low-pass by role and channel [N m].
        residual_rms: core::Named<core::Named<f64>>, "N m";
        /// The same by role, configuration and channel [N m].
        residual_rms_by_configuration: core::Named<core::Named<core::Named<f64>>>, "N m";
        /// By how many standard deviations the inertia that the cascade neglects moves each first moment.
        neglected_inertia: Vec<f64>, "";
        /// Noise of each joint's speed relative to the speed itself; zero where the motion was simulated.
        speed_noise: Vec<f64>, "";
        /// Why the motion was measured where it was to be simulated if that could be done.
        not_simulated: Option<String>, "";
        /// Joints, from 1, whose dry friction is set-valued in `model` though the smooth law was given: they stick.
        sticks: Vec<usize>, "";
        /// The model with the estimates.
        model: arm_model::Model, "";
        /// How each trial is explained.
        explained: Vec<Arc<core::Fit>>, "";
    }
}

/// Adds classes and constants to the module.
pub fn add(m: &Bound<'_, PyModule>) -> PyResult<()> {
    let allowed = arm_ident::regression::measured_motion::QUIET;
    m.add("SPEED_NOISE_ALLOWED", allowed)?;
    m.add_class::<Estimate>()?;
    m.add_class::<Fit>()?;
    m.add_class::<Identification>()
}
