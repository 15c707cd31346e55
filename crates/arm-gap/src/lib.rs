//! Where simulation and measured data of an arm disagree, which effect is missing, and what adding it gains.

pub mod anchor;
pub mod apart;
pub mod candidate;
pub mod chance;
pub mod disturbance;
mod error;
pub mod fit;
pub mod free;
pub mod groups;
pub mod hypothesis;
pub mod in_trial;
pub mod judge;
pub mod look;
pub mod memory;
pub mod misfit;
pub mod noise;
pub mod normal;
pub mod predict;
pub mod response;
pub mod rhythm;
mod ringing;
mod rows;
pub mod scan;
pub mod search;
pub mod separate;
pub mod session;
pub mod slow_ripple;
pub mod spectrum;
pub mod spread;
pub mod stretches;
pub mod study;
pub mod swing;
pub mod tabulated;
pub mod threads;
mod unrepeated;

pub use error::GapError;
