//! Runs whose step is found for an accuracy: what they promise, against ever shorter steps.

use core::ops::ControlFlow;

use arm_core::effect::{Effect, Kind};
use arm_sim::{
    Columns, Experiment, Integrator, Resolved, Sensors, SimulationError, digest, resolve,
    sample_experiments, simulate, simulate_accurately, simulate_batch,
};

use crate::common::{largest, run, several_effects, smooth};

/// As `resolve`, never broken off.
fn step_of<const N: usize>(
    experiment: &Experiment<N>,
    accuracy: f64,
) -> Result<Resolved, SimulationError> {
    let found = resolve(experiment, accuracy, &mut || ControlFlow::Continue(()))?;
    Ok(found.expect("not broken off"))
}

fn sampled<const N: usize>(mut experiment: Experiment<N>) -> Experiment<N> {
    experiment.output_interval = Some(0.02);
    experiment
}

/// Largest error of the angles that an accuracy leads to, estimated and against a run with a much shorter step.
fn errors<const N: usize>(experiment: &Experiment<N>, accuracy: f64, finer: f64) -> [f64; 3] {
    let one = core::slice::from_ref(experiment);
    let (recording, resolved) = simulate_accurately(one, accuracy, 1)
        .remove(0)
        .expect("runs");
    let mut reference = experiment.clone();
    reference.integrator = Integrator::Rk4;
    reference.dt = resolved.dt / finer;
    [
        resolved.error,
        largest(&recording.q, &run(&reference).q),
        resolved.dt,
    ]
}

#[test]
fn angles_are_right_to_what_was_asked_for_and_the_estimate_is_close() {
    for (experiment, name) in [
        (
            sampled(sample_experiments::human_experiment(4.0, [0.0; 3]).expect("valid")),
            "human",
        ),
        (sampled(smooth(2.0)), "smooth"),
    ] {
        for accuracy in [1e-5, 1e-6, 1e-7, 1e-8] {
            let [estimated, found, dt] = errors(&experiment, accuracy, 8.0);
            println!("{name} {accuracy:e}: estimated {estimated:e}, found {found:e}, step {dt:e}");
            assert!(estimated <= accuracy && found <= accuracy);
            assert!((0.5..2.0).contains(&(estimated / found)));
        }
    }
}

#[test]
fn where_something_is_not_smooth_the_accuracy_is_kept_too() {
    let mut experiment = sampled(smooth(2.0));
    experiment.effects = several_effects();
    for accuracy in [1e-4, 1e-6] {
        let [estimated, found, dt] = errors(&experiment, accuracy, 32.0);
        println!("several {accuracy:e}: estimated {estimated:e}, found {found:e}, step {dt:e}");
        assert!(estimated <= accuracy && found <= accuracy);
    }
    let mut dry = sampled(sample_experiments::human_experiment(2.0, [0.0; 3]).expect("valid"));
    for joint in 0..3 {
        dry.effects
            .push(Effect::new(Kind::Coulomb, joint).with(&[0.3, 0.0]));
    }
    for accuracy in [1e-4, 1e-6] {
        let [estimated, found, dt] = errors(&dry, accuracy, 16.0);
        println!("dry {accuracy:e}: estimated {estimated:e}, found {found:e}, step {dt:e}");
        assert!(estimated <= accuracy && found <= accuracy);
    }
}

#[test]
fn it_is_the_run_of_the_step_that_it_tells() {
    let experiment = sampled(sample_experiments::human_experiment(2.0, [0.0; 3]).expect("valid"));
    let one = core::slice::from_ref(&experiment);
    let (recording, resolved) = simulate_accurately(one, 1e-6, 1).remove(0).expect("runs");
    let mut again = experiment.clone();
    (again.integrator, again.dt) = (Integrator::Rk4, resolved.dt);
    assert_eq!(digest(&recording), digest(&simulate(&again).expect("runs")));
    assert_eq!(step_of(&experiment, 1e-6).expect("runs"), resolved);
}

#[test]
fn a_run_has_the_same_bits_alone_and_beside_others() {
    let runs: Vec<_> = (0..11)
        .map(|i| {
            let mut run =
                sampled(sample_experiments::human_experiment(1.0, [0.0; 3]).expect("valid"));
            // From soft to so stiff that another step is found.
            run.setup.contact.stiffness = [1e3 * f64::from(1 + i * i); 2];
            run
        })
        .collect();
    let beside = simulate_accurately(&runs, 1e-6, 2);
    let mut steps: Vec<f64> = Vec::new();
    for (run, beside) in runs.iter().zip(beside) {
        let (recording, resolved) = beside.expect("runs");
        let one = core::slice::from_ref(run);
        let (alone, found) = simulate_accurately(one, 1e-6, 1).remove(0).expect("runs");
        assert_eq!(digest(&recording), digest(&alone));
        assert_eq!(resolved, found);
        steps.push(resolved.dt);
    }
    steps.dedup();
    assert!(steps.len() > 1, "{steps:?}");
}

#[test]
fn what_cannot_be_reached_is_refused() {
    let experiment = sampled(sample_experiments::human_experiment(0.1, [0.0; 3]).expect("valid"));
    let refused = step_of(&experiment, 1e-18).expect_err("beyond rounding");
    let SimulationError::Accuracy {
        requested, reached, ..
    } = refused
    else {
        panic!("{refused}");
    };
    assert!(requested < reached && reached < 1e-9, "{refused}");
    for accuracy in [0.0, -1.0, f64::NAN] {
        assert!(matches!(
            step_of(&experiment, accuracy),
            Err(SimulationError::Setting {
                name: "accuracy",
                ..
            })
        ));
    }
    let mut unsampled = experiment;
    unsampled.output_interval = None;
    assert!(matches!(
        step_of(&unsampled, 1e-6),
        Err(SimulationError::Setting {
            name: "output interval",
            ..
        })
    ));
}

#[test]
fn a_search_can_be_broken_off() {
    let experiment = sampled(sample_experiments::human_experiment(2.0, [0.0; 3]).expect("valid"));
    let mut calls = 0;
    let found = resolve(&experiment, 1e-6, &mut || {
        calls += 1;
        ControlFlow::Break(())
    });
    assert_eq!((found, calls), (Ok(None), 1));
}

#[test]
fn a_contact_too_stiff_for_the_shortest_step_is_called_that() {
    let mut experiment =
        sampled(sample_experiments::human_experiment(0.1, [0.0; 3]).expect("valid"));
    experiment.setup.contact.stiffness = [1e15; 2];
    let refused = step_of(&experiment, 1e-6).expect_err("too stiff");
    assert!(
        matches!(refused, SimulationError::TooStiff { .. }),
        "{refused}"
    );
}

#[test]
fn motion_alone_has_the_bits_of_all_columns() {
    let mut experiment =
        sampled(sample_experiments::human_experiment(1.0, [0.0; 3]).expect("valid"));
    let all = run(&experiment);
    experiment.columns = Columns::Motion;
    let alone = run(&experiment);
    assert_eq!(
        (&alone.time, &alone.q, &alone.qd),
        (&all.time, &all.q, &all.qd)
    );
    assert!(alone.force_on_arm.is_empty() && alone.robot_q.is_empty());
    assert!(alone.energy_error().is_empty());
    let read = Sensors::ideal().read(&experiment, &alone);
    assert!(matches!(read, Err(SimulationError::Samples { .. })));
    let runs = vec![experiment; 3];
    for beside in simulate_batch(&runs, 1) {
        assert_eq!(beside.expect("runs"), alone);
    }
}
