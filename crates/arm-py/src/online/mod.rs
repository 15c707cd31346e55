//! The functions of a device in Python: estimator, compensation and monitor of the C interface, with its sizes and order of operations.

mod compensation;
mod estimator;
mod monitor;
mod rows;
mod settings;

pub use compensation::{GravityCompensator, OnlineCompensation};
pub use estimator::{DECISIONS, OnlineEstimator, statuses};
pub use monitor::OnlineMonitor;
pub use settings::online_settings;
