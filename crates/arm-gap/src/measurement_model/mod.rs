//! Predicted readings of the channels under a hypothesis.

mod base_path;
mod contact_readings;
mod gap_channels;
mod handle_path;
pub mod hypothesis;
pub mod in_trial;
pub mod joint_torques;
pub mod prediction;
pub(crate) mod start;
