//! The online estimator against the batch method on the same movement.

use std::path::PathBuf;

use arm_core::effect::{Effect, Kind};
use arm_core::estimator::{Decision, Estimator, Sample, Settings};
use arm_core::{
    Chain, Contact, Elbow, Equation, Joints, Limits, Measured, Real, Robot, Segment, Setup, Shape,
    sample_arms,
};
use arm_ident::inference::estimate::Identified;
use arm_ident::inference::joint_method::{Options, identify};
use arm_ident::regression::trial::{Model, Trial};

use super::noise::Noise;

use arm_sim::{
    Coupling, Drive, Experiment, HandlePath, Movement, SensorChannel, Sensors, Start, simulate,
};

/// Stiffness of the contact \[N/m\].
const STIFFNESS: f64 = 1e4;
/// Cutoff of the estimator's low-pass \[Hz\]; the virtual arm moves at less than 1 Hz.
const CUTOFF: f64 = 10.0;
/// Seeds of the sensors' noise.
const SEEDS: u64 = 4;

type Online<T> = Estimator<T, 2, 8, 4>;

fn friction() -> [Effect<f64>; 4] {
    [
        Effect::new(Kind::Coulomb, 0),
        Effect::new(Kind::Coulomb, 1),
        Effect::new(Kind::Viscous, 0),
        Effect::new(Kind::Viscous, 1),
    ]
}

fn cast<T: Real>(effects: [Effect<f64>; 4]) -> [Effect<T>; 4] {
    effects.map(|e| Effect::new(e.kind, e.index).with(&e.parameters.map(T::of)))
}

fn estimator<T: Real>(model: &Model<2>, settings: &Settings<T, 2>) -> Online<T> {
    let effects = model.fitted.clone().try_into().expect("four effects");
    let equation = Equation::new(model.chain.cast(), cast(effects)).expect("an arm");
    let priors = equation.priors(T::of(model.segment_uncertainty));
    Estimator::new(equation, priors, settings).expect("settings in range")
}

fn samples<T: Real>(trial: &Trial<2>, lead: &Option<Vec<Joints<f64, 2>>>) -> Vec<Sample<T, 2>> {
    let cast = |q: &Joints<f64, 2>| Joints::<T, 2>::from_fn(|j, _| T::of(q[j]));
    (0..trial.len())
        .map(|i| Sample {
            q: cast(&trial.q[i]),
            lead: lead.as_ref().map(|l| cast(&l[i])),
            measured: Measured {
                torque: trial
                    .torque
                    .as_ref()
                    .map_or(Joints::repeat(T::ZERO), |t| cast(&t[i])),
                force_on_arm: trial
                    .force_on_arm
                    .as_ref()
                    .map_or([T::ZERO; 2], |f| f[i].map(T::of)),
                moment_on_arm: T::ZERO,
            },
        })
        .collect()
}

/// A batch estimate in the order of the estimator's unknowns: value and standard deviation.
fn batch(found: &Identified<2>) -> Vec<(String, f64, f64)> {
    let base = found.combinations.iter();
    let effects = found
        .parameters
        .iter()
        .filter(|e| ["coulomb", "viscous"].contains(&e.kind.as_str()));
    base.chain(effects)
        .map(|e| (e.name.clone(), e.value, e.std))
        .collect()
}

