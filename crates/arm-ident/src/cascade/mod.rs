//! The cascade of thesis section 3.5.1: wrist, elbow, shoulder, one small problem a joint, quasi-static.
//!
//! Joint j has the unknowns `m_j l_j`, `m_{j+1}`, a constant passive moment `τ_pj` and a dissipative torque `d_j`:
//!
//! `g [cosθ_j, a_j cosθ_j] [m_j l_j, m_{j+1}]ᵀ + τ_pj + d_j s_j = (JᵀF)_j − g Σ_{k>j} cosθ_k X_k − g a_j cosθ_j Σ_{k>j+1} m_k`
//!
//! with θ_j = q_1 + … + q_j, F the force **on the arm**, s_j the direction of motion (−1 … 1, by the law of the effect), `X_k = m_k l_k + a_k Σ_{i>k} m_i`
//! from the steps before, and bounds `l_b ≤ π ≤ u_b` (equation 3.30).
//!
//! Where this departs from the text:
//! - one sign for F throughout (equations 3.18 and 3.23 contradict each other), and `cos123` where 3.24 has `cos12`;
//! - the first two columns are multiples of each other: only X_j can be read from data. What `m_j l_j` and `m_{j+1}` come out
//!   as is the point of the line `X_j = const` that lies nearest to the model, or a bound, and is labelled so;
//! - d_j is a regression on the direction of motion in the same problem. The mean of |residual| (equation 3.32) is 0.8 σ
//!   where there is no friction at all;
//! - where a joint with dry friction rests or turns, friction is anything between −d_j and d_j: these rows of that joint are left
//!   out. They would pull d_j towards zero, and X_j with it. The other joints' rows of the same samples know nothing of d_j, and stay;
//! - the same zero-phase low-pass acts on torque and regressors.
//!
//! The joint method (`joint`) is better in every respect; the cascade is for comparison with the thesis.

pub mod quasi_static;

use arm_core::effect::{Effect, Kind, Motion, resisting_torque};
use arm_core::{Chain, Joints, Pose, gravity, joint_force, regressor, static_torque};

use crate::error::IdentError;
use crate::inference::estimate::{Estimate, Identified};
use crate::inference::independent_blocks::cluster_ranges;
use crate::inference::joint_method::{explain, physical_columns, root_mean_square};
use crate::inference::rank::{RankOptions, analyse};
use crate::inference::summary::{Certainty, RANK_TOLERANCE, Spread, base_name};
use crate::regression::calibration::{Nearby, Prediction, influence as of_calibration};
use crate::regression::equation::{Kinematics, Memory, Rows, gradient, value_of};
use crate::regression::measured_motion::{candidates, low_pass, speed, speed_noise};
use crate::regression::preprocessing::{Pieces, filtered};
use crate::regression::trial::{Model, Role, Tolerance, Trial};
use crate::regression::unknown::{LEAST_MASS, Moment, Source, Unknown, calibration};
use arm_numerics::NumericsError;
use arm_numerics::error::check_range;
use arm_numerics::least_squares::program::{Program, Status};
use arm_numerics::statistics::autoregressive::effective_samples;
use arm_numerics::statistics::sandwich_covariance::SandwichCovariance;
use arm_numerics::{Condenser, Factor, Matrix};

/// Direction is read from angles below this frequency \[Hz\]: a quasi-static movement has nothing above.
const DIRECTION_CUTOFF: f64 = 1.0;
/// A joint moves where its speed is this many standard deviations of the speed's noise.
const DEAD_BAND: f64 = 3.0;
/// Slowest speed that counts as motion \[rad/s\], however little noise there is.
const SLOWEST: f64 = 1e-4;
/// Periods of the direction's cutoff next to rest or a turn that do not count as motion: the filter moves a start forward by no more,
/// and its ringing beside a movement has one sign for less than twice as long.
const TURN: f64 = 0.5;
/// Fewest stretches of data in which a joint has rows; with fewer nothing tells how sure its values are.
const FEWEST: usize = 2;
/// Residual, relative to the torques, assumed before the first fit.
const FIRST_GUESS: f64 = 0.05;

