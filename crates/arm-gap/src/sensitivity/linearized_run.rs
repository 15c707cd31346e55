//! Responses of a led arm to small changes, from the equation of motion linearised along one simulated run.
//!
//! A change of the rig, an effect or the handle's path leaves a torque over in the equation of motion of the run. The
//! arm answers it as a linear system with coefficients that follow the run ([`Slopes`]). A joint that set-valued friction holds in the
//! run does not answer, and one that slips does so against its friction. A hundred candidates cost less than one simulation each.

use arm_core::effect::{
    Effect, MAX_STATES, States, advance_states, any_state, dry_friction, resisting_besides_dry,
};
use arm_core::{Joints, Plane, Reading, Setup};
use arm_sim::{Change, SimulationError, Slopes, cubic_weights};
use nalgebra::SMatrix;
use std::sync::Arc;

use crate::data::session::Session;
use crate::measurement_model::hypothesis::Hypothesis;
use crate::measurement_model::prediction::{Channels, Course, smooth};
use crate::measurement_model::start::held_at_start;
use crate::sensitivity::plant::{Balance, Hand, Plant, State, balance, hands};
use crate::sensitivity::sliding::Mode;

/// The instants at which a run is recorded and solved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Grid {
    /// Records for each sample of the trial.
    parts: usize,
    /// Records for each step of the solution.
    stride: usize,
}

impl Grid {
    /// Steps a second at least: movements and the band in which they are compared ask for no more, however fast one samples.
    const RATE: f64 = 100.0;

    fn of(rate: f64) -> Self {
        match rate < Self::RATE {
            true => Self {
                parts: libm::ceil(Self::RATE / rate) as usize,
                stride: 1,
            },
            false => Self {
                parts: 1,
                stride: (rate / Self::RATE) as usize,
            },
        }
    }
}

/// The refusal of a hypothesis that cannot be followed from a simulated run.
pub const ASTRAY: SimulationError = SimulationError::Setting {
    name: "angle beside the simulated run",
    found: f64::INFINITY,
    allowed: "one within 1 rad of it",
};

