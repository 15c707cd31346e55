//! Named estimates of a solved problem, with intervals and the source of each.

use crate::error::IdentError;
use crate::inference::constraint::base_parameters;
use crate::inference::estimate::{Decision, Estimate, Explained, Identified};
use crate::inference::rank::{RankOptions, RankReport, analyse};
use crate::inference::weighted_fit::{Solved, physical_columns};
use crate::regression::trial::Model;
use crate::regression::unknown::{Moment, Source, Unknown, spring};
use arm_core::effect::Effect;
use arm_numerics::linalg::matrix::Matrix;
use arm_numerics::statistics::distributions::student_t_quantile;
use arm_numerics::statistics::sandwich_covariance::{
    SandwichCovariance, information_ratio, standard_error,
};
use arm_numerics::{Factor, NumericsError};

/// Relative singular value below which a combination does not act on the data. Filtering and whitening leave exact
/// dependencies exact to rounding; inertia in a slow movement is many orders above.
const RANK_TOLERANCE: f64 = 1e-8;
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
    pub covariance: Spread,
    /// Covariance as if no bound held, for what a bound narrows.
    pub unbounded: Spread,
    /// Which parameters the movements distinguish.
    pub report: RankReport,
    /// Number of unknowns that are not calibration; they come first.
    pub physical: usize,
    /// Degrees of freedom of the scatter: clusters less one.
    pub dof: f64,
    /// Probability with which an interval holds the true value.
    pub level: f64,
}

/// Covariance of the unknowns.
pub(crate) struct Spread {
    /// Of data and prior.
    pub whole: Matrix,
    /// The part that was estimated from the scatter of the clusters.
    pub scatter: Matrix,
}

impl Spread {
    /// Standard deviations of a linear function of the unknowns: the whole, and the part from the scatter.
    fn of(&self, w: &[f64]) -> Result<[f64; 2], IdentError> {
        Ok([
            standard_error(&self.whole, w)?,
            standard_error(&self.scatter, w)?,
        ])
    }
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
    let (report, trades) = rank_of(&solved.data, unknowns)?;
    let physical = physical(unknowns);
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
        dof: (clusters - 1) as f64,
        level: fit.level,
    };
    let parameters = parameters(&certainty, fit.model)?;
    let calibration = (physical..unknowns.len())
        .map(|u| certainty.unknown(u))
        .collect::<Result<_, _>>()?;
    let mut combinations = Vec::new();
    let (mut correlated, mut weighed) = (Vec::new(), Vec::new());
    for (i, (weights, _)) in base_parameters(unknowns, fit.model).into_iter().enumerate() {
        let (name, unit) = base_name::<N>(i);
        correlated.push(name.clone());
        combinations.push(Estimate {
            joint: Some(i % N + 1),
            ..certainty.linear(&weights, name, unit)?
        });
        weighed.push(weights);
    }
    for (u, unknown) in unknowns.iter().enumerate() {
        if let Source::Effect(..) = unknown.source {
            correlated.push(unknown.printed());
            weighed.push(unit_vector(unknowns.len(), u));
        }
    }
    Ok(Identified {
        status: solved.outcome.status,
        rank,
        unknowns: physical,
        parameters,
        combinations,
        calibration,
        correlations: certainty.correlations(&weighed),
        correlated,
        trades,
        scale_free: fit.scale_free,
        cutoff,
        clusters,
        neglected_inertia: vec![0.0; N],
        speed_noise: vec![0.0; N],
        not_simulated: None,
        explained,
        chain: fit.model.chain,
        fitted: fit.model.fitted.clone(),
    })
}

/// Number of unknowns that are not calibration; they come first.
pub(crate) fn physical(unknowns: &[Unknown]) -> usize {
    let is_physical = |u: &&Unknown| !matches!(u.source, Source::Calibration(_));
    unknowns.iter().filter(is_physical).count()
}

/// What weighed data determine of the unknowns that are not calibration, and in words which of these trade against each other.
pub(crate) fn rank_of(
    data: &Factor,
    unknowns: &[Unknown],
) -> Result<(RankReport, Vec<String>), IdentError> {
    let options = RankOptions {
        scale: None,
        rows: data.rows,
        tolerance: Some(RANK_TOLERANCE),
    };
    let report = analyse(&physical_columns(data, unknowns), &options)?;
    let physical = unknowns[..physical(unknowns)].iter();
    let names: Vec<String> = physical.map(Unknown::printed).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let trades = report.describe_trades(&names)?;
    Ok((report, trades))
}

