//! The triangular factor of a least-squares problem: everything the data say, in `p(p+3)/2 + 1` numbers.

use crate::error::{NumericsError, check_finite, check_len};
use crate::least_squares::condense::Condenser;
use crate::linalg::matrix::{Matrix, add_scaled, dot};
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
    /// Factor of a problem given as a matrix, for small problems and tests; data are streamed through [`Condenser`].
    ///
    /// * `y` - `n × p`
    /// * `b` - `n`
    ///
    /// # Errors
    /// [`NumericsError::Length`], [`NumericsError::NotFinite`].
    pub fn of(y: &Matrix, b: &[f64]) -> Result<Self, NumericsError> {
        check_len("b", b.len(), y.rows())?;
        let mut condenser = Condenser::new(y.cols());
        let mut row = vec![0.0; y.cols()];
        for i in 0..y.rows() {
            for j in 0..y.cols() {
                row[j] = y[(i, j)];
            }
            condenser.push(&row, b[i])?;
        }
        Ok(condenser.finish())
    }

    /// Number of parameters `p`.
    pub fn parameters(&self) -> usize {
        self.z.len()
    }

    /// The least-squares solution `R⁻¹ z`.
    ///
    /// # Errors
    /// [`NumericsError::Rank`] if a diagonal element of `R` is below `p ε` times the norm of its column: then [`crate::least_squares::program`] or [`crate::rank`] apply.
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

    /// The same problem in `x̃` with `x = S x̃`.
    ///
    /// # Errors
    /// [`NumericsError::Length`], [`NumericsError::NotFinite`].
    pub fn scaled(&self, scale: &[f64]) -> Result<Self, NumericsError> {
        check_len("scale", scale.len(), self.parameters())?;
        check_finite("scale", scale)?;
        Ok(Self {
            r: self.r.scaled_columns(scale),
            ..self.clone()
        })
    }

    /// The problem with independent prior rows `x_j/sd_j ≈ mean_j/sd_j` added; an infinite `sd_j` adds none.
    ///
    /// # Errors
    /// [`NumericsError::Length`]; [`NumericsError::OutOfRange`] if an `sd` is not positive; [`NumericsError::NotFinite`] for a mean.
    pub fn with_prior(&self, mean: &[f64], sd: &[f64]) -> Result<Self, NumericsError> {
        let p = self.parameters();
        check_len("mean", mean.len(), p)?;
        check_len("sd", sd.len(), p)?;
        let mut condenser = Condenser::new(p);
        condenser.merge_factor(self)?;
        let mut row = vec![0.0; p];
        for j in 0..p {
            // Written so that NaN is refused too.
            if sd[j].is_nan() || sd[j] <= 0.0 {
                return Err(NumericsError::OutOfRange {
                    name: "sd",
                    found: sd[j],
                    min: 0.0,
                    max: f64::INFINITY,
                });
            }
            if sd[j].is_finite() {
                row[j] = 1.0 / sd[j];
                condenser.push(&row, mean[j] / sd[j])?;
                row[j] = 0.0;
            }
        }
        Ok(Self {
            rows: self.rows,
            ..condenser.finish()
        })
    }

    /// The problem in the parameters `keep` alone, the others held at their values in `x`.
    ///
    /// * `keep` - indices, in the order that the new problem shall have
    /// * `x` - `p` values; those of kept parameters are not read
    ///
    /// # Errors
    /// [`NumericsError::Length`], [`NumericsError::NotFinite`]; [`NumericsError::OutOfRange`] for an index that is too large or given twice.
    pub fn restricted(&self, keep: &[usize], x: &[f64]) -> Result<Self, NumericsError> {
        let p = self.parameters();
        check_len("x", x.len(), p)?;
        let mut kept = vec![false; p];
        for &j in keep {
            if j >= p || kept[j] {
                return Err(NumericsError::OutOfRange {
                    name: "keep",
                    found: j as f64,
                    min: 0.0,
                    max: p as f64 - 1.0,
                });
            }
            kept[j] = true;
        }
        let mut z = self.z.clone();
        for j in (0..p).filter(|&j| !kept[j]) {
            add_scaled(&mut z, -x[j], self.r.column(j));
        }
        check_finite("x", &z)?;
        let smaller = Self::of(&self.r.select_columns(keep), &z)?;
        Ok(Self {
            rho2: smaller.rho2 + self.rho2,
            rows: self.rows,
            ..smaller
        })
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
