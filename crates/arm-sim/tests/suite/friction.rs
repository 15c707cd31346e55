//! Set-valued dry friction is solved: joints stick and slip, and the step does not matter.

use arm_core::effect::{Effect, Kind};
use arm_core::{Chain, Contact, Segment, Setup, Shape};
use arm_sim::{
    Drive, Experiment, Integrator, Interpolation, Recording, Series, SimulationError, Start,
    sample_experiments, simulate,
};

use crate::common::{largest, most, run};
use crate::friction_reference::{Follows, Law, Motion, Reference};

/// A level pendulum without weight, of inertia 0.05 kg m² about its joint.
fn free(friction: f64, speed: f64) -> Experiment<1> {
    let segment = Segment {
        length: 0.3,
        mass: 1.0,
        com: [0.2, 0.0],
        inertia: 0.01,
    };
    let chain = Chain::new([segment], [0.0; 2], [0.0; 2]).expect("an arm");
    let setup = Setup::new(&chain, Contact::new([0.0; 2], [0.0; 2]));
    let mut experiment = Experiment::new(setup, Drive::Torque(None), 0.5);
    experiment.start = Start::Given {
        q: [0.2].into(),
        qd: [speed].into(),
    };
    experiment.effects = vec![Effect::new(Kind::Coulomb, 0).with(&[friction, 0.0])];
    experiment
}

/// It slows down by 2 rad/s², stands still after 0.15 s between two steps, and stays there.
#[test]
fn a_joint_that_slides_out_stops_where_it_must() {
    for (integrator, within) in [
        (Integrator::Rk4, 1e-12),
        (Integrator::SemiImplicitEuler, 1e-4),
        (Integrator::Imex, 1e-5),
    ] {
        let mut experiment = free(0.1, 0.30003);
        experiment.integrator = integrator;
        let r = run(&experiment);
        let stop = 0.2 + 0.30003 * 0.30003 / 4.0;
        let end = r.len() - 1;
        assert!(
            (r.q[end] - stop).abs() < within,
            "{integrator:?}: {}",
            r.q[end] - stop
        );
        assert_eq!(r.qd[end], 0.0);
        assert_eq!(r.q[end], r.q[end - 100]);
        let error = most(r.energy_error());
        assert!(error < within, "{integrator:?}: {error:e} J");
        assert_eq!(r.resisting[0], 0.1);
        assert_eq!(r.resisting[end], 0.0);
    }
}

/// A torque of three quarters of what friction holds does not move the joint, not even slowly; a little more than it does.
#[test]
fn a_joint_sticks_until_it_is_pulled_harder_than_friction_holds() {
    let mut experiment = free(0.1, 0.0);
    let ramp = Series::new(
        "torque",
        &[0.0, 0.5],
        &[[0.0], [0.2]],
        Interpolation::Linear,
    );
    experiment.drive = Drive::Torque(Some(ramp.expect("a series")));
    let r = run(&experiment);
    for (i, time) in r.time.iter().enumerate() {
        let torque = 0.4 * time;
        if torque < 0.1 {
            assert_eq!((r.q[i], r.qd[i]), (0.2, 0.0));
            assert!((r.resisting[i] - torque).abs() < 1e-12);
        } else {
            // ∫∫ (0.4 t − 0.1)/0.05 from where it breaks away.
            let since = time - 0.25;
            let way = 0.4 / 0.05 * since * since * since / 6.0;
            assert!(
                (r.q[i] - 0.2 - way).abs() < 1e-10,
                "{time}: {}",
                r.q[i] - 0.2 - way
            );
        }
    }
}

/// The wrist of an arm that the robot holds at its hand is free: friction alone carries it, at the angle that is given.
#[test]
fn a_sticking_wrist_starts_and_stays_where_it_is() {
    let mut experiment = sample_experiments::human_experiment(2.0, [0.0; 3]).expect("a sample");
    experiment.effects = vec![Effect::new(Kind::Coulomb, 2).with(&[2.0, 0.0])];
    let Start::Equilibrium { near } = experiment.start else {
        unreachable!("an equilibrium")
    };
    let r = run(&experiment);
    assert_eq!(r.q[2], near[2]);
    let error = most(r.energy_error());
    assert!(error < 1e-8, "{error:e} J");
    let half = Experiment {
        dt: 0.5 * experiment.dt,
        output_interval: Some(experiment.dt),
        ..experiment.clone()
    };
    let apart = largest(&r.q, &run(&half).q);
    assert!(apart < 1e-7, "{apart:e} rad");
}

/// Friction that increases the force on which it depends may have no unique solution, and is refused with its loop gain.
#[test]
fn friction_that_jams_is_refused() {
    let mut experiment =
        sample_experiments::mechanical_experiment(1.0, [0.0; 2]).expect("a sample");
    for joint in 0..2 {
        let friction = Effect::new(Kind::LoadFriction, joint).with(&[1.0, 0.0]);
        experiment.effects.push(friction);
    }
    match simulate(&experiment) {
        Err(error @ SimulationError::AmbiguousFriction { .. }) => {
            let said = error.to_string();
            assert!(said.contains("no unique solution"), "{said}");
        }
        Err(other) => panic!("{other}"),
        Ok(r) => assert!(most(r.energy_error()) < 1e-6),
    }
}

