//! Digests of everything that must have the same bits everywhere: simulation, batch identification with its solver, and the
//! online estimator in both precisions.

use arm_core::effect::{Effect, Kind};
use arm_core::estimator::{Estimator, Sample, Settings};
use arm_core::{Chain, Elbow, Equation, Joints, Measured, Real, Robot, Segment};
use arm_ident::inference::joint_method::{Options, identify};
use arm_ident::regression::trial::{Model, Trial};
use arm_sim::{
    Integrator, SensorChannel, Sensors, digest, sample_experiments, simulate, simulate_batch,
};

pub type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

/// FNV-1a over the bits of numbers.
pub fn of_values(values: impl IntoIterator<Item = f64>) -> u64 {
    let bytes = values.into_iter().flat_map(|v| v.to_bits().to_le_bytes());
    bytes.fold(0xcbf2_9ce4_8422_2325, |h, byte| {
        (h ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    })
}

/// Four seconds of the mechanical arm, read by sensors: the trial, and the joint angles that follow from the robot's.
fn trial() -> Outcome<(Trial<2>, Vec<Joints<f64, 2>>)> {
    let mut experiment = sample_experiments::mechanical_experiment(4.0, [-0.8, 1.0])?;
    let robot = Robot::new([0.45, 0.45], [1.0, -0.1], Elbow::Up)?;
    experiment.robot = Some(robot);
    experiment.output_interval = Some(2e-3);
    let recording = simulate(&experiment)?;
    let mut sensors = Sensors::ideal();
    sensors.rate = 500.0;
    sensors.seed = 3;
    sensors.angle = [SensorChannel::white(1e-3); 2];
    sensors.force = [SensorChannel::white(0.1); 2];
    let read = sensors.read(&experiment, &recording)?;
    let pairs = |v: &[f64]| -> Vec<[f64; 2]> { v.chunks_exact(2).map(|c| [c[0], c[1]]).collect() };
    let robot_q = pairs(&read.robot_q);
    let handle: Vec<[f64; 2]> = robot_q.iter().map(|&q| robot.handle(&q.into())).collect();
    let arm = Robot::new([0.376, 0.239], [0.0, 0.0], Elbow::Down)?;
    let lead = handle.iter().map(|&h| arm.angles(h));
    let lead = lead.collect::<Result<Vec<_>, _>>()?;
    let q = pairs(&read.q).into_iter().map(Joints::from).collect();
    let trial = Trial {
        force_on_arm: Some(pairs(&read.force_on_arm)),
        handle: Some(handle),
        ..Trial::new(500.0, q)
    };
    Ok((trial, lead))
}

/// A tenth too heavy, with springs and friction to be found; there is no dry friction, so that bounds bind.
fn model() -> Outcome<Model<2>> {
    let truth = arm_core::sample_arms::mechanical_arm();
    let heavy = truth.segments().map(|s| Segment {
        mass: 1.1 * s.mass,
        inertia: 1.1 * s.inertia,
        ..s
    });
    let at_both = |kind| [0, 1].map(|joint| Effect::new(kind, joint));
    let mut fitted = [Kind::Viscous, Kind::Coulomb, Kind::Elastic]
        .map(at_both)
        .concat();
    fitted[4].parameters[1] = -0.8;
    fitted[5].parameters[1] = 1.0;
    Ok(Model {
        chain: Chain::new(heavy, truth.base(), truth.gravity())?,
        segment_uncertainty: 0.1,
        fitted,
        held: Vec::new(),
        contact: arm_core::Contact::new([sample_experiments::STIFFNESS; 2], [0.0; 2]),
    })
}

fn identification(model: &Model<2>, trial: &Trial<2>) -> Outcome<u64> {
    let found = identify(model, std::slice::from_ref(trial), &Options::default())?;
    let all = found.parameters.iter().chain(&found.combinations);
    Ok(of_values(
        all.chain(&found.calibration)
            .flat_map(|e| [e.value, e.std, e.interval.0, e.interval.1])
            .filter(|v| v.is_finite()),
    ))
}

fn estimation<T: Real>(
    model: &Model<2>,
    trial: &Trial<2>,
    lead: &[Joints<f64, 2>],
) -> Outcome<u64> {
    let effects: [Effect<T>; 6] = std::array::from_fn(|i| {
        let e = &model.fitted[i];
        Effect::new(e.kind, e.index).with(&e.parameters.map(T::of))
    });
    let equation = Equation::<T, 2, 10, 6>::new(model.chain.cast(), effects)?;
    let mut settings = Settings::new(equation.chain(), T::of(2e-3));
    settings.forgetting = T::of(30.0);
    let mut estimator = Estimator::new(equation, equation.priors(T::of(0.1)), &settings)?;
    let cast = |q: &Joints<f64, 2>| Joints::<T, 2>::from([T::of(q[0]), T::of(q[1])]);
    let mut values = Vec::new();
    let forces = trial.force_on_arm.iter().flatten();
    for ((q, lead), force) in trial.q.iter().zip(lead).zip(forces) {
        estimator.update(Some(&Sample {
            q: cast(q),
            lead: Some(cast(lead)),
            measured: Measured {
                torque: cast(&Joints::zeros()),
                force_on_arm: force.map(T::of),
                moment_on_arm: T::ZERO,
            },
        }));
        let estimates = estimator.estimates().iter();
        values.extend(estimates.flat_map(|e| [e.value.to_f64(), e.sd.to_f64()]));
    }
    Ok(of_values(values))
}

/// The digests by their names.
pub fn digests() -> Outcome<[(&'static str, u64); 7]> {
    let mut experiment = sample_experiments::reference()?;
    let rk4 = digest(&simulate(&experiment)?)?;
    let threads = if cfg!(target_family = "wasm") { 1 } else { 2 };
    let lanes = simulate_batch(&[experiment.clone(), experiment.clone()], threads);
    let lanes = lanes.into_iter().map(|lane| digest(&lane?));
    let lanes = lanes.collect::<Result<Vec<u64>, _>>()?;
    experiment.integrator = Integrator::SemiImplicitEuler;
    let euler = digest(&simulate(&experiment)?)?;
    let ((trial, lead), model) = (trial()?, model()?);
    Ok([
        ("simulation-rk4", rk4),
        ("simulation-rk4-lane-1", lanes[0]),
        ("simulation-rk4-lane-2", lanes[1]),
        ("simulation-euler", euler),
        ("identification", identification(&model, &trial)?),
        ("estimator-f64", estimation::<f64>(&model, &trial, &lead)?),
        ("estimator-f32", estimation::<f32>(&model, &trial, &lead)?),
    ])
}
