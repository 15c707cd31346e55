//! Engines that run an experiment: the native one (a single run, a batch, step by step) and rapier.

pub(crate) mod accuracy;
pub(crate) mod batch;
mod group;
pub(crate) mod native;
mod packing;
#[cfg(feature = "rapier")]
pub(crate) mod rapier;
pub(crate) mod simulate;
pub(crate) mod stepper;
