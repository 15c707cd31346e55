//! Responses of a led arm to small changes, from the equation of motion linearised along one simulated run.
//!
//! A change of the rig, an effect or the handle's path leaves a torque over in the equation of motion of the run. The
//! arm answers it as a linear system with coefficients that follow the run; that system is solved implicitly, so that a
//! stiff contact and dry friction need no short steps. A hundred candidates cost less than one simulation each.
//!
//! The same scheme, with Newton's method in every step, follows a change that is not small ([`Linear::play`]): what it
//! gives is the run itself and, on top, what two coarse solutions differ by, so that their common error drops out.

use arm_core::effect::{Effect, Motion, Place, advance_states, any_state, resisting_torque};
use arm_core::{
    Chain, Contact, Joints, Placement, Plane, Pose, Reading, Scalar, Setup, inverse_dynamics,
    jacobian, joint_force, static_torque, tip,
};
use arm_sim::{HandlePath, SimulationError};
use nalgebra::SMatrix;
use std::sync::Arc;

use crate::data::session::Session;
use crate::measurement_model::hypothesis::Hypothesis;
use crate::measurement_model::prediction::{Channels, Course, smooth};

/// Steps of the solution for each sample of the trial.
const PARTS: usize = 2;
/// How far into a step its rates count: a little beyond the middle, so that fast vibrations die out.
const THETA: f64 = 0.55;

/// The refusal of a hypothesis that cannot be followed from a simulated run.
pub const ASTRAY: SimulationError = SimulationError::Setting {
    name: "angle beside the simulated run",
    found: f64::INFINITY,
    allowed: "one within 1 rad of it",
};

/// What moves a led arm, besides its own state.
struct Plant<const N: usize> {
    setup: Setup<f64, N>,
    chain: Chain<f64, N>,
    contact: Contact<f64>,
    /// Effects that resist in joints: they alone count in every step.
    resisting: Vec<Effect<f64>>,
    /// Effects that the sensors show.
    sensing: Vec<Effect<f64>>,
    /// Whether the forces through the joints count.
    feels_force: bool,
}

impl<const N: usize> Plant<N> {
    fn new(session: &Session<N>, hypothesis: &Hypothesis<N>) -> Result<Self, SimulationError> {
        let setup = session.rig(hypothesis)?;
        let (resisting, sensing): (Vec<_>, Vec<_>) = hypothesis
            .effects()
            .into_iter()
            .filter(|e| e.on)
            .map(Effect::differentiable)
            .partition(|e| e.kind.info().place == Place::Joint);
        Ok(Self {
            chain: setup.chain()?,
            contact: setup.contact,
            feels_force: setup.base_motion != [0.0; 2]
                || resisting.iter().any(|e| e.kind.feels_force()),
            setup,
            resisting,
            sensing,
        })
    }

    /// The chain as seen from its base, and how far and how fast the base has moved with the first joint.
    ///
    /// A base that is accelerated is one that stands in another gravity.
    fn based(&self, state: &State<N>) -> (Chain<f64, N>, Hand) {
        let u = self.setup.base_motion;
        if u == [0.0; 2] {
            return (self.chain, ([0.0; 2], [0.0; 2]));
        }
        let angle = state.q[0] - self.setup.base_rest;
        let mut setup = self.setup;
        for axis in 0..2 {
            setup.gravity[axis] -= u[axis] * state.qdd[0];
        }
        // The segments were accepted before, and gravity may be any.
        let chain = setup.chain().unwrap_or(self.chain);
        (chain, (u.map(|u| u * angle), u.map(|u| u * state.qd[0])))
    }

    /// The handle with the robot's ripple on it.
    fn handle(&self, time: f64, (mut at, mut rate): Hand) -> Hand {
        if self.setup.ripple != [0.0; 2] {
            let omega = core::f64::consts::TAU * self.setup.ripple_frequency;
            let (sin, cos) = Scalar::sin_cos(omega * time + self.setup.ripple_phase);
            for axis in 0..2 {
                at[axis] += self.setup.ripple[axis] * sin;
                rate[axis] += self.setup.ripple[axis] * omega * cos;
            }
        }
        (at, rate)
    }
}

/// Position and velocity of the handle.
type Hand = (Plane<f64>, Plane<f64>);

