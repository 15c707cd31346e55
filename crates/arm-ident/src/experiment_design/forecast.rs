//! Forecast of the precision with which a movement determines each parameter.
//!
//! A movement is simulated in the closed chain, its rows are those of [`joint`](crate::inference::joint_method), and noise of force and angle sensors is carried
//! through them to a covariance `H⁻¹ M H⁻¹`.

use arm_core::effect::resisting_torque;
use arm_core::{Joints, Limits, Pose, Robot, Setup, Shape, jacobian};
use arm_sim::{Coupling, Drive, Experiment, HandlePath, Movement, Recording, Start, simulate};

use crate::error::IdentError;
use crate::inference::constraint::base_parameters;
use crate::inference::summary::base_name;
use crate::regression::instrument::Instrument;
use crate::regression::internal_state::InternalStates;
use crate::regression::kinematics::Kinematics;
use crate::regression::preprocessing::{Pieces, filtered, with_rest_columns};
use crate::regression::sensitivity::{Course, parts};
use crate::regression::trial::{Model, Tolerance, Trial};
use crate::regression::unknown::{Source, Unknown, unknowns};
use arm_numerics::NumericsError;
use arm_numerics::statistics::sandwich_covariance::{SandwichCovariance, standard_error};
use arm_numerics::{Condenser, Factor, Matrix};

/// Step of the simulations \[s\]: the fourth-order integrator holds stiff contacts with it.
const STEP: f64 = 1e-3;
/// Factor on prior standard deviations where an estimate shall rest on the data alone.
const HARDLY_KNOWN: f64 = 30.0;
/// Prior standard deviation of a parameter of an effect, SI unit.
const ANY_EFFECT: f64 = 30.0;
/// A parameter that is smaller than this is known relative to this, SI unit.
const SMALL: f64 = 0.05;

/// Covariance of the torques of one sample \[N² m²\].
type Covariance<const N: usize> = [[f64; N]; N];

/// Sampling, filtering and noise of the sensors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Accuracy {
    /// Samples a second \[Hz\].
    pub rate: f64,
    /// Cutoff of the low-pass \[Hz\].
    pub cutoff: f64,
    /// Deviation of a single force sample \[N\].
    pub force: f64,
    /// Deviation of a single angle sample \[rad\].
    pub angle: f64,
}

/// One movement and how often it is made.
#[derive(Clone, Debug, PartialEq)]
pub struct Task<const N: usize> {
    /// Angles \[rad\].
    pub waypoints: Vec<Joints<f64, N>>,
    /// Largest speed of a joint \[rad/s\].
    pub speed: f64,
    /// Largest acceleration of a joint \[rad/s²\].
    pub acceleration: f64,
    /// Shape of the ramps.
    pub shape: Shape,
    /// Rest in each waypoint \[s\].
    pub pause: f64,
    /// Trials.
    pub repeats: usize,
}

/// Input of a forecast.
#[derive(Clone, Debug)]
pub struct Question<const N: usize> {
    /// The assumed arm, with the effects that are to be fitted at assumed values.
    pub model: Model<N>,
    /// The robot that has to reach the path.
    pub robot: Option<Robot<f64>>,
    /// Tolerances of the calibration.
    pub tolerance: Tolerance,
    /// Sampling, filtering and noise of the sensors.
    pub accuracy: Accuracy,
}

/// How well one parameter will be known.
#[derive(Clone, Debug, PartialEq)]
pub struct Predicted {
    /// Name as identification gives it.
    pub name: String,
    /// SI unit.
    pub unit: &'static str,
    /// Index of the fitted effect, for its parameters.
    pub effect: Option<usize>,
    /// Assumed value.
    pub value: f64,
    /// Standard deviation to be expected, with the priors.
    pub std: f64,
    /// The same from the data alone, the calibration within its tolerance.
    pub std_of_data: f64,
}

