use crate::filter::column;
use crate::noise::{Noise, gap};
use arm_numerics::NumericsError;
use arm_numerics::signal::derivative::{SavitzkyGolay, SavitzkyGolayOptions, first, second};

fn options(window: usize, degree: usize, derivative: usize, step: f64) -> SavitzkyGolayOptions {
    SavitzkyGolayOptions {
        half_width: window / 2,
        degree,
        derivative,
        step,
    }
}

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
    let filter = SavitzkyGolay::new(options(9, 2, 1, step)).expect("in range");
    let smooth = sd(&filter.apply(&y).expect("many")) / filter.noise_gain();
    for ratio in [slope, bend, smooth] {
        assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
    }
}

/// scipy 1.17.1: samples 0, 2, 30, 59 of `savgol_filter(column, window, degree, deriv, delta, mode="interp")` and the norm of `savgol_coeffs`.
#[test]
fn savitzky_golay_equals_scipy() {
    let x = column();
    for (given, picked, gain) in [
        (
            options(7, 3, 0, 0.02),
            [
                -0.8557142857142854,
                -0.05714285714285672,
                0.9266666666666674,
                1.2757142857142867,
            ],
            0.5773502691896262,
        ),
        (
            options(7, 3, 1, 0.02),
            [
                27.17857142857147,
                12.74999999999998,
                14.3531746031746,
                1.928571428571417,
            ],
            25.620603894431223,
        ),
        (
            options(9, 4, 2, 0.02),
            [
                -1224.242424242434,
                -612.121212121213,
                -544.4347319347418,
                2230.71095571102,
            ],
            1108.1630957469426,
        ),
        (
            options(5, 2, 2, 0.5),
            [
                -1.1542857142857148,
                -1.1542857142857141,
                -1.1542857142857152,
                -1.1542857142857146,
            ],
            2.138089935299395,
        ),
    ] {
        let filter = SavitzkyGolay::new(given).expect("in range");
        let y = filter.apply(&x).expect("long enough");
        let found: Vec<f64> = [0, 2, 30, 59].iter().map(|&i| y[i]).collect();
        assert!(
            gap(&found, &picked) < 1e-10 * f64::max(gain, 1.0),
            "{given:?}: {found:?}"
        );
        assert!((filter.noise_gain() / gain - 1.0).abs() < 1e-11);
    }
}

#[test]
fn refuses_bad_windows_and_columns() {
    for bad in [
        options(1, 0, 0, 1.0),
        options(5, 5, 0, 1.0),
        options(5, 2, 3, 1.0),
        options(5, 2, 1, 0.0),
        options(5, 2, 1, f64::NAN),
    ] {
        assert!(matches!(
            SavitzkyGolay::new(bad),
            Err(NumericsError::OutOfRange { .. })
        ));
    }
    let filter = SavitzkyGolay::new(options(5, 2, 1, 1.0)).expect("in range");
    assert!(filter.apply(&[0.0; 4]).is_err());
    assert!(filter.apply(&[f64::NAN; 9]).is_err());
    assert!(first(&[0.0; 2], 1.0).is_err());
    assert!(second(&[0.0; 3], 1.0).is_err());
    assert!(first(&[0.0; 5], 0.0).is_err());
    assert!(first(&[0.0, 1.0, f64::INFINITY], 1.0).is_err());
}
