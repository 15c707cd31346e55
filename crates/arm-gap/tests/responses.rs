//! The linearised responses are those of the simulation, and a hidden effect is found in simulated data.

use arm_core::effect::{Effect, Kind};
use arm_core::{Chain, Contact, Elbow, Joints, Limits, Robot, Segment, Setup, Shape};
use arm_gap::data::prepared_session::PreparedSession;
use arm_gap::data::session::{ComparisonMode, Session};
use arm_gap::measurement_model::hypothesis::{Coordinate, Hypothesis, Target};
use arm_ident::regression::trial::{Role, Tolerance, Trial};
use arm_sim::{
    Channel, Coupling, Drive, Experiment, HandlePath, Movement, Sensors, Start, simulate,
};

const RATE: f64 = 50.0;

fn arm() -> Chain<f64, 2> {
    let segment = |length, mass, com, inertia| Segment {
        length,
        mass,
        com: [com, 0.0],
        inertia,
    };
    Chain::new(
        [
            segment(0.32, 2.0, 0.15, 0.02),
            segment(0.28, 1.3, 0.13, 0.012),
        ],
        [0.0, 0.0],
        [0.0, -9.81],
    )
    .expect("a possible arm")
}

fn known() -> Vec<Effect<f64>> {
    let viscous = Kind::named("viscous").expect("known");
    (0..2)
        .map(|j| Effect::new(viscous, j).with(&[0.1]))
        .collect()
}

/// Two movements, each repeated: synthetic trials of an arm with `effects`, read by sensors with white noise.
fn session(effects: &[Effect<f64>], noise: (f64, f64)) -> Session<2> {
    let chain = arm();
    let contact = Contact::new([1e4; 2], [25.0; 2]);
    let robot = Robot::new([0.5, 0.45], [1.0, -0.1], Elbow::Up).expect("a possible robot");
    let degrees = |list: &[[f64; 2]]| -> Vec<Joints<f64, 2>> {
        list.iter()
            .map(|w| Joints::from(w.map(f64::to_radians)))
            .collect()
    };
    let movements = [
        (
            degrees(&[[-60.0, 50.0], [-30.0, 50.0], [-30.0, 85.0], [-60.0, 50.0]]),
            0.4,
        ),
        (degrees(&[[-50.0, 80.0], [-20.0, 40.0], [-50.0, 80.0]]), 1.0),
    ];
    let mut trials = Vec::new();
    for (configuration, (waypoints, speed)) in movements.into_iter().enumerate() {
        let limits = Limits {
            speed,
            acceleration: 4.0 * speed,
        };
        let movement = Movement::within(Shape::Smooth, &waypoints, &[limits; 2], 0.3)
            .expect("a possible movement");
        let duration = (movement.duration() * RATE).ceil() / RATE;
        let path = HandlePath::of_arm(chain, movement);
        let drive = Drive::Handle {
            path,
            coupling: Coupling::Compliant,
        };
        let mut experiment = Experiment::new(Setup::new(&chain, contact), drive, duration);
        experiment.effects = known().into_iter().chain(effects.iter().copied()).collect();
        experiment.robot = Some(robot);
        experiment.start = Start::Equilibrium { near: waypoints[0] };
        experiment.output_interval = Some(0.5 / RATE);
        let recording = simulate(&experiment).expect("a stable run");
        for repeat in 0..4 {
            let mut sensors = Sensors::<2>::ideal();
            sensors.rate = RATE;
            sensors.seed = 100 * configuration as u64 + repeat;
            sensors.angle = [Channel::white(noise.0); 2];
            sensors.force = [Channel::white(noise.1); 2];
            let read = sensors.read(&experiment, &recording).expect("readings");
            let count = read.time.len();
            trials.push(Trial {
                role: if repeat == 3 { Role::Test } else { Role::Fit },
                configuration,
                rate: RATE,
                q: (0..count)
                    .map(|i| Joints::from_column_slice(&read.q[2 * i..2 * i + 2]))
                    .collect(),
                speed: None,
                force_on_arm: Some(
                    (0..count)
                        .map(|i| [read.force_on_arm[2 * i], read.force_on_arm[2 * i + 1]])
                        .collect(),
                ),
                moment_on_arm: None,
                torque: None,
                handle: Some(
                    (0..count)
                        .map(|i| {
                            robot.handle(&[read.robot_q[2 * i], read.robot_q[2 * i + 1]].into())
                        })
                        .collect(),
                ),
                valid: vec![true; count],
            });
        }
    }
    Session {
        chain,
        contact,
        effects: known(),
        segment_uncertainty: 0.02,
        tolerance: Tolerance::default(),
        trials,
        comparison: ComparisonMode::Led,
        own: Vec::new(),
        base: Vec::new(),
        start: [[0.0; 3]; 2],
    }
}

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
fn nothing_is_named_where_nothing_is_hidden() {
    let session = session(&[], (1e-3, 0.1));
    let mut prepared = PreparedSession::new(&session, 2).expect("a sound session");
    let finding = prepared.search(&|_, _| Ok(())).expect("a finding");
    assert!(finding.amended.hypothesis.named.is_empty());
    assert!(finding.trial_specific.is_empty());
    assert!(finding.lack[1].z < 4.0, "{:?}", finding.lack);
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
        for (a, i) in kept(before.gram.nrows()).enumerate() {
            assert_eq!(before.score[i], after.score[a]);
            for (b, j) in kept(before.gram.nrows()).enumerate() {
                assert_eq!(before.gram[(i, j)], after.gram[(a, b)]);
            }
        }
    }
}

/// The session of an arm whose model has no joint law at all.
fn little_known(effects: &[Effect<f64>]) -> Session<2> {
    let mut session = session(effects, (1e-3, 0.1));
    session.effects.clear();
    session.with_base()
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
        let session = session.with_base();
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
