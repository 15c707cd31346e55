//! Coriolis and centrifugal torques.

use crate::dynamics::inertia::{link_motion, pairs, to_joint_matrix, turning};
use crate::dynamics::kinematics::{to_joint_torque, to_links};
use crate::{Chain, JointMatrix, Joints, Pose, Products, Scalar, joints};

/// Derivative of `M_ik` to θ_i; to θ_k it is the opposite.
#[inline]
fn slope<T: Scalar, const N: usize>(
    chain: &Chain<T, N>,
    pose: &Pose<T, N>,
    i: usize,
    k: usize,
) -> T {
    let (near, far) = if i < k { (i, k) } else { (k, i) };
    let (c, s) = pose.difference(near, far);
    let value = chain.segments[near].length * (chain.h[far] * c - chain.x[far] * s);
    if i < k { value } else { -value }
}

/// Torques `C(q,q̇) q̇` at joint speeds `qd` \[N m\] (thesis 3.7; 3.6 corrected as its appendix D has it).
pub fn coriolis<T: Scalar, const N: usize>(
    chain: &Chain<T, N>,
    pose: &Pose<T, N>,
    qd: &Joints<T, N>,
) -> Joints<T, N> {
    to_joint_torque(&link_motion(&Products::of(chain), pose, &to_links(qd)).1)
}

/// The matrix `C(q,q̇)` of Christoffel symbols, for which `Ḃ − 2C` is skew-symmetric \[N m s/rad\].
pub fn coriolis_matrix<T: Scalar, const N: usize>(
    chain: &Chain<T, N>,
    pose: &Pose<T, N>,
    qd: &Joints<T, N>,
) -> JointMatrix<T, N> {
    let speed = to_links(qd);
    let mut c = JointMatrix::<T, N>::repeat(T::ZERO);
    for i in 0..N {
        for k in 0..N {
            if i != k {
                c[(i, k)] = -slope(chain, pose, i, k) * speed[k];
            }
        }
    }
    to_joint_matrix(&c)
}

/// The part of [`coriolis`] that goes with the squares q̇_j²; what remains goes with products q̇_j q̇_k.
///
/// The thesis splits by diagonal and off-diagonal entries of C, which is not this distinction: no diagonal entry
/// gives a squared speed.
pub fn centrifugal<T: Scalar, const N: usize>(
    chain: &Chain<T, N>,
    pose: &Pose<T, N>,
    qd: &Joints<T, N>,
) -> Joints<T, N> {
    centrifugal_of(&pairs(&Products::of(chain), pose).1, qd)
}

/// [`centrifugal`] from the slopes of [`pairs`].
#[inline(always)]
pub(crate) fn centrifugal_of<T: Scalar, const N: usize>(
    slopes: &[[T; N]; N],
    qd: &Joints<T, N>,
) -> Joints<T, N> {
    let mut total = joints([T::ZERO; N]);
    for k in 0..N {
        let mut alone = joints([T::ZERO; N]);
        alone[k] = qd[k];
        let torque = to_joint_torque(&turning(slopes, &to_links(&alone)));
        for i in 0..N {
            total[i] += torque[i];
        }
    }
    total
}
