//! Gauss and Newton's method on the rows of all trials: fit, linearise again at the estimate and, where the motion is simulated, simulate again.

use arm_sim::Springs;

use crate::error::IdentError;
use crate::inference::updated_model::{updated, values};
use crate::inference::weighted_fit::{Solved, weighted};
use crate::regression::equation::{Building, follows_estimate};
use crate::regression::instrument::Instrument;
use crate::regression::measured_motion::{measured, widened};
use crate::regression::preprocessing::{
    Pieces, TorqueCovariance, filtered, repeat_deviations, residual, with_rest_columns,
};
use crate::regression::simulated_motion::simulated;
use crate::regression::trial::{Model, Role, Trial};
use crate::regression::unknown::{Source, Unknown, delay};
use crate::threads::parallel;

/// Most rounds of fitting, re-linearising and, where the motion is simulated, simulating again.
const MOST_ROUNDS: usize = 15;

/// The estimate stands when a round moves it by less than this, in units of its noise.
const SETTLED: f64 = 1e-2;
/// The same where rounds swing about the minimum: what sticks changes by jumps, and so does what is linearised.
const SWINGING: f64 = 0.5;
/// The same with an assistance, where an estimate is no more than the start of the next.
const NEAR: f64 = 1.0;
/// Most rounds with an assistance.
const MOST_ASSISTED: usize = 8;
/// Least share of a step.
const LEAST_SHARE: f64 = 0.125;

/// What rounds of a fit have in common.
#[derive(Clone, Copy)]
pub(crate) struct Task<'a, const N: usize> {
    pub unknowns: &'a [Unknown],
    pub trials: &'a [Trial<N>],
    /// Those that are fitted.
    pub fit: &'a [&'a Trial<N>],
    pub cutoff: f64,
    pub simulate: bool,
    /// What helps simulated arms to move as measured.
    pub assistance: Option<Springs<N>>,
    pub scale_free: bool,
    pub threads: usize,
}

/// Where rounds of a fit ended.
pub(crate) struct Settled<const N: usize> {
    pub model: Model<N>,
    pub solved: Solved,
    pub prepared: Vec<Pieces>,
    /// Whether a parameter of an effect is at a bound.
    pub at_bound: bool,
    pub settled: bool,
    pub objective: f64,
    /// How many times larger the residuals are than what repeats differ by, if there are repeats.
    pub excess: Option<f64>,
}

impl<const N: usize> Settled<N> {
    /// Whether it is the better end of two. One at which the fit was still moving is none.
    pub fn better_than(&self, other: &Self) -> bool {
        match (self.settled, other.settled) {
            (true, false) => true,
            (false, true) => false,
            _ => self.objective < other.objective,
        }
    }
}

