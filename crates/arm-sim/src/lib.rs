//! The closed-chain experiment of thesis section 3.6: a robot leads the hand of a planar arm, or motors move its joints.
//!
//! An [`Experiment`] says what is simulated; [`simulate`] gives a [`Recording`] with every kinematic and dynamic quantity.
//! The step is fixed, transcendental functions come from the core, and nothing depends on threads or lanes: the same
//! experiment has the same [`digest`] everywhere.
//!
//! Conventions are those of [`arm_core`]: y forward, z up, counter-clockwise positive, SI units and radians, forces named
//! by what they act on, `R` the torque with which a joint resists.
//!
//! ```
//! use arm_sim::{digest, models, simulate};
//! let experiment = models::human_experiment(4.0, [-1.1, 0.9, 0.05])?;
//! let recording = simulate(&experiment)?;
//! let last = recording.len() - 1;
//! assert_eq!(recording.q.len(), 3 * recording.len());
//! assert!((recording.handle[2 * last] - recording.tip[2 * last]).abs() < 5e-3);
//! assert!(recording.energy_error()[last].abs() < 1e-9);
//! assert_eq!(digest(&recording)?, digest(&simulate(&experiment)?)?);
//! # Ok::<(), arm_sim::SimulationError>(())
//! ```

mod batch;
mod breaks;
mod controlled;
mod digest;
mod error;
mod experiment;
mod feed;
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