/// The unknowns and what follows from them.
fn parameters<const N: usize>(
    certainty: &Certainty<'_>,
    model: &Model<N>,
) -> Result<Vec<Estimate>, IdentError> {
    let mut parameters = Vec::new();
    for (u, unknown) in certainty.unknowns[..certainty.physical].iter().enumerate() {
        parameters.push(certainty.unknown(u)?);
        if let Source::Segment(k, Moment::Inertia) = unknown.source {
            let length = model.chain.segments()[k].length;
            parameters.extend(derived(certainty, k, length)?);
        }
        if let Source::RestTorque(e, rest) = unknown.source {
            parameters.extend(rest_angle(certainty, &model.fitted[e], (e, rest))?);
        }
    }
    Ok(parameters)
}

/// `H⁻¹ (Σ s sᵀ n/(n−1) + prior) H⁻¹`: scatter of the clusters for the data, the prior's own variance for the prior.
fn covariance(solved: &Solved, unknowns: &[Unknown], bounds: bool) -> Result<Spread, IdentError> {
    let p = unknowns.len();
    let mut binding = solved.equalities.clone();
    if bounds {
        binding.extend(solved.binding.iter().cloned());
        for u in (0..p).filter(|&u| solved.outcome.active[u] != 0) {
            binding.push(unit_vector(p, u));
        }
    }
    let bread = SandwichCovariance::new(&solved.posterior.r, &binding)?;
    let n = solved.clusters.len() as f64;
    let scores = solved
        .clusters
        .iter()
        .map(|c| c.score(&solved.outcome.x))
        .collect::<Result<Vec<_>, _>>()?;
    let mean: Vec<f64> = (0..p)
        .map(|i| scores.iter().map(|s| s[i]).sum::<f64>() / n)
        .collect();
    let mut meat = Matrix::from_fn(p, p, |i, j| {
        let scatter: f64 = scores
            .iter()
            .map(|s| (s[i] - mean[i]) * (s[j] - mean[j]))
            .sum();
        scatter * n / (n - 1.0)
    });
    let scatter = bread.sandwich(&meat)?;
    for (i, unknown) in unknowns.iter().enumerate() {
        if unknown.sd.is_finite() {
            meat[(i, i)] += 1.0 / (unknown.sd * unknown.sd);
        }
    }
    Ok(Spread {
        whole: bread.sandwich(&meat)?,
        scatter,
    })
}

