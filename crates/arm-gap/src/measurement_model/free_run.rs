//! Simulation of a rig without a robot: the angles of an arm that swings freely, or that its motors' measured torques drive.
//!
//! Nothing measured enters but where it starts, and the torques. A free swing runs from its first second to the end of the
//! trial. A driven arm does not: small errors of torques add up to any angle, so that it starts anew every second.

use arm_core::Joints;
use arm_numerics::{Cholesky, Matrix};
use arm_sim::{Drive, Experiment, Interpolation, Series, SimulationError, Start, simulate};

use crate::data::course::{Channels, Course};
use crate::data::noise::dot;
use crate::data::session::Session;
use crate::hypothesis::Hypothesis;
use crate::measurement_model::joint_torques::{offsets, unbent};
use crate::measurement_model::prediction::STEPS;

/// How long a start is fitted to, and how long a driven arm runs \[s\].
const SPAN: f64 = 1.0;
/// Most steps of Gauss and Newton's method for a start.
const MOST_STEPS: usize = 8;
/// Shares of such a step that are tried until one brings the run nearer.
const SHARES: [f64; 4] = [1.0, 0.5, 0.25, 0.125];
/// A start is fitted to this part of its samples, one after the other.
const PARTS: [usize; 4] = [8, 4, 2, 1];
/// Changes of angles \[rad\] and speeds \[rad/s\] with which the start is linearised.
pub(crate) const CHANGE: [f64; 2] = [1e-5, 1e-4];

/// Angles and speeds at which a run starts.
pub(crate) type State<const N: usize> = (Joints<f64, N>, Joints<f64, N>);

/// Writes the slope of a residual when something changes it to another.
pub(crate) fn slope_into(slope: &mut [f64], residual: &[f64], other: &[f64], change: f64) {
    for ((slope, here), there) in slope.iter_mut().zip(residual).zip(other) {
        *slope = (here - there) / change;
    }
}

impl<const N: usize> Session<N> {
    /// Angles that the encoders would read of the arm left to itself or to its motors, `[joint][sample]`; empty for an arm that is led, by
    /// a robot or whatever else its contact is with: without the path that holds it, it falls.
    ///
    /// Samples that no run reaches (next to gaps, and in pieces shorter than a quarter of a second) are not a number.
    ///
    /// # Errors
    /// [`SimulationError`] where the hypothesis cannot be simulated.
    pub fn free_run(
        &self,
        hypothesis: &Hypothesis<N>,
        (trial, course): (usize, &Course<N>),
    ) -> Result<Channels, SimulationError> {
        if self.reads_contact() {
            return Ok(Vec::new());
        }
        let (trial, rate) = (&self.trials[trial], course.rate);
        let span = libm::round(SPAN * rate) as usize;
        let longest = if trial.is_unloaded() {
            trial.len()
        } else {
            span
        };
        let mut out = vec![vec![f64::NAN; trial.len()]; N];
        let mut start = 0;
        while start < trial.len() {
            let end = (start..trial.len())
                .take(longest)
                .find(|&i| !trial.valid[i])
                .unwrap_or_else(|| (start + longest).min(trial.len()));
            if end - start > span / 4 {
                let angles = self.piece(hypothesis, course, (start, end, span))?;
                for (channel, own) in out.iter_mut().zip(angles) {
                    channel[start..end].copy_from_slice(&own);
                }
            }
            start = end.max(start + 1);
        }
        Ok(out)
    }

    /// One run from the state that explains its first samples best.
    fn piece(
        &self,
        hypothesis: &Hypothesis<N>,
        course: &Course<N>,
        (start, end, span): (usize, usize, usize),
    ) -> Result<Channels, SimulationError> {
        let Some(motion) = course.motion() else {
            return Ok(Vec::new());
        };
        let mut state = (motion.q[start], motion.qd[start]);
        // An arm near its upright multiplies a small error of the start by a hundred within a second, so that the whole of
        // it is no longer a nearly linear function of the start: each fit begins where that of half as many samples ended.
        for part in PARTS {
            let count = span.min(end - start) / part;
            if count > 2 * N {
                state = self.start_of(hypothesis, course, (start, count), state)?;
            }
        }
        self.angles(hypothesis, course, (start, end - start), &state)
    }

