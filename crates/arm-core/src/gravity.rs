//! Gravity torques.

use core::array::from_fn;

use crate::kinematics::to_joint_torque;
use crate::{Chain, Joints, Pose, Scalar};

/// Row of each link: how its weight and that of all beyond it resist turning \[N m\].
#[inline]
pub(crate) fn link_gravity<T: Scalar, const N: usize>(
    chain: &Chain<T, N>,
    pose: &Pose<T, N>,
) -> [T; N] {
    let [gy, gz] = chain.gravity;
    from_fn(|i| {
        let (x, h) = (chain.x[i], chain.h[i]);
        gy * (x * pose.sin[i] + h * pose.cos[i]) - gz * (x * pose.cos[i] - h * pose.sin[i])
    })
}

/// Gravity torques `G(q)` on the left-hand side of the equation of motion, shoulder first \[N m\] (thesis 3.8).
pub fn gravity<T: Scalar, const N: usize>(chain: &Chain<T, N>, pose: &Pose<T, N>) -> Joints<T, N> {
    to_joint_torque(&link_gravity(chain, pose))
}
