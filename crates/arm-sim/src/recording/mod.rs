//! Recorded quantities of a run, and their digest.

pub(crate) mod digest;
pub(crate) mod record;
pub(crate) mod recorder;
