//! Arrays in and out: the only place where shapes are checked and copies are made.

use std::borrow::Cow;

use arm_core::Joints;
use numpy::ndarray::{ArrayD, IxDyn};
use numpy::{
    IntoPyArray, PyArrayDyn, PyArrayMethods, PyReadonlyArray2, PyReadonlyArrayDyn,
    PyUntypedArrayMethods,
};
use pyo3::prelude::*;

use crate::errors::bad_input;

/// Anything NumPy can read as real numbers; what is none is refused where the name of the argument is known.
pub struct Numbers<'py>(PyResult<PyReadonlyArrayDyn<'py, f64>>);

impl<'a, 'py> FromPyObject<'a, 'py> for Numbers<'py> {
    type Error = std::convert::Infallible;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> Result<Self, Self::Error> {
        // A subclass of arrays may mean something else than its data: a masked one does.
        if let Ok(array) = given.cast_exact::<PyArrayDyn<f64>>()
            && let Ok(array) = array.try_readonly()
        {
            return Ok(Self(Ok(array)));
        }
        let read = || {
            let checks = given.py().import("armrs.checks")?;
            let array = checks.getattr("samples")?.call1(("", given))?;
            Ok(array.cast_into::<PyArrayDyn<f64>>()?.try_readonly()?)
        };
        Ok(Self(read()))
    }
}

impl<'py> Numbers<'py> {
    /// The array, or its refusal under the argument's name.
    fn array(&self, name: &str) -> PyResult<&PyReadonlyArrayDyn<'py, f64>> {
        self.0.as_ref().map_err(|refused| named(refused, name))
    }

    /// The numbers of a one-dimensional argument, all finite.
    pub fn list(&self, name: &'static str) -> PyResult<Vec<f64>> {
        let array = self.array(name)?;
        if array.ndim() != 1 {
            let found = format!("an array of shape {:?}", array.shape());
            return Err(bad_input(name, found, "a list of numbers, one a segment"));
        }
        let values: Vec<f64> = array.as_array().iter().copied().collect();
        if let Some(at) = values.iter().position(|v| !v.is_finite()) {
            return Err(bad_input(
                &format!("{name}[{at}]"),
                values[at],
                "a finite number",
            ));
        }
        Ok(values)
    }

    /// A single finite number.
    pub fn number(&self, name: &'static str) -> PyResult<f64> {
        let array = self.array(name)?;
        match array.as_array().iter().copied().next() {
            Some(value) if array.ndim() == 0 && value.is_finite() => Ok(value),
            Some(value) if array.ndim() == 0 => Err(bad_input(name, value, "a finite number")),
            _ => {
                let found = format!("an array of shape {:?}", array.shape());
                Err(bad_input(name, found, "a finite number"))
            }
        }
    }
}

/// A refusal from further inside, with the name of the argument in front.
fn named(refused: &PyErr, name: &str) -> PyErr {
    Python::attach(|py| {
        let arguments = pyo3::types::PyDict::new(py);
        let outer = arguments.set_item("place", name).and_then(|()| {
            refused
                .value(py)
                .call_method("within", (), Some(&arguments))
        });
        outer.map_or_else(|_| refused.clone_ref(py), PyErr::from_value)
    })
}

/// Rows of `width` numbers: a single one or a batch.
pub struct Rows<'a> {
    name: &'static str,
    values: Cow<'a, [f64]>,
    width: usize,
    batch: Option<usize>,
}

impl<'a> Rows<'a> {
    /// Reads an argument of shape `(width,)` or `(n, width)`.
    pub fn new(name: &'static str, given: &'a Numbers<'_>, width: usize) -> PyResult<Self> {
        let array = given.array(name)?;
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
    if let Some(at) = out.iter().position(|v| !v.is_finite()) {
        let names = inputs.each_ref().map(|r| r.name).join(", ");
        let row = batch.map_or(String::new(), |_| format!(" in row {}", at / size));
        return Err(bad_input(
            &names,
            format!("values of which the result is not finite{row}"),
            "numbers that an arm can have, in SI units and radians",
        ));
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
