//! Rows of the linear regression: trials, unknowns, motion, equation of motion, preprocessing.

pub(crate) mod assistance;
pub mod calibration;
pub mod equation;
pub(crate) mod instrument;
pub(crate) mod internal_state;
pub mod kinematics;
pub mod measured_motion;
pub mod preprocessing;
pub mod rows;
pub(crate) mod sensitivity;
pub mod simulated_motion;
pub mod trial;
pub mod unknown;
