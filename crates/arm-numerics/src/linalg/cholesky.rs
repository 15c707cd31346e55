//! Cholesky factor of a small symmetric matrix, such as the normal equations of a fit.

use crate::linalg::matrix::{Matrix, add_scaled, interleaved_dot};

/// Columns closer to a combination of the others than this (squared sine of the angle) are not distinguished.
const LEAST: f64 = 1e-9;

/// `S A S = L Lᵀ` with a unit diagonal of `S A S`, so that units do not matter.
///
/// ```
/// use arm_numerics::{Cholesky, Matrix};
/// let gram = Matrix::from_row_major(2, 2, &[4.0, 2.0, 2.0, 3.0])?;
/// let factor = Cholesky::new(gram).expect("positive definite");
/// let x = factor.solve(&[8.0, 8.0]);
/// assert!((x[0] - 1.0).abs() < 1e-15 && (x[1] - 2.0).abs() < 1e-15);
/// assert!(Cholesky::new(Matrix::zeros(2, 2)).is_none());
/// # Ok::<(), arm_numerics::NumericsError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Cholesky {
    /// `L` on and below the diagonal.
    lower: Matrix,
    /// Diagonal of `S`.
    scale: Vec<f64>,
}

impl Cholesky {
    /// Factorises `a`, of which the lower triangle is read; `None` unless it is finite and safely positive definite.
    ///
    /// # Panics
    /// If `a` is not square.
    pub fn new(mut a: Matrix) -> Option<Self> {
        let n = a.cols();
        assert_eq!(a.rows(), n, "a square matrix");
        let scale: Vec<f64> = (0..n).map(|i| 1.0 / a[(i, i)].sqrt()).collect();
        if scale.iter().any(|s| !s.is_finite() || *s == 0.0) {
            return None;
        }
        for j in 0..n {
            for i in j..n {
                a[(i, j)] *= scale[i] * scale[j];
            }
            for k in 0..j {
                let (before, own) = a.two_columns_mut(k, j);
                add_scaled(&mut own[j..], -before[j], &before[j..]);
            }
            let pivot = a[(j, j)];
            if pivot.is_nan() || pivot < LEAST {
                return None;
            }
            let root = pivot.sqrt();
            a.column_mut(j)[j..].iter_mut().for_each(|v| *v /= root);
        }
        Some(Self { lower: a, scale })
    }

    /// `A⁻¹ b`.
    ///
    /// # Panics
    /// If `b` has another length than `A` has rows.
    pub fn solve(&self, b: &[f64]) -> Vec<f64> {
        assert_eq!(b.len(), self.scale.len(), "one number a row");
        let mut x: Vec<f64> = b.iter().zip(&self.scale).map(|(b, s)| b * s).collect();
        for j in 0..x.len() {
            x[j] /= self.lower[(j, j)];
            let xj = x[j];
            add_scaled(&mut x[j + 1..], -xj, &self.lower.column(j)[j + 1..]);
        }
        self.solve_transposed(&mut x);
        x.iter().zip(&self.scale).map(|(x, s)| x * s).collect()
    }

    /// `A⁻¹ B`, column by column.
    ///
    /// # Panics
    /// If `B` has another number of rows than `A`.
    pub fn solve_columns(&self, b: &Matrix) -> Matrix {
        let mut out = b.clone();
        for j in 0..b.cols() {
            out.column_mut(j).copy_from_slice(&self.solve(b.column(j)));
        }
        out
    }

    /// `A⁻¹`.
    pub fn inverse(&self) -> Matrix {
        self.solve_columns(&Matrix::identity(self.scale.len()))
    }

    /// Vectors whose outer products add up to `A⁻¹`.
    pub fn spread(&self) -> Vec<Vec<f64>> {
        let n = self.scale.len();
        let vector = |k: usize| {
            let mut x = vec![0.0; n];
            x[k] = 1.0;
            self.solve_transposed(&mut x);
            x.iter().zip(&self.scale).map(|(x, s)| x * s).collect()
        };
        (0..n).map(vector).collect()
    }

    /// `x ← L⁻ᵀ x`.
    fn solve_transposed(&self, x: &mut [f64]) {
        for j in (0..x.len()).rev() {
            let below = interleaved_dot(&self.lower.column(j)[j + 1..], &x[j + 1..]);
            x[j] = (x[j] - below) / self.lower[(j, j)];
        }
    }
}
