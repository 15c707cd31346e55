//! The closed chain at one instant: from state and drive to accelerations, forces and powers.

use arm_core::effect::{
    Effect, Local, Motion, States, any_state, dry_friction, resisting_besides_dry, resisting_torque,
};
use arm_core::{
    Chain, Contact, Invalid, JointMatrix, Joints, Load, Placement, Plane, Pose, Products,
    Resistance, Scalar, Setup, accelerations, gravity, joint_force, kinetic_energy,
    potential_energy, tip, tip_velocity,
};

use crate::closed_chain::branch_free::{BranchFree, affine, contact_gap, load, pull};
use crate::closed_chain::joint_space::{
    BiasAndJacobian, JointSpaceEquation, MovingBase, add_inertia, first_moment_rows,
    inertia_with_base,
};
use crate::closed_chain::state::{Input, Outcome, State, difference, powers, sum};

/// How the tip is held.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Link<T> {
    Free,
    /// A force on the arm at its tip, whatever the tip does \[N\].
    Forced(Plane<T>),
    Compliant(Contact<T>),
    Rigid,
}

/// Everything of a rig that the dynamics need; constant during a run.
#[derive(Clone, Debug)]
pub(crate) struct Model<T, const N: usize> {
    pub chain: Chain<T, N>,
    pub base: Option<MovingBase<T>>,
    /// Whether the base also moves by itself, as a function of time.
    pub heaves: bool,
    /// Whether an assistance pulls at the joints of an arm that is held.
    pub is_assisted: bool,
    /// Where the handle is, unless at the tip.
    pub placement: Option<Placement<T>>,
    pub link: Link<T>,
    /// The joint effects that are switched on.
    pub effects: Vec<Effect<T>>,
    /// Sums over those that are linear in the motion of their joint: constant, to the angle, to the speed.
    pub affine: [[T; 3]; N],
    /// Effects that are not in the sums. If one of them has states, the full list with the summed effects switched off: an index selects
    /// the states.
    others: Vec<Effect<T>>,
    /// Whether one of those resists with more than set-valued dry friction.
    resists_otherwise: bool,
    /// Whether an effect depends on the force through its joint.
    pub(crate) feels_joint_force: bool,
    /// Whether one besides dry friction does.
    pub(crate) feels_besides_dry: bool,
    /// Joints with set-valued dry friction.
    pub dry: [bool; N],
    /// Whether there is any: steps are then those of [`friction`](crate::integrators::friction).
    pub has_dry: bool,
    /// Whether some of it depends on speed.
    pub dry_falls: bool,
    /// Largest torque of it in each joint, where that is constant \[N m\].
    constant_dry: Option<[T; N]>,
    pub products: Products<T, N>,
    /// Whether an effect depends on states of its own.
    pub has_memory: bool,
}

/// Passes of the fixed-point iteration for friction that grows with the force through its joint.
const PASSES: usize = 8;

impl<T: Scalar, const N: usize> Model<T, N> {
    /// * `setup` - the rig, effects applied
    /// * `effects` - joint effects only
    pub fn new(
        setup: &Setup<T, N>,
        link: Link<T>,
        effects: Vec<Effect<T>>,
    ) -> Result<Self, Invalid> {
        let mut affine = [[T::ZERO; 3]; N];
        let mut others = effects.clone();
        for effect in &mut others {
            if let (Some(terms), Some(sums)) = (effect.affine(), affine.get_mut(effect.index)) {
                for (sum, term) in sums.iter_mut().zip(terms) {
                    *sum += term;
                }
                effect.on = false;
            }
        }
        // An effect's index selects its states, so the list may be shortened only if no effect has any.
        if !any_state(&others) {
            others.retain(|effect| effect.on);
        }
        let is_dry = |e: &&Effect<T>| has_dry_friction(e);
        let mut dry = [false; N];
        for effect in effects.iter().filter(is_dry) {
            if let Some(dry) = dry.get_mut(effect.index) {
                *dry = true;
            }
        }
        let chain = setup.chain()?;
        let feels_besides_dry = |e: &Effect<T>| !e.is_dry() && feels_joint_force(e);
        let has_dry = dry.contains(&true);
        let resists = |e: &Effect<T>| e.on && (!has_dry || resists_besides_dry(e));
        let is_constant = effects
            .iter()
            .filter(|effect| effect.is_dry())
            .all(|effect| effect.kind.is_rate_independent());
        let zero = Joints::<T, N>::repeat(T::ZERO);
        let at_rest = || dry_friction(&effects, &Motion::new(T::ZERO, zero, zero), &[]);
        Ok(Self {
            affine,
            constant_dry: is_constant.then(at_rest),
            resists_otherwise: others.iter().any(resists),
            others,
            products: Products::of(&chain),
            chain,
            base: MovingBase::of(setup),
            heaves: !setup.heave.is_still(),
            is_assisted: false,
            placement: Placement::of(setup),
            link,
            feels_joint_force: effects.iter().any(feels_joint_force),
            has_memory: any_state(&effects),
            feels_besides_dry: effects.iter().any(feels_besides_dry),
            has_dry,
            dry_falls: effects.iter().any(falls),
            dry,
            effects,
        })
    }

