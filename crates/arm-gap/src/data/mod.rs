//! Measured data, prepared: session, repeats, the samples that are compared, noise.

pub(crate) mod base_path;
pub(crate) mod contact_readings;
pub mod course;
pub(crate) mod handle_path;
pub mod identified_base;
mod joint_in_motion;
mod measured_noise;
pub mod noise;
pub(crate) mod noise_without_repeats;
pub mod passive_law;
pub mod prepared_session;
mod repeat_deviations;
pub mod repeats;
mod resting_joints;
pub mod session;
pub mod valid_segments;
pub mod whitening;
