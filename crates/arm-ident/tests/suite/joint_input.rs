//! What the joint method may not depend on: gaps, test trials, the start; and what it refuses.

use super::joint_method::{close, exactly, two_factors};
use super::noise::Noise;
use super::synthetic::{Recipe, at_every_joint, effect, sines, wrong};
use arm_core::sample_arms;
use arm_ident::IdentError;
use arm_ident::inference::joint_method::{MotionSource, Options, identify};
use arm_ident::regression::trial::{Model, Role, Tolerance, Trial};

#[test]
fn what_stands_in_a_gap_has_no_influence() {
    let truth = sample_arms::mechanical_arm();
    let mut recipe = Recipe::new(truth);
    recipe.rate = 200.0;
    let mut trial = recipe.torque_trial(&sines([-0.6, 1.2], 0.3, 1.0), &[]);
    let gap = 900..1000;
    gap.clone().for_each(|i| trial.valid[i] = false);
    let model = wrong(&truth, two_factors(), 0.3);
    let clean = identify(&model, std::slice::from_ref(&trial), &exactly()).expect("a solution");
    let mut spoilt = trial.clone();
    for torque in &mut spoilt.torque.as_mut().expect("torques")[gap.start + 45..gap.end - 45] {
        torque.apply(|v| *v += 12.0);
    }
    let masked = identify(&model, std::slice::from_ref(&spoilt), &exactly()).expect("a solution");
    for (a, b) in clean.combinations.iter().zip(&masked.combinations) {
        close(a.value, b.value, 2e-4);
    }
    let margin = (200.0 / 20.0 / 2.0) as usize;
    let near = |i: &usize| *i + margin > gap.start && *i < gap.end + margin;
    assert_eq!(
        masked.explained[0]
            .samples
            .iter()
            .filter(|i| near(i))
            .count(),
        0
    );
    spoilt.valid.fill(true);
    let unmasked = identify(&model, &[spoilt], &exactly()).expect("a solution");
    let moved = (unmasked.combinations[0].value / clean.combinations[0].value - 1.0).abs();
    assert!(moved > 1e-3, "the gap would not have mattered: {moved}");
}

#[test]
fn test_trials_change_no_bit_of_the_estimate() {
    let truth = sample_arms::mechanical_arm();
    let mut recipe = Recipe::new(truth);
    recipe.rate = 200.0;
    recipe.force = Some(|t| [1.0 + libm::sin(t), 2.0 * libm::cos(0.7 * t)]);
    let effects = [
        effect("coulomb", 0, &[0.1, 0.1]),
        effect("viscous", 1, &[0.1]),
    ];
    let fit = recipe.torque_trial(&sines([-0.6, 1.2], 0.3, 1.0), &effects);
    let mut model = wrong(&truth, two_factors(), 0.3);
    model.fitted = at_every_joint::<2>(&["coulomb", "viscous"]);
    let options = Options {
        cutoff: None,
        motion: MotionSource::Auto,
        tolerance: Tolerance::default(),
        ..Options::default()
    };
    let alone = identify(&model, std::slice::from_ref(&fit), &options).expect("a solution");
    // Another movement, another arm, noise, no force: none of it may have an effect.
    let mut test = Recipe {
        force: None,
        ..recipe
    }
    .torque_trial(&sines([0.3, 0.5], 0.6, 2.0), &[]);
    let mut noise = Noise::new(1);
    test.q
        .iter_mut()
        .for_each(|q| q.apply(|v| *v += 0.01 * noise.normal()));
    test.role = Role::Test;
    test.configuration = 1;
    let both = identify(&model, &[test, fit], &options).expect("a solution");
    assert_eq!(alone.parameters, both.parameters);
    assert_eq!(alone.combinations, both.combinations);
    assert_eq!(alone.calibration, both.calibration);
    assert_eq!(alone.explained[0], both.explained[1]);
    assert_eq!(
        (alone.cutoff, alone.rank, &alone.trades),
        (both.cutoff, both.rank, &both.trades)
    );
    assert_eq!(both.explained.len(), 2);
}