impl<const N: usize> Task<'_, N> {
    /// Fits, linearises again and, where the motion is simulated, simulates again until the estimate stands.
    pub fn settle(&self, start: Model<N>) -> Result<Settled<N>, IdentError> {
        let Self {
            unknowns,
            trials,
            fit,
            cutoff,
            simulate,
            assistance,
            scale_free,
            threads,
        } = *self;
        let (enough, most) = match assistance {
            Some(_) => (NEAR, MOST_ASSISTED),
            None => (SETTLED, MOST_ROUNDS),
        };
        let mut at = Estimated::of(start, unknowns);
        let (mut last, mut prepared): (Option<Solved>, Vec<Pieces>) = (None, Vec::new());
        let (mut shown, mut refused, mut settled) = (at.clone(), None, false);
        let (mut share, mut before) = (1.0, f64::INFINITY);
        for _ in 0..most {
            let again = !simulate && !prepared.is_empty();
            let follows = |u| !again || follows_estimate(&at.model, u);
            let wanted: Vec<bool> = unknowns.iter().map(follows).collect();
            make_room(&mut prepared, &wanted);
            let delay = delay(unknowns, &at.x);
            let how = (cutoff, simulate, delay, assistance);
            match prepare((&at.model, unknowns, &wanted), trials, how, threads) {
                Ok(fresh) => renew(&mut prepared, fresh, &wanted),
                // A step too far makes an arm that cannot be simulated: half of it is a step too.
                Err(error) if last.is_some() => {
                    prepared.clear();
                    at = shown.towards(&at.x, 0.5, unknowns)?;
                    refused = Some(error);
                    continue;
                }
                Err(error) => return Err(error),
            };
            (shown, refused) = (at, None);
            let fitted = self.fitted(&prepared);
            let deviations = deviations(fit, &fitted);
            let solved = weighted(&shown.model, unknowns, &fitted, (&deviations, scale_free))?;
            let moved = moved(&solved, &shown.x);
            share = share_of_step(share, moved, before);
            at = shown.towards(&solved.outcome.x, share, unknowns)?;
            before = moved;
            settled = moved < enough || (share < 1.0 && moved < SWINGING);
            last = Some(solved);
            if settled {
                break;
            }
        }
        if let Some(error) = refused {
            return Err(error);
        }
        let Some(solved) = last else {
            unreachable!("there is at least one round")
        };
        let is_effect = |u: &Unknown| matches!(u.source, Source::Effect(..));
        let mut active = unknowns.iter().zip(&solved.outcome.active);
        let at_bound = active.any(|(u, active)| is_effect(u) && *active != 0);
        let objective = self.objective(&prepared, &solved.outcome.x);
        let excess = self.excess(&prepared, &solved.outcome.x);
        Ok(Settled {
            model: updated(&shown.model, unknowns, &solved.outcome.x)?,
            solved,
            prepared,
            at_bound,
            settled,
            objective,
            excess,
        })
    }

    /// The pieces of the trials that are fitted.
    fn fitted<'p>(&self, prepared: &'p [Pieces]) -> Vec<&'p Pieces> {
        let all = prepared.iter().zip(self.trials);
        all.filter(|(_, t)| t.role == Role::Fit)
            .map(|(p, _)| p)
            .collect()
    }

    /// How many times larger residuals are than what repeats differ by, as a geometric mean of the channels; none without repeats.
    fn excess(&self, prepared: &[Pieces], x: &[f64]) -> Option<f64> {
        let repeats = deviations(self.fit, &self.fitted(prepared));
        let size = |values: &[Vec<f64>]| TorqueCovariance::<N>::of_all(values).log_determinant();
        let ratio = |repeats: &Vec<Vec<f64>>| size(&self.residuals(prepared, x)) - size(repeats);
        Some(&repeats)
            .filter(|repeats| !repeats.is_empty())
            .map(|repeats| libm::exp(ratio(repeats) / (2 * N) as f64))
    }

    fn residuals(&self, prepared: &[Pieces], x: &[f64]) -> Vec<Vec<f64>> {
        let pieces = self.fitted(prepared).into_iter().flatten();
        pieces.map(|rows| residual(rows, x)).collect()
    }

    /// Twice the negative logarithm of what data and prior say of an estimate, whatever the weights: `n ln det S + Σ ((x − mean) / sd)²`, with
    /// S the covariance of n residuals.
    fn objective(&self, prepared: &[Pieces], x: &[f64]) -> f64 {
        let residuals = self.residuals(prepared, x);
        let samples = residuals.iter().map(Vec::len).sum::<usize>() / N;
        let prior: f64 = self
            .unknowns
            .iter()
            .zip(x)
            .map(|(u, x)| (x - u.mean) / u.sd)
            .map(|v| v * v)
            .sum();
        samples as f64 * TorqueCovariance::<N>::of_all(&residuals).log_determinant() + prior
    }
}

/// An estimate of all unknowns and the model with it.
#[derive(Clone)]
struct Estimated<const N: usize> {
    model: Model<N>,
    x: Vec<f64>,
}

impl<const N: usize> Estimated<N> {
    /// A model's own values; nothing is known of the calibration.
    fn of(model: Model<N>, unknowns: &[Unknown]) -> Self {
        let x = values(&model, unknowns);
        Self { model, x }
    }

    /// A share of the way from here to an estimate.
    fn towards(&self, x: &[f64], share: f64, unknowns: &[Unknown]) -> Result<Self, IdentError> {
        let x: Vec<f64> = match share {
            1.0 => x.to_vec(),
            _ => self
                .x
                .iter()
                .zip(x)
                .map(|(a, b)| a + share * (b - a))
                .collect(),
        };
        let model = updated(&self.model, unknowns, &x)?;
        Ok(Self { model, x })
    }
}

/// How far a round moved the estimate from where its rows were linearised, in units of its noise.
fn moved(solved: &Solved, from: &[f64]) -> f64 {
    let step: Vec<f64> = solved
        .outcome
        .x
        .iter()
        .zip(from)
        .map(|(a, b)| a - b)
        .collect();
    arm_numerics::linalg::matrix::norm(&solved.posterior.r.times(&step))
}

