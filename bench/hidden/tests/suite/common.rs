//! The same trial in the world and in the simulator that it judges.

use arm_core::effect::{Effect, Kind};
use arm_core::{Chain, Contact, Elbow, Joints, Robot, Segment, Setup};
use arm_sim::{Coupling, Drive, Experiment, HandlePath, Readings, Sensors, Start, simulate};
use hidden_world::effect::Hidden;
use hidden_world::model::Setting;
use hidden_world::motion::{Lead, Movement, Pace, Profile, RATE};
use hidden_world::random::Random;
use hidden_world::rig::{Plane, Rig};
use hidden_world::run::{Conditions, Grip, KEPT, RECORDS, Truth, run};

/// A setting with an exact model and so many joints.
pub fn setting(joints: usize) -> Setting {
    (1..)
        .filter_map(|seed| Setting::draw(&mut Random::new(seed, 1), 0.0).ok())
        .find(|setting| setting.truth.size() == joints)
        .expect("half of all settings have as many joints")
}

/// About 10 s at so many radians a second, least jerk and two joints at once.
pub fn movement(setting: &Setting, speed: f64) -> Movement {
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

/// What the robot does.
pub fn lead(setting: &Setting, movement: &Movement) -> Lead {
    let mut random = Random::new(7, 0);
    Lead::along(movement, &setting.model, &setting.servo, &mut random).expect("the robot reaches")
}

/// A trial in the world. Dry friction creeps: at rest a smoothed one cannot do otherwise.
pub fn world(setting: &Setting, movement: &Movement, lead: &Lead, hidden: &[Hidden]) -> Truth {
    rubbing(setting, movement, lead, hidden, 20.0)
}

/// The same with a damping of dry friction where it sticks \[N m s/rad\].
pub fn rubbing(
    setting: &Setting,
    movement: &Movement,
    lead: &Lead,
    hidden: &[Hidden],
    grip: f64,
) -> Truth {
    let mut rig = setting.truth.clone();
    for effect in hidden {
        effect.alter(&mut rig);
    }
    let conditions = Conditions {
        trial: 0,
        grip: &Grip::NOMINAL,
        near: &movement.from,
        friction_grip: grip,
        kept: KEPT,
    };
    run(&rig, hidden, lead, &conditions, &mut Random::new(7, 1)).expect("a run")
}

/// The same trial with effects of the catalogue, driven by what the robot's encoders would say 50 times a second: angles
/// and forces as they are read.
pub fn native<const N: usize>(
    rig: &Rig,
    movement: &Movement,
    robot_angles: &[Plane],
    effects: &[Effect<f64>],
) -> Readings<N> {
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
    let samples: Vec<[f64; 2]> = robot_angles.iter().step_by(RECORDS).copied().collect();
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
    experiment.output_interval = Some(0.002);
    for (j, joint) in rig.joints.iter().enumerate() {
        experiment.effects.extend([
            Effect::new(Kind::Viscous, j).with(&[joint.viscosity]),
            Effect::new(Kind::Elastic, j).with(&[joint.stiffness, joint.rest]),
        ]);
    }
    experiment.effects.extend_from_slice(effects);
    let recording = simulate(&experiment).expect("a run");
    Sensors::ideal()
        .read(&experiment, &recording)
        .expect("readings")
}
