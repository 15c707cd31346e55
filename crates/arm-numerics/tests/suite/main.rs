//! One module per source file; `noise` is what they share.

mod autoregressive;
mod bits;
mod cholesky;
mod condense;
mod derivative;
mod distributions;
mod factor;
mod filter;
mod noise;
mod program;
mod sandwich_covariance;
mod spectrum;
mod svd;
