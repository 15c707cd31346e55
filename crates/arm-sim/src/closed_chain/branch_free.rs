//! A rig whose steps need no decisions.

use arm_core::{
    Chain, Contact, Joints, Lanes, Load, Plane, Pose, Products, Scalar, accelerations, tip,
    tip_velocity,
};

use crate::Handle;
use crate::closed_chain::state::{Outcome, difference, powers};

/// A rig whose steps need no decisions: its base is at rest, its tip is held by springs and dampers without play, its joints
/// have no motors, and resisting torques are linear in their motion.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BranchFree<T, const N: usize> {
    pub chain: Chain<T, N>,
    pub products: Products<T, N>,
    pub contact: Contact<T>,
    pub affine: [[T; 3]; N],
}

impl<T: Scalar, const N: usize> BranchFree<T, N> {
    /// As [`Model::evaluate`](crate::closed_chain::model::Model::evaluate), the same bits.
    ///
    /// * `pose` - at the angles `q`
    #[inline(always)]
    pub fn evaluate(
        &self,
        handle: &Handle<T>,
        pose: &Pose<T, N>,
        [q, qd]: [&Joints<T, N>; 2],
    ) -> Outcome<T, N> {
        let (still, resisting) = (Joints::<T, N>::repeat(T::ZERO), affine(&self.affine, q, qd));
        let (at, v) = (tip(&self.chain, pose), tip_velocity(&self.chain, pose, qd));
        let (gap, rate) = contact_gap(handle, at, v);
        let (force, lost) = pull(self.contact.linear(gap, rate), rate);
        let net = load(&difference(&still, &resisting), force);
        let [led, _, resisted, _] =
            powers((force, handle.velocity), [&still, &resisting], qd, lost);
        Outcome {
            qdd: accelerations(&self.products, pose, qd, &net),
            force_on_arm: force,
            power: [led, T::ZERO, resisted, lost],
            joint_force: [T::ZERO; N],
        }
    }
}

impl<const L: usize, const N: usize> BranchFree<Lanes<L>, N> {
    /// The rig of one lane.
    #[inline(always)]
    pub fn lane(&self, lane: usize) -> BranchFree<f64, N> {
        let plane = |of: &Plane<Lanes<L>>| [of[0].0[lane], of[1].0[lane]];
        BranchFree {
            chain: self.chain.lane(lane),
            products: self.products.lane(lane),
            contact: Contact {
                stiffness: plane(&self.contact.stiffness),
                damping: plane(&self.contact.damping),
                play: plane(&self.contact.play),
            },
            affine: core::array::from_fn(|i| {
                core::array::from_fn(|term| self.affine[i][term].0[lane])
            }),
        }
    }
}

/// What effects linear in the motion of their joint resist with: `constant + to_angle q + to_speed q̇`.
#[inline(always)]
pub(crate) fn affine<T: Scalar, const N: usize>(
    terms: &[[T; 3]; N],
    q: &Joints<T, N>,
    qd: &Joints<T, N>,
) -> Joints<T, N> {
    Joints::from_fn(|i, _| {
        let [constant, to_angle, to_speed] = terms[i];
        constant + to_angle * q[i] + to_speed * qd[i]
    })
}

/// Gap between the handle and a tip at `at` that moves with `v`, and its rate.
#[inline(always)]
pub(crate) fn contact_gap<T: Scalar>(
    handle: &Handle<T>,
    at: Plane<T>,
    v: Plane<T>,
) -> (Plane<T>, Plane<T>) {
    (
        [handle.position[0] - at[0], handle.position[1] - at[1]],
        [handle.velocity[0] - v[0], handle.velocity[1] - v[1]],
    )
}

/// The force of springs and dampers, and the power lost in these.
#[inline(always)]
pub(crate) fn pull<T: Scalar>([spring, damper]: [Plane<T>; 2], rate: Plane<T>) -> (Plane<T>, T) {
    (
        [spring[0] + damper[0], spring[1] + damper[1]],
        damper[0] * rate[0] + damper[1] * rate[1],
    )
}

/// Net torques of the joints and a force at the tip, without a moment.
#[inline(always)]
pub(crate) fn load<T: Scalar, const N: usize>(
    torque: &Joints<T, N>,
    force_on_arm: Plane<T>,
) -> Load<T, N> {
    Load {
        torque: *torque,
        force_on_arm,
        moment_on_arm: T::ZERO,
    }
}
