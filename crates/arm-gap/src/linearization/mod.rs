//! One simulated run with the equation of motion linearised along it, or the torques of one measured motion, and their response to changes.

mod follower;
pub mod linear_response;
pub mod linearized_run;
mod newton;
pub(crate) mod origin;
mod plant;
mod sliding;
pub(crate) mod torques_beside;
