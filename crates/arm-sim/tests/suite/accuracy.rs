//! The documented order of the integrators, and the error of the reference workload.

use arm_core::effect::{Effect, Kind};
use arm_sim::{Experiment, Integrator, sample_experiments, simulate_batch};

use crate::common::{largest, run, several_effects, smooth};

/// Error of the angles at `dt` against Rk4 at a sixteenth of it \[rad\].
fn error<const N: usize>(mut experiment: Experiment<N>, integrator: Integrator, dt: f64) -> f64 {
    experiment.output_interval = Some(0.02);
    (experiment.integrator, experiment.dt) = (Integrator::Rk4, dt / 16.0);
    let reference = run(&experiment);
    (experiment.integrator, experiment.dt) = (integrator, dt);
    largest(&run(&experiment).q, &reference.q)
}

/// Exponent by which the error falls when the step is halved.
fn order(experiment: &Experiment<3>, integrator: Integrator, dt: f64) -> f64 {
    let coarse = error(experiment.clone(), integrator, dt);
    let fine = error(experiment.clone(), integrator, dt / 2.0);
    libm::log2(coarse / fine)
}

#[test]
fn semi_implicit_euler_is_of_first_order() {
    let order = order(&smooth(2.0), Integrator::SemiImplicitEuler, 0.5e-3);
    assert!((order - 1.0).abs() < 0.1, "order {order}");
}

#[test]
fn rk4_is_of_fourth_order() {
    let order = order(&smooth(2.0), Integrator::Rk4, 2e-3);
    assert!((order - 4.0).abs() < 0.4, "order {order}");
}

/// An effect that does nothing, but is not linear in the motion of its joint, makes every step evaluate everything that acts.
#[test]
fn the_short_way_through_a_rig_leaves_nothing_out() {
    let alter: [&dyn Fn(&mut Experiment<3>); 4] = [
        &|_| {},
        &|run| {
            let heave = Effect::new(Kind::ShoulderHeave, 0).with(&[0.01, 0.02, 0.4, 0.3]);
            run.effects.push(heave);
        },
        &|run| {
            let ripple = Effect::new(Kind::RobotRipple, 0).with(&[0.002, 0.001, 3.0, 0.1]);
            run.effects.push(ripple);
        },
        &|run| {
            let moves = Effect::new(Kind::ShoulderMotion, 0).with(&[0.01, 0.02]);
            run.effects.push(moves);
        },
    ];
    for (which, alter) in alter.iter().enumerate() {
        for integrator in [Integrator::SemiImplicitEuler, Integrator::Rk4] {
            let mut short = smooth(1.0);
            short.integrator = integrator;
            alter(&mut short);
            let mut long = short.clone();
            long.effects
                .push(Effect::new(Kind::CubicElastic, 1).with(&[0.0, 0.0]));
            let runs = [run(&short), run(&long)];
            assert_eq!(runs[0].q, runs[1].q, "{which}, {integrator:?}");
            let beside = [short, long].map(|one| simulate_batch(&vec![one; 2], 1).remove(0));
            for (beside, alone) in beside.iter().zip(&runs) {
                assert_eq!(beside.as_ref().expect("runs").q, alone.q);
            }
        }
    }
}

#[test]
fn rk4_is_of_fourth_order_with_memory_base_motion_and_friction() {
    let mut experiment = smooth(2.0);
    experiment.effects = several_effects();
    let order = order(&experiment, Integrator::Rk4, 0.5e-3);
    assert!((order - 4.0).abs() < 0.5, "order {order}");
}

/// performance.md: 1.0e-6 rad and 4e-10 rad over 20 s.
#[test]
fn the_reference_workload_is_as_accurate_as_measured_elsewhere() {
    let experiment =
        sample_experiments::human_experiment(20.0, [0.0; 3]).expect("a sample experiment");
    let euler = error(experiment.clone(), Integrator::SemiImplicitEuler, 0.25e-3);
    assert!(euler < 2e-6, "semi-implicit Euler {euler}");
    let rk4 = error(experiment, Integrator::Rk4, 1e-3);
    assert!(rk4 < 1e-9, "Rk4 {rk4}");
    println!("W2 error: euler {euler:e}, rk4 1 ms {rk4:e}");
}
