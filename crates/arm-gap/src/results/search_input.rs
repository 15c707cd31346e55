//! The input of a search in the terms of the files.

use arm_model::Model;

/// A trial as its files have it.
#[derive(Clone, Debug, PartialEq)]
pub struct TrialFile {
    /// Its name.
    pub file: String,
    /// Time of its last sample \[s\].
    pub end: f64,
}

/// The input of a search, in the terms of the files.
#[derive(Clone, Copy, Debug)]
pub struct SearchInput<'a> {
    /// The model as given.
    pub model: &'a Model,
    /// Whether the forces in the files are on the robot.
    pub force_on_robot: bool,
    /// The trials.
    pub trials: &'a [TrialFile],
}
