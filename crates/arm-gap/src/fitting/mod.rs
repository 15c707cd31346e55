//! Fits of a hypothesis to the fit trials, and what a fit leaves of the data.

pub mod fit;
pub mod free_decay_fit;
pub mod lack_of_fit;
pub mod precision;
pub mod score_variance;
pub mod step;