/// The mechanical arm of the thesis with its brakes, led by a robot for 12 s and read by sensors at 1 kHz.
fn virtual_arm(seed: u64) -> (Model<2>, Trial<2>, Option<Vec<Joints<f64, 2>>>) {
    let truth = sample_arms::mechanical_arm();
    let waypoints: Vec<Joints<f64, 2>> = [
        [-60, 50],
        [-20, 50],
        [-20, 100],
        [-70, 70],
        [-40, 30],
        [-60, 90],
        [-30, 50],
        [-60, 50],
    ]
    .map(|q| Joints::from(q.map(|a| f64::from(a).to_radians())))
    .to_vec();
    let limits = [Limits {
        speed: 0.6,
        acceleration: 4.0,
    }; 2];
    let movement = Movement::within(Shape::Smooth, &waypoints, &limits, 0.1).expect("a movement");
    let contact = Contact::new([STIFFNESS; 2], [25.0; 2]);
    let robot = Robot::new([0.45, 0.45], [1.0, -0.1], Elbow::Up).expect("a robot");
    let drive = Drive::Handle {
        path: HandlePath::of_arm(truth, movement),
        coupling: Coupling::Compliant,
    };
    let mut experiment = Experiment::new(Setup::new(&truth, contact), drive, 12.0);
    experiment.effects = vec![
        Effect::new(Kind::Coulomb, 0).with(&[0.139]),
        Effect::new(Kind::Coulomb, 1).with(&[0.161]),
        Effect::new(Kind::Viscous, 0).with(&[0.2]),
        Effect::new(Kind::Viscous, 1).with(&[0.1]),
    ];
    experiment.robot = Some(robot);
    experiment.start = Start::Equilibrium { near: waypoints[0] };
    experiment.dt = 0.25e-3;
    experiment.output_interval = Some(1e-3);
    let recording = simulate(&experiment).expect("a run");
    let mut sensors = Sensors::ideal();
    sensors.rate = 1000.0;
    sensors.seed = seed;
    sensors.angle = [SensorChannel::white(0.1_f64.to_radians()); 2];
    sensors.force = [SensorChannel {
        range: 110.0,
        bits: Some(12),
        ..SensorChannel::white(0.2)
    }; 2];
    sensors.robot = [SensorChannel {
        range: core::f64::consts::TAU,
        bits: Some(20),
        ..SensorChannel::IDEAL
    }; 2];
    let read = sensors.read(&experiment, &recording).expect("readings");
    let pairs = |v: &[f64]| -> Vec<[f64; 2]> { v.chunks_exact(2).map(|c| [c[0], c[1]]).collect() };
    let handle: Vec<[f64; 2]> = pairs(&read.robot_q)
        .iter()
        .map(|&q| robot.handle(&q.into()))
        .collect();
    // A two-link arm follows the handle as a robot of its own lengths would.
    let follows = Robot::new([0.376, 0.239], [0.0, 0.0], Elbow::Down).expect("an arm");
    let force = pairs(&read.force_on_arm);
    // The spring of the contact is known: the tip stands where the handle is, less what the force stretches it by.
    let lead = handle
        .iter()
        .zip(&force)
        .map(|(h, f)| {
            let tip = [0, 1].map(|axis| h[axis] - f[axis] / STIFFNESS);
            follows.angles(tip).expect("within reach")
        })
        .collect();
    let trial = Trial {
        force_on_arm: Some(force),
        handle: Some(handle),
        ..Trial::new(
            1000.0,
            pairs(&read.q).into_iter().map(Joints::from).collect(),
        )
    };
    let heavy = truth.segments().map(|s| Segment {
        mass: 1.1 * s.mass,
        inertia: 1.1 * s.inertia,
        ..s
    });
    let model = Model {
        chain: Chain::new(heavy, [0.0; 2], [0.0, -9.81]).expect("an arm"),
        segment_uncertainty: 0.1,
        fitted: friction().to_vec(),
        held: Vec::new(),
        contact,
    };
    (model, trial, Some(lead))
}

/// Settings of the estimator for that rig: 0.02 N m is what is left of a window once the arm is known.
fn settings<T: Real>(chain: &Chain<f64, 2>, period: f64) -> Settings<T, 2> {
    let mut settings = Settings::new(&chain.cast(), T::of(period));
    settings.noise = [T::of(0.02); 2];
    settings.cutoff = T::of(CUTOFF);
    settings
}

fn learned<T: Real>(
    model: &Model<2>,
    settings: &Settings<T, 2>,
    stream: &[Option<Sample<T, 2>>],
) -> Online<T> {
    let mut online = estimator(model, settings);
    for (i, sample) in stream.iter().enumerate() {
        online.update(sample.as_ref());
        for (e, prior) in online.estimates().iter().zip(online.priors()) {
            assert!(
                e.value >= prior.min && e.value <= prior.max && e.sd > T::ZERO && e.sd <= prior.sd,
                "period {i}: {e:?} outside {prior:?}"
            );
        }
    }
    online
}

