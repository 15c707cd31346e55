//! The inertia matrix.

use crate::numeric::unroll::each;
use crate::{Chain, JointMatrix, Pose, Products, Scalar};

/// Inertia matrix in link angles θ \[kg m²\]: `M_jj = J_j`, `M_ij = a_i (X_j cos(θ_i−θ_j) + H_j sin(θ_i−θ_j))` for i < j.
///
/// Rotor inertia acts on the relative angles and adds a tridiagonal part.
#[inline(always)]
pub fn link_inertia<T: Scalar, const N: usize>(
    chain: &Chain<T, N>,
    pose: &Pose<T, N>,
) -> JointMatrix<T, N> {
    let rows = pairs(&Products::of(chain), pose).0;
    JointMatrix::from_fn(|i, k| if i < k { rows[k][i] } else { rows[i][k] })
}

/// The inertia matrix in link angles, rows up to the diagonal, and the centrifugal part of each link's row.
#[inline(always)]
pub(crate) fn link_motion<T: Scalar, const N: usize>(
    products: &Products<T, N>,
    pose: &Pose<T, N>,
    speed: &[T; N],
) -> ([[T; N]; N], [T; N]) {
    let (m, slopes) = pairs(products, pose);
    (m, turning(&slopes, speed))
}

/// The inertia matrix in link angles, rows up to the diagonal, and the slopes of its entries `M_ik` to θ_i at `[k][i]`, for i < k.
///
/// One pass over the pairs of links, with their angle θ_i − θ_k: `M_ik = a_i (X_k cos + H_k sin)`, and its slope is
/// `a_i (H_k cos − X_k sin)`.
#[inline(always)]
pub(crate) fn pairs<T: Scalar, const N: usize>(
    products: &Products<T, N>,
    pose: &Pose<T, N>,
) -> ([[T; N]; N], [[T; N]; N]) {
    let (mut m, mut slopes) = ([[T::ZERO; N]; N], [[T::ZERO; N]; N]);
    each!(k in 0, N => {
        each!(i in 0, k => {
            let (c, s) = pose.difference(i, k);
            let [along, normal] = products.coupling[k][i];
            slopes[k][i] = normal * c - along * s;
            m[k][i] = along * c + normal * s;
        });
        m[k][k] = products.diagonal[k];
        if k > 0 {
            m[k][k - 1] -= products.rotor[k];
        }
    });
    (m, slopes)
}

/// The centrifugal part of each link's row: the slope of a pair i < k takes the squared speed of k from row i and gives that of i to
/// row k.
#[inline(always)]
pub(crate) fn turning<T: Scalar, const N: usize>(slopes: &[[T; N]; N], speed: &[T; N]) -> [T; N] {
    let mut turning = [T::ZERO; N];
    each!(k in 0, N => {
        each!(i in 0, k => {
            turning[i] -= slopes[k][i] * speed[k].squared();
            turning[k] += slopes[k][i] * speed[i].squared();
        });
    });
    turning
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
