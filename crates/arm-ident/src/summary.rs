//! From a solved problem to numbers with names, intervals and what decided them.

use crate::constraint::base_parameters;
use crate::covariance::{Bread, information_ratio, standard_error};
use crate::error::IdentError;
use crate::estimate::{Decision, Estimate, Explained, Identified};
use crate::joint::{Solved, physical_columns};
use crate::matrix::Matrix;
use crate::rank::{RankOptions, RankReport, analyse};
use crate::student;
use crate::trial::Model;
use crate::unknown::{Moment, Source, Unknown};

/// Relative singular value below which a combination does not act on the data. Filtering and whitening leave exact
/// dependencies exact to rounding; inertia in a slow movement is many orders above.
pub(crate) const RANK_TOLERANCE: f64 = 1e-8;
/// Share in the null space below which a quantity counts as determined.
const DETERMINED: f64 = 1e-4;
/// A quantity with a prior counts as measured when the data took away this share of the prior variance.
const MEASURED: f64 = 0.9;
/// A bound decides a quantity when it narrows its standard deviation to less than this share.
const FREE: f64 = 0.9;

/// What is summarised.
pub(crate) struct Fit<'a, const N: usize> {
    pub solved: &'a Solved,
    pub unknowns: &'a [Unknown],
    pub model: &'a Model<N>,
    pub scale_free: bool,
    pub level: f64,
}

/// Covariance, intervals and decisions of a fit.
pub(crate) struct Certainty<'a> {
    pub unknowns: &'a [Unknown],
    pub x: &'a [f64],
    /// Unknowns that a bound or another physical limit takes part in deciding.
    pub limited: Vec<bool>,
    /// Relative standard deviation of the scale that the model gives to data without a load, else zero.
    pub scale_sd: f64,
    pub covariance: Matrix,
    /// Covariance as if no bound held, for the parameters that sit on one.
    pub unbounded: Matrix,
    /// What the movements can tell apart.
    pub report: RankReport,
    /// Number of unknowns that are not calibration; they come first.
    pub physical: usize,
    /// Half width of the intervals in standard deviations.
    pub quantile: f64,
}

/// Puts a result together.
pub(crate) fn summarise<const N: usize>(
    fit: &Fit<'_, N>,
    cutoff: f64,
    explained: Vec<Explained<N>>,
) -> Result<Identified<N>, IdentError> {
    let Fit {
        solved, unknowns, ..
    } = *fit;
    let r = physical_columns(&solved.data, unknowns);
    let physical = r.cols();
    let options = RankOptions {
        scale: None,
        rows: solved.data.rows,
        tolerance: Some(RANK_TOLERANCE),
    };
    let report = analyse(&r, &options)?;
    let names: Vec<&str> = unknowns[..physical]
        .iter()
        .map(|u| u.name.as_str())
        .collect();
    let trades = report.describe_trades(&names)?;
    let rank = report.rank - usize::from(fit.scale_free);
    let clusters = solved.clusters.len();
    let certainty = Certainty {
        scale_sd: if fit.scale_free {
            fit.model.segment_uncertainty
        } else {
            0.0
        },
        unknowns,
        x: &solved.outcome.x,
        limited: (0..unknowns.len())
            .map(|u| solved.outcome.active[u] != 0 || solved.binding.iter().any(|b| b[u] != 0.0))
            .collect(),
        covariance: covariance(solved, unknowns, true)?,
        unbounded: covariance(solved, unknowns, false)?,
        report,
        physical,
        quantile: student::quantile(0.5 + fit.level / 2.0, (clusters - 1) as f64)?,
    };
    let mut parameters = Vec::new();
    for (u, unknown) in unknowns[..physical].iter().enumerate() {
        parameters.push(certainty.unknown(u)?);
        if let Source::Segment(k, Moment::Inertia) = unknown.source {
            parameters.extend(derived(&certainty, k)?);
        }
    }
    for e in &mut parameters {
        if let Some(Source::Effect(i, _)) = e.source {
            e.joint = Some(fit.model.fitted[i].index);
        }
    }
    let calibration = (physical..unknowns.len())
        .map(|u| certainty.unknown(u))
        .collect::<Result<_, _>>()?;
    let mut combinations = Vec::new();
    for (i, (weights, _)) in base_parameters(unknowns, fit.model).iter().enumerate() {
        let (name, unit) = base_name::<N>(i);
        combinations.push(Estimate {
            joint: Some(i % N),
            ..certainty.linear(weights, name, unit)?
        });
    }
    Ok(Identified {
        status: solved.outcome.status,
        rank,
        unknowns: physical,
        parameters,
        combinations,
        calibration,
        trades,
        scale_free: fit.scale_free,
        cutoff,
        clusters,
        speed_noise: vec![0.0; N],
        explained,
        chain: fit.model.chain,
        fitted: fit.model.fitted.clone(),
    })
}

