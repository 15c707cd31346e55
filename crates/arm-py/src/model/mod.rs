//! The types of `arm-model` as frozen Python classes, with the keys of the files as attributes.

mod class;
mod dataset;
mod effect;
mod muscle;
mod parameter;
mod parts;
mod value;
mod whole;

pub(crate) use class::{Attribute, Wraps, reduced, replaced, shown};
pub use dataset::{AddedMass, Description, Subject, Tolerance, TrialEntry};
pub use effect::Effect;
pub use muscle::Muscle;
pub use parameter::{ParameterId, ParameterInfo};
pub use parts::{Contact, Joint, Robot, Segment};
pub use whole::{Model, each, load_model, one};

use pyo3::prelude::*;

/// Adds the classes to the module.
pub fn add(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_class::<Segment>()?;
    m.add_class::<Joint>()?;
    m.add_class::<Robot>()?;
    m.add_class::<Contact>()?;
    m.add_class::<Effect>()?;
    m.add_class::<Model>()?;
    m.add_class::<ParameterId>()?;
    m.add_class::<ParameterInfo>()?;
    m.add_class::<Tolerance>()?;
    m.add_class::<Subject>()?;
    m.add_class::<AddedMass>()?;
    m.add_class::<Muscle>()?;
    m.add_class::<TrialEntry>()?;
    m.add_class::<Description>()?;
    m.add_function(wrap_pyfunction!(load_model, m)?)
}
