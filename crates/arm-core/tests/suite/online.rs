//! The equation of motion in its unknowns, the online estimator on exact data, and the torque that carries an arm.

use core::array::from_fn;

use arm_core::effect::{ActsOn, Effect, KINDS, Kind, Motion, States, resisting_torque};
use arm_core::estimator::{Decision, Estimator, Fault, Sample, SampleStatus, Settings};
use arm_core::{
    Compensation, Equation, Invalid, Joints, Measured, Pose, Prior, gravity, inverse_dynamics,
    joint_force, sample_arms, static_torque,
};

use crate::common::Random;

/// Effects of a typical subject: friction and springs in every joint, end stops, one over two joints, one known.
fn typical() -> [Effect<f64>; 10] {
    [
        Effect::new(Kind::Viscous, 0).with(&[0.25]),
        Effect::new(Kind::Viscous, 1).with(&[0.2]),
        Effect::new(Kind::Viscous, 2).with(&[0.05]),
        Effect::new(Kind::Coulomb, 1).with(&[0.16]),
        Effect::new(Kind::Elastic, 0).with(&[1.2, -0.8]),
        Effect::new(Kind::Elastic, 2).with(&[0.5, 0.1]),
        Effect::new(Kind::EndRange, 1).with(&[1.0, 0.8, 8.0, 1.6, 0.2]),
        Effect::new(Kind::Biarticular, 2).with(&[0.4]),
        Effect::new(Kind::Relaxation, 1).with(&[2.0, 0.5]),
        Effect::new(Kind::Coulomb, 0),
    ]
}

/// The last effect is switched off.
fn equation() -> Equation<f64, 3, 18, 10> {
    let mut effects = typical();
    effects[9].on = false;
    let arm = sample_arms::human_arm()
        .with_rotor_inertia([0.01, 0.0, 0.002])
        .expect("rotors");
    Equation::new(arm, effects).expect("an arm")
}

fn truth(equation: &Equation<f64, 3, 18, 10>) -> [f64; 18] {
    equation.priors(0.1).map(|p| p.mean)
}

fn memory() -> [States<f64>; 10] {
    from_fn(|i| from_fn(|k| 0.03 * (i + k) as f64))
}

#[test]
fn the_columns_times_the_unknowns_are_the_torque_that_a_motion_needs() {
    let (equation, mut random) = (equation(), Random(21));
    let values = truth(&equation);
    for _ in 0..200 {
        let mut motion: Motion<f64, 3> = random.motion();
        motion.joint_force = [0.0; 3];
        let measured = Measured {
            torque: random.joints(3.0),
            force_on_arm: [random.uniform(-9.0, 9.0), random.uniform(-9.0, 9.0)],
            moment_on_arm: random.uniform(-1.0, 1.0),
        };
        let (rows, acting) = equation.needed(&motion, &memory(), &measured);
        let pose = Pose::new(&motion.q);
        let expected = inverse_dynamics(equation.chain(), &pose, &motion.qd, &motion.qdd)
            + resisting_torque(equation.effects(), &motion, &memory());
        let load = static_torque(
            equation.chain(),
            &pose,
            measured.force_on_arm,
            measured.moment_on_arm,
        ) + measured.torque;
        assert!((acting - load).norm() < 1e-12);
        // The exponentials of the end stops reach 1e9.
        let off = (rows.torque(&values) - expected).norm() / expected.norm().max(1.0);
        assert!(off < 1e-12, "{off}");
    }
}

