//! What differs between trials, or swings too fast for the common band: rhythms, ripple, disturbances, the contact.

pub mod component;
pub(crate) mod contact_identification;
pub mod disturbance;
pub mod slow_ripple;
pub mod tremor_detection;
