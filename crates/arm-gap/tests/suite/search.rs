//! A hidden effect is found in simulated data, and nothing else is.

use arm_core::effect::{Effect, Kind};
use arm_gap::data::session::Session;
use arm_gap::fitting::fit::FittedHypothesis;
use arm_gap::prepared_session::PreparedSession;

use crate::sessions::session;

#[test]
fn a_hidden_spring_is_named_and_nothing_else() {
    let elastic = Kind::named("elastic").expect("known");
    let hidden = Effect::new(elastic, 1).with(&[1.5, 1.0]);
    let session = session(&[hidden], (1e-3, 0.1));
    let mut prepared = PreparedSession::new(&session, 2).expect("a sound session");
    let finding = prepared.search(&|_, _| Ok(())).expect("a finding");
    let named = &finding.amended.hypothesis.named;
    assert_eq!(named.len(), 1, "{named:?}");
    assert_eq!((named[0].kind, named[0].index), (elastic, 1));
    assert!((named[0].parameters[0] - 1.5).abs() < 0.15, "{named:?}");
    assert!(finding.lack[1].z < 4.0, "{:?}", finding.lack);
}

#[test]
fn a_late_reflex_is_named_with_its_latency() {
    let reflex = Kind::named("stretch_reflex").expect("known");
    let hidden = Effect::new(reflex, 1).with(&[0.8, 0.2, 1.0, 0.055]);
    let session = session(&[hidden], (3e-4, 0.03));
    let mut prepared = PreparedSession::new(&session, 2).expect("a sound session");
    let finding = prepared.search(&|_, _| Ok(())).expect("a finding");
    let named = &finding.amended.hypothesis.named;
    assert_eq!(named.len(), 1, "{named:?}");
    assert_eq!((named[0].kind, named[0].index), (reflex, 1));
    let [gain, threshold, direction, latency, ..] = named[0].parameters;
    assert!(
        (gain - 0.8).abs() < 0.08 && (threshold - 0.2).abs() < 0.03 && direction == 1.0,
        "{named:?}"
    );
    // From 40 ms, where the search starts.
    assert!((latency - 0.055).abs() < 0.005, "{named:?}");
    assert!(finding.lack[1].z < 4.0, "{:?}", finding.lack);
}

#[test]
fn nothing_is_named_where_nothing_is_hidden() {
    let session = session(&[], (1e-3, 0.1));
    let mut prepared = PreparedSession::new(&session, 2).expect("a sound session");
    let finding = prepared.search(&|_, _| Ok(())).expect("a finding");
    assert!(finding.amended.hypothesis.named.is_empty());
    assert!(finding.trial_specific.is_empty());
    assert!(finding.lack[1].z < 4.0, "{:?}", finding.lack);
}

/// The session of an arm whose model has no joint law at all.
fn little_known(effects: &[Effect<f64>]) -> Session<2> {
    let mut session = session(effects, (1e-3, 0.1));
    session.effects.clear();
    session.with_base(1)
}

#[test]
fn the_laws_of_a_passive_joint_are_named_with_what_could_stand_in_their_place() {
    let session = little_known(&[]);
    assert_eq!(session.base.len(), 6);
    let mut prepared = PreparedSession::new(&session, 2).expect("a sound session");
    let finding = prepared.search(&|_, _| Ok(())).expect("a finding");
    let named = &finding.amended.hypothesis.named;
    let viscous = Kind::named("viscous").expect("known");
    let places: Vec<_> = named.iter().map(|e| (e.kind, e.index)).collect();
    assert!(
        places.contains(&(viscous, 0)) && places.contains(&(viscous, 1)),
        "{places:?}"
    );
    assert!(finding.amended.hypothesis.known.is_empty());
    for one in &finding.named {
        let effect = &named[one.slot];
        assert_eq!(effect.kind, viscous, "{effect:?}");
        assert!((effect.parameters[0] - 0.1).abs() < 0.03, "{effect:?}");
        assert!(one.share > 0.0 && one.share <= 1.0);
        for other in &one.alternatives {
            assert_eq!(other.effect.index, effect.index);
            assert!(!other.candidate.is_same_effect(effect));
        }
    }
}

