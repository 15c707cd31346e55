//! Faults put into the sensors of an estimator with its default settings: its reports, and the error of the torque.
//!
//! `cargo test -p arm-core --test suite faults -- --nocapture` prints the table of docs/firmware.md.

use std::collections::BTreeMap;

use arm_core::effect::{Effect, Kind, Motion};
use arm_core::estimator::{Estimator, Sample, SampleStatus, Settings};
use arm_core::{Equation, Joints, Measured, sample_arms};

use crate::common::Random;

type Online = Estimator<f64, 3, 18, 9>;
type Arm = Equation<f64, 3, 18, 9>;

/// Periods of 1 ms before the fault, and with it.
const CLEAN: i32 = 6_000;
const FAULTY: i32 = 2_500;

fn equation() -> Arm {
    let effects = [
        Effect::new(Kind::Viscous, 0).with(&[0.25]),
        Effect::new(Kind::Viscous, 1).with(&[0.2]),
        Effect::new(Kind::Viscous, 2).with(&[0.05]),
        Effect::new(Kind::Coulomb, 0).with(&[0.14]),
        Effect::new(Kind::Coulomb, 1).with(&[0.16]),
        Effect::new(Kind::Coulomb, 2).with(&[0.03]),
        Effect::new(Kind::Elastic, 0).with(&[1.2, -0.8]),
        Effect::new(Kind::Elastic, 1).with(&[0.8, 1.1]),
        Effect::new(Kind::Elastic, 2).with(&[0.5, 0.05]),
    ];
    Equation::new(sample_arms::human_arm(), effects).expect("an arm")
}

fn truth(arm: &Arm) -> [f64; 18] {
    arm.priors(0.1).map(|p| p.mean)
}

/// A rich movement, and the torques of the arm with 0.02 N m of noise.
fn sample(arm: &Arm, k: i32, random: &mut Random) -> Sample<f64, 3> {
    let t = f64::from(k) * 1e-3;
    let centre = [-0.8, 0.9, 0.1];
    let wave = |j: usize| {
        let (w, phase) = (1.3 + 0.7 * j as f64, 0.9 * j as f64);
        let (s, c) = (libm::sin(w * t + phase), libm::cos(w * t + phase));
        [centre[j] + 0.6 * s, 0.6 * w * c, -0.6 * w * w * s]
    };
    let of = |i: usize| Joints::<f64, 3>::from_fn(|j, _| wave(j)[i]);
    let mut motion = Motion::new(t, of(0), of(1));
    motion.qdd = of(2);
    let nothing = Measured {
        torque: Joints::zeros(),
        force_on_arm: [0.0; 2],
        moment_on_arm: 0.0,
    };
    let (rows, _) = arm.needed(&motion, &[[0.0; 3]; 9], &nothing);
    let noise = Joints::from_fn(|_, _| random.uniform(-0.035, 0.035));
    Sample {
        q: motion.q,
        lead: None,
        measured: Measured {
            torque: rows.torque(&truth(arm)) + noise,
            ..nothing
        },
    }
}

/// An estimator that has learned for six seconds, from an arm that was taken 8 % too heavy and without any effect.
fn learned(arm: &Arm) -> Online {
    let mut priors = arm.priors(0.1);
    for (i, prior) in priors.iter_mut().enumerate().take(arm.used()) {
        prior.mean = if i < 6 { 1.08 * prior.mean } else { 0.0 };
    }
    let settings = Settings::new(arm.chain(), 1e-3);
    let mut online = Estimator::new(*arm, priors, &settings).expect("settings in range");
    let mut random = Random(31);
    for k in 0..CLEAN {
        online.update(Some(&sample(arm, k, &mut random)));
    }
    online
}

/// What a fault makes of the sample of a period; `None` where it is lost.
type Fault<'a> = Box<dyn Fn(i32, &mut Random) -> Option<Sample<f64, 3>> + 'a>;

