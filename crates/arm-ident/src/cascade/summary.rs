//! Estimates of the solved steps, with names, intervals and what decided them.

use super::covariance::{covariance, moved_by, stretches};
use super::step::Step;
use crate::error::IdentError;
use crate::inference::estimate::{Estimate, Identified};
use crate::inference::summary::{Certainty, base_name, physical, rank_of};
use crate::inference::weighted_fit::explain;
use crate::regression::equation::value_of;
use crate::regression::preprocessing::Pieces;
use crate::regression::trial::Model;
use crate::regression::unknown::{Imperfection, Moment, Source, Unknown};
use arm_core::Chain;
use arm_core::effect::Effect;
use arm_numerics::Condenser;
use arm_numerics::least_squares::program::Status;
use arm_numerics::statistics::sandwich_covariance::standard_error;

pub(super) fn summarise<const N: usize>(
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
    let (report, trades) = rank_of(&data, unknowns)?;
    let physical = physical(unknowns);
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
    let parameters = parameters(&certainty, steps)?;
    let combinations = if model.segment_uncertainty > 0.0 {
        (0..N)
            .map(|j| first_moment(&certainty, model, j))
            .collect::<Result<Vec<_>, _>>()?
    } else {
        Vec::new()
    };
    let (chain, fitted) = updated(model, unknowns, x)?;
    Ok(Identified {
        correlated: Vec::new(),
        correlations: Vec::new(),
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
        neglected_inertia: moved_by_inertia(&certainty, model, steps)?,
        speed_noise: vec![0.0; N],
        not_simulated: None,
        explained: prepared.iter().map(|pieces| explain(pieces, x)).collect(),
        chain,
        fitted,
    })
}

/// The unknowns and the centres of mass that follow from them.
fn parameters(certainty: &Certainty<'_>, steps: &[Step]) -> Result<Vec<Estimate>, IdentError> {
    let mut parameters = Vec::new();
    for (u, unknown) in certainty.unknowns[..certainty.physical].iter().enumerate() {
        let mut estimate = certainty.unknown(u)?;
        if steps.iter().all(|s| !s.own.contains(&u)) {
            // Nothing is known but the bounds: as spread out as an even distribution between them.
            estimate.std = (unknown.max - unknown.min) / libm::sqrt(12.0);
            estimate.interval = (unknown.min, unknown.max);
        }
        parameters.push(estimate);
        if let Source::Segment(k, Moment::Along) = unknown.source {
            parameters.extend(centre_of_mass(certainty, k)?);
        }
    }
    Ok(parameters)
}

/// `l_k = m_k l_k / m_k` (equation 3.28); none for the first segment, whose mass does not act.
pub(super) fn centre_of_mass(
    certainty: &Certainty<'_>,
    k: usize,
) -> Result<Option<Estimate>, IdentError> {
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
    let named = (format!("l{}", k + 1), "m");
    Ok(Some(certainty.nonlinear(
        x[h] / x[m],
        &gradient,
        named,
        k,
    )?))
}

/// `X_j` as a linear function of the unknowns.
fn weights<const N: usize>(unknowns: &[Unknown], model: &Model<N>, j: usize) -> Vec<f64> {
    let weight = |source| match source {
        Source::Segment(k, Moment::Along) if k == j => 1.0,
        Source::Segment(k, Moment::Mass) if k > j => model.chain.segments()[j].length,
        _ => 0.0,
    };
    unknowns.iter().map(|u| weight(u.source)).collect()
}

/// By how many of its other standard deviations the neglected inertia moves each `X_j`.
fn moved_by_inertia<const N: usize>(
    certainty: &Certainty<'_>,
    model: &Model<N>,
    steps: &[Step],
) -> Result<Vec<f64>, IdentError> {
    let unknowns = certainty.unknowns;
    let inertia = Source::Calibration(Imperfection::NeglectedInertia);
    let Some(place) = unknowns.iter().position(|u| u.source == inertia) else {
        return Ok(vec![0.0; N]);
    };
    let moved = moved_by(steps, unknowns.len(), place)?;
    (0..N)
        .map(|j| {
            let w = weights(unknowns, model, j);
            let shift: f64 = w.iter().zip(&moved).map(|(w, m)| w * m).sum();
            let std = standard_error(&certainty.covariance.whole, &w)?;
            let others = libm::sqrt(f64::max(std * std - shift * shift, 0.0));
            Ok(if shift == 0.0 {
                0.0
            } else {
                shift.abs() / others
            })
        })
        .collect()
}

/// `X_j`, what the data determine.
pub(super) fn first_moment<const N: usize>(
    certainty: &Certainty<'_>,
    model: &Model<N>,
    j: usize,
) -> Result<Estimate, IdentError> {
    let w = weights(certainty.unknowns, model, j);
    let (name, unit) = base_name::<N>(j);
    Ok(Estimate {
        joint: Some(j + 1),
        ..certainty.linear(&w, name, unit)?
    })
}

/// The arm and the effects with the estimates; moments of inertia about the centres of mass stay the model's.
///
/// A centre of mass beyond the end of its segment is moved there by more mass, which the segments before it balance: every `X_j`, all that the
/// data determine, stays.
pub(super) fn updated<const N: usize>(
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
            Source::RestTorque(..) | Source::Calibration(_) => {}
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