impl Predicted {
    /// Relative standard deviation from the data alone; small values count as a small one.
    pub fn relative(&self) -> f64 {
        self.std_of_data
            / self
                .value
                .abs()
                .max(SMALL * if self.effect.is_some() { 1.0 } else { 0.0 })
    }
}

/// Forecast of a set of movements: certainty of the parameters, and the load of the robot.
#[derive(Clone, Debug, PartialEq)]
pub struct MovementForecast {
    /// Base parameters and parameters of effects.
    pub predicted: Vec<Predicted>,
    /// Largest force on the arm \[N\].
    pub force: f64,
    /// Largest speed of a joint \[rad/s\].
    pub speed: f64,
    /// Largest speed of a joint of the robot, zero without one \[rad/s\].
    pub robot_speed: f64,
    /// Largest acceleration of a joint of the robot, zero without one \[rad/s²\].
    pub robot_acceleration: f64,
    /// Time of all trials together \[s\].
    pub duration: f64,
    /// Duration of one trial of each movement \[s\].
    pub durations: Vec<f64>,
}

impl MovementForecast {
    /// The worst relative standard deviation from the data alone.
    pub fn worst(&self) -> f64 {
        self.predicted
            .iter()
            .map(Predicted::relative)
            .fold(0.0, f64::max)
    }
}

/// Predicts how well movements determine the parameters.
///
/// # Errors
/// [`IdentError`] for movements that cannot be made, and when nothing is to be fitted.
pub fn forecast<const N: usize>(
    question: &Question<N>,
    tasks: &[Task<N>],
) -> Result<MovementForecast, IdentError> {
    let seen = tasks
        .iter()
        .map(|task| Seen::of(question, task))
        .collect::<Result<Vec<_>, _>>()?;
    said(question, tasks, &seen)
}

/// The certainty of the parameters from simulated movements.
pub(crate) fn said<const N: usize>(
    question: &Question<N>,
    tasks: &[Task<N>],
    seen: &[Seen<N>],
) -> Result<MovementForecast, IdentError> {
    let model = &question.model;
    let first: Vec<&Trial<N>> = seen.iter().map(|s| &s.trial).collect();
    let unknowns = unknowns(model, &question.tolerance, &first);
    let pieces = seen
        .iter()
        .map(|Seen { trial, course, .. }| {
            let motion = course.at_samples();
            let mut rows = Instrument::new((model, &unknowns), trial, (course, &motion), 0.0);
            let (cutoff, width) = (question.accuracy.cutoff, rows.building.width());
            let pieces = filtered(trial, cutoff, width, |count| rows.next(count))?;
            Ok(with_rest_columns(pieces, unknowns.len()))
        })
        .collect::<Result<Vec<Pieces>, IdentError>>()?;
    let torque_noise: Vec<Vec<Covariance<N>>> = seen
        .iter()
        .map(|s| noise_of(question, &s.trial, &s.course.at_samples()))
        .collect();
    let (bread, meat) = condensed(question, tasks, (&pieces, &torque_noise), unknowns.len())?;
    let covariance = covariance(&bread, &meat, &unknowns, |u| u.sd)?;
    let data_only = self::covariance(&bread, &meat, &unknowns, |u| match u.source {
        Source::Calibration(_) => u.sd,
        Source::Effect(..) | Source::RestTorque(..) => ANY_EFFECT,
        Source::Segment(..) => HARDLY_KNOWN * u.mean.abs().max(u.sd),
    })?;
    let mut predicted = Vec::new();
    let mut push = |name, unit, effect, value: f64, w: &[f64]| -> Result<(), IdentError> {
        predicted.push(Predicted {
            name,
            unit,
            effect,
            value,
            std: standard_error(&covariance, w)?,
            std_of_data: standard_error(&data_only, w)?,
        });
        Ok(())
    };
    for (i, (w, value)) in base_parameters(&unknowns, model).iter().enumerate() {
        let (name, unit) = base_name::<N>(i);
        push(name, unit, None, *value, w)?;
    }
    for (u, unknown) in unknowns.iter().enumerate() {
        if let Source::Effect(e, p) = unknown.source {
            let w: Vec<f64> = (0..unknowns.len())
                .map(|k| if k == u { 1.0 } else { 0.0 })
                .collect();
            let value = model.fitted[e].parameters[p];
            let name = model.fitted[e].kind.info().parameters[p].name.to_owned();
            push(name, unknown.unit, Some(e), value, &w)?;
        }
    }
    if predicted.is_empty() {
        return Err(IdentError::Numerics(NumericsError::TooFew {
            name: "parameters to plan for",
            found: 0,
            expected: 1,
        }));
    }
    let most = |of: fn(&Demand) -> f64| seen.iter().map(|s| of(&s.demand)).fold(0.0, f64::max);
    let durations: Vec<f64> = seen.iter().map(|s| s.demand.duration).collect();
    Ok(MovementForecast {
        predicted,
        force: most(|d| d.force),
        speed: most(|d| d.speed),
        robot_speed: most(|d| d.robot_speed),
        robot_acceleration: most(|d| d.robot_acceleration),
        duration: durations
            .iter()
            .zip(tasks)
            .map(|(d, t)| d * t.repeats as f64)
            .sum(),
        durations,
    })
}

