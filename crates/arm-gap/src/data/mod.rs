//! Measured data: session, trials in the common band, repeats, noise, passive laws from measured motion.

mod base_path;
pub(crate) mod contact_readings;
pub mod course;
mod handle_path;
pub mod identified_base;
mod joint_in_motion;
pub mod noise;
pub mod passive_law;
pub mod repeats;
pub mod session;
pub mod valid_segments;
pub mod whitening;