/// `H⁻¹ (Σ s sᵀ n/(n−1) + prior) H⁻¹`: scatter of the clusters for the data, the prior's own variance for the prior.
fn covariance(solved: &Solved, unknowns: &[Unknown], bounds: bool) -> Result<Matrix, IdentError> {
    let p = unknowns.len();
    let mut binding = solved.equalities.clone();
    if bounds {
        binding.extend(solved.binding.iter().cloned());
        for u in (0..p).filter(|&u| solved.outcome.active[u] != 0) {
            binding.push((0..p).map(|i| if i == u { 1.0 } else { 0.0 }).collect());
        }
    }
    let bread = Bread::new(&solved.posterior.r, &binding)?;
    let n = solved.clusters.len() as f64;
    let scores = solved
        .clusters
        .iter()
        .map(|c| c.score(&solved.outcome.x))
        .collect::<Result<Vec<_>, _>>()?;
    let mean: Vec<f64> = (0..p)
        .map(|i| scores.iter().map(|s| s[i]).sum::<f64>() / n)
        .collect();
    let meat = Matrix::from_fn(p, p, |i, j| {
        let scatter: f64 = scores
            .iter()
            .map(|s| (s[i] - mean[i]) * (s[j] - mean[j]))
            .sum();
        let prior = if i == j && unknowns[i].sd.is_finite() {
            1.0 / (unknowns[i].sd * unknowns[i].sd)
        } else {
            0.0
        };
        scatter * n / (n - 1.0) + prior
    });
    bread.sandwich(&meat)
}

impl Certainty<'_> {
    pub(crate) fn unknown(&self, u: usize) -> Result<Estimate, IdentError> {
        let mut w = vec![0.0; self.unknowns.len()];
        w[u] = 1.0;
        let unknown = &self.unknowns[u];
        let mut estimate = self.linear(&w, unknown.name.clone(), unknown.unit)?;
        estimate.source = Some(unknown.source);
        estimate.interval = estimate
            .interval
            .map(|end| end.clamp(unknown.min, unknown.max));
        if let Source::Segment(k, _) = unknown.source {
            estimate.joint = Some(k);
        }
        Ok(estimate)
    }

    /// A linear function of the unknowns.
    pub(crate) fn linear(
        &self,
        w: &[f64],
        name: String,
        unit: &'static str,
    ) -> Result<Estimate, IdentError> {
        let value: f64 = w.iter().zip(self.x).map(|(w, x)| w * x).sum();
        let (held, open) = (
            standard_error(&self.covariance, w)?,
            standard_error(&self.unbounded, w)?,
        );
        // A combination whose parts sit on a bound may still be free to move: X_j is, where m_{j+1} is not.
        let limited = w.iter().zip(&self.limited).any(|(&w, &l)| w != 0.0 && l);
        let bound = limited && held < FREE * open;
        let std = if bound { open } else { held };
        // Without a load every value is a ratio to the model's scale, and knows no more than that scale.
        let std = libm::hypot(std, self.scale_sd * value);
        let reach = self.quantile * std;
        let decided_by = if self.scale_sd > 0.0 && w[..self.physical].iter().any(|&v| v != 0.0) {
            Decision::Prior
        } else if bound {
            Decision::Bound
        } else {
            self.decision(w, std)?
        };
        Ok(Estimate {
            name,
            source: None,
            joint: None,
            unit,
            value,
            std,
            interval: [value - reach, value + reach],
            decided_by,
        })
    }

    fn decision(&self, w: &[f64], std: f64) -> Result<Decision, IdentError> {
        let prior = w
            .iter()
            .zip(self.unknowns)
            .filter(|(w, _)| **w != 0.0)
            .map(|(w, u)| w * u.sd);
        let prior = libm::sqrt(prior.map(|v| v * v).sum());
        let physical = &w[..self.physical];
        if physical.iter().any(|&v| v != 0.0)
            && self.report.undetermined_share(physical)? > DETERMINED
        {
            return Ok(Decision::Prior);
        }
        let measured = prior.is_infinite() || information_ratio(std, prior)? >= MEASURED;
        Ok(if measured {
            Decision::Data
        } else {
            Decision::Prior
        })
    }

    /// A nonlinear function through its gradient; decided by the weakest of what it rests on.
    pub(crate) fn nonlinear(
        &self,
        value: f64,
        gradient: &[f64],
        name: String,
        unit: &'static str,
    ) -> Result<Estimate, IdentError> {
        let mut estimate = self.linear(gradient, name, unit)?;
        let reach = self.quantile * estimate.std;
        estimate.value = value;
        estimate.interval = [value - reach, value + reach];
        for (u, _) in gradient.iter().enumerate().filter(|(_, g)| **g != 0.0) {
            match self.unknown(u)?.decided_by {
                other if estimate.decided_by == Decision::Data => estimate.decided_by = other,
                _ => {}
            }
        }
        Ok(estimate)
    }
}

