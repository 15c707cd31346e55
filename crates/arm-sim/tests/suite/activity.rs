//! Effects that depend on muscle activity, which a series gives.

use arm_core::effect::{Effect, Kind};
use arm_sim::{
    Experiment, Integrator, Interpolation, Port, Series, Stepper, digest, simulate, simulate_batch,
};

use crate::common::{largest, run, smooth, swinging};

/// Stiffness, torque and viscosity of a maximal contraction.
const MAXIMAL: [f64; 3] = [6.0, 4.0, 0.8];

fn active(joint: usize) -> [Effect<f64>; 2] {
    let [stiffness, torque, viscosity] = MAXIMAL;
    [
        Effect::new(Kind::ActiveStiffness, joint).with(&[stiffness, torque]),
        Effect::new(Kind::ActiveViscosity, joint).with(&[viscosity]),
    ]
}

/// An activity of the elbow that goes in straight lines through its samples.
fn of_elbow(duration: f64, activity: impl Fn(f64) -> f64) -> Series<3> {
    let times: Vec<f64> = (0..=100).map(|i| f64::from(i) * duration / 100.0).collect();
    let points: Vec<[f64; 3]> = times.iter().map(|&t| [0.0, activity(t), 0.0]).collect();
    Series::new("activity", &times, &points, Interpolation::Linear).expect("a series")
}

#[test]
fn a_constant_activity_is_a_spring_and_a_damper() {
    let [stiffness, torque, viscosity] = MAXIMAL;
    let plain = [
        Effect::new(Kind::Elastic, 1).with(&[0.5 * stiffness, torque / stiffness]),
        Effect::new(Kind::Viscous, 1).with(&[0.5 * viscosity]),
    ];
    let dry = Effect::new(Kind::Coulomb, 2).with(&[0.05, 0.0]);
    for besides in [vec![], vec![dry]] {
        for integrator in [Integrator::Rk4, Integrator::SemiImplicitEuler] {
            let with = |effects: &[Effect<f64>]| {
                let mut experiment = smooth(0.5);
                experiment.integrator = integrator;
                experiment.effects = [effects, &besides].concat();
                experiment.activity = Some(of_elbow(0.5, |_| 0.5));
                run(&experiment)
            };
            let (muscles, springs) = (with(&active(1)), with(&plain));
            assert!(largest(&muscles.q, &springs.q) < 1e-11);
            assert!(largest(&muscles.force_on_arm, &springs.force_on_arm) < 1e-7);
            assert!(largest(&muscles.q, &with(&[]).q) > 1e-3, "they are seen");
        }
    }
}

#[test]
fn a_pendulum_whose_muscle_grows_active_follows_its_own_equation() {
    let ([mass, com, inertia, gravity], mut experiment) = swinging();
    experiment.effects = active(0).to_vec();
    let ramp = Series::new(
        "activity",
        &[0.0, 2.0],
        &[[0.0], [1.0]],
        Interpolation::Linear,
    );
    experiment.activity = Some(ramp.expect("a series"));
    let recording = run(&experiment);
    let [stiffness, torque, viscosity] = MAXIMAL;
    let acceleration = |time: f64, q: f64, v: f64| {
        let muscle = 0.5 * time * (stiffness * q - torque + viscosity * v);
        -(mass * com * gravity * libm::cos(q) + muscle) / (inertia + mass * com * com)
    };
    // Another integration, a hundred times finer than its error: the midpoint rule.
    let (mut q, mut v, h) = (-1.2, 0.0, 1e-5);
    for step in 0..200_000 {
        let time = h * f64::from(step);
        let (half_q, half_v) = (q + 0.5 * h * v, v + 0.5 * h * acceleration(time, q, v));
        q += h * half_v;
        v += h * acceleration(time + 0.5 * h, half_q, half_v);
    }
    let last = *recording.q.last().expect("samples");
    assert!((last - q).abs() < 1e-8, "{last} {q}");
}

#[test]
fn lanes_have_the_bits_of_single_runs_with_activities_of_their_own() {
    for integrator in [Integrator::Rk4, Integrator::SemiImplicitEuler] {
        let one = |k: usize| {
            let mut experiment = smooth(0.25);
            experiment.integrator = integrator;
            experiment.effects = active(1).to_vec();
            let grows = move |t: f64| 0.1 * k as f64 * t;
            experiment.activity = Some(of_elbow(0.25, grows));
            experiment
        };
        let runs: Vec<Experiment<3>> = (0..9).map(one).collect();
        let together = simulate_batch(&runs, 1);
        let mut seen = Vec::new();
        for (many, alone) in together.iter().zip(&runs) {
            let many = digest(many.as_ref().expect("a run"));
            assert_eq!(many, digest(&simulate(alone).expect("a run")));
            assert!(!seen.contains(&many), "every activity is another run");
            seen.push(many);
        }
    }
}

#[test]
fn what_depends_on_activity_is_refused_where_nothing_tells_it() {
    let mut experiment = smooth(0.25);
    experiment.effects = active(1).to_vec();
    let refused = simulate(&experiment).expect_err("no activity").to_string();
    assert!(
        refused.contains("active_stiffness depends on muscle activity"),
        "{refused}"
    );
    experiment.activity = Some(of_elbow(0.2, |_| 0.0));
    let refused = simulate(&experiment).expect_err("too short").to_string();
    assert!(refused.contains("the muscle activity"), "{refused}");
    experiment.effects[1].on = false;
    let stepped = Stepper::new(&experiment.setup, &experiment.effects, Port::Force, 1e-3);
    assert!(stepped.is_err());
    experiment.effects.truncate(2);
    for effect in &mut experiment.effects {
        effect.on = false;
    }
    assert!(Stepper::new(&experiment.setup, &experiment.effects, Port::Force, 1e-3).is_ok());
}
