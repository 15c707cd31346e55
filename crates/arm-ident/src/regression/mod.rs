//! Rows of the linear regression: trials, unknowns, motion, equation of motion, preprocessing.

pub mod calibration;
pub mod equation;
pub mod measured_motion;
pub mod preprocessing;
pub(crate) mod sensitivity;
pub mod simulated_motion;
pub mod trial;
pub mod unknown;
