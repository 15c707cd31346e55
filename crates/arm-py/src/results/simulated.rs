//! `SimulatedTrial`.

use std::sync::Arc;

use arm_gap::data::course::Channels;
use arm_gap::results as core;
use arm_gap::results::Version;
use numpy::{Element, PyArray2, PyReadonlyArray2, ToPyArray};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyMappingProxy, PyTuple};

use super::class::nested;
use crate::errors::bad_input;

/// One trial as it was measured, and what models show of it.
///
/// Parameters
/// ----------
/// file : str
///     Name of the file.
/// group : int
///     The movement; repeats share it.
/// test : bool
///     Whether it is a test trial.
/// rate : float
///     Sampling rate [Hz].
/// counted : ndarray of bool, shape (n, n_channels)
///     Samples over which the gap of each channel is measured.
/// measured : ndarray, shape (n, n_channels)
///     Measured channels, in their units.
/// shown : mapping of str to ndarray or None, shape (n, n_channels)
///     Channels of the models `given`, `calibrated` and `amended`; None where the trial cannot be simulated.
/// free : mapping of str to ndarray or None, shape (n, n_joints)
///     Simulated less measured angles of a free run by model [rad]; None of a led arm.
#[pyclass(frozen, eq, module = "armrs.workflows.gap")]
#[derive(Clone, PartialEq)]
pub struct SimulatedTrial(pub Arc<core::SimulatedTrial>);

nested!(Arc<core::SimulatedTrial> => SimulatedTrial);

/// Channels as an array, `(n_samples, n_channels)`.
fn array<'py, T: Element + Copy>(py: Python<'py>, channels: &[Vec<T>]) -> Bound<'py, PyArray2<T>> {
    let (rows, columns) = (channels.first().map_or(0, Vec::len), channels.len());
    let at = |(row, column): (usize, usize)| channels[column][row];
    numpy::ndarray::Array2::from_shape_fn((rows, columns), at).to_pyarray(py)
}

fn channels<T: Element + Copy>(array: &PyReadonlyArray2<'_, T>) -> Vec<Vec<T>> {
    let columns = array.as_array();
    columns.columns().into_iter().map(|c| c.to_vec()).collect()
}

fn by_version<'py>(
    py: Python<'py>,
    all: &[Option<Channels>; 3],
) -> PyResult<Bound<'py, PyMappingProxy>> {
    let dict = PyDict::new(py);
    for (version, one) in Version::ALL.iter().zip(all) {
        dict.set_item(version.name(), one.as_ref().map(|c| array(py, c)))?;
    }
    Ok(PyMappingProxy::new(py, dict.as_mapping()))
}

fn versions(name: &str, given: &Bound<'_, PyAny>) -> PyResult<[Option<Channels>; 3]> {
    let mut all = [const { None }; 3];
    for (version, one) in Version::ALL.iter().zip(&mut all) {
        let found = given.call_method1("get", (version.name(),))?;
        let found: Option<PyReadonlyArray2<'_, f64>> = found
            .extract()
            .map_err(|_| bad_input(name, "something else", "arrays, shape (n, k), by model"))?;
        *one = found.map(|a| channels(&a));
    }
    Ok(all)
}

#[pymethods]
impl SimulatedTrial {
    #[new]
    #[allow(clippy::too_many_arguments)]
    fn new(
        file: String,
        group: usize,
        test: bool,
        rate: f64,
        counted: PyReadonlyArray2<'_, bool>,
        measured: PyReadonlyArray2<'_, f64>,
        shown: &Bound<'_, PyAny>,
        free: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        Ok(Self(Arc::new(core::SimulatedTrial {
            file,
            group,
            test,
            rate,
            counted: channels(&counted),
            measured: channels(&measured),
            shown: versions("shown", shown)?,
            free: versions("free", free)?,
        })))
    }
    /// Name of the file.
    #[getter]
    fn file(&self) -> &str {
        &self.0.file
    }
    /// The movement; repeats share it.
    #[getter]
    fn group(&self) -> usize {
        self.0.group
    }
    /// Whether it is a test trial.
    #[getter]
    fn test(&self) -> bool {
        self.0.test
    }
    /// Sampling rate [Hz].
    #[getter]
    fn rate(&self) -> f64 {
        self.0.rate
    }
    /// Samples over which the gap of each channel is measured, shape (n, n_channels).
    #[getter]
    fn counted<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<bool>> {
        array(py, &self.0.counted)
    }
    /// Measured channels, in their units, shape (n, n_channels).
    #[getter]
    fn measured<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        array(py, &self.0.measured)
    }
    /// Channels by model (`given`, `calibrated`, `amended`), shape (n, n_channels); None where the trial cannot be simulated.
    #[getter]
    fn shown<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyMappingProxy>> {
        by_version(py, &self.0.shown)
    }
    /// Simulated less measured angles of a free run by model [rad], shape (n, n_joints); None of a led arm.
    #[getter]
    fn free<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyMappingProxy>> {
        by_version(py, &self.0.free)
    }
    fn __repr__(&self) -> String {
        let of = &self.0;
        let simulated = Version::ALL.iter().filter(|v| of.version(**v).is_some());
        let simulated: Vec<&str> = simulated.map(|v| v.name()).collect();
        format!(
            "SimulatedTrial('{}': {} samples at {} Hz, {} channels; simulated: {})",
            of.file,
            of.measured.first().map_or(0, Vec::len),
            of.rate,
            of.measured.len(),
            simulated.join(", ")
        )
    }
    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        const ATTRIBUTES: [&str; 8] = [
            "file", "group", "test", "rate", "counted", "measured", "shown", "free",
        ];
        let values = ATTRIBUTES.iter().map(|name| {
            let item = slf.getattr(*name)?;
            match item.is_instance_of::<PyMappingProxy>() {
                true => item.call_method0("copy"),
                false => Ok(item),
            }
        });
        let values = values.collect::<PyResult<Vec<_>>>()?;
        Ok((slf.get_type().into_any(), PyTuple::new(slf.py(), values)?))
    }
}
