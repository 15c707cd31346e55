use crate::noise::{Noise, gap};
use arm_numerics::Matrix;
use arm_numerics::linalg::svd::Svd;

fn rebuilt(svd: &Svd) -> Matrix {
    svd.u.scaled_columns(&svd.sigma).product(&svd.v.transpose())
}

#[test]
fn rebuilds_random_matrices_with_orthogonal_factors() {
    let mut noise = Noise::new(21);
    for (m, n) in [(1, 1), (4, 4), (12, 12), (40, 40), (30, 7), (3, 6)] {
        let a = noise.matrix(m, n);
        let svd = Svd::of(a.clone());
        assert!(gap(rebuilt(&svd).as_slice(), a.as_slice()) < 1e-13);
        let unit = svd.v.transpose().product(&svd.v);
        assert!(gap(unit.as_slice(), Matrix::identity(n).as_slice()) < 1e-13);
        assert!(svd.sigma.windows(2).all(|s| s[0] >= s[1]));
        assert_eq!(svd.rank(1e-12), m.min(n));
    }
}

#[test]
fn a_diagonal_is_its_own_decomposition() {
    let a = Matrix::diagonal(&[1.0, 1e-5, 1e-10, 1e-14]);
    let svd = Svd::of(a);
    assert_eq!(svd.sigma, [1.0, 1e-5, 1e-10, 1e-14]);
    assert_eq!(svd.condition(), 1e14);
}

#[test]
fn rank_of_deficient_and_extreme_matrices() {
    let mut noise = Noise::new(22);
    let low = noise.matrix(20, 3).product(&noise.matrix(3, 9));
    assert_eq!(Svd::of(low).rank(1e-13), 3);
    for size in [1e-250, 1e250] {
        let a = noise.matrix(5, 5).scaled_columns(&[size; 5]);
        let svd = Svd::of(a);
        assert_eq!(svd.rank(1e-13), 5);
        assert!(svd.sigma.iter().all(|s| s.is_finite()));
    }
    let zero = Svd::of(Matrix::zeros(3, 3));
    assert_eq!((zero.rank(0.0), zero.condition()), (0, f64::INFINITY));
}
