//! Shared by the tests of the joint method: input, and access to results.

use arm_core::{Chain, Segment, sample_arms};
use arm_ident::inference::estimate::{Estimate, Identified};
use arm_ident::inference::joint_method::{MotionSource, Options};

use super::synthetic::EXACT;

pub fn exactly() -> Options {
    Options {
        cutoff: Some(20.0),
        motion: MotionSource::Measured,
        tolerance: EXACT,
        ..Options::default()
    }
}

pub fn human() -> Chain<f64, 3> {
    let arm = sample_arms::human_arm();
    let segments: [Segment<f64>; 3] = core::array::from_fn(|k| Segment {
        inertia: [0.0155, 0.0055, 0.0012][k],
        ..arm.segments()[k]
    });
    Chain::new(segments, arm.base(), arm.gravity()).expect("a valid arm")
}

/// The name of an estimate among those of all effects: `coulomb1 torque`.
fn printed(e: &Estimate) -> String {
    match (e.kind.as_str(), e.joint) {
        ("segment" | "combination" | "calibration", _) | (_, None) => e.name.clone(),
        (kind, Some(joint)) => format!("{kind}{joint} {}", e.name),
    }
}

pub fn named<'a, const N: usize>(result: &'a Identified<N>, name: &str) -> &'a Estimate {
    result
        .parameters
        .iter()
        .chain(&result.combinations)
        .chain(&result.calibration)
        .find(|e| printed(e) == name)
        .unwrap_or_else(|| panic!("nothing is called {name}"))
}

pub fn close(found: f64, truth: f64, relative: f64) {
    assert!(
        (found - truth).abs() <= relative * truth.abs().max(1e-3),
        "{found} instead of {truth}"
    );
}

pub fn two_factors() -> [[f64; 3]; 2] {
    [[1.1, 0.92, 0.8], [0.9, 1.08, 1.3]]
}

pub fn rms<const N: usize>(result: &Identified<N>, trial: usize) -> f64 {
    let explained = &result.explained[trial];
    let pairs = explained.measured.iter().zip(&explained.fitted);
    let sum: f64 = pairs.map(|(m, f)| (m - f).norm_squared()).sum();
    (sum / (explained.measured.len() * N) as f64).sqrt()
}