#[test]
fn the_same_input_gives_the_same_bits() {
    let truth = sample_arms::mechanical_arm();
    let mut recipe = Recipe::new(truth);
    recipe.rate = 200.0;
    let trial = recipe.force_trial(
        &sines([-0.6, 1.2], 0.3, 1.0),
        &[effect("coulomb", 0, &[0.1, 0.1])],
    );
    let mut model = wrong(&truth, two_factors(), 0.3);
    model.fitted = at_every_joint::<2>(&["coulomb", "elastic"]);
    let options = Options::default();
    let run = || identify(&model, std::slice::from_ref(&trial), &options).expect("a solution");
    let (first, second) = (run(), run());
    assert_eq!(first.parameters, second.parameters);
    assert_eq!(first.explained, second.explained);
}

#[test]
fn the_start_does_not_matter() {
    // Rounds of linearising converge: started from the estimate itself, with the same prior's width, nothing moves.
    let truth = sample_arms::mechanical_arm();
    let mut recipe = Recipe::new(truth);
    recipe.rate = 200.0;
    let path = sines([-0.6, 1.2], 0.3, 1.0);
    let mut trial = recipe.force_trial(&path, &[]);
    trial.q.iter_mut().for_each(|q| q[0] += 0.005);
    let mut noise = Noise::new(4);
    for force in trial.force_on_arm.iter_mut().flatten() {
        *force = force.map(|f| f + 0.1 * noise.normal());
    }
    let options = Options {
        tolerance: Tolerance::default(),
        ..exactly()
    };
    let from = |factors| {
        let model: Model<2> = wrong(&truth, factors, 0.3);
        identify(&model, std::slice::from_ref(&trial), &options).expect("a solution")
    };
    let (near, far) = (
        from([[1.0; 3]; 2]),
        from([[1.3, 0.8, 0.7], [0.75, 1.25, 1.3]]),
    );
    for (a, b) in near.combinations[..2].iter().zip(&far.combinations) {
        assert!(
            (a.value - b.value).abs() < 0.5 * a.std,
            "{} against {}",
            a.value,
            b.value
        );
    }
}

#[test]
fn what_cannot_be_used_is_refused() {
    let truth = sample_arms::mechanical_arm();
    let mut recipe = Recipe::new(truth);
    recipe.rate = 200.0;
    let trial = recipe.torque_trial(&sines([-0.6, 1.2], 0.3, 1.0), &[]);
    let model = wrong(&truth, two_factors(), 0.3);
    let refused = |model: &Model<2>, trials: &[Trial<2>], options: &Options| -> String {
        identify(model, trials, options)
            .err()
            .map(|e: IdentError| e.to_string())
            .unwrap_or_default()
    };
    assert_eq!(
        refused(&model, std::slice::from_ref(&trial), &exactly()),
        ""
    );

    let mut test = trial.clone();
    test.role = Role::Test;
    assert_eq!(
        refused(&model, &[test], &exactly()),
        "trials with role fit: found 0, expected at least 1"
    );
    let mut short = trial.clone();
    short.q.truncate(12);
    short.torque.as_mut().expect("torques").truncate(12);
    short.valid.truncate(12);
    assert!(
        refused(&model, &[short], &exactly())
            .contains("samples of column: found 12, expected at least")
    );
    let mut masked = trial.clone();
    masked.valid.fill(false);
    assert_eq!(
        refused(&model, &[masked], &exactly()),
        "usable stretches of data: found 0, expected at least 2"
    );
    let nothing = wrong(&truth, two_factors(), 0.0);
    assert_eq!(
        refused(&nothing, std::slice::from_ref(&trial), &exactly()),
        "unknowns: found 0, expected at least 1"
    );
    let options = Options {
        cutoff: Some(100.0),
        ..exactly()
    };
    assert!(
        refused(&model, std::slice::from_ref(&trial), &options)
            .starts_with("cutoff_hz / rate_hz is 0.5")
    );
    let options = Options {
        motion: MotionSource::Simulated,
        ..exactly()
    };
    assert!(refused(&model, &[trial], &options).contains("robot angles in every trial"));
}