    /// Puts springs and dampers of an assistance in the joints; the angles that they pull towards are in the input.
    pub fn assist(&mut self, stiffness: [T; N], damping: [T; N]) {
        self.is_assisted = true;
        for (j, terms) in self.affine.iter_mut().enumerate() {
            terms[1] += stiffness[j];
            terms[2] += damping[j];
        }
    }

    /// Whether nothing in it bends or jumps: no dry friction, no play, no effect but those linear in the motion of their joint.
    pub fn is_smooth(&self) -> bool {
        let has_play = matches!(&self.link, Link::Compliant(contact) if !contact.has_no_play());
        !self.has_dry && !has_play && self.others.is_empty()
    }

    /// Whether set-valued friction is independent of speed, no effect depends on the force through a joint, and neither a rigid coupling nor
    /// a moving base adds constraints: then [`steady`](crate::integrators::friction::steady) makes most steps.
    #[inline]
    pub fn has_simple_friction(&self) -> bool {
        self.has_dry && !self.dry_falls && !self.feels_joint_force && self.in_link_form()
    }

    /// The rig, where it is a plain one.
    pub fn plain(&self) -> Option<BranchFree<T, N>> {
        match &self.link {
            Link::Compliant(contact)
                if contact.has_no_play()
                    && self.base.is_none()
                    && !self.heaves
                    && !self.is_assisted
                    && self.placement.is_none()
                    && self.others.is_empty() =>
            {
                Some(BranchFree {
                    chain: self.chain,
                    products: self.products,
                    contact: *contact,
                    affine: self.affine,
                })
            }
            _ => None,
        }
    }

    /// Position of the tip where the handle holds it \[m\].
    #[inline(always)]
    pub fn tip(&self, q: &Joints<T, N>, pose: &Pose<T, N>) -> Plane<T> {
        let mut point = tip(&self.chain, pose);
        if let Some(base) = &self.base {
            let shift = base.displacement(q);
            point = [point[0] + shift[0], point[1] + shift[1]];
        }
        if let Some(placement) = &self.placement {
            let arm = placement.arm(pose);
            point = [point[0] + arm[0], point[1] + arm[1]];
        }
        point
    }

    /// Velocity of the tip where the handle holds it \[m/s\].
    #[inline(always)]
    pub fn tip_velocity(&self, qd: &Joints<T, N>, pose: &Pose<T, N>) -> Plane<T> {
        let mut velocity = tip_velocity(&self.chain, pose, qd);
        if let Some(base) = &self.base {
            let v = base.velocity(qd);
            velocity = [velocity[0] + v[0], velocity[1] + v[1]];
        }
        if let Some(placement) = &self.placement {
            let v = placement.velocity(pose, qd);
            velocity = [velocity[0] + v[0], velocity[1] + v[1]];
        }
        velocity
    }

    /// Acceleration of the tip where the handle holds it \[m/s²\].
    pub fn tip_acceleration(&self, state: &State<T, N>, qdd: &Joints<T, N>) -> Plane<T> {
        let terms = self.terms(&Pose::new(&state.q), &state.qd);
        let (change, turning) = (terms.tip_rate(qdd), terms.jacobian_rate);
        [change[0] + turning[0], change[1] + turning[1]]
    }

    /// Kinetic and potential energy, and the energy in the springs of the contact \[J\].
    #[inline(always)]
    pub fn energy(
        &self,
        pose: &Pose<T, N>,
        (q, qd): (&Joints<T, N>, &Joints<T, N>),
        handle: Plane<T>,
    ) -> [T; 3] {
        let [kinetic, potential] = match &self.base {
            Some(base) => base.energy(&self.chain, pose, q, qd),
            None => [T::ZERO; 2],
        };
        let contact = match &self.link {
            Link::Compliant(contact) => {
                let tip = self.tip(q, pose);
                contact.energy([handle[0] - tip[0], handle[1] - tip[1]])
            }
            Link::Free | Link::Forced(_) | Link::Rigid => T::ZERO,
        };
        [
            kinetic_energy(&self.chain, pose, qd) + kinetic,
            potential_energy(&self.chain, pose) + potential,
            contact,
        ]
    }

