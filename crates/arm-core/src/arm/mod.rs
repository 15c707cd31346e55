//! The arm as rigid bodies: segments, their chain, values from the literature, sample arms.

pub mod anthropometry;
pub(crate) mod body;
pub(crate) mod chain;
pub mod sample_arms;
