//! Uncertainty of a constrained weighted least-squares estimate whose residuals are correlated.
//!
//! The estimate minimises `½‖R x − z‖²` with some constraints binding. In the directions that stay free its covariance is the sandwich
//! `H⁻¹ M H⁻¹`, `H = RᵀR`, where M is the covariance of the score `Σ y (b − yᵀx)`. Scores summed over a trial (a cluster) are independent between trials
//! whatever the noise within a trial is, so M is estimated from their spread; for a single trial from blocks longer than the correlation time ([`blocks`]).
//!
//! Errors that repeat in every trial alike (calibration, lengths) are in neither: their covariance is added.

use crate::error::{NumericsError, check_finite, check_least, check_len, check_range};
use crate::linalg::matrix::{Matrix, dot};
use crate::linalg::orthogonal::{Qr, solve_upper, solve_upper_transposed};
use std::ops::Range;

/// Gradients of binding constraints that depend on each other to this degree count once.
const DEPENDENT: f64 = 1e-11;

/// `H⁻¹` in the free directions, as factors.
#[derive(Debug, Clone, PartialEq)]
pub struct SandwichCovariance {
    /// `p × f`: parameters per free coordinate.
    basis: Matrix,
    /// `f × f`, upper triangular: `TᵀT = basisᵀ H basis`.
    triangle: Matrix,
}

impl SandwichCovariance {
    /// * `r` - `m × p`, the factor of the estimate, prior rows included
    /// * `binding` - gradients of the binding constraints, `p` each: unit vectors for bounds ([`SandwichCovariance::with_fixed`]), rows of linear constraints, gradients of
    ///   cones at the solution
    ///
    /// # Errors
    /// [`NumericsError::Length`], [`NumericsError::NotFinite`]; [`NumericsError::Rank`] if the data leave a free direction open: restrict to base parameters first.
    pub fn new(r: &Matrix, binding: &[Vec<f64>]) -> Result<Self, NumericsError> {
        let p = r.cols();
        check_finite("r", r.as_slice())?;
        for row in binding {
            check_len("binding", row.len(), p)?;
            check_finite("binding", row)?;
        }
        let scale: Vec<f64> = r
            .column_norms()
            .iter()
            .map(|&n| if n > 0.0 { 1.0 / n } else { 1.0 })
            .collect();
        let gradients = Matrix::from_fn(p, binding.len(), |i, j| binding[j][i] * scale[i]);
        let lengths: Vec<f64> = gradients
            .column_norms()
            .iter()
            .map(|&n| if n > 0.0 { 1.0 / n } else { 1.0 })
            .collect();
        let constraints = Qr::pivoted(gradients.scaled_columns(&lengths));
        let bound = constraints.rank(DEPENDENT);
        let free = p - bound;
        let mut basis = Matrix::from_fn(p, free, |i, j| if i == bound + j { 1.0 } else { 0.0 });
        for j in 0..free {
            let column = basis.column_mut(j);
            constraints.apply(column);
            column.iter_mut().zip(&scale).for_each(|(v, s)| *v *= s);
        }
        let product = r.product(&basis);
        let found = Qr::pivoted(product.clone()).rank(f64::EPSILON * (4 * p.max(r.rows())) as f64);
        if found < free {
            return Err(NumericsError::Rank {
                name: "r in the free directions",
                found,
                expected: free,
            });
        }
        Ok(Self {
            basis,
            triangle: Qr::new(product).leading(free),
        })
    }

    /// As [`SandwichCovariance::new`] where only bounds bind: `fixed[j]` for a parameter that sits on its bound.
    ///
    /// # Errors
    /// As [`SandwichCovariance::new`].
    pub fn with_fixed(r: &Matrix, fixed: &[bool]) -> Result<Self, NumericsError> {
        let p = r.cols();
        check_len("fixed", fixed.len(), p)?;
        let unit = |j: usize| (0..p).map(|i| if i == j { 1.0 } else { 0.0 }).collect();
        Self::new(
            r,
            &(0..p).filter(|&j| fixed[j]).map(unit).collect::<Vec<_>>(),
        )
    }