/// A device evaluates each law for a unit of its parameters, a simulation as a whole.
#[test]
fn a_device_resists_as_the_laws_say() {
    let (arm, mut random) = (sample_arms::human_arm(), Random(27));
    for &kind in KINDS.iter().filter(|k| k.acts_on() == ActsOn::Joints) {
        for _ in 0..100 {
            let effect: Effect<f64> = random.effect(kind, 1);
            let equation = Equation::<f64, 3, 18, 1>::new(arm, [effect]).expect("an arm");
            let (motion, memory): (Motion<f64, 3>, _) = (random.motion(), [random.states()]);
            let force_on_arm = [random.uniform(-9.0, 9.0), random.uniform(-9.0, 9.0)];
            let pose = Pose::new(&motion.q);
            let load = Measured {
                force_on_arm,
                ..Measured::none()
            };
            let felt = motion.with_joint_force(&joint_force(
                &arm,
                &pose,
                (&motion.qd, &motion.qdd),
                force_on_arm,
            ));
            let expected = resisting_torque(&[effect], &felt, &memory);
            let found = equation.resisting(&pose, &motion, &memory, force_on_arm);
            let most = 1e-14 * expected.amax().max(1.0);
            assert!((found - expected).amax() <= most, "{}", kind.info().kind);
            let demanded = equation.demanded(&motion, &memory, &load);
            let (rows, pushed) = equation.needed(&motion, &memory, &load);
            let needed = rows.torque(&equation.priors(0.1).map(|p| p.mean)) - pushed;
            let off = (demanded - needed).amax() / needed.amax().max(1.0);
            assert!(off < 1e-12, "{} {off}", kind.info().kind);
        }
    }
}

/// A rich movement in joint angles, and its torques.
fn sample(equation: &Equation<f64, 3, 18, 10>, t: f64) -> Sample<f64, 3> {
    let wave = |j: usize| {
        let (w, phase) = (1.3 + 0.7 * j as f64, 0.9 * j as f64);
        let (s, c) = (libm::sin(w * t + phase), libm::cos(w * t + phase));
        [0.6 * s, 0.6 * w * c, -0.6 * w * w * s]
    };
    let centre = [-0.8, 0.9, 0.1];
    let mut motion = Motion::new(
        t,
        Joints::from_fn(|j, _| centre[j] + wave(j)[0]),
        Joints::from_fn(|j, _| wave(j)[1]),
    );
    motion.qdd = Joints::from_fn(|j, _| wave(j)[2]);
    let nothing = Measured {
        torque: Joints::zeros(),
        force_on_arm: [0.0; 2],
        moment_on_arm: 0.0,
    };
    let (rows, _) = equation.needed(&motion, &[[0.0; 3]; 10], &nothing);
    Sample {
        q: motion.q,
        lead: None,
        measured: Measured {
            torque: rows.torque(&truth(equation)),
            ..nothing
        },
    }
}

fn settings() -> Settings<f64, 3> {
    let mut settings = Settings::new(&sample_arms::human_arm(), 1e-3);
    settings.cutoff = 40.0;
    settings.noise = [0.005; 3];
    settings
}

fn started(settings: &Settings<f64, 3>) -> Estimator<f64, 3, 18, 10> {
    let mut effects = typical();
    effects[9].on = false;
    // Relaxation needs its state: it is left out of what is to be found exactly.
    effects[8].on = false;
    let equation = Equation::new(sample_arms::human_arm(), effects).expect("an arm");
    let mut priors = equation.priors(0.1);
    for (i, prior) in priors.iter_mut().enumerate().take(equation.used()) {
        prior.mean = if i < 6 { 1.08 * prior.mean } else { 0.0 };
        prior.min = prior.min.max(0.0);
    }
    Estimator::new(equation, priors, settings).expect("settings in range")
}

