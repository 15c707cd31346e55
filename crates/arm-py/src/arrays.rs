//! Arrays in and out: the only place where shapes are checked and copies are made.

use std::borrow::Cow;
use std::marker::PhantomData;

use arm_core::simd_dispatch::{Computation, dispatch};
use arm_core::{Chain, Lanes, Scalar};
use arm_sim::reserve_memory;
use numpy::ndarray::{ArrayD, Dimension, IxDyn};
use numpy::{
    Element, IntoPyArray, PyArrayDyn, PyArrayMethods, PyReadonlyArray, PyReadonlyArray2,
    PyReadonlyArrayDyn, PyUntypedArrayMethods,
};
use pyo3::prelude::*;

use crate::errors::{bad_input, simulation};
use crate::row_kernels::{Kernel, MOST};

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
        let mut values = reserved(array.len(), 1)?;
        values.extend(array.as_array().iter());
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
pub struct RowBatch<'a> {
    name: &'static str,
    values: Cow<'a, [f64]>,
    width: usize,
    batch: Option<usize>,
}

impl<'a> RowBatch<'a> {
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
        let values = match array.as_array().to_slice() {
            Some(slice) => Cow::Borrowed(slice),
            None => {
                let mut copy = reserved(array.len(), 1)?;
                copy.extend(array.as_array().iter());
                Cow::Owned(copy)
            }
        };
        if let Some(at) = first_not_finite(&values) {
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

/// The numbers of an array row by row.
///
/// NumPy's own notion of a slice takes an array that is stored column by column, as those of pandas are, for one that is stored by rows.
pub fn by_rows<'a, T: Element + Copy, D: Dimension>(
    array: &'a PyReadonlyArray<'_, T, D>,
) -> Cow<'a, [T]> {
    let view = array.as_array();
    view.to_slice()
        .map_or_else(|| Cow::Owned(view.iter().copied().collect()), Cow::Borrowed)
}

/// Memory for rows of `width` numbers, or `MemoryError` with what they need.
fn reserved(rows: usize, width: usize) -> PyResult<Vec<f64>> {
    let mut column = Vec::new();
    reserve_memory(&mut column, rows.saturating_mul(width)).map_err(simulation)?;
    Ok(column)
}

/// The first of many values that is not finite: searched for only where a whole stretch of them is not.
fn first_not_finite(values: &[f64]) -> Option<usize> {
    let finite = |v: &f64| v.is_finite();
    let mut stretches = values.chunks(64).enumerate();
    let (number, stretch) =
        stretches.find(|(_, stretch)| !stretch.iter().fold(true, |all, v| all & finite(v)))?;
    let within = stretch.iter().position(|v| !finite(v))?;
    Some(64 * number + within)
}

/// Rows that are computed side by side.
const LANES: usize = 8;

/// A kernel over every row of a batch; arguments that are single rows serve all rows of the others.
///
/// Eight rows at a time are the lanes of one call, in which each has the bits of a call of its own.
pub fn over_rows<'py, F: Kernel<K>, const K: usize, const N: usize>(
    py: Python<'py>,
    _: F,
    chain: &Chain<f64, N>,
    inputs: [RowBatch<'_>; K],
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
    let mut shape = F::shape(N);
    let (n, size) = (batch.unwrap_or(1), shape.iter().product::<usize>());
    let mut out = reserved(n, size)?;
    out.resize(n * size, 0.0);
    let mut run = || {
        // Longer arms are rare, and code for their lanes long to compile.
        if const { F::IN_LANES && N <= 3 } && batch.is_some() {
            return dispatch(Groups {
                kernel: PhantomData::<F>,
                chain: chain.cast(),
                inputs: &inputs,
                size,
                out: &mut out,
            });
        }
        for (i, result) in out.chunks_exact_mut(size).enumerate() {
            F::write(chain, inputs.each_ref().map(|r| r.row(i)), result);
        }
    };
    // Below some hundred rows, letting other threads run costs more than it gives.
    if n > 256 {
        py.detach(run)
    } else {
        run()
    }
    if let Some(at) = first_not_finite(&out) {
        let names = inputs.each_ref().map(|r| r.name).join(", ");
        let row = batch.map_or(String::new(), |_| format!(" in row {}", at / size));
        return Err(bad_input(
            &names,
            format!("values of which the result is not finite{row}"),
            "numbers that an arm can have, in SI units and radians",
        ));
    }
    if let Some(n) = batch {
        shape.insert(0, n);
    }
    let array =
        ArrayD::from_shape_vec(IxDyn(&shape), out).expect("the buffer was made for this shape");
    Ok(array.into_pyarray(py))
}

/// All rows of a batch, [`LANES`] after [`LANES`].
struct Groups<'a, F, const K: usize, const N: usize> {
    kernel: PhantomData<F>,
    chain: Chain<Lanes<LANES>, N>,
    inputs: &'a [RowBatch<'a>; K],
    /// Numbers of a result.
    size: usize,
    out: &'a mut [f64],
}

impl<F: Kernel<K>, const K: usize, const N: usize> Computation for Groups<'_, F, K, N> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { chain, inputs, .. } = self;
        let mut given = [[Lanes::<LANES>::ZERO; MOST]; K];
        let mut found = vec![Lanes::<LANES>::ZERO; self.size];
        for (group, results) in self.out.chunks_mut(LANES * self.size).enumerate() {
            let last = results.len() / self.size - 1;
            for (rows, wide) in inputs.iter().zip(&mut given) {
                for lane in 0..LANES {
                    // A last group that is not full repeats its end.
                    let row = rows.row(LANES * group + lane.min(last));
                    for (all, value) in wide.iter_mut().zip(row) {
                        all.0[lane] = *value;
                    }
                }
            }
            F::write(
                &chain,
                given.each_ref().map(|row| row.as_slice()),
                &mut found,
            );
            for (lane, result) in results.chunks_exact_mut(self.size).enumerate() {
                for (value, all) in result.iter_mut().zip(&found) {
                    *value = all.0[lane];
                }
            }
        }
    }
}

/// Calls `f` for every row in its order, each with `width` results: for functions with memory.
///
/// All arguments are batches of the same length.
pub fn in_order<'py, const K: usize>(
    py: Python<'py>,
    inputs: [RowBatch<'_>; K],
    width: usize,
    mut f: impl FnMut([&[f64]; K], &mut [f64]),
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let n = inputs[0].batch.unwrap_or(1);
    if let Some(other) = inputs.iter().find(|r| r.batch != inputs[0].batch) {
        let found = format!("{} rows", other.batch.unwrap_or(1));
        return Err(bad_input(other.name, found, &format!("{n} rows")));
    }
    let mut out = reserved(n, width)?;
    out.resize(n * width, 0.0);
    for i in 0..n {
        let row = &mut out[i * width..(i + 1) * width];
        f(std::array::from_fn(|k| inputs[k].row(i)), row);
    }
    let array = ArrayD::from_shape_vec(IxDyn(&[n, width]), out)
        .expect("the buffer was made for this shape");
    Ok(array.into_pyarray(py))
}

/// Refuses with `MemoryError` what needs more bytes than this process can get, where the system states that.
#[pyfunction]
pub fn require_memory(needed: u64) -> PyResult<()> {
    arm_sim::require_memory(needed).map_err(simulation)
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
