//! Lanes and threads have the bits of single runs.

use arm_core::effect::{Effect, Kind};
use arm_core::{Limits, Shape, sample_arms};
use arm_sim::{
    Coupling, Drive, Experiment, HandlePath, Integrator, Interpolation, Movement, Series,
    SimulationError, Start, digest, simulate, simulate_batch,
};

use crate::common::{several_effects, smooth};

/// The experiment with values that differ from run to run.
fn perturbed(base: &Experiment<3>, runs: usize) -> Vec<Experiment<3>> {
    (0..runs)
        .map(|i| {
            let mut e = base.clone();
            let scale = 1.0 + 0.01 * i as f64;
            for segment in &mut e.setup.segments {
                segment.mass *= scale;
                segment.inertia *= scale;
            }
            if let Some(effect) = e.effects.first_mut() {
                effect.parameters[0] *= scale;
            }
            e.setup.contact.stiffness[1] *= scale;
            e
        })
        .collect()
}

fn same_bits(experiments: &[Experiment<3>], threads: usize) {
    let batch = simulate_batch(experiments, threads);
    assert_eq!(batch.len(), experiments.len());
    for (i, (many, one)) in batch
        .iter()
        .zip(experiments.iter().map(simulate))
        .enumerate()
    {
        match (many, one) {
            (Ok(many), Ok(one)) => {
                assert_eq!(digest(many), digest(&one), "run {i} of {threads} threads");
                assert_eq!(many, &one);
            }
            (many, one) => assert_eq!(many.as_ref().err(), one.as_ref().err(), "run {i}"),
        }
    }
}

#[test]
fn reflexes_that_are_late_and_at_once_run_side_by_side() {
    for integrator in [Integrator::SemiImplicitEuler, Integrator::Rk4] {
        let mut runs = perturbed(&smooth(0.25), 8);
        for (i, run) in runs.iter_mut().enumerate() {
            run.integrator = integrator;
            let latency = 0.02 * (i % 4) as f64;
            let reflex = Effect::new(Kind::StretchReflex, 1).with(&[0.8, 0.02, 0.0, latency]);
            run.effects = vec![reflex];
        }
        same_bits(&runs, 1);
        // The last of three states has the excess itself for its goal; all of an early one stay zero.
        let [early, late] = [&runs[0], &runs[3]].map(|run| simulate(run).unwrap().memory);
        assert!(early.iter().all(|state| *state == 0.0) && late.iter().any(|s| s.abs() > 0.01));
    }
}

#[test]
fn lanes_have_the_bits_of_single_runs() {
    for integrator in [Integrator::SemiImplicitEuler, Integrator::Rk4] {
        let mut base = smooth(0.25);
        base.integrator = integrator;
        same_bits(&perturbed(&base, 8), 1);
        base.effects = several_effects();
        same_bits(&perturbed(&base, 11), 1);
    }
}

#[test]
fn lanes_have_the_bits_of_single_runs_with_a_rigid_coupling() {
    let mut base = smooth(0.25);
    if let Drive::Handle { coupling, .. } = &mut base.drive {
        *coupling = Coupling::Rigid;
    }
    base.start = Start::Given {
        q: [-68f64, 40.0, 0.0].map(f64::to_radians).into(),
        qd: [0.0; 3].into(),
    };
    let mut experiments = perturbed(&base, 5);
    same_bits(&experiments, 1);
    for e in &mut experiments {
        e.effects = several_effects();
    }
    same_bits(&experiments, 1);
}

/// Ramps that end inside of steps, in each lane of another one, and torques that jump.
#[test]
fn lanes_have_the_bits_of_single_runs_where_drives_break() {
    let arm = sample_arms::human_arm();
    let [from, to] = [[-68f64, 40.0, 0.0], [-66.0, 43.0, 1.0]].map(|q| q.map(f64::to_radians));
    for coupling in [Coupling::Compliant, Coupling::Rigid] {
        let mut base = smooth(0.25);
        base.effects = several_effects();
        let mut experiments = perturbed(&base, 8);
        for (i, e) in experiments.iter_mut().enumerate() {
            let limits = [Limits {
                speed: 0.9 + 0.01 * i as f64,
                acceleration: 7.0,
            }; 3];
            let waypoints = [from.into(), to.into()];
            let movement = Movement::within(Shape::Trapezoid, &waypoints, &limits, 0.0);
            e.drive = Drive::Handle {
                path: HandlePath::of_arm(arm, movement.expect("limits")),
                coupling,
            };
            e.start = Start::Given {
                q: from.into(),
                qd: [0.0; 3].into(),
            };
        }
        same_bits(&experiments, 1);
        for (i, e) in experiments.iter_mut().enumerate() {
            let times: Vec<f64> = (0..10)
                .map(|k| (0.03 + 1e-3 * i as f64) * f64::from(k))
                .collect();
            let values: Vec<[f64; 3]> = (0..10).map(|k| [f64::from(k), -1.0, 0.5]).collect();
            let held = Series::new("torque", &times, &values, Interpolation::Hold);
            e.drive = Drive::Torque(Some(held.expect("samples")));
        }
        same_bits(&experiments, 1);
    }
}

#[test]
fn the_result_does_not_depend_on_the_number_of_threads() {
    let mut experiments = perturbed(&smooth(0.1), 37);
    experiments[3]
        .effects
        .push(Effect::new(Kind::Tremor, 1).with(&[0.2]));
    experiments[20].dt = -1.0;
    for threads in [1, 2, 3, 64] {
        same_bits(&experiments, threads);
    }
    assert!(simulate_batch::<3>(&[], 4).is_empty());
}

/// A lane that overflows stops with its own step and joint and leaves its neighbours alone.
#[test]
fn a_lane_that_diverges_does_not_touch_the_others() {
    let mut experiments = perturbed(&smooth(0.05), 8);
    experiments[5].start = Start::Given {
        q: [0.0; 3].into(),
        qd: [1e200, 0.0, 0.0].into(),
    };
    let batch = simulate_batch(&experiments, 1);
    assert!(matches!(
        batch[5],
        Err(SimulationError::Diverged { step: 1, .. })
    ));
    same_bits(&experiments, 1);
}

/// A run of a group may be the only one whose friction is not zero.
#[test]
fn friction_of_one_run_of_a_group_is_not_lost() {
    let mut experiments = perturbed(&smooth(0.05), 3);
    for (i, experiment) in experiments.iter_mut().enumerate() {
        let torque = if i == 1 { 0.3 } else { 0.0 };
        experiment.effects = vec![Effect::new(Kind::Coulomb, 0).with(&[torque, 0.0])];
    }
    same_bits(&experiments, 1);
}

#[test]
fn the_step_that_diverges_is_found_wherever_samples_are_taken() {
    for speed in [1e5, 1e10, 1e25, 1e50, 1e100] {
        let mut experiment = smooth(0.05);
        experiment.integrator = Integrator::SemiImplicitEuler;
        experiment.start = Start::Given {
            q: [0.0; 3].into(),
            qd: [speed, 0.0, 0.0].into(),
        };
        let step = |interval| {
            let mut run = experiment.clone();
            run.output_interval = interval;
            match simulate(&run) {
                Err(SimulationError::Diverged { step, .. }) => step,
                other => panic!("{other:?} from {speed} rad/s"),
            }
        };
        // After every step, and after many made at once.
        assert_eq!(step(None), step(Some(0.05)), "{speed} rad/s");
        assert!(step(None) > 1, "{speed} rad/s");
    }
}