/// Choices of the cascade.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Cutoff of the common low-pass \[Hz\]; 5 Hz, the thesis' own, when absent.
    pub cutoff: Option<f64>,
    /// Half width of the box `l_b … u_b` around the model, in its standard deviations.
    pub bound_width: f64,
    /// What the calibration promises: it widens the intervals, and is not refitted.
    pub tolerance: Tolerance,
    /// Probability of the intervals.
    pub level: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            cutoff: None,
            bound_width: 3.0,
            tolerance: Tolerance::default(),
            level: 0.95,
        }
    }
}

/// Identifies by the cascade on the trials whose role is [`Role::Fit`]; the others are only explained.
///
/// Fitted effects of kind `coulomb` are the dissipative torques. The passive moment of a joint is free where
/// `constant_moment` is fitted there, else it is pinned to zero (thesis section 3.5.2). Other fitted effects keep the
/// values of the model. Inertia is left out, that of motors too.
///
/// # Errors
/// [`IdentError`] when there is nothing to fit on, no force or torque acts, or a trial is too short for the filter.
pub fn identify<const N: usize>(
    model: &Model<N>,
    trials: &[Trial<N>],
    options: &Options,
) -> Result<Identified<N>, IdentError> {
    check_range("bound_width", options.bound_width, [0.0, f64::MAX])?;
    let fit: Vec<&Trial<N>> = trials.iter().filter(|t| t.role == Role::Fit).collect();
    let loaded = fit.iter().filter(|t| !t.is_unloaded()).count();
    if loaded == 0 {
        return Err(IdentError::Numerics(NumericsError::TooFew {
            name: "trials with role fit in which a force or torque acts",
            found: 0,
            expected: 1,
        }));
    }
    let mut unknowns = unknowns(model, options.bound_width);
    if unknowns.is_empty() {
        return Err(IdentError::Numerics(NumericsError::TooFew {
            name: "unknowns",
            found: 0,
            expected: 1,
        }));
    }
    unknowns.extend(calibration::<N>(&options.tolerance, &fit));
    let cutoff = options.cutoff.unwrap_or(candidates(&fit)[0]);
    let prepared = trials
        .iter()
        .map(|t| Building::new((model, &unknowns), t, cutoff)?.filtered(cutoff))
        .collect::<Result<Vec<Pieces>, _>>()?;
    let fitted: Vec<&Pieces> = prepared
        .iter()
        .zip(trials)
        .filter(|(_, t)| t.role == Role::Fit)
        .map(|(p, _)| p)
        .collect();
    let ranges = cluster_ranges(&fitted)?;

    let mut x: Vec<f64> = unknowns.iter().map(|u| u.mean).collect();
    let mut steps = Vec::with_capacity(N);
    for joint in (0..N).rev() {
        let mut clusters = ranges
            .iter()
            .map(|cluster| condensed::<N>(cluster, joint, unknowns.len()))
            .collect::<Result<Vec<_>, _>>()?;
        if informed(&clusters) < FEWEST {
            clusters.fill(Condenser::new(unknowns.len()).finish());
        }
        let series: Vec<&Rows> = fitted.iter().flat_map(|p| p.iter()).collect();
        steps.push(step::<N>(
            &unknowns,
            own(model, &unknowns, joint),
            (joint, clusters, &series),
            &mut x,
        )?);
    }
    summarise(
        model,
        &unknowns,
        &steps,
        (&x, options.level, cutoff),
        &prepared,
    )
}

/// One joint's problem and its solution.
struct Step {
    /// Indices of the unknowns that are found here.
    own: Vec<usize>,
    /// Own unknowns on a bound: −1, 0, 1.
    active: Vec<i8>,
    /// Weighed rows of this joint, all unknowns, for each cluster.
    clusters: Vec<Factor>,
    /// Their sum.
    data: Factor,
    /// In the own unknowns, with the prior.
    posterior: Factor,
    /// How the solver ended.
    status: Status,
}

impl Step {
    /// Whether there is anything to find the joint's unknowns from.
    fn has_data(&self) -> bool {
        self.data.rows > 0
    }
}

/// Number of clusters in which a joint has rows.
fn informed(clusters: &[Factor]) -> usize {
    clusters.iter().filter(|c| c.rows > 0).count()
}

