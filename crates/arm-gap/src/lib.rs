//! Where simulation and measured data of an arm disagree, which effect is missing, and what adding it gains.
//!
//! - [`data`]: the session, its repeats and its noise
//! - [`measurement_model`]: what the channels would read if a hypothesis were true
//! - [`sensitivity`]: how they answer small changes
//! - [`candidates`]: the catalogue of effects as questions
//! - [`selection`]: score tests, the search, model selection
//! - [`trial_specific`]: what differs between trials
//! - [`joint_torque`]: rigs without a robot

pub mod candidates;
pub mod data;
mod error;
pub mod joint_torque;
pub mod measurement_model;
pub mod selection;
pub mod sensitivity;
pub mod threads;
pub mod trial_specific;

pub use error::GapError;
