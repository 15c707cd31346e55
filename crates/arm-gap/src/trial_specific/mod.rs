//! What differs between trials, or swings too fast for the common band: rhythms, ripple, disturbances, the contact.

pub mod component;
pub(crate) mod contact_identification;
pub mod disturbance;
mod disturbance_shape;
pub mod in_phase;
mod setting_apart;
mod spectral_line;
pub mod tremor_detection;
