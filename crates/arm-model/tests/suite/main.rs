//! Models and descriptions of data sets.

mod dataset;
mod model;
mod refused;