/// Load of arm and robot in one movement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Demand {
    /// Largest force on the arm \[N\].
    pub force: f64,
    /// Largest speed of a joint \[rad/s\].
    pub speed: f64,
    /// Largest speed of a joint of the robot, zero without one \[rad/s\].
    pub robot_speed: f64,
    /// Largest acceleration of a joint of the robot, zero without one \[rad/s²\].
    pub robot_acceleration: f64,
    /// Duration of one trial \[s\].
    pub duration: f64,
}

impl Demand {
    fn of<const N: usize>(recording: &Recording<N>) -> Self {
        let largest = |values: &[f64]| values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let force = recording.force_on_arm.chunks_exact(2);
        Self {
            force: force.map(|f| libm::hypot(f[0], f[1])).fold(0.0, f64::max),
            speed: largest(&recording.qd),
            robot_speed: largest(&recording.robot_qd),
            robot_acceleration: largest(&recording.robot_qdd),
            duration: recording.time[recording.len() - 1],
        }
    }
}

/// A movement in the closed chain, as a trial without noise.
pub(crate) struct Seen<const N: usize> {
    trial: Trial<N>,
    course: Course<N>,
    /// Load of arm and robot.
    pub demand: Demand,
}

impl<const N: usize> Seen<N> {
    pub fn of(question: &Question<N>, task: &Task<N>) -> Result<Self, IdentError> {
        let model = &question.model;
        let limits = Limits {
            speed: task.speed,
            acceleration: task.acceleration,
        };
        let movement = Movement::within(task.shape, &task.waypoints, &[limits; N], task.pause)?;
        let interval = 1.0 / question.accuracy.rate;
        let duration = libm::ceil(movement.duration() / interval - 1e-9).max(4.0) * interval;
        let drive = Drive::Handle {
            path: HandlePath::of_arm(model.chain, movement),
            coupling: Coupling::Compliant,
        };
        let mut experiment =
            Experiment::new(Setup::new(&model.chain, model.contact), drive, duration);
        experiment.effects = model.fitted.iter().chain(&model.held).copied().collect();
        experiment.robot = question.robot;
        experiment.start = Start::Equilibrium {
            near: task.waypoints[0],
        };
        let parts = parts(question.accuracy.rate);
        let finer = interval / parts as f64;
        experiment.dt = finer / libm::ceil(finer / STEP);
        experiment.output_interval = Some(finer);
        let recording = simulate(&experiment)?;
        let course = Course::new(&recording, question.accuracy.rate, parts);
        let trial = Trial {
            force_on_arm: Some(course.force_at_samples()),
            ..Trial::new(question.accuracy.rate, course.at_samples().q)
        };
        Ok(Self {
            trial,
            course,
            demand: Demand::of(&recording),
        })
    }
}

