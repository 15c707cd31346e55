//! Torques that hold joints.

use arm_core::{Joints, Scalar};

/// Share of its own inverse inertia below which what a joint gives to a torque of its friction is rounding.
const STIFF: f64 = 1e-9;

/// Friction torques that cancel the accelerations of joints that stick \[N m\], and 1 for each joint that they hold, else 0: a joint whose
/// motion the handle prescribes is not held.
///
/// * `columns` - accelerations for one newton metre in each joint that sticks \[rad/(s² N m)\]
/// * `own` - acceleration of that joint for one newton metre in it with the tip free \[rad/(s² N m)\]
/// * `left` - the acceleration to cancel in each joint that sticks \[rad/s²\]
/// * `sticks` - 1 for a joint that sticks, else 0
#[inline(always)]
pub(super) fn hold<T: Scalar, const N: usize>(
    columns: &[Joints<T, N>; N],
    own: &[T; N],
    mut left: [T; N],
    sticks: &[T; N],
) -> (Joints<T, N>, [T; N]) {
    let (mut torque, mut held) = (Joints::<T, N>::repeat(T::ZERO), [T::ZERO; N]);
    let mut m = [[T::ZERO; N]; N];
    for (i, row) in m.iter_mut().enumerate() {
        for (k, entry) in row.iter_mut().enumerate() {
            *entry = columns[k][i];
        }
    }
    let zero = || T::ZERO;
    for k in 0..N {
        // NaN counts as stiff.
        held[k] = T::if_less(T::of(STIFF) * own[k], m[k][k], sticks[k], T::ZERO);
        for i in k + 1..N {
            let both = held[k] * sticks[i];
            let factor = T::where_less(T::ZERO, both, || m[i][k] / m[k][k], zero);
            for c in k..N {
                m[i][c] -= factor * m[k][c];
            }
            left[i] -= factor * left[k];
        }
    }
    for k in (0..N).rev() {
        let mut rest = left[k];
        for c in k + 1..N {
            rest -= m[k][c] * torque[c];
        }
        torque[k] = T::where_less(T::ZERO, held[k], || rest / m[k][k], zero);
    }
    (torque, held)
}
