//! Effects of single trials, and rhythms: tremor, ripple, disturbances, the place of the handle, the contact.

pub mod component;
pub(crate) mod contact_identification;
pub mod disturbance;
mod disturbance_shape;
pub mod in_phase;
pub mod in_trial;
mod rhythm_removal;
mod spectral_line;
pub mod tremor_detection;
