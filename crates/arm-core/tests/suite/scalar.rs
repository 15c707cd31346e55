//! Accuracy of the transcendental functions that are written here, against `libm`.

use arm_core::Scalar;

use crate::common::Random;

/// Distance of two numbers in units of the last place of the second.
fn ulps(found: f64, expected: f64) -> f64 {
    let spacing = f64::from_bits(expected.abs().to_bits() + 1) - expected.abs();
    (found - expected).abs() / spacing
}

/// Largest errors of sine and cosine over arguments of a range.
fn worst(random: &mut Random, bound: f64, count: usize) -> f64 {
    (0..count).fold(0.0, |worst, _| {
        let x = random.uniform(-bound, bound);
        let (sin, cos) = Scalar::sin_cos(x);
        // Both are within 1 ulp of the truth; their distance adds.
        worst
            .max(ulps(sin, libm::sin(x)))
            .max(ulps(cos, libm::cos(x)))
    })
}

/// Measured over two million arguments: 1 ulp from `libm` within ±10³ rad, where a joint angle lies.
#[test]
fn sine_and_cosine_agree_with_libm() {
    let mut random = Random(91);
    for bound in [0.8, 4.0, 100.0, 1e3] {
        let found = worst(&mut random, bound, 500_000);
        assert!(found <= 1.0, "{found} ulp within ±{bound}");
    }
}

/// Farther out the third part of π/2 ends: the error is absolute, below 10⁻¹⁶, and counts many ulps near a zero.
#[test]
fn sine_and_cosine_of_large_angles() {
    let mut random = Random(92);
    for _ in 0..500_000 {
        let x = random.uniform(-1e5, 1e5);
        let (sin, cos) = Scalar::sin_cos(x);
        assert!(
            (sin - libm::sin(x)).abs() < 2.3e-16 && (cos - libm::cos(x)).abs() < 2.3e-16,
            "{x}"
        );
    }
    // Beyond, up to where neighbouring numbers are more than a turn apart.
    let far = (0..500_000).map(|_| libm::exp(random.uniform(11.5, 36.8)));
    for x in far.chain([1.1e5, 3e7, 9.99e15, 1e15 + 0.125]) {
        for x in [x, -x] {
            let (sin, cos) = Scalar::sin_cos(x);
            assert!(
                (sin - libm::sin(x)).abs() < 2.3e-16 && (cos - libm::cos(x)).abs() < 2.3e-16,
                "at {x}"
            );
        }
    }
    for x in [1e16_f64, -1e22] {
        let (sin, cos) = Scalar::sin_cos(x);
        assert!(sin.is_nan() && cos.is_nan());
    }
}

#[test]
fn sine_and_cosine_at_special_arguments() {
    assert_eq!(Scalar::sin_cos(0.0_f64), (0.0, 1.0));
    assert_eq!(Scalar::sin_cos(-0.0_f64).1, 1.0);
    for k in -1000..=1000 {
        let x = f64::from(k) * core::f64::consts::FRAC_PI_2;
        let (sin, cos) = Scalar::sin_cos(x);
        assert!(
            ulps(sin, libm::sin(x)) <= 1.0 && ulps(cos, libm::cos(x)) <= 1.0,
            "{k} quarter turns"
        );
    }
    for x in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let (sin, cos) = Scalar::sin_cos(x);
        assert!(sin.is_nan() && cos.is_nan());
    }
    let tiny = 1e-300_f64;
    assert_eq!(Scalar::sin_cos(tiny), (tiny, 1.0));
}

#[test]
fn sine_and_cosine_are_odd_and_even_bit_for_bit() {
    let mut random = Random(93);
    for _ in 0..100_000 {
        let x = random.uniform(0.0, 100.0);
        let ((s, c), (ms, mc)) = (Scalar::sin_cos(x), Scalar::sin_cos(-x));
        assert_eq!((s.to_bits(), c.to_bits()), ((-ms).to_bits(), mc.to_bits()));
    }
}

