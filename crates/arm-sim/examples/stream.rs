//! Writes the sensor stream that the firmware example reads: twelve seconds of a subject's arm led by a robot, at 1 kHz, as
//! a device has it, in counts. `cargo run --release -p arm-sim --no-default-features --example stream -- FILE`
//!
//! Little-endian, 16 bytes a sample: three joint encoders (32 bit, 2^20 counts a turn) and a force sensor (two times 16 bit,
//! 2^12 counts over ±110 N).

use std::f64::consts::TAU;

use arm_core::effect::{Effect, Kind};
use arm_core::{Contact, Joints, Limits, Setup, Shape, sample_arms};
use arm_sim::{
    Coupling, Drive, Experiment, HandlePath, Movement, SensorChannel, Sensors, Start,
    sample_experiments as rigs, simulate,
};

/// Where the arm is led [°]; `firmware/main.c` has the same.
const WAYPOINTS: [[f64; 3]; 7] = [
    [-68.0, 40.0, 0.0],
    [-40.0, 60.0, 5.0],
    [-60.0, 95.0, 0.0],
    [-25.0, 55.0, 5.0],
    [-70.0, 70.0, 0.0],
    [-35.0, 90.0, 5.0],
    [-68.0, 40.0, 0.0],
];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let file = std::env::args()
        .nth(1)
        .ok_or("the file to write is missing")?;
    let arm = sample_arms::human_arm();
    let waypoints = WAYPOINTS.map(|q| Joints::from(q.map(f64::to_radians)));
    let limits = [Limits {
        speed: 0.6,
        acceleration: 4.0,
    }; 3];
    let movement = Movement::within(Shape::Smooth, &waypoints, &limits, 0.1)?;
    let drive = Drive::Handle {
        path: HandlePath::of_arm(arm, movement),
        coupling: Coupling::Compliant,
    };
    let setup = Setup::new(&arm, Contact::new([1e4; 2], [25.0; 2]));
    let mut experiment = Experiment::new(setup, drive, 12.0);
    experiment.robot = Some(rigs::robot()?);
    experiment.start = Start::Equilibrium { near: waypoints[0] };
    experiment.dt = 0.25e-3;
    experiment.output_interval = Some(1e-3);
    let rest = [-0.8, 1.1, 0.05];
    for joint in 0..3 {
        experiment.effects.extend([
            Effect::new(Kind::Viscous, joint).with(&[[0.25, 0.2, 0.05][joint]]),
            Effect::new(Kind::Coulomb, joint).with(&[[0.14, 0.16, 0.03][joint]]),
            Effect::new(Kind::Elastic, joint).with(&[[1.2, 0.8, 0.5][joint], rest[joint]]),
        ]);
    }
    experiment.effects.extend([
        Effect::new(Kind::EndRange, 1).with(&[0.5, 0.5, 8.0, 1.7, 0.5]),
        Effect::new(Kind::Biarticular, 2).with(&[0.3]),
    ]);
    let recording = simulate(&experiment)?;

    let mut sensors = Sensors::ideal();
    sensors.rate = 1000.0;
    sensors.seed = 7;
    sensors.angle = [SensorChannel {
        range: TAU / 2.0,
        bits: Some(20),
        ..SensorChannel::white(5e-6)
    }; 3];
    sensors.force = [SensorChannel {
        range: 110.0,
        bits: Some(12),
        ..SensorChannel::white(0.1)
    }; 2];
    let read = sensors.read(&experiment, &recording)?;
    let mut bytes = Vec::new();
    for (q, force) in read
        .q
        .chunks_exact(3)
        .zip(read.force_on_arm.chunks_exact(2))
    {
        for angle in q {
            let counts = angle / TAU * f64::from(1 << 20);
            bytes.extend((counts.round() as i32).to_le_bytes());
        }
        for newton in force {
            let counts = newton / 220.0 * f64::from(1 << 12);
            bytes.extend((counts.round() as i16).to_le_bytes());
        }
    }
    std::fs::write(&file, &bytes)?;
    println!("{}: {} samples", file, bytes.len() / 16);
    Ok(())
}
