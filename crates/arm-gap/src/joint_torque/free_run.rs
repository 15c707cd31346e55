//! A rig without a robot, simulated: the angles of an arm that swings freely, or that its motors' measured torques drive.
//!
//! Nothing measured enters but where it starts, and the torques. A free swing runs from its first second to the end of the
//! trial. A driven arm does not: small errors of torques add up to any angle, so that it starts anew every second.

use arm_core::Joints;
use arm_numerics::{Cholesky, Matrix};
use arm_sim::{Drive, Experiment, Interpolation, Series, SimulationError, Start, simulate};

use crate::data::noise::dot;
use crate::data::session::Session;
use crate::measurement_model::hypothesis::Hypothesis;
use crate::measurement_model::joint_torques::{offsets, unbent};
use crate::measurement_model::prediction::{Channels, Course, STEPS};

/// How long a start is fitted to, and how long a driven arm runs \[s\].
const SPAN: f64 = 1.0;
/// Most steps of Gauss and Newton's method for a start.
const TURNS: usize = 8;
/// Changes of angles \[rad\] and speeds \[rad/s\] with which the start is linearised.
pub(crate) const CHANGE: [f64; 2] = [1e-5, 1e-4];

/// Angles and speeds at which a run starts.
pub(crate) type State<const N: usize> = (Joints<f64, N>, Joints<f64, N>);

/// Writes the slope of a residual when something changes it to another.
pub(super) fn slope_into(slope: &mut [f64], residual: &[f64], other: &[f64], change: f64) {
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
        let count = span.min(end - start);
        let run =
            |state: &State<N>, count: usize| self.angles(hypothesis, course, (start, count), state);
        let left = |shown: &Channels| -> Vec<f64> {
            let each = (0..N).flat_map(|j| (0..count).map(move |i| (j, i)));
            each.map(|(j, i)| motion.q[start + i][j] - shown[j][i])
                .collect()
        };
        let mut state = (motion.q[start], motion.qd[start]);
        let mut residual = left(&run(&state, count)?);
        for _ in 0..TURNS {
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
                let changed = left(&run(&moved, count)?);
                slope_into(slopes.column_mut(column), &residual, &changed, change);
            }
            let Some(solver) = Cholesky::new(slopes.transpose_product(&slopes)) else {
                break;
            };
            let step = solver.solve(&slopes.transpose_times(&residual));
            let q = Joints::from_fn(|j, _| step[j]);
            let qd = Joints::from_fn(|j, _| step[N + j]);
            let next = (state.0 + q, state.1 + qd);
            let better = left(&run(&next, count)?);
            let before = dot(&residual, &residual);
            let gained = before - dot(&better, &better);
            if gained <= 0.0 {
                break;
            }
            let done = gained < 1e-6 * before;
            (state, residual) = (next, better);
            if done {
                break;
            }
        }
        run(&state, end - start)
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
