//! Parts of a controller for every period: reference trajectories, corrected sensor readings, gravity compensation, safety monitor.

pub(crate) mod calibration;
pub(crate) mod gravity_compensation;
pub mod monitor;
pub(crate) mod trajectory;
