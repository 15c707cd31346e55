//! Dense linear algebra of small matrices.

pub mod cholesky;
pub mod matrix;
pub mod orthogonal;
pub mod svd;
