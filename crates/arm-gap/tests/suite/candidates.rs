//! The catalogue as candidates: the price of each, where it is tested, and what it finds.

use arm_core::effect::{Effect, KINDS, Kind, Place};
use arm_gap::candidates::candidate::{Candidate, THRESHOLD, price};
use arm_gap::candidates::library::Library;
use arm_gap::prepared_session::PreparedSession;

use crate::sessions::session;

#[test]
fn a_name_costs_twelve_units_and_what_was_tried_besides() {
    assert_eq!(THRESHOLD, 12.0);
    // One number in 1000 rows, one shape; two numbers; a hundred shapes.
    let log = libm::log(1000.0);
    assert!((price(1, 1, 1000) - (12.0 + log)).abs() < 1e-12);
    assert!((price(2, 1, 1000) - (12.0 + 2.0 * log)).abs() < 1e-12);
    assert!((price(1, 100, 1000) - (12.0 + log + 2.0 * libm::log(100.0))).abs() < 1e-12);
    // 4.4 standard deviations: the square is what one number gains.
    assert!((price(1, 1, 1000).sqrt() - 4.35).abs() < 0.01);
}

#[test]
fn every_kind_is_asked_wherever_it_may_act_and_answers() {
    let session = session(&[], (1e-3, 0.1));
    let prepared = PreparedSession::new(&session, 2).expect("a sound session");
    let point = prepared.linearize(&session.given()).expect("a run");
    let library = Library::build(&prepared, &point, None).expect("questions");
    assert_eq!(library.candidates.len(), library.responses.len());
    for (candidate, responses) in std::iter::zip(&library.candidates, &library.responses) {
        assert_eq!(candidate.width(), responses.len());
        assert!(candidate.step > 0.0, "{candidate:?}");
        let answers = responses
            .iter()
            .any(|r| r.0.iter().flatten().flatten().any(|v| *v != 0.0));
        assert!(answers, "{candidate:?}");
    }
    let asked = |kind: Kind, index: usize| {
        let mut all = library.candidates.iter();
        all.any(|c| (c.effect.kind, c.effect.index) == (kind, index))
    };
    for kind in ["viscous", "coulomb", "elastic", "constant_moment"] {
        let kind = Kind::named(kind).expect("known");
        assert!(asked(kind, 0) && asked(kind, 1), "{kind:?}");
    }
    let sensors = KINDS
        .iter()
        .filter(|k| k.info().place == Place::ForceSensor);
    for &kind in sensors.filter(|k| !k.prior().parts.is_empty()) {
        assert!(asked(kind, 0) && asked(kind, 1), "{kind:?}");
    }
}

#[test]
fn a_spring_at_two_rest_angles_is_one_spring_between_them() {
    let session = session(&[], (1e-3, 0.1));
    let prepared = PreparedSession::new(&session, 1).expect("a sound session");
    let point = prepared.linearize(&session.given()).expect("a run");
    let elastic = Kind::named("elastic").expect("known");
    let library = Library::of_joint(&prepared, &point, 1).expect("questions");
    let mut all = library.candidates.iter();
    let spring = all
        .find(|c| c.effect.kind == elastic && c.rest.is_some())
        .expect("a spring");
    let rest = spring.rest.expect("a rest angle");
    let middle = spring.effect.parameters[rest];
    // 3 N m/rad at the rest angle and 1 N m/rad at 1 rad beyond: 4 N m/rad, a quarter of the way.
    let found: Effect<f64> = spring.found(&[3.0, 1.0]);
    assert_eq!(found.parameters[spring.free[0]], 4.0);
    assert!((found.parameters[rest] - (middle + 0.25)).abs() < 1e-12);
    assert!(library.candidates.iter().all(|c| c.effect.index == 1));
}

#[test]
fn muscles_shake_no_slower_than_one_hertz_and_a_trunk_no_faster_than_three() {
    let session = session(&[], (1e-3, 0.1));
    let prepared = PreparedSession::new(&session, 2).expect("a sound session");
    let point = prepared.linearize(&session.given()).expect("a run");
    let swinging = |frequency: f64| {
        let library = Library::build(&prepared, &point, Some([frequency, 0.4]));
        let candidates = library.expect("questions").candidates;
        let kinds = candidates.iter().map(Candidate::kind);
        let mut swinging: Vec<_> = kinds.filter(|k| k.prior().nature.swings()).collect();
        swinging.dedup();
        let mut names: Vec<_> = swinging.iter().map(|k| k.info().kind).collect();
        names.sort_unstable();
        names
    };
    assert_eq!(swinging(0.5), ["robot_ripple", "shoulder_heave"]);
    assert_eq!(swinging(1.3), ["robot_ripple", "shoulder_heave", "tremor"]);
    assert_eq!(swinging(5.0), ["robot_ripple", "tremor"]);
}
