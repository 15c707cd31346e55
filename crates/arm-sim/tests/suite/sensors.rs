//! What the sensors read.

use arm_core::effect::{Effect, Kind};
use arm_sim::{Experiment, Readings, Recording, SensorChannel, Sensors, sample_experiments};

use crate::common::{largest, run, smooth};

/// A run of one second recorded at 1 kHz, with a robot.
fn recorded() -> (Experiment<3>, Recording<3>) {
    let mut experiment = smooth(1.0);
    experiment.output_interval = Some(1e-3);
    experiment.robot = Some(sample_experiments::robot().expect("a robot"));
    let recording = run(&experiment);
    (experiment, recording)
}

/// A recording of zeros, so that readings are noise alone.
fn silent(seconds: usize) -> Recording<1> {
    let n = 50 * seconds + 1;
    let mut recording = Recording {
        time: (0..n).map(|i| 0.02 * i as f64).collect(),
        q: vec![0.0; n],
        force_on_arm: vec![0.0; 2 * n],
        moment_on_arm: vec![0.0; n],
        ..Recording::default()
    };
    recording.torque.drive = vec![0.0; n];
    recording
}

fn read(sensors: &Sensors<1>, recording: &Recording<1>) -> Readings<1> {
    sensors.read(&one_joint(), recording).expect("readings")
}

fn one_joint() -> Experiment<1> {
    let arm = arm_core::Chain::new(
        [arm_core::sample_arms::mechanical_arm().segments()[0]],
        [0.0; 2],
        [0.0, -9.81],
    );
    let contact = arm_core::Contact::new([0.0; 2], [0.0; 2]);
    let setup = arm_core::Setup::new(&arm.expect("an arm"), contact);
    Experiment::new(setup, arm_sim::Drive::Torque(None), 1.0)
}

#[test]
fn ideal_sensors_read_the_recorded_samples() {
    let (experiment, r) = recorded();
    let readings = Sensors::ideal().read(&experiment, &r).expect("readings");
    assert_eq!(readings.time.len(), 51);
    for k in 0..51 {
        let i = 20 * k;
        assert_eq!(readings.q[3 * k..3 * k + 3], r.q[3 * i..3 * i + 3]);
        assert_eq!(
            readings.force_on_arm[2 * k..2 * k + 2],
            r.force_on_arm[2 * i..2 * i + 2]
        );
        assert_eq!(
            readings.robot_q[2 * k..2 * k + 2],
            r.robot_q[2 * i..2 * i + 2]
        );
    }
    assert!(readings.torque.is_empty());
}

/// The robot's angles put its handle where the recording has it.
#[test]
fn recorded_robot_angles_are_those_of_the_handle() {
    let (_, r) = recorded();
    let robot = sample_experiments::robot().expect("a robot");
    for i in (0..r.len()).step_by(100) {
        let handle = robot.handle(&[r.robot_q[2 * i], r.robot_q[2 * i + 1]].into());
        assert!(largest(&handle, &r.handle[2 * i..2 * i + 2]) < 1e-12);
    }
}

#[test]
fn a_delay_shifts_forces_and_leaves_angles() {
    let (mut experiment, r) = recorded();
    let truth = Sensors::ideal().read(&experiment, &r).expect("readings");
    experiment
        .effects
        .push(Effect::new(Kind::TimeDelay, 0).with(&[0.02]));
    let late = Sensors::ideal().read(&experiment, &r).expect("readings");
    assert_eq!(late.q, truth.q);
    assert_eq!(late.force_on_arm[2..], truth.force_on_arm[..100]);
    assert_eq!(late.force_on_arm[..2], truth.force_on_arm[..2]);
    // Between samples: against the same run recorded at every step.
    experiment.effects.pop();
    experiment.output_interval = None;
    let fine = run(&experiment);
    experiment
        .effects
        .push(Effect::new(Kind::TimeDelay, 0).with(&[0.0105]));
    let [coarse, fine] =
        [&r, &fine].map(|r| Sensors::ideal().read(&experiment, r).expect("readings"));
    let error = largest(&coarse.force_on_arm[4..], &fine.force_on_arm[4..]);
    // The contact still rings at some 80 Hz from the start, which 1 kHz resolves to this.
    assert!(error < 5e-3, "{error} N");
}