/// The unknowns: `m_2, m_1 l_1, …` of the segments, then passive moments and dissipative torques.
pub(crate) fn unknowns<const N: usize>(model: &Model<N>, width: f64) -> Vec<Unknown> {
    let mut list = Vec::new();
    let u = model.segment_uncertainty;
    if u > 0.0 {
        for k in 0..N {
            // The first segment's mass lies on no lever.
            let moments: &[Moment] = if k == 0 {
                &[Moment::Along]
            } else {
                &[Moment::Mass, Moment::Along]
            };
            list.extend(moments.iter().map(|&moment| {
                let mean = value_of(&model.chain, k, moment);
                let s = &model.chain.segments()[k];
                // Mass and centre of mass are uncertain independently: the product has both uncertainties.
                let (name, unit, sd, least) = match moment {
                    Moment::Mass => (format!("m{}", k + 1), "kg", u * mean, LEAST_MASS),
                    _ => (
                        format!("m{0}*l{0}", k + 1),
                        "kg m",
                        u * f64::max(
                            core::f64::consts::SQRT_2 * mean.abs(),
                            1e-3 * s.mass * s.length,
                        ),
                        0.0,
                    ),
                };
                Unknown {
                    source: Source::Segment(k, moment),
                    name,
                    unit,
                    mean,
                    sd,
                    min: (mean - width * sd).max(least),
                    max: mean + width * sd,
                }
            }));
        }
    }
    for (e, effect) in model.fitted.iter().enumerate().filter(|(_, e)| is_found(e)) {
        let info = effect.kind.info();
        let parameter = &info.parameters[0];
        list.push(Unknown {
            source: Source::Effect(e, 0),
            name: format!("{}{} {}", info.kind, effect.index + 1, parameter.name),
            unit: parameter.unit,
            mean: 0.0,
            sd: f64::INFINITY,
            min: parameter.min,
            max: parameter.max,
        });
    }
    list
}

/// Whether the cascade finds this effect's first parameter.
fn is_found(effect: &Effect<f64>) -> bool {
    matches!(effect.kind, Kind::Coulomb | Kind::ConstantMoment)
}

/// Indices of the unknowns that the step of a joint finds.
pub(crate) fn own<const N: usize>(
    model: &Model<N>,
    unknowns: &[Unknown],
    joint: usize,
) -> Vec<usize> {
    let belongs = |source| match source {
        Source::Segment(k, Moment::Along) => k == joint,
        Source::Segment(k, _) => k == joint + 1,
        Source::Effect(e, _) => model.fitted[e].index == joint,
        Source::Calibration(_) => false,
    };
    (0..unknowns.len())
        .filter(|&u| belongs(unknowns[u].source))
        .collect()
}

/// Quasi-static rows of a trial, a stretch after another: gravity and the static contact torque, inertia left out.
struct Building<'a, const N: usize> {
    model: &'a Model<N>,
    unknowns: &'a [Unknown],
    trial: &'a Trial<N>,
    /// Angles, without speeds and accelerations.
    still: Kinematics<N>,
    speed: Vec<Joints<f64, N>>,
    /// Where each joint moves.
    moves: [Vec<bool>; N],
    /// What is not found, held at its values.
    kept: Model<N>,
    memory: Memory,
    /// Where imperfections of the measurement are among the unknowns.
    prediction: Option<Prediction<N>>,
    /// Samples that are built.
    built: usize,
}

impl<'a, const N: usize> Building<'a, N> {
    fn new(
        (model, unknowns): (&'a Model<N>, &'a [Unknown]),
        trial: &'a Trial<N>,
        cutoff: f64,
    ) -> Result<Self, IdentError> {
        let (q, speed, moves) = motion(trial, cutoff)?;
        let rest = vec![Joints::zeros(); trial.len()];
        let kept = Model {
            fitted: Vec::new(),
            held: model
                .fitted
                .iter()
                .filter(|e| !is_found(e))
                .chain(&model.held)
                .copied()
                .collect(),
            ..model.clone()
        };
        Ok(Self {
            model,
            unknowns,
            trial,
            still: Kinematics {
                q,
                qd: rest.clone(),
                qdd: rest,
            },
            speed,
            moves,
            memory: Memory::new(&kept),
            prediction: Prediction::of_unknowns(unknowns, &kept),
            kept,
            built: 0,
        })
    }