/// An arm of masses, springs and contact 2⁻⁴⁰ times as large moves in the same way, from the start on, to the last bit.
#[test]
fn an_arm_that_weighs_next_to_nothing_starts_where_it_must() {
    let heavy = sample_experiments::human_experiment(0.5, [-1.1, 0.9, 0.05]).expect("a sample");
    let mut light = heavy.clone();
    let scale = libm::exp2(-40.0);
    for segment in &mut light.setup.segments {
        segment.mass *= scale;
        segment.inertia *= scale;
    }
    light.setup.contact.stiffness = light.setup.contact.stiffness.map(|k| k * scale);
    for effect in &mut light.effects {
        effect.parameters[0] *= scale;
    }
    let (heavy, light) = (run(&heavy), run(&light));
    let apart = largest(&heavy.q, &light.q);
    assert!(apart < 1e-9, "{apart:e} rad");
}

/// Of the two hundred, the first of each length.
#[test]
fn random_arms_agree_with_the_reference() {
    for judged in [judged::<2>(0), judged::<3>(1000), judged::<2>(1)] {
        println!("{judged:?}");
        let (angle, force) = judged.2.expect("both ran");
        assert!(angle < 0.01 && force < 0.01, "{judged:?}");
    }
}

/// Numbers between 0 and 1, the same everywhere.
struct Dice(u64);

impl Dice {
    fn roll(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.roll()
    }
    /// Evenly in the logarithm.
    fn spread(&mut self, low: f64, high: f64) -> f64 {
        low * libm::pow(high / low, self.roll())
    }
}

/// A random arm with friction up to the bounds of the catalogue, led by a handle, and the reference of the same.
pub fn random<const N: usize>(seed: u64) -> (Experiment<N>, Reference<N>) {
    let mut dice = Dice(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0x1234_5678);
    for _ in 0..8 {
        dice.roll();
    }
    let segments: [Segment<f64>; N] = core::array::from_fn(|i| {
        let shrink = [1.0, 0.8, 0.35][i.min(2)];
        let length = shrink * dice.between(0.25, 0.36);
        let mass = shrink * dice.between(1.0, 2.5);
        Segment {
            length,
            mass,
            com: [length * dice.between(0.4, 0.6), 0.0],
            inertia: mass * length * length * dice.between(0.06, 0.12),
        }
    });
    let gravity = [0.0, -9.81];
    let chain = Chain::new(segments, [0.0; 2], gravity).expect("an arm");
    let contact = Contact::new([10_000.0; 2], [dice.between(10.0, 50.0); 2]);
    let mut experiment: Experiment<N> = {
        let from: [f64; N] =
            core::array::from_fn(|i| [-60.0, 60.0, 5.0][i.min(2)] + dice.between(-15.0, 15.0));
        let to: [f64; N] = core::array::from_fn(|i| from[i] + dice.between(-25.0, 25.0));
        let duration = dice.between(0.8, 1.6);
        sample_experiments::led(
            chain,
            Shape::Trapezoid,
            (from, to),
            (duration * 100.0).round() / 100.0,
            [0.0; N],
        )
        .expect("a movement")
    };
    experiment.setup = Setup::new(&chain, contact);
    experiment.output_interval = Some(0.01);
    experiment.effects.clear();
    let near = match &experiment.start {
        Start::Given { q, .. } | Start::Equilibrium { near: q } => *q,
    };
    let (mut viscosity, mut elasticity) = ([0.0; N], [[0.0; 2]; N]);
    let mut friction = Vec::new();
    for j in 0..N {
        viscosity[j] = dice.between(0.02, 0.3);
        elasticity[j] = [dice.between(0.5, 4.0), near[j] + dice.between(-0.3, 0.3)];
        experiment.effects.extend([
            Effect::new(Kind::Viscous, j).with(&[viscosity[j]]),
            Effect::new(Kind::Elastic, j).with(&elasticity[j]),
        ]);
        let (kind, values, law) = match (dice.roll() * 5.0) as usize {
            0 => continue,
            1 => {
                let torque = dice.spread(0.02, 100.0);
                (Kind::Coulomb, vec![torque, 0.0], Law::Coulomb(torque))
            }
            2 => {
                let (torque, speed) = (dice.spread(0.02, 100.0), dice.spread(0.01, 1.0));
                (
                    Kind::Stribeck,
                    vec![torque, speed, 0.0],
                    Law::Stribeck(torque, speed),
                )
            }
            3 => {
                let radius = dice.spread(1e-3, 1.0);
                (Kind::LoadFriction, vec![radius, 0.0], Law::Load(radius))
            }
            _ => {
                let v = [
                    dice.spread(0.02, 100.0),
                    dice.between(0.0, 2.0),
                    near[j],
                    dice.spread(0.03, 0.5),
                    dice.spread(0.5, 10.0),
                ];
                (
                    Kind::Thixotropy,
                    [&v[..], &[0.0]].concat(),
                    Law::Thixotropy(v),
                )
            }
        };
        experiment.effects.push(Effect::new(kind, j).with(&values));
        friction.push((j, law));
    }
    let Drive::Handle { path, .. } = &experiment.drive else {
        unreachable!("an arm that is led")
    };
    let reference = Reference {
        segments,
        gravity,
        contact,
        viscosity,
        elasticity,
        friction,
        path: path.clone(),
    };
    (experiment, reference)
}