/// The arm's own state at one instant.
#[derive(Clone, Copy)]
struct State<const N: usize> {
    time: f64,
    q: Joints<f64, N>,
    qd: Joints<f64, N>,
    qdd: Joints<f64, N>,
}

impl<const N: usize> State<N> {
    /// The state with changes on it.
    fn moved(&self, q: &Joints<f64, N>, qd: &Joints<f64, N>, qdd: &Joints<f64, N>) -> Self {
        Self {
            time: self.time,
            q: self.q + q,
            qd: self.qd + qd,
            qdd: self.qdd + qdd,
        }
    }

    /// The motion as the states of effects see it.
    fn motion(&self) -> Motion<f64, N> {
        let mut motion = Motion::new(self.time, self.q, self.qd);
        motion.qdd = self.qdd;
        motion
    }
}

/// What the equation of motion says of a state.
#[derive(Clone, Copy)]
struct Balance<const N: usize> {
    /// Torque left over.
    torque: Joints<f64, N>,
    /// Force on the arm.
    force: Plane<f64>,
    /// The motion as joint effects see it.
    motion: Motion<f64, N>,
}

fn balance<const N: usize>(
    plant: &Plant<N>,
    state: &State<N>,
    hand: Hand,
    memory: &[f64],
) -> Balance<N> {
    let pose = Pose::new(&state.q);
    let (at, rate) = plant.handle(state.time, hand);
    let (chain, (shift, drift)) = plant.based(state);
    let place = tip(&chain, &pose);
    let moving = jacobian(&chain, &pose) * state.qd;
    let placement = Placement::of(&plant.setup);
    let beside = placement.map_or([0.0; 2], |p| p.arm(&pose));
    let turning = placement.map_or([0.0; 2], |p| p.velocity(&pose, &state.qd));
    let force = plant.contact.force_on_arm(
        [0, 1].map(|a| at[a] - place[a] - beside[a] - shift[a]),
        [0, 1].map(|a| rate[a] - moving[a] - turning[a] - drift[a]),
    );
    let moment = placement.map_or(0.0, |p| p.moment(&pose, force));
    let mut motion = state.motion();
    let mut torque = inverse_dynamics(&chain, &pose, &state.qd, &state.qdd)
        - static_torque(&chain, &pose, force, moment);
    if plant.feels_force {
        let through = joint_force(&chain, &pose, (&state.qd, &state.qdd), force);
        motion = motion.with_joint_force(&through);
        // The guide of a moving base carries the force through the first joint.
        let u = plant.setup.base_motion;
        torque[0] += u[0] * through[0][0] + u[1] * through[0][1];
    }
    torque += resisting_torque(&plant.resisting, &motion, memory);
    Balance {
        torque,
        force,
        motion,
    }
}

/// One run with the linear system along it.
pub struct Linear<'a, const N: usize> {
    session: &'a Session<N>,
    course: Arc<Course<N>>,
    step: f64,
    setup: Setup<f64, N>,
    states: Vec<State<N>>,
    hands: Vec<Hand>,
    /// What joint effects resist with.
    resisted: Vec<Joints<f64, N>>,
    /// What the run itself leaves over: the error of its own sampling.
    balances: Vec<Balance<N>>,
    damping: Vec<SMatrix<f64, N, N>>,
    stiffness: Vec<SMatrix<f64, N, N>>,
    /// Inverse of what multiplies the new accelerations of each step.
    inverse: Vec<SMatrix<f64, N, N>>,
    /// How the force follows angles and speeds.
    force: Vec<(SMatrix<f64, 2, N>, SMatrix<f64, 2, N>)>,
    /// Angles of the first instant for one unit of torque left over at rest.
    rest: SMatrix<f64, N, N>,
    base: Channels,
}

