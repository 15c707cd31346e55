//! Forward kinematics and the Jacobian of the tip.

use core::array::from_fn;

use nalgebra::SMatrix;

use crate::{Chain, Joints, Lanes, Plane, Scalar, joints};

/// Direction of every link: sine and cosine of θ_j = q_1 + … + q_j.
///
/// Computed once for a configuration and shared by all algorithms, because the trigonometric functions cost most.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose<T, const N: usize> {
    pub(crate) sin: [T; N],
    pub(crate) cos: [T; N],
}

impl<T: Scalar, const N: usize> Pose<T, N> {
    /// The pose at joint angles `q` \[rad\].
    // Always, so that a loop which is compiled for wider vectors takes it along; on a device once in the code.
    #[cfg_attr(target_os = "none", inline(never))]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    pub fn new(q: &Joints<T, N>) -> Self {
        let [sin, cos] = T::sines_and_cosines(&to_links(q));
        Self { sin, cos }
    }

    /// Sines of the link angles.
    #[inline]
    pub fn sin(&self) -> &[T; N] {
        &self.sin
    }

    /// Cosines of the link angles.
    #[inline]
    pub fn cos(&self) -> &[T; N] {
        &self.cos
    }

    /// Cosine and sine of θ_i − θ_k.
    #[inline(always)]
    pub(crate) fn difference(&self, i: usize, k: usize) -> (T, T) {
        (
            self.cos[i] * self.cos[k] + self.sin[i] * self.sin[k],
            self.sin[i] * self.cos[k] - self.cos[i] * self.sin[k],
        )
    }
}

impl<const L: usize, const N: usize> Pose<Lanes<L>, N> {
    /// The pose of one lane.
    #[inline(always)]
    pub fn lane(&self, lane: usize) -> Pose<f64, N> {
        Pose {
            sin: from_fn(|i| self.sin[i].0[lane]),
            cos: from_fn(|i| self.cos[i].0[lane]),
        }
    }
}

/// Sums from the proximal end: joint speeds to link speeds, joint angles to link angles.
#[inline(always)]
pub(crate) fn to_links<T: Scalar, const N: usize>(values: &Joints<T, N>) -> [T; N] {
    let mut sum = T::ZERO;
    from_fn(|i| {
        sum += values[i];
        sum
    })
}

/// Sums from the distal end: what acts on each link to what acts at each joint.
#[inline(always)]
pub(crate) fn to_joint_torque<T: Scalar, const N: usize>(links: &[T; N]) -> Joints<T, N> {
    let mut torque = *links;
    for i in (0..N.saturating_sub(1)).rev() {
        torque[i] += torque[i + 1];
    }
    joints(torque)
}

/// Position of joint `joint` (0 is the base, `N` the tip) \[m\].
#[inline(always)]
pub fn joint_position<T: Scalar, const N: usize>(
    chain: &Chain<T, N>,
    pose: &Pose<T, N>,
    joint: usize,
) -> Plane<T> {
    let mut point = chain.base;
    for (i, segment) in chain.segments.iter().enumerate().take(joint) {
        point[0] += segment.length * pose.cos[i];
        point[1] += segment.length * pose.sin[i];
    }
    point
}

/// Position of the tip: `y = Σ a_j cos θ_j`, `z = Σ a_j sin θ_j` from the base \[m\].
#[inline(always)]
pub fn tip<T: Scalar, const N: usize>(chain: &Chain<T, N>, pose: &Pose<T, N>) -> Plane<T> {
    joint_position(chain, pose, N)
}

/// Velocity of the tip at joint speeds `qd` \[m/s\]; equals `jacobian · qd`.
#[inline(always)]
pub fn tip_velocity<T: Scalar, const N: usize>(
    chain: &Chain<T, N>,
    pose: &Pose<T, N>,
    qd: &Joints<T, N>,
) -> Plane<T> {
    let mut velocity = [T::ZERO; 2];
    let mut speed = T::ZERO;
    for i in 0..N {
        speed += qd[i];
        velocity[0] -= chain.segments[i].length * pose.sin[i] * speed;
        velocity[1] += chain.segments[i].length * pose.cos[i] * speed;
    }
    velocity
}

/// Derivative of the tip position to the joint angles, rows y and z \[m/rad\] (thesis 3.10, third row corrected).
///
/// A moment at the tip acts on every joint with factor one and needs no row here.
pub fn jacobian<T: Scalar, const N: usize>(
    chain: &Chain<T, N>,
    pose: &Pose<T, N>,
) -> SMatrix<T, 2, N> {
    distal_sums(from_fn(|i| {
        let a = chain.segments[i].length;
        [-a * pose.sin[i], a * pose.cos[i]]
    }))
}

/// Time derivative of the Jacobian at joint speeds `qd` \[m/(rad s)\].
pub fn jacobian_rate<T: Scalar, const N: usize>(
    chain: &Chain<T, N>,
    pose: &Pose<T, N>,
    qd: &Joints<T, N>,
) -> SMatrix<T, 2, N> {
    let speed = to_links(qd);
    distal_sums(from_fn(|i| {
        let a = chain.segments[i].length * speed[i];
        [-a * pose.cos[i], -a * pose.sin[i]]
    }))
}

fn distal_sums<T: Scalar, const N: usize>(links: [Plane<T>; N]) -> SMatrix<T, 2, N> {
    let mut out = SMatrix::<T, 2, N>::repeat(T::ZERO);
    let mut sum = [T::ZERO; 2];
    for i in (0..N).rev() {
        sum[0] += links[i][0];
        sum[1] += links[i][1];
        out[(0, i)] = sum[0];
        out[(1, i)] = sum[1];
    }
    out
}