#[test]
fn distortions_come_in_the_order_of_the_list_before_quantisation() {
    let (mut experiment, r) = recorded();
    let truth = Sensors::ideal().read(&experiment, &r).expect("readings");
    experiment.effects.extend([
        Effect::new(Kind::ForceGain, 0).with(&[0.5]),
        Effect::new(Kind::ForceBias, 0).with(&[2.0]),
        Effect::new(Kind::AngleOffset, 1).with(&[0.25]),
    ]);
    let mut sensors = Sensors::ideal();
    sensors.force[0] = SensorChannel {
        range: 50.0,
        bits: Some(10),
        ..SensorChannel::IDEAL
    };
    let read = sensors.read(&experiment, &r).expect("readings");
    let step = 100.0 / 1024.0;
    for k in 0..51 {
        let distorted = 1.5 * truth.force_on_arm[2 * k] + 2.0;
        let expected = ((distorted / step).round() * step).clamp(-50.0, 50.0);
        assert_eq!(read.force_on_arm[2 * k], expected);
        assert_eq!(read.q[3 * k + 1], truth.q[3 * k + 1] + 0.25);
    }
}

#[test]
fn saturation_and_quantisation_of_zero() {
    let mut recording = silent(1);
    recording.q[0] = 3.0;
    recording.q[1] = -3.0;
    let mut sensors = Sensors::ideal();
    sensors.angle[0] = SensorChannel {
        range: 1.0,
        bits: Some(3),
        ..SensorChannel::IDEAL
    };
    let q = read(&sensors, &recording).q;
    assert_eq!(q[..3], [1.0, -1.0, 0.0]);
}

#[test]
fn noise_has_its_deviation_and_colour() {
    let recording = silent(2000);
    let mut sensors = Sensors::ideal();
    sensors.force = [
        SensorChannel::white(0.2),
        SensorChannel {
            deviation: 0.2,
            correlation_time: 0.1,
            ..SensorChannel::IDEAL
        },
    ];
    let readings = read(&sensors, &recording);
    let n = readings.time.len() as f64;
    for (axis, expected) in [0.0, libm::exp(-0.2)].into_iter().enumerate() {
        let x: Vec<f64> = readings
            .force_on_arm
            .iter()
            .skip(axis)
            .step_by(2)
            .copied()
            .collect();
        let variance = x.iter().map(|x| x * x).sum::<f64>() / n;
        let lagged = x.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / n / variance;
        // Five standard errors; the effective number of samples of the coloured channel is a tenth.
        let tolerance = if axis == 0 { 0.016 } else { 0.05 };
        assert!(
            (variance.sqrt() / 0.2 - 1.0).abs() < tolerance,
            "{axis}: {}",
            variance.sqrt()
        );
        assert!((lagged - expected).abs() < tolerance, "{axis}: {lagged}");
    }
}

#[test]
fn noise_follows_from_the_seed_and_channels_are_independent() {
    let recording = silent(10);
    let mut sensors = Sensors::ideal();
    sensors.angle[0] = SensorChannel::white(1.0);
    let first = read(&sensors, &recording);
    assert_eq!(first, read(&sensors, &recording));
    sensors.force[1] = SensorChannel::white(1.0);
    let both = read(&sensors, &recording);
    assert_eq!(first.q, both.q);
    let correlation: f64 = (0..both.time.len())
        .map(|k| both.q[k] * both.force_on_arm[2 * k + 1])
        .sum();
    assert!(correlation.abs() / (both.time.len() as f64) < 0.2);
    sensors.seed = 1;
    assert_ne!(first.q, read(&sensors, &recording).q);
}

#[test]
fn refused_sensors() {
    let recording = silent(1);
    let refusal = |change: &dyn Fn(&mut Sensors<1>)| {
        let mut sensors = Sensors::ideal();
        change(&mut sensors);
        sensors
            .read(&one_joint(), &recording)
            .expect_err("refused")
            .to_string()
    };
    assert!(refusal(&|s| s.rate = 0.0).contains("rate of the sensors"));
    assert!(refusal(&|s| s.force[0].deviation = -1.0).contains("deviation"));
    assert!(refusal(&|s| s.moment.correlation_time = f64::NAN).contains("correlation time"));
    assert!(refusal(&|s| s.angle[0].range = 0.0).contains("range"));
    assert!(refusal(&|s| s.angle[0].bits = Some(12)).contains("finite"));
    assert!(refusal(&|s| s.angle[0].bits = Some(0)).contains("bits"));
}
