//! The common low-pass and the derivatives behind it, for time series, and least squares within bounds.

use arm_ident::regression::measured_motion::{self, low_pass};
use arm_numerics::Matrix;
use arm_numerics::least_squares::program::Program;
use arm_numerics::signal::derivative;
use numpy::ndarray::{Array1, Array2};
use numpy::{IntoPyArray, PyArray2, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::errors::{bad_input, identification};

type Table<'py> = Bound<'py, PyArray2<f64>>;

/// Zero-phase low-pass of uniform time series, and the first and second derivatives of what passed, each `(n, k)`.
///
/// `cutoff` is −3 dB of both passes together [Hz].
#[pyfunction]
pub fn smooth<'py>(
    py: Python<'py>,
    values: PyReadonlyArray2<'py, f64>,
    rate: f64,
    cutoff: f64,
) -> PyResult<(Table<'py>, Table<'py>, Table<'py>)> {
    if !(0.0 < cutoff && cutoff < 0.5 * rate) {
        let allowed = format!("above 0 and below {} Hz, half the sample rate", 0.5 * rate);
        return Err(bad_input("cutoff", cutoff, &allowed));
    }
    let filter = low_pass(cutoff, rate).map_err(identification)?;
    let (n, k) = (values.shape()[0], values.shape()[1]);
    let mut out = [(); 3].map(|()| Array2::zeros((n, k)));
    for c in 0..k {
        let column = values.as_array().column(c).to_vec();
        let passed = filter.both_ways(&column).map_err(identification)?;
        let first = derivative::first(&passed, 1.0 / rate).map_err(identification)?;
        let second = derivative::second(&passed, 1.0 / rate).map_err(identification)?;
        for (table, series) in out.iter_mut().zip([passed, first, second]) {
            table.column_mut(c).assign(&Array1::from(series));
        }
    }
    let [passed, first, second] = out.map(|table| table.into_pyarray(py));
    Ok((passed, first, second))
}

/// How far a measured path of the first joint, `(n, 2)` [m], is from the place of the base [m]: `(n, 2)` [m].
///
/// Low-passed at 5 Hz, or a fifth of a low sampling rate; −3 dB of both ways together.
#[pyfunction]
pub fn displacement_of_base<'py>(
    py: Python<'py>,
    path: PyReadonlyArray2<'py, f64>,
    place: [f64; 2],
    rate: f64,
) -> PyResult<Table<'py>> {
    let path = path.as_array();
    let points: Vec<[f64; 2]> = path.rows().into_iter().map(|r| [r[0], r[1]]).collect();
    let moved =
        measured_motion::displacement_of_base(&points, place, rate).map_err(identification)?;
    Ok(Array2::from_shape_fn((moved.len(), 2), |(i, a)| moved[i][a]).into_pyarray(py))
}

/// The least `‖a x − b‖²` with `low ≤ x ≤ high`; `a` is `(m, p)`.
#[pyfunction]
pub fn bounded_least_squares(
    a: PyReadonlyArray2<'_, f64>,
    b: Vec<f64>,
    low: Vec<f64>,
    high: Vec<f64>,
) -> PyResult<f64> {
    let values = a.as_array();
    let matrix = Matrix::from_fn(values.nrows(), values.ncols(), |i, j| values[(i, j)]);
    let program = Program::new(matrix, b).and_then(|p| p.bounds(&low, &high));
    let outcome = program.and_then(|p| p.solve()).map_err(identification)?;
    Ok(outcome.objective)
}