    /// Torques of motors, and what the arm's inertia does against a base that is accelerated \[N m\].
    ///
    /// An arm on an accelerated base moves, as seen from there, as one at rest in another gravity.
    #[inline(always)]
    pub fn driving(&self, input: &Input<T, N>, pose: &Pose<T, N>) -> Joints<T, N> {
        if self.heaves {
            self.heaving(input, pose)
        } else {
            input.torque
        }
    }

    /// Apart, so that the usual case stays small.
    #[inline(never)]
    fn heaving(&self, input: &Input<T, N>, pose: &Pose<T, N>) -> Joints<T, N> {
        let rows = first_moment_rows(&self.chain, pose);
        let [y, z] = input.base.acceleration;
        let mut torque = input.torque;
        for j in 0..N {
            torque[j] -= y * rows[0][j] + z * rows[1][j];
        }
        if let Some(base) = &self.base {
            torque[0] -= base.along([y, z]);
        }
        torque
    }

    /// Sum of what all effects resist with besides dry friction \[N m\].
    #[inline(always)]
    pub fn resisting(&self, motion: &Motion<T, N>, memory: &[States<T>]) -> Joints<T, N> {
        let mut total = affine(&self.affine, &motion.q, &motion.qd);
        if self.resists_otherwise {
            self.resist_otherwise(motion, memory, &mut total);
        }
        total
    }

    /// Apart, so that the usual case stays small.
    #[inline(never)]
    fn resist_otherwise(
        &self,
        motion: &Motion<T, N>,
        memory: &[States<T>],
        total: &mut Joints<T, N>,
    ) {
        let others = if self.has_dry {
            resisting_besides_dry(&self.others, motion, memory)
        } else {
            resisting_torque(&self.others, motion, memory)
        };
        *total = sum(total, &others);
    }

    /// Largest torque of the set-valued dry friction of each joint \[N m\].
    #[inline]
    pub fn dry_friction(&self, motion: &Motion<T, N>, memory: &[States<T>]) -> [T; N] {
        match &self.constant_dry {
            Some(most) => *most,
            None => dry_friction(&self.effects, motion, memory),
        }
    }

    /// Time derivatives of the effects' own states.
    pub fn memory_rates(
        &self,
        motion: &Motion<T, N>,
        memory: &[States<T>],
        rates: &mut [States<T>],
    ) {
        for ((effect, &memory), rate) in self.effects.iter().zip(memory).zip(rates) {
            *rate = effect.memory_rate(&motion.local(effect.index, memory));
        }
    }

    /// Accelerations, contact force and powers at a state, without dry friction.
    ///
    /// Friction that depends on the force through its joint changes the motion and so that force: a fixed-point iteration of
    /// [`PASSES`] passes from the motion without it, each of which takes one more order of the friction into account.
    #[inline(always)]
    pub fn evaluate(
        &self,
        input: &Input<T, N>,
        q: &Joints<T, N>,
        qd: &Joints<T, N>,
        memory: &[States<T>],
    ) -> Outcome<T, N> {
        let pose = Pose::new(q);
        let mut motion = input.motion(q, qd);
        let mut resisting = self.resisting(&motion, memory);
        let (mut force, lost) = self.contact(input, q, qd, &pose);
        let driving = self.driving(input, &pose);
        let qdd = if self.in_link_form() && !self.feels_joint_force {
            self.forward(&pose, qd, &difference(&driving, &resisting), force)
        } else {
            self.coupled(
                (input, &driving),
                &pose,
                &mut motion,
                (memory, &mut resisting, &mut force),
            )
        };
        let v = self.velocity_of_force(input, qd, &pose);
        Outcome {
            qdd,
            force_on_arm: force,
            power: powers((force, v), [&driving, &resisting], qd, lost),
            joint_force: motion.joint_force,
        }
    }

    /// Velocity with which the force on the arm does work: that of the handle, or of the tip where the force is given \[m/s\].
    #[inline(always)]
    pub fn velocity_of_force(
        &self,
        input: &Input<T, N>,
        qd: &Joints<T, N>,
        pose: &Pose<T, N>,
    ) -> Plane<T> {
        match &self.link {
            Link::Forced(_) => self.tip_velocity(qd, pose),
            _ => input.handle.velocity,
        }
    }

