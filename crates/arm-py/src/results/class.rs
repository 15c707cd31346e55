//! Common parts of the result classes: each wraps a type of the core, is a value, and is JSON by the serde of that type.

use arm_core::estimator::Decision;
use indexmap::IndexMap;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyMappingProxy, PyTuple};
use serde::Serialize;

use crate::errors::bad_input;
use crate::model::{self, Wraps};

/// What an attribute of a result may be: it goes to Python and comes back from there.
pub(crate) trait Attribute: Sized {
    /// What a constructor takes, for refusals.
    const ALLOWED: &'static str;
    /// The attribute in Python.
    fn write<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>>;
    /// What a constructor was given.
    fn read(given: &Bound<'_, PyAny>) -> PyResult<Self>;
}

macro_rules! plain {
    ($($type:ty: $allowed:literal),* $(,)?) => {
        $(impl Attribute for $type {
            const ALLOWED: &'static str = $allowed;
            fn write<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
                Ok(self.clone().into_pyobject(py)?.to_owned().into_any())
            }
            fn read(given: &Bound<'_, PyAny>) -> PyResult<Self> {
                given.extract()
            }
        })*
    };
}

plain! {
    f64: "a number",
    bool: "True or False",
    usize: "a whole number",
    i8: "a whole number",
    String: "a text",
    (f64, f64): "two numbers",
    [f64; 2]: "two numbers",
    [f64; 3]: "three numbers",
    [[f64; 2]; 2]: "two times two numbers",
    (String, Option<usize>, Option<String>): "kind, joint and channel",
}

impl Attribute for Decision {
    const ALLOWED: &'static str = "data, prior or bound";
    fn write<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.name().to_owned().write(py)
    }
    fn read(given: &Bound<'_, PyAny>) -> PyResult<Self> {
        let word: String = given.extract()?;
        let known = [Self::Data, Self::Prior, Self::Bound];
        let found = known.into_iter().find(|d| d.name() == word);
        found.ok_or_else(|| pyo3::exceptions::PyValueError::new_err(word))
    }
}

impl<T: Attribute> Attribute for Option<T> {
    const ALLOWED: &'static str = T::ALLOWED;
    fn write<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.as_ref()
            .map_or_else(|| Ok(py.None().into_bound(py)), |value| value.write(py))
    }
    fn read(given: &Bound<'_, PyAny>) -> PyResult<Self> {
        (!given.is_none()).then(|| T::read(given)).transpose()
    }
}

impl<T: Attribute> Attribute for Vec<T> {
    const ALLOWED: &'static str = "a sequence";
    fn write<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let items = self.iter().map(|item| item.write(py));
        let items = items.collect::<PyResult<Vec<_>>>()?;
        Ok(PyTuple::new(py, items)?.into_any())
    }
    fn read(given: &Bound<'_, PyAny>) -> PyResult<Self> {
        given.try_iter()?.map(|item| T::read(&item?)).collect()
    }
}

/// A read-only mapping, in its order.
impl<T: Attribute> Attribute for IndexMap<String, T> {
    const ALLOWED: &'static str = "a mapping of names";
    fn write<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let dict = PyDict::new(py);
        for (name, value) in self {
            dict.set_item(name, value.write(py)?)?;
        }
        Ok(PyMappingProxy::new(py, dict.as_mapping()).into_any())
    }
    fn read(given: &Bound<'_, PyAny>) -> PyResult<Self> {
        let items = given.call_method0("items")?;
        let one = |item: PyResult<Bound<'_, PyAny>>| {
            let (name, value): (String, Bound<'_, PyAny>) = item?.extract()?;
            Ok((name, T::read(&value)?))
        };
        items.try_iter()?.map(one).collect()
    }
}

/// Classes that are attributes of results.
macro_rules! nested {
    ($($inner:ty => $class:path),* $(,)?) => {
        $(impl $crate::results::class::Attribute for $inner {
            const ALLOWED: &'static str = concat!("an object of class ", stringify!($class));
            fn write<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
                Ok(Bound::new(py, $class(self.clone()))?.into_any())
            }
            fn read(given: &Bound<'_, PyAny>) -> PyResult<Self> {
                Ok(given.cast::<$class>()?.get().0.clone())
            }
        })*
    };
}
pub(crate) use nested;

/// Classes of the model.
macro_rules! of_model {
    ($($class:ident: $allowed:literal),*) => {
        $(impl Attribute for arm_model::$class {
            const ALLOWED: &'static str = $allowed;
            fn write<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
                Ok(Bound::new(py, model::$class::wrap(self.clone()))?.into_any())
            }
            fn read(given: &Bound<'_, PyAny>) -> PyResult<Self> {
                Ok(given.cast::<model::$class>()?.get().inner().clone())
            }
        })*
    };
}

of_model!(Model: "a Model", Effect: "an Effect");

