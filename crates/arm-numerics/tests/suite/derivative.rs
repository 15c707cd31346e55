use crate::noise::{Noise, gap};
use arm_numerics::signal::derivative::{first, second};

/// Central differences are exact for parabolas, ends included: y = 1 + 2t + 3t².
#[test]
fn differences_of_a_parabola() {
    let y: Vec<f64> = (0..9)
        .map(|i| 0.5 * i as f64)
        .map(|t| 1.0 + 2.0 * t + 3.0 * t * t)
        .collect();
    let slope: Vec<f64> = (0..9).map(|i| 2.0 + 3.0 * i as f64).collect();
    assert!(gap(&first(&y, 0.5).expect("nine"), &slope) < 1e-12);
    assert!(gap(&second(&y, 0.5).expect("nine"), &[6.0; 9]) < 1e-12);
}

#[test]
fn halving_the_step_quarters_the_error() {
    let error = |n: usize| {
        let step = 1.0 / n as f64;
        let y: Vec<f64> = (0..=n)
            .map(|i| libm::sin(3.0 * step * i as f64 + 0.7))
            .collect();
        let slope: Vec<f64> = (0..=n)
            .map(|i| 3.0 * libm::cos(3.0 * step * i as f64 + 0.7))
            .collect();
        let bend: Vec<f64> = y.iter().map(|y| -9.0 * y).collect();
        let slope_gap = gap(&first(&y, step).expect("many"), &slope);
        (slope_gap, gap(&second(&y, step).expect("many"), &bend))
    };
    let (coarse, fine) = (error(100), error(200));
    for ratio in [coarse.0 / fine.0, coarse.1 / fine.1] {
        assert!((3.7..4.3).contains(&ratio), "{ratio}");
    }
}

#[test]
fn noise_gains_are_as_documented() {
    let mut noise = Noise::new(31);
    let y: Vec<f64> = (0..200_000).map(|_| noise.normal()).collect();
    let sd = |v: &[f64]| (v.iter().map(|v| v * v).sum::<f64>() / v.len() as f64).sqrt();
    let step = 0.02;
    let slope = sd(&first(&y, step).expect("many")) * step * 2.0_f64.sqrt();
    let bend = sd(&second(&y, step).expect("many")) * step * step / 6.0_f64.sqrt();
    for ratio in [slope, bend] {
        assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
    }
}

#[test]
fn refuses_bad_columns() {
    assert!(first(&[0.0; 2], 1.0).is_err());
    assert!(second(&[0.0; 3], 1.0).is_err());
    assert!(first(&[0.0; 5], 0.0).is_err());
    assert!(first(&[0.0, 1.0, f64::INFINITY], 1.0).is_err());
}
