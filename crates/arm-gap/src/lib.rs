#![doc = include_str!("../README.md")]
//!
//! ## Order of the modules
//! A module uses modules before it, and none behind it. Types of the first modules have methods in later ones.
//!
//! `error` ← `hypothesis` ← `data` ← `measurement_model` ← `linearization` ← `prepared_session` ← `sensitivity` ← `candidates` ←
//! `fitting` ← `preparation` ← `selection` ← `trial_specific` ← `search` ← `results`

pub mod candidates;
pub mod data;
mod error;
pub mod fitting;
pub mod hypothesis;
pub mod linearization;
pub mod measurement_model;
pub mod preparation;
pub mod prepared_session;
pub mod results;
pub mod search;
pub mod selection;
pub mod sensitivity;
pub mod trial_specific;

pub use error::GapError;
