//! The catalogue of effects as Python data.

use arm_core::effect::Kind;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple};

/// Adds constants to the module.
pub fn add(m: &Bound<'_, PyModule>) -> PyResult<()> {
    let laws = arm_model::joint_laws().map(|(key, kind, size)| (key, kind.info().kind, size));
    m.add(
        "JOINT_LAWS",
        PyTuple::new(m.py(), laws.collect::<Vec<_>>())?,
    )
}

/// All kinds of effects, user-defined ones last: name, title, where, parameters with units and bounds, formula, reference.
#[pyfunction]
pub fn effects(py: Python<'_>) -> PyResult<Bound<'_, PyList>> {
    let list = PyList::empty(py);
    for kind in arm_model::kinds() {
        let info = kind.info();
        let parameters = PyList::empty(py);
        for p in info.parameters {
            let entry = PyDict::new(py);
            entry.set_item("name", p.name)?;
            entry.set_item("unit", p.unit)?;
            entry.set_item("min", p.min)?;
            entry.set_item("max", p.max)?;
            entry.set_item("default", p.default)?;
            entry.set_item("linear", p.linear)?;
            entry.set_item("or_zero", p.or_zero)?;
            parameters.append(entry)?;
        }
        let entry = PyDict::new(py);
        entry.set_item("kind", info.kind)?;
        let title = kind.title().map(str::to_string);
        entry.set_item(
            "title",
            title.unwrap_or_else(|| info.kind.replace('_', " ")),
        )?;
        entry.set_item("where", info.place.name())?;
        entry.set_item("summary", info.summary)?;
        entry.set_item("formula", info.formula)?;
        entry.set_item("reference", info.reference)?;
        entry.set_item("parameters", parameters)?;
        entry.set_item("first_joint", if kind.crosses() { 2 } else { 1 })?;
        entry.set_item("family", kind.family().name())?;
        entry.set_item("rate_independent", kind.is_rate_independent())?;
        entry.set_item("feels_activity", kind.feels_activity())?;
        entry.set_item("searched", !kind.prior().parts.is_empty())?;
        entry.set_item("address", info.place.address())?;
        entry.set_item("own", matches!(kind, Kind::Custom(_)))?;
        list.append(entry)?;
    }
    Ok(list)
}