    /// The state from which a run explains so many samples best, found by Gauss and Newton's method from another.
    fn start_of(
        &self,
        hypothesis: &Hypothesis<N>,
        course: &Course<N>,
        (start, count): (usize, usize),
        mut state: State<N>,
    ) -> Result<State<N>, SimulationError> {
        let Some(motion) = course.motion() else {
            return Ok(state);
        };
        let left = |state: &State<N>| -> Result<Vec<f64>, SimulationError> {
            let shown = self.angles(hypothesis, course, (start, count), state)?;
            let each = (0..N).flat_map(|j| (0..count).map(move |i| (j, i)));
            Ok(each
                .map(|(j, i)| motion.q[start + i][j] - shown[j][i])
                .collect())
        };
        let mut residual = left(&state)?;
        for _ in 0..MOST_STEPS {
            let mut slopes = Matrix::zeros(N * count, 2 * N);
            for column in 0..2 * N {
                let mut moved = state;
                let change = CHANGE[column / N];
                let part = if column < N {
                    &mut moved.0
                } else {
                    &mut moved.1
                };
                part[column % N] += change;
                slope_into(slopes.column_mut(column), &residual, &left(&moved)?, change);
            }
            let Some(solver) = Cholesky::new(slopes.transpose_product(&slopes)) else {
                break;
            };
            let step = solver.solve(&slopes.transpose_times(&residual));
            let before = dot(&residual, &residual);
            let mut gained = 0.0;
            for share in SHARES {
                let next = (
                    state.0 + Joints::from_fn(|j, _| share * step[j]),
                    state.1 + Joints::from_fn(|j, _| share * step[N + j]),
                );
                let better = left(&next)?;
                gained = before - dot(&better, &better);
                if gained > 0.0 {
                    (state, residual) = (next, better);
                    break;
                }
            }
            if gained < 1e-6 * before {
                break;
            }
        }
        Ok(state)
    }

    /// What the encoders read of a run from a state.
    pub(crate) fn angles(
        &self,
        hypothesis: &Hypothesis<N>,
        course: &Course<N>,
        (start, count): (usize, usize),
        state: &State<N>,
    ) -> Result<Channels, SimulationError> {
        let interval = 1.0 / course.rate;
        let duration = (count - 1) as f64 * interval;
        let unloaded = course.raw.iter().flatten().all(|v| *v == 0.0);
        let torques = if unloaded {
            None
        } else {
            let samples = start..start + count;
            let times: Vec<f64> = (0..count).map(|i| i as f64 * interval).collect();
            let values: Vec<[f64; N]> = samples
                .map(|i| core::array::from_fn(|j| course.raw[j][i]))
                .collect();
            let linear = Interpolation::Linear;
            Some(Series::new("torque", &times, &values, linear)?)
        };
        let setup = hypothesis.setup(&self.chain, self.contact)?;
        let mut experiment = Experiment::new(setup, Drive::Torque(torques), duration);
        experiment.effects = hypothesis.effects();
        experiment.output_interval = Some(interval);
        let offset = offsets(&experiment.effects);
        experiment.start = Start::Given {
            q: unbent(hypothesis, &state.0) - offset,
            qd: state.1,
        };
        let mut last = None;
        for step in STEPS {
            experiment.dt = interval / libm::ceil(interval / step - 1e-9);
            match simulate(&experiment) {
                Ok(recording) => {
                    let read = |j: usize, i: usize| {
                        let q = recording.q[i * N + j] + offset[j];
                        let [cosine, sine] = hypothesis.eccentricity[j];
                        let (sin, cos) = libm::sincos(q);
                        q + cosine * cos + sine * sin
                    };
                    let channel = |j| (0..count).map(|i| read(j, i)).collect();
                    return Ok((0..N).map(channel).collect());
                }
                Err(error) => last = Some(error),
            }
        }
        Err(last.unwrap_or(SimulationError::Setting {
            name: "step",
            found: STEPS[0],
            allowed: "a step that is tried",
        }))
    }
}