    /// The rows of the trial, filtered and thinned, and which of them are fitted.
    fn filtered(mut self, cutoff: f64) -> Result<Pieces, IdentError> {
        let count = self.unknowns.len();
        let mut pieces = filtered(self.trial, cutoff, count, |count| self.next(count))?;
        if let Some(has) = has_friction(self.model) {
            let moves = &self.moves;
            for rows in &mut pieces {
                let fits = |&i: &usize| (0..N).map(move |j| !has[j] || moves[j][i]);
                rows.fits = Some(rows.samples.iter().flat_map(fits).collect());
            }
        }
        Ok(pieces)
    }

    /// The rows of the next samples.
    fn next(&mut self, count: usize) -> Rows {
        let samples = self.built..self.built + count;
        self.built += count;
        let mut rows = Rows::zeros::<N>(self.unknowns.len(), samples.collect());
        for k in 0..count {
            self.sample(&mut rows, k);
        }
        rows
    }

    fn sample(&mut self, rows: &mut Rows, k: usize) {
        let Self { model, trial, .. } = *self;
        let (kept, still) = (&self.kept, &self.still);
        let rest = Joints::<f64, N>::zeros();
        let i = rows.samples[k];
        let here = k * N..(k + 1) * N;
        let q = still.q[i];
        let pose = Pose::new(&q);
        let force = trial.force_on_arm.as_ref().map_or([0.0; 2], |f| f[i]);
        let joint = joint_force(&model.chain, &pose, (&rest, &rest), force);
        let at = Motion::new(i as f64 / trial.rate, q, self.speed[i]).with_joint_force(&joint);
        self.memory.advance(&at, 1.0 / trial.rate);
        let memory = &self.memory;
        let predicted = self.prediction.as_mut();
        let predicted = predicted.map_or_else(Nearby::default, |p| p.next(kept, trial, still));
        let moment = trial.moment_on_arm.as_ref().map_or(0.0, |m| m[i]);
        let mut measured = static_torque(&model.chain, &pose, force, moment)
            - resisting_torque(&kept.held, &at, &memory.held);
        if let Some(torque) = &trial.torque {
            measured += torque[i];
        }
        let y = regressor(&model.chain, &pose, &rest, &rest);
        let mut held = gravity(&model.chain, &pose);
        for (column, unknown) in rows.columns.iter_mut().zip(self.unknowns) {
            let value = match unknown.source {
                Source::Segment(k, moment) => {
                    let [mass, along, ..] = y.segment_columns(&model.chain, k);
                    let value = if moment == Moment::Mass { mass } else { along };
                    held -= value * unknown.mean;
                    value
                }
                Source::Effect(e, p) => gradient(&model.fitted[e], p, &at, 0.0),
                Source::Calibration(what) => {
                    of_calibration(kept, trial, still, (&predicted, memory, i), what)
                }
            };
            column[here.clone()].copy_from_slice(value.as_slice());
        }
        rows.rhs[here].copy_from_slice((measured - held).as_slice());
    }
}

/// The joints whose dry friction is found; none if there is no such joint.
fn has_friction<const N: usize>(model: &Model<N>) -> Option<[bool; N]> {
    let found = |j| {
        let mut effects = model.fitted.iter();
        effects.any(|e| e.kind == Kind::Coulomb && e.index == j)
    };
    let has = core::array::from_fn(found);
    has.contains(&true).then_some(has)
}

