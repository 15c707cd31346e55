//! The joint method: all joints and all linear effects at once, under physical constraints, with intervals.

use arm_sim::Springs;

use crate::error::IdentError;
use crate::inference::cutoff::best_cutoff;
use crate::inference::estimate::Identified;
use crate::inference::gauss_newton::{Settled, Task, can_simulate, fit_trials};
use crate::inference::sticking::{is_plainly_better, sticking};
use crate::inference::summary::{Fit, summarise};
use crate::inference::weighted_fit::explain;
use crate::regression::measured_motion::{candidates, relative_speed_noise};
use crate::regression::sensitivity::{HELD, damped};
use crate::regression::trial::{Model, Tolerance, Trial};
use crate::regression::unknown::{Source, delay, unknowns};
use arm_numerics::NumericsError;

/// Natural frequencies \[Hz\] with which an assistance holds each joint, one fit after another: first what an arm moves with at most, last
/// less than what its own springs and its weight give.
const FADING: [f64; 3] = [2.0, 1.0, 0.5];

/// Where the motion in the regressors comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MotionSource {
    /// Simulated where the handle's path is known in every trial, measured where that cannot be done.
    Auto,
    /// Filtered and differentiated angles.
    Measured,
    /// Simulation of the closed chain along the measured path of the handle: from the model as given and, where that arm moves elsewhere,
    /// with an assistance that fades.
    Simulated,
}

/// A fit that leaves this much more than repeats differ by, as a mean ratio of the channels' deviations, may be in a wrong minimum.
const LARGEST_EXCESS: f64 = 2.0;

/// Choices of an identification.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Cutoff of the common low-pass \[Hz\]; chosen from the data when absent.
    pub cutoff: Option<f64>,
    /// Where the motion comes from.
    pub motion: MotionSource,
    /// Whether dry friction with the default smoothing is fitted as set-valued too, which stands where it plainly describes the simulated runs better.
    pub may_stick: bool,
    /// What the calibration promises.
    pub tolerance: Tolerance,
    /// Probability of the intervals.
    pub level: f64,
    /// Threads over which the trials of a round are spread; the result has the same bits for any number.
    pub threads: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            cutoff: None,
            motion: MotionSource::Auto,
            may_stick: false,
            tolerance: Tolerance::default(),
            level: 0.95,
            threads: 1,
        }
    }
}

/// Identifies a model on the trials whose role is [`Role::Fit`](crate::regression::trial::Role::Fit); the others are only explained.
///
/// # Errors
/// [`IdentError`] when there is nothing to fit on or with, a trial is too short for the filter, or no solution exists.
pub fn identify<const N: usize>(
    model: &Model<N>,
    trials: &[Trial<N>],
    options: &Options,
) -> Result<Identified<N>, IdentError> {
    let fit: Vec<&Trial<N>> = fit_trials(trials).collect();
    if fit.is_empty() {
        return Err(IdentError::Numerics(NumericsError::TooFew {
            name: "trials with role fit",
            found: 0,
            expected: 1,
        }));
    }
    let scale_free = fit.iter().all(|t| t.is_unloaded());
    let unknowns = unknowns(model, &options.tolerance, &fit);
    if unknowns
        .iter()
        .all(|u| matches!(u.source, Source::Calibration(_)))
    {
        return Err(IdentError::Numerics(NumericsError::TooFew {
            name: "unknowns",
            found: 0,
            expected: 1,
        }));
    }
    let task = Task {
        unknowns: &unknowns,
        trials,
        fit: &fit,
        cutoff: candidates(&fit)[0],
        simulate: false,
        assistance: None,
        scale_free,
        threads: options.threads,
    };
    let (task, found, not_simulated) = task.found(model, options)?;
    let Task {
        cutoff, simulate, ..
    } = task;
    let Settled {
        model: current,
        solved,
        prepared,
        ..
    } = found;
    let explained = prepared
        .iter()
        .map(|pieces| explain(pieces, &solved.outcome.x))
        .collect();
    let fit_trials = fit;
    let fit = Fit {
        solved: &solved,
        unknowns: &unknowns,
        model: &current,
        scale_free,
        level: options.level,
    };
    let mut result = summarise(&fit, cutoff, explained)?;
    if !simulate {
        result.speed_noise = relative_speed_noise(&fit_trials, cutoff)?.to_vec();
    }
    result.not_simulated = not_simulated;
    Ok(result)
}