    /// Accelerations where they depend on forces that depend on them; those forces, and the torques that follow them, are
    /// put in place of what they were. Apart, so that the usual case stays small.
    #[inline(never)]
    fn coupled(
        &self,
        (input, driving): (&Input<T, N>, &Joints<T, N>),
        pose: &Pose<T, N>,
        motion: &mut Motion<T, N>,
        (memory, resisting, force): (&[States<T>], &mut Joints<T, N>, &mut Plane<T>),
    ) -> Joints<T, N> {
        let qd = motion.qd;
        let terms = (!self.in_link_form()).then(|| self.terms(pose, &qd));
        let mut arm = None;
        let mut qdd = Joints::<T, N>::repeat(T::ZERO);
        for pass in 0..self.passes() {
            if pass > 0 {
                motion.joint_force = self.joint_force(pose, (&qd, &qdd), (*force, input));
                *resisting = self.resisting(motion, memory);
            }
            let torque = difference(driving, resisting);
            match &terms {
                Some(terms) => (qdd, *force) = self.accelerations(input, &torque, *force, terms),
                None => {
                    let load = self.load(pose, &torque, *force);
                    let resistance =
                        arm.get_or_insert_with(|| Resistance::at(&self.products, pose, &qd));
                    qdd = resistance.accelerations(&self.products, pose, &load);
                }
            }
        }
        qdd
    }

    /// Accelerations of an arm in link form under net torques of its joints and a force at its tip.
    #[inline(always)]
    fn forward(
        &self,
        pose: &Pose<T, N>,
        qd: &Joints<T, N>,
        torque: &Joints<T, N>,
        force_on_arm: Plane<T>,
    ) -> Joints<T, N> {
        let load = self.load(pose, torque, force_on_arm);
        accelerations(&self.products, pose, qd, &load)
    }

    /// What the joints and the handle load the arm with.
    #[inline(always)]
    pub fn load(
        &self,
        pose: &Pose<T, N>,
        torque: &Joints<T, N>,
        force_on_arm: Plane<T>,
    ) -> Load<T, N> {
        let mut load = load(torque, force_on_arm);
        if let Some(placement) = &self.placement {
            load.moment_on_arm = placement.moment(pose, force_on_arm);
        }
        load
    }

    /// Evaluations of the dynamics for one state.
    #[inline]
    pub(crate) fn passes(&self) -> usize {
        if self.feels_joint_force { PASSES } else { 1 }
    }

    /// Whether the link-form solver of the core holds the whole rig.
    #[inline]
    pub(crate) fn in_link_form(&self) -> bool {
        self.base.is_none() && !matches!(self.link, Link::Rigid)
    }

    /// Magnitudes of the forces through the joints \[N\].
    fn joint_force(
        &self,
        pose: &Pose<T, N>,
        moving: (&Joints<T, N>, &Joints<T, N>),
        outside: (Plane<T>, &Input<T, N>),
    ) -> [T; N] {
        let through = self.through_joints(pose, moving, outside);
        through.map(|[y, z]| (y.squared() + z.squared()).sqrt())
    }

    /// Forces through the joints \[N\].
    pub(crate) fn through_joints(
        &self,
        pose: &Pose<T, N>,
        (qd, qdd): (&Joints<T, N>, &Joints<T, N>),
        (force, input): (Plane<T>, &Input<T, N>),
    ) -> [Plane<T>; N] {
        let mut through = joint_force(&self.chain, pose, (qd, qdd), force);
        if let Some(base) = &self.base {
            add_inertia(&self.chain, base.velocity(qdd), &mut through);
        }
        if self.heaves {
            add_inertia(&self.chain, input.base.acceleration, &mut through);
        }
        through
    }

    /// Force of a compliant contact on the arm, and the power lost in its damping.
    #[inline(always)]
    pub fn contact(
        &self,
        input: &Input<T, N>,
        q: &Joints<T, N>,
        qd: &Joints<T, N>,
        pose: &Pose<T, N>,
    ) -> (Plane<T>, T) {
        let contact = match &self.link {
            Link::Compliant(contact) => contact,
            Link::Forced(force) => return (*force, T::ZERO),
            Link::Free | Link::Rigid => return ([T::ZERO; 2], T::ZERO),
        };
        let (at, v) = (self.tip(q, pose), self.tip_velocity(qd, pose));
        let (gap, rate) = contact_gap(&input.handle, at, v);
        pull(contact.spring_and_damper(gap, rate), rate)
    }