/// The default of an argument that may be left out: what it is stands in the class.
pub(crate) fn absent(_: &str) -> Option<Bound<'static, PyAny>> {
    None
}

/// An attribute from what a constructor was given for it.
pub(crate) fn given<T: Attribute>(
    py: Python<'_>,
    name: &str,
    given: Option<Bound<'_, PyAny>>,
    default: Option<fn() -> T>,
) -> PyResult<T> {
    let none = || py.None().into_bound(py);
    match (given, default) {
        (None, Some(default)) => Ok(default()),
        (given, _) => {
            let given = given.unwrap_or_else(none);
            T::read(&given).map_err(|_| {
                let found = given
                    .repr()
                    .map_or_else(|_| String::new(), |r| r.to_string());
                bad_input(name, found, T::ALLOWED)
            })
        }
    }
}

/// A result as plain data, as it is in JSON; what is no number is None.
pub(crate) fn to_dict<'py>(py: Python<'py>, of: &impl Serialize) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(of)
        .map_err(|error| pyo3::exceptions::PyRuntimeError::new_err(error.to_string()))?;
    py.import("json")?.call_method1("loads", (text,))
}

/// `0.1234` or `1.2e-05`: a number with so many digits as Python writes it.
pub(crate) fn digits(py: Python<'_>, value: f64, form: &str) -> PyResult<String> {
    let number = value.into_pyobject(py)?;
    number.call_method1("__format__", (form,))?.extract()
}

/// Declares a class of results: its attributes with their units, and the defaults of those that may be left out.
macro_rules! result_class {
    (@default) => { None };
    (@default $default:expr) => { Some(|| $default) };
    (
        $(#[$meta:meta])*
        $class:ident of $inner:path, in $module:tt
        { $($(#[$doc:meta])* $field:ident: $type:ty, $unit:literal $(, or $default:expr)?;)* }
    ) => {
        $(#[$meta])*
        #[pyclass(frozen, eq, module = $module)]
        #[derive(Clone, PartialEq)]
        pub struct $class(pub $inner);

        impl $class {
            /// Its attributes, in the order of the constructor.
            const ATTRIBUTES: &'static [$crate::model::Attribute] = &[$((stringify!($field), $unit)),*];

            #[allow(clippy::too_many_arguments)]
            fn made(py: Python<'_>, $($field: Option<Bound<'_, PyAny>>),*) -> PyResult<Self> {
                type Inner = $inner;
                Ok(Self(Inner { $(
                    $field: $crate::results::class::given::<$type>(
                        py,
                        stringify!($field),
                        $field,
                        $crate::results::class::result_class!(@default $($default)?),
                    )?
                ),* }))
            }
        }

        $crate::results::class::nested!($inner => $class);

        #[pymethods]
        impl $class {
            #[new]
            #[pyo3(signature = ($($field $(= $crate::results::class::absent(stringify!($default)))?),*))]
            #[allow(clippy::too_many_arguments)]
            fn new(py: Python<'_>, $($field: Option<Bound<'_, PyAny>>),*) -> PyResult<Self> {
                Self::made(py, $($field),*)
            }
            $(
                $(#[$doc])*
                #[getter]
                fn $field<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
                    $crate::results::class::Attribute::write(&self.0.$field, py)
                }
            )*
            #[classattr]
            #[pyo3(name = "__match_args__")]
            fn match_args(py: Python<'_>) -> PyResult<Bound<'_, pyo3::types::PyTuple>> {
                pyo3::types::PyTuple::new(py, Self::ATTRIBUTES.iter().map(|(name, _)| *name))
            }
            fn __repr__(slf: &Bound<'_, Self>) -> PyResult<String> {
                $crate::model::shown(stringify!($class), slf.as_any(), Self::ATTRIBUTES)
            }
            fn __reduce__<'py>(
                slf: &Bound<'py, Self>,
            ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, pyo3::types::PyTuple>)> {
                $crate::model::reduced(slf.as_any(), Self::ATTRIBUTES)
            }
            #[pyo3(signature = (**changes))]
            fn __replace__<'py>(
                slf: &Bound<'py, Self>,
                changes: Option<&Bound<'py, pyo3::types::PyDict>>,
            ) -> PyResult<Bound<'py, PyAny>> {
                $crate::model::replaced(slf.as_any(), Self::ATTRIBUTES, changes)
            }
            /// Return an equal object but for the attributes given; `copy.replace` does the same.
            #[pyo3(signature = (**changes))]
            fn replace<'py>(
                slf: &Bound<'py, Self>,
                changes: Option<&Bound<'py, pyo3::types::PyDict>>,
            ) -> PyResult<Bound<'py, PyAny>> {
                $crate::model::replaced(slf.as_any(), Self::ATTRIBUTES, changes)
            }
            /// Return it as it is written to JSON; what is no number is None.
            fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
                $crate::results::class::to_dict(py, &self.0)
            }
        }
    };
}
pub(crate) use result_class;
