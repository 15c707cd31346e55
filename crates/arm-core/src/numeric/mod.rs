//! The numbers that the core computes with: scalars, SIMD lanes, transcendental functions, covariances.

pub(crate) mod covariance;
pub(crate) mod float;
pub(crate) mod lanes;
pub(crate) mod scalar;
#[cfg(feature = "simd")]
pub mod simd_dispatch;
mod transcendental;
pub(crate) mod unroll;
