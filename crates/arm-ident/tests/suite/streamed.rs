//! Rows are built, filtered and thinned a stretch at a time: as of the whole trial, in memory that the samples bound.

use super::joint_method::{exactly, two_factors};
use super::noise::Noise;
use super::synthetic::{Recipe, at_every_joint, effect, sines, wrong};
use arm_core::{Joints, sample_arms};
use arm_ident::IdentError;
use arm_ident::inference::joint_method::identify;
use arm_ident::regression::measured_motion::low_pass;
use arm_ident::regression::preprocessing::filtered;
use arm_ident::regression::rows::RegressionRows;
use arm_ident::regression::trial::Trial;
use arm_numerics::NumericsError;

const RATE: f64 = 100.0;
const CUTOFF: f64 = 5.0;

/// Columns of two joints and a trial that is as long.
fn raw(samples: usize) -> (RegressionRows, Trial<2>) {
    let mut noise = Noise::new(3);
    let mut column = || noise.slow(0.99, 2 * samples);
    let rows = RegressionRows {
        columns: (0..3).map(|_| column()).collect(),
        rhs: column(),
        samples: (0..samples).collect(),
        fits: None,
        held: None,
    };
    let trial = Trial {
        valid: (0..samples).map(|i| i % 7000 != 3500).collect(),
        ..Trial::new(RATE, vec![Joints::zeros(); samples])
    };
    (rows, trial)
}

/// Gives the next rows of `all` at each call.
fn part_by_part(all: &RegressionRows) -> impl FnMut(usize) -> RegressionRows + '_ {
    let mut built = 0;
    move |count| {
        let samples = built..built + count;
        built += count;
        let part = |column: &Vec<f64>| column[2 * samples.start..2 * samples.end].to_vec();
        RegressionRows {
            columns: all.columns.iter().map(part).collect(),
            rhs: part(&all.rhs),
            samples: samples.collect(),
            fits: None,
            held: None,
        }
    }
}

/// Largest difference to columns that are filtered as a whole, relative to their largest value.
fn difference(samples: usize) -> f64 {
    let (all, trial) = raw(samples);
    let kept = filtered(&trial, CUTOFF, 3, part_by_part(&all)).expect("long enough");
    let filter = low_pass(CUTOFF, RATE).expect("in range");
    assert_eq!(kept.len(), 1 + (samples + 3499) / 7000);
    let mut worst = 0.0_f64;
    for (u, whole) in all.columns.iter().chain([&all.rhs]).enumerate() {
        for j in 0..2 {
            let channel: Vec<f64> = whole[j..].iter().step_by(2).copied().collect();
            let smooth = filter.both_ways(&channel).expect("long enough");
            let largest = smooth.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            for piece in &kept {
                let column = piece.columns.get(u).unwrap_or(&piece.rhs);
                assert_eq!(column.len(), 2 * piece.samples.len());
                for (value, &i) in column[j..].iter().step_by(2).zip(&piece.samples) {
                    worst = worst.max((value - smooth[i]).abs() / largest);
                }
            }
        }
    }
    worst
}

#[test]
fn stretches_are_filtered_like_the_whole() {
    assert_eq!(difference(5000), 0.0, "one stretch has the same bits");
    for samples in [8192, 20_001, 40_000] {
        let found = difference(samples);
        // What rings on for longer than the filter waits is below 2⁻⁶⁰; the rest is rounding.
        assert!(found < 1e-14, "{samples} samples: {found:e}");
    }
}

#[test]
fn what_is_not_finite_is_named_by_its_sample() {
    let (mut all, trial) = raw(20_000);
    all.columns[1][2 * 15_000 + 1] = f64::NAN;
    let refused = filtered(&trial, CUTOFF, 3, part_by_part(&all));
    assert!(
        matches!(
            refused,
            Err(IdentError::Numerics(NumericsError::NotFinite {
                index: 15_000,
                ..
            }))
        ),
        "{refused:?}"
    );
}

/// The samples, speeds and accelerations beside them, what is in work, and little more: the rows would take eleven times a sample.
#[test]
fn memory_is_bounded_by_the_samples() {
    let truth = sample_arms::mechanical_arm();
    let acting = [
        effect("coulomb", 0, &[0.1, 0.1]),
        effect("viscous", 1, &[0.1]),
    ];
    let mut model = wrong(&truth, two_factors(), 0.3);
    model.fitted = at_every_joint::<2>(&["coulomb", "viscous"]);
    let (mut most, mut samples) = (Vec::new(), Vec::new());
    for duration in [40.0, 120.0] {
        let mut recipe = Recipe::new(truth);
        recipe.duration = duration;
        let trials = [recipe.torque_trial(&sines([-0.6, 1.2], 0.3, 1.0), &acting)];
        samples.push(trials[0].len() as u64);
        for cutoff in [Some(20.0), None] {
            let mut options = exactly();
            options.cutoff = cutoff;
            let used = allocation_counter::measure(|| {
                identify(&model, &trials, &options).expect("a solution");
            });
            most.push(used.bytes_max);
        }
    }
    // Two angles and two torques.
    const SAMPLE: u64 = 4 * 8;
    for cutoff in 0..2 {
        let each = (most[2 + cutoff] - most[cutoff]) / (samples[1] - samples[0]);
        assert!(each < 4 * SAMPLE, "{each} bytes for each sample");
    }
}
