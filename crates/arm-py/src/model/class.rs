//! Common parts of the model classes: each wraps a type of `arm-model`, is a value, and reads and writes the tables of the files.

use arm_model::{Refused, Table, Value};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyMappingProxy, PyTuple};

use super::value;
use crate::errors::refused;

/// Arguments of a constructor as a table; those left out are not in it.
pub(crate) fn table<const K: usize>(given: [(&str, Option<&Bound<'_, PyAny>>); K]) -> Value {
    let mut table = Table::new();
    for (name, item) in given {
        if let Some(item) = item {
            // An explicit None is a value, and refused where it is none.
            table.0.push((name.to_owned(), value::read(item)));
        }
    }
    table.into()
}

/// An attribute in Python: its name, and the unit that `repr` shows behind its value.
pub(crate) type Attribute = (&'static str, &'static str);

/// `Class(name=value unit, …)` without what is None.
pub(crate) fn shown(
    class: &str,
    slf: &Bound<'_, PyAny>,
    attributes: &[Attribute],
) -> PyResult<String> {
    let mut parts = Vec::with_capacity(attributes.len());
    for (name, unit) in attributes {
        let item = plain(slf.getattr(*name)?)?;
        if !item.is_none() {
            let gap = if unit.is_empty() { "" } else { " " };
            parts.push(format!("{name}={}{gap}{unit}", item.repr()?));
        }
    }
    Ok(format!("{class}({})", parts.join(", ")))
}

/// An attribute as a constructor takes it and as it can be pickled: read-only mappings are dicts.
fn plain(item: Bound<'_, PyAny>) -> PyResult<Bound<'_, PyAny>> {
    if !item.is_instance_of::<PyMappingProxy>() {
        return Ok(item);
    }
    let copy = PyDict::new(item.py());
    for pair in item.call_method0("items")?.try_iter()? {
        let (name, value): (Bound<'_, PyAny>, Bound<'_, PyAny>) = pair?.extract()?;
        copy.set_item(name, plain(value)?)?;
    }
    Ok(copy.into_any())
}

/// Class and arguments that make an equal object.
pub(crate) fn reduced<'py>(
    slf: &Bound<'py, PyAny>,
    attributes: &[Attribute],
) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
    let values = attributes
        .iter()
        .map(|(name, _)| plain(slf.getattr(*name)?))
        .collect::<PyResult<Vec<_>>>()?;
    let arguments = PyTuple::new(slf.py(), values)?;
    Ok((slf.get_type().into_any(), arguments))
}

/// An object with some attributes changed, checked like any other.
pub(crate) fn replaced<'py>(
    slf: &Bound<'py, PyAny>,
    attributes: &[Attribute],
    changes: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyAny>> {
    let class = slf.get_type();
    let arguments = PyDict::new(slf.py());
    for (name, _) in attributes {
        arguments.set_item(name, plain(slf.getattr(*name)?)?)?;
    }
    for (name, item) in changes.into_iter().flatten() {
        let name: String = name.extract()?;
        if !attributes.iter().any(|(known, _)| *known == name) {
            let known: Vec<&str> = attributes.iter().map(|(known, _)| *known).collect();
            let class = class.name()?.to_string();
            return Err(refused(arm_model::unknown(
                &class,
                &name,
                "attribute",
                &known,
            )));
        }
        arguments.set_item(name, item)?;
    }
    class.call((), Some(&arguments))
}

/// What every class has: equality and hash by value, `repr`, copies with changes, pickling, and the form of the files.
macro_rules! value_class {
    ($class:ident, $attributes:expr) => {
        impl $class {
            /// Its attributes, in the order of the constructor.
            const ATTRIBUTES: &'static [$crate::model::class::Attribute] = &$attributes;
        }

        impl std::hash::Hash for $class {
            fn hash<H: std::hash::Hasher>(&self, state: &mut H) {
                arm_model::write_toml(&self.inner().to_table()).hash(state);
            }
        }

        impl PartialEq for $class {
            fn eq(&self, other: &Self) -> bool {
                self.inner() == other.inner()
            }
        }

        #[pymethods]
        impl $class {
            #[classattr]
            #[pyo3(name = "__match_args__")]
            fn match_args(py: Python<'_>) -> PyResult<Bound<'_, pyo3::types::PyTuple>> {
                pyo3::types::PyTuple::new(py, Self::ATTRIBUTES.iter().map(|(name, _)| *name))
            }

            fn __repr__(slf: &Bound<'_, Self>) -> PyResult<String> {
                $crate::model::class::shown(stringify!($class), slf.as_any(), Self::ATTRIBUTES)
            }

            fn __reduce__<'py>(
                slf: &Bound<'py, Self>,
            ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, pyo3::types::PyTuple>)> {
                $crate::model::class::reduced(slf.as_any(), Self::ATTRIBUTES)
            }

            #[pyo3(signature = (**changes))]
            fn __replace__<'py>(
                slf: &Bound<'py, Self>,
                changes: Option<&Bound<'py, pyo3::types::PyDict>>,
            ) -> PyResult<Bound<'py, PyAny>> {
                $crate::model::class::replaced(slf.as_any(), Self::ATTRIBUTES, changes)
            }

            /// Return an equal object but for the attributes given, checked like any other; `copy.replace` does the same.
            #[pyo3(signature = (**changes))]
            fn replace<'py>(
                slf: &Bound<'py, Self>,
                changes: Option<&Bound<'py, pyo3::types::PyDict>>,
            ) -> PyResult<Bound<'py, PyAny>> {
                $crate::model::class::replaced(slf.as_any(), Self::ATTRIBUTES, changes)
            }

            /// Return it as it stands in a file: a dict of plain values, what is None or at a silent default left out.
            fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
                $crate::model::value::write(py, &self.inner().to_table().into())
            }

            /// Return what a table of a file describes.
            ///
            /// Parameters
            /// ----------
            /// table : mapping
            ///     Keys and values as in TOML.
            /// place : str
            ///     Name of the table, for refusals.
            ///
            /// Raises
            /// ------
            /// BadInput
            ///     For an unknown or missing key and for a value that is not allowed.
            #[staticmethod]
            #[pyo3(signature = (table, place=""))]
            fn from_dict(table: &Bound<'_, PyAny>, place: &str) -> PyResult<Self> {
                $crate::model::class::built(place, $crate::model::value::read(table))
            }
        }
    };
}

pub(crate) use value_class;

/// A class around a type of `arm-model`.
pub(crate) trait Wraps: Sized {
    /// The type.
    type Inner;
    /// Its object from a checked one.
    fn wrap(inner: Self::Inner) -> Self;
    /// Reads a table.
    fn read(place: &str, value: Value) -> Result<Self::Inner, Refused>;
}

/// An object from a table, or the refusal of it.
pub(crate) fn built<C: Wraps>(place: &str, value: Value) -> PyResult<C> {
    C::read(place, value).map(C::wrap).map_err(refused)
}

/// Declares a class as the wrapper of the type of the same name.
macro_rules! wraps {
    ($($class:ident),*) => {
        $(impl $class {
            /// The object of `arm-model`.
            pub fn inner(&self) -> &arm_model::$class {
                &self.0
            }
        }
        impl $crate::model::class::Wraps for $class {
            type Inner = arm_model::$class;
            fn wrap(inner: Self::Inner) -> Self {
                Self(inner)
            }
            fn read(place: &str, value: arm_model::Value) -> Result<Self::Inner, arm_model::Refused> {
                Self::Inner::from_value(place, value)
            }
        })*
    };
}

pub(crate) use wraps;
