//! Shapes that a fit refines, and their limits: a law whose shape lies beyond what the trials can show is another, plainer law there.

use arm_core::effect::{Effect, Nature, Question};

use crate::data::session::Session;

/// Largest speed below which a joint with dry friction creeps \[rad/s\]; what friction does below is how the joint rests, no law of its
/// own.
pub(crate) const CREEP: f64 = 0.03;
/// Shortest time that shows in the common band \[s\]: the distance of its samples.
const SHORTEST: f64 = 0.08;

/// The shapes of an effect that are refined once it is named, with their limits: of friction that sticks, not the speed below which it
/// would creep.
pub(crate) fn refined<const N: usize>(
    session: &Session<N>,
    effect: &Effect<f64>,
    question: &Question,
) -> Vec<(usize, (f64, f64))> {
    let shapes = question.refined.iter();
    shapes
        .filter(|&&p| Some(p) != held(effect))
        .map(|&p| (p, limits(session, effect, p)))
        .collect()
}

/// The parameter that stays as it is in friction that sticks: the speed over which it would be smoothed.
pub(crate) fn held(effect: &Effect<f64>) -> Option<usize> {
    effect.kind.smoothed_by().filter(|_| effect.is_dry())
}

/// Smallest and largest value that a fit may give a refined shape.
///
/// A relaxation that takes longer than a trial is a spring, one that is over between two samples is a viscosity; an excess of friction
/// that fades below [`CREEP`] is the friction of a joint that creeps.
fn limits<const N: usize>(
    session: &Session<N>,
    effect: &Effect<f64>,
    parameter: usize,
) -> (f64, f64) {
    let info = &effect.kind.info().parameters[parameter];
    let whole = (info.min, info.max);
    let probe = effect.kind.probe();
    let is_known = |q: &Question| q.expected.iter().any(|e| e.0 == parameter);
    if probe.nature != Nature::Lasting || probe.questions.iter().any(is_known) {
        return whole;
    }
    let dry = effect.kind.smoothed_by();
    match info.unit {
        "s" => {
            let lengths = session.trials.iter().map(|t| t.len() as f64 / t.rate);
            (
                f64::max(info.min, SHORTEST),
                f64::min(info.max, lengths.fold(SHORTEST, f64::max)),
            )
        }
        "rad/s" if dry.is_some_and(|p| p != parameter) => (f64::max(info.min, CREEP), info.max),
        _ => whole,
    }
}

#[cfg(test)]
mod tests {
    use arm_core::effect::Kind;
    use arm_core::{Chain, Contact, Joints, Segment};
    use arm_ident::regression::trial::{Tolerance, Trial};

    use super::*;
    use crate::data::session::ComparisonMode;

    /// A session of trials that last so long \[s\].
    fn of_lengths(lengths: &[f64]) -> Session<1> {
        let segment = Segment {
            length: 0.3,
            mass: 1.0,
            com: [0.1, 0.0],
            inertia: 0.01,
        };
        let at_rest = |s: &f64| Trial::new(50.0, vec![Joints::zeros(); (50.0 * s) as usize]);
        Session {
            chain: Chain::new([segment], [0.0; 2], [0.0, -9.81]).expect("a possible arm"),
            contact: Contact::new([1e4; 2], [25.0; 2]),
            effects: Vec::new(),
            segment_uncertainty: 0.02,
            tolerance: Tolerance::default(),
            trials: lengths.iter().map(at_rest).collect(),
            comparison: ComparisonMode::Led,
            own: Vec::new(),
            base: Vec::new(),
            start: [[0.0; 3]; 1],
        }
    }

    #[test]
    fn a_shape_stays_within_what_the_trials_show() {
        let session = of_lengths(&[8.0, 12.0]);
        let of = |kind, name| {
            let kind = Kind::named(kind).expect("known");
            let parameters = kind.info().parameters;
            let p = parameters.iter().position(|p| p.name == name);
            limits(&session, &Effect::new(kind, 0), p.expect("a parameter"))
        };
        assert_eq!(of("relaxation", "time"), (SHORTEST, 12.0));
        assert_eq!(of("thixotropy", "recovery"), (SHORTEST, 12.0));
        assert_eq!(of("stribeck", "speed").0, CREEP);
        // The speed below which friction creeps, and a latency of which something is known, have their own limits.
        let whole = |kind: &str, p: usize| {
            let info = &Kind::named(kind).expect("known").info().parameters[p];
            (info.min, info.max)
        };
        assert_eq!(of("stribeck", "smoothing"), whole("stribeck", 2));
        assert_eq!(of("stretch_reflex", "latency"), whole("stretch_reflex", 3));
    }
}
