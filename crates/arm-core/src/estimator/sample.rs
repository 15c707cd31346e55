//! The input of an estimator in one control period, and the status of each sample.

use super::filtered_channel::Fault;
use crate::Joints;
use crate::numeric::scalar::Real;
use crate::regression::Measured;

/// The measurements of one control period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample<T, const N: usize> {
    /// Joint angles \[rad\].
    pub q: Joints<T, N>,
    /// Joint angles from which speeds and accelerations are taken, where better ones are known than `q`: from the encoders
    /// of the robot that leads the arm, or from its command \[rad\].
    pub lead: Option<Joints<T, N>>,
    /// What acts on the arm.
    pub measured: Measured<T, N>,
}

/// What became of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampleStatus {
    /// It counts.
    Taken,
    /// No joint moves: it holds no information.
    Resting,
    /// The filters have not yet settled after a start or a gap.
    Settling,
    /// It was refused.
    Refused(Fault),
}

impl SampleStatus {
    /// All of them, in the order of the C interface.
    pub const ALL: [Self; 10] = [
        Self::Taken,
        Self::Resting,
        Self::Settling,
        Self::Refused(Fault::Missing),
        Self::Refused(Fault::NotFinite),
        Self::Refused(Fault::Spike),
        Self::Refused(Fault::Frozen),
        Self::Refused(Fault::Unexpected),
        Self::Refused(Fault::Implausible),
        Self::Refused(Fault::Restarted),
    ];

    /// The word for it in tables and files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Taken => "taken",
            Self::Resting => "resting",
            Self::Settling => "settling",
            Self::Refused(Fault::Missing) => "missing",
            Self::Refused(Fault::NotFinite) => "not finite",
            Self::Refused(Fault::Spike) => "spike",
            Self::Refused(Fault::Frozen) => "frozen",
            Self::Refused(Fault::Unexpected) => "unexpected",
            Self::Refused(Fault::Implausible) => "not possible",
            Self::Refused(Fault::Restarted) => "restarted",
        }
    }
}

impl<T: Real, const N: usize> Sample<T, N> {
    /// Whether all that was measured is finite.
    pub(super) fn finite(&self) -> bool {
        let leads = self.lead.iter().flatten();
        let angles = self.q.iter().chain(leads).chain(&self.measured.torque);
        let mut all = angles.chain(&self.measured.force_on_arm);
        all.all(|v| v.is_finite()) && self.measured.moment_on_arm.is_finite()
    }

    /// Angles, leading angles or torques of the joints.
    pub(super) fn of_joints(&self, kind: usize) -> &[T; N] {
        let values = match kind {
            0 => &self.q,
            1 => self.lead.as_ref().unwrap_or(&self.q),
            _ => &self.measured.torque,
        };
        let [values] = &values.data.0;
        values
    }

    /// Forces and moment at the hand.
    pub(super) fn of_hand(&self) -> [T; 3] {
        let [y, z] = self.measured.force_on_arm;
        [y, z, self.measured.moment_on_arm]
    }
}
