//! Integrators with a fixed step: semi-implicit Euler and Runge-Kutta 4, steps divided at discontinuities, and set-valued dry friction.

pub(crate) mod divided_step;
pub(crate) mod friction;
pub(crate) mod input_buffer;
pub(crate) mod step;