    /// Number of free directions.
    pub fn free(&self) -> usize {
        self.basis.cols()
    }

    /// `H⁻¹ s` in the free directions: by how much a score `s` (`p` numbers) moves the estimate.
    ///
    /// # Errors
    /// [`NumericsError::Length`].
    pub fn apply(&self, score: &[f64]) -> Result<Vec<f64>, NumericsError> {
        check_len("score", score.len(), self.basis.rows())?;
        let mut u = self.basis.transpose_times(score);
        solve_upper_transposed(&self.triangle, self.free(), &mut u);
        solve_upper(&self.triangle, self.free(), &mut u);
        Ok(self.basis.times(&u))
    }

    /// `H⁻¹ M H⁻¹`, `p × p`, for a given covariance `M` (`p × p`) of the total score.
    ///
    /// # Errors
    /// [`NumericsError::Length`].
    pub fn sandwich(&self, meat: &Matrix) -> Result<Matrix, NumericsError> {
        check_len("meat (columns)", meat.cols(), self.basis.rows())?;
        let left = (0..meat.cols())
            .map(|j| self.apply(meat.column(j)))
            .collect::<Result<Vec<_>, _>>()?;
        let p = meat.rows();
        let half = Matrix::from_fn(p, p, |i, j| left[i][j]);
        let right = (0..p)
            .map(|j| self.apply(half.column(j)))
            .collect::<Result<Vec<_>, _>>()?;
        Ok(Matrix::from_fn(p, p, |i, j| {
            0.5 * (right[j][i] + right[i][j])
        }))
    }

    /// `H⁻¹ · variance`: right for **white** residuals of that variance only, and far too small for slow ones. Also the posterior covariance, with variance 1,
    /// if rows are whitened and prior rows included.
    pub fn white(&self, variance: f64) -> Matrix {
        let f = self.free();
        let mut half = Matrix::identity(f);
        for j in 0..f {
            solve_upper(&self.triangle, f, half.column_mut(j));
        }
        let root = self.basis.product(&half);
        let p = root.rows();
        let rows = root.transpose();
        Matrix::from_fn(p, p, |i, j| variance * dot(rows.column(i), rows.column(j)))
    }
}

/// Cuts `n` samples into blocks of at least `shortest` samples, as many and as equal as possible; one block if there are fewer samples.
///
/// As clusters of a single trial, blocks should be several correlation times long: `shortest = 5 n / effective_samples` or more.
///
/// # Errors
/// [`NumericsError::TooFew`] if `n` or `shortest` is zero.
pub fn blocks(n: usize, shortest: usize) -> Result<Vec<Range<usize>>, NumericsError> {
    check_least("samples", n, 1)?;
    check_least("shortest", shortest, 1)?;
    let count = (n / shortest).max(1);
    Ok((0..count)
        .map(|i| i * n / count..(i + 1) * n / count)
        .collect())
}

/// Share of the prior's variance that the data removed, `1 − posterior/prior`, between 0 (no information) and 1.
///
/// It measures the information of the data **and of the priors of the other parameters**: a parameter in the null space can have a large ratio. Read it with
/// `RankReport::undetermined_share` of `arm-ident`.
///
/// # Errors
/// [`NumericsError::OutOfRange`] unless both standard deviations are positive and finite (0 is allowed for the posterior).
pub fn information_ratio(posterior_sd: f64, prior_sd: f64) -> Result<f64, NumericsError> {
    check_range("posterior_sd", posterior_sd, [0.0, f64::MAX])?;
    check_range("prior_sd", prior_sd, [f64::MIN_POSITIVE, f64::MAX])?;
    let ratio = posterior_sd / prior_sd;
    Ok((1.0 - ratio * ratio).clamp(0.0, 1.0))
}

/// Standard error `√(wᵀ Σ w)` of a combination `wᵀx`.
///
/// # Errors
/// [`NumericsError::Length`].
pub fn standard_error(covariance: &Matrix, w: &[f64]) -> Result<f64, NumericsError> {
    check_len("w", w.len(), covariance.cols())?;
    let variance = dot(w, &covariance.times(w));
    Ok(if variance > 0.0 { variance.sqrt() } else { 0.0 })
}