/// Covariance of the torque residual of a single sample, at every sample \[N² m²\].
///
/// The forces act through the Jacobian. Angles move everything on the left-hand side that depends on them, at the speeds and accelerations
/// of the simulated motion: inertia, gravity, springs and the lever arms of the force.
fn noise_of<const N: usize>(
    question: &Question<N>,
    trial: &Trial<N>,
    motion: &Kinematics<N>,
) -> Vec<Covariance<N>> {
    let model = &question.model;
    let chain = &model.chain;
    let Accuracy { force, angle, .. } = question.accuracy;
    let mut memory = InternalStates::new(model);
    let forces = trial.force_on_arm.as_deref().unwrap_or_default();
    motion
        .q
        .iter()
        .zip(&motion.qd)
        .zip(&motion.qdd)
        .zip(forces)
        .enumerate()
        .map(|(i, (((q, qd), qdd), &f))| {
            let moving = |q: &Joints<f64, N>| trial.motion(i, q, qd);
            memory.advance(&moving(q), 1.0 / trial.rate);
            let residual = |q: &Joints<f64, N>| {
                let (pose, motion) = (Pose::new(q), moving(q));
                arm_core::inverse_dynamics(chain, &pose, qd, qdd)
                    + resisting_torque(&model.fitted, &motion, &memory.fitted)
                    + resisting_torque(&model.held, &motion, &memory.held)
                    - arm_core::static_torque(chain, &pose, f, 0.0)
            };
            let j = jacobian(chain, &Pose::new(q));
            let here = residual(q);
            let mut covariance = [[0.0; N]; N];
            let columns = (0..N).map(|k| {
                let mut moved = *q;
                moved[k] += SMALL_ANGLE;
                (residual(&moved) - here) / SMALL_ANGLE * angle
            });
            let axes = (0..2).map(|axis| Joints::<f64, N>::from_fn(|i, _| j[(axis, i)] * force));
            for column in columns.chain(axes) {
                for a in 0..N {
                    for b in 0..N {
                        covariance[a][b] += column[a] * column[b];
                    }
                }
            }
            covariance
        })
        .collect()
}

/// A step of an angle for a difference quotient \[rad\].
const SMALL_ANGLE: f64 = 1e-6;

/// Factors of `Σ Yᵀ C⁻¹ Y` and of `Σ Yᵀ C⁻¹ S C⁻¹ Y`, with S the noise of a sample and C its mean, by which identification weighs.
fn condensed<const N: usize>(
    question: &Question<N>,
    tasks: &[Task<N>],
    (pieces, noise): (&[Pieces], &[Vec<Covariance<N>>]),
    p: usize,
) -> Result<(Factor, Factor), IdentError> {
    let accuracy = question.accuracy;
    // White noise through the low-pass and the decimation: each kept sample replaces so many.
    let step = ((accuracy.rate / (2.5 * accuracy.cutoff)) as usize).max(1) as f64;
    let mut mean = [[0.0; N]; N];
    let count: f64 = noise.iter().map(|n| n.len() as f64).sum();
    for sample in noise.iter().flatten() {
        for a in 0..N {
            for b in 0..N {
                mean[a][b] += sample[a][b] / count;
            }
        }
    }
    let whitener = inverse_root(&mean);
    let (mut bread, mut meat) = (Condenser::new(p), Condenser::new(p));
    let mut row = vec![0.0; p];
    for ((task, pieces), noise) in tasks.iter().zip(pieces).zip(noise) {
        let weight = (step * task.repeats as f64).sqrt();
        for piece in pieces {
            for (i, &sample) in piece.samples.iter().enumerate() {
                // L⁻¹ S L⁻ᵀ = G Gᵀ, so that the score has the root Gᵀ L⁻¹ Y.
                let white = congruent(&whitener, &noise[sample]);
                let root = lower_root(&white);
                let mut weighed = vec![[0.0; N]; p];
                for (u, column) in piece.columns.iter().enumerate() {
                    for a in 0..N {
                        weighed[u][a] = (0..=a)
                            .map(|b| whitener[a][b] * column[i * N + b])
                            .sum::<f64>();
                    }
                }
                for a in 0..N {
                    for (value, w) in row.iter_mut().zip(&weighed) {
                        *value = weight * w[a];
                    }
                    bread.push(&row, 0.0)?;
                    for (value, w) in row.iter_mut().zip(&weighed) {
                        *value = weight * (a..N).map(|b| root[b][a] * w[b]).sum::<f64>();
                    }
                    meat.push(&row, 0.0)?;
                }
            }
        }
    }
    Ok((bread.finish(), meat.finish()))
}

