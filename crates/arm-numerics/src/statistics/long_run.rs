//! Long-run covariance of a correlated score series: the sandwich's filling for a single trial (heteroskedasticity and autocorrelation consistent, "HAC").
//!
//! `M = Σ_t Σ_u E s_t s_uᵀ ≈ Γ₀ + Σ_l w(l/(L+1)) (Γ_l + Γ_lᵀ)`, `Γ_l = Σ_t s_t s_{t+l}ᵀ` (Newey & West 1987; automatic bandwidth by the AR(1) plug-in of
//! Andrews 1991; prewhitening and recolouring after Andrews & Monahan 1992, here with one AR(1) per component).

use crate::error::{NumericsError, check_finite, check_least, check_range};
use crate::linalg::matrix::{Matrix, dot};
use crate::statistics::autoregressive::{AutoRegression, centred};

/// Weight of lag `l` at `x = l / bandwidth`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kernel {
    /// `1 − x`.
    Bartlett,
    /// Parzen's kernel: smoother, less bias at the same bandwidth.
    Parzen,
}

/// How a long-run covariance is estimated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LongRun {
    /// Weights of the lags.
    pub kernel: Kernel,
    /// Lag in samples at which the weight reaches zero; `None` chooses it from the data.
    pub bandwidth: Option<f64>,
    /// Whether each component is first passed through its own AR(1) filter. Better for slow residuals.
    pub prewhiten: bool,
}

impl Default for LongRun {
    /// Parzen kernel, automatic bandwidth, prewhitened.
    fn default() -> Self {
        Self {
            kernel: Kernel::Parzen,
            bandwidth: None,
            prewhiten: true,
        }
    }
}

impl LongRun {
    /// Covariance of the *sum* of the scores of one trial, `p × p`.
    ///
    /// * `scores` - `n × p`, row t is `y_t (b_t − y_tᵀx)`
    ///
    /// # Errors
    /// [`NumericsError::TooFew`] below 8 samples, [`NumericsError::NotFinite`], [`NumericsError::OutOfRange`] for a bandwidth below 1.
    pub fn meat(&self, scores: &Matrix) -> Result<Matrix, NumericsError> {
        let (n, p) = (scores.rows(), scores.cols());
        check_least("samples of scores", n, 8)?;
        check_finite("scores", scores.as_slice())?;
        let mut columns: Vec<Vec<f64>> = (0..p).map(|j| centred(scores.column(j))).collect();
        let mut recolour = vec![1.0; p];
        if self.prewhiten {
            for (column, factor) in columns.iter_mut().zip(&mut recolour) {
                // The limit is Andrews and Monahan's: beyond it recolouring would explode.
                let rho = first_order(column)?.0.clamp(-0.97, 0.97);
                *column = column.windows(2).map(|s| s[1] - rho * s[0]).collect();
                *factor = 1.0 / (1.0 - rho);
            }
        }
        let bandwidth = match self.bandwidth {
            Some(lag) => lag,
            None => self.automatic(&columns)?,
        };
        check_range("bandwidth", bandwidth, [1.0, f64::MAX])?;
        let length = columns.first().map_or(0, Vec::len);
        let mut meat = Matrix::from_fn(p, p, |i, j| dot(&columns[i], &columns[j]));
        for lag in 1..length {
            let weight = self.weight(lag as f64 / bandwidth);
            if weight == 0.0 {
                break;
            }
            let gamma = Matrix::from_fn(p, p, |i, j| {
                dot(&columns[i][..length - lag], &columns[j][lag..])
            });
            meat = Matrix::from_fn(p, p, |i, j| {
                meat[(i, j)] + weight * (gamma[(i, j)] + gamma[(j, i)])
            });
        }
        let longer = n as f64 / length.max(1) as f64;
        Ok(Matrix::from_fn(p, p, |i, j| {
            longer * recolour[i] * recolour[j] * meat[(i, j)]
        }))
    }

    fn weight(&self, x: f64) -> f64 {
        match self.kernel {
            _ if x >= 1.0 => 0.0,
            Kernel::Bartlett => 1.0 - x,
            Kernel::Parzen if x <= 0.5 => 1.0 - 6.0 * x * x * (1.0 - x),
            Kernel::Parzen => 2.0 * (1.0 - x) * (1.0 - x) * (1.0 - x),
        }
    }

    /// Andrews' bandwidth from an AR(1) model of every component, each weighted by the inverse of its squared variance.
    fn automatic(&self, columns: &[Vec<f64>]) -> Result<f64, NumericsError> {
        let (mut over, mut under, mut n) = (0.0, 0.0, 0.0);
        for column in columns {
            let (rho, varies) = first_order(column)?;
            if !varies {
                continue;
            }
            n = column.len() as f64;
            let rho = rho.clamp(-0.97, 0.97);
            let (away, up) = (1.0 - rho, 1.0 + rho);
            // In units of the innovation variance, so that the component's unit drops out.
            over += match self.kernel {
                Kernel::Bartlett => 4.0 * rho * rho / (libm::pow(away, 6.0) * up * up),
                Kernel::Parzen => 4.0 * rho * rho / libm::pow(away, 8.0),
            };
            under += 1.0 / libm::pow(away, 4.0);
        }
        if under == 0.0 {
            return Ok(1.0);
        }
        let alpha = over / under;
        let bandwidth = match self.kernel {
            Kernel::Bartlett => 1.1447 * libm::pow(alpha * n, 1.0 / 3.0),
            Kernel::Parzen => 2.6614 * libm::pow(alpha * n, 0.2),
        };
        Ok(bandwidth.max(1.0))
    }
}

/// Lag-one correlation of a series and whether it varies at all.
fn first_order(column: &[f64]) -> Result<(f64, bool), NumericsError> {
    if column.iter().all(|v| *v == column[0]) {
        return Ok((0.0, false));
    }
    Ok((AutoRegression::burg(&[column], 1)?.coefficients[0], true))
}

/// Standard error of the mean of a correlated series, in its own unit: the simplest use of a long-run covariance.
///
/// # Errors
/// As [`LongRun::meat`].
pub fn standard_error_of_mean(series: &[f64]) -> Result<f64, NumericsError> {
    let scores = Matrix::from_fn(series.len(), 1, |i, _| series[i]);
    let total = LongRun::default().meat(&scores)?[(0, 0)];
    Ok((total.max(0.0)).sqrt() / series.len() as f64)
}
