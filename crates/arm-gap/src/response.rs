//! Responses of a led arm to small changes, from the equation of motion linearised along one simulated run.
//!
//! A change of the rig, an effect or the handle's path leaves a torque over in the equation of motion of the run. The
//! arm answers it as a linear system with coefficients that follow the run; that system is solved implicitly, so that a
//! stiff contact and dry friction need no short steps. A hundred candidates cost less than one simulation each.

use arm_core::effect::{Effect, Motion, resisting_torque};
use arm_core::{
    Chain, Contact, Joints, Plane, Pose, Reading, Scalar, Setup, inverse_dynamics, jacobian,
    joint_force, static_torque, tip,
};
use arm_sim::{HandlePath, SimulationError};
use nalgebra::SMatrix;

use crate::hypothesis::Hypothesis;
use crate::predict::{Channels, Course, smooth};
use crate::session::Session;

/// Steps of the solution for each sample of the trial.
const PARTS: usize = 2;
/// How far into a step its rates count: a little beyond the middle, so that fast vibrations die out.
const THETA: f64 = 0.55;

/// What moves a led arm, besides its own state.
struct Plant<const N: usize> {
    setup: Setup<f64, N>,
    chain: Chain<f64, N>,
    contact: Contact<f64>,
    effects: Vec<Effect<f64>>,
}

impl<const N: usize> Plant<N> {
    fn new(session: &Session<N>, hypothesis: &Hypothesis<N>) -> Result<Self, SimulationError> {
        let mut setup = hypothesis.setup(&session.chain, session.contact)?;
        let effects = hypothesis.effects();
        for effect in &effects {
            effect.validate(N)?;
            effect.alter(&mut setup);
        }
        Ok(Self {
            chain: setup.chain()?,
            contact: setup.contact,
            setup,
            effects,
        })
    }

