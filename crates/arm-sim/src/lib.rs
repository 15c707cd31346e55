#![doc = include_str!("../README.md")]

mod closed_chain;
mod engines;
mod error;
mod experiment;
mod free_memory;
mod integrators;
mod laboratory;
mod preparation;
mod recording;

pub use closed_chain::linearized::{Change, Slopes};
pub use closed_chain::stability::{Vibration, longest_step, longest_step_on_contact};
pub use engines::accuracy::{Resolved, resolve, simulate_accurately};
#[doc(hidden)]
pub use engines::batch::simulate_batch;
#[cfg(feature = "rapier")]
pub use engines::rapier::{RapierSettings, simulate_rapier};
pub use engines::simulate::{
    Engine, simulate, simulate_in_pieces, simulate_partial, simulate_with,
};
pub use engines::stepper::{Outside, Port, Seen, Snapshot, Stepper};
pub use error::{NoRest, SimulationError};
pub use experiment::description::{
    Assistance, Columns, Coupling, Drive, Experiment, Integrator, Springs, Start, altered,
};
pub use experiment::handle_path::{Handle, HandlePath};
pub use experiment::movement::{JointMotion, Movement};
pub use experiment::piecewise_cubic::{Interpolation, Jet, Series, cubic_weights};
pub use experiment::sample_experiments;
pub use experiment::step_grid::MOST_STEPS;
pub use free_memory::{require_memory, reserve_memory};
pub use integrators::implicit_friction::{ImplicitFriction, SmoothFriction, WithFriction};
pub use laboratory::interaction_control::{
    Interaction, InteractionLaw, Support, Yielded, interact,
};
pub use laboratory::joint_controller::{Controlled, Controller, InjectedFault, control};
pub use laboratory::noise::Normal;
pub use laboratory::sensors::{Readings, SensorChannel, Sensors};
pub use laboratory::supervisor::Safety;
pub use recording::digest::{Digest, definite, digest, digest_of};
pub use recording::record::{EnergyColumns, Partial, Piece, Recording, TorqueColumns, WorkColumns};
