//! Dry friction at one instant: the joints that stick, and the friction torques.

use arm_core::effect::{Motion, States, dry_friction_of};
use arm_core::{Joints, Plane, Pose, Resistance, Scalar};

use super::gain::{newton, strongest};
use super::hold::hold;
use crate::closed_chain::joint_space::{Constraint, JointSpaceEquation};
use crate::closed_chain::model::{Link, Model};
use crate::closed_chain::state::{Input, Outcome, difference, powers, sum};

/// The mode of dry friction in a joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Mode {
    /// There is none.
    None,
    /// It resists with its largest torque against this direction, 1 or −1. Zero for a joint at rest that is held by something
    /// other than friction.
    Slips(f64),
    /// It holds the joint.
    Sticks,
}

/// The mode of each joint.
pub(crate) type Modes<const N: usize> = [Mode; N];

/// What follows from state and input with friction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Solved<const N: usize> {
    pub outcome: Outcome<f64, N>,
    pub dry: Friction<f64, N>,
    /// The joints that stick.
    pub held: [bool; N],
    /// Joint in which the friction has no unique solution, and its loop gain.
    pub ambiguous_friction: Option<(usize, f64)>,
}

/// Dry friction of all joints.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Friction<T, const N: usize> {
    /// Torque with which it resists \[N m\].
    pub torque: Joints<T, N>,
    /// Most that it could be \[N m\].
    pub most: [T; N],
}

impl<T: Scalar, const N: usize> Friction<T, N> {
    /// The torque of one of several effects in a joint, by what each could be at most \[N m\].
    pub fn share(&self, joint: usize, most: T) -> T {
        match (self.torque.get(joint), self.most.get(joint)) {
            (Some(&torque), Some(&all)) => T::if_less(T::ZERO, all, torque * (most / all), T::ZERO),
            _ => T::ZERO,
        }
    }
}

/// Share by which a torque may exceed the largest friction by rounding.
const ROUNDING: f64 = 1e-10;
/// Speed of a rigidly led joint that is rounding \[rad/s\].
const LED_STILL: f64 = 1e-9;
/// Acceleration of a rigidly led joint that is rounding \[rad/s²\].
const LED_STEADY: f64 = 1e-6;
/// Passes of Newton's method for friction that grows with the joint force.
const PASSES: usize = 30;
/// Determinant of one less the gain of that friction below which it has no unique solution.
const SINGLE: f64 = 0.02;
/// Changes of one mode each in which the modes of all joints are found.
const CHANGES: usize = 64;

/// What follows from state and input: outcome, and the friction in it.
pub(crate) fn at<const N: usize>(
    model: &Model<f64, N>,
    input: &Input<f64, N>,
    moving: (&Joints<f64, N>, &Joints<f64, N>),
    memory: &[States<f64>],
) -> (Outcome<f64, N>, Option<Friction<f64, N>>) {
    if !model.has_dry {
        return (model.evaluate(input, moving.0, moving.1, memory), None);
    }
    let (_, solved) = Arm::at(model, input, moving).modes(memory, None);
    (solved.outcome, Some(solved.dry))
}

/// How far what holds a joint is from the most that it can be, as a share of that.
#[inline(always)]
pub(crate) fn reserve<T: Scalar, const N: usize>(dry: &Friction<T, N>, joint: usize) -> T {
    let (most, held) = (dry.most[joint], dry.torque[joint].abs());
    let share = || T::ONE + T::of(ROUNDING) - held / most;
    T::where_less(T::ZERO, most, share, || -held)
}

/// Derivative of a joint's friction to the force through it \[m\].
///
/// * `now` - its friction \[N m\]
fn slope<const N: usize>(
    model: &Model<f64, N>,
    motion: &Motion<f64, N>,
    memory: &[States<f64>],
    (joint, now): (usize, f64),
) -> f64 {
    let change = 1e-3 * (1.0 + motion.joint_force[joint]);
    let mut beside = *motion;
    beside.joint_force[joint] += change;
    (dry_friction_of(joint, &model.effects, &beside, memory) - now) / change
}

/// Accelerations, and the force on the arm that belongs to them.
#[derive(Clone, Copy, Debug)]
struct Response<const N: usize> {
    qdd: Joints<f64, N>,
    force: Plane<f64>,
}

