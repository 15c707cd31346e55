//! The unknowns of the cascade, joint by joint.

use crate::regression::equation::value_of;
use crate::regression::trial::Model;
use crate::regression::unknown::{Imperfection, LEAST_MASS, Moment, Source, Unknown};
use arm_core::effect::Effect;

/// The unknowns: `m_2, m_1 l_1, …` of the segments, then passive moments and dissipative torques.
pub(crate) fn unknowns<const N: usize>(model: &Model<N>, width: f64) -> Vec<Unknown> {
    let mut list = Vec::new();
    let u = model.segment_uncertainty;
    if u > 0.0 {
        for k in 0..N {
            // The first segment's mass lies on no lever.
            let moments: &[Moment] = if k == 0 {
                &[Moment::Along]
            } else {
                &[Moment::Mass, Moment::Along]
            };
            list.extend(moments.iter().map(|&moment| {
                let mean = value_of(&model.chain, k, moment);
                let s = &model.chain.segments()[k];
                // Mass and centre of mass are uncertain independently: the product has both uncertainties.
                let (name, unit, sd, least) = match moment {
                    Moment::Mass => (format!("m{}", k + 1), "kg", u * mean, LEAST_MASS),
                    _ => (
                        format!("m{0}*l{0}", k + 1),
                        "kg m",
                        u * f64::max(
                            core::f64::consts::SQRT_2 * mean.abs(),
                            1e-3 * s.mass * s.length,
                        ),
                        0.0,
                    ),
                };
                Unknown {
                    source: Source::Segment(k, moment),
                    name,
                    kind: "segment",
                    joint: Some(k + 1),
                    unit,
                    mean,
                    sd,
                    min: (mean - width * sd).max(least),
                    max: mean + width * sd,
                }
            }));
        }
    }
    for (e, effect) in model.fitted.iter().enumerate().filter(|(_, e)| is_found(e)) {
        list.push(Unknown::of_effect((e, effect), 0));
    }
    list
}

/// The torque of the model's inertia, which the cascade leaves out: it widens the intervals, and is not refitted.
pub(super) fn neglected_inertia() -> Unknown {
    Unknown {
        source: Source::Calibration(Imperfection::NeglectedInertia),
        name: "neglected inertia".to_owned(),
        kind: "calibration",
        joint: None,
        unit: "1",
        mean: 0.0,
        sd: 1.0,
        min: -f64::INFINITY,
        max: f64::INFINITY,
    }
}

/// Whether the cascade finds this effect's first parameter: passive moments and dissipative torques.
pub(super) fn is_found(effect: &Effect<f64>) -> bool {
    effect.kind.is_rate_independent()
}

/// Whether its sign follows the direction of motion.
pub(super) fn is_dissipative(effect: &Effect<f64>) -> bool {
    is_found(effect) && effect.affine().is_none()
}

/// Indices of the unknowns that the step of a joint finds.
pub(crate) fn own<const N: usize>(
    model: &Model<N>,
    unknowns: &[Unknown],
    joint: usize,
) -> Vec<usize> {
    let belongs = |source| match source {
        Source::Segment(k, Moment::Along) => k == joint,
        Source::Segment(k, _) => k == joint + 1,
        Source::Effect(e, _) => model.fitted[e].index == joint,
        Source::RestTorque(..) | Source::Calibration(_) => false,
    };
    (0..unknowns.len())
        .filter(|&u| belongs(unknowns[u].source))
        .collect()
}
