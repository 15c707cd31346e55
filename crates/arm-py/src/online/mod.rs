//! What a device runs, in Python: the estimator, the compensation and the monitor of the C interface, with its sizes and its order of
//! operations.

mod compensation;
mod estimator;
mod monitor;
mod rows;
mod settings;

pub use compensation::{GravityCompensator, OnlineCompensation};
pub use estimator::{DECISIONS, OnlineEstimator, statuses};
pub use monitor::OnlineMonitor;
pub use settings::online_settings;
