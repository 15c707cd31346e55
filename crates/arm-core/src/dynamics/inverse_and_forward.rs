//! Inverse and forward dynamics.

use core::array::from_fn;

use crate::dynamics::gravity::link_gravity;
use crate::dynamics::inertia::link_motion;
use crate::dynamics::kinematics::{to_joint_torque, to_links};
use crate::numeric::unroll::each;
use crate::{Chain, Joints, Plane, Pose, Products, Scalar, joints};

/// What acts on the arm from outside and in its joints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Load<T, const N: usize> {
    /// Net torque of each joint on its distal segment: muscles or motors less all resisting torques \[N m\].
    pub torque: Joints<T, N>,
    /// Force on the arm at its tip \[N\].
    pub force_on_arm: Plane<T>,
    /// Moment on the arm at its tip, counter-clockwise \[N m\].
    pub moment_on_arm: T,
}

impl<T: Scalar, const N: usize> Load<T, N> {
    /// Nothing acts.
    pub fn none() -> Self {
        Self {
            torque: joints([T::ZERO; N]),
            force_on_arm: [T::ZERO; 2],
            moment_on_arm: T::ZERO,
        }
    }
}

/// Joint torques `Jᵀ F` of a force and a moment on the arm at its tip \[N m\].
#[cfg_attr(target_os = "none", inline)]
#[cfg_attr(not(target_os = "none"), inline(always))]
pub fn static_torque<T: Scalar, const N: usize>(
    chain: &Chain<T, N>,
    pose: &Pose<T, N>,
    force_on_arm: Plane<T>,
    moment_on_arm: T,
) -> Joints<T, N> {
    let mut rows = link_force(chain, pose, force_on_arm);
    if N > 0 {
        rows[N - 1] += moment_on_arm;
    }
    to_joint_torque(&rows)
}

#[inline(always)]
fn link_force<T: Scalar, const N: usize>(
    chain: &Chain<T, N>,
    pose: &Pose<T, N>,
    force: Plane<T>,
) -> [T; N] {
    from_fn(|i| chain.segments[i].length * (pose.cos[i] * force[1] - pose.sin[i] * force[0]))
}

/// Joint torques that move the arm with `qd`, `qdd`: `B q̈ + C q̇ + G` \[N m\].
///
/// Equals [`regressor`](crate::regressor) times the base parameters.
pub fn inverse_dynamics<T: Scalar, const N: usize>(
    chain: &Chain<T, N>,
    pose: &Pose<T, N>,
    qd: &Joints<T, N>,
    qdd: &Joints<T, N>,
) -> Joints<T, N> {
    inverse_dynamics_inlined(chain, pose, qd, qdd)
}

/// [`inverse_dynamics`] for loops over lanes that are compiled for wider vectors: only what is inlined goes along. A loop over single
/// states takes a tenth more instructions with it.
#[inline(always)]
pub fn inverse_dynamics_inlined<T: Scalar, const N: usize>(
    chain: &Chain<T, N>,
    pose: &Pose<T, N>,
    qd: &Joints<T, N>,
    qdd: &Joints<T, N>,
) -> Joints<T, N> {
    let acceleration = to_links(qdd);
    let (m, mut rows) = link_motion(&Products::of(chain), pose, &to_links(qd));
    let weight = link_gravity(chain, pose);
    for i in 0..N {
        rows[i] += weight[i] + m[i][i] * acceleration[i];
        for k in 0..i {
            rows[i] += m[i][k] * acceleration[k];
            rows[k] += m[i][k] * acceleration[i];
        }
    }
    to_joint_torque(&rows)
}

/// Joint accelerations under a load \[rad/s²\]; the inverse of [`inverse_dynamics`].
///
/// Solved in link angles by a factorisation without square roots ([`Resistance`]). The arm of a validated [`Chain`] has a positive
/// definite inertia matrix unless all inertia about a joint vanishes; then the result is not finite.
#[inline(always)]
pub fn forward_dynamics<T: Scalar, const N: usize>(
    chain: &Chain<T, N>,
    pose: &Pose<T, N>,
    qd: &Joints<T, N>,
    load: &Load<T, N>,
) -> Joints<T, N> {
    accelerations(&Products::of(chain), pose, qd, load)
}

/// [`forward_dynamics`] of an arm whose products are at hand, with the same bits.
#[inline(always)]
pub fn accelerations<T: Scalar, const N: usize>(
    products: &Products<T, N>,
    pose: &Pose<T, N>,
    qd: &Joints<T, N>,
    load: &Load<T, N>,
) -> Joints<T, N> {
    Resistance::at(products, pose, qd).accelerations(products, pose, load)
}

/// What an arm in one state opposes to any load: its inertia matrix in link angles, factorised, and what its speeds demand, so that another
/// load in the same state costs less.
///
/// `L D Lᵀ`, except that with three or more links the 2 × 2 Schur complement of the last two is inverted directly: one division instead of
/// two that depend on each other.
#[derive(Clone, Copy, Debug)]
pub struct Resistance<T, const N: usize> {
    /// `L D` up to the diagonal, by rows; the last block as the links before leave it.
    matrix: [[T; N]; N],
    /// One over `D` of the links that are eliminated one by one.
    reciprocal: [T; N],
    /// Inverse of the Schur complement `[[a, b], [b, c]]` as `[c, b, a] / (ac − b²)`, beside the diagonal without its minus sign.
    last: [T; 3],
    /// `C q̇` of each link \[N m\].
    demand: [T; N],
}

