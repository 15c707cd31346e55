//! How the channels change with small changes of a hypothesis, from the equation of motion linearised along a simulated run.

mod follower;
pub mod linear_response;
pub mod linearization_point;
pub mod linearized_run;
mod newton;
pub mod normal_equations;
mod origin;
mod plant;
pub mod response;
pub(crate) mod rows;
mod sliding;
