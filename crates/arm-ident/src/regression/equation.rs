//! The equation of motion of every sample as rows of a linear regression.
//!
//! One row a joint: `Y π + R(ρ) + C c = τ + Jᵀ F − R_held − rotor`, with inertial parameters π, linear parameters ρ of the
//! fitted effects and small imperfections c of the measurement, each through its first-order influence on the row.

use arm_core::effect::{Effect, Motion, resisting_torque};
use arm_core::{Chain, Joints, Pose, inverse_dynamics, joint_force, regressor, static_torque};

use crate::regression::calibration::{Nearby, Prediction, influence};
use crate::regression::sensitivity::{Answers, Course, HELD};
use crate::regression::trial::{Model, Trial};
use crate::regression::unknown::{Imperfection, Moment, Source, Unknown};

/// Joint motion at the samples of a trial.
#[derive(Clone, Debug, PartialEq)]
pub struct Kinematics<const N: usize> {
    /// Angles \[rad\].
    pub q: Vec<Joints<f64, N>>,
    /// Speeds \[rad/s\].
    pub qd: Vec<Joints<f64, N>>,
    /// Accelerations \[rad/s²\].
    pub qdd: Vec<Joints<f64, N>>,
}

/// Rows of a regression over a whole trial, column by column.
///
/// `columns[u][i * N + j]` belongs to unknown `u`, sample `i`, joint `j`; the right-hand side `rhs` is laid out alike.
#[derive(Clone, Debug, PartialEq)]
pub struct Rows {
    /// One column for each unknown.
    pub columns: Vec<Vec<f64>>,
    /// Measured torque that the columns explain \[N m\].
    pub rhs: Vec<f64>,
    /// Index in the trial of each sample.
    pub samples: Vec<usize>,
    /// Which rows the cascade fits, laid out like `rhs`; all where there is none.
    pub fits: Option<Vec<bool>>,
}

impl Rows {
    /// Whether the row at a place in `rhs` is fitted.
    pub fn fits(&self, at: usize) -> bool {
        self.fits.as_ref().is_none_or(|fits| fits[at])
    }

    /// Rows of zeros.
    pub(crate) fn zeros<const N: usize>(unknowns: usize, samples: Vec<usize>) -> Self {
        let length = samples.len() * N;
        Self {
            columns: vec![vec![0.0; length]; unknowns],
            rhs: vec![0.0; length],
            samples,
            fits: None,
        }
    }
}

/// The rows of a trial, built a stretch after another.
///
/// The measured forces act through the Jacobian of the motion, so that the same filter reaches both sides later.
pub(crate) struct Building<'a, const N: usize> {
    model: &'a Model<N>,
    unknowns: &'a [Unknown],
    trial: &'a Trial<N>,
    motion: &'a Kinematics<N>,
    memory: Memory,
    /// Where imperfections of the measurement are among the unknowns.
    prediction: Option<Prediction<N>>,
    /// Samples that are built.
    built: usize,
}

impl<'a, const N: usize> Building<'a, N> {
    /// From the first sample on.
    pub fn new(
        (model, unknowns): (&'a Model<N>, &'a [Unknown]),
        trial: &'a Trial<N>,
        motion: &'a Kinematics<N>,
    ) -> Self {
        Self {
            model,
            unknowns,
            trial,
            motion,
            memory: Memory::new(model),
            prediction: Prediction::of_unknowns(unknowns, model),
            built: 0,
        }
    }

    /// The rows of the next samples.
    pub fn next(&mut self, count: usize) -> Rows {
        let samples = self.built..self.built + count;
        self.built += count;
        let mut rows = Rows::zeros::<N>(self.unknowns.len(), samples.collect());
        for k in 0..count {
            self.sample(&mut rows, k);
        }
        rows
    }

