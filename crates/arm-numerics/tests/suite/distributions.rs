use arm_numerics::NumericsError;
use arm_numerics::statistics::distributions::{chi_square_tail, student_t_quantile};

/// Relative agreement of quantiles.
const TOLERANCE: f64 = 1e-10;

/// scipy 1.17.1: `stats.t.ppf(p, dof)`; each row also checked with mpmath's 40-digit incomplete beta function.
const QUANTILES: [(f64, f64, f64); 12] = [
    (0.6, 1.0, 0.32491969623290634),
    (0.975, 1.0, 12.706204736174694),
    (1.0 - 1e-8, 1.0, 31830988.45843601),
    (0.995, 2.0, 9.924843200918287),
    (0.975, 3.0, 3.1824463052837078),
    (0.975, 9.0, 2.262157162798205),
    (1.0 - 1e-8, 9.0, 18.283967445453246),
    (0.995, 29.5, 2.753133270256325),
    (0.6, 100.0, 0.25402218245822766),
    (0.975, 1000.0, 1.9623390808264083),
    (1.0 - 1e-8, 1000.0, 5.657912336788832),
    (0.975, 1e5, 1.9599877075346095),
];

#[test]
fn quantiles_are_those_of_scipy() {
    for (probability, dof, expected) in QUANTILES {
        let found = student_t_quantile(probability, dof).expect("in range");
        assert!(
            (found / expected - 1.0).abs() < TOLERANCE,
            "{probability} {dof}: {found}"
        );
    }
    let low = student_t_quantile(0.025, 9.0).expect("in range");
    assert!((low + 2.262157162798205).abs() < TOLERANCE);
    assert_eq!(student_t_quantile(0.5, 3.0).expect("in range"), 0.0);
}

#[test]
fn refuses_what_has_no_answer() {
    assert!(matches!(
        student_t_quantile(1.0, 3.0),
        Err(NumericsError::OutOfRange {
            name: "probability",
            ..
        })
    ));
    assert!(matches!(
        student_t_quantile(0.9, 0.0),
        Err(NumericsError::OutOfRange { name: "dof", .. })
    ));
    assert!(student_t_quantile(f64::NAN, 3.0).is_err());
}

#[test]
fn tails_of_chi_square_match_tables() {
    // Abramowitz, Stegun, table 26.8.
    for (x, dof, tail) in [
        (3.841_459, 1, 0.05),
        (5.991_465, 2, 0.05),
        (7.814_728, 3, 0.05),
        (13.276_70, 4, 0.01),
        (20.515_01, 5, 0.001),
    ] {
        assert!((chi_square_tail(x, dof) - tail).abs() < 1e-7, "{dof}");
    }
}
