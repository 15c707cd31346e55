//! The kernels of the core over rows of numbers, one row at a time or several side by side.

use arm_core::{Chain, Joints, Load, Pose, Scalar};
use nalgebra::SMatrix;

/// Longest arm that is compiled in.
pub(crate) const MOST: usize = 6;

/// Values of a row as joint values.
#[inline(always)]
pub fn joints<T: Scalar, const N: usize>(row: &[T]) -> Joints<T, N> {
    // Not from a slice, which copies numbers one by one where they are of many lanes.
    Joints::from_fn(|i, _| row[i])
}

/// A function of a chain and a row of each of `K` arguments. A trait, as closures cannot be made to be inlined, and only what is
/// inlined goes through the widest vectors.
pub trait Kernel<const K: usize> {
    /// Whether a batch goes through lanes: only where it takes long enough to be worth their compilation.
    const IN_LANES: bool;

    /// Shape of a result for an arm with some joints.
    fn shape(joints: usize) -> Vec<usize>;

    /// Writes the result of a row, row-major.
    fn write<T: Scalar, const N: usize>(chain: &Chain<T, N>, given: [&[T]; K], out: &mut [T]);
}

macro_rules! kernels {
    ($($name:ident, in lanes $lanes:literal: |$n:ident| $shape:expr, |$chain:ident, [$($given:ident),*], $out:ident| $body:expr;)*) => {$(
        pub struct $name;

        impl Kernel<{ [$(stringify!($given)),*].len() }> for $name {
            const IN_LANES: bool = $lanes;

            fn shape($n: usize) -> Vec<usize> {
                $shape.to_vec()
            }

            #[inline(always)]
            fn write<T: Scalar, const N: usize>(
                $chain: &Chain<T, N>,
                [$($given),*]: [&[T]; { [$(stringify!($given)),*].len() }],
                $out: &mut [T],
            ) {
                $body
            }
        }
    )*};
}

kernels! {
    ForwardKinematics, in lanes false: |_n| [2], |chain, [q], out| {
        out.copy_from_slice(&arm_core::tip(chain, &Pose::new(&joints(q))));
    };
    Jacobian, in lanes false: |n| [2, n], |chain, [q], out| {
        put(&arm_core::jacobian(chain, &Pose::new(&joints(q))), out);
    };
    Inertia, in lanes false: |n| [n, n], |chain, [q], out| {
        put(&arm_core::inertia(chain, &Pose::new(&joints(q))), out);
    };
    Coriolis, in lanes false: |n| [n], |chain, [q, qd], out| {
        put(&arm_core::coriolis(chain, &Pose::new(&joints(q)), &joints(qd)), out);
    };
    Gravity, in lanes false: |n| [n], |chain, [q], out| {
        put(&arm_core::gravity(chain, &Pose::new(&joints(q))), out);
    };
    StaticTorque, in lanes false: |n| [n], |chain, [q, force], out| {
        let pose = Pose::new(&joints(q));
        put(&arm_core::static_torque(chain, &pose, [force[0], force[1]], T::ZERO), out);
    };
    InverseDynamics, in lanes true: |n| [n], |chain, [q, qd, qdd], out| {
        put(&arm_core::inverse_dynamics_inlined(chain, &Pose::new(&joints(q)), &joints(qd), &joints(qdd)), out);
    };
    ForwardDynamics, in lanes true: |n| [n], |chain, [q, qd, torque], out| {
        let load = Load { torque: joints(torque), ..Load::none() };
        put(&arm_core::forward_dynamics(chain, &Pose::new(&joints(q)), &joints(qd), &load), out);
    };
    Regressor, in lanes false: |n| [n, 3 * n], |chain, [q, qd, qdd], out| {
        let y = arm_core::regressor(chain, &Pose::new(&joints(q)), &joints(qd), &joints(qdd));
        for (r, row) in out.chunks_exact_mut(3 * N).enumerate() {
            for k in 0..N {
                (row[k], row[N + k], row[2 * N + k]) = (y.x[(r, k)], y.h[(r, k)], y.j[(r, k)]);
            }
        }
    };
}

#[inline(always)]
fn put<T: Scalar, const R: usize, const C: usize>(matrix: &SMatrix<T, R, C>, out: &mut [T]) {
    for r in 0..R {
        for c in 0..C {
            out[r * C + c] = matrix[(r, c)];
        }
    }
}
