//! Gravity torques.

use core::array::from_fn;

use crate::dynamics::kinematics::to_joint_torque;
use crate::{Chain, Joints, Pose, Scalar};

/// Row of each link: how its weight and that of all beyond it resist turning \[N m\].
#[inline(always)]
pub(crate) fn link_gravity<T: Scalar, const N: usize>(
    chain: &Chain<T, N>,
    pose: &Pose<T, N>,
) -> [T; N] {
    from_fn(|i| {
        let [level, upright] = weight_moments(chain, i);
        upright * pose.sin[i] - level * pose.cos[i]
    })
}

/// Moments of the weight of a link and of all beyond it about its joint, with the link level and upright \[N m\].
#[inline(always)]
pub(crate) fn weight_moments<T: Scalar, const N: usize>(chain: &Chain<T, N>, i: usize) -> [T; 2] {
    let [gy, gz] = chain.gravity;
    let (x, h) = (chain.x[i], chain.h[i]);
    [gz * x - gy * h, gy * x + gz * h]
}

/// Gravity torques `G(q)` on the left-hand side of the equation of motion, shoulder first \[N m\] (thesis 3.8).
#[cfg_attr(not(target_os = "none"), inline(always))]
pub fn gravity<T: Scalar, const N: usize>(chain: &Chain<T, N>, pose: &Pose<T, N>) -> Joints<T, N> {
    to_joint_torque(&link_gravity(chain, pose))
}
