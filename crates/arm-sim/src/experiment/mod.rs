//! Experiments: the rig, its drive, the desired motion of joints and handle, and the times of steps and samples.

pub(crate) mod description;
pub(crate) mod discontinuities;
pub(crate) mod handle_path;
pub(crate) mod movement;
pub(crate) mod piecewise_cubic;
pub mod sample_experiments;
pub(crate) mod step_grid;
