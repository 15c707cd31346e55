//! The experiments of tables 4.9 and 4.10 for a minute, and the sign that the thesis prints.

use arm_core::effect::{Effect, Kind};
use arm_core::{Invalid, Shape, sample_arms};
use arm_sim::{Drive, Experiment, HandlePath, Movement, SimulationError, simulate};

use crate::common::{largest, run};

/// There and back every 4 s for a minute.
fn minute<const N: usize>(mut experiment: Experiment<N>, poses: [[f64; N]; 2]) -> Experiment<N> {
    let arm = experiment.setup.chain().expect("a sample arm");
    let [from, to] = poses.map(|q| q.map(f64::to_radians).into());
    let waypoints: Vec<_> = (0..31)
        .map(|i| if i % 2 == 0 { from } else { to })
        .collect();
    let movement = Movement::timed(Shape::Smooth, &waypoints, &[2.0; 30], 0.5).expect("a movement");
    if let Drive::Handle { path, .. } = &mut experiment.drive {
        *path = HandlePath::of_arm(arm, movement);
    }
    experiment.duration = 60.0;
    experiment.output_interval = Some(4.0);
    experiment
}

/// The state after each period against that before it, and the energy that nothing explains.
fn does_not_drift<const N: usize>(experiment: &Experiment<N>) {
    let r = run(experiment);
    let period = |i: usize| &r.q[N * i..N * (i + 1)];
    let apart = |a: usize, b: usize| largest(period(a), period(b));
    // The transient of the start dies out; later periods are equal.
    let (early, late) = (apart(1, 15), apart(14, 15));
    let error = r.energy_error();
    println!(
        "N = {N}: {early:e} rad over 56 s, {late:e} rad in the last period, energy {:e} J",
        error[15]
    );
    assert!(early < 1e-6, "state after 4 s and 60 s: {early:e} rad");
    assert!(late < 1e-9, "state after 56 s and 60 s: {late:e} rad");
    assert!(
        error[15].abs() < 1e-6,
        "unexplained energy {:e} J",
        error[15]
    );
    let growth = (error[15] - error[8]).abs();
    assert!(
        growth < 2.0 * (error[8] - error[1]).abs() + 1e-9,
        "energy error grows by {growth:e} J"
    );
}

#[test]
fn the_mechanical_arm_runs_for_a_minute() {
    let rest = [(-50.0f64).to_radians(), 65f64.to_radians()];
    let experiment =
        arm_sim::sample_experiments::mechanical_experiment(4.0, rest).expect("a sample");
    does_not_drift(&minute(experiment, [[-60.0, 50.0], [-40.0, 80.0]]));
}

#[test]
fn the_human_arm_runs_for_a_minute() {
    let rest = [-62.0f64, 60.0, 5.0].map(f64::to_radians);
    let experiment = arm_sim::sample_experiments::human_experiment(4.0, rest).expect("a sample");
    does_not_drift(&minute(
        experiment,
        [[-68.0, 40.0, 0.0], [-56.0, 80.0, 5.0]],
    ));
}

/// Errata 16: K_v = −0.2 is negative damping. As a viscosity it is refused.
#[test]
fn the_printed_sign_of_viscosity_is_refused() {
    let mut experiment =
        arm_sim::sample_experiments::human_experiment(4.0, [0.0; 3]).expect("a sample");
    experiment.effects[0] = Effect::new(Kind::Viscous, 0).with(&[-0.2]);
    let refused = simulate(&experiment).expect_err("negative damping");
    assert!(
        matches!(refused, SimulationError::Invalid(Invalid::OutOfRange { name: "viscosity", found, .. }) if found == -0.2),
        "{refused}"
    );
}

/// Errata 15: with the printed sign of the spring force the contact pushes away. The linearised arm then grows by
/// e^(ωt); here a spring of the arm itself is negative, with the largest value that the catalogue allows.
#[test]
fn a_destabilising_spring_leaves_the_path() {
    let poses = ([-40.0, 50.0, 5.0], [-40.0, 50.0, 5.0]);
    let mut experiment = arm_sim::sample_experiments::led(
        sample_arms::human_arm(),
        Shape::Smooth,
        poses,
        4.0,
        [-0.7, 0.87, 0.087],
    )
    .expect("a sample");
    experiment.output_interval = Some(0.02);
    let stays = run(&experiment);
    for effect in &mut experiment.effects {
        if effect.kind == Kind::Elastic {
            effect.parameters[0] = -10.0;
        }
    }
    experiment.start = arm_sim::Start::Given {
        q: [-0.7, 0.87, 0.088].into(),
        qd: [0.0; 3].into(),
    };
    let leaves = run(&experiment);
    let moved = |r: &arm_sim::Recording<3>| (r.q[3 * (r.len() - 1) + 2] - r.q[2]).abs();
    assert!(moved(&stays) < 1e-6, "{}", moved(&stays));
    assert!(moved(&leaves) > 0.1, "{}", moved(&leaves));
}