/// One run with the linear system along it.
pub struct Linear<'a, const N: usize> {
    pub(super) session: &'a Session<N>,
    pub(super) course: Arc<Course<N>>,
    grid: Grid,
    /// Length of a step of the solution \[s\].
    pub(super) step: f64,
    setup: Setup<f64, N>,
    /// Effects that resist in joints.
    resisting: Vec<Effect<f64>>,
    /// Effects that the sensors show.
    sensing: Vec<Effect<f64>>,
    /// The run at every record.
    records: Vec<State<N>>,
    /// Force on the arm at every record.
    recorded_force: Vec<Plane<f64>>,
    /// The same as the sensor of the run shows it at the samples of the trial, without its errors.
    delayed_force: Vec<Plane<f64>>,
    /// The run at every step.
    pub(super) states: Vec<State<N>>,
    pub(super) hands: Vec<Hand>,
    /// Whether some joint has dry friction that is set-valued.
    pub(super) dry: bool,
    /// Direction in which each joint slips, 0 for none.
    ways: Vec<Joints<f64, N>>,
    pub(super) balances: Vec<Balance<N>>,
    /// How what is left over and the force follow the motion in each step.
    pub(super) slopes: Vec<Slopes<N>>,
    /// The inverse of what multiplies new accelerations, for the joints that friction does not hold.
    pub(super) inverse: Vec<SMatrix<f64, N, N>>,
    /// Which joints friction holds.
    held: Vec<[bool; N]>,
    /// Angles of the first instant for one unit of torque left over at rest.
    pub(super) rest: SMatrix<f64, N, N>,
    /// Where it starts: the angles that are measured, and what dry friction resists with where the handle places a joint.
    start: (Joints<f64, N>, Joints<f64, N>),
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
        let mut plant = Plant::new(session, hypothesis, &course.rhythms)?;
        // Effects that are asked later may feel them.
        plant.feels_force = true;
        let grid = Grid::of(course.rate);
        let run = session.run_finely(hypothesis, course, grid.parts)?;
        let recording = run.recording();
        let interval = 1.0 / course.rate / grid.parts as f64;
        let at = |v: &[f64], i: usize| Joints::from_column_slice(&v[i * N..(i + 1) * N]);
        let records: Vec<State<N>> = (0..recording.len())
            .map(|i| State {
                time: i as f64 * interval,
                q: at(&recording.q, i),
                qd: at(&recording.qd, i),
                qdd: at(&recording.qdd, i),
            })
            .collect();
        let mut linear = Self {
            session,
            course: Arc::clone(course),
            grid,
            step: interval * grid.stride as f64,
            setup: plant.setup,
            dry: plant.dry,
            resisting: Vec::new(),
            sensing: Vec::new(),
            recorded_force: Vec::with_capacity(records.len()),
            delayed_force: Vec::new(),
            states: records.iter().step_by(grid.stride).copied().collect(),
            records,
            hands: Vec::new(),
            ways: Vec::new(),
            balances: Vec::new(),
            slopes: Vec::new(),
            inverse: Vec::new(),
            held: Vec::new(),
            rest: SMatrix::zeros(),
            start: (
                course.start(hypothesis),
                session.friction_at_start(hypothesis, course)?,
            ),
            base: Vec::new(),
        };
        let every = hands(course, hypothesis, (linear.records.len(), interval))?;
        for (record, hand) in std::iter::zip(&linear.records, &every) {
            let force = balance(&plant, record, *hand, &[]).force;
            linear.recorded_force.push(force);
        }
        linear.hands = every.into_iter().step_by(grid.stride).collect();
        linear.delayed_force = linear.force_after(plant.setup.force_delay);
        let memories = linear.memories(&plant.resisting);
        for i in 0..linear.states.len() {
            let memory = memories.get(i).map_or(&[][..], Vec::as_slice);
            linear.differentiate(&plant, i, memory);
        }
        linear.rest = linear.slopes.first().map_or_else(SMatrix::zeros, |slopes| {
            inverse_of_free(
                &slopes.stiffness,
                &held_at_start(&linear.balances[0].friction),
            )
        });
        linear.base = linear.sensed(&plant, None, 0);
        (linear.resisting, linear.sensing) = (plant.resisting, plant.sensing);
        Ok(linear)
    }

    /// What the sensors would read of the run itself, in the common band.
    ///
    /// # Errors
    /// [`SimulationError`] for a channel that is not finite.
    pub fn shown(&self) -> Result<Channels, SimulationError> {
        smooth(&self.base, self.course.band, self.course.rate).map_err(|_| ASTRAY)
    }

    /// Angles \[rad\], speeds \[rad/s\] and accelerations \[rad/s²\] of the joints at a sample of the trial.
    pub fn state(&self, sample: usize) -> (Joints<f64, N>, Joints<f64, N>, Joints<f64, N>) {
        let last = self.records.len().saturating_sub(1);
        let State { q, qd, qdd, .. } = self.records[(sample * self.grid.parts).min(last)];
        (q, qd, qdd)
    }

    /// The states of effects that have one, along the run; nothing where none has.
    fn memories(&self, effects: &[Effect<f64>]) -> Vec<Vec<States<f64>>> {
        if !any_state(effects) {
            return Vec::new();
        }
        let mut now = vec![[0.0; MAX_STATES]; effects.len()];
        let motion = |state: &State<N>| state.motion();
        let mut out = Vec::with_capacity(self.states.len());
        for (i, state) in self.states.iter().enumerate() {
            if i > 0 {
                let before = motion(&self.states[i - 1]);
                advance_states(effects, (&before, &motion(state)), &mut now, self.step);
            }
            out.push(now.clone());
        }
        out
    }

    fn differentiate(&mut self, plant: &Plant<N>, i: usize, memory: &[States<f64>]) {
        let (state, hand) = (self.states[i], self.hands[i]);
        let middle = balance(plant, &state, hand, memory);
        let way = Joints::from_fn(|j, _| Mode::of(state.qd[j]).way());
        let held: [bool; N] = std::array::from_fn(|j| middle.friction[j] > 0.0 && way[j] == 0.0);
        let left_over = |there: &Balance<N>| there.torque + there.friction.component_mul(&way);
        let at = [state.q, state.qd, state.qdd];
        let slopes = Slopes::around(at, &left_over(&middle), |q, qd, qdd| {
            let (time, q, qd, qdd) = (state.time, *q, *qd, *qdd);
            let there = balance(plant, &State { time, q, qd, qdd }, hand, memory);
            (left_over(&there), there.force)
        });
        let inverse = inverse_of_free(&slopes.of_step(self.step), &held);
        self.inverse.push(inverse);
        self.held.push(held);
        self.ways.push(way);
        self.slopes.push(slopes);
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
        let plant = Plant::new(self.session, changed, &self.course.rhythms)?;
        let nowhere = [Joints::<f64, N>::zeros(); 2];
        let start = match self.dry || plant.dry {
            true => self.start_of(&plant, changed)?,
            false => nowhere,
        };
        let sensed = if sensing && start == nowhere {
            self.sensed(&plant, None, 0)
        } else {
            let own;
            let hands = if moves_handle {
                own = hands(&self.course, changed, (self.states.len(), self.step))?;
                &own
            } else {
                &self.hands
            };
            let answer = self.solve(&plant, hands, start);
            self.sensed(&plant, Some(&answer), self.first_changed(&plant, &answer))
        };
        let mut out = sensed;
        for (channel, base) in out.iter_mut().zip(&self.base) {
            for (value, base) in channel.iter_mut().zip(base) {
                *value = (*value - base) / size;
            }
        }
        Ok(out)
    }

    /// How far another hypothesis starts from the run: the joints that dry friction holds where they are measured, and what dry friction
    /// resists less with in the others.
    fn start_of(
        &self,
        plant: &Plant<N>,
        changed: &Hypothesis<N>,
    ) -> Result<[Joints<f64, N>; 2], SimulationError> {
        let (near, friction) = self.start;
        let most = plant.friction(&self.balances[0].motion, &[]);
        let held = held_at_start(&most);
        let moved = self.course.start(changed) - near;
        Ok([
            Joints::from_fn(|j, _| if held[j] { moved[j] } else { 0.0 }),
            friction - self.session.friction_at_start(changed, &self.course)?,
        ])
    }

    /// Changes of angles and forces along the run when another plant takes its place.
    ///
    /// * `start` - see [`Linear::start_of`]
    fn solve(
        &self,
        plant: &Plant<N>,
        hands: &[Hand],
        [moved, released]: [Joints<f64, N>; 2],
    ) -> Vec<(Joints<f64, N>, Plane<f64>)> {
        let h = self.step;
        let pushes = self.pushes(plant, hands);
        let mut change = Change::default();
        let mut out = Vec::with_capacity(self.states.len());
        let nothing = Joints::<f64, N>::zeros();
        let mut is_still = true;
        for (i, (push, force)) in pushes.into_iter().enumerate() {
            let slopes = &self.slopes[i];
            if i == 0 {
                change.q = moved + self.rest * (push + released - slopes.stiffness * moved);
                is_still = change.q == nothing;
            } else if !is_still || push != nothing {
                is_still = false;
                for j in (0..N).filter(|&j| self.held[i][j]) {
                    (change.qd[j], change.qdd[j]) = (0.0, 0.0);
                }
                change.advance(slopes, &self.inverse[i], &push, h);
            }
            let [by_angle, by_speed] = &slopes.force;
            let follow = by_angle * change.q + by_speed * change.qd;
            out.push((change.q, [0, 1].map(|c| force[c] + follow[c])));
        }
        out
    }

    /// Torque that the motion of the run leaves over in another plant, and the force on the arm there beyond that of the run, at every step.
    fn pushes(&self, plant: &Plant<N>, hands: &[Hand]) -> Vec<(Joints<f64, N>, Plane<f64>)> {
        let steps = 0..self.states.len();
        let mut both = self.resisting.iter().chain(&plant.resisting);
        let same_rig = plant.setup == self.setup && std::ptr::eq(hands, self.hands.as_slice());
        if !same_rig && both.any(|e| e.kind.feels_force()) {
            let memories = self.memories(&plant.resisting);
            let one = |i: usize| {
                let own = &self.balances[i];
                let memory = memories.get(i).map_or(&[][..], Vec::as_slice);
                let changed = balance(plant, &self.states[i], hands[i], memory);
                let friction = (own.friction - changed.friction).component_mul(&self.ways[i]);
                let push = own.torque - changed.torque + friction;
                (push, [0, 1].map(|c| changed.force[c] - own.force[c]))
            };
            return steps.map(one).collect();
        }
        // What the same effects resist with takes itself out.
        let less = self.resisted(&beyond(&self.resisting, &plant.resisting));
        let more = self.resisted(&beyond(&plant.resisting, &self.resisting));
        let push = |i: usize| less[i] - more[i];
        if same_rig {
            return steps.map(|i| (push(i), [0.0; 2])).collect();
        }
        let bare = plant.without_effects();
        let one = |i: usize| {
            let own = &self.balances[i];
            let changed = balance(&bare, &self.states[i], hands[i], &[]);
            let rigid = own.torque - own.resisted - changed.torque;
            let force = [0, 1].map(|c| changed.force[c] - own.force[c]);
            (rigid + push(i), force)
        };
        steps.map(one).collect()
    }

    /// What joint effects resist with at every step, where joints slip as in the run \[N m\].
    fn resisted(&self, effects: &[Effect<f64>]) -> Vec<Joints<f64, N>> {
        if effects.is_empty() {
            return vec![Joints::zeros(); self.states.len()];
        }
        let memories = self.memories(effects);
        let one = |i: usize| {
            let motion = &self.balances[i].motion;
            let memory = memories.get(i).map_or(&[][..], Vec::as_slice);
            let friction = Joints::from(dry_friction(effects, motion, memory));
            resisting_besides_dry(effects, motion, memory) + friction.component_mul(&self.ways[i])
        };
        (0..self.states.len()).map(one).collect()
    }

    /// The first sample that shows a change of the motion; before it, the sensors of another plant show what those of the run do.
    fn first_changed(&self, plant: &Plant<N>, changes: &[(Joints<f64, N>, Plane<f64>)]) -> usize {
        if plant.sensing != self.sensing || plant.setup.force_delay != self.setup.force_delay {
            return 0;
        }
        let still = |(q, force): &&(Joints<f64, N>, Plane<f64>)| {
            *q == Joints::<f64, N>::zeros() && *force == [0.0; 2]
        };
        let steps = changes.iter().take_while(still).count();
        let first = steps.saturating_sub(1) * self.grid.stride / self.grid.parts;
        first.min(self.base[0].len())
    }

    /// Steps to beyond so many samples of the trial.
    pub(super) fn steps_until(&self, samples: usize) -> usize {
        samples * self.grid.parts / self.grid.stride + 2
    }

    /// What the run itself leaves over: the error of its own sampling. What holds a joint is no error.
    pub(super) fn error(&self, i: usize) -> Joints<f64, N> {
        let Balance {
            torque, friction, ..
        } = &self.balances[i];
        Joints::from_fn(|j, _| match self.ways[i][j] {
            0.0 => torque[j] - torque[j].clamp(-friction[j], friction[j]),
            way => torque[j] + way * friction[j],
        })
    }

    /// Force on the arm at the samples of the trial, as long ago as a sensor is late \[s\].
    fn force_after(&self, delay: f64) -> Vec<Plane<f64>> {
        let Grid { parts, stride } = self.grid;
        let last = self.records.len() - 1;
        let delay = delay / self.step * stride as f64;
        let at = |sample: usize| {
            let record = (sample * parts).min(last) as f64;
            cubic(&self.recorded_force, (record - delay).max(0.0))
        };
        (0..self.course.raw[0].len()).map(at).collect()
    }

    /// What the sensors read of the run with changes on it, at the samples of the trial.
    ///
    /// * `first` - sample before which they show what those of the run do
    pub(super) fn sensed(
        &self,
        plant: &Plant<N>,
        changes: Option<&[(Joints<f64, N>, Plane<f64>)]>,
        first: usize,
    ) -> Channels {
        let Grid { parts, stride } = self.grid;
        let count = self.course.raw[0].len();
        let mut channels: Channels = match first {
            0 => vec![Vec::with_capacity(count); N + 2],
            _ => self.base.iter().map(|c| c[..first].to_vec()).collect(),
        };
        let last = self.records.len() - 1;
        // Between two steps changes go straight.
        let change = |record: f64| {
            let changes = changes?;
            let place = record / stride as f64;
            let i = (place as usize).min(changes.len() - 1);
            let share = place - i as f64;
            let ((q, force), (next_q, next_force)) =
                (changes[i], changes[(i + 1).min(changes.len() - 1)]);
            Some((
                q + (next_q - q) * share,
                [0, 1].map(|c| force[c] + share * (next_force[c] - force[c])),
            ))
        };
        let own;
        let forces = if plant.setup.force_delay == self.setup.force_delay {
            &self.delayed_force
        } else {
            own = self.force_after(plant.setup.force_delay);
            &own
        };
        let delay = plant.setup.force_delay / self.step * stride as f64;
        for sample in first..count {
            let i = (sample * parts).min(last);
            let more = change(i as f64).map_or_else(Joints::zeros, |c| c.0);
            let pulled = change((i as f64 - delay).max(0.0)).map_or([0.0; 2], |c| c.1);
            let mut reading = Reading::<f64, N> {
                time: self.records[i].time,
                q: self.records[i].q + more,
                force_on_arm: [0, 1].map(|c| forces[sample][c] + pulled[c]),
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

/// The effects of one list that another does not have.
fn beyond(effects: &[Effect<f64>], others: &[Effect<f64>]) -> Vec<Effect<f64>> {
    let mut others = others.to_vec();
    let is_new = |effect: &&Effect<f64>| match others.iter().position(|o| o == *effect) {
        Some(same) => {
            others.swap_remove(same);
            false
        }
        None => true,
    };
    effects.iter().filter(is_new).copied().collect()
}

/// The value at a place among samples of the cubic through the four samples about it (Lagrange).
fn cubic(samples: &[Plane<f64>], place: f64) -> Plane<f64> {
    let first = (place as usize).clamp(1, samples.len() - 3) - 1;
    let weights = cubic_weights(place - first as f64);
    let four = std::iter::zip(weights, &samples[first..first + 4]);
    four.fold([0.0; 2], |sum, (weight, sample)| {
        [0, 1].map(|c| sum[c] + weight * sample[c])
    })
}

/// The inverse of a slope for the joints that nothing holds; those that are held answer nothing.
fn inverse_of_free<const N: usize>(
    slope: &SMatrix<f64, N, N>,
    held: &[bool; N],
) -> SMatrix<f64, N, N> {
    let mut free = *slope;
    for j in (0..N).filter(|&j| held[j]) {
        free.fill_row(j, 0.0);
        free.fill_column(j, 0.0);
        free[(j, j)] = 1.0;
    }
    let mut inverse = free.try_inverse().unwrap_or_else(SMatrix::zeros);
    for j in (0..N).filter(|&j| held[j]) {
        inverse[(j, j)] = 0.0;
    }
    inverse
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_are_solved_at_a_hundred_hertz_or_a_little_more() {
        let of = |rate| {
            let Grid { parts, stride } = Grid::of(rate);
            (parts, stride, rate * parts as f64 / stride as f64)
        };
        assert_eq!(of(50.0), (2, 1, 100.0));
        assert_eq!(of(30.0), (4, 1, 120.0));
        assert_eq!(of(100.0), (1, 1, 100.0));
        assert_eq!(of(250.0), (1, 2, 125.0));
        assert_eq!(of(1000.0), (1, 10, 100.0));
    }

    #[test]
    fn between_samples_a_delayed_force_keeps_its_swing() {
        // 5 Hz at 100 Hz: straight lines would take 1 % of it.
        let swing = |place: f64| libm::sin(0.314 * place);
        let samples: Vec<Plane<f64>> = (0..40).map(|i| [swing(f64::from(i)), 2.0]).collect();
        for place in [0.4, 3.3, 17.5, 38.6] {
            let [y, z] = cubic(&samples, place);
            assert!((y - swing(place)).abs() < 1e-3 && (z - 2.0).abs() < 1e-12);
        }
        assert_eq!(cubic(&samples, 12.0), samples[12]);
        assert_eq!(cubic(&samples, 39.0), samples[39]);
    }

    #[test]
    fn of_two_lists_of_effects_what_both_have_counts_once_for_each() {
        use arm_core::effect::Kind;
        let of = |size: f64| Effect::<f64>::new(Kind::Viscous, 1).with(&[size]);
        let (one, two, three) = (of(1.0), of(2.0), of(3.0));
        assert_eq!(beyond(&[one, two, one], &[one, three]), [two, one]);
        assert_eq!(beyond(&[one, three], &[one, two, one]), [three]);
        assert!(beyond(&[two, one], &[one, two]).is_empty());
    }

    #[test]
    fn a_joint_that_is_held_answers_nothing() {
        let slope = SMatrix::<f64, 2, 2>::new(2.0, 1.0, 1.0, 4.0);
        let inverse = inverse_of_free(&slope, &[false, true]);
        assert_eq!(inverse, SMatrix::<f64, 2, 2>::new(0.5, 0.0, 0.0, 0.0));
        let free = inverse_of_free(&slope, &[false; 2]) * slope;
        assert!((free - SMatrix::identity()).amax() < 1e-15);
    }
}
