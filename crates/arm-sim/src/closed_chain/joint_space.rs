//! The equation of motion in joint coordinates, for rigs beyond the link-form solver of the core: an arm whose first
//! joint moves, and an arm whose tip is held rigidly.

use core::array::from_fn;

use arm_core::{
    Chain, JointMatrix, Joints, Placement, Plane, Pose, Scalar, Setup, gravity, inertia,
    inverse_dynamics, jacobian, jacobian_rate, joint_force,
};

/// A first joint that moves with its own angle: `base + u (q_1 − rest)`.
///
/// It is an ideal guide: it does no work and has no mass. Lagrange's equations with the velocity `u q̇_1` of the whole arm,
/// P the derivative of the first moment `Σ m r` to the joint angles and f₀ the force through the first joint without
/// acceleration give
///
/// ```text
/// B' = B + e₁ (uᵀP) + (uᵀP)ᵀ e₁ᵀ + e₁ M|u|² e₁ᵀ     bias' = C q̇ + G + e₁ uᵀf₀     J' = J + u e₁ᵀ
/// ```
///
/// so that inertia, weight and contact force all act on it and energy is conserved.
#[derive(Clone, Debug)]
pub(crate) struct MovingBase<T> {
    per_angle: Plane<T>,
    rest: T,
    mass: T,
}

impl<T: Scalar> MovingBase<T> {
    /// The moving base of a rig, or nothing where it rests.
    pub fn of<const N: usize>(setup: &Setup<T, N>) -> Option<Self> {
        let u = setup.base_motion;
        if u.iter().all(|u| u.every(|u| u == 0.0)) {
            return None;
        }
        Some(Self {
            per_angle: u,
            rest: setup.base_rest,
            mass: setup.segments.iter().fold(T::ZERO, |m, s| m + s.mass),
        })
    }

    /// How far the base stands from its place at rest \[m\].
    #[inline]
    pub fn displacement<const N: usize>(&self, q: &Joints<T, N>) -> Plane<T> {
        let angle = q[0] - self.rest;
        self.per_angle.map(|u| u * angle)
    }

    /// Its velocity \[m/s\], and with accelerations its acceleration \[m/s²\].
    #[inline]
    pub fn velocity<const N: usize>(&self, qd: &Joints<T, N>) -> Plane<T> {
        self.per_angle.map(|u| u * qd[0])
    }

    /// Torque on the first joint that accelerates the whole arm so that it keeps up with an acceleration \[N m\].
    #[inline]
    pub fn along(&self, [y, z]: Plane<T>) -> T {
        let [uy, uz] = self.per_angle;
        self.mass * (uy * y + uz * z)
    }

    /// Joint torques on the left-hand side because the base moves; the contact's share is subtracted \[N m\].
    pub fn torque<const N: usize>(
        &self,
        chain: &Chain<T, N>,
        pose: &Pose<T, N>,
        (qd, qdd): (&Joints<T, N>, &Joints<T, N>),
        force_on_arm: Plane<T>,
    ) -> Joints<T, N> {
        // Newton for the whole arm as if its base stood still, less the contact force.
        let [fy, fz] = joint_force(chain, pose, (qd, qdd), force_on_arm)[0];
        let rows = first_moment_rows(chain, pose);
        let [uy, uz] = self.per_angle;
        let mut torque = Joints::<T, N>::repeat(T::ZERO);
        for k in 0..N {
            torque[k] = (uy * rows[0][k] + uz * rows[1][k]) * qdd[0];
        }
        torque[0] += uy * fy + uz * fz + self.mass * (uy.squared() + uz.squared()) * qdd[0];
        torque
    }

    /// Kinetic and potential energy beyond those of the arm on a base at rest \[J\].
    pub fn energy<const N: usize>(
        &self,
        chain: &Chain<T, N>,
        pose: &Pose<T, N>,
        q: &Joints<T, N>,
        qd: &Joints<T, N>,
    ) -> [T; 2] {
        let v = self.velocity(qd);
        let rows = first_moment_rows(chain, pose);
        let mut kinetic = T::of(0.5) * self.mass * (v[0].squared() + v[1].squared());
        for k in 0..N {
            kinetic += (v[0] * rows[0][k] + v[1] * rows[1][k]) * qd[k];
        }
        let [y, z] = self.displacement(q);
        let [gy, gz] = chain.gravity();
        [kinetic, -(self.mass * (gy * y + gz * z))]
    }
}

