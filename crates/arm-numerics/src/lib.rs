#![doc = include_str!("../README.md")]

pub mod error;
pub mod least_squares;
pub mod linalg;
pub mod signal;
pub mod statistics;

pub use error::NumericsError;
pub use least_squares::condense::Condenser;
pub use least_squares::factor::Factor;
pub use linalg::cholesky::Cholesky;
pub use linalg::matrix::{Matrix, interleaved_dot};
