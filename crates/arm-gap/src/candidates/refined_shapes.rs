//! Shape parameters that a fit refines, and their limits: beyond the range that the trials resolve, a law equals a simpler one.

use arm_core::effect::{Effect, Nature, Part};
use arm_ident::regression::trial::Trial;
use arm_numerics::statistics::extent::extent;

use crate::data::course::BAND;
use crate::data::session::Session;
use crate::data::valid_segments::SAMPLES_PER_PERIOD;

/// Largest speed below which a joint with dry friction creeps \[rad/s\]; what friction does below is how the joint rests, no law of its
/// own.
pub(crate) const CREEP: f64 = 0.03;
/// Shortest time that shows in the common band \[s\]: the distance of its samples.
const SHORTEST: f64 = 1.0 / (SAMPLES_PER_PERIOD * BAND);

/// The shapes of an effect that are refined once it is named, with their limits: of friction that sticks, not the speed below which it
/// would creep.
pub(crate) fn refined<const N: usize>(
    session: &Session<N>,
    effect: &Effect<f64>,
    part: &Part,
) -> Vec<(usize, (f64, f64))> {
    let shapes = part.varying.iter();
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
/// that fades below [`CREEP`] is the friction of a joint that creeps, and one that does not fade up to the fastest speed is Coulomb's. A
/// moment that rises less than e-fold over the range of the joint is a spring.
fn limits<const N: usize>(
    session: &Session<N>,
    effect: &Effect<f64>,
    parameter: usize,
) -> (f64, f64) {
    let info = &effect.kind.info().parameters[parameter];
    let prior = effect.kind.prior();
    let is_known = |part: &Part| part.expected.iter().any(|e| e.0 == parameter);
    let has_own = prior.nature != Nature::Lasting || prior.parts.iter().any(is_known);
    let is_rest = effect.kind.smoothed_by() == Some(parameter);
    let (least, most) = match info.unit {
        _ if has_own || is_rest => (info.min, info.max),
        "s" => {
            let lengths = session.trials.iter().map(|t| t.len() as f64 / t.rate);
            (SHORTEST, lengths.fold(SHORTEST, f64::max))
        }
        "rad/s" => (CREEP, fastest(session, effect.index).max(CREEP)),
        "1/rad" => ((1.0 / range(session, effect)).min(info.max), info.max),
        _ => (info.min, info.max),
    };
    (f64::max(info.min, least), f64::min(info.max, most))
}

/// Range of the angle on which an effect of a joint depends \[rad\]; of one that crosses two joints, of both together.
fn range<const N: usize>(session: &Session<N>, effect: &Effect<f64>) -> f64 {
    let first = effect.index - usize::from(effect.kind.crosses() && effect.index > 0);
    let of_joint = |j: usize| {
        let trials = session.trials.iter();
        let (low, high) = extent(trials.flat_map(|t| t.q.iter().map(|q| q[j])));
        high - low
    };
    (first..=effect.index).map(of_joint).sum()
}

/// Fastest mean speed of a joint over a quarter of a second \[rad/s\], which noise of the angles hardly changes.
fn fastest<const N: usize>(session: &Session<N>, joint: usize) -> f64 {
    /// \[s\]
    const SPAN: f64 = 0.25;
    let of_trial = |trial: &Trial<N>| {
        let apart = ((SPAN * trial.rate) as usize).max(1);
        let pairs = trial.q.iter().zip(trial.q.iter().skip(apart));
        let moved = pairs.fold(0.0, |most, (a, b)| {
            f64::max(most, (b[joint] - a[joint]).abs())
        });
        moved * trial.rate / apart as f64
    };
    session.trials.iter().map(of_trial).fold(0.0, f64::max)
}

/// Whether a fit has driven a refined shape to a limit at which the law is another, plainer one.
///
/// Friction that does not recover within a trial is thixotropic still: what was broken down stays so.
pub(crate) fn is_plainer(refined: &[(usize, (f64, f64))], effect: &Effect<f64>) -> bool {
    /// Share of a limit that counts as the limit.
    const NEAR: f64 = 1e-6;
    let info = effect.kind.info();
    refined.iter().any(|&(p, (least, most))| {
        let (value, parameter) = (effect.parameters[p], &info.parameters[p]);
        let lasts = parameter.unit == "s" && effect.kind.smoothed_by().is_some();
        let at_least = least > parameter.min && value <= least * (1.0 + NEAR);
        let at_most = !lasts && most < parameter.max && value >= most * (1.0 - NEAR);
        at_least || at_most
    })
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
            weights: Vec::new(),
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
        // Joints at rest have no speed at which an excess could fade.
        assert_eq!(of("stribeck", "speed"), (CREEP, CREEP));
        // The speed below which friction creeps, and a latency of which something is known, have their own limits.
        let whole = |kind: &str, p: usize| {
            let info = &Kind::named(kind).expect("known").info().parameters[p];
            (info.min, info.max)
        };
        assert_eq!(of("stribeck", "smoothing"), whole("stribeck", 2));
        assert_eq!(of("stretch_reflex", "latency"), whole("stretch_reflex", 3));
    }

    #[test]
    fn a_moment_must_rise_e_fold_over_the_range_of_its_joint() {
        let mut session = of_lengths(&[4.0, 4.0]);
        session.trials[0].q[7] = Joints::from([-0.2]);
        session.trials[1].q[9] = Joints::from([0.3]);
        let steepness = |session: &Session<1>| limits(session, &Effect::new(Kind::EndRange, 0), 2);
        assert_eq!(steepness(&session), (2.0, 50.0));
        session.trials[1].q[9] = Joints::from([-0.19]);
        assert_eq!(steepness(&session), (5.0, 50.0));
        assert_eq!(steepness(&of_lengths(&[4.0])), (50.0, 50.0), "at rest");
        let spring = Effect::<f64>::new(Kind::EndRange, 0).with(&[1.0, 0.0, 2.0]);
        assert!(is_plainer(&[(2, (2.0, 50.0))], &spring));
    }

    #[test]
    fn the_fastest_speed_is_a_mean_over_a_quarter_of_a_second() {
        let mut session = of_lengths(&[4.0]);
        // 0.8 rad/s from 1 to 3 s, and one sample that is off by 0.02 rad, 1 rad/s between samples.
        let angle = |i: usize| 0.8 * (i as f64 / 50.0).clamp(1.0, 3.0);
        let off = |i: usize| if i == 20 { 0.02 } else { 0.0 };
        session.trials[0].q = (0..200)
            .map(|i| Joints::from([angle(i) + off(i)]))
            .collect();
        assert!((fastest(&session, 0) - 0.8).abs() < 1e-12);
    }

    #[test]
    fn a_law_at_the_limit_of_its_shape_is_a_plainer_one() {
        let relaxation = Effect::<f64>::new(Kind::Relaxation, 0).with(&[1.0, 12.0]);
        let limits = [(1, (SHORTEST, 12.0))];
        assert!(is_plainer(&limits, &relaxation));
        assert!(is_plainer(&limits, &relaxation.with(&[1.0, SHORTEST])));
        assert!(!is_plainer(&limits, &relaxation.with(&[1.0, 11.9])));
        // The limits of the kind do not depend on the session.
        let info = &Kind::Relaxation.info().parameters[1];
        let own = [(1, (info.min, info.max))];
        assert!(!is_plainer(&own, &relaxation.with(&[1.0, info.max])));
        let kind = Kind::Thixotropy;
        let recovery = kind
            .info()
            .parameters
            .iter()
            .position(|p| p.name == "recovery");
        let recovery = recovery.expect("a parameter");
        let mut thixotropy = Effect::<f64>::new(kind, 0);
        thixotropy.parameters[recovery] = 12.0;
        let limits = [(recovery, (SHORTEST, 12.0))];
        assert!(!is_plainer(&limits, &thixotropy));
        thixotropy.parameters[recovery] = SHORTEST;
        assert!(is_plainer(&limits, &thixotropy));
    }
}
