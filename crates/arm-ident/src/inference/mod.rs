//! Inference from rows: the joint method, rank, intervals, multistart; fits by simulation.

pub mod by_simulation;
pub mod constraint;
pub(crate) mod cutoff;
pub mod estimate;
pub(crate) mod gauss_newton;
pub(crate) mod independent_blocks;
pub mod joint_method;
pub mod joint_scale;
pub(crate) mod multistart;
pub mod rank;
pub(crate) mod sticking;
pub(crate) mod summary;
pub(crate) mod updated_model;
pub(crate) mod weighted_fit;
