//! Joint motion at the samples of a trial.

use arm_core::Joints;

/// Joint motion at the samples of a trial.
#[derive(Clone, Debug, PartialEq)]
pub struct Kinematics<const N: usize> {
    /// Angles \[rad\].
    pub q: Vec<Joints<f64, N>>,
    /// Speeds \[rad/s\].
    pub qd: Vec<Joints<f64, N>>,
    /// Accelerations \[rad/s²\].
    pub qdd: Vec<Joints<f64, N>>,
}
