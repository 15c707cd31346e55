//! Constrained least-squares identification of planar arms, with honest intervals and rank.
//!
//! The lower half is pure numerics and knows nothing of arms:
//!
//! - [`condense`]: rows to a triangular factor in one streamed pass
//! - [`program`]: least squares under bounds, linear constraints and second-order cones
//! - [`rank`]: what a movement can tell apart, and the combinations that it can
//! - [`filter`], [`derivative`]: zero-phase low-pass, differentiation
//! - [`coloured`], [`long_run`], [`covariance`], [`student`]: residuals that are not white, and intervals that know it
//!
//! The upper half is the arm: [`trial`] and [`unknown`] say what is known, [`motion`] and [`simulated`] give the movement, [`equation`] the rows,
//! [`condition`] filters and whitens them, [`constraint`] says what is physical, [`joint`] solves, [`estimate`] is the result. [`design`] says before an experiment what it will show.
//!
//! Everything is `f64`, has a fixed order of operations and takes its transcendental functions from `libm`: the same input gives the same bits on
//! every platform.

pub mod by_simulation;
pub mod calibration;
pub mod cascade;
pub mod coloured;
pub mod condition;
pub mod constraint;
pub mod design;
pub mod equation;
pub mod estimate;
pub mod forecast;
pub mod joint;
pub mod motion;
pub mod quasi_static;
pub mod simulated;
pub mod trial;
pub mod unknown;

mod summary;

pub mod condense;
pub mod covariance;
pub mod derivative;
pub mod error;
pub mod factor;
pub mod filter;
pub mod long_run;
pub mod matrix;
pub mod program;
pub mod rank;
pub mod student;
pub mod svd;

mod clusters;
mod cutoff;
mod equality;
mod orthogonal;
mod outcome;
mod polish;
mod response;
mod restart;
mod scaled;

pub use condense::Condenser;
pub use error::IdentError;
pub use factor::Factor;
pub use matrix::Matrix;