/// Derivative of the arm's first moment to the joint angles, rows y and z \[kg m/rad\]: its gravity torques under unit gravity against y and z.
pub(crate) fn first_moment_rows<T: Scalar, const N: usize>(
    chain: &Chain<T, N>,
    pose: &Pose<T, N>,
) -> [Joints<T, N>; 2] {
    let against = |y, z| gravity(&chain.with_gravity([T::of(y), T::of(z)]), pose);
    [against(-1.0, 0.0), against(0.0, -1.0)]
}

/// Adds to the forces through the joints what accelerates everything beyond them with the base \[N\].
///
/// * `acceleration` - of the base \[m/s²\]
pub(crate) fn add_inertia<T: Scalar, const N: usize>(
    chain: &Chain<T, N>,
    acceleration: Plane<T>,
    force: &mut [Plane<T>; N],
) {
    let mut beyond = T::ZERO;
    for (segment, force) in chain.segments().iter().zip(force.iter_mut()).rev() {
        beyond += segment.mass;
        for axis in 0..2 {
            force[axis] += beyond * acceleration[axis];
        }
    }
}

/// `B`, `C q̇ + G` and the Jacobian of the tip at one state, with a moving base and a handle beside the tip where there are.
pub(crate) struct JointSpaceEquation<T, const N: usize> {
    inertia: JointMatrix<T, N>,
    /// What does not depend on accelerations.
    pub given: BiasAndJacobian<T, N>,
    /// `J̇ q̇` \[m/s²\].
    pub jacobian_rate: Plane<T>,
}

/// What of the equation does not depend on accelerations.
pub(crate) struct BiasAndJacobian<T, const N: usize> {
    /// `C q̇ + G` \[N m\].
    pub bias: Joints<T, N>,
    /// Rows y and z of the Jacobian of the tip \[m/rad\].
    jacobian: [[T; N]; 2],
}

impl<T: Scalar, const N: usize> BiasAndJacobian<T, N> {
    /// * `bias` - that of an arm on a base at rest; at rest itself its gravity, which has the bits of its inverse dynamics
    pub fn new(
        bias: Joints<T, N>,
        chain: &Chain<T, N>,
        (base, placement): (Option<&MovingBase<T>>, Option<&Placement<T>>),
        (pose, qd): (&Pose<T, N>, &Joints<T, N>),
    ) -> Self {
        let j = jacobian(chain, pose);
        let mut given = Self {
            bias,
            jacobian: [0, 1].map(|row| from_fn(|k| j[(row, k)])),
        };
        if let Some(base) = base {
            let still = Joints::<T, N>::repeat(T::ZERO);
            let [uy, uz] = base.per_angle;
            let [fy, fz] = joint_force(chain, pose, (qd, &still), [T::ZERO; 2])[0];
            given.bias[0] += uy * fy + uz * fz;
            given.jacobian[0][0] += uy;
            given.jacobian[1][0] += uz;
        }
        if let Some(placement) = placement {
            let [y, z] = placement.arm(pose);
            for k in 0..N {
                given.jacobian[0][k] += -z;
                given.jacobian[1][k] += y;
            }
        }
        given
    }

    /// `Jᵀ F` \[N m\].
    pub fn tip_torque(&self, force: Plane<T>) -> Joints<T, N> {
        let mut torque = Joints::<T, N>::repeat(T::ZERO);
        for k in 0..N {
            torque[k] = self.jacobian[0][k] * force[0] + self.jacobian[1][k] * force[1];
        }
        torque
    }
}

/// The inertia matrix with a base that moves with the first joint.
pub(crate) fn inertia_with_base<T: Scalar, const N: usize>(
    chain: &Chain<T, N>,
    base: Option<&MovingBase<T>>,
    pose: &Pose<T, N>,
) -> JointMatrix<T, N> {
    let mut inertia = inertia(chain, pose);
    if let Some(base) = base {
        let [uy, uz] = base.per_angle;
        let rows = first_moment_rows(chain, pose);
        for k in 0..N {
            let coupling = uy * rows[0][k] + uz * rows[1][k];
            inertia[(0, k)] += coupling;
            inertia[(k, 0)] += coupling;
        }
        inertia[(0, 0)] += base.mass * (uy.squared() + uz.squared());
    }
    inertia
}

