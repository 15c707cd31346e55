#![doc = include_str!("../README.md")]
#![no_std]

mod arm;
#[doc(hidden)]
pub mod call;
mod compensation;
mod estimator;
#[doc(hidden)]
pub mod held;
mod monitor;
mod motion;
mod robot;
mod status;

pub use arm::*;
pub use compensation::*;
pub use estimator::*;
pub use monitor::*;
pub use motion::*;
pub use robot::*;
pub use status::*;

/// The number that the library computes with.
#[cfg(not(feature = "single"))]
pub type armrs_real = f64;
/// The number that the library computes with.
#[cfg(feature = "single")]
pub type armrs_real = f32;

/// Number of joints of an arm.
#[cfg(not(feature = "two-joints"))]
pub const ARMRS_JOINTS: usize = 3;
/// Number of joints of an arm.
#[cfg(feature = "two-joints")]
pub const ARMRS_JOINTS: usize = 2;

/// Most effects of an arm.
pub const ARMRS_EFFECTS: usize = 12;
/// Most unknowns of an estimator: a first and a second moment for each joint, then the linear parameters of the effects.
pub const ARMRS_UNKNOWNS: usize = 18;
/// Channels that a monitor watches.
pub const ARMRS_CHANNELS: usize = 16;
/// Most waypoints of a path.
pub const ARMRS_WAYPOINTS: usize = 16;
