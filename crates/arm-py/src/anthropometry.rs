//! Values from the literature for the segments of an arm.

use arm_core::anthropometry::{Grip, PARTS, Sex, Subject};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::{bad_input, invalid};

/// What the literature expects of the segments of an arm: name and (value, standard deviation) of each quantity, by segment.
///
/// Lengths [m] may be measured; the others are scaled with height.
#[pyfunction]
pub fn literature<'py>(
    py: Python<'py>,
    body_mass: f64,
    height: f64,
    sex: &str,
    lengths: Vec<Option<f64>>,
) -> PyResult<Vec<Bound<'py, PyDict>>> {
    let sex = match sex {
        "male" => Sex::Male,
        "female" => Sex::Female,
        other => return Err(bad_input("sex", other, "male or female")),
    };
    let subject = Subject::new(body_mass, height, sex).map_err(invalid)?;
    PARTS
        .iter()
        .zip(["upper arm", "forearm", "hand"])
        .zip(lengths)
        .map(|((&part, name), length)| {
            let prior = subject
                .prior(part, length, Grip::Neutral)
                .map_err(invalid)?;
            let out = PyDict::new(py);
            out.set_item("name", name)?;
            out.set_item("length", prior.length)?;
            for (key, e) in [
                ("mass", prior.mass),
                ("com", prior.com),
                ("inertia", prior.inertia),
            ] {
                out.set_item(key, (e.value, e.sd))?;
            }
            Ok(out)
        })
        .collect()
}
