//! Every joule is accounted for.

use arm_core::effect::{Effect, Kind};
use arm_sim::{Integrator, Recording, models};

use crate::common::{run, several_effects, smooth};

/// Largest unexplained energy, and the work exchanged by all ways in the run \[J\].
fn unexplained<const N: usize>(recording: &Recording<N>) -> (f64, f64) {
    let error = recording
        .energy_error()
        .iter()
        .fold(0.0, |m: f64, e| m.max(e.abs()));
    let w = &recording.work;
    let columns = [&w.handle, &w.drive, &w.resisted, &w.damped];
    let exchanged = columns.map(|c| c.windows(2).map(|p| (p[1] - p[0]).abs()).sum::<f64>());
    (error, exchanged.iter().sum())
}

#[test]
fn rk4_accounts_for_energy_to_a_billionth_a_second() {
    let recording = run(&smooth(4.0));
    let (error, exchanged) = unexplained(&recording);
    println!("smooth: {error:e} of {exchanged} J");
    assert!(error < 1e-9 * 4.0 * exchanged, "{error:e} of {exchanged} J");
}

#[test]
fn rk4_accounts_for_energy_with_memory_friction_and_a_moving_base() {
    let mut experiment = smooth(4.0);
    experiment.effects = several_effects();
    let (error, exchanged) = unexplained(&run(&experiment));
    println!("several effects: {error:e} of {exchanged} J");
    assert!(error < 1e-8 * 4.0 * exchanged, "{error:e} of {exchanged} J");
}

#[test]
fn rk4_accounts_for_energy_on_a_path_with_jumps_of_acceleration() {
    let recording = run(&models::human_experiment(4.0, [0.0; 3]).expect("a sample"));
    let (error, exchanged) = unexplained(&recording);
    println!("trapezoid: {error:e} of {exchanged} J");
    assert!(error < 1e-9 * 4.0 * exchanged, "{error:e} of {exchanged} J");
}

#[test]
fn semi_implicit_euler_accounts_for_energy_to_first_order() {
    let mut experiment = smooth(4.0);
    experiment.integrator = Integrator::SemiImplicitEuler;
    let (error, exchanged) = unexplained(&run(&experiment));
    println!("euler: {error:e} of {exchanged} J");
    assert!(error < 2e-4 * exchanged, "{error:e} of {exchanged} J");
}

/// All torques of the equation of motion cancel at every sample, with a moving base too.
#[test]
fn the_torques_balance_at_every_sample() {
    let mut experiment = smooth(1.0);
    experiment.effects = several_effects();
    experiment
        .effects
        .push(Effect::new(Kind::Tremor, 2).with(&[0.1, 5.0]));
    let r = run(&experiment);
    let t = &r.torque;
    for i in 0..t.inertial.len() {
        let left = t.inertial[i]
            + t.centrifugal[i]
            + t.coriolis[i]
            + t.gravity[i]
            + t.frame[i]
            + t.resisting[i];
        let imbalance = left - t.drive[i] - t.contact[i];
        assert!(imbalance.abs() < 1e-9, "entry {i}: {imbalance:e} N m");
    }
}
