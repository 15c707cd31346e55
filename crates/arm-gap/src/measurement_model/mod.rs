//! Predicted readings of the channels under a hypothesis.

mod gap_channels;
pub mod in_trial;
pub mod joint_torques;
pub mod prediction;
pub(crate) mod start;
