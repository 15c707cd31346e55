//! Python module `armrs._armrs`: conversion and error mapping only, no mathematics.

mod anthropometry;
mod arm;
mod arrays;
mod catalogue;
mod cosim;
mod custom_effects;
mod errors;
mod experiment_design;
mod firmware;
mod fit_by_simulation;
mod gap;
mod identification;
mod laboratory;
mod model;
mod online;
mod results;
mod rig;
mod row_kernels;
mod signal;
mod simulation;

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
    m.add_class::<simulation::Digest>()?;
    m.add_function(wrap_pyfunction!(identification::identify, m)?)?;
    m.add_function(wrap_pyfunction!(fit_by_simulation::fit_by_simulation, m)?)?;
    m.add_function(wrap_pyfunction!(gap::find_gap, m)?)?;
    m.add_function(wrap_pyfunction!(gap::distances, m)?)?;
    m.add_function(wrap_pyfunction!(gap::look, m)?)?;
    m.add_function(wrap_pyfunction!(gap::play, m)?)?;
    m.add_function(wrap_pyfunction!(gap::reach, m)?)?;
    m.add("STILL", arm_gap::data::identified_base::STILL)?;
    m.add("MOST_STEPS", arm_sim::MOST_STEPS)?;
    m.add_function(wrap_pyfunction!(custom_effects::declare, m)?)?;
    m.add_function(wrap_pyfunction!(simulation::simulate, m)?)?;
    m.add_function(wrap_pyfunction!(simulation::simulate_accurately, m)?)?;
    m.add_function(wrap_pyfunction!(simulation::energy_balance, m)?)?;
    m.add_function(wrap_pyfunction!(simulation::resolve, m)?)?;
    m.add_function(wrap_pyfunction!(simulation::simulate_in_pieces, m)?)?;
    m.add_function(wrap_pyfunction!(laboratory::control, m)?)?;
    m.add_function(wrap_pyfunction!(laboratory::interact, m)?)?;
    m.add_function(wrap_pyfunction!(experiment_design::forecast_py, m)?)?;
    m.add_function(wrap_pyfunction!(experiment_design::design_py, m)?)?;
    m.add_function(wrap_pyfunction!(anthropometry::literature, m)?)?;
    m.add_function(wrap_pyfunction!(signal::smooth, m)?)?;
    m.add_function(wrap_pyfunction!(signal::displacement_of_base, m)?)?;
    m.add_function(wrap_pyfunction!(signal::bounded_least_squares, m)?)?;
    m.add_function(wrap_pyfunction!(arrays::require_memory, m)?)?;
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
