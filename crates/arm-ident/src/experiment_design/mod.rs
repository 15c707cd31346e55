//! Experiment design: forecasts of movements, and search for better ones.

pub mod design;
pub mod forecast;
pub mod results;
