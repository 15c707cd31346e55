//! The virtual laboratory: controllers of the robot, safety supervisor, and sensors with noise.

pub(crate) mod interaction_control;
pub(crate) mod joint_controller;
pub(crate) mod noise;
mod robot_and_arm;
pub(crate) mod sensors;
pub(crate) mod supervisor;
