//! The problem of one joint and its solution.

use crate::error::IdentError;
use crate::inference::weighted_fit::root_mean_square;
use crate::inference::weighted_fit::weighed;
use crate::regression::rows::RegressionRows;
use crate::regression::unknown::Unknown;
use arm_numerics::least_squares::program::{Program, Status};
use arm_numerics::statistics::autoregressive::effective_samples;
use arm_numerics::{Condenser, Factor};

/// Fewest stretches of data in which a joint has rows; with fewer their scatter cannot be estimated.
pub(super) const FEWEST: usize = 2;

/// Residual, relative to the torques, assumed before the first fit.
pub(super) const FIRST_GUESS: f64 = 0.05;

/// One joint's problem and its solution.
pub(super) struct Step {
    /// Indices of the unknowns that are found here.
    pub(super) own: Vec<usize>,
    /// Own unknowns on a bound: −1, 0, 1.
    pub(super) active: Vec<i8>,
    /// Weighed rows of this joint, all unknowns, for each cluster.
    pub(super) clusters: Vec<Factor>,
    /// Their sum.
    pub(super) data: Factor,
    /// In the own unknowns, with the prior.
    pub(super) posterior: Factor,
    /// How the solver ended.
    pub(super) status: Status,
}

impl Step {
    /// Whether there are rows to estimate the joint's unknowns from.
    pub(super) fn has_data(&self) -> bool {
        self.data.rows > 0
    }
}

/// Number of clusters in which a joint has rows.
pub(super) fn informed(clusters: &[Factor]) -> usize {
    clusters.iter().filter(|c| c.rows > 0).count()
}

/// Rows of one joint over the stretches of a cluster.
pub(super) fn condensed<const N: usize>(
    cluster: &[(&RegressionRows, core::ops::Range<usize>)],
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
pub(super) fn step<const N: usize>(
    unknowns: &[Unknown],
    mut own: Vec<usize>,
    (joint, mut clusters, series): (usize, Vec<Factor>, &[&RegressionRows]),
    x: &mut [f64],
) -> Result<Step, IdentError> {
    let mut data = merged(&clusters, unknowns.len())?;
    if data.rows == 0 {
        // Unknowns that neither data nor a prior determine stay as they are.
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
        // Data without noise (a check on exact values) would lead to infinite weights.
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

pub(super) fn merged(factors: &[Factor], p: usize) -> Result<Factor, IdentError> {
    let mut all = Condenser::new(p);
    for factor in factors {
        all.merge_factor(factor)?;
    }
    Ok(all.finish())
}

/// Variance that the residual of one joint has for each *effective* sample \[N² m²\].
pub(super) fn residual_variance<const N: usize>(
    series: &[&RegressionRows],
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