#[test]
fn single_precision_agrees_with_double() {
    let mut random = Random(94);
    let mut worst = 0.0_f64;
    for _ in 0..500_000 {
        let x = random.uniform(-20.0, 20.0) as f32;
        let (sin, cos) = Scalar::sin_cos(x);
        let (s, c) = (libm::sin(f64::from(x)), libm::cos(f64::from(x)));
        worst = worst
            .max((f64::from(sin) - s).abs())
            .max((f64::from(cos) - c).abs());
    }
    // One ulp below 1 is 6.0e-8.
    assert!(worst < 7e-8, "{worst:e}");
    // Far angles, evenly over their magnitudes; neighbours of 4096 and 10⁸ with them.
    let far = (0..500_000).map(|_| libm::exp(random.uniform(8.4, 18.4)) as f32);
    for x in far.chain([4096.001, 99_999_990.0]) {
        for x in [x, -x] {
            let (sin, cos) = Scalar::sin_cos(x);
            let (s, c) = (libm::sin(f64::from(x)), libm::cos(f64::from(x)));
            worst = worst
                .max((f64::from(sin) - s).abs())
                .max((f64::from(cos) - c).abs());
        }
    }
    assert!(worst < 7e-8, "{worst:e}");
}

#[test]
fn comparisons_choose() {
    assert_eq!(f64::if_less(1.0, 2.0, 3.0, 4.0), 3.0);
    assert_eq!(f64::if_less(2.0, 2.0, 3.0, 4.0), 4.0);
    assert_eq!(f64::if_less(f64::NAN, 2.0, 3.0, 4.0), 4.0);
    assert_eq!((Scalar::max(1.0, 2.0), Scalar::min(1.0, 2.0)), (2.0, 1.0));
    assert_eq!(
        (Scalar::abs(-3.0_f64), Scalar::squared(-3.0_f64)),
        (3.0, 9.0)
    );
    assert!(!Scalar::is_finite(f64::NAN) && Scalar::is_finite(1.0_f32));
}

/// Measured over two million arguments: 1 ulp from `libm`.
#[test]
fn exponential_agrees_with_libm() {
    let mut random = Random(95);
    for bound in [1e-3, 1.0, 30.0, 700.0] {
        for _ in 0..500_000 {
            let x = random.uniform(-bound, bound);
            let found = ulps(Scalar::exp(x), libm::exp(x));
            assert!(found <= 1.0, "{found} ulp at {x}");
        }
    }
    for (x, e) in [
        (0.0, 1.0),
        (-0.0, 1.0),
        (-709.0, 0.0),
        (f64::NEG_INFINITY, 0.0),
    ] {
        assert_eq!(Scalar::exp(x), e);
    }
    assert_eq!(Scalar::exp(f64::INFINITY), f64::INFINITY);
    assert_eq!(Scalar::exp(709.8_f64), f64::INFINITY);
    assert!(ulps(Scalar::exp(709.7_f64), libm::exp(709.7)) <= 1.0);
    assert!(Scalar::exp(f64::NAN).is_nan());
}

/// Measured over two million arguments: 3 ulp from `libm`, near zero too; odd bit for bit.
#[test]
fn hyperbolic_tangent_agrees_with_libm() {
    let mut random = Random(96);
    for bound in [1e-6, 0.1, 2.0, 25.0] {
        for _ in 0..500_000 {
            let x = random.uniform(-bound, bound);
            let t = Scalar::tanh(x);
            let found = ulps(t, libm::tanh(x));
            assert!(found <= 3.0, "{found} ulp at {x}");
            assert_eq!(Scalar::tanh(-x).to_bits(), (-t).to_bits());
            assert!(t.abs() <= 1.0);
        }
    }
    for (x, t) in [
        (0.0, 0.0),
        (1e9, 1.0),
        (-1e9, -1.0),
        (f64::INFINITY, 1.0),
        (1e-300, 1e-300),
    ] {
        assert_eq!(Scalar::tanh(x), t);
    }
    assert!(Scalar::tanh(-0.0_f64).is_sign_negative());
    assert!(Scalar::tanh(f64::NAN).is_nan());
}