    fn sample(&mut self, rows: &mut Rows, k: usize) {
        let Self {
            model,
            unknowns,
            trial,
            motion,
            ..
        } = *self;
        let i = rows.samples[k];
        let here = k * N..(k + 1) * N;
        let (qd, qdd) = (&motion.qd[i], &motion.qdd[i]);
        let at = Sample::new(model, trial, (&motion.q[i], qd, qdd), i);
        self.memory.advance(&at.motion, 1.0 / trial.rate);
        let memory = &self.memory;
        let predicted = self.prediction.as_mut();
        let predicted = predicted.map_or_else(Nearby::default, |p| p.next(model, trial, motion));
        let measured = at.measured - resisting_torque(&model.held, &at.motion, &memory.held);
        rows.rhs[here.clone()].copy_from_slice(measured.as_slice());
        let y = regressor(&model.chain, &at.pose, qd, qdd);
        let fixed = inverse_dynamics(&model.chain, &at.pose, qd, qdd);
        let inertial: [[Joints<f64, N>; 4]; N] =
            core::array::from_fn(|s| y.segment_columns(&model.chain, s));
        let mut explained = Joints::<f64, N>::zeros();
        for (unknown, values) in unknowns.iter().zip(&mut rows.columns) {
            let column = match unknown.source {
                Source::Segment(s, moment) => inertial[s][position(moment)],
                Source::Effect(e, p) => gradient(&model.fitted[e], p, &at.motion, memory.fitted[e]),
                Source::Calibration(what) => {
                    influence(model, trial, motion, (&predicted, memory, i), what)
                }
            };
            if let Source::Segment(s, moment) = unknown.source {
                explained += column * value_of(&model.chain, s, moment);
            }
            values[here.clone()].copy_from_slice(column.as_slice());
        }
        // What the rigid arm does besides the unknown moments: rotors, held normal moments, held segments.
        for (j, value) in rows.rhs[here].iter_mut().enumerate() {
            *value -= fixed[j] - explained[j];
        }
    }
}

/// Puts rows built along a simulated motion in the place of those along measured angles, without the noise of the latter.
///
/// Angles with noise must not stand in columns: a wrist that hangs between forearm and handle moves little more than its
/// noise, and a spring read off such angles comes out too soft, with everything that hangs on it. The columns Z stay those of the
/// simulated motion, with what each unknown changes of it; the right-hand side becomes `τ − Y(q) x + Z x` with the measured angles q and
/// the model's own values x. The fit stands still where `Zᵀ (τ − Y(q) x) = 0`: Z are instruments, and the residual is that of the measured angles.
///
/// A delay of the force channels, as it was last estimated, shifts the force of the simulated motion. Its first order alone would not do:
/// of a force that swings five times a second, ten milliseconds take 5 % in the second order, which a fit buys with gains and masses.
pub(crate) struct Instrument<'a, const N: usize> {
    building: Building<'a, N>,
    course: &'a Course<N>,
    /// Of the force channels \[s\].
    delay: f64,
    answers: Option<Answers<'a, N>>,
    memory: Memory,
}

impl<'a, const N: usize> Instrument<'a, N> {
    /// From the first sample on.
    ///
    /// * `motion` - `course` at the samples of the trial
    /// * `delay` - of the force channels \[s\]
    pub fn new(
        (model, unknowns): (&'a Model<N>, &'a [Unknown]),
        trial: &'a Trial<N>,
        (course, motion): (&'a Course<N>, &'a Kinematics<N>),
        delay: f64,
    ) -> Self {
        Self {
            building: Building::new((model, unknowns), trial, motion),
            course,
            delay,
            answers: (N > HELD).then(|| course.answers(model, unknowns)),
            memory: Memory::new(model),
        }
    }

    /// The rows of the next samples.
    pub fn next(&mut self, count: usize) -> Rows {
        let mut rows = self.building.next(count);
        let Building {
            model,
            unknowns,
            trial,
            motion,
            ..
        } = self.building;
        if let Some(answers) = &mut self.answers {
            for (column, more) in rows.columns.iter_mut().zip(answers.next(count)) {
                for (value, more) in column.iter_mut().zip(more) {
                    *value += more;
                }
            }
        }
        for (left, &i) in rows.rhs.chunks_exact_mut(N).zip(&rows.samples) {
            let (qd, qdd) = (&motion.qd[i], &motion.qdd[i]);
            let at = Sample::new(model, trial, (&trial.q[i], qd, qdd), i);
            self.memory.advance(&at.motion, 1.0 / trial.rate);
            let delayed = self.course.change_by_delay(self.delay, i);
            let rest = at.measured
                - static_torque(&model.chain, &at.pose, delayed, 0.0)
                - inverse_dynamics(&model.chain, &at.pose, qd, qdd)
                - resisting_torque(&model.fitted, &at.motion, &self.memory.fitted)
                - resisting_torque(&model.held, &at.motion, &self.memory.held);
            left.copy_from_slice(rest.as_slice());
        }
        for (unknown, column) in unknowns.iter().zip(&rows.columns) {
            let value = match unknown.source {
                Source::Segment(k, moment) => value_of(&model.chain, k, moment),
                Source::Effect(e, p) => model.fitted[e].parameters[p],
                Source::Calibration(Imperfection::TimeDelay) => self.delay,
                Source::Calibration(_) => continue,
            };
            for (rest, column) in rows.rhs.iter_mut().zip(column) {
                *rest += column * value;
            }
        }
        rows
    }
}