/// `(H + P)⁻¹ (M + P) (H + P)⁻¹` with the prior P of deviations `sd`.
fn covariance(
    bread: &Factor,
    meat: &Factor,
    unknowns: &[Unknown],
    sd: impl Fn(&Unknown) -> f64,
) -> Result<Matrix, IdentError> {
    let zero = vec![0.0; unknowns.len()];
    let sd: Vec<f64> = unknowns
        .iter()
        .map(|u| {
            let sd = sd(u);
            if sd.is_finite() { sd } else { ANY_EFFECT }
        })
        .collect();
    let known = bread.with_prior(&zero, &sd)?;
    let spread = meat.with_prior(&zero, &sd)?;
    let score = spread.r.transpose_product(&spread.r);
    Ok(SandwichCovariance::new(&known.r, &[])?.sandwich(&score)?)
}

/// Lower triangular `G` with `G Gᵀ` the matrix; directions without noise stay zero.
fn lower_root<const N: usize>(m: &[[f64; N]; N]) -> [[f64; N]; N] {
    let largest = (0..N).map(|j| m[j][j]).fold(f64::MIN_POSITIVE, f64::max);
    let mut lower = [[0.0; N]; N];
    for j in 0..N {
        for k in 0..=j {
            let value = (0..k).fold(m[j][k], |v, i| v - lower[j][i] * lower[k][i]);
            lower[j][k] = if j == k {
                value.max(0.0).sqrt()
            } else if lower[k][k] > 1e-9 * largest.sqrt() {
                value / lower[k][k]
            } else {
                0.0
            };
        }
    }
    lower
}

/// Inverse of the lower root; identification too takes no direction for more than a thousand times as certain as another.
fn inverse_root<const N: usize>(m: &[[f64; N]; N]) -> [[f64; N]; N] {
    let largest = (0..N).map(|j| m[j][j]).fold(f64::MIN_POSITIVE, f64::max);
    let mut regular = *m;
    for (j, row) in regular.iter_mut().enumerate() {
        row[j] += 1e-3 * largest;
    }
    let lower = lower_root(&regular);
    let mut inverse = [[0.0; N]; N];
    for column in 0..N {
        for j in column..N {
            let start = if j == column { 1.0 } else { 0.0 };
            let value = (column..j).fold(start, |v, k| v - lower[j][k] * inverse[k][column]);
            inverse[j][column] = value / lower[j][j];
        }
    }
    inverse
}

/// `L S Lᵀ` for lower triangular L.
fn congruent<const N: usize>(l: &[[f64; N]; N], s: &[[f64; N]; N]) -> [[f64; N]; N] {
    let half: [[f64; N]; N] = core::array::from_fn(|i| {
        core::array::from_fn(|k| (0..=i).map(|a| l[i][a] * s[a][k]).sum())
    });
    core::array::from_fn(|i| core::array::from_fn(|k| (0..=k).map(|a| half[i][a] * l[k][a]).sum()))
}
