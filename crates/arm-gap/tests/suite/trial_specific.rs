//! What is not the same in every trial: a handle or a sensor that slips, the robot's ripple.

use arm_core::effect::{Effect, Kind, Nature};
use arm_gap::data::session::Session;
use arm_gap::prepared_session::PreparedSession;
use arm_gap::trial_specific::component::TrialSpecific;
use arm_gap::trial_specific::tremor_detection::Line;
use arm_ident::regression::trial::Role;
use core::f64::consts::TAU;

use crate::sessions::{RATE, known, session};

/// The clearest disturbance of a session against the model as given.
fn disturbance(session: &Session<2>) -> Option<TrialSpecific> {
    let prepared = PreparedSession::new(session, 2).expect("a sound session");
    let point = prepared.linearize(&session.given()).expect("a run");
    prepared.disturbance(&point, 1.0)
}

/// A session one of whose encoders slips by an angle \[rad\] after 3 s of one trial.
fn slipped(by: f64) -> Session<2> {
    let mut session = session(&[], (1e-3, 0.1));
    let late = session.trials[1].q.iter_mut().skip((3.0 * RATE) as usize);
    late.for_each(|q| q[1] += by);
    session
}

#[test]
fn an_encoder_that_slips_is_found_with_its_trial_its_time_and_its_size() {
    let found = disturbance(&slipped(0.05)).expect("a slip");
    let offset = Kind::named("angle_offset").expect("known");
    assert_eq!(
        (found.effect.kind, found.effect.index, found.trial),
        (offset, 1, Some(1))
    );
    assert!(
        (found.effect.parameters[0] - 0.05).abs() < 0.005,
        "{found:?}"
    );
    assert!((found.span().0 - 3.0).abs() <= 0.2, "{found:?}");
    assert!(found.sd[0] < 0.005 && found.gain > 100.0, "{found:?}");
}

/// A session whose hand is displaced from its place by the robot's angles \[m\] from 3 s of one trial on.
fn slipped_in_the_hand(by: [f64; 2]) -> Session<2> {
    let mut session = session(&[], (1e-3, 0.1));
    let handle = session.trials[1].handle.as_mut().expect("a robot");
    for point in handle.iter_mut().skip((3.0 * RATE) as usize) {
        *point = [0, 1].map(|axis| point[axis] - by[axis]);
    }
    session
}

#[test]
fn a_handle_that_slips_is_found_with_its_trial_its_time_and_its_way() {
    let found = disturbance(&slipped_in_the_hand([0.003, -0.002])).expect("a slip");
    let slip = Kind::named("handle_slip").expect("known");
    assert_eq!((found.effect.kind, found.trial), (slip, Some(1)));
    for (axis, way) in [0.003, -0.002].into_iter().enumerate() {
        let told = found.effect.parameters[axis];
        assert!((told - way).abs() < 4.0 * found.sd[axis], "{found:?}");
        assert!(found.sd[axis] < 5e-4, "{found:?}");
    }
    assert!((found.span().0 - 3.0).abs() <= 0.1, "{found:?}");
    // How the handle is held differs from trial to trial by as much as that.
    assert!(disturbance(&slipped_in_the_hand([0.0005, 0.0005])).is_none());
}

/// A session with dry friction \[N m\] in the elbow, and in one trial with a burst of an amplitude \[N m\] from 2 s on besides.
fn tense(friction: f64, amplitude: f64) -> Session<2> {
    let effect =
        |kind, values: &[f64]| Effect::new(Kind::named(kind).expect("known"), 1).with(values);
    let dry = effect("coulomb", &[friction, 0.0]);
    let noise = (1e-3, 0.1);
    let mut session_with_one = session(&[dry], noise);
    let with_burst = session(&[dry, effect("voluntary", &[amplitude, 2.0, 0.6])], noise);
    session_with_one.trials[1] = with_burst.trials[1].clone();
    session_with_one.effects = known().into_iter().chain([dry]).collect();
    session_with_one
}

#[test]
fn a_burst_is_found_with_its_joint_and_not_below_twice_the_dry_friction() {
    let found = disturbance(&tense(0.2, 0.8)).expect("a burst");
    assert_eq!(found.effect.kind.prior().nature, Nature::Burst);
    assert_eq!((found.effect.index, found.trial), (1, Some(1)));
    let [amplitude, start, duration, ..] = found.effect.parameters;
    assert!((amplitude - 0.8).abs() < 0.1, "{found:?}");
    assert!(
        (start - 2.0).abs() < 0.15 && (duration - 0.6).abs() < 0.2,
        "{found:?}"
    );
    // Two repeats may hold the elbow with 0.2 N m to either side.
    assert!(disturbance(&tense(0.2, 0.35)).is_none());
    assert!(disturbance(&tense(0.0, 0.35)).is_some());
}

/// Of two repeats each looks disturbed beside the other, and a model that was fitted to both is as far from one as from the other.
#[test]
fn of_two_repeats_the_disturbed_one_is_that_without_which_the_model_fits() {
    for disturbed in [0, 1] {
        let mut session = tense(0.0, 0.8);
        session.trials.swap(1, disturbed);
        // Two repeats of each movement to fit.
        for movement in [0, 4] {
            session.trials[movement + 2].role = Role::Test;
        }
        let mut prepared = PreparedSession::new(&session, 2).expect("a sound session");
        let finding = prepared.search(&|_, _| Ok(())).expect("a finding");
        let bursts = finding.trial_specific.iter();
        let mut bursts = bursts.filter(|one| one.effect.kind.prior().nature == Nature::Burst);
        let found = bursts.next().expect("a burst");
        assert_eq!((found.effect.index, found.trial), (1, Some(disturbed)));
        assert!((found.effect.parameters[0] - 0.8).abs() < 0.1, "{found:?}");
        assert!(bursts.next().is_none());
    }
}