    /// Accelerations and the force on the arm, which for a rigid coupling follows from the constraint.
    pub(crate) fn accelerations(
        &self,
        input: &Input<T, N>,
        torque: &Joints<T, N>,
        force: Plane<T>,
        terms: &JointSpaceEquation<T, N>,
    ) -> (Joints<T, N>, Plane<T>) {
        let net = difference(torque, &terms.given.bias);
        if !matches!(self.link, Link::Rigid) {
            return (
                terms.accelerate(&sum(&net, &terms.tip_torque(force))),
                force,
            );
        }
        let free = terms.accelerate(&net);
        let (a, rate, wanted) = (
            terms.tip_rate(&free),
            terms.jacobian_rate,
            input.handle.acceleration,
        );
        let constraint = terms.constraint();
        let force = constraint.force([wanted[0] - rate[0] - a[0], wanted[1] - rate[1] - a[1]]);
        (sum(&free, &constraint.response(force)), force)
    }

    /// Brings a rigidly held tip back to position and velocity of the handle, with the least energy of motion.
    ///
    /// The position by `iterations` Newton steps, so that lanes and single runs take the same ones; the velocity exactly.
    ///
    /// * `held` - joints that friction holds meanwhile
    pub fn project(
        &self,
        input: &Input<T, N>,
        state: &mut State<T, N>,
        (iterations, held): (usize, &[bool; N]),
    ) {
        for _ in 0..iterations {
            let pose = Pose::new(&state.q);
            let terms = self.terms(&pose, &state.qd).holding(held);
            let at = self.tip(&state.q, &pose);
            let wanted = input.handle.position;
            let constraint = terms.constraint();
            let force = constraint.force([wanted[0] - at[0], wanted[1] - at[1]]);
            state.q = sum(&state.q, &constraint.response(force));
        }
        let terms = self.terms(&Pose::new(&state.q), &state.qd).holding(held);
        let (v, wanted) = (terms.tip_rate(&state.qd), input.handle.velocity);
        let constraint = terms.constraint();
        let force = constraint.force([wanted[0] - v[0], wanted[1] - v[1]]);
        state.qd = sum(&state.qd, &constraint.response(force));
    }

    /// Bias and Jacobian of the arm at rest.
    pub fn bias_and_jacobian_at_rest(&self, pose: &Pose<T, N>) -> BiasAndJacobian<T, N> {
        let attached = (self.base.as_ref(), self.placement.as_ref());
        let bias = gravity(&self.chain, pose);
        BiasAndJacobian::new(
            bias,
            &self.chain,
            attached,
            (pose, &Joints::repeat(T::ZERO)),
        )
    }

    /// The inertia matrix in joint coordinates \[kg m²\].
    pub fn inertia(&self, pose: &Pose<T, N>) -> JointMatrix<T, N> {
        inertia_with_base(&self.chain, self.base.as_ref(), pose)
    }

    /// The equation of motion in joint coordinates.
    pub fn terms(&self, pose: &Pose<T, N>, qd: &Joints<T, N>) -> JointSpaceEquation<T, N> {
        JointSpaceEquation::new(
            &self.chain,
            self.base.as_ref(),
            self.placement.as_ref(),
            (pose, qd),
        )
    }
}

/// Tries how much dry friction there is in an effect at a speed.
fn dry_at<T: Scalar>(effect: &Effect<T>, speed: f64) -> T {
    effect.dry(&Local {
        joint_force: T::ONE,
        ..Local::moving(T::ZERO, T::of(speed))
    })
}

/// Tries whether there is any dry friction in an effect.
fn has_dry_friction<T: Scalar>(effect: &Effect<T>) -> bool {
    effect.is_dry() && !dry_at(effect, 0.0).every(|most| most == 0.0)
}

/// Tries whether an effect resists with more than set-valued dry friction.
fn resists_besides_dry<T: Scalar>(effect: &Effect<T>) -> bool {
    let nothing = |q: f64| {
        let mut at = Local::moving(T::of(q), T::ONE);
        at.joint_force = T::ONE;
        effect.besides_dry(&at).every(|torque| torque == 0.0)
    };
    !(effect.is_dry() && nothing(0.1) && nothing(-0.7))
}

/// Tries whether dry friction is less at a speed than at rest.
fn falls<T: Scalar>(effect: &Effect<T>) -> bool {
    has_dry_friction(effect)
        && !(dry_at(effect, 0.1) - dry_at(effect, 0.0)).every(|change| change == 0.0)
}

/// Tries whether the force through the joint changes an effect's torque; no kind is named here.
fn feels_joint_force<T: Scalar>(effect: &Effect<T>) -> bool {
    let mut at = Local::moving(T::of(0.1), T::ONE);
    let without = effect.torque(&at);
    at.joint_force = T::ONE;
    !(effect.torque(&at) - without).every(|d| d == 0.0)
}
