//! Conversion between a model and its estimates.

use arm_core::Chain;
use arm_core::effect::Effect;

use crate::error::IdentError;
use crate::regression::equation::{effect_value, value_of};
use crate::regression::trial::Model;
use crate::regression::unknown::{Moment, Source, Unknown, spring};

/// The model with estimates in place of its own values.
pub(crate) fn updated<const N: usize>(
    model: &Model<N>,
    unknowns: &[Unknown],
    x: &[f64],
) -> Result<Model<N>, IdentError> {
    let mut next = model.clone();
    let mut segments = *model.chain.segments();
    for (k, segment) in segments.iter_mut().enumerate() {
        let value = |moment| {
            unknowns
                .iter()
                .position(|u| u.source == Source::Segment(k, moment))
                .map(|u| x[u])
        };
        let (Some(mass), Some(along), Some(inertia)) = (
            value(Moment::Mass),
            value(Moment::Along),
            value(Moment::Inertia),
        ) else {
            continue;
        };
        let normal = value(Moment::Normal).unwrap_or(mass * segment.com[1]);
        segment.mass = mass;
        segment.com = [along / mass, normal / mass];
        segment.inertia = (inertia - (along * along + normal * normal) / mass).max(0.0);
    }
    for (u, unknown) in unknowns.iter().enumerate() {
        if let Source::Effect(e, p) = unknown.source {
            next.fitted[e].parameters[p] = x[u];
        }
    }
    for (u, unknown) in unknowns.iter().enumerate() {
        if let Source::RestTorque(e, rest) = unknown.source {
            set_rest(&mut next.fitted[e], rest, x[u]);
        }
    }
    next.chain = Chain::new(segments, model.chain.base(), model.chain.gravity())
        .and_then(|c| c.with_rotor_inertia(*model.chain.rotor_inertia()))
        .map_err(IdentError::Model)?;
    Ok(next)
}

/// The rest angle of a spring from amplitude · rest, within its bounds; a spring without amplitude keeps its own.
fn set_rest(effect: &mut Effect<f64>, rest: usize, torque: f64) {
    let bounds = effect.kind.info().parameters[rest];
    if let Some((amplitude, _)) = spring(effect)
        && effect.parameters[amplitude] != 0.0
    {
        let angle = torque / effect.parameters[amplitude];
        effect.parameters[rest] = angle.clamp(bounds.min, bounds.max);
    }
}

/// The model's own values of the unknowns, zero for those of the calibration.
pub(crate) fn values<const N: usize>(model: &Model<N>, unknowns: &[Unknown]) -> Vec<f64> {
    unknowns
        .iter()
        .map(|u| match u.source {
            Source::Segment(k, moment) => value_of(&model.chain, k, moment),
            source => effect_value(model, source),
        })
        .collect()
}
