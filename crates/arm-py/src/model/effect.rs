//! `Effect`.

use arm_model::Table;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyMappingProxy};

use super::class::{value_class, wraps};
use super::value;
use crate::errors::refused;

/// One effect of the catalogue, with values.
///
/// Parameters
/// ----------
/// kind : str
///     Name in the catalogue.
/// joint : int, optional
///     Joint or segment it acts on, from 1.
/// channel : {"Fy", "Fz", "Mx"}, optional
///     Channel of the force sensor it acts on.
/// parameters : mapping of str to float
///     Values in SI units. What is not given takes the default of the catalogue.
///
/// Raises
/// ------
/// BadInput
///     For an unknown kind or parameter, a value out of bounds, and a joint or channel that is missing or too much.
///
/// Examples
/// --------
/// >>> import armrs
/// >>> effect = armrs.Effect("coulomb", joint=2, parameters={"torque": 0.16})
/// >>> effect.parameters["smoothing"]
/// 0.01
#[pyclass(frozen, eq, hash, module = "armrs.model")]
#[derive(Clone)]
pub struct Effect(pub arm_model::Effect);

#[pymethods]
impl Effect {
    #[new]
    #[pyo3(
        signature = (kind, joint=None, channel=None, parameters=None),
        text_signature = "(kind, joint=None, channel=None, parameters={})"
    )]
    fn new(
        kind: &Bound<'_, PyAny>,
        joint: Option<&Bound<'_, PyAny>>,
        channel: Option<&Bound<'_, PyAny>>,
        parameters: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        use arm_model::{Refused, Value};
        let parameters = match parameters.map(value::read) {
            None => Table::new(),
            Some(Value::Table(table)) => table,
            Some(other) => {
                return Err(refused(Refused::new(
                    "parameters",
                    other.shown(),
                    "a table",
                )));
            }
        };
        let name = match value::read(kind) {
            Value::Text(name) => name,
            other => {
                let refusal = Refused::new("kind", other.shown(), "a text on one line");
                return Err(refused(refusal));
            }
        };
        let site = [joint.map(value::read), channel.map(value::read)];
        arm_model::Effect::of_kind(&name, site, parameters)
            .map(Self)
            .map_err(refused)
    }
    /// Name in the catalogue.
    #[getter]
    fn kind(&self) -> &'static str {
        self.0.name()
    }
    /// Joint or segment it acts on, from 1.
    #[getter]
    fn joint(&self) -> Option<usize> {
        self.0.joint().map(|joint| joint + 1)
    }
    /// Channel of the force sensor it acts on.
    #[getter]
    fn channel(&self) -> Option<&'static str> {
        self.0.channel().map(arm_model::ForceChannel::name)
    }
    /// Values by name, in SI units and in the order of the catalogue; read-only.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyMappingProxy>> {
        let values = PyDict::new(py);
        for (name, value) in self.0.parameters() {
            values.set_item(name, value)?;
        }
        Ok(PyMappingProxy::new(py, values.as_mapping()))
    }
}

value_class!(
    Effect,
    [
        ("kind", ""),
        ("joint", ""),
        ("channel", ""),
        ("parameters", "")
    ]
);
wraps!(Effect);