/// Centre of mass and inertia about it, which follow from the unknowns of a segment.
fn derived(certainty: &Certainty<'_>, k: usize) -> Result<[Estimate; 2], IdentError> {
    let find = |moment| {
        certainty
            .unknowns
            .iter()
            .position(|u| u.source == Source::Segment(k, moment))
    };
    let (Some(m), Some(h), Some(i)) = (
        find(Moment::Mass),
        find(Moment::Along),
        find(Moment::Inertia),
    ) else {
        return Err(IdentError::TooFew {
            name: "unknowns of a segment",
            found: 0,
            expected: 3,
        });
    };
    let x = certainty.x;
    let normal = find(Moment::Normal);
    let n = normal.map_or(0.0, |n| x[n]);
    let com = x[h] / x[m];
    let mut to_com = vec![0.0; x.len()];
    to_com[h] = 1.0 / x[m];
    to_com[m] = -com / x[m];
    let mut to_inertia = vec![0.0; x.len()];
    to_inertia[i] = 1.0;
    to_inertia[h] = -2.0 * com;
    to_inertia[m] = (x[h] * x[h] + n * n) / (x[m] * x[m]);
    if let Some(place) = normal {
        to_inertia[place] = -2.0 * n / x[m];
    }
    let inertia = x[i] - (x[h] * x[h] + n * n) / x[m];
    let mut list = [
        certainty.nonlinear(com, &to_com, format!("l{}", k + 1), "m")?,
        certainty.nonlinear(inertia, &to_inertia, format!("I{}", k + 1), "kg m^2")?,
    ];
    for estimate in &mut list {
        estimate.joint = Some(k);
        // Neither a distance within the segment nor an inertia is negative.
        estimate.interval = estimate.interval.map(|end| end.max(0.0));
    }
    Ok(list)
}

/// Name and unit of base parameter `i` of `X_1 … X_N, J_1 … J_N`.
pub(crate) fn base_name<const N: usize>(i: usize) -> (String, &'static str) {
    let j = i % N + 1;
    let beyond: Vec<String> = (j + 1..=N).map(|k| format!("m{k}")).collect();
    let mass = match beyond.len() {
        0 => String::new(),
        1 => beyond[0].clone(),
        _ => format!("({})", beyond.join(" + ")),
    };
    let tail = |arm: String| {
        if mass.is_empty() {
            String::new()
        } else {
            format!(" + {arm}*{mass}")
        }
    };
    if i < N {
        (format!("m{j}*l{j}{}", tail(format!("a{j}"))), "kg m")
    } else {
        (
            format!("I{j} + m{j}*l{j}^2{}", tail(format!("a{j}^2"))),
            "kg m^2",
        )
    }
}
