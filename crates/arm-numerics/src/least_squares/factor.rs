//! The triangular factor of a least-squares problem: sufficient statistics of the data, `p(p+3)/2 + 1` numbers.

use crate::error::{NumericsError, check_finite, check_len};
use crate::linalg::matrix::{Matrix, dot};
use crate::linalg::orthogonal::solve_upper;

/// The problem `min ‖R x − z‖² + ρ²`, equal to `min Σ_rows (yᵀx − b)²` for every `x`.
#[derive(Debug, Clone, PartialEq)]
pub struct Factor {
    /// Upper triangular, `p × p`, diagonal not negative.
    pub r: Matrix,
    /// Transformed right-hand side, `p`.
    pub z: Vec<f64>,
    /// Sum of squares that no `x` can explain.
    pub rho2: f64,
    /// Number of rows behind it.
    pub rows: usize,
}

impl Factor {
    /// Number of parameters `p`.
    pub fn parameters(&self) -> usize {
        self.z.len()
    }

    /// The least-squares solution `R⁻¹ z`.
    ///
    /// # Errors
    /// [`NumericsError::Rank`] if a diagonal element of `R` is below `p ε` times the norm of its column: then [`crate::least_squares::program`] or the rank analysis of `arm-ident` apply.
    pub fn solve(&self) -> Result<Vec<f64>, NumericsError> {
        self.check()?;
        let p = self.parameters();
        let tolerance = f64::EPSILON * (p.max(1) as f64);
        let norms = self.r.column_norms();
        let found = (0..p)
            .filter(|&j| self.r[(j, j)].abs() > tolerance * norms[j])
            .count();
        if found < p {
            return Err(NumericsError::Rank {
                name: "r",
                found,
                expected: p,
            });
        }
        let mut x = self.z.clone();
        solve_upper(&self.r, p, &mut x);
        Ok(x)
    }

    /// Sum of squared residuals at `x`: `‖R x − z‖² + ρ²`.
    ///
    /// # Errors
    /// [`NumericsError::Length`].
    pub fn residual2(&self, x: &[f64]) -> Result<f64, NumericsError> {
        let e = self.misfit(x)?;
        Ok(dot(&e, &e) + self.rho2)
    }

    /// Score `Rᵀ(z − R x)`, equal to `Σ_rows y (b − yᵀx)`: what [`crate::statistics::sandwich_covariance`] takes from every cluster.
    ///
    /// # Errors
    /// [`NumericsError::Length`].
    pub fn score(&self, x: &[f64]) -> Result<Vec<f64>, NumericsError> {
        let e = self.misfit(x)?;
        Ok(self.r.transpose_times(&e))
    }

    /// Refuses a factor whose public fields do not fit together.
    pub(crate) fn check(&self) -> Result<(), NumericsError> {
        check_len("r", self.r.cols(), self.z.len())?;
        check_len("r", self.r.rows(), self.z.len())?;
        check_finite("r", self.r.as_slice())?;
        check_finite("z", &self.z)?;
        check_finite("rho2", &[self.rho2])
    }

    /// `z − R x`.
    fn misfit(&self, x: &[f64]) -> Result<Vec<f64>, NumericsError> {
        check_len("x", x.len(), self.parameters())?;
        Ok(self
            .z
            .iter()
            .zip(self.r.times(x))
            .map(|(z, f)| z - f)
            .collect())
    }
}