impl<const N: usize> Response<N> {
    /// Less a multiple of another one.
    fn less(&mut self, factor: f64, other: &Self) {
        for i in 0..N {
            self.qdd[i] -= factor * other.qdd[i];
        }
        for axis in 0..2 {
            self.force[axis] -= factor * other.force[axis];
        }
    }
}

/// An arm in one state, for which accelerations are computed with any friction and any torques.
pub(crate) struct Arm<'a, const N: usize> {
    model: &'a Model<f64, N>,
    input: &'a Input<f64, N>,
    /// Without joint forces.
    motion: Motion<f64, N>,
    pose: Pose<f64, N>,
    /// Of a compliant contact, and the power lost in it.
    contact: (Plane<f64>, f64),
    driving: Joints<f64, N>,
    form: Form<N>,
}

enum Form<const N: usize> {
    Links(Resistance<f64, N>),
    Joints(JointSpaceEquation<f64, N>, Option<Constraint<f64, N>>),
}

impl<const N: usize> Form<N> {
    #[inline(always)]
    fn at(model: &Model<f64, N>, pose: &Pose<f64, N>, qd: &Joints<f64, N>) -> Self {
        if model.in_link_form() {
            return Self::Links(Resistance::at(&model.products, pose, qd));
        }
        let terms = model.terms(pose, qd);
        let constraint = matches!(model.link, Link::Rigid).then(|| terms.constraint());
        Self::Joints(terms, constraint)
    }
}

impl<'a, const N: usize> Arm<'a, N> {
    #[inline(always)]
    pub(crate) fn at(
        model: &'a Model<f64, N>,
        input: &'a Input<f64, N>,
        (q, qd): (&Joints<f64, N>, &Joints<f64, N>),
    ) -> Self {
        let pose = Pose::new(q);
        Self {
            model,
            input,
            motion: input.motion(q, qd),
            contact: model.contact(input, q, qd, &pose),
            driving: model.driving(input, &pose),
            form: Form::at(model, &pose, qd),
            pose,
        }
    }

    /// Finds the mode of each joint, and the response.
    ///
    /// A joint that moves slips. The modes of joints at rest solve a linear complementarity problem in their accelerations: each sticks
    /// within what holds it, or slips the way in which it is accelerated. With `ahead` \[s\] it is one of all joints, in their
    /// speeds after that time. Starting from all of them sticking, the first that violates its conditions changes its mode, until none is left: Murty's
    /// principal pivoting, which ends where the inertia matrix is positive definite.
    pub(crate) fn modes(
        &self,
        memory: &[States<f64>],
        ahead: Option<f64>,
    ) -> (Modes<N>, Solved<N>) {
        let (model, qd) = (self.model, &self.motion.qd);
        let led = matches!(model.link, Link::Rigid);
        let rests = |j: usize| qd[j] == 0.0 || (led && qd[j].abs() < LED_STILL);
        let open: [bool; N] =
            core::array::from_fn(|j| model.dry[j] && (ahead.is_some() || rests(j)));
        let mut modes: Modes<N> = core::array::from_fn(|j| match (model.dry[j], open[j]) {
            (false, _) => Mode::None,
            (true, true) => Mode::Sticks,
            (true, false) => Mode::Slips(qd[j].signum()),
        });
        let speed = |j: usize| ahead.map_or(0.0, |h| qd[j] / h);
        let mut solved = self.solve(memory, (&modes, ahead));
        for _ in 0..CHANGES {
            if solved.ambiguous_friction.is_some() {
                return (modes, solved);
            }
            let other = |j: usize| match modes[j] {
                Mode::Sticks if !solved.held[j] => {
                    let rate = solved.outcome.qdd[j] + speed(j);
                    let steady = rate.abs() < LED_STEADY;
                    Some(Mode::Slips(if steady { 0.0 } else { rate.signum() }))
                }
                Mode::Sticks if reserve(&solved.dry, j) < 0.0 => {
                    Some(Mode::Slips(solved.dry.torque[j].signum()))
                }
                Mode::Slips(way) if way * (solved.outcome.qdd[j] + speed(j)) < 0.0 => {
                    Some(Mode::Sticks)
                }
                _ => None,
            };
            let Some((joint, mode)) = (0..N)
                .filter(|&j| open[j])
                .find_map(|j| other(j).map(|m| (j, m)))
            else {
                if model.feels_joint_force {
                    solved.ambiguous_friction = self.ambiguous(memory, (&modes, &solved));
                }
                return (modes, solved);
            };
            modes[joint] = mode;
            solved = self.solve(memory, (&modes, ahead));
        }
        // Where friction does not grow with the joint force, only rounding prevents a solution: either mode is right.
        if model.feels_joint_force {
            solved.ambiguous_friction = (0..N).find(|&j| open[j]).map(|j| (j, f64::INFINITY));
        }
        (modes, solved)
    }

