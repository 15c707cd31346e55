//! The documented order of the integrators, and the error of the reference workload.

use arm_sim::{Experiment, Integrator, models};

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
    let experiment = models::human_experiment(20.0, [0.0; 3]).expect("a sample experiment");
    let euler = error(experiment.clone(), Integrator::SemiImplicitEuler, 0.25e-3);
    assert!(euler < 2e-6, "semi-implicit Euler {euler}");
    let rk4 = error(experiment, Integrator::Rk4, 1e-3);
    assert!(rk4 < 1e-9, "Rk4 {rk4}");
    println!("W2 error: euler {euler:e}, rk4 1 ms {rk4:e}");
}
