//! Python objects as untrusted values, and values as Python objects.

use arm_model::{Table, Value};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyBytes, PyDict, PyFloat, PyInt, PyList, PyMapping, PyString};

/// Most items that are read of an iterable.
const MAX_ITEMS: usize = 10_000;
/// Deepest nesting that is read.
const MAX_DEPTH: usize = 16;

/// A Python object as a value. What no file can hold is kept as it is shown.
pub fn read(given: &Bound<'_, PyAny>) -> Value {
    deep(given, MAX_DEPTH)
}

fn deep(given: &Bound<'_, PyAny>, depth: usize) -> Value {
    if given.is_none() {
        return Value::Nothing;
    }
    let Some(depth) = depth.checked_sub(1) else {
        return Value::Other("too deep a nesting".to_owned());
    };
    if let Ok(flag) = given.cast::<PyBool>() {
        return Value::Flag(flag.is_true());
    }
    if given.is_instance_of::<PyInt>() {
        return integer(given);
    }
    if let Ok(number) = given.cast::<PyFloat>() {
        return Value::Number(number.value());
    }
    if let Ok(text) = given.cast::<PyString>() {
        return Value::Text(text.to_string_lossy().into_owned());
    }
    if given.is_instance_of::<PyBytes>() {
        return other(given);
    }
    if let Ok(mapping) = given.cast::<PyMapping>() {
        return mapped(mapping, depth).unwrap_or_else(|_| other(given));
    }
    if given.hasattr("dtype").unwrap_or(false) {
        return array(given, depth).unwrap_or_else(|_| other(given));
    }
    if let Ok(items) = given.try_iter() {
        let items: PyResult<Vec<_>> = items.take(MAX_ITEMS).collect();
        return items.map_or_else(
            |_| other(given),
            |items| Value::List(items.iter().map(|item| deep(item, depth)).collect()),
        );
    }
    number(given).unwrap_or_else(|| other(given))
}

/// A number that is of no type of its own: a fraction, a decimal.
fn number(given: &Bound<'_, PyAny>) -> Option<Value> {
    let class = given.get_type();
    if class.hasattr("__index__").unwrap_or(false) {
        return Some(integer(&given.call_method0("__index__").ok()?));
    }
    if class.hasattr("__float__").unwrap_or(false) {
        let value = given.call_method0("__float__").ok()?;
        return value.extract().ok().map(Value::Number);
    }
    None
}

fn integer(given: &Bound<'_, PyAny>) -> Value {
    match given.extract::<i64>() {
        Ok(value) => Value::Integer(value),
        // Python refuses to print more than some thousand digits.
        Err(_) => given.str().map_or_else(
            |_| Value::Other("an integer of thousands of digits".to_owned()),
            |digits| Value::Long(digits.to_string_lossy().into_owned()),
        ),
    }
}

fn mapped(mapping: &Bound<'_, PyMapping>, depth: usize) -> PyResult<Value> {
    let mut table = Table::new();
    for item in mapping.items()?.iter().take(MAX_ITEMS) {
        let (key, value): (Bound<'_, PyAny>, Bound<'_, PyAny>) = item.extract()?;
        table.0.push((key.str()?.to_string(), deep(&value, depth)));
    }
    Ok(table.into())
}

/// An array of NumPy, or one number of it.
fn array(given: &Bound<'_, PyAny>, depth: usize) -> PyResult<Value> {
    let kind: String = given.getattr("dtype")?.getattr("kind")?.extract()?;
    if !["i", "u", "f"].contains(&kind.as_str())
        || given.getattr("size")?.extract::<usize>()? > MAX_ITEMS
    {
        return Ok(other(given));
    }
    // A masked array is not taken for its data.
    if given.hasattr("mask")? {
        return Ok(other(given));
    }
    Ok(deep(&given.call_method0("tolist")?, depth + 1))
}

fn other(given: &Bound<'_, PyAny>) -> Value {
    let text = given.repr().map(|text| text.to_string_lossy().into_owned());
    Value::Other(text.unwrap_or_else(|_| "something that cannot be shown".to_owned()))
}

/// A value as a Python object.
pub fn write<'py>(py: Python<'py>, value: &Value) -> PyResult<Bound<'py, PyAny>> {
    Ok(match value {
        Value::Nothing => py.None().into_bound(py),
        Value::Flag(flag) => PyBool::new(py, *flag).to_owned().into_any(),
        Value::Integer(number) => number.into_pyobject(py)?.into_any(),
        Value::Number(number) => number.into_pyobject(py)?.into_any(),
        Value::Text(text) | Value::Long(text) | Value::Other(text) => {
            text.into_pyobject(py)?.into_any()
        }
        Value::List(items) => {
            let items: PyResult<Vec<_>> = items.iter().map(|item| write(py, item)).collect();
            PyList::new(py, items?)?.into_any()
        }
        Value::Table(table) => {
            let dict = PyDict::new(py);
            for (key, item) in &table.0 {
                dict.set_item(key, write(py, item)?)?;
            }
            dict.into_any()
        }
    })
}
