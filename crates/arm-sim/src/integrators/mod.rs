//! Integrators with a fixed step: semi-implicit Euler, Runge-Kutta 4, and an implicit-explicit method for steep friction; steps divided at
//! discontinuities, and set-valued dry friction.

pub(crate) mod advance;
pub(crate) mod divided_step;
pub(crate) mod friction;
pub(crate) mod imex;
pub(crate) mod implicit_friction;
pub(crate) mod input_buffer;
pub(crate) mod step;
