#![doc = include_str!("../README.md")]

mod dependencies;
mod description;
mod directional;
mod exchange;
mod hash;
mod mode;
mod plant;
mod quantity;
mod slave;
mod spec;
mod start;
mod state;
mod status;
mod units;
mod variables;

pub use description::{Fmi, MODEL_IDENTIFIER, model_description, terminals};
pub use hash::fnv1a;
pub use mode::Mode;
pub use quantity::Quantity;
pub use slave::Slave;
pub use spec::{ArmSpec, EffectSpec, SegmentSpec, StartSpec};
pub use state::SlaveState;
pub use status::{Refused, Status};
pub use units::{Unit, unit};
pub use variables::{Causality, Initial, Variability, Variable, token, variables};
