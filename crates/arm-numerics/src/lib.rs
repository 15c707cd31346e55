//! Dense numerics of small estimation problems: linear algebra, constrained least squares, statistics of correlated residuals, filters.
//!
//! Nothing here knows of arms. Everything is `f64`, has a fixed order of operations and takes its transcendental functions from `libm`: the same
//! input gives the same bits on every platform.
//!
//! - [`linalg`]: matrix, Householder QR, singular values
//! - [`least_squares`]: rows to a triangular factor in one streamed pass; least squares under bounds, linear constraints and second-order cones
//! - [`statistics`]: distributions, autoregressive models, long-run and sandwich covariance
//! - [`signal`]: zero-phase low-pass, differentiation, spectral lines

pub mod error;
pub mod least_squares;
pub mod linalg;
pub mod signal;
pub mod statistics;

pub use error::NumericsError;
pub use least_squares::condense::Condenser;
pub use least_squares::factor::Factor;
pub use linalg::matrix::Matrix;