/// The share of a round's step that is taken: half of the last one where steps grow, as they do where they swing about the minimum or lead
/// away from it, and twice the last one where they shrink to less than half.
fn share_of_step(last: f64, moved: f64, before: f64) -> f64 {
    if moved > before {
        f64::max(0.5 * last, LEAST_SHARE)
    } else if moved < 0.5 * before {
        f64::min(2.0 * last, 1.0)
    } else {
        last
    }
}

/// Frees columns of the wanted unknowns, and right-hand sides, before new ones are built: rows take most of the memory.
fn make_room(prepared: &mut Vec<Pieces>, wanted: &[bool]) {
    if wanted.iter().all(|&wanted| wanted) {
        prepared.clear();
    }
    for rows in prepared.iter_mut().flatten() {
        let columns = rows.columns.iter_mut().zip(wanted);
        let freed = columns.filter(|(_, wanted)| **wanted);
        freed.for_each(|(column, _)| *column = Vec::new());
        (rows.rhs, rows.held) = (Vec::new(), None);
    }
}

/// Puts fresh columns of the wanted unknowns, and right-hand sides, into the rows of every trial; where there are none, the fresh ones are taken whole.
fn renew(prepared: &mut Vec<Pieces>, fresh: Vec<Pieces>, wanted: &[bool]) {
    if prepared.is_empty() {
        *prepared = fresh;
        return;
    }
    let pairs = prepared
        .iter_mut()
        .flatten()
        .zip(fresh.into_iter().flatten());
    for (rows, fresh) in pairs {
        let own = rows.columns.iter_mut().zip(wanted);
        let own = own.filter(|(_, wanted)| **wanted);
        own.zip(fresh.columns)
            .for_each(|((own, _), new)| *own = new);
        (rows.rhs, rows.held) = (fresh.rhs, fresh.held);
    }
}

/// Filtered rows of every trial. Along measured motion they have columns of the wanted unknowns only.
fn prepare<const N: usize>(
    (model, unknowns, wanted): (&Model<N>, &[Unknown], &[bool]),
    trials: &[Trial<N>],
    (cutoff, simulate, delay, assistance): (f64, bool, f64, Option<Springs<N>>),
    threads: usize,
) -> Result<Vec<Pieces>, IdentError> {
    let model = if simulate {
        model.clone()
    } else {
        widened(model, fit_trials(trials), cutoff)
    };
    let of_trial = |k: usize| {
        let trial = &trials[k];
        // A test trial that cannot be simulated is explained from what was measured; it decides nothing.
        if !simulate || (trial.role == Role::Test && !can_simulate(trial)) {
            let motion = measured(trial, cutoff)?;
            let mut rows = Building::new((&model, unknowns), trial, &motion).of_only(wanted);
            let pieces = filtered(trial, cutoff, rows.width(), |count| rows.next(count))?;
            return Ok(with_rest_columns(pieces, rows.columns()));
        }
        let course =
            simulated(&model, trial, cutoff, assistance).map_err(|error| error.in_trial(k))?;
        let motion = course.at_samples();
        let mut rows = Instrument::new((&model, unknowns), trial, (&course, &motion), delay);
        let pieces = filtered(trial, cutoff, rows.building.width(), |count| {
            rows.next(count)
        })?;
        Ok(with_rest_columns(pieces, unknowns.len()))
    };
    let prepared = parallel(threads, trials.len(), of_trial);
    prepared.into_iter().collect()
}

/// Whether the robot's angles alone tell how a trial moved: its path is known, and nothing else drives the arm.
pub(crate) fn can_simulate<const N: usize>(trial: &Trial<N>) -> bool {
    if trial.base.is_some() || trial.activity.is_some() {
        return false;
    }
    let moment = trial.moment_on_arm.iter().flatten().any(|&m| m != 0.0);
    let torque = trial
        .torque
        .iter()
        .flatten()
        .any(|t| t.iter().any(|&v| v != 0.0));
    trial.handle.is_some() && !moment && !torque
}

/// The trials that are fitted.
pub(crate) fn fit_trials<const N: usize>(trials: &[Trial<N>]) -> impl Iterator<Item = &Trial<N>> {
    trials.iter().filter(|t| t.role == Role::Fit)
}