impl<'a, const N: usize> Linear<'a, N> {
    /// Linearises along the run of a hypothesis.
    ///
    /// # Errors
    /// [`SimulationError`] where the hypothesis cannot be simulated.
    pub fn along(
        session: &'a Session<N>,
        hypothesis: &Hypothesis<N>,
        course: &Arc<Course<N>>,
    ) -> Result<Self, SimulationError> {
        let mut plant = Plant::new(session, hypothesis)?;
        // Effects that are asked later may feel them.
        plant.feels_force = true;
        let run = session.run_finely(hypothesis, course, PARTS)?;
        let recording = run.recording();
        let step = 1.0 / course.rate / PARTS as f64;
        let at = |v: &[f64], i: usize| Joints::from_column_slice(&v[i * N..(i + 1) * N]);
        let states: Vec<State<N>> = (0..recording.len())
            .map(|i| State {
                time: i as f64 * step,
                q: at(&recording.q, i),
                qd: at(&recording.qd, i),
                qdd: at(&recording.qdd, i),
            })
            .collect();
        let hands = hands(&course.handle_path(hypothesis)?, states.len(), step);
        let count = states.len();
        let mut linear = Self {
            session,
            course: Arc::clone(course),
            step,
            balances: Vec::with_capacity(count),
            damping: Vec::with_capacity(count),
            stiffness: Vec::with_capacity(count),
            inverse: Vec::with_capacity(count),
            force: Vec::with_capacity(count),
            rest: SMatrix::zeros(),
            base: Vec::new(),
            setup: plant.setup,
            resisted: Vec::with_capacity(count),
            states,
            hands,
        };
        let memories = linear.memories(&plant);
        for i in 0..count {
            let memory = memories.get(i).map_or(&[][..], Vec::as_slice);
            linear.differentiate(&plant, i, memory);
            let motion = &linear.balances[i].motion;
            let torque = resisting_torque(&plant.resisting, motion, memory);
            linear.resisted.push(torque);
        }
        let first = linear
            .stiffness
            .first()
            .copied()
            .unwrap_or_else(SMatrix::zeros);
        linear.rest = first.try_inverse().unwrap_or_else(SMatrix::zeros);
        linear.base = linear.sensed(&plant, None);
        Ok(linear)
    }

    /// Angles \[rad\], speeds \[rad/s\] and accelerations \[rad/s²\] of the joints at a sample of the trial.
    pub fn state(&self, sample: usize) -> (Joints<f64, N>, Joints<f64, N>, Joints<f64, N>) {
        let last = self.states.len().saturating_sub(1);
        let State { q, qd, qdd, .. } = self.states[(sample * PARTS).min(last)];
        (q, qd, qdd)
    }

    /// The states of effects that have one, along the run; nothing where none has.
    fn memories(&self, plant: &Plant<N>) -> Vec<Vec<f64>> {
        if !any_state(&plant.resisting) {
            return Vec::new();
        }
        let mut now = vec![0.0; plant.resisting.len()];
        let motion = |state: &State<N>| state.motion();
        let mut out = Vec::with_capacity(self.states.len());
        for (i, state) in self.states.iter().enumerate() {
            if i > 0 {
                let before = motion(&self.states[i - 1]);
                advance_states(
                    &plant.resisting,
                    (&before, &motion(state)),
                    &mut now,
                    self.step,
                );
            }
            out.push(now.clone());
        }
        out
    }

    fn differentiate(&mut self, plant: &Plant<N>, i: usize, memory: &[f64]) {
        const ANGLE: f64 = 1e-6;
        const SPEED: f64 = 1e-5;
        let (state, hand) = (self.states[i], self.hands[i]);
        let mut mass = SMatrix::<f64, N, N>::zeros();
        let mut damping = SMatrix::<f64, N, N>::zeros();
        let mut stiffness = SMatrix::<f64, N, N>::zeros();
        let mut by_angle = SMatrix::<f64, 2, N>::zeros();
        let mut by_speed = SMatrix::<f64, 2, N>::zeros();
        let middle = balance(plant, &state, hand, memory);
        for j in 0..N {
            let mut moved = state;
            moved.qdd[j] += 1.0;
            mass.set_column(
                j,
                &(balance(plant, &moved, hand, memory).torque - middle.torque),
            );
            let both = |change: &dyn Fn(&mut State<N>, f64), size: f64| {
                let (mut up, mut down) = (state, state);
                change(&mut up, size);
                change(&mut down, -size);
                let (up, down) = (
                    balance(plant, &up, hand, memory),
                    balance(plant, &down, hand, memory),
                );
                let force = [0, 1].map(|c| (up.force[c] - down.force[c]) / (2.0 * size));
                ((up.torque - down.torque) / (2.0 * size), force)
            };
            let (torque, pull) = both(&|s, d| s.q[j] += d, ANGLE);
            stiffness.set_column(j, &torque);
            by_angle.set_column(j, &pull.into());
            let (torque, pull) = both(&|s, d| s.qd[j] += d, SPEED);
            damping.set_column(j, &torque);
            by_speed.set_column(j, &pull.into());
        }
        let h = self.step * THETA;
        let left = mass + damping * h + stiffness * (h * h);
        self.inverse
            .push(left.try_inverse().unwrap_or_else(SMatrix::zeros));
        self.damping.push(damping);
        self.stiffness.push(stiffness);
        self.force.push((by_angle, by_speed));
        self.balances.push(middle);
    }

