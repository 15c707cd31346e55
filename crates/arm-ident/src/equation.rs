//! The equation of motion of every sample as rows of a linear regression.
//!
//! One row a joint: `Y π + R(ρ) + C c = τ + Jᵀ F − R_held − rotor`, with inertial parameters π, linear parameters ρ of the
//! fitted effects and small imperfections c of the measurement, each through its first-order influence on the row.

use arm_core::effect::{Effect, Motion, resisting_torque};
use arm_core::{Chain, Joints, Pose, inverse_dynamics, joint_force, regressor, static_torque};

use crate::calibration::{influence, predicted_force};
use crate::response::{Course, HELD};
use crate::trial::{Model, Trial};
use crate::unknown::{Imperfection, Moment, Source, Unknown};

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
}

/// Builds the rows of a trial for given unknowns.
///
/// The measured forces act through the Jacobian of `motion`, so that the same filter reaches both sides later.
pub fn rows<const N: usize>(
    model: &Model<N>,
    unknowns: &[Unknown],
    trial: &Trial<N>,
    motion: &Kinematics<N>,
) -> Rows {
    let samples = trial.len();
    let mut columns = vec![vec![0.0; samples * N]; unknowns.len()];
    let mut rhs = vec![0.0; samples * N];
    let predicted = predicted_force(model, trial, motion);
    let mut memory = Memory::new(model);
    for i in 0..samples {
        let at = Sample::new(model, trial, motion, i);
        memory.advance(&at.motion, 1.0 / trial.rate);
        let measured = at.measured - resisting_torque(&model.held, &at.motion, &memory.held);
        rhs[i * N..(i + 1) * N].copy_from_slice(measured.as_slice());
        let y = regressor(&model.chain, &at.pose, &at.motion.qd, &at.motion.qdd);
        let fixed = inverse_dynamics(&model.chain, &at.pose, &at.motion.qd, &at.motion.qdd);
        let inertial: [[Joints<f64, N>; 4]; N] =
            core::array::from_fn(|k| y.segment_columns(&model.chain, k));
        let mut explained = Joints::<f64, N>::zeros();
        for (u, unknown) in unknowns.iter().enumerate() {
            let column = match unknown.source {
                Source::Segment(k, moment) => inertial[k][position(moment)],
                Source::Effect(e, p) => gradient(&model.fitted[e], p, &at.motion, memory.fitted[e]),
                Source::Calibration(what) => {
                    influence(model, trial, motion, (&predicted, &memory, i), what)
                }
            };
            if let Source::Segment(k, moment) = unknown.source {
                explained += column * value_of(&model.chain, k, moment);
            }
            columns[u][i * N..(i + 1) * N].copy_from_slice(column.as_slice());
        }
        // What the rigid arm does besides the unknown moments: rotors, held normal moments, held segments.
        for j in 0..N {
            rhs[i * N + j] -= fixed[j] - explained[j];
        }
    }
    Rows {
        columns,
        rhs,
        samples: (0..samples).collect(),
        fits: None,
    }
}

/// Puts rows built along a simulated motion in the place of those along measured angles, without the noise of the latter.
///
/// Angles with noise must not stand in columns: a wrist that hangs between forearm and handle moves little more than its
/// noise, and a spring read off such angles comes out too soft, with everything that hangs on it. The columns Z stay those of the
/// simulated motion, with what each unknown changes of it; the right-hand side becomes `τ − Y(q) x + Z x` with the measured angles q and
/// the model's own values x. The fit stands still where `Zᵀ (τ − Y(q) x) = 0`: Z are instruments, and the residual is that of the measured angles.
///
/// A `delay` of the force channels \[s\], as it was last estimated, shifts the force of the simulated motion. Its first order alone would not do:
/// of a force that swings five times a second, ten milliseconds take 5 % in the second order, which a fit buys with gains and masses.
pub(crate) fn instrument<const N: usize>(
    rows: &mut Rows,
    (model, unknowns): (&Model<N>, &[Unknown]),
    trial: &Trial<N>,
    (course, delay): (&Course<N>, f64),
) {
    if N > HELD {
        for (column, more) in rows.columns.iter_mut().zip(course.columns(model, unknowns)) {
            for (value, more) in column.iter_mut().zip(more) {
                *value += more;
            }
        }
    }
    let mut motion = course.at_samples();
    motion.q.clone_from(&trial.q);
    let mut memory = Memory::new(model);
    let delayed = course.change_by_delay(delay);
    for i in 0..trial.len() {
        let at = Sample::new(model, trial, &motion, i);
        memory.advance(&at.motion, 1.0 / trial.rate);
        let left = at.measured
            - static_torque(&model.chain, &at.pose, delayed[i], 0.0)
            - inverse_dynamics(&model.chain, &at.pose, &motion.qd[i], &motion.qdd[i])
            - resisting_torque(&model.fitted, &at.motion, &memory.fitted)
            - resisting_torque(&model.held, &at.motion, &memory.held);
        rows.rhs[i * N..(i + 1) * N].copy_from_slice(left.as_slice());
    }
    for (unknown, column) in unknowns.iter().zip(&rows.columns) {
        let value = match unknown.source {
            Source::Segment(k, moment) => value_of(&model.chain, k, moment),
            Source::Effect(e, p) => model.fitted[e].parameters[p],
            Source::Calibration(Imperfection::TimeDelay) => delay,
            Source::Calibration(_) => continue,
        };
        for (rest, column) in rows.rhs.iter_mut().zip(column) {
            *rest += column * value;
        }
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
    fn new(model: &Model<N>, trial: &Trial<N>, motion: &Kinematics<N>, i: usize) -> Self {
        let pose = Pose::new(&motion.q[i]);
        let force = trial.force_on_arm.as_ref().map_or([0.0; 2], |f| f[i]);
        let moment = trial.moment_on_arm.as_ref().map_or(0.0, |m| m[i]);
        let torque = trial.torque.as_ref().map_or_else(Joints::zeros, |t| t[i]);
        let joint = joint_force(&model.chain, &pose, (&motion.qd[i], &motion.qdd[i]), force);
        let mut seen =
            Motion::new(i as f64 / trial.rate, motion.q[i], motion.qd[i]).with_joint_force(&joint);
        seen.qdd = motion.qdd[i];
        Self {
            pose,
            motion: seen,
            measured: torque + static_torque(&model.chain, &pose, force, moment),
        }
    }
}
