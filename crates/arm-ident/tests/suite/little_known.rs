//! An arm of which little is known, one of whose joints the robot leaves free: no law in any joint of the model, masses off, angles with noise.

use arm_core::effect::Kind;
use arm_core::{Chain, Contact, Joints, Limits, Segment, Setup, Shape};
use arm_ident::inference::estimate::{Decision, Estimate, Identified};
use arm_ident::inference::joint_method::{MotionSource, Options, identify};
use arm_ident::regression::trial::{Model, Trial};
use arm_sim::{
    Coupling, Drive, Experiment, HandlePath, Movement, Normal, Recording, Start, simulate,
};

use crate::synthetic::{at_every_joint, effect, wrong};

/// Samples a second.
const RATE: f64 = 100.0;
/// Of the angles \[rad\] and of the force \[N\].
const NOISE: [f64; 2] = [2e-3, 0.05];

fn arm() -> Chain<f64, 3> {
    let segment = |length, mass, com, inertia| Segment {
        length,
        mass,
        com: [com, 0.0],
        inertia,
    };
    let segments = [
        segment(0.30, 1.9, 0.13, 0.016),
        segment(0.26, 1.1, 0.11, 0.007),
        segment(0.10, 0.45, 0.045, 0.0005),
    ];
    Chain::new(segments, [0.0; 2], [0.0, -9.81]).expect("a valid arm")
}

/// What the joints are made of: stiffness, rest angle, viscosity and dry friction.
type Laws = [[f64; 4]; 3];

/// A trial of the arm, led quickly or slowly through bent poses.
fn trial(laws: &Laws, quick: bool, repeat: u64, sticks: bool) -> Trial<3> {
    let poses = [
        [-1.0, 1.0, 0.0],
        [-0.5, 1.5, 0.2],
        [-0.9, 1.2, -0.3],
        [-1.2, 0.9, 0.3],
        [-0.6, 1.6, -0.2],
        [-1.0, 1.0, 0.0],
    ];
    let [speed, acceleration] = if quick { [1.0, 4.0] } else { [0.25, 1.0] };
    let limits = [Limits {
        speed,
        acceleration,
    }; 3];
    let waypoints = poses.map(Joints::from);
    let movement =
        Movement::within(Shape::Trapezoid, &waypoints, &limits, 0.3).expect("a movement");
    let duration = (movement.duration() * RATE).floor() / RATE;
    let path = HandlePath::of_arm(arm(), movement);
    let drive = Drive::Handle {
        path: path.clone(),
        coupling: Coupling::Compliant,
    };
    let contact = Contact::new([1e4; 2], [25.0; 2]);
    let mut experiment = Experiment::new(Setup::new(&arm(), contact), drive, duration);
    for (j, [stiffness, rest, viscosity, friction]) in laws.iter().enumerate() {
        let smoothing = if sticks && j == 2 { 0.0 } else { 0.01 };
        experiment.effects.extend([
            effect("elastic", j, &[*stiffness, *rest]),
            effect("viscous", j, &[*viscosity]),
            effect("coulomb", j, &[*friction, smoothing]),
        ]);
    }
    experiment.start = Start::Equilibrium { near: waypoints[0] };
    experiment.output_interval = Some(1.0 / RATE);
    let recording: Recording<3> = simulate(&experiment).expect("a run");
    let mut noise = Normal::new(7 + u64::from(quick), repeat);
    let mut noisy = |values: &[f64], deviation: f64| -> Vec<f64> {
        values
            .iter()
            .map(|v| v + deviation * noise.next())
            .collect()
    };
    let q = noisy(&recording.q, NOISE[0]);
    let force = noisy(&recording.force_on_arm, NOISE[1]);
    let handle = (0..q.len() / 3).map(|i| path.at(i as f64 / RATE).position);
    Trial {
        configuration: usize::from(quick),
        force_on_arm: Some(force.chunks_exact(2).map(|f| [f[0], f[1]]).collect()),
        handle: Some(handle.collect()),
        ..Trial::new(
            RATE,
            q.chunks_exact(3).map(Joints::from_column_slice).collect(),
        )
    }
}

fn identified(laws: &Laws, sticks: bool) -> Identified<3> {
    let trials: Vec<Trial<3>> = [(false, 0), (false, 1), (true, 0), (true, 1)]
        .map(|(quick, repeat)| trial(laws, quick, repeat, sticks))
        .into();
    let known = wrong(
        &arm(),
        [[1.05, 0.96, 1.1], [0.93, 1.05, 0.9], [1.0; 3]],
        0.1,
    );
    let model = Model {
        fitted: at_every_joint::<3>(&["elastic", "viscous", "coulomb"]),
        ..known
    };
    let options = Options {
        motion: MotionSource::Auto,
        may_stick: true,
        ..Options::default()
    };
    identify(&model, &trials, &options).expect("identified")
}

/// Asserts that the motion was simulated, and every law within four standard deviations of the true one.
fn assert_recovered(found: &Identified<3>, laws: &Laws) {
    assert!(found.not_simulated.is_none(), "{:?}", found.not_simulated);
    for (j, [stiffness, rest, viscosity, friction]) in laws.iter().enumerate() {
        let laws = [
            ("elastic", "stiffness", *stiffness),
            ("elastic", "stiffness*rest", stiffness * rest),
            ("viscous", "viscosity", *viscosity),
            ("coulomb", "torque", *friction),
        ];
        for (kind, name, wanted) in laws {
            let of = |e: &&Estimate| e.kind == kind && e.name == name && e.joint == Some(j + 1);
            let e = found.parameters.iter().find(of).expect("an estimate");
            let (value, std) = (e.value, e.std);
            let off = (value - wanted).abs();
            assert!(
                off < 4.0 * std,
                "{kind}{} {name} {value} ± {std}, true {wanted}",
                j + 1
            );
            assert_eq!(e.decided_by, Decision::Data, "{kind}{} {name}", j + 1);
        }
    }
}

/// Without a law in its joints the simulated arm moves elsewhere, and what measured speeds tell of the wrist is noise: only runs that are helped
/// near the measured ones lead to the minimum.
#[test]
fn a_free_wrist_is_identified_from_a_model_without_laws() {
    let laws = [
        [1.1, -0.63, 0.18, 0.13],
        [0.45, 1.34, 0.17, 0.09],
        [1.3, 0.05, 0.15, 0.06],
    ];
    assert_recovered(&identified(&laws, false), &laws);
}

/// Its friction is set-valued, that of the other joints smooth: the law that sticks is found, and told by its smoothing speed of zero.
#[test]
fn a_wrist_that_sticks_is_identified_from_a_model_without_laws() {
    let laws = [
        [2.7, -0.64, 0.2, 0.2],
        [1.5, 1.1, 0.36, 0.09],
        [0.83, 0.05, 0.1, 0.12],
    ];
    let found = identified(&laws, true);
    assert_recovered(&found, &laws);
    let mut friction = found.fitted.iter().filter(|e| e.kind == Kind::Coulomb);
    let of_wrist = friction.find(|e| e.index == 2).expect("fitted");
    assert_eq!(of_wrist.parameters[1], 0.0, "smoothing speed");
}
