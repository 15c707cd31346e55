//! Synthetic sessions for the other modules.

use arm_core::effect::{Effect, Kind};
use arm_core::{Chain, Contact, Elbow, Joints, Limits, Robot, Segment, Setup, Shape};
use arm_gap::data::session::{ComparisonMode, Session};
use arm_ident::regression::trial::{Role, Tolerance, Trial};
use arm_sim::{
    Coupling, Drive, Experiment, HandlePath, Movement, SensorChannel, Sensors, Start, simulate,
};

/// Of every trial \[Hz\].
pub const RATE: f64 = 50.0;

/// An upper arm and a forearm.
pub fn arm() -> Chain<f64, 2> {
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

/// The joints of the model.
pub fn known() -> Vec<Effect<f64>> {
    let viscous = Kind::named("viscous").expect("known");
    (0..2)
        .map(|j| Effect::new(viscous, j).with(&[0.1]))
        .collect()
}

/// Two movements, each repeated: synthetic trials of an arm with `effects`, read by sensors with white noise.
pub fn session(effects: &[Effect<f64>], noise: (f64, f64)) -> Session<2> {
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
            sensors.angle = [SensorChannel::white(noise.0); 2];
            sensors.force = [SensorChannel::white(noise.1); 2];
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
                base: None,
                activity: None,
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
        weights: Vec::new(),
        own: Vec::new(),
        base: Vec::new(),
        start: [[0.0; 3]; 2],
    }
}
