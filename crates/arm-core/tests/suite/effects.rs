//! Each effect by arithmetic in the head, and what each must mean physically.

use arm_core::effect::{Effect, Kind, Local, Motion, resisting_torque};
use arm_core::{
    Chain, Contact, Displaced, Joints, Load, Pose, Reading, Segment, Setup, Wave, forward_dynamics,
    gravity, inverse_dynamics, sample_arms,
};

use crate::common::Random;

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-14
}

fn of(name: &str, values: &[f64]) -> Effect<f64> {
    let kind = Kind::named(name).expect("a kind of the catalogue");
    let effect = Effect::new(kind, 0).with(values);
    if name != "biarticular" {
        effect.validate(1).expect("values within bounds");
    }
    effect
}

/// A joint at rest at angle zero.
const REST: Local<f64> = Local {
    time: 0.0,
    q: 0.0,
    qd: 0.0,
    qdd: 0.0,
    proximal_q: 0.0,
    joint_force: 0.0,
    activity: 0.0,
    memory: [0.0; 3],
};
const fn moving(qd: f64) -> Local<f64> {
    Local { qd, ..REST }
}
const fn at(q: f64) -> Local<f64> {
    Local { q, ..REST }
}
const fn when(time: f64) -> Local<f64> {
    Local { time, ..REST }
}

#[test]
fn torques_in_the_head() {
    let half_life = core::f64::consts::LN_2;
    let loaded = Local {
        joint_force: 100.0,
        ..moving(1.0)
    };
    let remembering = Local {
        q: 1.0,
        memory: [0.5, 0.0, 0.0],
        ..moving(1.0)
    };
    let crossed = Local {
        proximal_q: 2.0,
        ..at(1.0)
    };
    for (name, values, local, expected) in [
        ("viscous", &[2.0][..], moving(3.0), 6.0),
        ("viscous", &[2.0], at(3.0), 0.0),
        ("coulomb", &[0.5], moving(1.0), 0.5),
        ("coulomb", &[0.5], moving(-1.0), -0.5),
        ("coulomb", &[0.5], REST, 0.0),
        ("stribeck", &[2.0, 1.0], moving(half_life), 1.0),
        ("stribeck", &[2.0, 0.1], moving(-9.0), 0.0),
        ("load_friction", &[0.01], loaded, 1.0),
        ("load_friction", &[0.01], moving(1.0), 0.0),
        ("quadratic_drag", &[0.5], moving(-2.0), -2.0),
        ("elastic", &[2.0, 0.5], at(1.5), 2.0),
        ("elastic", &[2.0, 0.5], at(-0.5), -2.0),
        ("cubic_elastic", &[2.0, 1.0], at(3.0), 16.0),
        (
            "relaxation",
            &[3.0, 4.0],
            Local {
                memory: [2.0, 0.0, 0.0],
                ..REST
            },
            6.0,
        ),
        ("thixotropy", &[1.0, 2.0, 0.0, 0.5, 4.0], remembering, 1.5),
        ("constant_moment", &[1.5], REST, 1.5),
        ("end_range", &[3.0, 2.0, 50.0, 1.0, -1.0], at(1.0), 3.0),
        ("end_range", &[3.0, 2.0, 50.0, 1.0, -1.0], at(-1.0), -2.0),
        ("end_range", &[3.0, 2.0, 50.0, 1.0, -1.0], REST, 0.0),
        ("biarticular", &[2.0, 0.5, 1.0], crossed, 2.0),
        ("stretch_reflex", &[2.0, 0.5, 1.0], moving(1.5), 2.0),
        ("stretch_reflex", &[2.0, 0.5, 1.0], moving(-1.5), 0.0),
        ("stretch_reflex", &[2.0, 0.5, -1.0], moving(-1.5), -2.0),
        ("stretch_reflex", &[2.0, 0.5, -1.0], moving(1.5), 0.0),
        ("stretch_reflex", &[2.0, 0.5, 0.0], moving(1.5), 2.0),
        ("stretch_reflex", &[2.0, 0.5, 0.0], moving(-1.5), -2.0),
        ("stretch_reflex", &[2.0, 0.5, 0.0], moving(0.5), 0.0),
        ("tremor", &[2.0, 1.0, 0.0], when(0.25), -2.0),
        ("tremor", &[2.0, 1.0, 0.0], when(0.75), 2.0),
        ("voluntary", &[4.0, 1.0, 2.0], when(2.0), -4.0),
        ("voluntary", &[4.0, 1.0, 2.0], when(1.5), -4.0 * 27.0 / 64.0),
        ("voluntary", &[4.0, 1.0, 2.0], when(0.5), 0.0),
        ("voluntary", &[4.0, 1.0, 2.0], when(3.5), 0.0),
        ("motor_inertia", &[4.0], Local { qdd: 2.0, ..REST }, 0.0),
    ] {
        let torque = of(name, values).torque(&local);
        assert!(
            close(torque, expected),
            "{name} {values:?}: {torque} instead of {expected}"
        );
    }
}

