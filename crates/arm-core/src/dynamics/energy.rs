//! Energy of the moving arm.

use crate::dynamics::kinematics::to_links;
use crate::{Chain, Joints, Pose, Scalar, link_inertia};

/// Kinetic energy `½ q̇ᵀ B q̇` \[J\].
#[inline(always)]
pub fn kinetic_energy<T: Scalar, const N: usize>(
    chain: &Chain<T, N>,
    pose: &Pose<T, N>,
    qd: &Joints<T, N>,
) -> T {
    let speed = to_links(qd);
    let m = link_inertia(chain, pose);
    let mut twice = T::ZERO;
    for i in 0..N {
        for k in 0..N {
            twice += m[(i, k)] * speed[i] * speed[k];
        }
    }
    T::of(0.5) * twice
}

/// Potential energy of the weight relative to the base \[J\]; its gradient to `q` is [`gravity`](crate::gravity).
#[inline(always)]
pub fn potential_energy<T: Scalar, const N: usize>(chain: &Chain<T, N>, pose: &Pose<T, N>) -> T {
    let [gy, gz] = chain.gravity;
    let mut energy = T::ZERO;
    for i in 0..N {
        let (x, h) = (chain.x[i], chain.h[i]);
        energy -=
            gy * (x * pose.cos[i] - h * pose.sin[i]) + gz * (x * pose.sin[i] + h * pose.cos[i]);
    }
    energy
}