/// Angles at the common cutoff, speeds, and for every joint where it moves.
#[expect(clippy::type_complexity, reason = "three series")]
fn motion<const N: usize>(
    trial: &Trial<N>,
    cutoff: f64,
) -> Result<(Vec<Joints<f64, N>>, Vec<Joints<f64, N>>, [Vec<bool>; N]), IdentError> {
    let slow_cutoff = DIRECTION_CUTOFF.min(cutoff);
    let (filter, slow) = (
        low_pass(cutoff, trial.rate)?,
        low_pass(slow_cutoff, trial.rate)?,
    );
    let noise = speed_noise(trial, slow_cutoff);
    let mut q = vec![Joints::zeros(); trial.len()];
    let mut speeds = q.clone();
    let mut moves = core::array::from_fn(|_| Vec::new());
    let turn = libm::ceil(TURN * trial.rate / slow_cutoff) as usize;
    for j in 0..N {
        let raw: Vec<f64> = trial.q.iter().map(|q| q[j]).collect();
        let smooth = filter.both_ways(&raw)?;
        let qd = speed(trial, j, &slow)?;
        for i in 0..trial.len() {
            q[i][j] = smooth[i];
            speeds[i][j] = qd[i];
        }
        moves[j] = moving(&qd, f64::max(DEAD_BAND * noise[j], SLOWEST), turn);
    }
    Ok((q, speeds, moves))
}

/// Where a joint moves one way: at least so fast, and for that many samples before and after.
///
/// The ends of the series are no turns.
fn moving(speed: &[f64], least: f64, turn: usize) -> Vec<bool> {
    let way = |v: &f64| i8::from(*v >= least) - i8::from(*v <= -least);
    let mut moves = vec![false; speed.len()];
    let mut start = 0;
    for stretch in speed.chunk_by(|a, b| way(a) == way(b)) {
        let end = start + stretch.len();
        let from = if start == 0 { 0 } else { start + turn };
        let to = if end == speed.len() {
            end
        } else {
            end.saturating_sub(turn)
        };
        if way(&stretch[0]) != 0 && from < to {
            moves[from..to].fill(true);
        }
        start = end;
    }
    moves
}

/// Rows of one joint over the stretches of a cluster.
fn condensed<const N: usize>(
    cluster: &[(&Rows, core::ops::Range<usize>)],
    joint: usize,
    p: usize,
) -> Result<Factor, IdentError> {
    let mut condenser = Condenser::new(p);
    let mut row = vec![0.0; p];
    for (rows, range) in cluster {
        for i in range.clone() {
            let at = i * N + joint;
            if !rows.fits(at) {
                continue;
            }
            for (value, column) in row.iter_mut().zip(&rows.columns) {
                *value = column[at];
            }
            condenser.push(&row, rows.rhs[at])?;
        }
    }
    Ok(condenser.finish())
}

/// Solves one joint with the unknowns of the joints beyond it held at `x`, and writes its own into `x`.
fn step<const N: usize>(
    unknowns: &[Unknown],
    mut own: Vec<usize>,
    (joint, mut clusters, series): (usize, Vec<Factor>, &[&Rows]),
    x: &mut [f64],
) -> Result<Step, IdentError> {
    let mut data = merged(&clusters, unknowns.len())?;
    if data.rows == 0 {
        // What neither data nor a prior know anything of stays as it is.
        own.retain(|&u| unknowns[u].sd.is_finite());
    }
    let level = libm::sqrt(data.residual2(&vec![0.0; x.len()])? / data.rows.max(1) as f64);
    let mut variance = f64::max(FIRST_GUESS * level, f64::MIN_POSITIVE.sqrt());
    variance *= variance;
    let part = |values: fn(&Unknown) -> f64| -> Vec<f64> {
        own.iter().map(|&u| values(&unknowns[u])).collect()
    };
    let (mean, sd) = (part(|u| u.mean), part(|u| u.sd));
    let mut solved = None;
    for _ in 0..3 {
        let posterior = weighed(&data.restricted(&own, x)?, variance).with_prior(&mean, &sd)?;
        let (values, active, status) = bounded(&posterior, &own, unknowns)?;
        for (&u, value) in own.iter().zip(values) {
            x[u] = value;
        }
        solved = Some((posterior, active, status, variance));
        let next = residual_variance::<N>(series, x, joint)?;
        // Data without any noise (a check on exact values) would make infinite weights.
        if next <= 1e-18 * level * level {
            break;
        }
        variance = next;
    }
    let Some((posterior, active, status, variance)) = solved else {
        unreachable!("at least one round")
    };
    data = weighed(&data, variance);
    clusters.iter_mut().for_each(|c| *c = weighed(c, variance));
    Ok(Step {
        own,
        active,
        clusters,
        data,
        posterior,
        status,
    })
}

