use crate::noise::{Noise, gap};
use arm_numerics::NumericsError;
use arm_numerics::statistics::autoregressive::{AutoRegression, Whitener, effective_samples};

const SECOND_ORDER: [f64; 2] = [1.2, -0.5];

/// `x_t = 1.2 x_{t−1} − 0.5 x_{t−2} + 0.3 e_t`, after its transient.
fn second_order(noise: &mut Noise, n: usize) -> Vec<f64> {
    let mut x = vec![0.0; n + 200];
    for t in 2..x.len() {
        x[t] = SECOND_ORDER[0] * x[t - 1] + SECOND_ORDER[1] * x[t - 2] + 0.3 * noise.normal();
    }
    x.split_off(200)
}

/// `(1/n) Σ_t x_t x_{t+k}` for `k = 0 … 5`.
fn autocovariance(x: &[f64]) -> Vec<f64> {
    let n = x.len();
    let product = |k: usize| x.iter().zip(&x[k..]).map(|(a, b)| a * b).sum::<f64>();
    (0..=5).map(|k| product(k) / n as f64).collect()
}

/// Variance of the mean of many samples times their number.
fn long_run_variance(model: &AutoRegression) -> f64 {
    let innovation = model.sd / (1.0 - model.coefficients.iter().sum::<f64>());
    innovation * innovation
}

/// The prediction errors of a series with missing samples, in units of their standard deviations.
fn with_gaps(whitener: &Whitener, spacing: &[usize], series: &[f64]) -> Vec<f64> {
    let one = |t: usize| {
        let before = spacing[..=t].iter().rev().take(whitener.order().min(t));
        let lags = before.scan(0, |lag, step| {
            *lag += step;
            Some(*lag)
        });
        let (factors, inverse) = whitener.predictor(&lags.collect::<Vec<usize>>());
        let past = series[..t].iter().rev();
        let foretold = factors.iter().zip(past).fold(0.0, |s, (a, v)| s + a * v);
        (series[t] - foretold) * inverse
    };
    (0..series.len()).map(one).collect()
}

#[test]
fn the_model_that_made_the_series_is_found() {
    let mut noise = Noise::new(61);
    let trials: Vec<Vec<f64>> = (0..5).map(|_| second_order(&mut noise, 4000)).collect();
    let series: Vec<&[f64]> = trials.iter().map(Vec::as_slice).collect();
    let fit = |series: &[&[f64]], most: usize| {
        AutoRegression::selected_about_zero(series, &[], most).expect("long enough")
    };
    let model = fit(&series, 2);
    assert!(gap(&model.coefficients, &SECOND_ORDER) < 0.02, "{model:?}");
    assert!((model.sd - 0.3).abs() < 0.005);
    // sd² / (1 − 1.2 + 0.5)² = 1
    assert!((long_run_variance(&model) - 1.0).abs() < 0.1);
    let selected = fit(&series, 8);
    assert!(
        (2..=4).contains(&selected.coefficients.len()),
        "{selected:?}"
    );
    let white: Vec<f64> = (0..2000).map(|_| noise.normal()).collect();
    let order = fit(&[&white], 8).coefficients.len();
    assert!(order <= 1, "{order}");
}

#[test]
fn whitening_makes_unit_white_noise_and_loses_no_sample() {
    let mut noise = Noise::new(62);
    let model = AutoRegression {
        coefficients: SECOND_ORDER.to_vec(),
        sd: 0.3,
    };
    let whitener = Whitener::new(&model).expect("stationary");
    let x = second_order(&mut noise, 20_000);
    let gamma = autocovariance(&with_gaps(&whitener, &vec![1; x.len()], &x));
    assert!((gamma[0] - 1.0).abs() < 0.03);
    assert!(gamma[1..].iter().all(|g| g.abs() < 0.03), "{gamma:?}");

    // The first samples too have unit variance: over many short trials.
    let mut power = [0.0; 4];
    for _ in 0..20_000 {
        let short = noise.slow(0.9, 4);
        let model = AutoRegression {
            coefficients: vec![0.9],
            sd: (1.0 - 0.81_f64).sqrt(),
        };
        let whitener = Whitener::new(&model).expect("stationary");
        let short = with_gaps(&whitener, &[1; 4], &short);
        power
            .iter_mut()
            .zip(short)
            .for_each(|(p, v)| *p += v * v / 20_000.0);
    }
    assert!(gap(&power, &[1.0; 4]) < 0.05, "{power:?}");
}