impl<T: Scalar, const N: usize> Resistance<T, N> {
    /// The number of pivots that are eliminated one by one.
    const SINGLE: usize = if N < 3 { N } else { N - 2 };

    /// The resistance in a state.
    #[inline(always)]
    pub fn at(products: &Products<T, N>, pose: &Pose<T, N>, qd: &Joints<T, N>) -> Self {
        let (mut m, demand) = link_motion(products, pose, &to_links(qd));
        let mut reciprocal = [products.first; N];
        each!(k in 0, Self::SINGLE => {
            if k > 0 {
                reciprocal[k] = T::ONE / m[k][k];
            }
            each!(i in k + 1, N => {
                let factor = m[i][k] * reciprocal[k];
                each!(c in i, N => {
                    m[c][i] -= factor * m[c][k];
                });
            });
        });
        let mut last = [T::ZERO; 3];
        if Self::SINGLE < N {
            let (near, beside, far) = (m[N - 2][N - 2], m[N - 1][N - 2], m[N - 1][N - 1]);
            let over = T::ONE / (near * far - beside * beside);
            last = [far * over, beside * over, near * over];
        }
        Self {
            matrix: m,
            reciprocal,
            last,
            demand,
        }
    }

    /// Joint accelerations under a load \[rad/s²\].
    #[inline(always)]
    pub fn accelerations(
        &self,
        products: &Products<T, N>,
        pose: &Pose<T, N>,
        load: &Load<T, N>,
    ) -> Joints<T, N> {
        let mut rows = self.demand;
        let [fy, fz] = load.force_on_arm;
        each!(i in 0, N => {
            // Weight and force at the tip turn the link with the same two lever arms.
            let [level, upright] = products.weight[i];
            let a = products.length[i];
            let pushed = (a * fz + level) * pose.cos[i] - (a * fy + upright) * pose.sin[i];
            let beyond = if i + 1 < N { load.torque[i + 1] } else { -load.moment_on_arm };
            rows[i] = load.torque[i] - beyond + pushed - rows[i];
        });
        self.solve(rows)
    }

    /// Joint accelerations for each newton metre of torque in one joint \[rad/(s² N m)\]: a column of the inverse inertia matrix.
    #[inline]
    pub fn column(&self, joint: usize) -> Joints<T, N> {
        let mut rows = [T::ZERO; N];
        for (i, row) in rows.iter_mut().enumerate() {
            if i == joint {
                *row = T::ONE;
            } else if i + 1 == joint {
                *row = -T::ONE;
            }
        }
        self.solve(rows)
    }

    /// Joint accelerations under torques of the links.
    #[inline(always)]
    fn solve(&self, mut b: [T; N]) -> Joints<T, N> {
        let (m, reciprocal) = (&self.matrix, &self.reciprocal);
        each!(k in 0, Self::SINGLE => {
            each!(i in k + 1, N => {
                let factor = m[i][k] * reciprocal[k];
                b[i] -= factor * b[k];
            });
        });
        if Self::SINGLE < N {
            let [near, beside, far] = self.last;
            (b[N - 2], b[N - 1]) = (
                near * b[N - 2] - beside * b[N - 1],
                far * b[N - 1] - beside * b[N - 2],
            );
        }
        each!(i in rev 0, Self::SINGLE => {
            each!(k in i + 1, N => {
                b[i] -= m[k][i] * b[k];
            });
            b[i] = b[i] * reciprocal[i];
        });
        joints(from_fn(|i| if i == 0 { b[0] } else { b[i] - b[i - 1] }))
    }
}

/// Force of the proximal side on each joint, from the motion and the force at the tip \[N\].
///
/// Newton's law summed over all segments beyond the joint; its magnitude is the load of the joint's bearing.
pub fn joint_force<T: Scalar, const N: usize>(
    chain: &Chain<T, N>,
    pose: &Pose<T, N>,
    motion: (&Joints<T, N>, &Joints<T, N>),
    force_on_arm: Plane<T>,
) -> [Plane<T>; N] {
    let (speed, acceleration) = (to_links(motion.0), to_links(motion.1));
    let mut joint = [T::ZERO; 2];
    let mut inertial = [[T::ZERO; 2]; N];
    for (i, segment) in chain.segments.iter().enumerate() {
        let turn = |along: T, normal: T| {
            let along_axis = -(along * speed[i].squared() + normal * acceleration[i]);
            let normal_axis = along * acceleration[i] - normal * speed[i].squared();
            [
                along_axis * pose.cos[i] - normal_axis * pose.sin[i],
                along_axis * pose.sin[i] + normal_axis * pose.cos[i],
            ]
        };
        let com = turn(segment.com[0], segment.com[1]);
        for axis in 0..2 {
            inertial[i][axis] = segment.mass * (joint[axis] + com[axis] - chain.gravity[axis]);
        }
        let end = turn(segment.length, T::ZERO);
        joint = [joint[0] + end[0], joint[1] + end[1]];
    }
    let mut sum = [-force_on_arm[0], -force_on_arm[1]];
    for force in inertial.iter_mut().rev() {
        sum = [sum[0] + force[0], sum[1] + force[1]];
        *force = sum;
    }
    inertial
}
