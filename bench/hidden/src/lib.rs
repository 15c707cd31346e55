//! The judge of the gap workflow.
//!
//! Sessions that look measured: an arm led by a robot, sensors with noise and calibration errors, a model that is a little
//! wrong, and in most of them one effect or several that the model lacks. The arm is a chain of rigid bodies that
//! [rapier](https://rapier.rs) moves, and every effect is written here anew; nothing of the equations that the workflow
//! fits is used. `bench/hidden/README.md` says what differs and why.

pub mod cast;
pub mod effect;
pub mod little_known;
pub mod model;
pub mod motion;
pub mod output;
pub mod random;
pub mod rig;
pub mod run;
pub mod sensor;
pub mod session;
mod start;
mod world;