#[test]
fn where_samples_are_missing_the_others_are_whitened_with_what_is_known() {
    let model = AutoRegression {
        coefficients: SECOND_ORDER.to_vec(),
        sd: 0.3,
    };
    let whitener = Whitener::new(&model).expect("stationary");
    let mut noise = Noise::new(64);
    let whole = second_order(&mut noise, 40_000);
    // Runs of three samples with gaps of one to four between them.
    let mut spacing = Vec::new();
    let mut kept = Vec::new();
    let mut at = 0;
    for run in 0.. {
        let step = if run == 0 { 0 } else { 2 + run % 4 };
        if at + step + 3 > whole.len() {
            break;
        }
        at += step;
        kept.extend_from_slice(&whole[at..at + 3]);
        spacing.extend([step, 1, 1]);
        at += 2;
    }
    let white = with_gaps(&whitener, &spacing, &kept);
    let gamma = autocovariance(&white);
    assert!((gamma[0] - 1.0).abs() < 0.03, "{gamma:?}");
    assert!(gamma[1..].iter().all(|g| g.abs() < 0.03), "{gamma:?}");
    // Each run by itself: what the runs have in common is counted again and again.
    let apart: Vec<usize> = spacing
        .iter()
        .map(|&s| if s == 1 { 1 } else { 1000 })
        .collect();
    let again = with_gaps(&whitener, &apart, &kept);
    let gamma = autocovariance(&again);
    assert!(gamma[1..].iter().any(|g| g.abs() > 0.06), "{gamma:?}");
}

/// A first-order autoregression has no memory beyond the sample before, at whatever lag: the whitener is the exact one.
#[test]
fn after_a_gap_a_first_order_autoregression_is_predicted_from_the_sample_before_it() {
    let (rho, sd) = (0.9_f64, 0.5);
    let model = AutoRegression {
        coefficients: vec![rho],
        sd,
    };
    let whitener = Whitener::new(&model).expect("stationary");
    let column = with_gaps(&whitener, &[0, 1, 5, 2], &[1.0, 2.0, -1.0, 0.5]);
    let variance = sd * sd / (1.0 - rho * rho);
    let white = |value: f64, before: f64, lag: usize| {
        let r = [rho; 5][..lag].iter().product::<f64>();
        (value - r * before) / (variance * (1.0 - r * r)).sqrt()
    };
    let expected = [
        1.0 / variance.sqrt(),
        white(2.0, 1.0, 1),
        white(-1.0, 2.0, 5),
        white(0.5, -1.0, 2),
    ];
    assert!(gap(&column, &expected) < 1e-12, "{column:?}");
}

/// AR(1) with ρ = 0.9: `n (1 − ρ)/(1 + ρ) = n / 19`.
#[test]
fn slow_noise_counts_for_few_samples() {
    let mut noise = Noise::new(63);
    let n = 20_000;
    let effective = effective_samples(&noise.slow(0.9, n)).expect("long");
    assert!(
        (effective / (n as f64 / 19.0) - 1.0).abs() < 0.25,
        "{effective}"
    );
    let white: Vec<f64> = (0..n).map(|_| noise.normal()).collect();
    assert!(effective_samples(&white).expect("long") > 0.9 * n as f64);
    assert_eq!(effective_samples(&[2.0; 10]).expect("constant"), 1.0);
}

/// Means that were taken out of short series take slow noise with them, unless what they may have been counts.
#[test]
fn noise_that_left_with_a_mean_is_counted() {
    const RHO: f64 = 0.92;
    const N: usize = 90;
    let mut noise = Noise::new(11);
    let series: Vec<Vec<f64>> = (0..400)
        .map(|_| {
            let slow = noise.slow(RHO, N);
            let mean = slow.iter().sum::<f64>() / N as f64;
            slow.iter().map(|v| v - mean).collect()
        })
        .collect();
    let (mut sum, mut correlation) = (1.0, 1.0);
    for k in 1..N {
        correlation *= RHO;
        sum += 2.0 * (1.0 - k as f64 / N as f64) * correlation;
    }
    let variance: f64 = sum / N as f64;
    let unknown = vec![variance.sqrt(); N];
    let series: Vec<&[f64]> = series.iter().map(Vec::as_slice).collect();
    let taken = vec![unknown.as_slice(); series.len()];
    let long = |taken: &[&[f64]]| {
        let model = AutoRegression::selected_about_zero(&series, taken, 1).expect("long enough");
        long_run_variance(&model) * (1.0 - RHO) / (1.0 + RHO)
    };
    assert!(long(&[]) < 0.6, "{}", long(&[]));
    assert!((long(&taken) - 1.0).abs() < 0.1, "{}", long(&taken));
}

#[test]
fn refuses_what_cannot_be_fitted() {
    let fit = |series: &[&[f64]], most: usize| {
        AutoRegression::selected_about_zero(series, &[], most).map(|m| m.sd)
    };
    assert!(matches!(
        fit(&[&[1.0, 2.0]], 3),
        Err(NumericsError::TooFew { .. })
    ));
    assert!(fit(&[], 1).is_err());
    assert!(fit(&[&[5.0; 20]], 1).is_err());
    assert!(fit(&[&[1.0, f64::NAN, 2.0, 1.0]], 1).is_err());
    let explosive = AutoRegression {
        coefficients: vec![1.1],
        sd: 1.0,
    };
    assert!(matches!(
        Whitener::new(&explosive),
        Err(NumericsError::OutOfRange { .. })
    ));
    let silent = AutoRegression {
        coefficients: vec![0.5],
        sd: 0.0,
    };
    assert!(Whitener::new(&silent).is_err());
    assert!(effective_samples(&[1.0]).is_err());
}