    /// What the sensors would read more, for one unit of a change.
    ///
    /// * `changed` - the hypothesis with the change made
    /// * `size` - of the change
    /// * `moves_handle` - whether the path of the handle is another
    ///
    /// # Errors
    /// [`SimulationError`] for a rig that cannot be.
    pub fn response(
        &self,
        changed: &Hypothesis<N>,
        size: f64,
        (sensing, moves_handle): (bool, bool),
    ) -> Result<Channels, SimulationError> {
        let raw = self.response_raw(changed, size, (sensing, moves_handle))?;
        smooth(&raw, self.course.band, self.course.rate).map_err(|_| ASTRAY)
    }

    /// The same before the low-pass.
    ///
    /// # Errors
    /// As [`Linear::response`].
    pub fn response_raw(
        &self,
        changed: &Hypothesis<N>,
        size: f64,
        (sensing, moves_handle): (bool, bool),
    ) -> Result<Channels, SimulationError> {
        let plant = Plant::new(self.session, changed)?;
        let sensed = if sensing {
            self.sensed(&plant, None)
        } else {
            let own;
            let hands = if moves_handle {
                let path = self.course.handle_path(changed)?;
                own = hands(&path, self.states.len(), self.step);
                &own
            } else {
                &self.hands
            };
            let answer = self.solve(&plant, hands);
            self.sensed(&plant, Some(&answer))
        };
        let mut out = sensed;
        for (channel, base) in out.iter_mut().zip(&self.base) {
            for (value, base) in channel.iter_mut().zip(base) {
                *value = (*value - base) / size;
            }
        }
        Ok(out)
    }

    /// Changes of angles and forces along the run when another plant takes its place.
    fn solve(&self, plant: &Plant<N>, hands: &[Hand]) -> Vec<(Joints<f64, N>, Plane<f64>)> {
        let h = self.step;
        let memories = self.memories(plant);
        let (mut q, mut qd, mut qdd) = (Joints::zeros(), Joints::zeros(), Joints::zeros());
        let mut out = Vec::with_capacity(self.states.len());
        // A change of joint effects alone needs no more than their torque.
        let same_rig = plant.setup == self.setup && std::ptr::eq(hands, self.hands.as_slice());
        for i in 0..self.states.len() {
            let own = &self.balances[i];
            let memory = memories.get(i).map_or(&[][..], Vec::as_slice);
            let (push, force) = if same_rig {
                let changed = resisting_torque(&plant.resisting, &own.motion, memory);
                (self.resisted[i] - changed, own.force)
            } else {
                let changed = balance(plant, &self.states[i], hands[i], memory);
                (own.torque - changed.torque, changed.force)
            };
            if i == 0 {
                q = self.rest * push;
            } else {
                let speed = qd + qdd * (h * (1.0 - THETA));
                let angle = q + speed * (h * THETA) + qd * (h * (1.0 - THETA));
                let next =
                    self.inverse[i] * (push - self.damping[i] * speed - self.stiffness[i] * angle);
                let faster = speed + next * (h * THETA);
                q += faster * (h * THETA) + qd * (h * (1.0 - THETA));
                (qd, qdd) = (faster, next);
            }
            let (by_angle, by_speed) = &self.force[i];
            let follow = by_angle * q + by_speed * qd;
            let direct = [0, 1].map(|c| force[c] - own.force[c] + follow[c]);
            out.push((q, direct));
        }
        out
    }

    /// What the sensors would read under another hypothesis, which need not be near, on a trial of the same movement;
    /// before the low-pass.
    ///
    /// # Errors
    /// [`SimulationError`] for a rig that cannot be, and an arm that leaves the run.
    pub fn play(
        &self,
        changed: &Hypothesis<N>,
        course: &Course<N>,
    ) -> Result<Channels, SimulationError> {
        let plant = Plant::new(self.session, changed)?;
        let path = course.handle_path(changed)?;
        let hands = hands(&path, self.states.len(), self.step);
        let answer = self.follow(&plant, &hands).ok_or(ASTRAY)?;
        Ok(self.sensed(&plant, Some(&answer)))
    }

