//! One simulated run with the equation of motion linearised along it, and its response to changes.

mod follower;
pub mod linear_response;
pub mod linearized_run;
mod newton;
pub(crate) mod origin;
mod plant;
mod sliding;