/// The viscosity of a joint as a fitted hypothesis has it \[N m s/rad\].
fn viscosity(fitted: &FittedHypothesis<2>, joint: usize) -> f64 {
    let viscous = Kind::named("viscous").expect("known");
    let mut known = fitted.hypothesis.known.iter();
    let own = known.find(|law| (law.kind, law.index) == (viscous, joint));
    own.expect("a law of the base").parameters[0]
}

/// The simulation shows a viscosity that the regression did not: 0.5 N m s/rad in the second joint, with that of all joints.
#[test]
fn a_law_that_measured_motion_does_not_show_is_calibrated_where_much_is_left_without_it() {
    let viscous = Kind::named("viscous").expect("known");
    let mut session = little_known(&[Effect::new(viscous, 1).with(&[0.4])]);
    for law in &mut session.base {
        if (law.effect.kind, law.effect.index) == (viscous, 1) {
            law.likely = false;
            law.effect.parameters[0] = 0.0;
        }
    }
    let mut prepared = PreparedSession::new(&session, 2).expect("a sound session");
    let (without, _) = prepared.calibrate().expect("a fit");
    assert!(without.misfit() > 1.5, "{}", without.misfit());
    let (fitted, _) = prepared.calibrate_base().expect("a fit");
    assert!(fitted.misfit() < 1.5, "{}", fitted.misfit());
    let found = viscosity(&fitted, 1);
    assert!((found - 0.5).abs() < 0.05, "{found}");
}

#[test]
fn a_base_in_a_wrong_minimum_is_calibrated_again_and_a_good_one_is_kept() {
    let session = little_known(&[]);
    let mut prepared = PreparedSession::new(&session, 2).expect("a sound session");
    let good = prepared.calibrate_base().expect("a fit");
    let (stays, _) = prepared.with_base_anew(good.clone());
    assert_eq!(stays.hypothesis, good.0.hypothesis);
    let (mut wrong, point) = good.clone();
    let viscous = Kind::named("viscous").expect("known");
    for law in &mut wrong.hypothesis.known {
        if law.kind == viscous {
            law.parameters[0] = 5.0;
        }
    }
    wrong.cost = 100.0 * wrong.rows as f64;
    let (anew, _) = prepared.with_base_anew((wrong, point));
    let found = [0, 1].map(|joint| viscosity(&anew, joint));
    assert!(
        found.iter().all(|found| (found - 0.1).abs() < 0.03),
        "{found:?}"
    );
}

/// The cubic spring that the base lacks leaves much, and a second calibration ends where the first one did.
#[test]
fn a_base_that_is_no_better_calibrated_again_is_kept() {
    let cubic = Kind::named("cubic_elastic").expect("known");
    let session = little_known(&[Effect::new(cubic, 1).with(&[20.0])]);
    let mut prepared = PreparedSession::new(&session, 2).expect("a sound session");
    let first = prepared.calibrate_base().expect("a fit");
    assert!(first.0.misfit() > 1.5, "{}", first.0.misfit());
    let (kept, _) = prepared.with_base_anew(first.clone());
    assert_eq!(kept.hypothesis, first.0.hypothesis);
}

