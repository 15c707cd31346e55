//! `ParameterId` and `ParameterInfo`.

use pyo3::prelude::*;

use crate::errors::refused;

/// The identity of one parameter of a model: which object, which effect, which parameter.
///
/// It is the same wherever the parameter stands in a file: `joint[2].coulomb.torque` is the friction of the second joint, be
/// it stated by `[[arm.joint]]` or by `[[effect]]`.
///
/// Parameters
/// ----------
/// text : str
///     Object and parameter (`segment[1].mass`, `arm.base[2]`), or object, effect and parameter
///     (`channel[Fy].force_bias.bias`, `joint[1].coulomb[2].torque` for the second of a kind); positions from 1.
///
/// Raises
/// ------
/// BadInput
///     For what is no parameter, with the nearest known name.
///
/// Examples
/// --------
/// >>> from armrs.model import ParameterId
/// >>> ParameterId("joint[2].coulomb.torque").kind
/// 'coulomb'
#[pyclass(frozen, eq, ord, hash, str, from_py_object, module = "armrs.model")]
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ParameterId(pub arm_model::ParameterId);

impl std::fmt::Display for ParameterId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.fmt(f)
    }
}

#[pymethods]
impl ParameterId {
    #[new]
    fn new(text: &str) -> PyResult<Self> {
        text.parse().map(Self).map_err(refused)
    }
    /// What it belongs to, such as `joint[2]`.
    #[getter]
    fn object(&self) -> String {
        self.0.object().to_string()
    }
    /// The kind of effect that has it; None for a parameter of the object itself.
    #[getter]
    fn kind(&self) -> Option<&'static str> {
        self.0.kind().map(|kind| kind.info().kind)
    }
    /// Its name in files.
    #[getter]
    fn name(&self) -> &'static str {
        self.0.name()
    }
    fn __repr__(&self) -> String {
        format!("ParameterId('{}')", self.0)
    }
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> (Bound<'py, PyAny>, (String,)) {
        (slf.get_type().into_any(), (slf.get().0.to_string(),))
    }
}

/// One parameter of a model, with its bounds and unit.
#[pyclass(frozen, eq, module = "armrs.model")]
#[derive(Clone, PartialEq)]
pub struct ParameterInfo(pub arm_model::ParameterInfo);

#[pymethods]
impl ParameterInfo {
    /// Its identity.
    #[getter]
    fn id(&self) -> ParameterId {
        ParameterId(self.0.id)
    }
    /// Its value, in `unit`.
    #[getter]
    fn value(&self) -> f64 {
        self.0.value
    }
    /// SI unit.
    #[getter]
    fn unit(&self) -> &'static str {
        self.0.bounds.unit()
    }
    /// Smallest value, minus infinity where there is no limit.
    #[getter]
    fn min(&self) -> f64 {
        self.0.bounds.lower()
    }
    /// Largest value, infinity where there is no limit.
    #[getter]
    fn max(&self) -> f64 {
        self.0.bounds.upper()
    }
    fn __repr__(&self) -> String {
        format!(
            "ParameterInfo({} = {} {})",
            self.0.id,
            self.0.value,
            self.unit()
        )
    }
}

/// A parameter given by its identity or by its text.
#[derive(FromPyObject)]
pub enum AnyId<'py> {
    /// An identity.
    Id(Bound<'py, ParameterId>),
    /// Its text, or what is neither.
    Text(Bound<'py, PyAny>),
}

impl AnyId<'_> {
    /// The identity.
    pub fn id(&self) -> PyResult<arm_model::ParameterId> {
        match self {
            Self::Id(id) => Ok(id.get().0),
            Self::Text(text) => match super::value::read(text) {
                arm_model::Value::Text(text) => text.parse().map_err(refused),
                other => {
                    let allowed = "a ParameterId, or its text";
                    let refusal = arm_model::Refused::new("parameter", other.shown(), allowed);
                    Err(refused(refusal))
                }
            },
        }
    }
}
