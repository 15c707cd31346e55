//! Derivatives of the joint torques with respect to the joint angles.

use crate::dynamics::inertia::{pairs, to_joint_matrix};
use crate::dynamics::kinematics::to_links;
use crate::{Chain, JointMatrix, Joints, Plane, Pose, Products, Scalar};

/// Slopes of `B q̈ + C q̇ + G − Jᵀ F` to the joint angles, a column for each \[N m/rad\]: of what the joints give so that the arm moves
/// with `qd`, `qdd` under a force on it at its tip.
///
/// In link angles every entry of the inertia matrix depends on one difference θ_i − θ_k: `M_ik = a_i (X_k cos + H_k sin)`, whose second
/// derivative is `−M_ik`.
///
/// * `force_on_arm` - at the tip \[N\]
///
/// ```
/// use arm_core::{Joints, Pose, gravity, sample_arms, torque_by_angle};
/// let (arm, q, rest) = (sample_arms::human_arm(), Joints::<f64, 3>::new(-1.0, 0.8, 0.1), Joints::zeros());
/// let slopes = torque_by_angle(&arm, &Pose::new(&q), (&rest, &rest), [0.0; 2]);
/// let [up, down] = [1e-5, -1e-5].map(|d| gravity(&arm, &Pose::new(&q.add_scalar(d))));
/// assert!((slopes.column_sum() - (up - down) / 2e-5).norm() < 1e-8);
/// ```
pub fn torque_by_angle<T: Scalar, const N: usize>(
    chain: &Chain<T, N>,
    pose: &Pose<T, N>,
    (qd, qdd): (&Joints<T, N>, &Joints<T, N>),
    force_on_arm: Plane<T>,
) -> JointMatrix<T, N> {
    let (speed, acceleration) = (to_links(qd), to_links(qdd));
    let products = Products::of(chain);
    let (m, slopes) = pairs(&products, pose);
    let mut links = JointMatrix::<T, N>::repeat(T::ZERO);
    for k in 0..N {
        let [level, upright] = products.weight[k];
        let a = products.length[k];
        let [fy, fz] = force_on_arm;
        links[(k, k)] += (upright + a * fy) * pose.cos[k] + (level + a * fz) * pose.sin[k];
        for i in 0..k {
            // Without the rotor term of `pairs`, which no angle changes.
            let turning = if i + 1 == k {
                m[k][i] + products.rotor[k]
            } else {
                m[k][i]
            };
            let on_i = slopes[k][i] * acceleration[k] + turning * speed[k].squared();
            let on_k = slopes[k][i] * acceleration[i] - turning * speed[i].squared();
            links[(i, i)] += on_i;
            links[(i, k)] -= on_i;
            links[(k, i)] += on_k;
            links[(k, k)] -= on_k;
        }
    }
    to_joint_matrix(&links)
}
