//! The cutoff of the common low-pass, chosen from the data.

use crate::error::IdentError;
use crate::inference::independent_blocks::clusters;
use crate::inference::weighted_fit::{FIRST_GUESS, estimated, weighed};
use crate::regression::equation::Building;
use crate::regression::measured_motion::widened;
use crate::regression::measured_motion::{candidates_of_measured, measured};
use crate::regression::preprocessing::{LEAST_SHARE, Thinning, TorqueCovariance};
use crate::regression::trial::{Model, Trial};
use crate::regression::unknown::Unknown;
use crate::threads::parallel;
use arm_numerics::{Condenser, Factor};

/// A lower cutoff is preferred while its relative residual is within this factor of the best.
const NEARLY_BEST: f64 = 1.1;

/// The lowest cutoff with which the fit trials are explained nearly as well as with the best one \[Hz\].
///
/// The criterion is the residual relative to the size of the terms that have to cancel.
///
/// # Errors
/// [`IdentError`] when a trial is too short for the filter, or no solution exists.
pub(crate) fn best_cutoff<const N: usize>(
    model: &Model<N>,
    unknowns: &[Unknown],
    (fit, threads): (&[&Trial<N>], usize),
) -> Result<f64, IdentError> {
    let scale_free = fit.iter().all(|t| t.is_unloaded());
    let cutoffs = candidates_of_measured(fit)?;
    let scored = parallel(threads, cutoffs.len(), |i| {
        let cutoff = cutoffs[i];
        let model_there = widened(model, fit.iter().copied(), cutoff);
        let data = condensed(&model_there, unknowns, (fit, cutoff))?;
        let misfit = misfit(&data, (model, unknowns), scale_free)?;
        Ok::<_, IdentError>((cutoff, misfit))
    });
    let scored = scored.into_iter().collect::<Result<Vec<_>, _>>()?;
    let best = scored.iter().map(|s| s.1).fold(f64::INFINITY, f64::min);
    Ok(scored
        .iter()
        .find(|s| s.1 <= NEARLY_BEST * best)
        .map_or(scored[0].0, |s| s.0))
}

/// The rows of all trials, none of them kept.
fn condensed<const N: usize>(
    model: &Model<N>,
    unknowns: &[Unknown],
    (fit, cutoff): (&[&Trial<N>], f64),
) -> Result<Factor, IdentError> {
    let noise = TorqueCovariance::<N>::none();
    let mut condenser = Condenser::new(unknowns.len());
    let mut lengths = Vec::new();
    for trial in fit {
        let motion = measured(trial, cutoff)?;
        let mut rows = Building::new((model, unknowns), trial, &motion);
        let thinning = Thinning::new(trial, cutoff)?;
        lengths.push(thinning.lengths());
        thinning.stream::<N>(
            rows.width(),
            |count| rows.next(count),
            |_, mut kept| {
                kept.columns.truncate(unknowns.len());
                noise.condense(&mut condenser, &kept, 0..kept.samples.len())
            },
        )?;
    }
    // A cutoff that the fit will refuse is refused here too.
    clusters(&lengths)?;
    Ok(condenser.finish())
}

/// The residual of a first estimate under white noise, relative to the terms that have to cancel.
fn misfit<const N: usize>(
    data: &Factor,
    (model, unknowns): (&Model<N>, &[Unknown]),
    scale_free: bool,
) -> Result<f64, IdentError> {
    let root_mean = |sum: f64| libm::sqrt(sum / data.rows.max(1) as f64);
    let x0: Vec<f64> = unknowns.iter().map(|u| u.mean).collect();
    let torque = root_mean(data.residual2(&vec![0.0; x0.len()])?);
    let level = torque.max(root_mean(data.residual2(&x0)?));
    let sd = (FIRST_GUESS * level).max(f64::MIN_POSITIVE.sqrt());
    // As in the fit itself, where it is added for the sake of joints that are weighed together.
    let variance = sd * sd * (1.0 + LEAST_SHARE);
    let x = estimated(&weighed(data, variance), (model, unknowns), scale_free)?
        .1
        .x;
    let square = |u: usize| x[u] * x[u] * data.r.column(u).iter().map(|r| r * r).sum::<f64>();
    let terms: f64 = (0..x.len()).map(square).sum();
    Ok(root_mean(data.residual2(&x)?) / root_mean(terms / x.len() as f64))
}