#[test]
fn memory_in_the_head() {
    // 1 rad/s stretches, 2 rad of stretch fade over 4 s.
    let stretched = Local {
        memory: [2.0, 0.0, 0.0],
        ..moving(1.0)
    };
    assert_eq!(
        of("relaxation", &[3.0, 4.0]).memory_rate(&stretched),
        [0.5, 0.0, 0.0]
    );
    // Half broken: 0.5·|−1|/0.5 breaks, 0.5/4 builds.
    let half = Local {
        memory: [0.5, 0.0, 0.0],
        ..moving(-1.0)
    };
    let effect = of("thixotropy", &[1.0, 2.0, 0.0, 0.5, 4.0]);
    assert_eq!(effect.memory_rate(&half), [0.875, 0.0, 0.0]);
}

/// Torques over a motion, with the state advanced by small steps.
fn torques(effect: &Effect<f64>, duration: f64, motion: impl Fn(f64) -> [f64; 2]) -> Vec<f64> {
    let step = 1e-3;
    let mut memory = [0.0; 3];
    (0..(duration / step) as u32)
        .map(|i| {
            let [q, qd] = motion(f64::from(i) * step);
            let local = Local {
                q,
                qd,
                memory,
                ..REST
            };
            let rates = effect.memory_rate(&local);
            memory = core::array::from_fn(|k| memory[k] + step * rates[k]);
            effect.torque(&local)
        })
        .collect()
}

#[test]
fn relaxation_fades_at_rest() {
    // Stretched by 1 rad in 0.1 s, then held for two time constants of 1 s.
    let r = torques(&of("relaxation", &[2.0, 1.0]), 2.1, |t| {
        if t < 0.1 {
            [10.0 * t, 10.0]
        } else {
            [1.0, 0.0]
        }
    });
    let peak = r[100];
    assert!((1.8..2.0).contains(&peak), "{peak}");
    let left = r[2099] / peak;
    assert!((left - libm::exp(-2.0)).abs() < 2e-3, "{left}");
}

#[test]
fn thixotropy_breaks_down_in_motion_and_recovers_at_rest() {
    let effect = of("thixotropy", &[1.0, 0.0, 0.0, 0.1, 3.0]);
    let r = torques(&effect, 12.0, |t| {
        let speed = if (1.0..11.0).contains(&t) { 0.0 } else { 1.0 };
        [0.0, speed]
    });
    assert!(close(r[0], 1.0), "whole after a long rest");
    // Steady: (1−b)·1/0.1 = b/3, so 1−b = 1/31.
    assert!((r[999] - 1.0 / 31.0).abs() < 1e-3, "{}", r[999]);
    // 10 s of rest: the broken part fades by exp(−10/3).
    let recovered = 1.0 - 30.0 / 31.0 * libm::exp(-10.0 / 3.0);
    assert!(
        (r[11_001] - recovered).abs() < 0.02,
        "{} {recovered}",
        r[11_001]
    );
}

#[test]
fn friction_takes_energy_at_every_speed() {
    let mut random = Random(41);
    for name in [
        "viscous",
        "coulomb",
        "stribeck",
        "load_friction",
        "quadratic_drag",
        "stretch_reflex",
        "thixotropy",
    ] {
        let kind = Kind::named(name).expect("a kind");
        for _ in 0..1000 {
            let mut effect = random.effect(kind, 0);
            if name == "thixotropy" {
                effect.parameters[1] = 0.0;
            }
            let local = Local {
                joint_force: 10.0,
                ..moving(random.uniform(-3.0, 3.0))
            };
            assert!(effect.torque(&local) * local.qd >= 0.0, "{name}");
        }
    }
}

