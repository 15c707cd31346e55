//! What was measured, made ready: session, repeats, the samples that are compared, noise.

pub mod identified_base;
mod joint_in_motion;
mod measured_noise;
pub mod noise;
pub mod passive_law;
pub mod prepared_session;
mod repeated;
pub mod repeats;
mod rest;
pub mod session;
pub(crate) mod unrepeated;
pub mod valid_segments;
pub mod whitening;
