use crate::noise::{Noise, gap};
use arm_numerics::{Factor, Matrix, NumericsError};

const ROUNDING: f64 = 1e-12;

fn problem() -> (Matrix, Vec<f64>, Factor) {
    let mut noise = Noise::new(11);
    let (y, b) = (noise.matrix(200, 4), noise.vector(200));
    let factor = Factor::of(&y, &b).expect("finite");
    (y, b, factor)
}

fn residual(y: &Matrix, b: &[f64], x: &[f64]) -> Vec<f64> {
    b.iter().zip(y.times(x)).map(|(b, f)| b - f).collect()
}

#[test]
fn residual_and_score_are_those_of_the_rows() {
    let (y, b, factor) = problem();
    for x in [[0.0; 4], [1.0, -2.0, 0.3, 5.0]] {
        let e = residual(&y, &b, &x);
        let sum: f64 = e.iter().map(|v| v * v).sum();
        assert!((factor.residual2(&x).expect("four") / sum - 1.0).abs() < ROUNDING);
        assert!(gap(&factor.score(&x).expect("four"), &y.transpose_times(&e)) < 1e-10);
    }
    let best = factor.solve().expect("full rank");
    assert!(gap(&factor.score(&best).expect("four"), &[0.0; 4]) < 1e-11);
}

#[test]
fn restriction_and_prior_change_the_problem_as_stated() {
    let (y, b, factor) = problem();
    let at = [0.0, 7.0, 0.0, -1.0];
    let restricted = factor.restricted(&[2, 0], &at).expect("two of four");
    assert_eq!(restricted.rows, 200);
    let free = restricted.solve().expect("full rank");
    let e = residual(&y, &b, &[free[1], 7.0, free[0], -1.0]);
    let score = y.transpose_times(&e);
    assert!(score[0].abs() < 1e-10 && score[2].abs() < 1e-10);
    let sum: f64 = e.iter().map(|v| v * v).sum();
    assert!((restricted.residual2(&free).expect("two") / sum - 1.0).abs() < ROUNDING);

    // A prior as tight as the data: half way for one orthogonal column.
    let one = Factor::of(&Matrix::identity(1), &[4.0]).expect("finite");
    let pulled = one.with_prior(&[2.0], &[1.0]).expect("finite");
    assert!((pulled.solve().expect("one")[0] - 3.0).abs() < ROUNDING);
    assert_eq!(pulled.rows, 1);
    let free = one.with_prior(&[2.0], &[f64::INFINITY]).expect("no row");
    assert!((free.solve().expect("one")[0] - 4.0).abs() < ROUNDING);
}

#[test]
fn refuses_what_does_not_fit() {
    let (_, _, factor) = problem();
    assert!(matches!(
        factor.residual2(&[0.0; 3]),
        Err(NumericsError::Length {
            name: "x",
            found: 3,
            expected: 4
        })
    ));
    assert!(factor.score(&[0.0; 5]).is_err());
    assert!(factor.with_prior(&[0.0; 4], &[1.0, 1.0, 0.0, 1.0]).is_err());
    assert!(
        factor
            .with_prior(&[0.0; 4], &[1.0, 1.0, f64::NAN, 1.0])
            .is_err()
    );
    assert!(
        factor
            .with_prior(&[f64::NAN, 0.0, 0.0, 0.0], &[1.0; 4])
            .is_err()
    );
    assert!(factor.restricted(&[4], &[0.0; 4]).is_err());
    assert!(factor.restricted(&[1, 1], &[0.0; 4]).is_err());
    assert!(factor.restricted(&[1], &[f64::NAN, 0.0, 0.0, 0.0]).is_err());
    let mut broken = factor.clone();
    broken.z.pop();
    assert!(broken.solve().is_err());
    let mut broken = factor;
    broken.r[(0, 0)] = f64::NAN;
    assert!(broken.solve().is_err());
}