/// Scatter between the repeats of every movement; empty where too few movements were repeated.
fn deviations<const N: usize>(fit: &[&Trial<N>], pieces: &[&Pieces]) -> Vec<Vec<f64>> {
    let mut configurations: Vec<usize> = fit.iter().map(|t| t.configuration).collect();
    configurations.sort_unstable();
    configurations.dedup();
    let mut all = Vec::new();
    for configuration in configurations {
        let repeats: Vec<&Pieces> = fit
            .iter()
            .zip(pieces)
            .filter(|(t, _)| t.configuration == configuration)
            .map(|(_, &p)| p)
            .collect();
        let mut own = fit.iter().filter(|t| t.configuration == configuration);
        let lengths = own.clone().map(|t| t.len());
        let alike = own
            .next()
            .is_some_and(|first| lengths.clone().all(|n| n == first.len()));
        match repeat_deviations::<N>(&repeats).filter(|_| alike) {
            Some(found) => all.extend(found),
            None => return Vec::new(),
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use arm_core::effect::{Effect, Kind};
    use arm_core::{Chain, Contact, Joints, Segment, sample_arms};

    use super::*;
    use crate::regression::trial::Tolerance;
    use crate::regression::unknown::unknowns;

    /// Two movements, the second with samples missing.
    fn trials() -> [Trial<2>; 2] {
        let wave = |i: i32, rate: f64| libm::sin(rate * f64::from(i));
        [(0.021, 800), (0.034, 900)].map(|(rate, samples)| {
            let q = (0..samples).map(|i| {
                Joints::from([-1.0 + 0.5 * wave(i, rate), 0.9 + 0.4 * wave(i, 1.7 * rate)])
            });
            let mut trial = Trial {
                force_on_arm: Some((0..samples).map(|i| [5.0 * wave(i, rate), 9.0]).collect()),
                torque: Some(
                    (0..samples)
                        .map(|i| Joints::repeat(wave(i, 0.02)))
                        .collect(),
                ),
                ..Trial::new(100.0, q.collect())
            };
            if samples > 800 {
                trial.valid[400..430].fill(false);
            }
            trial
        })
    }

    /// The mechanical arm with rotors, friction that sticks and springs with different rest angles; masses and most fitted parameters grow
    /// with `part`.
    fn estimated(part: f64) -> Model<2> {
        let arm = sample_arms::mechanical_arm();
        let segments = arm.segments().map(|s| Segment {
            mass: s.mass * (0.5 + part),
            ..s
        });
        let chain = Chain::new(segments, arm.base(), arm.gravity()).unwrap();
        Model {
            chain: chain.with_rotor_inertia([0.02, 0.01]).unwrap(),
            segment_uncertainty: 0.1,
            fitted: vec![
                Effect::new(Kind::MotorInertia, 1).with(&[0.1 * part]),
                Effect::new(Kind::Coulomb, 0).with(&[part, 0.0]),
                Effect::new(Kind::Elastic, 0).with(&[part, -0.4 * part]),
                Effect::new(Kind::Elastic, 1).with(&[2.0 * part, 0.7]),
                Effect::new(Kind::Relaxation, 1).with(&[part]),
            ],
            held: vec![Effect::new(Kind::Thixotropy, 1).with(&[0.2, 0.0, 0.0, 0.1, 3.0, 0.0])],
            contact: Contact::new([1e4; 2], [25.0; 2]),
        }
    }

    #[test]
    fn renewed_rows_are_those_of_a_whole_preparation() {
        let (trials, [first, later]) = (trials(), [0.3, 0.7].map(estimated));
        let tolerance = Tolerance {
            angle_offset_deg: 1.0,
            ..Tolerance::default()
        };
        let fit: Vec<_> = trials.iter().collect();
        let unknowns = unknowns(&first, &tolerance, &fit);
        let how = (3.0, false, 0.0, None);
        let of = |model, wanted: &[bool]| {
            prepare((model, &unknowns, wanted), &trials, how, 1).expect("rows")
        };
        let all = vec![true; unknowns.len()];
        let follow: Vec<bool> = unknowns
            .iter()
            .map(|u| follows_estimate(&first, u))
            .collect();
        assert!(follow.contains(&true) && follow.contains(&false));

        let (before, whole) = (of(&first, &all), of(&later, &all));
        let mut renewed = before.clone();
        make_room(&mut renewed, &follow);
        renew(&mut renewed, of(&later, &follow), &follow);

        let rows = |pieces: &[Pieces]| -> Vec<_> {
            let rows = pieces.iter().flatten();
            rows.map(|r| (r.columns.clone(), r.rhs.clone(), r.held.clone()))
                .collect()
        };
        assert_eq!(rows(&renewed), rows(&whole));
        assert_ne!(rows(&before), rows(&whole));
        assert!(
            whole.iter().flatten().count() > trials.len(),
            "a gap divides"
        );
        assert!(whole.iter().flatten().all(|rows| rows.held.is_some()));
    }
}
