//! Responses to small changes of a hypothesis: of a simulated run (linearised equation of motion) and of torques of a measured motion.

mod follower;
pub mod linear_response;
pub mod linearized_run;
pub(crate) mod linearized_torques;
mod newton;
pub(crate) mod origin;
mod plant;
