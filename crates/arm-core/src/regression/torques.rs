//! Torques of the equation of motion at given values of the unknowns.

use core::array::from_fn;

use super::{Equation, Measured};
use crate::effect::{Motion, States};
use crate::numeric::covariance::Covariance;
use crate::numeric::scalar::Real;
use crate::{Joints, Pose, Scalar, inverse_dynamics, joints, static_torque};

impl<T: Scalar, const N: usize, const P: usize, const E: usize> Equation<T, N, P, E> {
    /// Torques that motors would need for a motion under a load \[N m\]: inertia, weight and effects, less what force and moment on
    /// the arm do. Motors that were measured are not counted.
    pub fn demanded(
        &self,
        motion: &Motion<T, N>,
        memory: &[States<T>; E],
        load: &Measured<T, N>,
    ) -> Joints<T, N> {
        let (chain, pose) = (&self.chain, Pose::new(&motion.q));
        let moving = inverse_dynamics(chain, &pose, &motion.qd, &motion.qdd);
        let resisting = self.resisting(&pose, motion, memory, load.force_on_arm);
        let pushed = static_torque(chain, &pose, load.force_on_arm, load.moment_on_arm);
        joints(from_fn(|j| moving[j] + resisting[j] - pushed[j]))
    }

    /// Torques with which the effects resist a motion \[N m\]: the values of their parameters times what each unit of them gives.
    ///
    /// * `force_on_arm` - at the tip, for friction that grows with the load; accelerations are read for it alone
    pub fn resisting(
        &self,
        pose: &Pose<T, N>,
        motion: &Motion<T, N>,
        memory: &[States<T>; E],
        force_on_arm: [T; 2],
    ) -> Joints<T, N> {
        if !self.feels_force {
            return self.resisting_unloaded(motion, memory);
        }
        self.resisting_unloaded(&self.loaded(pose, motion, force_on_arm), memory)
    }

    #[inline(never)]
    fn resisting_unloaded(&self, motion: &Motion<T, N>, memory: &[States<T>; E]) -> Joints<T, N> {
        let mut total = joints([T::ZERO; N]);
        self.each_acting(motion, memory, |effect, _, units| {
            let pairs = effect.parameters.iter().zip(units);
            let torque = pairs.fold(T::ZERO, |sum, (&value, &unit)| sum + value * unit);
            let mut add = |joint: usize, torque: T| {
                if let Some(place) = total.as_mut_slice().get_mut(joint) {
                    *place += torque;
                }
            };
            add(effect.index, torque);
            if let Some(share) = effect.share_before() {
                add(effect.index.wrapping_sub(1), share * torque);
            }
        });
        self.add_own(motion, memory, &mut total);
        total
    }
}

impl<T: Real, const N: usize, const P: usize, const E: usize> Equation<T, N, P, E> {
    /// [`Equation::carrying`] at two values of each unknown, and its standard deviations by a covariance.
    ///
    /// What is zero in the rows costs nothing, and what links have in common is added up once.
    #[inline(never)]
    pub(crate) fn carried(
        &self,
        motion: &Motion<T, N>,
        memory: &[States<T>; E],
        values: impl Fn(usize) -> [T; 2],
        covariance: &Covariance<T, P>,
    ) -> ([Joints<T, N>; 2], Joints<T, N>) {
        // The weight of a link counts in its own joint and all before.
        let weights = self.weights(&motion.q);
        let mut roots = covariance.tails(&weights.map(|[x, _]| x));
        let (mut torques, mut sums) = ([joints([T::ZERO; N]); 2], [T::ZERO; 2]);
        for (j, [x, h]) in weights.into_iter().enumerate().rev() {
            for (m, value) in values(j).into_iter().enumerate() {
                sums[m] += x * value + h;
                torques[m][j] = sums[m];
            }
        }
        self.each_acting(motion, memory, |effect, first, units| {
            if units.iter().all(|&unit| unit == T::ZERO) {
                return;
            }
            for (i, &unit) in (first..).zip(units) {
                if unit == T::ZERO {
                    continue;
                }
                let values = values(i);
                let mut act = |joint: usize, unit: T| {
                    roots.add(joint, covariance, i, unit);
                    for (torques, value) in torques.iter_mut().zip(values) {
                        if let Some(torque) = torques.as_mut_slice().get_mut(joint) {
                            *torque += unit * value;
                        }
                    }
                };
                act(effect.index, unit);
                if let Some(share) = effect.share_before() {
                    act(effect.index.wrapping_sub(1), share * unit);
                }
            }
        });
        for torque in &mut torques {
            self.add_own(motion, memory, torque);
        }
        (torques, joints(roots.deviations()))
    }
}