/// The least-squares solution within the bounds, which bounds hold, and how the solver ended.
pub(crate) fn bounded(
    posterior: &Factor,
    own: &[usize],
    unknowns: &[Unknown],
) -> Result<(Vec<f64>, Vec<i8>, Status), IdentError> {
    if own.is_empty() {
        return Ok((Vec::new(), Vec::new(), Status::Solved));
    }
    let lower: Vec<f64> = own.iter().map(|&u| unknowns[u].min).collect();
    let upper: Vec<f64> = own.iter().map(|&u| unknowns[u].max).collect();
    let norms = posterior.r.column_norms();
    let scale: Vec<f64> = own
        .iter()
        .zip(&norms)
        .map(|(&u, &n)| match unknowns[u].sd {
            sd if sd.is_finite() => sd,
            _ if n > 0.0 => {
                arm_numerics::linalg::matrix::norm(&posterior.z).max(f64::MIN_POSITIVE.sqrt()) / n
            }
            _ => 1.0,
        })
        .collect();
    let outcome = Program::of(posterior)?
        .scale(&scale)?
        .bounds(&lower, &upper)?
        .solve()?;
    if outcome.x.iter().any(|v| !v.is_finite()) {
        return Err(IdentError::NoSolution {
            status: outcome.status,
        });
    }
    Ok((outcome.x, outcome.active, outcome.status))
}

fn merged(factors: &[Factor], p: usize) -> Result<Factor, IdentError> {
    let mut all = Condenser::new(p);
    for factor in factors {
        all.merge_factor(factor)?;
    }
    Ok(all.finish())
}

/// The problem with every row divided by a standard deviation.
pub(crate) fn weighed(factor: &Factor, variance: f64) -> Factor {
    let w = 1.0 / variance.sqrt();
    Factor {
        r: factor.r.scaled_columns(&vec![w; factor.r.cols()]),
        z: factor.z.iter().map(|v| v * w).collect(),
        rho2: factor.rho2 / variance,
        rows: factor.rows,
    }
}

/// Variance that the residual of one joint has for each *effective* sample \[N² m²\].
fn residual_variance<const N: usize>(
    series: &[&Rows],
    x: &[f64],
    joint: usize,
) -> Result<f64, IdentError> {
    let (mut sum, mut effective) = (0.0, 0.0);
    for rows in series {
        let rest: Vec<f64> = crate::regression::preprocessing::residual(rows, x)
            .into_iter()
            .enumerate()
            .skip(joint)
            .step_by(N)
            .filter_map(|(at, value)| rows.fits(at).then_some(value))
            .collect();
        if rest.len() < 2 {
            continue;
        }
        let square = root_mean_square(rest.iter());
        sum += square * square * rest.len() as f64;
        effective += effective_samples(&rest)?;
    }
    Ok(sum / f64::max(effective, 1.0))
}

/// By how much every unknown moves with the scores of all steps and with those `moved` that no step finds: an error of one
/// step is carried into the next.
fn influence(
    steps: &[(&Step, SandwichCovariance)],
    mut moved: Vec<f64>,
    score: impl Fn(usize) -> Vec<f64>,
) -> Result<Vec<f64>, IdentError> {
    for (i, (step, bread)) in steps.iter().enumerate() {
        if step.own.is_empty() {
            continue;
        }
        let score = score(i);
        let carried = step.data.r.transpose_times(&step.data.r.times(&moved));
        let own: Vec<f64> = step.own.iter().map(|&u| score[u] - carried[u]).collect();
        for (&u, value) in step.own.iter().zip(bread.apply(&own)?) {
            moved[u] = value;
        }
    }
    Ok(moved)
}