    /// Joint whose friction may have several solutions, and its largest loop gain.
    ///
    /// With a joint force that is linear in the friction, `λ = ±μ |F₀ + λ f|` has one solution for each sign if `μ |f| < 1`. Beyond
    /// that it has two or none, and whether the joint sticks or slips does not follow from the law (Painlevé 1895).
    fn ambiguous(
        &self,
        memory: &[States<f64>],
        (modes, solved): (&Modes<N>, &Solved<N>),
    ) -> Option<(usize, f64)> {
        let model = self.model;
        let response = Response {
            qdd: solved.outcome.qdd,
            force: solved.outcome.force_on_arm,
        };
        let through = self.through_joints(&response);
        let motion = self.motion.with_joint_force(&through);
        let most = model.dry_friction(&motion, memory);
        let gain = |j: usize| {
            let slope = slope(model, &motion, memory, (j, most[j]));
            if slope == 0.0 {
                return 0.0;
            }
            let others = core::array::from_fn(|k| k != j && modes[k] == Mode::Sticks);
            let then = self.with_less(j, &response, &others);
            let [y, z] = [0, 1].map(|axis| then[j][axis] - through[j][axis]);
            slope * (y * y + z * z).sqrt()
        };
        (0..N)
            .filter(|&j| modes[j] != Mode::None)
            .map(|j| (j, gain(j)))
            .find(|(_, gain)| *gain >= 1.0 - SINGLE)
    }

    /// What follows from modes.
    ///
    /// * `ahead` - time after which joints that stick rest \[s\]; `None` for those that rest already
    #[inline(always)]
    pub(crate) fn solve(
        &self,
        memory: &[States<f64>],
        (modes, ahead): (&Modes<N>, Option<f64>),
    ) -> Solved<N> {
        let (model, qd) = (self.model, &self.motion.qd);
        let mut motion = self.motion;
        let rubbing = Rubbing {
            modes,
            wanted: ahead.map_or_else(Joints::zeros, |h| qd / h),
            memory,
        };
        let driving = &self.driving;
        let mut resisting = model.resisting(&motion, memory);
        let mut found = rubbing.under(self, &mut motion, &difference(driving, &resisting));
        if model.feels_besides_dry {
            for _ in 1..model.passes() {
                resisting = model.resisting(&motion, memory);
                found = rubbing.under(self, &mut motion, &difference(driving, &resisting));
            }
        }
        let v = model.velocity_of_force(self.input, qd, &self.pose);
        let all = sum(&resisting, &found.dry);
        let lost = self.contact.1;
        Solved {
            outcome: Outcome {
                qdd: found.response.qdd,
                force_on_arm: found.response.force,
                power: powers((found.response.force, v), [driving, &all], qd, lost),
                joint_force: motion.joint_force,
            },
            dry: Friction {
                torque: found.dry,
                most: found.most,
            },
            held: found.held,
            ambiguous_friction: found.ambiguous_friction,
        }
    }

    /// The same motion with other speeds.
    pub(super) fn motion_at(&self, speeds: Joints<f64, N>) -> Motion<f64, N> {
        Motion {
            qd: speeds,
            ..self.motion
        }
    }

    /// Acceleration of each joint per newton metre in it, at any speed \[rad/(s² N m)\].
    pub(super) fn yielding(&self) -> [f64; N] {
        core::array::from_fn(|j| self.column(j).0.qdd[j])
    }

    /// Forces through the joints \[N\].
    fn through_joints(&self, response: &Response<N>) -> [Plane<f64>; N] {
        let moving = (&self.motion.qd, &response.qdd);
        self.model
            .through_joints(&self.pose, moving, (response.force, self.input))
    }

