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
//! use arm_core::{sample_arms, gravity, Pose};
//! let arm = sample_arms::mechanical_arm();
//! let torque = gravity(&arm, &Pose::new(&[0.0, 0.0].into()));
//! assert!((torque[1] - 9.81 * 1.160 * 0.115).abs() < 1e-12);
//! ```
#![no_std]

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod arm;
mod check;
mod control;
mod dynamics;
pub mod effect;
mod error;
pub mod estimator;
mod numeric;
mod regression;
mod rig;

pub use arm::body::{Body, Orthosis};
pub use arm::chain::{Chain, Segment};
pub use arm::{anthropometry, sample_arms};
pub use control::calibration::Calibration;
pub use control::gravity_compensation::{Compensation, GravityCompensation};
pub use control::monitor;
pub use control::trajectory::{Limits, Path, Profile, Route, Sample, Shape};
pub use dynamics::contributions::{Contributions, contributions};
pub use dynamics::coriolis::{centrifugal, coriolis, coriolis_matrix};
pub use dynamics::energy::{kinetic_energy, potential_energy};
pub use dynamics::gravity::gravity;
pub use dynamics::inertia::{inertia, link_inertia};
pub use dynamics::inverse_and_forward::{
    Load, Resistance, accelerations, forward_dynamics, inverse_dynamics, inverse_dynamics_inlined,
    joint_force, static_torque,
};
pub use dynamics::kinematics::{Pose, jacobian, jacobian_rate, joint_position, tip, tip_velocity};
pub use dynamics::products::Products;
pub use dynamics::regressor::{Regressor, regressor};
pub use dynamics::torque_by_angle::torque_by_angle;
pub use error::{Invalid, Shown};
pub use numeric::float::write_sines_and_cosines;
pub use numeric::lanes::Lanes;
pub use numeric::scalar::{Real, Scalar};
#[cfg(feature = "simd")]
pub use numeric::simd_dispatch;
pub use regression::{Equation, Measured, Needed, Prior};
pub use rig::contact::Contact;
pub use rig::placement::Placement;
pub use rig::robot::{Elbow, Robot};
pub use rig::setup::{Displaced, Reading, Setup, Wave};

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
