//! What is recorded of a run, and its digest.

pub(crate) mod digest;
pub(crate) mod record;
pub(crate) mod recorder;