#[test]
fn a_heaving_shoulder_is_named_beside_the_laws_of_joints_that_bend_to_it() {
    let of = |kind: &str, index, values: &[f64]| {
        Effect::new(Kind::named(kind).expect("known"), index).with(values)
    };
    let heave = [4e-4, 6e-3, 0.6, -1.3];
    let session = little_known(&[
        of("elastic", 0, &[0.6, -1.2]),
        of("elastic", 1, &[0.8, 0.8]),
        of("coulomb", 1, &[0.06, 0.0]),
        of("biarticular", 1, &[0.6, 0.9, -0.2]),
        of("shoulder_heave", 0, &heave),
    ]);
    let mut prepared = PreparedSession::new(&session, 2).expect("a sound session");
    let finding = prepared.search(&|_, _| Ok(())).expect("a finding");
    let named = &finding.amended.hypothesis.named;
    let found = named
        .iter()
        .find(|e| e.kind.info().kind == "shoulder_heave");
    let found = found.expect("a heave").parameters;
    assert!((found[1] / heave[1] - 1.0).abs() < 0.05, "{found:?}");
    assert!((found[2] - heave[2]).abs() < 0.01, "{found:?}");
    assert!(finding.lack[1].z < 4.0, "{:?}", finding.lack);
}

#[test]
fn whole_trials_tell_whether_friction_sticks_or_creeps() {
    let of = |kind: &str, index, values: &[f64]| {
        Effect::new(Kind::named(kind).expect("known"), index).with(values)
    };
    for smoothing in [0.0, 0.03] {
        let hidden = [
            of("elastic", 0, &[1.0, -1.0]),
            of("elastic", 1, &[1.5, 1.0]),
            of("coulomb", 1, &[0.3, smoothing]),
        ];
        let mut session = session(&hidden, (3e-4, 0.03));
        session.effects = Vec::new();
        let session = session.with_base(1);
        let mut prepared = PreparedSession::new(&session, 2).expect("a sound session");
        let finding = prepared.search(&|_, _| Ok(())).expect("a finding");
        let named = &finding.amended.hypothesis.named;
        let friction = named
            .iter()
            .find(|e| e.kind == hidden[2].kind && e.index == 1);
        let found = friction.expect("dry friction").parameters;
        assert_eq!(found[1], smoothing, "{named:?}");
        assert!((found[0] - 0.3).abs() < 0.02, "{found:?}");
    }
}

#[test]
fn friction_that_the_model_lacks_sticks_where_the_joint_does() {
    let coulomb = Kind::named("coulomb").expect("known");
    let hidden = Effect::new(coulomb, 1).with(&[0.3, 0.0]);
    let session = session(&[hidden], (3e-4, 0.03));
    let mut prepared = PreparedSession::new(&session, 2).expect("a sound session");
    let finding = prepared.search(&|_, _| Ok(())).expect("a finding");
    let named = &finding.amended.hypothesis.named;
    assert_eq!(named.len(), 1, "{named:?}");
    assert_eq!((named[0].kind, named[0].index), (coulomb, 1));
    let [torque, smoothing, ..] = named[0].parameters;
    assert_eq!(smoothing, 0.0, "{named:?}");
    assert!((torque - 0.3).abs() < 0.02, "{named:?}");
    // What is no unknown is not refined.
    assert!(finding.amended.asked[0].refined.is_empty());
}

/// A cubic spring with a rest angle 0.7 rad outside the movements explains the same data as an end-range moment: both must be stated.
#[test]
fn a_law_of_the_family_that_shows_the_same_is_stated_though_its_fit_is_long() {
    let of =
        |kind: &str, values: &[f64]| Effect::new(Kind::named(kind).expect("known"), 1).with(values);
    let elastic = of("elastic", &[0.8, 0.9]);
    let mut session = session(&[elastic, of("cubic_elastic", &[0.1, 0.0])], (3e-3, 0.3));
    session.effects.push(elastic);
    let mut prepared = PreparedSession::new(&session, 2).expect("a sound session");
    let finding = prepared.search(&|_, _| Ok(())).expect("a finding");
    assert_eq!(finding.named.len(), 1);
    let one = &finding.named[0];
    let named = finding.amended.hypothesis.named[one.slot];
    let others = one.alternatives.iter().map(|a| a.effect);
    let stated: Vec<&str> = std::iter::once(named)
        .chain(others)
        .map(|e| e.kind.info().kind)
        .collect();
    assert!(stated.contains(&"cubic_elastic"), "{stated:?}");
    assert!(stated.contains(&"end_range"), "{stated:?}");
}
