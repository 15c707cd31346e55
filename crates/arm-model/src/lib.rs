//! The model of an arm as one value: segments, joints, robot, contact and effects, with their bounds and units, the files
//! that hold it, and the identity of each of its parameters. The description of a data set stands beside it.
//!
//! A [`Model`] is checked where it is made, so one that exists is valid. Every number of it has a [`ParameterId`], and
//! [`Model::with`] gives the same model with one of them changed. What cannot be read is [`Refused`] with file, place, value
//! found and values allowed.
//!
//! ```
//! use arm_model::{Model, ParameterId};
//!
//! let model = Model::from_toml(
//!     r#"
//!     [[arm.segment]]
//!     length = 0.3
//!     mass = 1.5
//!     com = 0.15
//!     inertia = 0.012
//!     [[arm.joint]]
//!     coulomb = 0.05
//!     "#,
//! )?;
//! let friction: ParameterId = "joint[1].coulomb.torque".parse()?;
//! assert_eq!(model.value(friction), Some(0.05));
//! let rougher = model.with(friction, 0.16)?;
//! assert_eq!(rougher.joints[0].coulomb, 0.16);
//! let refused = model.with(friction, 150.0).unwrap_err();
//! assert_eq!(refused.to_string(), "[[arm.joint]] 1, coulomb: found 150.0, allowed a finite number 0 to 100 N m");
//! # Ok::<(), arm_model::Refused>(())
//! ```

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod catalogue;
mod contact;
mod dataset;
mod effect;
mod fields;
mod file;
mod joint;
mod model;
mod number;
mod parameter;
mod refused;
mod robot;
mod segment;
mod subject;
mod tolerance;
mod toml_file;
mod value;

pub use catalogue::{declare, kind, kinds};
pub use contact::Contact;
pub use dataset::{AddedMass, Description, ForceOn, Muscle, Role, TrialEntry};
pub use effect::{Effect, ForceChannel, Site};
pub use fields::{Bounds, Fields};
pub use joint::{Joint, joint_laws};
pub use model::{MAX_SEGMENTS, Model, Parts};
pub use parameter::{Object, ParameterId, ParameterInfo};
pub use refused::{RefusalKind, Refused, nearest, unknown};
pub use robot::Robot;
pub use segment::Segment;
pub use subject::{Sex, Side, Subject};
pub use tolerance::Tolerance;
pub use toml_file::{read as read_toml, write as write_toml};
pub use value::{Table, Value};
