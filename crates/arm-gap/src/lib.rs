#![doc = include_str!("../README.md")]

pub mod candidates;
pub mod data;
mod error;
pub mod hypothesis;
pub mod joint_torque;
pub mod measurement_model;
pub mod results;
pub mod selection;
pub mod sensitivity;
pub mod trial_specific;

pub use error::GapError;
