//! What was measured, made ready: which trials repeat each other, which samples are compared, what is refitted, and the noise.

use arm_core::Joints;
use arm_core::effect::{Effect, Kind};
use arm_gap::GapError;
use arm_gap::data::noise::{NoiseModel, Thinned};
use arm_gap::data::repeats::groups;
use arm_gap::data::session::{ComparisonMode, Session};
use arm_gap::hypothesis::{Coordinate, Target};
use arm_gap::prepared_session::PreparedSession;
use arm_ident::regression::trial::{Role, Tolerance};
use std::sync::Arc;

use crate::sessions::{RATE, session};

fn quiet() -> Session<2> {
    session(&[], (1e-3, 0.1))
}

/// Which movement each trial belongs to.
fn grouped(session: &Session<2>) -> (Vec<usize>, Vec<usize>) {
    let course = |i| Arc::new(session.course(i).expect("a course"));
    let courses: Vec<_> = (0..session.trials.len()).map(course).collect();
    groups(&session.trials, &courses)
}

fn refusal(session: &Session<2>) -> String {
    match session.check() {
        Err(error @ GapError::Data { .. }) => error.to_string(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn what_no_comparison_can_be_made_of_is_refused() {
    let mut none = quiet();
    none.trials.iter_mut().for_each(|t| t.role = Role::Test);
    assert!(refusal(&none).contains("trials to fit"));
    let mut other = quiet();
    other.trials[3].handle = None;
    assert!(refusal(&other).contains("channels"));
    let mut torques = quiet();
    torques.comparison = ComparisonMode::Torque;
    assert!(torques.check().is_ok(), "forces tell torques");
    torques.trials[0].force_on_arm = None;
    assert!(refusal(&torques).contains("channels"));
    let mut gaps = quiet();
    for trial in &mut gaps.trials {
        (0..trial.len())
            .step_by(20)
            .for_each(|i| trial.valid[i] = false);
    }
    let prepared = PreparedSession::new(&gaps, 1).map(|p| p.fitted.clone());
    let error = prepared.expect_err("no stretch is long enough").to_string();
    assert!(error.contains("no stretch long enough"), "{error}");
}

#[test]
fn trials_of_one_path_to_a_centimetre_repeat_each_other() {
    let as_is = quiet();
    assert_eq!(grouped(&as_is), (vec![0, 0, 0, 0, 1, 1, 1, 1], vec![0, 4]));
    let moved = |by: f64| {
        let mut session = quiet();
        for point in session.trials[1].handle.as_mut().expect("a robot") {
            point[0] += by;
        }
        grouped(&session).0
    };
    assert_eq!(moved(0.009), [0, 0, 0, 0, 1, 1, 1, 1]);
    assert_eq!(moved(0.011), [0, 1, 0, 0, 2, 2, 2, 2]);
    let mut renamed = quiet();
    renamed.trials[2].configuration = 7;
    assert_eq!(grouped(&renamed).0, [0, 0, 1, 0, 2, 2, 2, 2]);
    let mut faster = quiet();
    faster.trials[0].rate = 1.01 * RATE;
    assert_eq!(grouped(&faster).0[..2], [0, 1]);
}

/// Keeps the first samples of a trial.
fn broken_off(session: &mut Session<2>, trial: usize, count: usize) {
    let trial = &mut session.trials[trial];
    trial.q.truncate(count);
    trial.valid.truncate(count);
    trial.force_on_arm.as_mut().expect("forces").truncate(count);
    trial.handle.as_mut().expect("a robot").truncate(count);
}

#[test]
fn a_trial_that_was_broken_off_after_half_of_the_way_is_a_repeat_and_no_reference() {
    let mut session = quiet();
    let whole = session.trials[0].len();
    broken_off(&mut session, 0, 2 * whole / 3);
    let (group_of, references) = grouped(&session);
    assert_eq!(group_of[..4], [0, 0, 0, 0]);
    assert_eq!(references[0], 1, "the longest");
    // So early that the handle has hardly moved.
    broken_off(&mut session, 0, whole / 12);
    assert_eq!(grouped(&session).0[..4], [0, 1, 1, 1]);
}

#[test]
fn a_disturbance_is_left_out_from_half_a_second_before_to_half_a_second_after() {
    let session = quiet();
    let mut prepared = PreparedSession::new(&session, 1).expect("a sound session");
    let all: Vec<usize> = prepared.valid_segments[0].samples().collect();
    prepared.leave_out(0, (2.0, 2.4));
    assert!(prepared.is_touched(0) && !prepared.is_touched(1));
    let left: Vec<usize> = prepared.valid_segments[0].samples().collect();
    let touched = |i: &usize| (1.5..=2.9).contains(&(*i as f64 / RATE));
    let away = all.iter().copied().filter(|i| !touched(i));
    assert_eq!(left, away.collect::<Vec<_>>());
    assert!((1..all.len()).contains(&left.len()));
    prepared.take_back();
    assert_eq!(
        prepared.valid_segments[0].samples().collect::<Vec<_>>(),
        all
    );
}

#[test]
fn between_gaps_four_samples_count_that_filters_reach_from_neither() {
    // Between two gaps of one sample; filters reach 1.5 periods of 5 Hz, 15 samples, and every fourth sample is compared.
    let kept = |between: usize| {
        let mut session = quiet();
        let valid = &mut session.trials[0].valid;
        (valid[40], valid[41 + between]) = (false, false);
        let prepared = PreparedSession::new(&session, 1).expect("a sound session");
        let inside = |i: &usize| (41..41 + between).contains(i);
        prepared.valid_segments[0].samples().filter(inside).count()
    };
    assert_eq!(kept(2 * 15 + 4 * 3), 0);
    assert_eq!(kept(2 * 15 + 4 * 4), 4);
    assert_eq!(kept(2 * 15 + 4 * 8), 8);
}

/// The number of a session that is refitted, where it is.
fn refitted(session: &Session<2>, target: Target) -> Option<Coordinate> {
    session.nuisances().into_iter().find(|c| c.target == target)
}

#[test]
fn what_is_known_is_refitted_within_four_standard_deviations() {
    let mut session = quiet();
    let (mass, viscosity, smooth) = (
        Target::Segment(1, 0),
        Target::Known(0, 0),
        Target::Known(2, 1),
    );
    let coulomb = Kind::named("coulomb").expect("known");
    session
        .effects
        .push(Effect::new(coulomb, 0).with(&[0.2, 0.01]));
    let limits = |c: &Coordinate| (c.prior.expect("known beforehand"), c.lower, c.upper);
    let close = |(a, b): (f64, f64)| (a - b).abs() < 1e-12;
    // 2 % of the segments, 5 % of a viscosity of 0.1, and nothing of what a torque is not linear in.
    let ((value, sd), lower, upper) = limits(&refitted(&session, mass).expect("a segment"));
    assert!(
        [(value, 0.0), (sd, 0.02), (lower, -0.08), (upper, 0.08)]
            .into_iter()
            .all(close)
    );
    let ((value, sd), lower, upper) = limits(&refitted(&session, viscosity).expect("an effect"));
    assert!(
        [(value, 0.1), (sd, 0.005), (lower, 0.08), (upper, 0.12)]
            .into_iter()
            .all(close)
    );
    assert!(refitted(&session, smooth).is_none());
    // Damping of the contact is known to 30 %, and no more than half as much again can be stepped through.
    let ((_, sd), lower, upper) =
        limits(&refitted(&session, Target::Contact(1, 0)).expect("a contact"));
    assert!(
        [(sd, 0.3), (lower, -0.9), (upper, 0.5)]
            .into_iter()
            .all(close)
    );
    session.segment_uncertainty = 0.0;
    session.effects[0].parameters[0] = 0.0;
    assert!(refitted(&session, mass).is_none() && refitted(&session, viscosity).is_none());
    assert_eq!(session.by_trial().len(), 4);
    session.tolerance = Tolerance {
        handle_placement: 0.0,
        force_bias: 0.0,
        ..session.tolerance
    };
    assert!(session.by_trial().is_empty() && refitted(&session, Target::Shift(0)).is_none());
}

#[test]
fn the_weight_moment_of_a_light_joint_is_a_third_of_the_arms_at_least() {
    let session = quiet();
    // 2.0 kg at 0.15 m, and 1.3 kg at 0.32 + 0.13 m; of the forearm alone 1.3 kg at 0.13 m.
    let (arm, forearm) = (9.81 * (2.0 * 0.15 + 1.3 * 0.45), 9.81 * 1.3 * 0.13);
    assert!((session.weight_moment(0) - arm).abs() < 1e-12);
    assert!(forearm < 0.3 * arm);
    assert!((session.weight_moment(1) - 0.3 * arm).abs() < 1e-12);
}

/// A session with joints that the model gives no law.
fn without_laws(effects: &[Effect<f64>]) -> Session<2> {
    let mut session = session(effects, (1e-3, 0.1));
    session.effects.clear();
    session
}

#[test]
fn laws_of_the_base_are_likely_where_measured_motion_shows_them() {
    let of = |kind: &str, index, values: &[f64]| {
        Effect::new(Kind::named(kind).expect("known"), index).with(values)
    };
    let session = without_laws(&[of("coulomb", 1, &[0.3, 0.01])]).with_base(1);
    let law = |kind: &str, joint: usize| {
        let kind = Kind::named(kind).expect("known");
        let own = |p: &&arm_gap::data::passive_law::Passive| {
            (p.effect.kind, p.effect.index) == (kind, joint)
        };
        session.base.iter().find(own).expect("a law").clone()
    };
    let friction = law("coulomb", 1);
    assert!(friction.likely && (friction.effect.parameters[0] - 0.3).abs() < 0.1);
    let none = law("elastic", 1);
    assert!(!none.likely && none.effect.parameters[0] == 0.0, "{none:?}");
    // A rest angle is known to a radian before the data; a response is taken with a hundredth of what a size may be.
    let [size, rest] = none.free[..] else {
        panic!("{none:?}");
    };
    assert_eq!((rest.sd, size.step), (1.0, 0.01 * size.sd));
    // The model has a law: nothing is added to its joints.
    assert!(quiet().with_base(1).base.is_empty());
}

#[test]
fn calibration_starts_no_further_than_three_standard_deviations_from_the_literature() {
    let mut session = without_laws(&[]);
    // A model that is half as heavy as the arm.
    let light = session.chain.segments().map(|s| arm_core::Segment {
        mass: 0.5 * s.mass,
        ..s
    });
    let (base, gravity) = (session.chain.base(), session.chain.gravity());
    session.chain = arm_core::Chain::new(light, base, gravity).expect("a possible arm");
    let start = session.with_base(1).start;
    let furthest = start
        .iter()
        .flatten()
        .fold(0.0, |most, c| f64::max(most, c.abs()));
    assert!((furthest - 0.06).abs() < 1e-12, "{start:?}");
}

#[test]
fn a_joint_that_hardly_moves_is_held_and_nothing_is_asked_of_it() {
    let held = |range: f64| {
        let mut session = without_laws(&[]);
        for trial in &mut session.trials {
            let count = trial.len() as f64;
            for (i, q) in trial.q.iter_mut().enumerate() {
                q[1] = 0.8 + range * (i as f64 / count);
            }
        }
        let session = session.with_base(1);
        let own = session.base.iter().filter(|p| p.effect.index == 1);
        let friction = own
            .clone()
            .filter(|p| p.likely)
            .map(|p| p.effect.parameters[0]);
        (
            own.clone().all(|p| p.free.is_empty()),
            friction.sum::<f64>(),
            session.weight_moment(0),
        )
    };
    let (nothing_free, holding, weight) = held(0.009);
    assert!(nothing_free);
    assert_eq!(holding, weight, "more than it must ever hold");
    assert!(!held(0.02).0);
}

#[test]
fn noise_is_measured_where_movements_are_repeated() {
    let session = quiet();
    let prepared = PreparedSession::new(&session, 1).expect("a sound session");
    assert!(prepared.repeated);
    let point = prepared.linearize(&session.given()).expect("a run");
    // The model is the truth: the residuals of each trial are as large as the noise.
    for (place, &trial) in prepared.fitted.iter().enumerate() {
        let rows =
            prepared.noise.white_at(&prepared.valid_segments[trial])(&point.residuals[place]);
        let square = rows.iter().map(|v| v * v).sum::<f64>() / rows.len() as f64;
        assert!((0.5..2.0).contains(&square), "trial {trial}: {square}");
    }
    let mut once = quiet();
    once.trials.retain(|t| t.role == Role::Fit);
    once.trials = vec![once.trials[0].clone(), once.trials[3].clone()];
    let prepared = PreparedSession::new(&once, 1).expect("a sound session");
    assert!(!prepared.repeated);
}

/// Two repeats of one movement, and a trial of another whose forces are three times as noisy: repeats tell nothing of that, what a model
/// leaves that explains the data does.
#[test]
fn once_the_data_are_explained_noise_is_read_off_all_trials() {
    let mut session = session(&[], (1e-3, 0.1));
    let noisy = crate::sessions::session(&[], (1e-3, 0.3));
    let of = |s: &Session<2>, i: usize| s.trials[i].clone();
    session.trials = vec![of(&session, 0), of(&session, 1), of(&noisy, 4)];
    let mut prepared = PreparedSession::new(&session, 1).expect("a sound session");
    assert!(prepared.repeated);
    let (fitted, point) = prepared.calibrate().expect("a calibration");
    // Mean square of the white rows of the forces.
    let mean = |prepared: &PreparedSession<2>| {
        let rows = fitted.residuals.iter().zip(&prepared.fitted);
        let rows = rows.flat_map(|(left, &trial)| {
            let all = prepared.noise.white_at(&prepared.valid_segments[trial])(left);
            all[all.len() / 2..].to_vec()
        });
        let (sum, count) = rows.fold((0.0, 0.0), |(s, n), v| (s + v * v, n + 1.0));
        sum / count
    };
    let before = mean(&prepared);
    prepared
        .measure_noise_left(&point, &fitted)
        .expect("what is left");
    let after = mean(&prepared);
    assert!(
        before > 1.5 && (after - 1.0).abs() < 0.15,
        "{before} {after}"
    );
}

fn whitened(noise: &NoiseModel, thinned: &Thinned) -> Vec<f64> {
    let whitening = noise.whitening_at(thinned.observed());
    noise.rows(thinned.channels.clone(), &whitening)
}

#[test]
fn noise_is_never_believed_to_be_below_a_two_thousandth_of_the_range() {
    let silent: Vec<Thinned> = vec![vec![vec![0.0; 500]; 2].into(); 8];
    let range = [2.0, 100.0];
    let noise = NoiseModel::of(&silent, &[], &range, &[1.0; 2]).expect("noise");
    let rows = whitened(&noise, &vec![vec![1e-3; 64], vec![0.05; 64]].into());
    // 5e-4 of 2 and of 100: one standard deviation each.
    for row in rows.chunks(64) {
        let mean = row.iter().sum::<f64>() / 64.0;
        assert!((mean - 1.0).abs() < 0.05, "{mean}");
    }
}

/// Uniform numbers of a generator of Knuth's, of variance 1.
fn uniform(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        12.0_f64.sqrt() * ((state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5)
    }
}

#[test]
fn noise_that_channels_share_is_taken_for_one() {
    let mut random = uniform(3);
    let series: Vec<Thinned> = (0..40)
        .map(|_| {
            let own: Vec<f64> = (0..100).map(|_| random()).collect();
            let other = own.iter().map(|v| 0.8 * v + 0.6 * random()).collect();
            vec![own, other].into()
        })
        .collect();
    let noise = NoiseModel::of(&series, &[], &[1.0; 2], &[1.0; 2]).expect("noise");
    let (mut own, mut both) = ([0.0; 2], 0.0);
    for one in &series {
        let rows = whitened(&noise, one);
        for i in 0..100 {
            both += rows[i] * rows[100 + i] / 4000.0;
            own[0] += rows[i] * rows[i] / 4000.0;
            own[1] += rows[100 + i] * rows[100 + i] / 4000.0;
        }
    }
    assert!(own.iter().all(|v| (v - 1.0).abs() < 0.02), "{own:?}");
    assert!(both.abs() < 0.02, "{both}");
}

#[test]
fn without_repeats_noise_is_larger_by_as_much_as_it_is_correlated() {
    let mut random = uniform(9);
    let mut slow = |share: f64| -> Vec<Vec<Vec<f64>>> {
        let mut x = 0.0;
        let mut next = || {
            x = share * x + (1.0 - share * share).sqrt() * random();
            x
        };
        (0..8)
            .map(|_| vec![(0..2000).map(|_| next()).collect()])
            .collect()
    };
    let size = |series: &[Vec<Vec<f64>>]| {
        let noise =
            NoiseModel::without_repeats(series, &[1.0], (&[1.0], Vec::new())).expect("noise");
        1.0 / whitened(&noise, &vec![vec![1.0; 2]].into())[1]
    };
    let (white, slow) = (size(&slow(0.0)), size(&slow(0.9)));
    assert!((white - 1.0).abs() < 0.1, "{white}");
    // A correlation of 0.9 a sample leaves (1 − 0.9) / (1 + 0.9) of the samples.
    assert!((slow / 19.0_f64.sqrt() - 1.0).abs() < 0.2, "{slow}");
}

#[test]
fn samples_at_which_a_joint_with_dry_friction_rests_are_not_compared() {
    let mut session = quiet();
    let coulomb = Kind::named("coulomb").expect("known");
    session
        .effects
        .push(Effect::new(coulomb, 1).with(&[0.3, 0.0]));
    let free = quiet();
    let prepared = PreparedSession::new(&session, 1).expect("a sound session");
    let without = PreparedSession::new(&free, 1).expect("a sound session");
    assert_eq!((prepared.dry, without.dry), ([false, true], [false; 2]));
    let rows = |p: &PreparedSession<2>| p.valid_segments[0].rows_per_channel(4);
    let (own, all) = (rows(&prepared), rows(&without));
    // Two joints: the component of the force that no torque of the elbow changes is still observable.
    assert_eq!(own[..3], all[..3]);
    assert!(own[3] < all[3] && own[3] > 0, "{own:?} {all:?}");
    let joints = |q: &Joints<f64, 2>| q.iter().all(|v| v.is_finite());
    assert!(session.trials[0].q.iter().all(joints));
}