#[test]
fn springs_return_their_energy() {
    // Work over a closed loop in both angles is zero.
    let step = 1e-3;
    let tau = core::f64::consts::TAU;
    for name in [
        "elastic",
        "cubic_elastic",
        "end_range",
        "constant_moment",
        "biarticular",
    ] {
        let mut effect = Random(42).effect(Kind::named(name).expect("a kind"), 1);
        if name == "end_range" {
            effect = effect.with(&[1.0, 2.0, 2.0, 0.5, -0.5]);
        }
        let mut work = 0.0;
        let mut largest = 0.0_f64;
        for i in 0..1000 {
            let t = step * f64::from(i);
            let angle = |phase: f64| arm_core::Scalar::sin_cos(tau * t + phase);
            let ((s1, c1), (s2, c2)) = (angle(0.0), angle(1.0));
            let qd = Joints::<f64, 2>::new(tau * c1, tau * c2);
            let motion = Motion::new(t, Joints::<f64, 2>::new(s1, s2), qd);
            let r = resisting_torque(&[effect], &motion, &[]);
            work += step * r.dot(&qd);
            largest = largest.max(r.dot(&qd).abs());
        }
        assert!(work.abs() < 1e-10 * largest, "{name}: {work}");
    }
}

#[test]
fn a_positive_muscle_torque_lifts_the_arm() {
    let arm = sample_arms::mechanical_arm();
    let pose = Pose::new(&Joints::zeros());
    for effect in [
        of("voluntary", &[3.0, 0.0, 2.0]),
        of("tremor", &[3.0, 0.25, 0.0]),
    ] {
        let motion = Motion::<f64, 2>::new(1.0, Joints::zeros(), Joints::zeros());
        let r = resisting_torque(&[effect], &motion, &[]);
        assert!(close(r[0], -3.0));
        let load = Load {
            torque: gravity(&arm, &pose) - r,
            ..Load::none()
        };
        let qdd = forward_dynamics(&arm, &pose, &motion.qd, &load);
        assert!(qdd[0] > 1.0, "{qdd}");
    }
}

#[test]
fn rotor_inertia_is_counted_once() {
    let arm = sample_arms::mechanical_arm();
    let effect = Effect {
        index: 1,
        ..of("motor_inertia", &[0.5])
    };
    let mut rig = Setup::new(&arm, Contact::new([1.0; 2], [1.0; 2]));
    effect.alter(&mut rig);
    let with = rig.chain().expect("a possible arm");
    let (q, qd) = (
        Joints::<f64, 2>::new(0.3, 0.4),
        Joints::<f64, 2>::new(1.0, -1.0),
    );
    let mut motion = Motion::new(0.0, q, qd);
    motion.qdd = Joints::<f64, 2>::new(7.0, 2.0);
    let pose = Pose::new(&q);
    let needed = |chain: &Chain<f64, 2>| inverse_dynamics(chain, &pose, &qd, &motion.qdd);
    let gained = needed(&with) - needed(&arm) + resisting_torque(&[effect], &motion, &[]);
    // 0.5 kg m² at 2 rad/s²: 1 N m in its joint, nothing in the other.
    assert!(close(gained[0], 0.0) && close(gained[1], 1.0), "{gained}");
}

/// Three segments of 1 m and 1 kg with the mass at half length, and no inertia of their own.
fn rig() -> Setup<f64, 3> {
    let segment = Segment {
        length: 1.0,
        mass: 1.0,
        com: [0.5, 0.0],
        inertia: 0.0,
    };
    let chain = Chain::new([segment; 3], [0.0; 2], [0.0, -10.0]).expect("valid");
    Setup::new(&chain, Contact::new([10_000.0, 20_000.0], [25.0, 50.0]))
}

fn altered(name: &str, index: usize, values: &[f64]) -> Setup<f64, 3> {
    let mut rig = rig();
    Effect {
        index,
        ..of(name, values)
    }
    .alter(&mut rig);
    rig
}

