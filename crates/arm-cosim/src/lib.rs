//! The arm as a co-simulation slave after FMI 3.0, for whatever speaks it: a shared library, Python, tests.
//!
//! An [`ArmSpec`] is the arm as it travels; [`variables`] is the one table from which the model descriptions of both FMI
//! versions, the value references and the documentation come; a [`Slave`] has the life cycle, the statuses and the states of
//! the standard. No C and no Python here.
//!
//! ```
//! use arm_cosim::{ArmSpec, Slave, Status};
//! let spec = ArmSpec::sample();
//! let mut arm = Slave::new(spec.clone())?;
//! let angle = arm.reference("q[1]").unwrap();
//! arm.enter_initialization_mode(0.0, None)?;
//! arm.set(&[angle], &[-1.2])?;
//! arm.exit_initialization_mode()?;
//! arm.do_step(0.0, 0.01)?;
//! let mut q = [0.0];
//! arm.get(&[angle], &mut q)?;
//! assert!(q[0] != -1.2);
//! let refused = arm.set(&[angle], &[0.0]).unwrap_err();
//! assert_eq!(refused.status, Status::Error);
//! # Ok::<(), arm_cosim::Refused>(())
//! ```

mod dependencies;
mod description;
mod directional;
mod exchange;
mod hash;
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
pub use quantity::Quantity;
pub use slave::{Mode, Slave};
pub use spec::{ArmSpec, EffectSpec, SegmentSpec, StartSpec};
pub use state::SlaveState;
pub use status::{Refused, Status};
pub use units::{Unit, unit};
pub use variables::{Causality, Initial, Variability, Variable, token, variables};
