//! Filters, derivatives and spectral lines of uniformly sampled columns.

pub mod derivative;
pub mod filter;
pub mod spectrum;
