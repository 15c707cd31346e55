//! Preparation of a session: the samples that are compared, and the noise.

mod measured_noise;
pub(crate) mod noise_without_repeats;
mod prepare;
mod repeat_deviations;
mod resting_joints;
