//! Distributions, and the covariance of estimates whose residuals are correlated.

pub mod autoregressive;
pub mod distributions;
pub mod extent;
pub mod sandwich_covariance;