/// Largest differences of angles \[°\] and of forces as a share of the largest.
fn differences<const N: usize>(r: &Recording<N>, truth: &[(Motion<N>, Follows<N>)]) -> (f64, f64) {
    let mut angle: f64 = 0.0;
    let (mut force, mut size): (f64, f64) = (0.0, 0.0);
    for (i, (motion, follows)) in truth.iter().enumerate().take(r.len()) {
        for j in 0..N {
            angle = angle.max((r.q[N * i + j] - motion.q[j]).abs().to_degrees());
        }
        let [y, z] = follows.force;
        size = size.max(libm::hypot(y, z));
        force = force.max(libm::hypot(
            r.force_on_arm[2 * i] - y,
            r.force_on_arm[2 * i + 1] - z,
        ));
    }
    (angle, force / size)
}

/// `cargo test --release -p arm-sim --test suite -- --ignored --nocapture what_sticking_costs`.
#[test]
#[ignore = "a measurement: the times of docs/performance.md"]
fn what_sticking_costs() {
    for (kind, values) in [
        (Kind::Coulomb, vec![0.5]),
        (Kind::Stribeck, vec![0.5, 0.06]),
        (Kind::LoadFriction, vec![0.01]),
        (Kind::Thixotropy, vec![0.5, 0.0, 0.0, 0.1, 3.0]),
    ] {
        let [smooth, solved] = [0.01, 0.0].map(|smoothing| {
            let mut experiment =
                sample_experiments::mechanical_experiment(2.0, [0.0; 2]).expect("a sample");
            let values = [&values[..], &[smoothing]].concat();
            experiment.effects = (0..2)
                .map(|joint| Effect::new(kind, joint).with(&values))
                .collect();
            let runs = (0..20).map(|_| {
                let begun = std::time::Instant::now();
                run(&experiment);
                begun.elapsed().as_secs_f64()
            });
            runs.fold(f64::INFINITY, f64::min)
        });
        let [smooth_ms, solved_ms] = [smooth, solved].map(|s| 1e3 * s);
        let ratio = solved / smooth;
        println!("{kind:?}: smooth {smooth_ms:.2} ms, set-valued {solved_ms:.2} ms, {ratio:.2}");
    }
}

/// `cargo test --release -p arm-sim --test suite -- --ignored --nocapture two_hundred`.
#[test]
#[ignore = "some minutes; the table of docs/effects.md"]
fn two_hundred_random_arms_agree_with_the_reference() {
    for seed in 0..100 {
        println!("{:?}", judged::<2>(seed));
        println!("{:?}", judged::<3>(1000 + seed));
    }
}

fn judged<const N: usize>(seed: u64) -> (u64, String, Option<(f64, f64)>, f64) {
    let (experiment, reference) = random::<N>(seed);
    let what = format!("{:?}", reference.friction);
    match simulate(&experiment) {
        Err(error) => (seed, format!("{error} {what}"), None, 0.0),
        Ok(r) => {
            let start = (core::array::from_fn(|j| r.q[j]), [0.0; N]);
            let share = most(r.energy_error());
            match reference.run(start, 0.01, r.len() - 1) {
                Some(truth) => (seed, what, Some(differences(&r, &truth)), share),
                None => (seed, format!("no reference {what}"), None, share),
            }
        }
    }
}

/// Its weight pulls with 9.81 · 0.2 · cos q N m, level with more than 1.2 N m of friction hold: it slides down to where these hold it, from
/// either side, and one that they can hold stays.
#[test]
fn a_start_at_rest_beyond_what_friction_holds_is_where_it_first_holds() {
    let rest = |from: f64| {
        let mut experiment = free(1.2, 0.0);
        experiment.setup.gravity = [0.0, -9.81];
        experiment.start = Start::Equilibrium {
            near: [from].into(),
        };
        let r = run(&experiment);
        let end = r.len() - 1;
        assert!((r.q[end] - r.q[0]).abs() < 1e-9, "it stays there");
        r.q[0]
    };
    let edge = libm::acos(1.2 / (9.81 * 0.2));
    let down = -core::f64::consts::FRAC_PI_2;
    assert!((rest(0.2) + edge).abs() < 1e-9);
    assert!((rest(2.0 * down - 0.2) - (2.0 * down + edge)).abs() < 1e-9);
    assert_eq!(rest(down + 0.3), down + 0.3);
}
