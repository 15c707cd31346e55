//! The rows of the equation of motion.

use core::array::from_fn;

use super::{Equation, Measured, Needed};
use crate::dynamics::kinematics::to_links;
use crate::dynamics::regressor::link_columns;
use crate::effect::{Effect, Kind, Motion, States, UnitTorques, resisting_torque};
use crate::numeric::unroll::each;
use crate::{Joints, Pose, Scalar, joint_force, joints, static_torque};

impl<T: Scalar, const N: usize, const P: usize, const E: usize> Equation<T, N, P, E> {
    /// The torques that a motion needs.
    ///
    /// * `motion` - without joint forces: they are taken from the arm as expected and from `measured`
    /// * `memory` - the states of each effect
    pub fn needed(
        &self,
        motion: &Motion<T, N>,
        memory: &[States<T>; E],
        measured: &Measured<T, N>,
    ) -> (Needed<T, N, P>, Joints<T, N>) {
        let mut rows = Needed::none();
        let acting = self.add_needed(motion, memory, measured, &mut rows);
        (rows, acting)
    }

    /// [`Equation::needed`], into rows that hold nothing yet; what acts.
    #[inline]
    pub(crate) fn add_needed(
        &self,
        motion: &Motion<T, N>,
        memory: &[States<T>; E],
        measured: &Measured<T, N>,
        rows: &mut Needed<T, N, P>,
    ) -> Joints<T, N> {
        let pose = Pose::new(&motion.q);
        self.add_inertial(&pose, [&motion.qd, &motion.qdd], rows);
        if self.feels_force {
            let loaded = self.loaded(&pose, motion, measured.force_on_arm);
            self.add_effects(&loaded, memory, rows);
        } else {
            self.add_effects(motion, memory, rows);
        }
        let (force, moment) = (measured.force_on_arm, measured.moment_on_arm);
        let acting = static_torque(&self.chain, &pose, force, moment);
        joints(from_fn(|j| acting[j] + measured.torque[j]))
    }

    /// The torques that carry the arm: its weight, and what its effects resist with at this motion. Inertia is left out.
    pub fn carrying(&self, motion: &Motion<T, N>, memory: &[States<T>; E]) -> Needed<T, N, P> {
        let mut rows = Needed::none();
        for (k, [x, h]) in self.weights(&motion.q).into_iter().enumerate() {
            for j in 0..=k {
                rows.known[j] += h;
                if k < P {
                    rows.columns[j][k] = x;
                }
            }
        }
        self.add_effects(motion, memory, &mut rows);
        rows
    }

    /// The regressor of an arm at rest: how the weight of each link resists turning, for each unit of its first moment and by its
    /// normal one. It counts in its own joint and all before.
    #[inline(never)]
    pub(super) fn weights(&self, q: &Joints<T, N>) -> [[T; 2]; N] {
        let (pose, [gy, gz]) = (Pose::new(q), self.chain.gravity);
        from_fn(|k| {
            let (sin, cos) = (pose.sin[k], pose.cos[k]);
            [gy * sin - gz * cos, (gy * cos + gz * sin) * self.chain.h[k]]
        })
    }

    #[inline(never)]
    fn add_inertial(
        &self,
        pose: &Pose<T, N>,
        [qd, qdd]: [&Joints<T, N>; 2],
        rows: &mut Needed<T, N, P>,
    ) {
        let moving = [&to_links(qd), &to_links(qdd)];
        for j in 0..N {
            rows.known[j] = self.chain.rotor[j] * qdd[j];
        }
        // Written out: most of what a link adds is zero.
        each!(k in 0, N => {
            let [x, h, inertia] = link_columns(&self.chain, pose, moving, k);
            for (j, row) in rows.columns.iter_mut().enumerate() {
                for (place, column) in [(k, &x), (N + k, &inertia)] {
                    if let Some(place) = row.get_mut(place) {
                        *place = column[j];
                    }
                }
                rows.known[j] += h[j] * self.chain.h[k];
            }
        });
    }

    /// The motion with the forces through the joints that act on effects.
    #[inline(never)]
    pub(super) fn loaded(
        &self,
        pose: &Pose<T, N>,
        motion: &Motion<T, N>,
        force_on_arm: [T; 2],
    ) -> Motion<T, N> {
        let moving = (&motion.qd, &motion.qdd);
        motion.with_joint_force(&joint_force(&self.chain, pose, moving, force_on_arm))
    }

    #[inline(never)]
    fn add_effects(
        &self,
        motion: &Motion<T, N>,
        memory: &[States<T>; E],
        rows: &mut Needed<T, N, P>,
    ) {
        self.each_acting(motion, memory, |effect, first, units| {
            let mut write = |joint: usize, share: Option<T>| {
                let Some(row) = rows.columns.get_mut(joint) else {
                    return;
                };
                for (i, &unit) in (first..).zip(units) {
                    if let Some(place) = row.get_mut(i) {
                        *place = share.map_or(unit, |share| share * unit);
                    }
                }
            };
            write(effect.index, None);
            if let Some(share) = effect.share_before() {
                write(effect.index.wrapping_sub(1), Some(share));
            }
        });
        self.add_own(motion, memory, &mut rows.known);
    }

    /// Goes through the effects: each with the number of its first unknown, and what it resists with for each unit of that and of
    /// those after it. Of one that has fewer unknowns than others, there are zeros too, with numbers of the next.
    #[inline(always)]
    pub(super) fn each_acting(
        &self,
        motion: &Motion<T, N>,
        memory: &[States<T>; E],
        mut take: impl FnMut(&Effect<T>, usize, &UnitTorques<T>),
    ) {
        for ((effect, &first), states) in self.effects.iter().zip(&self.first).zip(memory) {
            if effect.on {
                take(effect, first.into(), &effect.unit_torques(motion, states));
            }
        }
    }

    /// Adds the torques of user-defined laws: they have no unknowns.
    #[inline]
    pub(super) fn add_own(
        &self,
        motion: &Motion<T, N>,
        memory: &[States<T>; E],
        total: &mut Joints<T, N>,
    ) {
        let own = |e: &Effect<T>| matches!(e.kind, Kind::Custom(_));
        for (effect, states) in self.effects.iter().zip(memory).filter(|(e, _)| own(e)) {
            *total += resisting_torque(core::slice::from_ref(effect), motion, &[*states]);
        }
    }
}
