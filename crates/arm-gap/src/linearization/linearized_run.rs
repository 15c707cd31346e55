//! One simulated run of a led arm with the equation of motion linearised along it.
//!
//! A joint that set-valued friction holds in the run does not respond to changes, and one that slips does so against its friction.

use arm_core::effect::{Effect, MAX_STATES, States, advance_states, any_state};
use arm_core::{Joints, Plane, Reading};
use arm_sim::{SimulationError, Slopes, cubic_weights};
use nalgebra::SMatrix;
use std::sync::{Arc, OnceLock};

use crate::data::course::{Channels, Course, smooth};
use crate::data::session::Session;
use crate::hypothesis::Hypothesis;
use crate::linearization::origin::Origin;
use crate::linearization::plant::{Balance, Hand, Plant, State, balance, hands};

/// The instants at which a run is recorded and solved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Grid {
    /// Records for each sample of the trial.
    pub parts: usize,
    /// Records for each step of the solution.
    pub stride: usize,
}

impl Grid {
    /// Fewest steps per second: movements and their compared band need no more at any sampling rate.
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

/// The direction of a speed; zero for a joint at rest.
fn direction(speed: f64) -> f64 {
    match speed {
        v if v > 0.0 => 1.0,
        v if v < 0.0 => -1.0,
        _ => 0.0,
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
    pub(crate) course: Arc<Course<N>>,
    pub(super) grid: Grid,
    /// Length of a step of the solution \[s\].
    pub(super) step: f64,
    /// The hypothesis of the run.
    pub(super) own: Origin<N>,
    /// The run at every record.
    records: Vec<State<N>>,
    /// Force on the arm at every record.
    recorded_force: Vec<Plane<f64>>,
    /// The run at every step.
    pub(super) states: Vec<State<N>>,
    pub(super) hands: Vec<Hand>,
    /// Direction in which each joint slips, 0 for none.
    pub(super) ways: Vec<Joints<f64, N>>,
    pub(super) balances: Vec<Balance<N>>,
    /// How what is left over and the force follow the motion in each step.
    pub(super) slopes: Vec<Slopes<N>>,
    /// The inverse of what multiplies new accelerations, for the joints that friction does not hold.
    pub(super) inverse: Vec<SMatrix<f64, N, N>>,
    /// Which joints friction holds.
    pub(super) held: Vec<[bool; N]>,
    /// Angles of the first instant for one unit of torque left over at rest.
    pub(super) rest: SMatrix<f64, N, N>,
}

/// States of effects at every step of a run; nothing where no effect has one.
#[derive(Default)]
pub(super) struct Memories {
    effects: usize,
    /// Those of all effects at one step after those of the step before.
    states: Vec<States<f64>>,
}

impl Memories {
    /// Those of all effects at a step.
    pub fn at(&self, step: usize) -> &[States<f64>] {
        &self.states[step * self.effects..(step + 1) * self.effects]
    }
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
        let plant = Plant::new(session, hypothesis, &course.rhythms)?;
        let grid = Grid::of(course.rate);
        let run = session.run_finely(hypothesis, course, grid.parts)?;
        let recording = run.recording();
        let interval = 1.0 / course.rate / grid.parts as f64;
        let at = |v: &[f64], i: usize| Joints::from_column_slice(&v[i * N..(i + 1) * N]);
        let records: Vec<State<N>> = (0..recording.len())
            .map(|i| {
                let moving = [&recording.q, &recording.qd, &recording.qdd].map(|v| at(v, i));
                State::new(i as f64 * interval, moving)
            })
            .collect();
        let start = session.at_start(hypothesis, course)?;
        let mut linear = Self {
            session,
            course: Arc::clone(course),
            grid,
            step: interval * grid.stride as f64,
            own: Origin::of(plant, start),
            recorded_force: Vec::with_capacity(records.len()),
            states: records.iter().step_by(grid.stride).copied().collect(),
            records,
            hands: Vec::new(),
            ways: Vec::new(),
            balances: Vec::new(),
            slopes: Vec::new(),
            inverse: Vec::new(),
            held: Vec::new(),
            rest: SMatrix::zeros(),
        };
        let plant = &linear.own.plant;
        let every = hands(course, hypothesis, (linear.records.len(), interval))?;
        for (record, hand) in std::iter::zip(&linear.records, &every) {
            let force = balance(plant, record, *hand, &[]).force;
            linear.recorded_force.push(force);
        }
        linear.hands = every.into_iter().step_by(grid.stride).collect();
        let memories = linear.memories(&plant.resisting);
        let feels_force = plant.feels_force;
        // Effects that are tested later may depend on them.
        linear.own.plant.feels_force = true;
        linear.balances = linear.balances_of(&linear.own.plant, &memories);
        linear.own.plant.feels_force = feels_force;
        for i in 0..linear.states.len() {
            linear.differentiate(i, memories.at(i));
        }
        let held = linear.own.held_at_start(&linear.balances[0].motion);
        linear.rest = linear.slopes.first().map_or_else(SMatrix::zeros, |slopes| {
            inverse_of_free(&slopes.stiffness, &held)
        });
        linear.own.shown = linear.sensed((&linear.own, &linear.own.plant), None, None);
        Ok(linear)
    }

    /// What the sensors would read of the run itself, in the common band.
    ///
    /// # Errors
    /// [`SimulationError`] for a channel that is not finite.
    pub fn shown(&self) -> Result<Channels, SimulationError> {
        smooth(&self.own.shown, self.course.band, self.course.rate).map_err(|_| ASTRAY)
    }

    /// Angles \[rad\], speeds \[rad/s\] and accelerations \[rad/s²\] of the joints at a sample of the trial.
    pub fn state(&self, sample: usize) -> (Joints<f64, N>, Joints<f64, N>, Joints<f64, N>) {
        let last = self.records.len().saturating_sub(1);
        let State { q, qd, qdd, .. } = self.records[(sample * self.grid.parts).min(last)];
        (q, qd, qdd)
    }

    /// The states of effects that have one, along the run; nothing where none has.
    pub(super) fn memories(&self, effects: &[Effect<f64>]) -> Memories {
        if !any_state(effects) {
            return Memories::default();
        }
        let mut now = vec![[0.0; MAX_STATES]; effects.len()];
        let mut states = Vec::with_capacity(effects.len() * self.states.len());
        let mut before = self.states[0].motion();
        for state in &self.states {
            let motion = state.motion();
            if !states.is_empty() {
                advance_states(effects, (&before, &motion), &mut now, self.step);
            }
            states.extend_from_slice(&now);
            before = motion;
        }
        Memories {
            effects: effects.len(),
            states,
        }
    }

    /// The balance of another plant for the motion of the run at every step, led as the run is.
    ///
    /// * `memories` - the states of its effects along the run
    pub(super) fn balances_of(&self, plant: &Plant<N>, memories: &Memories) -> Vec<Balance<N>> {
        let one = |i: usize| balance(plant, &self.states[i], self.hands[i], memories.at(i));
        (0..self.states.len()).map(one).collect()
    }

    fn differentiate(&mut self, i: usize, memory: &[States<f64>]) {
        let (state, hand, middle) = (self.states[i], self.hands[i], &self.balances[i]);
        let way = state.qd.map(direction);
        let held: [bool; N] = std::array::from_fn(|j| middle.friction[j] > 0.0 && way[j] == 0.0);
        let left_over = |there: &Balance<N>| there.torque + there.friction.component_mul(&way);
        let at = [state.q, state.qd, state.qdd];
        let slopes = Slopes::around(at, &left_over(middle), |q, qd, qdd| {
            let there = state.beside([*q, *qd, *qdd]);
            let there = balance(&self.own.plant, &there, hand, memory);
            (left_over(&there), there.force)
        });
        let inverse = inverse_of_free(&slopes.of_step(self.step), &held);
        self.inverse.push(inverse);
        self.held.push(held);
        self.ways.push(way);
        self.slopes.push(slopes);
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
    /// * `plant` - with sensors that are, all or but one, those of `origin`
    /// * `known` - what they read at its first samples
    pub(super) fn sensed(
        &self,
        (origin, plant): (&Origin<N>, &Plant<N>),
        changes: Option<&[(Joints<f64, N>, Plane<f64>)]>,
        known: Option<Channels>,
    ) -> Channels {
        let Grid { parts, stride } = self.grid;
        let count = self.course.raw[0].len();
        let mut channels = known.unwrap_or_else(|| vec![Vec::with_capacity(count); N + 2]);
        let first = channels[0].len();
        for channel in &mut channels {
            channel.reserve(count - first);
        }
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
        let delay = plant.setup.force_delay;
        let fresh = OnceLock::new();
        let is_as_late = |o: &&Origin<N>| o.plant.setup.force_delay == delay;
        let same = [origin, &self.own].into_iter().find(is_as_late);
        let forces = same.map_or(&fresh, |o| &o.delayed_force);
        let forces = forces.get_or_init(|| self.force_after(delay));
        let delay = delay / self.step * stride as f64;
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

/// The value at a place among samples of the cubic through the four samples about it (Lagrange).
fn cubic(samples: &[Plane<f64>], place: f64) -> Plane<f64> {
    let first = (place as usize).clamp(1, samples.len() - 3) - 1;
    let weights = cubic_weights(place - first as f64);
    let four = std::iter::zip(weights, &samples[first..first + 4]);
    four.fold([0.0; 2], |sum, (weight, sample)| {
        [0, 1].map(|c| sum[c] + weight * sample[c])
    })
}

/// The inverse of a slope for the joints that nothing holds; zero for those that are held.
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
    fn a_joint_that_is_held_answers_nothing() {
        let slope = SMatrix::<f64, 2, 2>::new(2.0, 1.0, 1.0, 4.0);
        let inverse = inverse_of_free(&slope, &[false, true]);
        assert_eq!(inverse, SMatrix::<f64, 2, 2>::new(0.5, 0.0, 0.0, 0.0));
        let free = inverse_of_free(&slope, &[false; 2]) * slope;
        assert!((free - SMatrix::identity()).amax() < 1e-15);
    }
}
