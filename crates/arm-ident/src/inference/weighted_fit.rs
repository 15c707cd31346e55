//! Weighted constrained least squares of prepared rows, alternating between estimate and weights.

use crate::error::IdentError;
use crate::inference::constraint::{binding_gradients, common_scale, program};
use crate::inference::estimate::Explained;
use crate::inference::independent_blocks::cluster_ranges;
use crate::regression::preprocessing::{Pieces, TorqueCovariance, residual};
use crate::regression::trial::Model;
use crate::regression::unknown::{Source, Unknown};
use arm_numerics::least_squares::outcome::Outcome;
use arm_numerics::{Condenser, Factor, Matrix};

/// Residual, relative to the torques, assumed before the first fit.
pub(crate) const FIRST_GUESS: f64 = 0.05;

/// A solved weighted problem and what its uncertainty is computed from.
pub(crate) struct Solved {
    /// The solution.
    pub outcome: Outcome,
    /// Factor of the weighed data, without prior.
    pub data: Factor,
    /// The same with the prior.
    pub posterior: Factor,
    /// Factors of the independent clusters.
    pub clusters: Vec<Factor>,
    /// Gradients of the inequalities and cones that bind, bounds excepted.
    pub binding: Vec<Vec<f64>>,
    /// Rows of the equalities.
    pub equalities: Vec<Vec<f64>>,
}

/// Iteratively weighted least squares: the weights of the joints and the estimate in turn.
pub(crate) fn weighted<const N: usize>(
    model: &Model<N>,
    unknowns: &[Unknown],
    fit: &[&Pieces],
    (deviations, scale_free): (&[Vec<f64>], bool),
) -> Result<Solved, IdentError> {
    let (mut solved, level) = first_solution::<N>(model, unknowns, fit, scale_free)?;
    // Repeats of a simulation without noise do not scatter, and give no estimate of noise.
    let repeated = root_mean_square(deviations.iter().flatten()) > 1e-6 * level;
    for _ in 0..2 {
        let rest = |x: &[f64]| -> Vec<Vec<f64>> {
            fit.iter()
                .flat_map(|p| p.iter())
                .map(|r| residual(r, x))
                .collect()
        };
        let residuals = rest(&solved.outcome.x);
        // Data without noise (a check on exact values) would lead to infinite weights.
        if root_mean_square(residuals.iter().flatten()) <= 1e-9 * level {
            break;
        }
        let noise = if repeated {
            TorqueCovariance::<N>::of_repeats(deviations)?.at_least(&residuals)
        } else {
            TorqueCovariance::of_residuals(&residuals)?
        };
        solved = solve(model, unknowns, fit, &noise, scale_free)?;
    }
    Ok(solved)
}

/// The estimate under an initial value of white noise, and the size of the torques.
pub(crate) fn first_solution<const N: usize>(
    model: &Model<N>,
    unknowns: &[Unknown],
    fit: &[&Pieces],
    scale_free: bool,
) -> Result<(Solved, f64), IdentError> {
    let torque = root_mean_square(fit.iter().flat_map(|p| p.iter()).flat_map(|r| r.rhs.iter()));
    // Without a load, torques are compared with those of the given model.
    let x0: Vec<f64> = unknowns.iter().map(|u| u.mean).collect();
    let rest: Vec<Vec<f64>> = fit
        .iter()
        .flat_map(|p| p.iter())
        .map(|r| residual(r, &x0))
        .collect();
    let level = torque.max(root_mean_square(rest.iter().flatten()));
    let noise = TorqueCovariance::<N>::even((FIRST_GUESS * level).max(f64::MIN_POSITIVE.sqrt()));
    Ok((solve(model, unknowns, fit, &noise, scale_free)?, level))
}

pub(crate) fn root_mean_square<'a>(values: impl Iterator<Item = &'a f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(s, n), v| (s + v * v, n + 1.0));
    if count > 0.0 {
        libm::sqrt(sum / count)
    } else {
        0.0
    }
}

pub(crate) fn solve<const N: usize>(
    model: &Model<N>,
    unknowns: &[Unknown],
    fit: &[&Pieces],
    noise: &TorqueCovariance<N>,
    scale_free: bool,
) -> Result<Solved, IdentError> {
    let p = unknowns.len();
    let clusters = cluster_ranges(fit)?
        .iter()
        .map(|cluster| {
            let mut condenser = Condenser::new(p);
            for (rows, range) in cluster {
                noise.condense(&mut condenser, rows, range.clone())?;
            }
            Ok(condenser.finish())
        })
        .collect::<Result<Vec<_>, IdentError>>()?;
    let mut all = Condenser::new(p);
    for cluster in &clusters {
        all.merge_factor(cluster)?;
    }
    let data = all.finish();
    let (posterior, outcome) = estimated(&data, (model, unknowns), scale_free)?;
    let binding = binding_gradients(&outcome, unknowns, model);
    let equalities = if scale_free {
        vec![common_scale(unknowns, model)]
    } else {
        Vec::new()
    };
    Ok(Solved {
        outcome,
        data,
        posterior,
        clusters,
        binding,
        equalities,
    })
}

/// The estimate from a factor of weighed data, and that factor with the prior.
pub(crate) fn estimated<const N: usize>(
    data: &Factor,
    (model, unknowns): (&Model<N>, &[Unknown]),
    scale_free: bool,
) -> Result<(Factor, Outcome), IdentError> {
    let mean: Vec<f64> = unknowns.iter().map(|u| u.mean).collect();
    let sd: Vec<f64> = unknowns.iter().map(|u| u.sd).collect();
    let posterior = data.with_prior(&mean, &sd)?;
    let outcome = program(&posterior, unknowns, model, scale_free)?.solve()?;
    if outcome.x.iter().any(|v| !v.is_finite()) {
        return Err(IdentError::NoSolution {
            status: outcome.status,
        });
    }
    Ok((posterior, outcome))
}

/// How rows are explained by values of the unknowns.
pub(crate) fn explain<const N: usize>(pieces: &Pieces, x: &[f64]) -> Explained<N> {
    let mut out = Explained {
        samples: Vec::new(),
        measured: Vec::new(),
        fitted: Vec::new(),
    };
    for piece in pieces {
        out.samples.extend(&piece.samples);
        let rest = residual(piece, x);
        for (k, r) in rest.chunks_exact(N).enumerate() {
            let measured = arm_core::Joints::from_fn(|j, _| piece.measured(k * N + j));
            out.fitted
                .push(arm_core::Joints::from_fn(|j, _| measured[j] - r[j]));
            out.measured.push(measured);
        }
    }
    out
}

/// The design matrix that the weighed data leave, without the calibration columns.
pub(crate) fn physical_columns(data: &Factor, unknowns: &[Unknown]) -> Matrix {
    let keep: Vec<usize> = (0..unknowns.len())
        .filter(|&u| !matches!(unknowns[u].source, Source::Calibration(_)))
        .collect();
    data.r.select_columns(&keep)
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
