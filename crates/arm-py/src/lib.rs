//! Python module `armrs._armrs`: conversion and error mapping only, no mathematics.

mod arm;
mod catalogue;
mod convert;
mod cosim;
mod errors;
mod firmware;
mod fit;
mod gap;
mod ident;
mod kernel;
mod lab;
mod model;
mod online;
mod own;
mod plan;
mod results;
mod rig;
mod signal;
mod sim;

use pyo3::prelude::*;

#[pymodule]
fn _armrs(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add("__version__", env!("CARGO_PKG_VERSION"))?;
    m.add("build_profile", env!("BUILD_PROFILE"))?;
    m.add_class::<arm::Arm>()?;
    model::add(m)?;
    results::add(m)?;
    m.add_class::<rig::Rig>()?;
    m.add_class::<cosim::ArmSlave>()?;
    m.add_class::<cosim::ArmState>()?;
    m.add_class::<sim::Digest>()?;
    m.add_function(wrap_pyfunction!(ident::identify, m)?)?;
    m.add_function(wrap_pyfunction!(fit::fit_by_simulation, m)?)?;
    m.add_function(wrap_pyfunction!(gap::find_gap, m)?)?;
    m.add_function(wrap_pyfunction!(gap::distances, m)?)?;
    m.add_function(wrap_pyfunction!(gap::look, m)?)?;
    m.add_function(wrap_pyfunction!(gap::play, m)?)?;
    m.add_function(wrap_pyfunction!(gap::reach, m)?)?;
    m.add("STILL", arm_gap::data::identified_base::STILL)?;
    m.add_function(wrap_pyfunction!(own::declare, m)?)?;
    m.add_function(wrap_pyfunction!(sim::simulate, m)?)?;
    m.add_function(wrap_pyfunction!(sim::simulate_accurately, m)?)?;
    m.add_function(wrap_pyfunction!(sim::resolve, m)?)?;
    m.add_function(wrap_pyfunction!(sim::simulate_in_pieces, m)?)?;
    m.add_function(wrap_pyfunction!(lab::control, m)?)?;
    m.add_function(wrap_pyfunction!(lab::interact, m)?)?;
    m.add_function(wrap_pyfunction!(plan::forecast_py, m)?)?;
    m.add_function(wrap_pyfunction!(plan::design_py, m)?)?;
    m.add_function(wrap_pyfunction!(lab::literature, m)?)?;
    m.add_function(wrap_pyfunction!(signal::smooth, m)?)?;
    m.add_function(wrap_pyfunction!(signal::displacement_of_base, m)?)?;
    m.add_function(wrap_pyfunction!(signal::bounded_least_squares, m)?)?;
    m.add_function(wrap_pyfunction!(convert::require_memory, m)?)?;
    m.add_function(wrap_pyfunction!(catalogue::effects, m)?)?;
    catalogue::add(m)?;
    m.add_function(wrap_pyfunction!(firmware::firmware, m)?)?;
    m.add_function(wrap_pyfunction!(online::online_settings, m)?)?;
    m.add_class::<online::OnlineEstimator>()?;
    m.add_class::<online::OnlineCompensation>()?;
    m.add_class::<online::OnlineMonitor>()?;
    m.add("SAMPLE_STATUSES", online::statuses())?;
    m.add("DECISIONS", online::DECISIONS)?;
    Ok(())
}