    /// Changes of angles and forces along the run when another plant takes its place, however large.
    fn follow(
        &self,
        plant: &Plant<N>,
        hands: &[Hand],
    ) -> Option<Vec<(Joints<f64, N>, Plane<f64>)>> {
        /// Changes of angle \[rad\] and speed \[rad/s\] by which slopes are told.
        const NUDGE: (f64, f64) = (1e-7, 1e-5);
        /// Steps without a solution, in percent: a contact that closes takes hold in no time.
        const UNSOLVED: usize = 3;
        /// Distance from the run at which an arm is lost \[rad\].
        const ASTRAY: f64 = 1.0;
        let h = self.step;
        let remembers = any_state(&plant.resisting);
        let mut memory = vec![0.0; if remembers { plant.resisting.len() } else { 0 }];
        let zero = Joints::<f64, N>::zeros();
        let (mut q, mut qd, mut qdd) = (zero, zero, zero);
        let mut out = Vec::with_capacity(self.states.len());
        let mut before = self.states[0].moved(&q, &qd, &qdd);
        // What the inverse slope differed by from that of the run itself in the last step.
        let mut other = SMatrix::<f64, N, N>::zeros();
        // What accelerations differed by from those that nothing pushes, in the last two steps.
        let mut pushed = [zero; 2];
        let mut unsolved = 0;
        for i in 0..self.states.len() {
            let (own, state) = (&self.balances[i], &self.states[i]);
            let found = if i == 0 {
                // At rest: the angles give way.
                let missing = |angle: &Joints<f64, N>| {
                    let moved = state.moved(angle, &zero, &zero);
                    let there = balance(plant, &moved, hands[i], &memory);
                    (own.torque - there.torque, there)
                };
                let solved = newton(zero, [&self.rest; 2], missing, NUDGE.0)?;
                q = solved.at;
                solved.there
            } else {
                let speed = qd + qdd * (h * (1.0 - THETA));
                let angle = q + speed * (h * THETA) + qd * (h * (1.0 - THETA));
                let reach = h * THETA;
                let place = |next: &Joints<f64, N>| {
                    state.moved(
                        &(angle + next * (reach * reach)),
                        &(speed + next * reach),
                        next,
                    )
                };
                let carry = |to: &State<N>, memory: &mut Vec<f64>| {
                    let motions = (&before.motion(), &to.motion());
                    advance_states(&plant.resisting, motions, memory, h);
                };
                let free =
                    -(self.inverse[i] * (self.damping[i] * speed + self.stiffness[i] * angle));
                let start = free + pushed[0] * 2.0 - pushed[1];
                // States of effects follow slowly: where the step is expected to end is near enough.
                let mut expected = memory.clone();
                if remembers {
                    carry(&place(&start), &mut expected);
                }
                let missing = |next: &Joints<f64, N>| {
                    let there = balance(plant, &place(next), hands[i], &expected);
                    (own.torque - there.torque, there)
                };
                let own = &self.inverse[i];
                let solved = newton(start, [&(own + other), own], missing, NUDGE.1 / reach)?;
                let (next, there) = (solved.at, solved.there);
                other = solved.inverse - own;
                pushed = [next - free, pushed[0]];
                unsolved += usize::from(!solved.exact);
                q = angle + next * (reach * reach);
                qd = speed + next * reach;
                qdd = next;
                if remembers {
                    carry(&place(&next), &mut memory);
                }
                there
            };
            let astray = q.iter().any(|v| !v.is_finite() || v.abs() > ASTRAY);
            if astray || unsolved > UNSOLVED * self.states.len() / 100 {
                return None;
            }
            before = state.moved(&q, &qd, &qdd);
            out.push((q, [0, 1].map(|c| found.force[c] - own.force[c])));
        }
        Some(out)
    }

