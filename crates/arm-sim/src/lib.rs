#![doc = include_str!("../README.md")]

mod accuracy;
mod batch;
mod controlled;
mod coupled;
mod digest;
mod discontinuities;
mod divided_step;
mod equilibrium;
mod error;
mod experiment;
mod friction;
mod input_buffer;
mod interaction;
mod linearized;
mod model;
pub mod models;
mod movement;
mod native;
mod noise;
mod path;
mod plain;
mod prepare;
#[cfg(feature = "rapier")]
mod rapier;
mod record;
mod recorder;
mod room;
mod schedule;
mod sensor;
mod series;
mod simulate;
mod stability;
mod start;
mod state;
mod step;
mod stepper;
mod supervisor;
mod terms;
pub use accuracy::{Resolved, resolve, simulate_accurately};
#[doc(hidden)]
pub use batch::simulate_batch;
pub use controlled::{Controlled, Controller, Fault, control};
pub use digest::{Digest, definite, digest, digest_of};
pub use error::{NoRest, SimulationError};
pub use experiment::{
    Assistance, Columns, Coupling, Drive, Experiment, Integrator, Springs, Start, altered,
};
pub use interaction::{Interaction, Law, Support, Yielded, interact};
pub use linearized::{Change, Slopes};
pub use movement::{JointMotion, Movement};
pub use noise::Normal;
pub use path::{Handle, HandlePath};
#[cfg(feature = "rapier")]
pub use rapier::{RapierSettings, simulate_rapier};
pub use record::{EnergyColumns, Partial, Piece, Recording, TorqueColumns, WorkColumns};
pub use room::{require_room, reserve_room};
pub use sensor::{Channel, Readings, Sensors};
pub use series::{Interpolation, Jet, Series, cubic_weights};
pub use simulate::{Engine, simulate, simulate_in_pieces, simulate_partial, simulate_with};
pub use stability::{Vibration, longest_step};
pub use stepper::{Outside, Port, Seen, Snapshot, Stepper};
pub use supervisor::Safety;