/// Covariance of all unknowns: scatter of the clusters, the prior's own variance and the calibration's, each through all steps.
fn covariance(
    steps: &[Step],
    unknowns: &[Unknown],
    x: &[f64],
    bounds: bool,
) -> Result<Spread, IdentError> {
    let p = unknowns.len();
    let breads = steps
        .iter()
        .map(|s| {
            let fixed: Vec<bool> = s.active.iter().map(|&a| bounds && a != 0).collect();
            Ok((s, SandwichCovariance::with_fixed(&s.posterior.r, &fixed)?))
        })
        .collect::<Result<Vec<_>, IdentError>>()?;
    let all = steps.first().map_or(0, |s| s.clusters.len());
    let n = stretches(steps);
    let mut moves = Vec::with_capacity(all);
    for g in 0..all {
        let scores = steps
            .iter()
            .map(|s| s.clusters[g].score(x))
            .collect::<Result<Vec<_>, _>>()?;
        moves.push(influence(&breads, vec![0.0; p], |i| scores[i].clone())?);
    }
    let mean: Vec<f64> = (0..p)
        .map(|i| moves.iter().map(|m| m[i]).sum::<f64>() / all as f64)
        .collect();
    let mut priors = Vec::new();
    for (u, unknown) in unknowns
        .iter()
        .enumerate()
        .filter(|(_, u)| u.sd.is_finite())
    {
        let owner = steps.iter().position(|s| s.own.contains(&u));
        let mut moved = vec![0.0; p];
        if owner.is_none() {
            moved[u] = unknown.sd;
        }
        priors.push(influence(&breads, moved, |i| {
            let mut score = vec![0.0; p];
            if Some(i) == owner {
                score[u] = 1.0 / unknown.sd;
            }
            score
        })?);
    }
    let correction = n as f64 / (n as f64 - 1.0);
    let scatter = Matrix::from_fn(p, p, |i, j| {
        let scatter: f64 = moves
            .iter()
            .map(|m| (m[i] - mean[i]) * (m[j] - mean[j]))
            .sum();
        scatter * correction
    });
    let whole = Matrix::from_fn(p, p, |i, j| {
        scatter[(i, j)] + priors.iter().map(|m| m[i] * m[j]).sum::<f64>()
    });
    Ok(Spread { whole, scatter })
}

/// Number of stretches of data that every joint with rows has rows in.
fn stretches(steps: &[Step]) -> usize {
    let of_joints = steps.iter().filter(|s| s.has_data());
    of_joints
        .map(|s| informed(&s.clusters))
        .min()
        .unwrap_or(FEWEST)
}

fn summarise<const N: usize>(
    model: &Model<N>,
    unknowns: &[Unknown],
    steps: &[Step],
    (x, level, cutoff): (&[f64], f64, f64),
    prepared: &[Pieces],
) -> Result<Identified<N>, IdentError> {
    let p = unknowns.len();
    let mut all = Condenser::new(p);
    for step in steps {
        all.merge_factor(&step.data)?;
    }
    let data = all.finish();
    let r = physical_columns(&data, unknowns);
    let physical = r.cols();
    let options = RankOptions {
        scale: None,
        rows: data.rows,
        tolerance: Some(RANK_TOLERANCE),
    };
    let report = analyse(&r, &options)?;
    let names: Vec<&str> = unknowns[..physical]
        .iter()
        .map(|u| u.name.as_str())
        .collect();
    let trades = report.describe_trades(&names)?;
    let rank = report.rank;
    let clusters = stretches(steps);
    let mut limited = vec![false; p];
    for step in steps {
        for (&u, &a) in step.own.iter().zip(&step.active) {
            limited[u] = a != 0;
        }
    }
    let certainty = Certainty {
        scale_sd: 0.0,
        unknowns,
        x,
        limited,
        covariance: covariance(steps, unknowns, x, true)?,
        unbounded: covariance(steps, unknowns, x, false)?,
        report,
        physical,
        dof: (clusters - 1) as f64,
        level,
    };
    let mut parameters = Vec::new();
    for (u, unknown) in unknowns[..physical].iter().enumerate() {
        let mut estimate = certainty.unknown(u)?;
        if let Source::Effect(e, _) = unknown.source {
            estimate.joint = Some(model.fitted[e].index);
        }
        if steps.iter().all(|s| !s.own.contains(&u)) {
            // Nothing is known but the bounds: as spread out as an even distribution between them.
            estimate.std = (unknown.max - unknown.min) / libm::sqrt(12.0);
            estimate.interval = [unknown.min, unknown.max];
        }
        parameters.push(estimate);
        if let Source::Segment(k, Moment::Along) = unknown.source {
            parameters.extend(centre_of_mass(&certainty, k)?);
        }
    }
    let combinations = if model.segment_uncertainty > 0.0 {
        (0..N)
            .map(|j| first_moment(&certainty, model, j))
            .collect::<Result<Vec<_>, _>>()?
    } else {
        Vec::new()
    };
    let (chain, fitted) = updated(model, unknowns, x)?;
    Ok(Identified {
        status: steps
            .iter()
            .map(|s| s.status)
            .find(|&s| s != Status::Solved)
            .unwrap_or(Status::Solved),
        rank,
        unknowns: physical,
        parameters,
        combinations,
        calibration: Vec::new(),
        trades,
        scale_free: false,
        cutoff,
        clusters,
        speed_noise: vec![0.0; N],
        explained: prepared.iter().map(|pieces| explain(pieces, x)).collect(),
        chain,
        fitted,
    })
}