#[test]
fn segments_in_the_head() {
    let base = rig().chain().expect("valid");
    // 1 kg in the hand adds a_j to every X and a_j² to every J.
    let loaded = altered("added_mass", 0, &[1.0]).chain().expect("valid");
    for j in 0..3 {
        assert!(close(
            loaded.first_moments()[j],
            base.first_moments()[j] + 1.0
        ));
        assert!(close(
            loaded.second_moments()[j],
            base.second_moments()[j] + 1.0
        ));
    }
    // The hand carries 2 kg now, at 0.75 m.
    assert_eq!(loaded.segments()[2].mass, 2.0);
    assert_eq!(loaded.segments()[2].com, [0.75, 0.0]);

    let moved = altered("gravity_moment", 1, &[0.25])
        .chain()
        .expect("valid");
    assert_eq!(moved.segments()[1].com, [0.75, 0.0]);
    assert_eq!(
        (moved.segments()[1].mass, moved.segments()[1].inertia),
        (1.0, 0.0)
    );
    assert!(close(
        moved.first_moments()[1] - base.first_moments()[1],
        0.25
    ));
    assert_eq!(moved.first_moments()[0], base.first_moments()[0]);

    let heavier = altered("inertia", 1, &[0.5]).chain().expect("valid");
    assert_eq!(heavier.second_moments()[1] - base.second_moments()[1], 0.5);
    let longer = altered("segment_length", 1, &[0.25]);
    assert_eq!(
        (longer.segments[1].length, longer.segments[1].com),
        (1.25, [0.5, 0.0])
    );
}

#[test]
fn frame_in_the_head() {
    // A turn of π/6 shows half the weight forward.
    let tilted = altered("gravity_tilt", 0, &[core::f64::consts::FRAC_PI_6 * 0.5]);
    let [y, z] = tilted.gravity;
    assert!(y > 0.0 && z < 0.0);
    assert!(close(y * y + z * z - 100.0, 0.0) || (y * y + z * z - 100.0).abs() < 1e-12);
    assert!(close(2.0 * y * -z / 100.0, 0.5), "sine of twice the angle");
    let moving = altered("shoulder_motion", 0, &[0.01, -0.02, 0.5]);
    assert_eq!((moving.base_motion, moving.base_rest), ([0.01, -0.02], 0.5));
    let heaving = altered("shoulder_heave", 0, &[0.004, 0.012, 0.23, -0.5]);
    let wave = Wave {
        amplitude: [0.004, 0.012],
        frequency: 0.23,
        phase: -0.5,
    };
    assert_eq!(heaving.heave, wave);
}

#[test]
fn contact_in_the_head() {
    // In series with its own compliance of 1e-4 m/N: half as stiff. The second axis: a third.
    let softer = altered("contact_compliance", 0, &[1e-4, 1e-4]).contact;
    assert!((softer.stiffness[0] - 5_000.0).abs() < 1e-9);
    assert!((softer.stiffness[1] - 20_000.0 / 3.0).abs() < 1e-9);
    // However negative: a hundred times as stiff at most.
    let stiffer = altered("contact_compliance", 0, &[-1e-3, 0.0]).contact;
    assert_eq!(stiffer.stiffness, [1e6, 20_000.0]);
    assert_eq!(
        altered("contact_damping", 0, &[5.0, -60.0]).contact.damping,
        [30.0, 0.0]
    );
    let loose = altered("backlash", 0, &[0.001, 0.002]).contact;
    assert_eq!(loose.play, [0.001, 0.002]);
    assert_eq!(loose.force_on_arm([0.0005, 0.003], [0.0; 2])[0], 0.0);
    assert!((loose.force_on_arm([0.0005, 0.003], [0.0; 2])[1] - 20.0).abs() < 1e-12);
    let rippled = altered("robot_ripple", 0, &[0.001, 0.002, 3.0, 0.5]);
    let Wave {
        amplitude, phase, ..
    } = rippled.displaced.ripple;
    assert_eq!((amplitude, phase), ([0.001, 0.002], 0.5));
    assert_eq!(altered("time_delay", 0, &[0.05]).force_delay, 0.05);
}

