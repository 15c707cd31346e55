//! Sensitivity of the channels of a session to changes of a hypothesis: whitened rows and normal equations.

pub mod linearization_point;
pub mod normal_equations;
pub(crate) mod rows;
