//! User-defined kinds of effects: laws that are Python callables.

use std::cell::RefCell;
use std::sync::{Mutex, PoisonError};

use arm_core::effect::{
    CustomEffect, Info, Kind, MAX_PARAMETERS, Parameter, Part, Place, Prior, Values,
};
use arm_gap::candidates::tabulated::{Grid, Tabulated};
use numpy::ndarray::Array1;
use numpy::{IntoPyArray, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::errors::{bad_input, invalid, refused};

/// What a callable raised while the core called it.
static FAILED: Mutex<Option<PyErr>> = Mutex::new(None);

thread_local! {
    /// The laws that this thread evaluates.
    static EVALUATING: RefCell<Vec<&'static str>> = const { RefCell::new(Vec::new()) };
}

/// The kind of a name: of the catalogue or user-defined.
pub fn kind(name: &str) -> PyResult<Kind> {
    arm_model::kind(name).map_or_else(|| Kind::named(name).map_err(invalid), Ok)
}

/// Raises what a callable has raised meanwhile.
pub fn failed() -> PyResult<()> {
    let mut last = FAILED.lock().unwrap_or_else(PoisonError::into_inner);
    last.take().map_or(Ok(()), Err)
}

/// One parameter: name, unit, smallest and largest value, start, whether the torque is linear in it, and values of a shape
/// that a search tries.
type DeclaredParameter = (String, String, f64, f64, f64, bool, Vec<f64>);

/// Declares a kind of effect whose law is a callable; see `armrs.own_effect`.
///
/// Parameters
/// ----------
/// name, summary, formula : str
/// parameters : list of tuple
///     Those in which the torque is linear first.
/// grid : (float, float, float, float, int, int)
///     Smallest and largest angle [rad], largest speed and its knee [rad/s], numbers of angles and speeds.
/// tabulate : callable
///     Takes angles [rad], speeds [rad/s] and all parameters, returns an array, shape (n_linear, n_angles, n_speeds) [N m].
#[pyfunction]
pub fn declare(
    name: String,
    summary: String,
    formula: String,
    parameters: Vec<DeclaredParameter>,
    grid: (f64, f64, f64, f64, usize, usize),
    tabulate: Py<PyAny>,
) -> PyResult<()> {
    if parameters.len() > MAX_PARAMETERS {
        return Err(bad_input(
            "parameters",
            parameters.len(),
            &format!("at most {MAX_PARAMETERS}"),
        ));
    }
    let (low, high, speed, knee, angles, speeds) = grid;
    let grid = Grid {
        angle: [low, high],
        speed,
        knee,
        count: [angles.max(4), speeds.max(4)],
    };
    let prior = Prior::lasting(leak(vec![part(&parameters)]));
    let info: &'static Info = Box::leak(Box::new(Info {
        kind: name.leak(),
        place: Place::Joint,
        summary: summary.leak(),
        formula: formula.leak(),
        reference: "of one's own",
        parameters: leak(parameters.into_iter().map(parameter).collect()),
        states: 0,
    }));
    let me = info.kind;
    let compute = move |p: &[f64]| {
        tabulate_once(me, &tabulate, grid, p)
            .map_err(|error| {
                *FAILED.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
            })
            .ok()
    };
    let law = Box::leak(Box::new(Tabulated::new(
        info,
        prior,
        grid,
        Box::new(compute),
    )));
    arm_model::declare(Kind::Custom(CustomEffect::new(law))).map_err(refused)
}

/// The one part of the kind: all linear parameters are its sizes, shapes with values occur with them.
///
/// A kind lives as long as the program, like those of the catalogue: models and results refer to it.
fn part(parameters: &[DeclaredParameter]) -> Part {
    let linear = parameters.iter().take_while(|p| p.5).count();
    let sizes: &'static [usize] = leak((0..linear).collect());
    let varying: &'static [usize] = leak((linear..parameters.len()).collect());
    let shapes: Vec<(usize, Values)> = parameters
        .iter()
        .enumerate()
        .filter(|(_, p)| !p.6.is_empty())
        .map(|(k, p)| (k, Values::Each(leak(p.6.clone()))))
        .collect();
    Part::of(sizes).shaped(leak(shapes)).varying(varying)
}

fn parameter((name, unit, min, max, default, linear, _): DeclaredParameter) -> Parameter {
    Parameter {
        or_zero: false,
        name: name.leak(),
        unit: unit.leak(),
        min,
        max,
        default,
        linear,
    }
}

/// Calls a law for its table, unless a call is active: one that simulates an arm with this very effect would never end.
fn tabulate_once(
    me: &'static str,
    tabulate: &Py<PyAny>,
    grid: Grid,
    p: &[f64],
) -> PyResult<Vec<Vec<f64>>> {
    if EVALUATING.with_borrow(|laws| laws.contains(&me)) {
        return Err(bad_input(
            &format!("law of {me}"),
            "a law that simulates an arm with this effect",
            "a function of angle and speed",
        ));
    }
    EVALUATING.with_borrow_mut(|laws| laws.push(me));
    let table = Python::attach(|py| table_of(py, tabulate, grid, p));
    EVALUATING.with_borrow_mut(Vec::pop);
    table
}

fn leak<T>(list: Vec<T>) -> &'static [T] {
    list.leak()
}

fn table_of(
    py: Python<'_>,
    tabulate: &Py<PyAny>,
    grid: Grid,
    p: &[f64],
) -> PyResult<Vec<Vec<f64>>> {
    let row = |values: Vec<f64>| Array1::from_vec(values).into_pyarray(py);
    let arguments = (row(grid.angles()), row(grid.speeds()), row(p.to_vec()));
    let table = tabulate.call1(py, arguments)?;
    let array: PyReadonlyArray3<'_, f64> = table.extract(py)?;
    let [layers, ..] = *array.shape() else {
        return Err(bad_input("law", "no table", "an array"));
    };
    let view = array.as_array();
    Ok((0..layers)
        .map(|k| {
            view.index_axis(numpy::ndarray::Axis(0), k)
                .iter()
                .copied()
                .collect()
        })
        .collect())
}
