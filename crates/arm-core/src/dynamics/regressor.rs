//! The regressor: inverse dynamics as a linear function of the inertial parameters.

use crate::dynamics::kinematics::{to_joint_torque, to_links};
use crate::{Chain, JointMatrix, Joints, Pose, Scalar};

/// Derivatives of the joint torques to the base parameters; row = joint, column = link.
///
/// The effects of the catalogue that are linear in their parameters add columns of their own, their gradients.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Regressor<T, const N: usize> {
    /// To the first moments `X_j` \[N m/(kg m)\].
    pub x: JointMatrix<T, N>,
    /// To the normal moments `H_j` \[N m/(kg m)\].
    pub h: JointMatrix<T, N>,
    /// To the second moments `J_j` \[N m/(kg m²)\].
    pub j: JointMatrix<T, N>,
}

impl<T: Scalar, const N: usize> Regressor<T, N> {
    /// Joint torques for base parameters \[N m\].
    pub fn torque(&self, x: &[T; N], h: &[T; N], j: &[T; N]) -> Joints<T, N> {
        let mut torque = Joints::<T, N>::repeat(T::ZERO);
        for row in 0..N {
            for k in 0..N {
                torque[row] +=
                    self.x[(row, k)] * x[k] + self.h[(row, k)] * h[k] + self.j[(row, k)] * j[k];
            }
        }
        torque
    }

    /// Columns to the inertial parameters of segment `k`: mass, mass × com along, mass × com normal, inertia about its
    /// proximal joint. A mass acts as if it were moved to the distal joints of all segments before it.
    pub fn segment_columns(&self, chain: &Chain<T, N>, k: usize) -> [Joints<T, N>; 4] {
        let mut mass = Joints::<T, N>::repeat(T::ZERO);
        for row in 0..N {
            for i in 0..k.min(N) {
                let a = chain.segments[i].length;
                mass[row] += a * self.x[(row, i)] + a.squared() * self.j[(row, i)];
            }
        }
        [
            mass,
            self.x.column(k).into_owned(),
            self.h.column(k).into_owned(),
            self.j.column(k).into_owned(),
        ]
    }
}

/// The regressor at a motion; needs of the chain only lengths and gravity.
pub fn regressor<T: Scalar, const N: usize>(
    chain: &Chain<T, N>,
    pose: &Pose<T, N>,
    qd: &Joints<T, N>,
    qdd: &Joints<T, N>,
) -> Regressor<T, N> {
    let moving = [&to_links(qd), &to_links(qdd)];
    let zero = JointMatrix::<T, N>::repeat(T::ZERO);
    let mut y = Regressor {
        x: zero,
        h: zero,
        j: zero,
    };
    for k in 0..N {
        let [x, h, j] = link_columns(chain, pose, moving, k);
        y.x.set_column(k, &x);
        y.h.set_column(k, &h);
        y.j.set_column(k, &j);
    }
    y
}

/// The columns to the moments of link `k`: `X_k`, `H_k`, `J_k`; speeds and accelerations are those of the links.
#[inline(always)]
pub(crate) fn link_columns<T: Scalar, const N: usize>(
    chain: &Chain<T, N>,
    pose: &Pose<T, N>,
    [speed, acceleration]: [&[T; N]; 2],
    k: usize,
) -> [Joints<T, N>; 3] {
    let [gy, gz] = chain.gravity;
    let (mut x, mut h, mut j) = ([T::ZERO; N], [T::ZERO; N], [T::ZERO; N]);
    x[k] = gy * pose.sin[k] - gz * pose.cos[k];
    h[k] = gy * pose.cos[k] + gz * pose.sin[k];
    j[k] = acceleration[k];
    // Every link before k carries the moment of link k at its end.
    for i in 0..k {
        let a = chain.segments[i].length;
        let (c, s) = pose.difference(i, k);
        x[i] += a * (c * acceleration[k] + s * speed[k].squared());
        h[i] += a * (s * acceleration[k] - c * speed[k].squared());
        x[k] += a * (c * acceleration[i] - s * speed[i].squared());
        h[k] += a * (s * acceleration[i] + c * speed[i].squared());
    }
    [x, h, j].map(|links| to_joint_torque(&links))
}