impl<T: Scalar, const N: usize> JointSpaceEquation<T, N> {
    pub fn new(
        chain: &Chain<T, N>,
        base: Option<&MovingBase<T>>,
        placement: Option<&Placement<T>>,
        (pose, qd): (&Pose<T, N>, &Joints<T, N>),
    ) -> Self {
        let rate = jacobian_rate(chain, pose, qd);
        let bias = inverse_dynamics(chain, pose, qd, &Joints::repeat(T::ZERO));
        let mut terms = Self {
            inertia: inertia_with_base(chain, base, pose),
            given: BiasAndJacobian::new(bias, chain, (base, placement), (pose, qd)),
            jacobian_rate: [0, 1].map(|row| {
                let mut sum = T::ZERO;
                for k in 0..N {
                    sum += rate[(row, k)] * qd[k];
                }
                sum
            }),
        };
        if let Some(placement) = placement {
            let turning = placement.centripetal(pose, qd);
            for axis in 0..2 {
                terms.jacobian_rate[axis] += turning[axis];
            }
        }
        terms
    }

    /// The same with some joints held: nothing moves them, and through them nothing moves.
    pub fn holding(mut self, held: &[bool; N]) -> Self {
        for joint in (0..N).filter(|&j| held[j]) {
            for k in 0..N {
                self.inertia[(joint, k)] = T::ZERO;
                self.inertia[(k, joint)] = T::ZERO;
            }
            self.inertia[(joint, joint)] = T::ONE;
            for row in &mut self.given.jacobian {
                row[joint] = T::ZERO;
            }
        }
        self
    }

    /// `J v` \[m/s for speeds\].
    pub fn tip_rate(&self, v: &Joints<T, N>) -> Plane<T> {
        self.given.jacobian.map(|row| {
            let mut sum = T::ZERO;
            for k in 0..N {
                sum += row[k] * v[k];
            }
            sum
        })
    }

    /// `Jᵀ F` \[N m\].
    pub fn tip_torque(&self, force: Plane<T>) -> Joints<T, N> {
        self.given.tip_torque(force)
    }

    /// `B⁻¹ τ` \[rad/s²\], by a square-root-free Cholesky factorisation.
    pub fn accelerate(&self, torque: &Joints<T, N>) -> Joints<T, N> {
        let mut columns = [*torque];
        self.solve(&mut columns);
        columns[0]
    }

    /// `B⁻¹` applied to several columns at once.
    fn solve<const K: usize>(&self, columns: &mut [Joints<T, N>; K]) {
        let mut m = self.inertia;
        for k in 0..N {
            let reciprocal = T::ONE / m[(k, k)];
            for i in k + 1..N {
                let factor = m[(i, k)] * reciprocal;
                for c in i..N {
                    m[(c, i)] = m[(c, i)] - factor * m[(c, k)];
                }
                for b in columns.iter_mut() {
                    b[i] = b[i] - factor * b[k];
                }
            }
        }
        for b in columns.iter_mut() {
            for i in (0..N).rev() {
                for k in i + 1..N {
                    b[i] = b[i] - m[(k, i)] * b[k];
                }
                b[i] = b[i] / m[(i, i)];
            }
        }
    }

    /// `B⁻¹ Jᵀ (J B⁻¹ Jᵀ)⁻¹`: how the joints follow the tip with the least energy of motion, and the force for it.
    pub fn constraint(&self) -> Constraint<T, N> {
        let mut follow = self.given.jacobian.map(Joints::<T, N>::from);
        self.solve(&mut follow);
        let entry = |row: usize, column: usize| self.tip_rate(&follow[column])[row];
        let (a, b, d) = (entry(0, 0), entry(0, 1), entry(1, 1));
        let reciprocal = T::ONE / (a * d - b * b);
        Constraint {
            follow,
            apparent_mass: [
                [d * reciprocal, -(b * reciprocal)],
                [-(b * reciprocal), a * reciprocal],
            ],
        }
    }
}

/// A tip that is held in y and z.
pub(crate) struct Constraint<T, const N: usize> {
    /// Columns of `B⁻¹ Jᵀ`.
    follow: [Joints<T, N>; 2],
    /// `(J B⁻¹ Jᵀ)⁻¹` \[kg\].
    apparent_mass: [[T; 2]; 2],
}

impl<T: Scalar, const N: usize> Constraint<T, N> {
    /// Force at the tip that changes its acceleration (or with impulse and velocity, its velocity) by `change`.
    pub fn force(&self, change: Plane<T>) -> Plane<T> {
        self.apparent_mass
            .map(|[y, z]| y * change[0] + z * change[1])
    }

    /// What a force at the tip does to the joints: `B⁻¹ Jᵀ F`.
    pub fn response(&self, force: Plane<T>) -> Joints<T, N> {
        let mut v = Joints::<T, N>::repeat(T::ZERO);
        for k in 0..N {
            v[k] = self.follow[0][k] * force[0] + self.follow[1][k] * force[1];
        }
        v
    }
}
