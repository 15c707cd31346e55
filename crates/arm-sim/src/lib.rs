#![doc = include_str!("../README.md")]

mod batch;
mod controlled;
mod digest;
mod discontinuities;
mod error;
mod experiment;
mod friction;
mod input_buffer;
mod model;
pub mod models;
mod movement;
mod native;
mod noise;
mod path;
mod prepare;
#[cfg(feature = "rapier")]
mod rapier;
mod record;
mod recorder;
mod sensor;
mod series;
mod stability;
mod start;
mod step;
mod stepper;
mod terms;
#[doc(hidden)]
pub use batch::simulate_batch;
pub use controlled::{Controlled, Controller, Fault, Safety, control};
pub use digest::{Digest, definite, digest, digest_of};
pub use error::SimulationError;
pub use experiment::{
    Coupling, Drive, Engine, Experiment, Integrator, Partial, Start, altered, simulate,
    simulate_in_pieces, simulate_partial, simulate_with,
};
pub use movement::{JointMotion, Movement};
pub use noise::Normal;
pub use path::{Handle, HandlePath};
#[cfg(feature = "rapier")]
pub use rapier::{RapierSettings, simulate_rapier};
pub use record::{EnergyColumns, Piece, Recording, TorqueColumns, WorkColumns};
pub use sensor::{Channel, Readings, Sensors};
pub use series::{Interpolation, Jet, Series};
pub use stability::Vibration;
pub use stepper::{Outside, Port, Seen, Snapshot, Stepper};
