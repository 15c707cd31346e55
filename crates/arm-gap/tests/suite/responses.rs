//! The linearised responses are those of the simulation.

use arm_core::effect::{Effect, Kind};
use arm_gap::hypothesis::{Coordinate, Hypothesis, Target};
use arm_gap::prepared_session::PreparedSession;

use crate::sessions::session;

/// Root mean square of channels.
fn size(channels: &[Vec<f64>]) -> f64 {
    let all = channels.iter().flatten();
    let (sum, count) = all.fold((0.0, 0.0), |(s, n), v| (s + v * v, n + 1.0));
    f64::sqrt(sum / count)
}

#[test]
fn linearised_responses_are_those_of_the_simulation() {
    let session = session(&[], (1e-4, 0.01));
    let prepared = PreparedSession::new(&session, 1).expect("a sound session");
    let named = |kind: &str, index: usize| -> Hypothesis<2> {
        let mut hypothesis = session.given();
        let mut effect = Effect::new(Kind::named(kind).expect("known"), index);
        effect.parameters[0] = 0.0;
        hypothesis.named.push(effect);
        hypothesis
    };
    let late = |gain: f64| -> Hypothesis<2> {
        let mut hypothesis = named("stretch_reflex", 1);
        hypothesis.named[0] = hypothesis.named[0].with(&[gain, 0.1, 0.0, 0.04]);
        hypothesis
    };
    let plain = session.given();
    let first = Target::Named(0, 0);
    let cases = [
        (plain.clone(), Target::Segment(1, 0), 0.02),
        (plain.clone(), Target::Segment(0, 2), 0.1),
        (plain.clone(), Target::Shift(0), 1e-3),
        (plain.clone(), Target::Placement(1), 1e-3),
        (plain.clone(), Target::Known(1, 0), 0.02),
        (named("constant_moment", 0), first, 0.05),
        (named("elastic", 1), first, 0.05),
        (named("relaxation", 1), first, 0.05),
        (late(0.0), first, 0.05),
        (late(0.5), Target::Named(0, 3), 2e-3),
        (named("added_mass", 0), first, 0.02),
        (named("segment_length", 1), first, 1e-3),
        (named("gravity_tilt", 0), first, 0.01),
        (named("contact_compliance", 0), first, 2e-6),
        (named("shoulder_motion", 0), first, 1e-5),
        (named("motor_inertia", 0), first, 0.01),
        (named("time_delay", 0), first, 0.004),
        (named("force_misalignment", 0), first, 0.01),
    ];
    let course = &prepared.courses[0];
    for (hypothesis, target, step) in cases {
        let coordinate = Coordinate {
            target,
            prior: None,
            lower: f64::NEG_INFINITY,
            upper: f64::INFINITY,
            step,
        };
        let point = prepared.linearize(&hypothesis).expect("a run");
        let response = prepared
            .responses_to(&point, &[coordinate])
            .expect("a response");
        let linear = &response[0].0[0];
        let play = |h: &Hypothesis<2>| {
            let run = session.run(h, course).expect("a stable run");
            session.read(h, course, &run).expect("readings")
        };
        let value = hypothesis.get(target);
        let up = play(&hypothesis.clone().with(target, value + step));
        let base = play(&hypothesis);
        let inner = |channels: &[Vec<f64>]| -> Vec<Vec<f64>> {
            channels
                .iter()
                .map(|c| c[20..c.len() - 20].to_vec())
                .collect()
        };
        let simulated: Vec<Vec<f64>> = std::iter::zip(&up, &base)
            .map(|(a, b)| std::iter::zip(a, b).map(|(a, b)| (a - b) / step).collect())
            .collect();
        for channels in [0..2, 2..4] {
            let (seen, expected) = (
                inner(&linear[channels.clone()]),
                inner(&simulated[channels]),
            );
            let trial_specific: Vec<Vec<f64>> = std::iter::zip(&seen, &expected)
                .map(|(a, b)| std::iter::zip(a, b).map(|(a, b)| a - b).collect())
                .collect();
            let (off, whole) = (size(&trial_specific), size(&expected));
            assert!(
                off <= 0.06 * whole + 1e-9,
                "{target:?} {:?}: {off} of {whole}",
                hypothesis.named.first().map(|e| e.kind)
            );
        }
    }
}

#[test]
fn a_changed_hypothesis_is_followed_as_it_is_simulated() {
    let session = session(&[], (1e-4, 0.01));
    let prepared = PreparedSession::new(&session, 1).expect("a sound session");
    let plain = session.given();
    let strong = [
        ("viscous", 1, &[0.5][..]),
        ("coulomb", 0, &[0.4]),
        ("thixotropy", 1, &[0.3]),
        ("relaxation", 1, &[2.0, 1.0]),
        ("stretch_reflex", 1, &[0.5, 0.1, 0.0, 0.04]),
        ("contact_compliance", 0, &[1e-4, 1e-4]),
        ("backlash", 0, &[2e-3, 2e-3]),
        ("shoulder_motion", 0, &[0.01, 0.01]),
        ("added_mass", 0, &[0.5]),
    ];
    for (kind, index, values) in strong {
        let mut changed = plain.clone();
        let effect = Effect::new(Kind::named(kind).expect("known"), index).with(values);
        changed.named.push(effect);
        is_followed(&prepared, (&plain, &changed), 0.02, kind);
    }
}