    #[inline(always)]
    fn under(&self, torque: &Joints<f64, N>) -> Response<N> {
        let (qdd, force) = match &self.form {
            Form::Links(resistance) => {
                let force = self.contact.0;
                let load = self.model.load(&self.pose, torque, force);
                let qdd = resistance.accelerations(&self.model.products, &self.pose, &load);
                (qdd, force)
            }
            Form::Joints(terms, _) => {
                self.model
                    .accelerations(self.input, torque, self.contact.0, terms)
            }
        };
        Response { qdd, force }
    }

    /// What one newton metre in a joint adds, and what it would give way by if nothing held the tip.
    fn column(&self, joint: usize) -> (Response<N>, f64) {
        let (free, constraint) = match &self.form {
            Form::Links(resistance) => (resistance.column(joint), None),
            Form::Joints(terms, constraint) => {
                let mut unit = Joints::<f64, N>::zeros();
                unit[joint] = 1.0;
                let free = terms.accelerate(&unit);
                (
                    free,
                    constraint.as_ref().map(|c| (c, terms.tip_rate(&free))),
                )
            }
        };
        let mut response = Response {
            qdd: free,
            force: [0.0; 2],
        };
        if let Some((constraint, [y, z])) = constraint {
            response.force = constraint.force([-y, -z]);
            response.qdd = sum(&free, &constraint.response(response.force));
        }
        (response, free[joint])
    }

    /// Forces through the joints with one newton metre less in a joint, while others stick \[N\].
    fn with_less(
        &self,
        joint: usize,
        response: &Response<N>,
        sticks: &[bool; N],
    ) -> [Plane<f64>; N] {
        let (mut column, _) = self.column(joint);
        self.hold(&mut column, sticks, &Joints::zeros());
        let mut less = *response;
        less.less(1.0, &column);
        self.through_joints(&less)
    }

    /// Subtracts the torques of joints that stick from a response, so that these joints have the required accelerations.
    ///
    /// Returns their torques, and which of them stick: not those that nothing but the handle moves.
    fn hold(
        &self,
        response: &mut Response<N>,
        sticks: &[bool; N],
        wanted: &Joints<f64, N>,
    ) -> (Joints<f64, N>, [bool; N]) {
        let still = Response {
            qdd: Joints::zeros(),
            force: [0.0; 2],
        };
        let (mut columns, mut own) = ([still; N], [0.0; N]);
        for k in (0..N).filter(|&k| sticks[k]) {
            (columns[k], own[k]) = self.column(k);
        }
        let left = core::array::from_fn(|k| response.qdd[k] - wanted[k]);
        let accelerations = columns.map(|column| column.qdd);
        let (torque, held) = hold(&accelerations, &own, left, &sticks.map(f64::from));
        let held = held.map(|held| held > 0.0);
        for k in (0..N).filter(|&k| held[k]) {
            response.less(torque[k], &columns[k]);
        }
        for k in (0..N).filter(|&k| held[k]) {
            response.qdd[k] = wanted[k];
        }
        (torque, held)
    }
}

/// Friction at one instant, and the required accelerations of joints that stick.
struct Rubbing<'a, const N: usize> {
    modes: &'a Modes<N>,
    /// Speeds that joints lose in a second, where they are to rest after a time \[rad/s²\].
    wanted: Joints<f64, N>,
    memory: &'a [States<f64>],
}

/// What follows with friction.
struct Found<const N: usize> {
    response: Response<N>,
    dry: Joints<f64, N>,
    most: [f64; N],
    held: [bool; N],
    ambiguous_friction: Option<(usize, f64)>,
}

