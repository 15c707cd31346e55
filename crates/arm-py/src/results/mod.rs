//! Results in Python: the types of the core, frozen, with attributes, `repr`, equality, pickling and JSON.

mod class;
mod gap;
mod gap_result;
mod identified;
mod planned;
mod recorded;
mod simulated;

pub use gap::Alternative;
pub use gap_result::{GapResult, Screening};
pub use identified::Identification;
pub use planned::{Design, Forecast, RunFit};
pub use recorded::{Readings, Recording};
pub use simulated::SimulatedTrial;

use pyo3::prelude::*;

/// Adds the classes to the module.
pub fn add(m: &Bound<'_, PyModule>) -> PyResult<()> {
    gap::add(m)?;
    gap_result::add(m)?;
    identified::add(m)?;
    planned::add(m)?;
    m.add_class::<Readings>()?;
    m.add_class::<Recording>()?;
    m.add_class::<SimulatedTrial>()
}