/// A slip and a ripple: where they begin and end, and that velocity and acceleration are the derivatives of the position.
#[test]
fn a_handle_slips_once_and_stays() {
    let slip = Displaced {
        slip: [0.003, -0.001],
        slip_start: 2.0,
        ..Displaced::<f64>::nowhere()
    };
    assert!(slip.is_somewhere() && !Displaced::<f64>::nowhere().is_somewhere());
    let far = |time| slip.at(time)[0];
    assert_eq!((far(0.0), far(2.0)), ([0.0; 2], [0.0; 2]));
    let [y, z] = far(2.05);
    assert!((y - 0.0015).abs() < 1e-15 && (z + 0.0005).abs() < 1e-15);
    for time in [2.1, 50.0] {
        let [position, velocity, acceleration] = slip.at(time);
        assert!((position[0] - 0.003).abs() < 1e-17 && (position[1] + 0.001).abs() < 1e-17);
        assert!(velocity[0].abs() < 1e-12 && acceleration[1].abs() < 1e-12);
    }
    let both = Displaced {
        ripple: Wave {
            amplitude: [1e-4, 2e-4],
            frequency: 3.0,
            phase: 0.4,
        },
        ..slip
    };
    let h = 1e-5;
    for time in [1.9, 2.01, 2.04, 2.08, 2.5] {
        let [before, now, after] = [-h, 0.0, h].map(|d| both.at(time + d));
        for axis in 0..2 {
            for order in 0..2 {
                let slope = (after[order][axis] - before[order][axis]) / (2.0 * h);
                let told = now[order + 1][axis];
                assert!(
                    (slope - told).abs() < 1e-4 * (1.0 + told.abs()),
                    "{slope} {told}"
                );
            }
        }
    }
}

#[test]
fn sensors_in_the_head() {
    let before = Reading {
        time: 2.0,
        q: Joints::<f64, 2>::new(0.1, 0.2),
        force_on_arm: [3.0, 4.0],
        moment_on_arm: 1.0,
    };
    let read = |name: &str, index, values: &[f64]| {
        let mut reading = before;
        Effect {
            index,
            ..of(name, values)
        }
        .distort(&mut reading);
        reading
    };
    assert_eq!(read("force_bias", 0, &[0.5]).force_on_arm, [3.5, 4.0]);
    assert_eq!(read("force_bias", 1, &[0.5]).force_on_arm, [3.0, 4.5]);
    assert_eq!(read("force_bias", 2, &[0.5]).moment_on_arm, 1.5);
    assert_eq!(read("force_drift", 1, &[0.5]).force_on_arm, [3.0, 5.0]);
    assert_eq!(read("force_gain", 0, &[0.5]).force_on_arm, [4.5, 4.0]);
    assert_eq!(
        read("angle_offset", 1, &[0.5]).q,
        Joints::<f64, 2>::new(0.1, 0.7)
    );
    let [y, z] = read("force_misalignment", 0, &[core::f64::consts::FRAC_PI_2]).force_on_arm;
    assert!(
        close(y, -4.0) && close(z, 3.0),
        "a quarter turn: y → z → −y"
    );
}

/// The largest error of a Maxwell element's stretch along `sin ωt`, whose state is known in closed form, relative to its amplitude.
fn error_of_stretch(time: f64, omega: f64, rate: f64) -> f64 {
    let spring = of("relaxation", &[1.0, time]);
    let view = |t: f64| moving(omega * libm::cos(omega * t));
    let (h, tau) = (1.0 / rate, omega * time);
    let size = tau / (1.0 + tau * tau);
    // ė = ω cos ωt − e/T from rest: e = a (sin ωt + cos ωt / ωT − exp(−t/T) / ωT) ωT, a = ωT / (1 + ω²T²).
    let exact =
        |t: f64| size * (tau * libm::sin(omega * t) + libm::cos(omega * t) - libm::exp(-t / time));
    let (mut state, mut worst) = ([0.0; 3], 0.0_f64);
    for i in 0..(3.0 * rate) as u32 {
        let t = f64::from(i) * h;
        state = spring.next_states((&view(t), &view(t + h)), state, h);
        worst = worst.max((state[0] - exact(t + h)).abs());
    }
    worst / size
}

#[test]
fn states_follow_a_given_motion() {
    // Second order in the interval, and right even where the state settles within a sample.
    let (coarse, fine) = (
        error_of_stretch(0.3, 5.0, 50.0),
        error_of_stretch(0.3, 5.0, 100.0),
    );
    assert!(coarse < 2e-3, "{coarse}");
    assert!(fine < 0.27 * coarse, "{fine} {coarse}");
    let quick = error_of_stretch(0.01, 5.0, 50.0);
    assert!(quick < 0.02, "{quick}");
}

#[test]
fn states_stay_within_their_law_however_fast_they_settle() {
    // Breaks down within 0.1 ms of motion at 10 rad/s; the sampling interval is 200 times that.
    let effect = of("thixotropy", &[1.0, 0.0, 0.0, 0.001, 0.01]);
    let mut state = [0.0; 3];
    for i in 0..200 {
        let now = moving(if i % 20 < 10 { 10.0 } else { 0.0 });
        state = effect.next_states((&now, &now), state, 0.02);
        assert!((0.0..=1.0).contains(&state[0]), "{state:?}");
    }
}

