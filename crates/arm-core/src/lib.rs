//! Planar arm core: kinematics, dynamics and joint effects of a serial chain in a vertical plane.
//!
//! `no_std`, no allocation, no panic, no `unsafe`. Every algorithm is written once, over [`Scalar`], for `f32`, `f64`
//! and [`Lanes`] (many simulations side by side), and over the number of segments `N`. All transcendental functions
//! come through [`Scalar`], so that a run has the same bits on every platform.
//!
//! On a device (`target_os = "none"`) sine, exponential and hyperbolic tangent stand once in the code. That changes no bit.
//!
//! Conventions: y forward, z up, counter-clockwise positive; `q[0]` from +y, the others relative to the segment before;
//! SI units and radians; forces are named by what they act on. Inside, the dynamics are in link form: one row for each
//! link in absolute angles, which needs few operations and separates the base parameters.
//!
//! ```
//! use arm_core::{models, gravity, Pose};
//! let arm = models::mechanical_arm();
//! let torque = gravity(&arm, &Pose::new(&[0.0, 0.0].into()));
//! assert!((torque[1] - 9.81 * 1.160 * 0.115).abs() < 1e-12);
//! ```
#![no_std]

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

pub mod anthropometry;
mod body;
mod calibration;
mod chain;
mod check;
mod compensation;
mod contact;
mod contribution;
mod coriolis;
mod covariance;
mod dynamics;
pub mod effect;
mod energy;
mod equation;
mod error;
pub mod estimator;
mod float;
mod gravity;
mod inertia;
mod kinematics;
mod lanes;
pub mod models;
pub mod monitor;
mod placement;
mod products;
mod regressor;
mod robot;
mod scalar;
mod series;
mod setup;
#[cfg(feature = "simd")]
pub mod simd_dispatch;
mod trajectory;
mod unroll;

pub use body::{Body, Orthosis};
pub use calibration::Calibration;
pub use chain::{Chain, Segment};
pub use compensation::{Compensation, GravityCompensation};
pub use contact::Contact;
pub use contribution::{Contributions, contributions};
pub use coriolis::{centrifugal, coriolis, coriolis_matrix};
pub use dynamics::{
    Load, Resistance, accelerations, forward_dynamics, inverse_dynamics, joint_force, static_torque,
};
pub use energy::{kinetic_energy, potential_energy};
pub use equation::{Equation, Measured, Needed, Prior};
pub use error::{Invalid, Shown};
pub use gravity::gravity;
pub use inertia::{inertia, link_inertia};
pub use kinematics::{Pose, jacobian, jacobian_rate, joint_position, tip, tip_velocity};
pub use lanes::Lanes;
pub use placement::Placement;
pub use products::Products;
pub use regressor::{Regressor, regressor};
pub use robot::{Elbow, Robot};
pub use scalar::{Real, Scalar};
pub use setup::{Displaced, Reading, Setup, Wave};
pub use trajectory::{Limits, Path, Profile, Route, Sample, Shape};

/// A value for each joint or link: angles, speeds, torques.
pub type Joints<T, const N: usize> = nalgebra::SVector<T, N>;
/// A square matrix over the joints or links.
pub type JointMatrix<T, const N: usize> = nalgebra::SMatrix<T, N, N>;
/// A vector of the plane, `[y, z]`.
pub type Plane<T> = [T; 2];

/// Joint values from an array, without the copies that filling a vector costs in lanes.
#[inline]
pub(crate) const fn joints<T, const N: usize>(values: [T; N]) -> Joints<T, N> {
    Joints::from_array_storage(nalgebra::ArrayStorage([values]))
}