#[test]
fn exact_data_give_the_truth_from_a_wrong_start() {
    let mut online = started(&settings());
    let mut source = typical();
    source[8].on = false;
    source[9].on = false;
    let equation = Equation::new(sample_arms::human_arm(), source).expect("an arm");
    for k in 0..20_000 {
        online.update(Some(&sample(&equation, f64::from(k) * 1e-3)));
    }
    for (e, value) in online
        .estimates()
        .iter()
        .zip(truth(&equation))
        .take(equation.used())
    {
        assert!(
            (e.value - value).abs() <= 3.0 * e.sd,
            "{e:?} instead of {value}"
        );
    }
    // The large ones are known well, and the torque that carries the arm even better.
    for i in 0..3 {
        let e = online.estimates()[i];
        assert_eq!(e.decided_by, Decision::Data);
        assert!((e.value / truth(&equation)[i] - 1.0).abs() < 0.01, "{e:?}");
    }
    let still = Motion::new(0.0, [-0.7, 1.1, 0.2].into(), [0.0; 3].into());
    let carry = online.carry(&still);
    let needed = equation
        .carrying(&still, &[[0.0; 3]; 10])
        .torque(&truth(&equation));
    for j in 0..3 {
        assert!(
            (carry.torque[j] - needed[j]).abs() < 0.02,
            "{carry:?} {needed}"
        );
        assert!(carry.sd[j] < 0.02, "{carry:?}");
    }
}

#[test]
fn what_is_not_moved_is_said_to_be_prior() {
    let mut online = started(&settings());
    let equation = *online.equation();
    // Only the wrist moves: nothing is learned of the shoulder's inertia.
    for k in 0..8_000 {
        let mut s = sample(&equation, f64::from(k) * 1e-3);
        s.q[0] = -0.8;
        s.q[1] = 0.9;
        online.update(Some(&s));
    }
    let shoulder_viscosity = online.estimates()[6];
    assert_eq!(shoulder_viscosity.decided_by, Decision::Prior);
    assert!(shoulder_viscosity.sd > 1.0, "{shoulder_viscosity:?}");
}

#[test]
fn forgetting_at_rest_and_in_a_poor_movement_does_not_wind_up() {
    let mut forgetting = settings();
    forgetting.forgetting = 5.0;
    let mut online = started(&forgetting);
    let equation = *online.equation();
    for k in 0..12_000 {
        online.update(Some(&sample(&equation, f64::from(k) * 1e-3)));
    }
    let mut random = Random(9);
    // A minute of rest with noise: once the movement has run out of the filters, nothing changes.
    let held = sample(&equation, 12.0);
    let mut learned = *online.estimates();
    for k in 0..61_000 {
        let mut s = held;
        s.measured.torque[0] += random.uniform(-0.01, 0.01);
        online.update(Some(&s));
        if k == 1_000 {
            learned = *online.estimates();
        }
    }
    assert_eq!(*online.estimates(), learned);
    // Two minutes in which only the wrist moves: what it does not show comes back to the prior and stays finite.
    for k in 0..120_000 {
        let mut s = sample(&equation, f64::from(k) * 1e-3);
        (s.q[0], s.q[1]) = (-0.8, 0.9);
        s.measured.torque[1] += random.uniform(-0.05, 0.05);
        online.update(Some(&s));
    }
    for (e, prior) in online.estimates().iter().zip(online.priors()) {
        assert!(
            e.value.is_finite() && (e.value - prior.mean).abs() < 10.0 * prior.sd,
            "{e:?}"
        );
        assert!(e.sd <= prior.sd * 1.0001, "{e:?} {prior:?}");
    }
}