fn position(moment: Moment) -> usize {
    match moment {
        Moment::Mass => 0,
        Moment::Along => 1,
        Moment::Normal => 2,
        Moment::Inertia => 3,
    }
}

/// The model's own value of an inertial parameter.
pub fn value_of<const N: usize>(chain: &Chain<f64, N>, segment: usize, moment: Moment) -> f64 {
    let s = &chain.segments()[segment];
    match moment {
        Moment::Mass => s.mass,
        Moment::Along => s.mass * s.com[0],
        Moment::Normal => s.mass * s.com[1],
        Moment::Inertia => s.inertia + s.mass * (s.com[0] * s.com[0] + s.com[1] * s.com[1]),
    }
}

/// Derivative of the resisting torques to one parameter of one effect.
pub(crate) fn gradient<const N: usize>(
    effect: &Effect<f64>,
    p: usize,
    motion: &Motion<f64, N>,
    memory: f64,
) -> Joints<f64, N> {
    let mut column = Joints::zeros();
    if effect.index < N {
        let value = effect.gradient(&motion.local(effect.index, memory))[p];
        column[effect.index] = value;
        if effect.index > 0 {
            column[effect.index - 1] = effect.proximal_share() * value;
        }
    }
    column
}

/// The states of effects that have one, carried along the motion.
pub(crate) struct Memory {
    pub(crate) fitted: Vec<f64>,
    pub(crate) held: Vec<f64>,
    effects: (Vec<Effect<f64>>, Vec<Effect<f64>>),
}

impl Memory {
    pub(crate) fn new<const N: usize>(model: &Model<N>) -> Self {
        Self {
            fitted: vec![0.0; model.fitted.len()],
            held: vec![0.0; model.held.len()],
            effects: (model.fitted.clone(), model.held.clone()),
        }
    }

    /// One sampling interval in ten steps, the motion taken as constant in it.
    pub(crate) fn advance<const N: usize>(&mut self, motion: &Motion<f64, N>, interval: f64) {
        const STEPS: usize = 10;
        let lists = [
            (&self.effects.0, &mut self.fitted),
            (&self.effects.1, &mut self.held),
        ];
        for (effects, states) in lists {
            for (effect, state) in effects.iter().zip(states.iter_mut()) {
                if effect.kind.info().memory {
                    for _ in 0..STEPS {
                        let local = motion.local(effect.index, *state);
                        *state += effect.memory_rate(&local) * interval / STEPS as f64;
                    }
                }
            }
        }
    }
}

/// One sample: what moves and what was measured.
struct Sample<const N: usize> {
    pose: Pose<f64, N>,
    motion: Motion<f64, N>,
    measured: Joints<f64, N>,
}

impl<const N: usize> Sample<N> {
    fn new(
        model: &Model<N>,
        trial: &Trial<N>,
        (q, qd, qdd): (&Joints<f64, N>, &Joints<f64, N>, &Joints<f64, N>),
        i: usize,
    ) -> Self {
        let pose = Pose::new(q);
        let force = trial.force_on_arm.as_ref().map_or([0.0; 2], |f| f[i]);
        let moment = trial.moment_on_arm.as_ref().map_or(0.0, |m| m[i]);
        let torque = trial.torque.as_ref().map_or_else(Joints::zeros, |t| t[i]);
        let joint = joint_force(&model.chain, &pose, (qd, qdd), force);
        let mut seen = Motion::new(i as f64 / trial.rate, *q, *qd).with_joint_force(&joint);
        seen.qdd = *qdd;
        Self {
            pose,
            motion: seen,
            measured: torque + static_torque(&model.chain, &pose, force, moment),
        }
    }
}
