//! Least squares: condensation of rows to a triangular factor, bounds, linear constraints and second-order cones.

pub mod condense;
mod equality;
pub mod factor;
mod factoring;
pub mod outcome;
mod polish;
pub mod program;
mod scaled;
pub mod solve;
