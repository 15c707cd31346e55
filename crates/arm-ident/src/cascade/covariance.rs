//! Covariance of the unknowns through all steps.

use super::step::{FEWEST, Step, informed};
use crate::error::IdentError;
use crate::inference::summary::Spread;
use crate::regression::unknown::Unknown;
use arm_numerics::Matrix;
use arm_numerics::statistics::sandwich_covariance::SandwichCovariance;

/// By how much every unknown moves with the scores of all steps and with those `moved` that no step finds: an error of one
/// step is carried into the next.
pub(super) fn influence(
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
pub(super) fn covariance(
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
pub(super) fn stretches(steps: &[Step]) -> usize {
    let of_joints = steps.iter().filter(|s| s.has_data());
    of_joints
        .map(|s| informed(&s.clusters))
        .min()
        .unwrap_or(FEWEST)
}

/// By how much every unknown moves with one unit of an unknown that no step finds.
pub(super) fn moved_by(steps: &[Step], p: usize, u: usize) -> Result<Vec<f64>, IdentError> {
    let breads = steps
        .iter()
        .map(|s| {
            let fixed: Vec<bool> = s.active.iter().map(|&a| a != 0).collect();
            Ok((s, SandwichCovariance::with_fixed(&s.posterior.r, &fixed)?))
        })
        .collect::<Result<Vec<_>, IdentError>>()?;
    let mut moved = vec![0.0; p];
    moved[u] = 1.0;
    influence(&breads, moved, |_| vec![0.0; p])
}
