#![doc = include_str!("../README.md")]

pub mod cascade;
pub mod error;
pub mod experiment_design;
pub mod inference;
pub mod movement_limits;
pub mod regression;
pub mod results;
pub mod threads;

pub use error::IdentError;
