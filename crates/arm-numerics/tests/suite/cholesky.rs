use crate::noise::{Noise, gap};
use arm_numerics::{Cholesky, Matrix};
use nalgebra::{DMatrix, DVector};

/// Normal equations of random columns whose units differ by factors of up to a million.
fn gram(noise: &mut Noise, n: usize) -> Matrix {
    let columns = noise.matrix(3 * n, n);
    let units: Vec<f64> = (0..n)
        .map(|i| libm::pow(10.0, i as f64 % 7.0 - 3.0))
        .collect();
    let columns = columns.scaled_columns(&units);
    columns.transpose_product(&columns)
}

#[test]
fn solves_like_nalgebra() {
    let mut noise = Noise::new(3);
    for n in 1..25 {
        let a = gram(&mut noise, n);
        let b: Vec<f64> = (0..n).map(|i| a[(i, i)].sqrt() * noise.normal()).collect();
        let theirs = DMatrix::from_column_slice(n, n, a.as_slice())
            .cholesky()
            .expect("positive definite");
        let factor = Cholesky::new(a.clone()).expect("positive definite");
        let unit: Vec<f64> = (0..n).map(|i| a[(i, i)].sqrt()).collect();
        let same = |ours: &[f64], theirs: &[f64], scale: &dyn Fn(usize) -> f64| {
            let scaled = |x: &[f64]| -> Vec<f64> {
                x.iter().enumerate().map(|(i, v)| v * scale(i)).collect()
            };
            gap(&scaled(ours), &scaled(theirs))
        };
        let x = theirs.solve(&DVector::from_column_slice(&b));
        assert!(same(&factor.solve(&b), x.as_slice(), &|i| unit[i]) < 1e-11);
        let both = |i: usize| unit[i % n] * unit[i / n];
        let inverse = factor.inverse();
        assert!(same(inverse.as_slice(), theirs.inverse().as_slice(), &both) < 1e-11);
        let mut sum = Matrix::zeros(n, n);
        for v in factor.spread() {
            sum.add_scaled(1.0, &Matrix::from_fn(n, n, |i, j| v[i] * v[j]));
        }
        assert!(same(sum.as_slice(), inverse.as_slice(), &both) < 1e-11);
    }
}

#[test]
fn columns_that_can_hardly_be_told_apart_are_refused() {
    // The squared sine between both columns is just above and just below 1e-9.
    let gram = |sine: f64| {
        let cosine = (1.0 - sine * sine).sqrt();
        Matrix::from_row_major(2, 2, &[4.0, 6.0 * cosine, 6.0 * cosine, 9.0]).expect("four")
    };
    assert!(Cholesky::new(gram(4e-5)).is_some() && Cholesky::new(gram(2.5e-5)).is_none());
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(
            Cholesky::new(Matrix::diagonal(&[1.0, bad])).is_none(),
            "{bad}"
        );
    }
    let half = Matrix::from_row_major(2, 2, &[1.0, 0.0, f64::NAN, 1.0]).expect("four");
    assert!(Cholesky::new(half).is_none());
    assert!(
        Cholesky::new(Matrix::zeros(0, 0))
            .expect("nothing to decide")
            .solve(&[])
            .is_empty()
    );
}