impl Certainty<'_> {
    pub(crate) fn unknown(&self, u: usize) -> Result<Estimate, IdentError> {
        let w = unit_vector(self.unknowns.len(), u);
        let unknown = &self.unknowns[u];
        let estimate = self.linear(&w, unknown.name.clone(), unknown.unit)?;
        Ok(Estimate {
            kind: unknown.kind.to_owned(),
            joint: unknown.joint,
            ..estimate.within(unknown.min, unknown.max)
        })
    }

    /// A linear function of the unknowns.
    pub(crate) fn linear(
        &self,
        w: &[f64],
        name: String,
        unit: &'static str,
    ) -> Result<Estimate, IdentError> {
        let value: f64 = w.iter().zip(self.x).map(|(w, x)| w * x).sum();
        let (held, open) = (self.covariance.of(w)?, self.unbounded.of(w)?);
        // A bound narrows also quantities that are correlated with the unknown on it. The distance of the true value from the
        // bound is unknown, so neither is known better than without the bound.
        let narrowed = held[0] < FREE * open[0];
        // A combination whose parts sit on a bound may still be free to move: X_j is, where m_{j+1} is not.
        let limited = w.iter().zip(&self.limited).any(|(&w, &l)| w != 0.0 && l);
        let bound = limited && narrowed;
        let [std, scatter] = if narrowed { open } else { held };
        // Without a load every value is a ratio to the model's scale, and no more certain than that scale.
        let std = libm::hypot(std, self.scale_sd * value);
        let reach = self.quantile(std, scatter)? * std;
        let decided_by = if self.scale_sd > 0.0 && w[..self.physical].iter().any(|&v| v != 0.0) {
            Decision::Prior
        } else if bound {
            Decision::Bound
        } else {
            self.decision(w, std)?
        };
        Ok(Estimate {
            name,
            joint: None,
            kind: "combination".to_owned(),
            value,
            std,
            unit: unit.replace('·', " "),
            interval: (value - reach, value + reach),
            decided_by,
            caveat: None,
        })
    }

    /// Correlations between the errors of linear functions of the unknowns. One that a bound holds has none.
    fn correlations(&self, functions: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        let (whole, p) = (&self.covariance.whole, self.x.len());
        let covariance = |a: &[f64], b: &[f64]| {
            let spread: Vec<f64> = (0..p)
                .map(|i| (0..p).map(|k| whole[(i, k)] * b[k]).sum())
                .collect();
            dot(a, &spread) + self.scale_sd * self.scale_sd * dot(a, self.x) * dot(b, self.x)
        };
        let sd: Vec<f64> = functions
            .iter()
            .map(|w| libm::sqrt(covariance(w, w).max(0.0)))
            .collect();
        let between = |i: usize, k: usize| match sd[i] * sd[k] {
            _ if i == k => 1.0,
            product if product > 0.0 => covariance(&functions[i], &functions[k]) / product,
            _ => 0.0,
        };
        (0..functions.len())
            .map(|i| (0..functions.len()).map(|k| between(i, k)).collect())
            .collect()
    }

    /// Half width of an interval in standard deviations: of so many degrees of freedom as a sum of two variances has of which one
    /// is known (Satterthwaite 1946), so that the part of the prior does not widen with the few clusters.
    fn quantile(&self, std: f64, scatter: f64) -> Result<f64, IdentError> {
        /// Degrees of freedom from which on Student's distribution is taken as normal.
        const NORMAL: f64 = 1e9;
        let share = if scatter > 0.0 { std / scatter } else { NORMAL };
        let dof = self.dof * share * share * share * share;
        Ok(student_t_quantile(0.5 + self.level / 2.0, dof.min(NORMAL))?)
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

    /// A nonlinear function through its gradient, of a segment from 0; its source is the weakest of its arguments.
    pub(crate) fn nonlinear(
        &self,
        value: f64,
        gradient: &[f64],
        (name, unit): (String, &'static str),
        segment: usize,
    ) -> Result<Estimate, IdentError> {
        let mut estimate = self.linear(gradient, name, unit)?;
        let (low, high) = estimate.interval;
        let reach = 0.5 * (high - low);
        estimate.value = value;
        estimate.kind = "segment".to_owned();
        estimate.joint = Some(segment + 1);
        estimate.interval = (value - reach, value + reach);
        for (u, _) in gradient.iter().enumerate().filter(|(_, g)| **g != 0.0) {
            match self.unknown(u)?.decided_by {
                other if estimate.decided_by == Decision::Data => estimate.decided_by = other,
                _ => {}
            }
        }
        Ok(estimate)
    }
}

fn unit_vector(length: usize, place: usize) -> Vec<f64> {
    (0..length)
        .map(|i| if i == place { 1.0 } else { 0.0 })
        .collect()
}

/// The rest angle of a fitted spring; none for a spring whose amplitude may be zero, which rests anywhere.
fn rest_angle(
    certainty: &Certainty<'_>,
    effect: &Effect<f64>,
    (e, rest): (usize, usize),
) -> Result<Option<Estimate>, IdentError> {
    let place = |source| certainty.unknowns.iter().position(|u| u.source == source);
    let amplitude = spring(effect).and_then(|(p, _)| place(Source::Effect(e, p)));
    let (Some(k), Some(w)) = (amplitude, place(Source::RestTorque(e, rest))) else {
        return Ok(None);
    };
    let x = certainty.x;
    let (low, high) = certainty.unknown(k)?.interval;
    if low <= 0.0 && high >= 0.0 {
        return Ok(None);
    }
    let info = effect.kind.info();
    let parameter = &info.parameters[rest];
    let mut gradient = vec![0.0; x.len()];
    gradient[w] = 1.0 / x[k];
    gradient[k] = -x[w] / (x[k] * x[k]);
    let named = (parameter.name.to_owned(), parameter.unit);
    let estimate = certainty.nonlinear(x[w] / x[k], &gradient, named, effect.index)?;
    Ok(Some(Estimate {
        kind: info.kind.to_owned(),
        ..estimate
    }))
}

/// Centre of mass and inertia about it, which follow from the unknowns of a segment.
fn derived(certainty: &Certainty<'_>, k: usize, length: f64) -> Result<[Estimate; 2], IdentError> {
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
        return Err(IdentError::Numerics(NumericsError::TooFew {
            name: "unknowns of a segment",
            found: 0,
            expected: 3,
        }));
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
    let com = certainty.nonlinear(com, &to_com, (format!("l{}", k + 1), "m"), k)?;
    let named = (format!("I{}", k + 1), "kg m^2");
    let inertia = certainty.nonlinear(inertia, &to_inertia, named, k)?;
    // The centre of mass is within the segment, and no inertia is negative.
    Ok([com.within(0.0, length), inertia.within(0.0, f64::INFINITY)])
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
