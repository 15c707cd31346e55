//! The catalogue of effects as candidates of a session.

pub mod candidate;
pub mod library;
pub(crate) mod refined_shapes;
pub mod tabulated;
mod torque_step;