#[test]
fn bad_samples_are_named() {
    let mut strict = settings();
    strict.steepest = 1000.0;
    strict.frozen_after = 0.01;
    let mut online = started(&strict);
    let equation = *online.equation();
    let at = |k: i32| sample(&equation, f64::from(k) * 1e-3);
    assert_eq!(online.update(None), SampleStatus::Refused(Fault::Missing));
    assert_eq!(online.update(Some(&at(0))), SampleStatus::Settling);
    for k in 1..2000 {
        online.update(Some(&at(k)));
    }
    assert_eq!(online.update(Some(&at(2000))), SampleStatus::Taken);
    assert_eq!(online.update(None), SampleStatus::Refused(Fault::Missing));
    let mut s = at(2002);
    s.measured.force_on_arm[1] = f64::NAN;
    assert_eq!(
        online.update(Some(&s)),
        SampleStatus::Refused(Fault::NotFinite)
    );
    s = at(2003);
    s.q[1] += 1.0;
    assert_eq!(online.update(Some(&s)), SampleStatus::Refused(Fault::Spike));
    assert_eq!(online.update(Some(&at(2004))), SampleStatus::Taken);
    let held = at(2005);
    let mut last = SampleStatus::Taken;
    for k in 2005..2020 {
        s = at(k);
        s.measured.torque[2] = held.measured.torque[2];
        last = online.update(Some(&s));
    }
    assert_eq!(last, SampleStatus::Refused(Fault::Frozen));
    // After a long gap the filters settle anew.
    for _ in 0..100 {
        online.update(None);
    }
    assert_eq!(online.update(Some(&at(2120))), SampleStatus::Settling);
}

#[test]
fn impossible_settings_and_priors_are_refused() {
    let equation = equation();
    type Change<'a> = &'a dyn Fn(&mut Settings<f64, 3>, &mut [Prior<f64>; 18]);
    let refused = |change: Change| {
        let (mut settings, mut priors) = (settings(), equation.priors(0.1));
        change(&mut settings, &mut priors);
        Estimator::new(equation, priors, &settings).expect_err("refused")
    };
    let named = |found: Invalid| match found {
        Invalid::NotFinite { name, .. } | Invalid::OutOfRange { name, .. } => name,
        other => panic!("{other}"),
    };
    assert_eq!(named(refused(&|s, _| s.period = 0.0)), "control period");
    assert_eq!(
        named(refused(&|s, _| s.period = f64::NAN)),
        "control period"
    );
    assert_eq!(
        named(refused(&|s, _| s.cutoff = 500.0)),
        "cutoff in units of the sampling rate"
    );
    assert_eq!(
        named(refused(&|s, _| s.window = 1e-3)),
        "control periods in a window"
    );
    assert_eq!(named(refused(&|s, _| s.noise[2] = 0.0)), "noise of joint");
    assert_eq!(named(refused(&|s, _| s.gate = f64::NAN)), "gate");
    assert_eq!(
        named(refused(&|s, _| s.forgetting = -1.0)),
        "time of forgetting"
    );
    assert_eq!(
        named(refused(&|_, p| p[3].sd = 0.0)),
        "standard deviation of unknown"
    );
    assert_eq!(named(refused(&|_, p| p[3].max = -1.0)), "bound of unknown");
    let narrow = Equation::<f64, 3, 8, 10>::new(sample_arms::human_arm(), typical());
    assert_eq!(named(narrow.expect_err("too many")), "number of unknowns");
}

#[test]
fn the_error_of_the_carrying_torque_follows_from_the_covariance() {
    let equation = equation();
    let values = truth(&equation);
    // X_1 is wrong by 0.02 kg m, X_2 by −0.5 times as much: level, the weight's error is 9.81 · (0.02 − 0.01).
    let mut covariance = [[0.0; 18]; 18];
    covariance[0][0] = 4e-4;
    covariance[1][0] = -2e-4;
    covariance[1][1] = 1e-4;
    let carry = Compensation::new(equation, values, &covariance).expect("a covariance");
    let level = Motion::new(0.0, [0.0; 3].into(), [0.0; 3].into());
    let found = carry.carry(&level, &[[0.0; 3]; 10]);
    assert!((found.sd[0] - 0.0981).abs() < 1e-9 && (found.sd[1] - 0.0981).abs() < 1e-9);
    assert_eq!(found.sd[2], 0.0);
    let expected = gravity(equation.chain(), &Pose::new(&level.q))
        + resisting_torque(equation.effects(), &level, &[[0.0; 3]; 10]);
    assert!((found.torque - expected).norm() < 1e-12);
    covariance[0][0] = -1.0;
    assert!(Compensation::new(equation, values, &covariance).is_err());
}