fn whole<T: Real>(
    trial: &Trial<2>,
    lead: &Option<Vec<Joints<f64, 2>>>,
) -> Vec<Option<Sample<T, 2>>> {
    samples(trial, lead).into_iter().map(Some).collect()
}

/// How far the online estimate is from the batch estimate, in standard deviations of the latter.
fn distances<T: Real>(found: &Identified<2>, online: &Online<T>) -> Vec<f64> {
    let all = batch(found);
    all.iter()
        .zip(online.estimates())
        .map(|((name, value, std), e)| {
            let off = (e.value.to_f64() - value) / std;
            println!("{name:28} batch {value:8.4} ± {std:.4}, online {e:?}: {off:+.2}");
            off
        })
        .collect()
}

#[test]
fn virtual_arm_comes_to_the_batch_estimate() {
    let mut squares = 0.0;
    for seed in 0..SEEDS {
        let (model, trial, lead) = virtual_arm(seed);
        let found =
            identify(&model, std::slice::from_ref(&trial), &Options::default()).expect("a fit");
        let online = learned(
            &model,
            &settings::<f64>(&model.chain, 1e-3),
            &whole(&trial, &lead),
        );
        let off = distances(&found, &online);
        if seed == 0 {
            assert!(off.iter().all(|o| o.abs() <= 1.0), "{off:.2?}");
            assert!(
                online
                    .estimates()
                    .iter()
                    .all(|e| e.decided_by == Decision::Data)
            );
            // Single precision comes to the same.
            let single = learned(
                &model,
                &settings::<f32>(&model.chain, 1e-3),
                &whole(&trial, &lead),
            );
            for (a, b) in single.estimates().iter().zip(online.estimates()) {
                assert!(
                    (f64::from(a.value) - b.value).abs() <= 0.05 * b.sd,
                    "{a:?} and {b:?}"
                );
            }
        }
        squares += off.iter().map(|o| o * o).sum::<f64>() / off.len() as f64;
    }
    let typical = libm::sqrt(squares / SEEDS as f64);
    println!("root mean square over {SEEDS} seeds: {typical:.2} standard deviations");
    assert!(typical <= 1.0, "{typical}");
}

/// Faults put into the movement of the virtual arm, one by one, and all at once.
#[test]
fn faults_of_the_data_do_no_harm() {
    let (model, trial, lead) = virtual_arm(0);
    let clean: Vec<Option<Sample<f64, 2>>> = whole(&trial, &lead);
    let mut settings = settings(&model.chain, 1e-3);
    settings.steepest = 5e3;
    settings.frozen_after = 0.02;
    settings.forgetting = 60.0;
    let reference = learned(&model, &settings, &clean);
    type Stream = Vec<Option<Sample<f64, 2>>>;
    let dropped = |mut s: Stream| {
        let mut noise = Noise::new(11);
        s.iter_mut().for_each(|x| {
            if noise.uniform() < -0.8 {
                *x = None
            }
        });
        s
    };
    let paused = |mut s: Stream| {
        s.splice(5000..5000, std::iter::repeat_n(None, 5000));
        s
    };
    let rested = |mut s: Stream| {
        let still = s[11_900];
        s.extend(std::iter::repeat_n(still, 30_000));
        s
    };
    let spiked = |mut s: Stream| {
        let mut noise = Noise::new(12);
        for x in s.iter_mut().flatten() {
            if noise.uniform() < -0.98 {
                x.measured.force_on_arm[0] += 50.0;
            }
            if noise.uniform() < -0.98 {
                x.q[1] -= 0.5;
            }
            if noise.uniform() < -0.98 {
                x.lead.as_mut().expect("a lead")[0] += 0.1;
            }
        }
        s
    };
    let not_numbers = |mut s: Stream| {
        let mut noise = Noise::new(13);
        for x in s.iter_mut().flatten() {
            if noise.uniform() < -0.96 {
                x.measured.force_on_arm[1] = f64::NAN;
            }
            if noise.uniform() < -0.96 {
                x.q[0] = f64::INFINITY;
            }
        }
        s
    };
    let frozen = |mut s: Stream| {
        let held = s[6000].expect("a sample");
        for x in s[6000..9000].iter_mut().flatten() {
            x.measured.force_on_arm = held.measured.force_on_arm;
        }
        s
    };
    type Spoil<'a> = &'a dyn Fn(Stream) -> Stream;
    let all: [(&str, Spoil, f64); 7] = [
        ("one sample in ten dropped", &dropped, 1.0),
        ("nothing for 5 s", &paused, 1.0),
        ("at rest for 30 s", &rested, 0.1),
        ("spikes", &spiked, 1.0),
        ("not numbers", &not_numbers, 1.0),
        ("force sensor frozen for 3 s", &frozen, 2.0),
        (
            "all of them",
            &|s| rested(paused(dropped(not_numbers(spiked(frozen(s)))))),
            3.0,
        ),
    ];
    for (name, spoil, allowed) in all {
        let online = learned(&model, &settings, &spoil(clean.clone()));
        for (a, b) in online.estimates().iter().zip(reference.estimates()) {
            let off = (a.value - b.value) / b.sd;
            println!(
                "{name}: {} ± {} instead of {} ± {}: {off:+.2}",
                a.value, a.sd, b.value, b.sd
            );
            assert!(off.abs() <= allowed, "{name}: {off}");
        }
    }
}