fn changed<'a>(
    arm: &'a Arm,
    change: impl Fn(&mut Sample<f64, 3>, i32, &mut Random) + 'a,
) -> Fault<'a> {
    Box::new(move |k, random| {
        let mut s = sample(arm, k, random);
        change(&mut s, k, random);
        Some(s)
    })
}

fn flipped(value: f64, bit: u32) -> f64 {
    f64::from_bits(value.to_bits() ^ (1 << bit))
}

/// Every fault of one joint, by family.
fn faults(arm: &Arm, j: usize) -> Vec<(&'static str, Fault<'_>)> {
    const TURN: f64 = core::f64::consts::TAU;
    let torque = move |s: &Sample<f64, 3>| s.measured.torque[j];
    let mut all: Vec<(&'static str, Fault)> = Vec::new();
    for bias in [0.5, -0.5] {
        all.push((
            "torque sensor biased by 0.5 N m",
            changed(arm, move |s, _, _| s.measured.torque[j] += bias),
        ));
        all.push((
            "angle a turn off",
            changed(arm, move |s, _, _| s.q[j] += 2.0 * bias * TURN),
        ));
        all.push((
            "angle offset by 0.1 rad",
            changed(arm, move |s, _, _| s.q[j] += 0.2 * bias),
        ));
    }
    all.push((
        "torque with the wrong sign",
        changed(arm, move |s, _, _| s.measured.torque[j] = -torque(s)),
    ));
    all.push((
        "angle with the wrong sign",
        changed(arm, move |s, _, _| s.q[j] = -s.q[j]),
    ));
    all.push((
        "angle in degrees",
        changed(arm, move |s, _, _| s.q[j] = s.q[j].to_degrees()),
    ));
    for factor in [1000.0, 0.001, 0.1] {
        all.push((
            "torque in another unit",
            changed(arm, move |s, _, _| {
                s.measured.torque[j] = factor * torque(s)
            }),
        ));
    }
    let held = sample(arm, CLEAN, &mut Random(5));
    all.push((
        "stuck torque sensor",
        changed(arm, move |s, _, _| {
            s.measured.torque[j] = held.measured.torque[j]
        }),
    ));
    all.push((
        "stuck angle sensor",
        changed(arm, move |s, _, _| s.q[j] = held.q[j]),
    ));
    for late in [20, 50, 200] {
        all.push((
            "torque late by 20 to 200 ms",
            changed(arm, move |s, k, random| {
                s.measured.torque[j] = sample(arm, k - late, random).measured.torque[j];
            }),
        ));
    }
    for lost in [0.5, 0.9, 0.99] {
        all.push((
            "samples lost, half to 99 %",
            Box::new(move |k, random| {
                let keep = random.uniform(0.0, 1.0) > lost;
                Some(sample(arm, k, random)).filter(|_| keep)
            }),
        ));
    }
    for jump in [50, 500, 3000] {
        all.push((
            "time jumps by 50 ms to 3 s",
            Box::new(move |k, random| Some(sample(arm, k + jump * ((k - CLEAN) / 400), random))),
        ));
    }
    all.push((
        "spikes of 20 N m",
        changed(arm, move |s, _, random| {
            if random.uniform(0.0, 1.0) > 0.98 {
                s.measured.torque[j] += 20.0;
            }
        }),
    ));
    for not in [f64::NAN, f64::INFINITY] {
        all.push((
            "NaN and infinity",
            changed(arm, move |s, k, _| {
                if k % 7 == 0 {
                    s.measured.torque[j] = not;
                    s.q[j] = not;
                }
            }),
        ));
    }
    for bit in [
        20, 30, 36, 40, 44, 46, 48, 49, 50, 51, 52, 53, 54, 57, 60, 61, 62, 63,
    ] {
        all.push((
            "a bit of a torque flips",
            changed(arm, move |s, k, _| {
                if k % 3 == 0 {
                    s.measured.torque[j] = flipped(torque(s), bit);
                }
            }),
        ));
        all.push((
            "a bit of an angle flips",
            changed(arm, move |s, k, _| {
                if k % 3 == 0 {
                    s.q[j] = flipped(s.q[j], bit);
                }
            }),
        ));
    }
    for gain in [0.8, 1.2] {
        all.push((
            "torque gain 20 % off",
            changed(arm, move |s, _, _| s.measured.torque[j] = gain * torque(s)),
        ));
    }
    for noise in [1.0, 5.0] {
        all.push((
            "noise of 1 to 5 N m",
            changed(arm, move |s, _, random| {
                s.measured.torque[j] += random.uniform(-noise, noise);
            }),
        ));
    }
    for load in [5.0, 40.0] {
        all.push((
            "unannounced load, 0.5 to 4 kg",
            changed(arm, move |s, _, _| {
                // A weight at the hand, which nothing measures but the joints.
                let reach: f64 = libm::cos(s.q[0]) * 0.3;
                s.measured.torque[j] += load * reach;
            }),
        ));
    }
    all
}

/// What came of the scenarios of one family.
#[derive(Default)]
struct Family {
    scenarios: u32,
    /// Largest error of a torque that was given [N m], and as a share of the stated bound.
    error: f64,
    share: f64,
    /// Samples refused, torques withheld, of all.
    refused: u32,
    withheld: u32,
    samples: u32,
    torques: u32,
}

#[test]
fn two_hundred_faults_leave_the_torque_within_its_stated_bound() {
    let arm = equation();
    let start = learned(&arm);
    let settings = Settings::new(arm.chain(), 1e-3);
    let means = start.priors().map(|p| p.mean);
    let mut families: BTreeMap<&str, Family> = BTreeMap::new();
    for joint in 0..3 {
        for (number, (name, fault)) in faults(&arm, joint).iter().enumerate() {
            let family = families.entry(name).or_default();
            let (mut online, mut random) = (start, Random(100 + number as u64));
            family.scenarios += 1;
            for k in CLEAN..CLEAN + FAULTY {
                let status = online.update(fault(k, &mut random).as_ref());
                family.samples += 1;
                family.refused += u32::from(!matches!(
                    status,
                    SampleStatus::Taken | SampleStatus::Resting
                ));
                if k % 50 != 0 {
                    continue;
                }
                // The controller asks at the pose where the arm is.
                let q = sample(&arm, k, &mut Random(1)).q;
                let still = Motion::new(0.0, q, Joints::zeros());
                let carry = online.carry(&still);
                family.torques += 1;
                if !carry.within {
                    family.withheld += 1;
                    continue;
                }
                let rows = arm.carrying(&still, &[[0.0; 3]; 9]);
                let (needed, expected) = (rows.torque(&truth(&arm)), rows.torque(&means));
                for j in 0..3 {
                    let error = (carry.torque[j] - needed[j]).abs();
                    let bound = settings.envelope[j] + (expected[j] - needed[j]).abs();
                    assert!(
                        error <= bound + 1e-9,
                        "{name}, joint {joint}, {k}: {error} beyond {bound}"
                    );
                    family.error = family.error.max(error);
                    family.share = family.share.max(error / bound);
                }
            }
        }
    }
    let scenarios: u32 = families.values().map(|f| f.scenarios).sum();
    println!(
        "| fault | scenarios | samples refused | torques withheld | largest error of a torque | of the bound |"
    );
    println!("| --- | --- | --- | --- | --- | --- |");
    for (name, f) in &families {
        println!(
            "| {name} | {} | {:.0} % | {:.0} % | {:.2} N m | {:.0} % |",
            f.scenarios,
            100.0 * f64::from(f.refused) / f64::from(f.samples),
            100.0 * f64::from(f.withheld) / f64::from(f.torques),
            f.error,
            100.0 * f.share
        );
    }
    assert!(scenarios >= 200, "{scenarios}");
    // What a sensor cannot have never gets in.
    for name in ["angle a turn off", "angle in degrees"] {
        assert!(
            families[name].error < 0.3,
            "{name}: {}",
            families[name].error
        );
    }
}
