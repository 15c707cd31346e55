//! A handle that the hand holds beside its tip.

use crate::{Joints, Plane, Pose, Scalar, Setup};

/// Where the handle sits beside the tip, fixed in the last segment: along it and to its left \[m\].
///
/// Its bearing passes a force and no moment, so that the force acts at the handle: about the joints before it with the arm
/// `r = R(θ_N) placement` beside that of the tip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement<T>(Plane<T>);

impl<T: Scalar> Placement<T> {
    /// The place of the handle in a rig, or nothing where it is the tip.
    pub fn of<const N: usize>(setup: &Setup<T, N>) -> Option<Self> {
        let at_tip = setup.placement.iter().all(|p| p.every(|p| p == 0.0));
        (!at_tip && N > 0).then_some(Self(setup.placement))
    }

    /// From the tip to the handle \[m\].
    #[inline]
    pub fn arm<const N: usize>(&self, pose: &Pose<T, N>) -> Plane<T> {
        let ([along, left], sin, cos) = (self.0, pose.sin()[N - 1], pose.cos()[N - 1]);
        [along * cos - left * sin, along * sin + left * cos]
    }

    /// Velocity of the handle beside that of the tip \[m/s\].
    #[inline]
    pub fn velocity<const N: usize>(&self, pose: &Pose<T, N>, qd: &Joints<T, N>) -> Plane<T> {
        let ([y, z], turning) = (self.arm(pose), turning(qd));
        [-(turning * z), turning * y]
    }

    /// Acceleration beside that of the tip while the joints' own is zero \[m/s²\].
    pub fn centripetal<const N: usize>(&self, pose: &Pose<T, N>, qd: &Joints<T, N>) -> Plane<T> {
        let squared = turning(qd).squared();
        self.arm(pose).map(|r| -(squared * r))
    }

    /// Moment of a force on the arm about the tip \[N m\].
    #[inline]
    pub fn moment<const N: usize>(&self, pose: &Pose<T, N>, force_on_arm: Plane<T>) -> T {
        let [y, z] = self.arm(pose);
        y * force_on_arm[1] - z * force_on_arm[0]
    }
}

/// Speed of the last segment \[rad/s\].
#[inline]
fn turning<T: Scalar, const N: usize>(qd: &Joints<T, N>) -> T {
    qd.iter().fold(T::ZERO, |sum, v| sum + *v)
}
