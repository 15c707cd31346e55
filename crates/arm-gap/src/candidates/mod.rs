//! The catalogue of effects as questions that a session can answer.

pub mod candidate;
pub mod library;
pub(crate) mod refined_shapes;
pub mod tabulated;
mod torque_step;