    /// Whether its base stands still.
    fn stands(&self) -> bool {
        self.setup.base_motion == [0.0; 2]
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

/// The torque left over in the equation of motion, and the force on the arm.
fn balance<const N: usize>(
    plant: &Plant<N>,
    state: &State<N>,
    hand: Hand,
    memory: &[f64],
) -> (Joints<f64, N>, Plane<f64>) {
    let pose = Pose::new(&state.q);
    let (at, rate) = plant.handle(state.time, hand);
    let place = tip(&plant.chain, &pose);
    let moving = jacobian(&plant.chain, &pose) * state.qd;
    let force = plant.contact.force_on_arm(
        [at[0] - place[0], at[1] - place[1]],
        [rate[0] - moving[0], rate[1] - moving[1]],
    );
    let through = joint_force(&plant.chain, &pose, (&state.qd, &state.qdd), force);
    let mut motion = Motion::new(state.time, state.q, state.qd).with_joint_force(&through);
    motion.qdd = state.qdd;
    let torque = inverse_dynamics(&plant.chain, &pose, &state.qd, &state.qdd)
        + resisting_torque(&plant.effects, &motion, memory)
        - static_torque(&plant.chain, &pose, force, 0.0);
    (torque, force)
}

/// One run with the linear system along it.
pub struct Linear<'a, const N: usize> {
    session: &'a Session<N>,
    course: &'a Course<N>,
    step: f64,
    setup: Setup<f64, N>,
    states: Vec<State<N>>,
    hands: Vec<Hand>,
    /// The motion as joint effects see it, and what they resist with.
    resisted: Vec<(Motion<f64, N>, Joints<f64, N>)>,
    /// Torque left over and force of the run itself.
    balances: Vec<(Joints<f64, N>, Plane<f64>)>,
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
    /// Linearises along the run of a hypothesis; `None` where the arm's base moves, which this form does not know.
    ///
    /// # Errors
    /// [`SimulationError`] where the hypothesis cannot be simulated.
    pub fn along(
        session: &'a Session<N>,
        hypothesis: &Hypothesis<N>,
        course: &'a Course<N>,
    ) -> Result<Option<Self>, SimulationError> {
        let plant = Plant::new(session, hypothesis)?;
        if !plant.stands() {
            return Ok(None);
        }
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
        let memories = memories(&plant, &states, step);
        let count = states.len();
        let mut linear = Self {
            session,
            course,
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
        for i in 0..count {
            linear.differentiate(&plant, i, &memories[i]);
            let state = &linear.states[i];
            let (pose, force) = (Pose::new(&state.q), linear.balances[i].1);
            let through = joint_force(&plant.chain, &pose, (&state.qd, &state.qdd), force);
            let mut motion = Motion::new(state.time, state.q, state.qd).with_joint_force(&through);
            motion.qdd = state.qdd;
            let torque = resisting_torque(&plant.effects, &motion, &memories[i]);
            linear.resisted.push((motion, torque));
        }
        let first = linear
            .stiffness
            .first()
            .copied()
            .unwrap_or_else(SMatrix::zeros);
        linear.rest = first.try_inverse().unwrap_or_else(SMatrix::zeros);
        linear.base = linear.sensed(&plant, None);
        Ok(Some(linear))
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
        let (middle, force) = balance(plant, &state, hand, memory);
        for j in 0..N {
            let mut moved = state;
            moved.qdd[j] += 1.0;
            mass.set_column(j, &(balance(plant, &moved, hand, memory).0 - middle));
            let both = |change: &dyn Fn(&mut State<N>, f64), size: f64| {
                let (mut up, mut down) = (state, state);
                change(&mut up, size);
                change(&mut down, -size);
                let (up, down) = (
                    balance(plant, &up, hand, memory),
                    balance(plant, &down, hand, memory),
                );
                let force = [0, 1].map(|c| (up.1[c] - down.1[c]) / (2.0 * size));
                ((up.0 - down.0) / (2.0 * size), force)
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
        self.balances.push((middle, force));
    }

    /// What the sensors would read more, for one unit of a change; `None` where it reaches beyond this form.
    ///
    /// * `changed` - the hypothesis with the change made
    /// * `size` - of the change
    /// * `moves_handle` - whether the path of the handle is another
    pub fn response(
        &self,
        changed: &Hypothesis<N>,
        size: f64,
        (sensing, moves_handle): (bool, bool),
    ) -> Option<Channels> {
        let raw = self.response_raw(changed, size, (sensing, moves_handle))?;
        smooth(&raw, self.course.band, self.course.rate).ok()
    }

    /// The same before the low-pass.
    pub fn response_raw(
        &self,
        changed: &Hypothesis<N>,
        size: f64,
        (sensing, moves_handle): (bool, bool),
    ) -> Option<Channels> {
        let plant = Plant::new(self.session, changed).ok()?;
        if !plant.stands() {
            return None;
        }
        let sensed = if sensing {
            self.sensed(&plant, None)
        } else {
            let own;
            let hands = if moves_handle {
                own = hands(
                    &self.course.handle_path(changed).ok()?,
                    self.states.len(),
                    self.step,
                );
                &own
            } else {
                &self.hands
            };
            let memories = memories(&plant, &self.states, self.step);
            let answer = self.solve(&plant, hands, &memories);
            self.sensed(&plant, Some(&answer))
        };
        let mut out = sensed;
        for (channel, base) in out.iter_mut().zip(&self.base) {
            for (value, base) in channel.iter_mut().zip(base) {
                *value = (*value - base) / size;
            }
        }
        Some(out)
    }

    /// Changes of angles and forces along the run when another plant takes its place.
    fn solve(
        &self,
        plant: &Plant<N>,
        hands: &[Hand],
        memories: &[Vec<f64>],
    ) -> Vec<(Joints<f64, N>, Plane<f64>)> {
        let h = self.step;
        let (mut q, mut qd, mut qdd) = (Joints::zeros(), Joints::zeros(), Joints::zeros());
        let mut out = Vec::with_capacity(self.states.len());
        // A change of joint effects alone needs no more than their torque.
        let same_rig = plant.setup == self.setup && std::ptr::eq(hands, self.hands.as_slice());
        for i in 0..self.states.len() {
            let (own_torque, own_force) = &self.balances[i];
            let (push, force) = if same_rig {
                let (motion, torque) = &self.resisted[i];
                let changed = resisting_torque(&plant.effects, motion, &memories[i]);
                (torque - changed, *own_force)
            } else {
                let (torque, force) = balance(plant, &self.states[i], hands[i], &memories[i]);
                (own_torque - torque, force)
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
            let direct = [0, 1].map(|c| force[c] - own_force[c] + follow[c]);
            out.push((q, direct));
        }
        out
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
                let own = self.balances[k].1;
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
            for effect in &plant.effects {
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

fn hands<const N: usize>(path: &HandlePath<N>, count: usize, step: f64) -> Vec<Hand> {
    let (_, end) = path.span();
    (0..count)
        .map(|i| {
            let handle = path.at((i as f64 * step).min(end));
            (handle.position, handle.velocity)
        })
        .collect()
}

/// The states of effects that have one, along a motion; one list for each instant.
fn memories<const N: usize>(plant: &Plant<N>, states: &[State<N>], step: f64) -> Vec<Vec<f64>> {
    let mut memory = vec![0.0; plant.effects.len()];
    if !plant.effects.iter().any(|e| e.kind.info().memory) {
        return vec![memory; states.len()];
    }
    states
        .iter()
        .map(|state| {
            let now = memory.clone();
            let motion = Motion::new(state.time, state.q, state.qd);
            for (effect, value) in plant.effects.iter().zip(&mut memory) {
                if effect.kind.info().memory {
                    // Two half steps keep quick states stable.
                    for _ in 0..2 {
                        let local = motion.local(effect.index, *value);
                        *value += effect.memory_rate(&local) * step * 0.5;
                    }
                }
            }
            now
        })
        .collect()
}