impl<const N: usize> Rubbing<'_, N> {
    /// The response to given torques besides friction; joint forces are written into the motion where an effect depends on them.
    #[inline(always)]
    fn under(
        &self,
        arm: &Arm<'_, N>,
        motion: &mut Motion<f64, N>,
        net: &Joints<f64, N>,
    ) -> Found<N> {
        let most = arm.model.dry_friction(motion, self.memory);
        if arm.model.feels_joint_force {
            return self.with_joint_forces(arm, motion, net, most);
        }
        let slips = Joints::<f64, N>::from_fn(|j, _| self.way(j) * most[j]);
        let mut response = arm.under(&difference(net, &slips));
        let sticks = self.modes.map(|mode| mode == Mode::Sticks);
        let (mut dry, mut held) = (Joints::zeros(), [false; N]);
        if sticks.contains(&true) {
            (dry, held) = arm.hold(&mut response, &sticks, &self.wanted.map(|w| -w));
        }
        Found {
            response,
            dry: sum(&dry, &slips),
            most,
            held,
            ambiguous_friction: None,
        }
    }

    /// Direction in which a joint slips; zero for one that does not.
    fn way(&self, joint: usize) -> f64 {
        match self.modes[joint] {
            Mode::Slips(way) => way,
            Mode::None | Mode::Sticks => 0.0,
        }
    }

    /// What follows where friction grows with the force through its joint, which grows with friction: by Newton's method.
    ///
    /// * `most` - dry friction without those forces
    #[inline(never)]
    fn with_joint_forces(
        &self,
        arm: &Arm<'_, N>,
        motion: &mut Motion<f64, N>,
        net: &Joints<f64, N>,
        mut most: [f64; N],
    ) -> Found<N> {
        let (model, modes) = (arm.model, self.modes);
        let sticks = modes.map(|mode| mode == Mode::Sticks);
        let any = sticks.contains(&true);
        let stop = self.wanted.map(|w| -w);
        let mut slips = Joints::<f64, N>::from_fn(|j, _| self.way(j) * most[j]);
        let (mut ambiguous_friction, mut settled) = (None, false);
        for _ in 0..PASSES {
            let mut response = arm.under(&difference(net, &slips));
            let (mut dry, mut held) = (Joints::zeros(), [false; N]);
            if any {
                (dry, held) = arm.hold(&mut response, &sticks, &stop);
            }
            let found = |most, ambiguous_friction| Found {
                response,
                dry: sum(&dry, &slips),
                most,
                held,
                ambiguous_friction,
            };
            if settled {
                return found(most, ambiguous_friction);
            }
            let through = arm.through_joints(&response);
            *motion = motion.with_joint_force(&through);
            most = model.dry_friction(motion, self.memory);
            let missing = Joints::<f64, N>::from_fn(|j, _| self.way(j) * most[j] - slips[j]);
            let size = 1.0 + slips.amax();
            // A state that is not finite is reported elsewhere.
            let lost = !missing.iter().all(|m| m.is_finite());
            if ambiguous_friction.is_some() || lost || missing.amax() <= 1e-12 * size {
                return found(most, ambiguous_friction);
            }
            let gains = self.gains(arm, motion, (&response, &through, &most), &sticks);
            let (change, determinant) = newton(&gains, &missing);
            if determinant <= SINGLE {
                ambiguous_friction = Some(strongest(&gains));
                settled = true;
            }
            slips += change;
        }
        ambiguous_friction = Some((0, f64::INFINITY));
        let mut response = arm.under(&difference(net, &slips));
        let (dry, held) = arm.hold(&mut response, &sticks, &stop);
        Found {
            response,
            dry: sum(&dry, &slips),
            most,
            held,
            ambiguous_friction,
        }
    }

    /// What a newton metre of friction in each slipping joint adds to the friction of each, through the joint forces.
    fn gains(
        &self,
        arm: &Arm<'_, N>,
        motion: &Motion<f64, N>,
        (response, through, most): (&Response<N>, &[Plane<f64>; N], &[f64; N]),
        sticks: &[bool; N],
    ) -> [[f64; N]; N] {
        let model = arm.model;
        let mut slopes = [0.0; N];
        for (j, gain) in slopes.iter_mut().enumerate() {
            let Mode::Slips(way) = self.modes[j] else {
                continue;
            };
            *gain = way * slope(model, motion, self.memory, (j, most[j]));
        }
        let mut gains = [[0.0; N]; N];
        for k in 0..N {
            if !matches!(self.modes[k], Mode::Slips(way) if way != 0.0) {
                continue;
            }
            let then = arm.with_less(k, response, sticks);
            for j in 0..N {
                let [y, z] = through[j];
                let size = motion.joint_force[j];
                if size > 0.0 {
                    let along = (y * (then[j][0] - y) + z * (then[j][1] - z)) / size;
                    gains[j][k] = slopes[j] * along;
                }
            }
        }
        gains
    }
}
