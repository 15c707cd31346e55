//! Arrays in and out: the only place where shapes are checked and copies are made.

use std::borrow::Cow;

use arm_core::Joints;
use numpy::ndarray::{ArrayD, IxDyn};
use numpy::{
    AllowTypeChange, IntoPyArray, PyArrayDyn, PyArrayLikeDyn, PyReadonlyArray2,
    PyUntypedArrayMethods,
};
use pyo3::prelude::*;

use crate::errors::bad_input;

/// Anything NumPy can read as numbers.
pub type Numbers<'py> = PyArrayLikeDyn<'py, f64, AllowTypeChange>;

/// Rows of `width` numbers: a single one or a batch.
pub struct Rows<'a> {
    name: &'static str,
    values: Cow<'a, [f64]>,
    width: usize,
    batch: Option<usize>,
}

impl<'a> Rows<'a> {
    /// Reads an argument of shape `(width,)` or `(n, width)`.
    pub fn new(name: &'static str, array: &'a Numbers<'_>, width: usize) -> PyResult<Self> {
        let batch = match *array.shape() {
            [last] if last == width => None,
            [n, last] if last == width => Some(n),
            _ => {
                let found = format!("an array of shape {:?}", array.shape());
                return Err(bad_input(
                    name,
                    found,
                    &format!("({width},) or (n, {width})"),
                ));
            }
        };
        let values = match array.as_slice() {
            Ok(slice) => Cow::Borrowed(slice),
            Err(_) => Cow::Owned(array.as_array().iter().copied().collect()),
        };
        if let Some(at) = values.iter().position(|v| !v.is_finite()) {
            let place = format!("{name}[{}, {}]", at / width, at % width);
            return Err(bad_input(&place, values[at], "a finite number"));
        }
        Ok(Self {
            name,
            values,
            width,
            batch,
        })
    }

    fn row(&self, i: usize) -> &[f64] {
        let start = if self.batch.is_some() {
            i * self.width
        } else {
            0
        };
        &self.values[start..start + self.width]
    }
}

/// Values of a row as joint values.
pub fn joints<const N: usize>(row: &[f64]) -> Joints<f64, N> {
    Joints::from_column_slice(row)
}

/// Calls `f` for every row of a batch and collects what it writes, `inner` being the shape of one result.
///
/// Arguments that are single rows serve all rows of the others.
pub fn over_rows<'py, const K: usize>(
    py: Python<'py>,
    inputs: [Rows<'_>; K],
    inner: &[usize],
    f: impl Fn([&[f64]; K], &mut [f64]) + Send + Sync,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let batch = inputs.iter().find_map(|r| r.batch);
    if let (Some(n), Some(other)) = (
        batch,
        inputs
            .iter()
            .find(|r| r.batch.is_some_and(|m| Some(m) != batch)),
    ) {
        let found = format!("{} rows", other.batch.unwrap_or(0));
        return Err(bad_input(
            other.name,
            found,
            &format!("{n} rows as the other arguments, or a single one"),
        ));
    }
    let (n, size) = (batch.unwrap_or(1), inner.iter().product::<usize>());
    let mut out = vec![0.0; n * size];
    let mut run = || {
        for (i, chunk) in out.chunks_exact_mut(size).enumerate() {
            f(std::array::from_fn(|k| inputs[k].row(i)), chunk);
        }
    };
    // Below some hundred rows, letting other threads run costs more than it gives.
    if n > 256 {
        py.detach(run)
    } else {
        run()
    }
    let shape: Vec<usize> = batch.into_iter().chain(inner.iter().copied()).collect();
    let array =
        ArrayD::from_shape_vec(IxDyn(&shape), out).expect("the buffer was made for this shape");
    Ok(array.into_pyarray(py))
}

/// Calls `f` for every row in its order, each with `width` results: for what remembers the rows before.
///
/// All arguments are batches of the same length.
pub fn in_order<'py, const K: usize>(
    py: Python<'py>,
    inputs: [Rows<'_>; K],
    width: usize,
    mut f: impl FnMut([&[f64]; K], &mut [f64]),
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let n = inputs[0].batch.unwrap_or(1);
    if let Some(other) = inputs.iter().find(|r| r.batch != inputs[0].batch) {
        let found = format!("{} rows", other.batch.unwrap_or(1));
        return Err(bad_input(other.name, found, &format!("{n} rows")));
    }
    let mut out = vec![0.0; n * width];
    for i in 0..n {
        let row = &mut out[i * width..(i + 1) * width];
        f(std::array::from_fn(|k| inputs[k].row(i)), row);
    }
    let array = ArrayD::from_shape_vec(IxDyn(&[n, width]), out)
        .expect("the buffer was made for this shape");
    Ok(array.into_pyarray(py))
}

/// A table of samples, `(n, M)`.
pub fn rows<const M: usize>(
    name: &str,
    array: &PyReadonlyArray2<'_, f64>,
) -> PyResult<Vec<[f64; M]>> {
    if array.shape()[1] != M {
        return Err(bad_input(
            name,
            format!("{} columns", array.shape()[1]),
            &format!("{M} columns"),
        ));
    }
    let view = array.as_array();
    Ok(view
        .rows()
        .into_iter()
        .map(|r| std::array::from_fn(|k| r[k]))
        .collect())
}
