//! The inertia matrix.

use crate::{Chain, JointMatrix, Pose, Scalar};

/// Inertia matrix in link angles θ \[kg m²\]: `M_jj = J_j`, `M_ij = a_i (X_j cos(θ_i−θ_j) + H_j sin(θ_i−θ_j))` for i < j.
///
/// Rotor inertia acts on the relative angles and adds a tridiagonal part.
#[inline]
pub fn link_inertia<T: Scalar, const N: usize>(
    chain: &Chain<T, N>,
    pose: &Pose<T, N>,
) -> JointMatrix<T, N> {
    let mut m = JointMatrix::<T, N>::repeat(T::ZERO);
    for i in 0..N {
        for k in i + 1..N {
            let (c, s) = pose.difference(i, k);
            let value = chain.segments[i].length * (chain.x[k] * c + chain.h[k] * s);
            m[(i, k)] = value;
            m[(k, i)] = value;
        }
        m[(i, i)] = chain.j[i];
    }
    for i in 0..N {
        m[(i, i)] += chain.rotor[i];
        if i > 0 {
            m[(i - 1, i - 1)] += chain.rotor[i];
            m[(i, i - 1)] -= chain.rotor[i];
            m[(i - 1, i)] -= chain.rotor[i];
        }
    }
    m
}

/// Inertia matrix in joint angles, `B(q)` of thesis 3.4 with `l_3²` in place of the misprinted `l_2²` \[kg m²\].
///
/// Symmetric and positive definite; `B = Tᵀ M T` with `θ = T q`.
pub fn inertia<T: Scalar, const N: usize>(
    chain: &Chain<T, N>,
    pose: &Pose<T, N>,
) -> JointMatrix<T, N> {
    to_joint_matrix(&link_inertia(chain, pose))
}

/// `Tᵀ M T`: sums over all distal rows and columns.
pub(crate) fn to_joint_matrix<T: Scalar, const N: usize>(
    links: &JointMatrix<T, N>,
) -> JointMatrix<T, N> {
    let mut b = *links;
    for i in (0..N.saturating_sub(1)).rev() {
        for k in 0..N {
            b[(i, k)] = b[(i, k)] + b[(i + 1, k)];
        }
    }
    for i in 0..N {
        for k in (0..N.saturating_sub(1)).rev() {
            b[(i, k)] = b[(i, k)] + b[(i, k + 1)];
        }
    }
    b
}
