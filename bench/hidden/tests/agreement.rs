//! Where nothing is hidden, the world and the simulator that it judges show the same.

use arm_core::effect::{Effect, Kind};
use arm_core::{Chain, Contact, Elbow, Joints, Robot, Segment, Setup};
use arm_sim::{Coupling, Drive, Experiment, HandlePath, Start, simulate};
use hidden_world::cast::Strength;
use hidden_world::effect::Hidden;
use hidden_world::model::Setting;
use hidden_world::motion::{Lead, Movement, Pace, Profile, RATE};
use hidden_world::random::Random;
use hidden_world::rig::Rig;
use hidden_world::run::{Grip, RECORDS, Truth, run};
use hidden_world::session::{Case, Session};

/// A setting with an exact model and so many joints.
fn setting(joints: usize) -> Setting {
    (1..)
        .filter_map(|seed| Setting::draw(&mut Random::new(seed, 1), 0.0).ok())
        .find(|setting| setting.truth.size() == joints)
        .expect("half of all settings have as many joints")
}

/// About 10 s at so many radians a second, least jerk and two joints at once.
fn movement(setting: &Setting, speed: f64) -> Movement {
    let away = |y: f64, z: f64| [y, z, 0.1 * z][..setting.posture.len()].to_vec();
    let waypoints = [
        away(0.5, 0.0),
        away(0.5, 0.6),
        away(-0.1, 0.5),
        away(0.0, 0.0),
    ];
    let pace = Pace {
        speed,
        pause: 0.2,
        profile: Profile::LeastJerk,
        duration: 10.0,
    };
    Movement::legs("round", &setting.posture, &waypoints, &pace)
}

/// The same trial, driven by what the robot's encoders would say 50 times a second.
fn native<const N: usize>(rig: &Rig, movement: &Movement, truth: &Truth) -> arm_sim::Recording<N> {
    let segments = std::array::from_fn(|i| {
        let link = &rig.links[i];
        Segment {
            length: link.length,
            mass: link.mass,
            com: [link.com, 0.0],
            inertia: link.inertia,
        }
    });
    let chain = Chain::<f64, N>::new(segments, rig.base, rig.gravity).expect("a chain");
    let robot = Robot::new(rig.robot.lengths, rig.robot.base, Elbow::Up).expect("a robot");
    let samples: Vec<[f64; 2]> = truth.robot.iter().step_by(RECORDS).copied().collect();
    let times: Vec<f64> = (0..samples.len()).map(|k| k as f64 / RATE).collect();
    let path = HandlePath::of_robot(robot, &times, &samples).expect("a path");
    let contact = Contact::new(rig.contact.stiffness, rig.contact.damping);
    let drive = Drive::Handle {
        path,
        coupling: Coupling::Compliant,
    };
    let mut experiment =
        Experiment::new(Setup::new(&chain, contact), drive, times[times.len() - 1]);
    experiment.start = Start::Equilibrium {
        near: Joints::from_fn(|j, _| movement.from[j]),
    };
    experiment.output_interval = Some(1.0 / RATE);
    for (j, joint) in rig.joints.iter().enumerate() {
        experiment.effects.extend([
            Effect::new(Kind::Viscous, j).with(&[joint.viscosity]),
            Effect::new(Kind::Elastic, j).with(&[joint.stiffness, joint.rest]),
        ]);
    }
    simulate(&experiment).expect("a run")
}

/// Largest differences of angles \[rad\] and forces \[N\].
fn differences<const N: usize>(speed: f64) -> (f64, f64) {
    let setting = setting(N);
    let movement = movement(&setting, speed);
    let mut random = Random::new(7, 0);
    let lead = Lead::along(&movement, &setting.model, &setting.servo, &mut random)
        .expect("the robot reaches");
    let near = (0, &Grip::NOMINAL, movement.from.as_slice());
    let none: &[Hidden] = &[];
    let truth = run(&setting.truth, none, &lead, near, 0.0, &mut random).expect("a run");
    let recording = native::<N>(&setting.truth, &movement, &truth);
    let (mut angle, mut force) = (0.0_f64, 0.0_f64);
    for k in 0..recording.time.len() {
        for j in 0..N {
            angle = angle.max((recording.q[N * k + j] - truth.q[RECORDS * k][j]).abs());
        }
        for c in 0..2 {
            let there = recording.force_on_arm[2 * k + c];
            force = force.max((there - truth.force_on_arm[RECORDS * k][c]).abs());
        }
    }
    println!("{N} joints at {speed} rad/s: {angle:.1e} rad, {force:.1e} N");
    (angle, force)
}

#[test]
fn nothing_hidden_nothing_seen() {
    // A tenth of the finest sensors: 0.02° and 0.05 N. What is left at speed is the spline through 50 samples a second.
    for (angle, force) in [
        differences::<2>(0.3),
        differences::<2>(1.3),
        differences::<3>(0.3),
        differences::<3>(1.3),
    ] {
        assert!(angle < 3e-5, "{angle} rad");
        assert!(force < 0.01, "{force} N");
    }
}

#[test]
fn a_seed_is_a_session() {
    let make = || {
        let case = Case::Single("coulomb", Strength::Strong);
        let session = Session::new(3, case).expect("a session");
        hidden_world::output::truth(&session).to_string()
            + &format!("{:?}", session.trials[0].readings)
    };
    assert_eq!(make(), make());
}