/// A reflex of the elbow with a latency: both directions beyond 0.5 rad/s.
fn late(latency: f64) -> Effect<f64> {
    of("stretch_reflex", &[2.0, 0.5, 0.0, latency])
}

/// Torques of an effect along speeds that are given at equal intervals.
fn along(effect: &Effect<f64>, interval: f64, speeds: &[f64]) -> Vec<f64> {
    let mut states = [0.0; 3];
    let mut torques = vec![effect.torque(&moving(speeds[0]))];
    for pair in speeds.windows(2) {
        let (from, to) = (moving(pair[0]), moving(pair[1]));
        states = effect.next_states((&from, &to), states, interval);
        let memory = states;
        torques.push(effect.torque(&Local { memory, ..to }));
    }
    torques
}

#[test]
fn a_reflex_without_latency_acts_at_once_whatever_its_states() {
    let mut random = Random(71);
    for _ in 0..1000 {
        let speed = random.uniform(-3.0, 3.0);
        let local = Local {
            memory: random.states(),
            ..moving(speed)
        };
        for latency in [0.0, 0.0049] {
            let reflex = late(latency);
            let expected = 2.0 * ((speed - 0.5).max(0.0) - (-speed - 0.5).max(0.0));
            assert_eq!(reflex.torque(&local).to_bits(), expected.to_bits());
            assert_eq!(reflex.memory_rate(&local), [0.0; 3]);
            assert!(!reflex.remembers());
        }
    }
}

#[test]
fn a_late_reflex_resists_what_was_stretched_its_latency_before() {
    let h = 2.5e-4;
    for latency in [0.01, 0.03, 0.05, 0.1] {
        let (reflex, at_once) = (late(latency), late(0.0));
        // A stretch that begins at once: half of the torque is there after the latency.
        let torques = along(&reflex, h, &[&[0.0][..], &[1.5; 1600]].concat());
        let half = torques.iter().position(|&r| r > 1.0).unwrap() as f64 * h;
        assert!((half - latency).abs() < 0.06 * latency, "{half}");
        assert!((torques[1599] - 2.0).abs() < 1e-3, "{}", torques[1599]);
        // Movements to and fro within a second: what acts at once, later, but for 7 % of what the torque grows by in one latency.
        let speed = |t: f64| 1.5 * libm::sin(core::f64::consts::TAU * t);
        let speeds: Vec<f64> = (0..8000).map(|i| speed(f64::from(i) * h)).collect();
        let bound = 0.07 * latency * 2.0 * 1.5 * core::f64::consts::TAU;
        let shift = (latency / h).round() as usize;
        let exact = along(&at_once, h, &speeds);
        let found = along(&reflex, h, &speeds);
        for (now, then) in found[shift..].iter().zip(&exact) {
            assert!((now - then).abs() < bound, "{latency} {now} {then}");
        }
    }
}

#[test]
fn states_of_a_late_reflex_follow_in_long_and_short_intervals() {
    let speed = |t: f64| 1.5 * libm::sin(5.0 * t);
    let error = |rate: f64, latency: f64| -> f64 {
        let of_rate = |rate: f64| -> Vec<f64> {
            (0..(2.0 * rate) as u32)
                .map(|i| speed(f64::from(i) / rate))
                .collect()
        };
        let fine = along(&late(latency), 1e-4, &of_rate(1e4));
        let own = along(&late(latency), 1.0 / rate, &of_rate(rate));
        let every = (1e4 / rate) as usize;
        let pairs = own.iter().zip(fine.iter().step_by(every));
        pairs.fold(0.0, |worst: f64, (a, b)| worst.max((a - b).abs()))
    };
    // Second order in the interval. Where the latency is an eighth of it: what the torque grows by in half an interval.
    let (coarse, fine) = (error(50.0, 0.04), error(200.0, 0.04));
    assert!(coarse < 0.03, "{coarse}");
    assert!(fine < coarse / 5.0, "{fine} {coarse}");
    assert!(
        error(25.0, 0.005) < 0.02 * 2.0 * 1.5 * 5.0,
        "{}",
        error(25.0, 0.005)
    );
}