/// The better end of two fits; of two that failed the second, as the first started from the model as given.
fn better<const N: usize>(
    one: Result<Settled<N>, IdentError>,
    other: Result<Settled<N>, IdentError>,
) -> Result<Settled<N>, IdentError> {
    match (one, other) {
        (Ok(one), Ok(other)) if other.better_than(&one) => Ok(other),
        (Ok(one), _) => Ok(one),
        (Err(_), other) => other,
    }
}

impl<const N: usize> Task<'_, N> {
    /// The fit along the motion that is asked for, and why that was measured where it was to be simulated if that could be done.
    fn found(
        self,
        model: &Model<N>,
        options: &Options,
    ) -> Result<(Self, Settled<N>, Option<IdentError>), IdentError> {
        let measured = || self.by_measured(model, options.cutoff);
        let certain = |(task, found)| (task, found, None);
        let requested = options.motion;
        if requested == MotionSource::Measured
            || requested == MotionSource::Auto && !self.fit.iter().all(|t| can_simulate(t))
        {
            return measured().map(certain);
        }
        let task = self.simulating(options.cutoff);
        let mut best = task.settle(damped(model, task.cutoff));
        if !best.as_ref().is_ok_and(|found| self.done(found)) {
            // An arm of which little is known moves elsewhere than its model, and a fit along a motion that is not the arm's may end in the
            // wrong minimum.
            best = better(best, task.faded(model));
        }
        let concluded = |found| match options.may_stick {
            true => (task, task.or_sticking(found)),
            false => (task, found),
        };
        match best.map(concluded) {
            Err(error) if requested == MotionSource::Auto => {
                measured().map(|(task, found)| (task, found, Some(error)))
            }
            ended => ended.map(certain),
        }
    }

    /// Whether another way to the minimum can do no good: the robot holds every joint and the motion is known, or the fit ended between all bounds
    /// and leaves little more than repeats differ by.
    fn done(&self, found: &Settled<N>) -> bool {
        let fits = found.excess.is_none_or(|excess| excess < LARGEST_EXCESS);
        N <= HELD || (found.settled && fits && !found.at_bound)
    }

    /// The fit along filtered and differentiated angles.
    fn by_measured(
        mut self,
        model: &Model<N>,
        cutoff: Option<f64>,
    ) -> Result<(Self, Settled<N>), IdentError> {
        self.cutoff = match cutoff {
            Some(cutoff) => cutoff,
            None => best_cutoff(model, self.unknowns, (self.fit, self.threads))?,
        };
        let found = self.settle(model.clone())?;
        Ok((self, found))
    }

    /// The task along simulated motion. That is not bent by the filter: the lowest cutoff keeps out most noise.
    fn simulating(mut self, cutoff: Option<f64>) -> Self {
        self.simulate = true;
        self.cutoff = cutoff.unwrap_or(self.cutoff);
        self
    }

    /// The end of fits whose assistance fades.
    fn faded(&self, from: &Model<N>) -> Result<Settled<N>, IdentError> {
        let mut assisted = *self;
        let mut current = from.clone();
        for frequency in FADING {
            assisted.assistance = Some(Springs::of_frequency(&current.chain, frequency));
            let found = assisted.settle(current)?;
            current = found.model;
        }
        self.settle(current)
    }

    /// The fit with set-valued friction from where a fit with smooth friction ended, if it plainly describes the simulated runs better.
    fn or_sticking(&self, mut found: Settled<N>) -> Settled<N> {
        for start in sticking(&found.model) {
            // From an end that is none the assistance leads, as it did for the smooth law.
            let ended = if found.settled {
                self.settle(start)
            } else {
                self.faded(&start)
            };
            let Ok(other) = ended else {
                continue;
            };
            let fitted = [&other, &found].map(|one| {
                let delay = delay(self.unknowns, &one.solved.outcome.x);
                (&one.model, delay)
            });
            let how = (self.cutoff, self.threads);
            if is_plainly_better(fitted, self.fit, how).unwrap_or(false) {
                found = other;
            }
        }
        found
    }
}