/// `l_k = m_k l_k / m_k` (equation 3.28); none for the first segment, whose mass does not act.
fn centre_of_mass(certainty: &Certainty<'_>, k: usize) -> Result<Option<Estimate>, IdentError> {
    let find = |moment| {
        certainty
            .unknowns
            .iter()
            .position(|u| u.source == Source::Segment(k, moment))
    };
    let (Some(m), Some(h)) = (find(Moment::Mass), find(Moment::Along)) else {
        return Ok(None);
    };
    let x = certainty.x;
    let mut gradient = vec![0.0; x.len()];
    gradient[h] = 1.0 / x[m];
    gradient[m] = -x[h] / (x[m] * x[m]);
    let estimate = certainty.nonlinear(x[h] / x[m], &gradient, format!("l{}", k + 1), "m")?;
    Ok(Some(Estimate {
        joint: Some(k),
        ..estimate
    }))
}

/// `X_j`, what the data determine.
fn first_moment<const N: usize>(
    certainty: &Certainty<'_>,
    model: &Model<N>,
    j: usize,
) -> Result<Estimate, IdentError> {
    let weight = |source| match source {
        Source::Segment(k, Moment::Along) if k == j => 1.0,
        Source::Segment(k, Moment::Mass) if k > j => model.chain.segments()[j].length,
        _ => 0.0,
    };
    let w: Vec<f64> = certainty
        .unknowns
        .iter()
        .map(|u| weight(u.source))
        .collect();
    let (name, unit) = base_name::<N>(j);
    Ok(Estimate {
        joint: Some(j),
        ..certainty.linear(&w, name, unit)?
    })
}

/// The arm and the effects with the estimates; moments of inertia about the centres of mass stay the model's.
///
/// A centre of mass beyond the end of its segment is moved there by more mass, which the segments before it balance: every `X_j`, all that the
/// data determine, stays.
fn updated<const N: usize>(
    model: &Model<N>,
    unknowns: &[Unknown],
    x: &[f64],
) -> Result<(Chain<f64, N>, Vec<Effect<f64>>), IdentError> {
    let mut segments = *model.chain.segments();
    let mut fitted = model.fitted.clone();
    let mut along: [f64; N] = core::array::from_fn(|k| value_of(&model.chain, k, Moment::Along));
    for (unknown, &value) in unknowns.iter().zip(x) {
        match unknown.source {
            Source::Segment(k, Moment::Mass) => segments[k].mass = value,
            Source::Segment(k, _) => along[k] = value,
            Source::Effect(e, p) => fitted[e].parameters[p] = value,
            Source::Calibration(_) => {}
        }
    }
    for k in (1..N).rev() {
        let more = f64::max(along[k] / segments[k].length - segments[k].mass, 0.0);
        segments[k].mass += more;
        for (i, along) in along[..k].iter_mut().enumerate() {
            *along -= segments[i].length * more;
        }
    }
    for (k, segment) in segments.iter_mut().enumerate() {
        let normal = value_of(&model.chain, k, Moment::Normal);
        segment.com = [along[k] / segment.mass, normal / segment.mass];
    }
    let chain = Chain::new(segments, model.chain.base(), model.chain.gravity())
        .and_then(|c| c.with_rotor_inertia(*model.chain.rotor_inertia()))
        .map_err(IdentError::Model)?;
    Ok((chain, fitted))
}