#[test]
fn nothing_is_found_in_noise_nor_in_what_the_calibration_promises() {
    assert!(disturbance(&slipped(0.0)).is_none());
    // 0.3° is 0.0052 rad.
    assert!(disturbance(&slipped(0.004)).is_none());
}

#[test]
fn a_robot_that_shakes_is_told_by_handle_and_hand_that_come_apart() {
    let ripple = |size: f64| {
        let mut session = session(&[], (2e-4, 0.02));
        for trial in &mut session.trials {
            let handle = trial.handle.as_mut().expect("a robot");
            for (i, point) in handle.iter_mut().enumerate() {
                point[1] -= size * libm::sin(TAU * 4.3 * i as f64 / RATE);
            }
        }
        let prepared = PreparedSession::new(&session, 2).expect("a sound session");
        let point = prepared.linearize(&session.given()).expect("a run");
        prepared
            .rhythm(&point, Line::OfTheRobot)
            .expect("an answer")
    };
    assert!(ripple(0.0).is_none());
    let found = ripple(1e-3).expect("a ripple");
    assert_eq!(found.effect.kind.prior().nature, Nature::Periodic);
    assert!((found.wave()[0] - 4.3).abs() < 0.05, "{found:?}");
    assert!(found.locked, "in the same phase in every trial");
    let axes = &found.effect.parameters[..2];
    assert!(
        axes[0].abs() < 2e-4 && (axes[1].abs() - 1e-3).abs() < 2e-4,
        "{axes:?}"
    );
}

/// A session with dry friction in the elbow and a shoulder that trembles with another phase in every trial.
fn trembling() -> Session<2> {
    let effect =
        |kind, j, values: &[f64]| Effect::new(Kind::named(kind).expect("known"), j).with(values);
    let dry = effect("coulomb", 1, &[0.15, 0.0]);
    let noise = (5e-4, 0.05);
    let mut all = session(&[dry], noise);
    for (i, trial) in all.trials.iter_mut().enumerate() {
        let phase = TAU * 0.37 * i as f64 - core::f64::consts::PI;
        let phase = phase.rem_euclid(TAU) - core::f64::consts::PI;
        let tremor = effect("tremor", 0, &[0.8, 5.5, phase]);
        *trial = session(&[dry, tremor], noise).trials[i].clone();
    }
    all.effects = known().into_iter().chain([dry]).collect();
    all
}

/// What dry friction resists with depends on the rhythm that shakes its joint: taken out of the channels alone it would leave three
/// times as much, beside the noise of repeats that differ by the rhythm.
#[test]
fn a_rhythm_is_put_into_the_runs_where_a_joint_rubs() {
    let session = trembling();
    let left = |inside: bool| {
        let mut prepared = PreparedSession::new(&session, 2).expect("a sound session");
        let point = prepared.linearize(&session.given()).expect("a run");
        let found = prepared.rhythm(&point, Line::BetweenRepeats);
        let found = found.expect("a spectrum").expect("a rhythm");
        let tremor = Kind::named("tremor").expect("known");
        assert_eq!((found.effect.kind, found.effect.index), (tremor, 0));
        let mut taken = found.clone();
        if !inside {
            // What is not of muscles is taken out of the channels.
            taken.effect = Effect::new(Kind::named("robot_ripple").expect("known"), 0);
        }
        prepared.take_out(&point, &taken).expect("finite channels");
        let (fitted, _) = prepared.calibrate().expect("a calibration");
        fitted.cost
    };
    let (inside, alone) = (left(true), left(false));
    assert!(inside < 0.33 * alone, "{inside} {alone}");
}

/// A rhythm whose runs cannot be simulated, here with an amplitude that no arm survives, is taken out of the channels alone: neither they
/// nor the runs have it afterwards.
#[test]
fn a_rhythm_that_cannot_be_put_into_the_runs_is_taken_out_of_the_channels() {
    let session = trembling();
    let mut prepared = PreparedSession::new(&session, 2).expect("a sound session");
    let point = prepared.linearize(&session.given()).expect("a run");
    let found = prepared.rhythm(&point, Line::BetweenRepeats);
    let mut found = found.expect("a spectrum").expect("a rhythm");
    found.effect.parameters[0] = 1e9;
    assert!(prepared.sized(&point, &found).is_none());
    prepared.take_out(&point, &found).expect("finite channels");
    let after = prepared.linearize(&session.given()).expect("a run");
    let left = prepared.rhythm(&after, Line::BetweenRepeats);
    assert!(
        left.expect("a spectrum")
            .is_none_or(|r| !r.swings_with(&found))
    );
}

/// To first order in a rhythm, a joint with dry friction responds as it does without one; runs with it give its phase.
#[test]
fn the_phase_of_a_rhythm_is_that_of_runs_where_a_joint_rubs() {
    let session = trembling();
    let prepared = PreparedSession::new(&session, 2).expect("a sound session");
    let tremor = Effect::new(Kind::named("tremor").expect("known"), 0).with(&[0.8, 5.5, 0.0]);
    for trial in [1, 6] {
        let course = &prepared.courses[trial];
        let own = session.in_trial((&session.given(), &[tremor]), course);
        let own = own.expect("a run");
        let off = own.named[0].parameters[2] - TAU * 0.37 * trial as f64;
        assert!((off - TAU * (off / TAU).round()).abs() < 0.1, "{off}");
    }
}
