//! Predicted readings of the channels under a hypothesis, by simulation or by inverse dynamics.

pub mod free_run;
mod gap_channels;
pub mod joint_torques;
pub mod prediction;
pub(crate) mod start;
