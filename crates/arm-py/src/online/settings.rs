//! Settings of an estimator.

use arm_core::Real;
use arm_core::estimator::Settings;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::bad_input;
use crate::firmware::{DeviceEquation, with_equation};
use crate::rig::Rig;

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
    precision: String,
}

/// Copies settings by their names into the precision of a device.
macro_rules! copied {
    ($to:ident, $from:ident, $($name:ident),*) => { $($to.$name = T::of($from.$name);)* };
}

impl Given {
    /// Whether the device computes in single precision.
    pub fn single(&self) -> bool {
        is_single(&self.precision)
    }

    pub fn core<T: Real, const N: usize>(
        &self,
        equation: &DeviceEquation<T, N>,
    ) -> PyResult<Settings<T, N>> {
        fn each<V: Copy, const N: usize>(name: &str, values: &[V]) -> PyResult<[V; N]> {
            let found = format!("{} values", values.len());
            <[V; N]>::try_from(values)
                .map_err(|_| bad_input(name, found, &format!("{N}, one a joint")))
        }
        let mut s = Settings::new(equation.chain(), T::of(self.period));
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
        s.noise = each("noise", &self.noise)?.map(T::of);
        s.range = each("range", &self.range)?.map(|ends| ends.map(T::of));
        s.envelope = each("envelope", &self.envelope)?.map(T::of);
        Ok(s)
    }
}

/// Whether the name of a precision is "single".
pub fn is_single(precision: &str) -> bool {
    precision == "single"
}

/// Settings for an arm and a control period [s], as `armrs_estimator_settings` gives them.
#[pyfunction]
pub fn online_settings<'py>(
    py: Python<'py>,
    rig: &Rig,
    period: f64,
    precision: &str,
) -> PyResult<Bound<'py, PyDict>> {
    with_equation!(rig, is_single(precision), equation => settings_dict(py, &equation, period))
}

fn settings_dict<'py, T: Real, const N: usize>(
    py: Python<'py>,
    equation: &DeviceEquation<T, N>,
    period: f64,
) -> PyResult<Bound<'py, PyDict>> {
    let s = Settings::new(equation.chain(), T::of(period));
    let values = PyDict::new(py);
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
        values.set_item(name, value.to_f64())?;
    }
    values.set_item("noise", s.noise.map(T::to_f64).to_vec())?;
    let range = s.range.map(|ends| ends.map(T::to_f64));
    values.set_item("range", range.to_vec())?;
    values.set_item("envelope", s.envelope.map(T::to_f64).to_vec())?;
    Ok(values)
}