/// The first 12 s of the slow tracking of a two-link arm (see the README of the measured data), resampled to 300 Hz.
fn dfki() -> Option<(Model<2>, Trial<2>)> {
    let folder = std::env::var_os("ARMRS_DATA").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"),
        PathBuf::from,
    );
    let text = std::fs::read_to_string(folder.join("dfki_a0/trials/track_1.csv")).ok()?;
    let rows: Vec<Vec<f64>> = text
        .lines()
        .skip(1)
        .map(|l| l.split(',').map(|v| v.parse().expect("a number")).collect())
        .collect();
    let rate = 300.0;
    let mut at = 0;
    let even: Vec<Vec<f64>> = (0..3600)
        .map(|i| {
            let t = f64::from(i) / rate;
            while rows[at + 1][0] < t {
                at += 1;
            }
            let s = (t - rows[at][0]) / (rows[at + 1][0] - rows[at][0]);
            rows[at]
                .iter()
                .zip(&rows[at + 1])
                .map(|(a, b)| a + s * (b - a))
                .collect()
        })
        .collect();
    let pair = |c: usize| {
        even.iter()
            .map(|r| Joints::from([r[c], r[c + 1]]))
            .collect::<Vec<_>>()
    };
    let trial = Trial {
        torque: Some(pair(5)),
        ..Trial::new(rate, pair(1))
    };
    let segment = |length, mass, com, inertia| Segment {
        length,
        mass,
        com: [com, 0.0],
        inertia,
    };
    let segments = [
        segment(0.3, 0.559381, 0.3, 0.00312655),
        segment(0.2, 0.604346, 0.183777, 0.00351255),
    ];
    let model = Model {
        chain: Chain::new(segments, [0.0; 2], [0.0, -9.81]).expect("an arm"),
        segment_uncertainty: 0.1,
        fitted: friction().to_vec(),
        held: Vec::new(),
        contact: Contact::new([STIFFNESS; 2], [25.0; 2]),
    };
    Some((model, trial))
}

#[test]
fn measured_arm_comes_to_the_batch_estimate() {
    let Some((model, trial)) = dfki() else {
        assert!(
            std::env::var_os("CI").is_none(),
            "measured data are missing"
        );
        eprintln!("skipped: no measured data in ARMRS_DATA or ../shared/data");
        return;
    };
    let found = identify(&model, std::slice::from_ref(&trial), &Options::default()).expect("a fit");
    let mut settings = settings(&model.chain, 1.0 / 300.0);
    settings.cutoff = 15.0;
    let online = learned(&model, &settings, &whole(&trial, &None));
    let off = distances(&found, &online);
    assert!(off.iter().all(|o| o.abs() <= 1.0), "{off:.2?}");
}
