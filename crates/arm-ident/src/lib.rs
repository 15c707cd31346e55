//! Constrained least-squares identification of planar arms, with intervals and rank.
//!
//! - [`regression`]: what a trial brings, the unknowns, the motion, the rows of the equation of motion, filtered and whitened
//! - [`inference`]: the joint method: physical constraints, rank, intervals; parameters fitted by simulation
//! - [`cascade`]: the method of the thesis, wrist to shoulder, quasi-static
//! - [`experiment_design`]: before an experiment, what a movement will show, and one that shows it well
//!
//! Everything is `f64`, has a fixed order of operations and takes its transcendental functions from `libm`: the same input gives the same bits on
//! every platform.

pub mod cascade;
pub mod error;
pub mod experiment_design;
pub mod inference;
pub mod regression;

pub use error::IdentError;
