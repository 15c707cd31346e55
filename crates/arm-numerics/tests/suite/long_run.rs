use crate::noise::Noise;
use arm_numerics::Matrix;
use arm_numerics::statistics::long_run::{Kernel, LongRun, standard_error_of_mean};

fn variants() -> Vec<LongRun> {
    let mut all = Vec::new();
    for kernel in [Kernel::Bartlett, Kernel::Parzen] {
        for prewhiten in [false, true] {
            all.push(LongRun {
                kernel,
                bandwidth: None,
                prewhiten,
            });
        }
    }
    all
}

/// AR(1), ρ = 0.8, unit variance: variance of the sum is `n (1 + ρ)/(1 − ρ) = 9 n`.
#[test]
fn long_run_variance_of_slow_noise() {
    let mut noise = Noise::new(81);
    let n = 2000;
    for variant in variants() {
        let mut mean = 0.0;
        for _ in 0..40 {
            let x = noise.slow(0.8, n);
            let scores = Matrix::from_fn(n, 2, |i, j| if j == 0 { x[i] } else { 1e3 * x[i] });
            let meat = variant.meat(&scores).expect("long");
            assert!((meat[(0, 1)] / (1e3 * meat[(0, 0)]) - 1.0).abs() < 1e-9);
            mean += meat[(0, 0)] / (9.0 * n as f64) / 40.0;
        }
        assert!((0.8..1.1).contains(&mean), "{variant:?}: {mean}");
    }
}

/// With one lag of weight ½: Γ₀ + ½·2Γ₁, by hand: x = (1, −1) repeated, n = 8: 8 − 7 = 1.
#[test]
fn bartlett_by_hand() {
    let scores = Matrix::from_fn(8, 1, |i, _| if i % 2 == 0 { 1.0 } else { -1.0 });
    let fixed = LongRun {
        kernel: Kernel::Bartlett,
        bandwidth: Some(2.0),
        prewhiten: false,
    };
    let meat = fixed.meat(&scores).expect("eight");
    assert!((meat[(0, 0)] - 1.0).abs() < 1e-14);
}

/// Coverage of the mean of one trial of slow noise: honest to a few percent, where the white formula is lost.
#[test]
fn standard_error_of_a_mean_of_slow_noise() {
    let mut noise = Noise::new(82);
    let (mut honest, mut white) = (0, 0);
    for _ in 0..500 {
        let x = noise.slow(0.9, 1000);
        let mean = x.iter().sum::<f64>() / 1000.0;
        let sd = (x.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / 999.0).sqrt();
        honest += usize::from(mean.abs() < 1.96 * standard_error_of_mean(&x).expect("long"));
        white += usize::from(mean.abs() < 1.96 * sd / 1000.0_f64.sqrt());
    }
    assert!((450..=490).contains(&honest), "{honest} of 500");
    assert!(white < 250, "{white} of 500");
}

#[test]
fn constant_and_short_scores() {
    let constant = Matrix::from_fn(20, 1, |_, _| 3.0);
    for variant in variants() {
        assert_eq!(variant.meat(&constant).expect("twenty")[(0, 0)], 0.0);
    }
    let standard = LongRun::default();
    assert!(standard.meat(&Matrix::zeros(7, 1)).is_err());
    assert!(
        standard
            .meat(&Matrix::from_fn(20, 1, |_, _| f64::NAN))
            .is_err()
    );
    let narrow = LongRun {
        bandwidth: Some(0.5),
        ..standard
    };
    assert!(
        narrow
            .meat(&Matrix::from_fn(20, 1, |i, _| i as f64))
            .is_err()
    );
}