/// Checks that what is followed from the run of one hypothesis to another differs from its simulation by no more than a share of what
/// the two simulations differ by.
fn is_followed(
    prepared: &PreparedSession<2>,
    (plain, changed): (&Hypothesis<2>, &Hypothesis<2>),
    share: f64,
    what: &str,
) {
    let (session, course) = (prepared.session, &prepared.courses[0]);
    let read = |h: &Hypothesis<2>| {
        let run = session.run(h, course).expect("a stable run");
        session.read(h, course, &run).expect("readings")
    };
    let (now, then) = (read(changed), read(plain));
    let point = prepared.linearize(plain).expect("a run");
    let followed = prepared
        .residuals(&point, changed)
        .unwrap_or_else(|e| panic!("{what}: {e}"));
    for channels in [0..2, 2..4] {
        let (mut off, mut whole) = (0.0, 0.0);
        for c in channels {
            let count = now[c].len();
            for i in 20..count - 20 {
                let seen = course.seen[c][i] - followed[0][c][i];
                off += (seen - now[c][i]) * (seen - now[c][i]);
                whole += (now[c][i] - then[c][i]) * (now[c][i] - then[c][i]);
            }
        }
        assert!(off <= share * share * whole, "{what}: {off} of {whole}");
    }
}

#[test]
fn a_joint_that_sticks_is_followed_as_it_is_simulated() {
    let session = session(&[], (1e-4, 0.01));
    let prepared = PreparedSession::new(&session, 1).expect("a sound session");
    let sticking = |torque: f64| {
        let mut hypothesis = session.given();
        let coulomb = Kind::named("coulomb").expect("known");
        let effects = (0..2).map(|j| Effect::new(coulomb, j).with(&[torque, 0.0]));
        hypothesis.named.extend(effects);
        hypothesis
    };
    let with = |mut hypothesis: Hypothesis<2>, kind: &str, values: &[f64]| {
        let kind = Kind::named(kind).expect("known");
        hypothesis.named.push(Effect::new(kind, 1).with(values));
        hypothesis
    };
    let cases = [
        ("more friction", sticking(0.1), sticking(0.3)),
        ("friction at all", sticking(0.0), sticking(0.3)),
        ("no friction", sticking(0.3), sticking(0.0)),
        (
            "a spring where it sticks",
            sticking(0.2),
            with(sticking(0.2), "elastic", &[1.0, 1.0]),
        ),
        (
            "smooth in place of set-valued friction",
            sticking(0.0),
            with(sticking(0.0), "coulomb", &[0.2, 0.01]),
        ),
    ];
    for (what, plain, changed) in &cases {
        is_followed(&prepared, (plain, changed), 0.05, what);
    }
}

#[test]
fn a_number_that_is_held_is_no_unknown_and_the_others_answer_as_before() {
    let session = session(&[], (1e-3, 0.1));
    let prepared = PreparedSession::new(&session, 1).expect("a sound session");
    let point = prepared.linearize(&session.given()).expect("a run");
    let held = point.holding(|t| t == Target::Known(1, 0));
    let place = |p: &[Coordinate]| p.iter().position(|c| c.target == Target::Known(1, 0));
    let place_before = place(&point.coordinates).expect("an unknown");
    assert_eq!(place(&held.coordinates), None);
    let before = point.rows.clusters(&prepared, &[], &point.residuals);
    let after = held.rows.clusters(&prepared, &[], &point.residuals);
    for (before, after) in std::iter::zip(&before, &after) {
        let kept = |n: usize| (0..n).filter(|&i| i != place_before);
        for (a, i) in kept(before.gram.rows()).enumerate() {
            assert_eq!(before.score[i], after.score[a]);
            for (b, j) in kept(before.gram.rows()).enumerate() {
                assert_eq!(before.gram[(i, j)], after.gram[(a, b)]);
            }
        }
    }
}

#[test]
fn a_delayed_force_keeps_the_ringing_of_the_arm_on_its_contact() {
    let session = session(&[], (0.0, 0.0));
    let mut hypothesis = session.given();
    let delay = Effect::new(Kind::named("time_delay").expect("known"), 0);
    hypothesis.calibration = vec![delay.with(&[0.004])];
    // Without the damping of the contact the arm rings on from the first jerk.
    hypothesis.contact[1] = [-0.9; 2];
    let course = session.course(1).expect("a course");
    let read = |parts: Option<usize>| {
        let run = match parts {
            None => session.run(&hypothesis, &course),
            Some(parts) => session.run_finely(&hypothesis, &course, parts),
        };
        let run = run.expect("a run");
        let read = session.read_raw(&hypothesis, &course, &run);
        read.expect("channels")[2].clone()
    };
    let fine = read(Some(20));
    let off = |column: &[f64]| {
        let off = std::iter::zip(column, &fine).map(|(a, b)| a - b);
        size(&[off.collect()])
    };
    // Recorded no finer than it is read, a run loses much more.
    assert!(off(&read(None)) < 2e-3, "{}", off(&read(None)));
    assert!(off(&read(Some(1))) > 10.0 * off(&read(None)));
}
