//! What a device runs, in Python: the estimator, the compensation and the monitor of the C interface, with its sizes and its order of
//! operations.

mod carrying;
mod estimator;
mod monitor;
mod rows;
mod settings;

pub use carrying::{Carries, OnlineCompensation};
pub use estimator::{DECISIONS, OnlineEstimator, statuses};
pub use monitor::OnlineMonitor;
pub use settings::online_settings;
