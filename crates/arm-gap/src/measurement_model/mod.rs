//! What the channels would read if a hypothesis were true.

mod base_path;
mod compared;
pub mod hypothesis;
pub mod in_trial;
pub mod prediction;
pub(crate) mod start;