    /// What the sensors read of the run with changes on it, at the samples of the trial.
    fn sensed(
        &self,
        plant: &Plant<N>,
        changes: Option<&[(Joints<f64, N>, Plane<f64>)]>,
    ) -> Channels {
        let count = self.course.raw[0].len();
        let mut channels = vec![Vec::with_capacity(count); N + 2];
        let last = self.states.len() - 1;
        let force_at = |place: f64| {
            let place = place.clamp(0.0, last as f64);
            let i = (place as usize).min(last.saturating_sub(1));
            let share = place - i as f64;
            let force = |k: usize| {
                let own = self.balances[k].force;
                let more = changes.map_or([0.0; 2], |c| c[k].1);
                [own[0] + more[0], own[1] + more[1]]
            };
            let (a, b) = (force(i), force((i + 1).min(last)));
            [0, 1].map(|c| a[c] + share * (b[c] - a[c]))
        };
        let delay = plant.setup.force_delay / self.step;
        for sample in 0..count {
            let i = (sample * PARTS).min(last);
            let mut reading = Reading::<f64, N> {
                time: i as f64 * self.step,
                q: self.states[i].q + changes.map_or_else(Joints::zeros, |c| c[i].0),
                force_on_arm: force_at(i as f64 - delay),
                moment_on_arm: 0.0,
            };
            for effect in &plant.sensing {
                effect.distort(&mut reading);
            }
            for j in 0..N {
                channels[j].push(reading.q[j]);
            }
            for c in 0..2 {
                channels[N + c].push(reading.force_on_arm[c]);
            }
        }
        channels
    }
}

/// The unknown at which nothing is missing, or as little as can be.
struct Solved<const N: usize> {
    at: Joints<f64, N>,
    there: Balance<N>,
    /// The inverse slope that led there.
    inverse: SMatrix<f64, N, N>,
    exact: bool,
}

/// Solves for the unknown at which nothing is missing; `None` where that leads beyond all numbers.
///
/// First with given inverse slopes, one after the other and corrected on the way (Broyden 1965), which is enough for what is
/// smooth or small; then with slopes of its own and shorter steps, for friction that reverses and a contact that opens.
///
/// * `missing` - the torque missing at an unknown
/// * `nudge` - a change of the unknown that tells a slope
fn newton<const N: usize>(
    start: Joints<f64, N>,
    [first, second]: [&SMatrix<f64, N, N>; 2],
    missing: impl Fn(&Joints<f64, N>) -> (Joints<f64, N>, Balance<N>),
    nudge: f64,
) -> Option<Solved<N>> {
    /// Torque that may be missing, and that is missing at most where a step finds no better \[N m\].
    const ENOUGH: (f64, f64) = (1e-7, 1e-3);
    /// Share of what is missing that a step of a good slope leaves at most.
    const GOOD: f64 = 0.3;
    const ROUNDS: usize = 30;
    const HALVINGS: usize = 6;
    let size = |r: &Joints<f64, N>| r.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    let (mut at, (mut left, mut there)) = (start, missing(&start));
    let (mut inverse, mut fallback) = (*first, (first != second).then_some(second));
    for _ in 0..ROUNDS {
        if size(&left) < ENOUGH.0 {
            break;
        }
        let step = inverse * left;
        let next = at + step;
        let (rest, balance) = missing(&next);
        if size(&rest) < GOOD * size(&left) {
            let answered = inverse * (left - rest);
            let along = step.dot(&answered);
            if along > 0.0 {
                inverse += (step - answered) * (step.transpose() * inverse) / along;
            }
            (at, left, there) = (next, rest, balance);
            continue;
        }
        if let Some(given) = fallback.take() {
            inverse = *given;
            continue;
        }
        let mut slope = SMatrix::<f64, N, N>::zeros();
        for j in 0..N {
            let mut beside = at;
            beside[j] += nudge;
            slope.set_column(j, &((left - missing(&beside).0) / nudge));
        }
        inverse = slope.try_inverse()?;
        let whole = inverse * left;
        let mut share = 1.0;
        let better = (0..HALVINGS).find_map(|_| {
            let next = at + whole * share;
            let (rest, balance) = missing(&next);
            share *= 0.5;
            (size(&rest) < size(&left)).then_some((next, rest, balance))
        });
        let Some((next, rest, balance)) = better else {
            break;
        };
        (at, left, there) = (next, rest, balance);
    }
    size(&left).is_finite().then(|| Solved {
        at,
        there,
        inverse,
        exact: size(&left) < ENOUGH.1,
    })
}

fn hands<const N: usize>(path: &HandlePath<N>, count: usize, step: f64) -> Vec<Hand> {
    let (_, end) = path.span();
    (0..count)
        .map(|i| {
            let handle = path.at((i as f64 * step).min(end));
            (handle.position, handle.velocity)
        })
        .collect()
}
