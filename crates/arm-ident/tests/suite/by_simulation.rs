//! Fits by simulation.

use arm_core::effect::{Effect, Kind};
use arm_ident::IdentError;
use arm_ident::inference::by_simulation::{Fit, Free, Recorded, fit};
use arm_numerics::NumericsError;
use arm_sim::{Experiment, Integrator, Recording, sample_experiments, simulate};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

/// Viscosity and stiffness of each joint, as the recorded arm has them.
const TRUE: [f64; 6] = [0.15, 0.4, 0.25, 0.6, 0.2, 0.5];
const ANGLE_NOISE: f64 = 1.7e-3;
const FORCE_NOISE: f64 = 0.2;

fn experiment(joints: [f64; 6]) -> Experiment<3> {
    let mut experiment =
        sample_experiments::human_experiment(2.0, [0.0; 3]).expect("a sample experiment");
    experiment.integrator = Integrator::SemiImplicitEuler;
    experiment.output_interval = Some(0.02);
    for (effect, value) in experiment.effects.iter_mut().zip(joints) {
        effect.parameters[0] = value;
    }
    experiment
}

fn free(max: f64) -> Vec<Free> {
    (0..6)
        .map(|effect| Free {
            effect,
            parameter: 0,
            min: 0.0,
            max,
        })
        .collect()
}

/// A recording as a fit takes it.
fn recorded(recording: &Recording<3>) -> Recorded<'_, 3> {
    Recorded {
        q: &recording.q,
        force_on_arm: &recording.force_on_arm,
        angle_noise: [ANGLE_NOISE; 3],
        force_noise: [FORCE_NOISE; 2],
    }
}

fn fitted(recording: &Recording<3>, start: [f64; 6], max: f64) -> Result<Fit, IdentError> {
    fit(&experiment(start), &recorded(recording), &free(max), 1)
}

#[test]
fn exact_records_give_back_what_made_them() {
    let recording = simulate(&experiment(TRUE)).expect("runs");
    let found = fitted(&recording, [0.1, 1.0, 0.1, 1.0, 0.1, 1.0], 20.0).expect("a fit");
    assert!(found.settled);
    for (value, expected) in found.values.iter().zip(TRUE) {
        assert!((value - expected).abs() < 1e-5, "{value} for {expected}");
    }
    assert!(found.squares < 1e-6, "{}", found.squares);
}

/// What an experiment shows, with noise.
fn noisy(experiment: &Experiment<3>, seed: u64) -> Recording<3> {
    let mut recording = simulate(experiment).expect("runs");
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    // The sum of twelve even numbers: nearly normal, of unit variance.
    let mut noise = || {
        (0..12)
            .map(|_| (rng.next_u64() >> 11) as f64 / (1_u64 << 53) as f64)
            .sum::<f64>()
            - 6.0
    };
    recording
        .q
        .iter_mut()
        .for_each(|v| *v += ANGLE_NOISE * noise());
    recording
        .force_on_arm
        .iter_mut()
        .for_each(|v| *v += FORCE_NOISE * noise());
    recording
}

/// Derivatives by differences of a run of 80 000 steps promise a reduction that rounding does not keep.
#[test]
fn no_round_is_spent_on_steps_that_rounding_refuses() {
    let long = |joints| {
        let mut experiment = experiment(joints);
        experiment.duration = 20.0;
        experiment
    };
    let recording = noisy(&long(TRUE), 0);
    let start = long([0.1, 1.0, 0.1, 1.0, 0.1, 1.0]);
    let found = fit(&start, &recorded(&recording), &free(20.0), 1).expect("a fit");
    assert!(found.settled && found.rounds < 9, "{} rounds", found.rounds);
}

#[test]
fn noise_moves_the_estimate_by_its_standard_deviations() {
    let recording = noisy(&experiment(TRUE), 3);
    let found = fitted(&recording, [0.1, 1.0, 0.1, 1.0, 0.1, 1.0], 20.0).expect("a fit");
    assert_eq!(found.residuals, 101 * 5);
    assert!(
        (found.squares / 499.0 - 1.0).abs() < 0.25,
        "{}",
        found.squares
    );
    for ((value, sd), expected) in found.values.iter().zip(&found.sd).zip(TRUE) {
        assert!(
            (value - expected).abs() < 4.0 * sd,
            "{value} ± {sd} for {expected}"
        );
    }
}

#[test]
fn bounds_hold_and_are_said() {
    let recording = simulate(&experiment(TRUE)).expect("runs");
    let found = fitted(&recording, [0.1; 6], 0.45).expect("a fit");
    assert_eq!(found.values[3], 0.45);
    assert_eq!(found.active[3], 1);
    assert!(found.values.iter().all(|&v| (0.0..=0.45).contains(&v)));
}

#[test]
fn a_rhythm_that_loses_its_amplitude_to_a_wrong_phase_is_found_again() {
    // Out of phase by more than a right angle, no amplitude fits better than any; at amplitude zero no phase is better than another.
    let rhythm = |amplitude, phase| {
        let mut run = experiment(TRUE);
        let effect = Effect::new(Kind::Tremor, 1).with(&[amplitude, 1.5, phase]);
        run.effects.push(effect);
        run
    };
    let recording = simulate(&rhythm(0.4, 0.0)).expect("runs");
    let recorded = recorded(&recording);
    let free = |parameter, [min, max]: [f64; 2]| Free {
        effect: 6,
        parameter,
        min,
        max,
    };
    let free = [free(0, [0.0, 20.0]), free(2, [-7.0, 7.0])];
    let found = fit(&rhythm(0.4, 2.5), &recorded, &free, 1).expect("a fit");
    assert_eq!(found.active, [0, 0]);
    assert!(found.squares < 1e-6, "{}", found.squares);
    assert!((found.values[0] - 0.4).abs() < 1e-5 && found.values[1].abs() < 1e-4);
}

#[test]
fn what_cannot_be_fitted_is_refused() {
    let recording = simulate(&experiment(TRUE)).expect("runs");
    let recorded = Recorded {
        q: &recording.q,
        force_on_arm: &recording.force_on_arm[2..],
        angle_noise: [ANGLE_NOISE; 3],
        force_noise: [FORCE_NOISE; 2],
    };
    let run = |recorded: &Recorded<3>, free: &[Free]| fit(&experiment(TRUE), recorded, free, 1);
    assert!(matches!(
        run(&recorded, &free(20.0)),
        Err(IdentError::Numerics(NumericsError::Length { .. }))
    ));
    assert!(matches!(
        run(&recorded, &[]),
        Err(IdentError::Numerics(NumericsError::TooFew { .. }))
    ));
    assert!(matches!(
        run(&recorded, &free(0.3)),
        Err(IdentError::Numerics(NumericsError::OutOfRange { .. }))
    ));
    let missing = Free {
        effect: 9,
        ..free(20.0)[0]
    };
    assert!(matches!(
        run(&recorded, &[missing]),
        Err(IdentError::Numerics(NumericsError::OutOfRange { .. }))
    ));
    let silent = Recorded {
        angle_noise: [0.0; 3],
        ..recorded
    };
    assert!(matches!(
        run(&silent, &free(20.0)),
        Err(IdentError::Numerics(NumericsError::OutOfRange { .. }))
    ));
}
