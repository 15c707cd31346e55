//! What the channels would read if a hypothesis were true.

mod base_path;
mod compared;
mod contact_readings;
mod handle_path;
pub mod hypothesis;
pub mod in_trial;
pub mod joint_torques;
pub mod prediction;
pub(crate) mod start;
