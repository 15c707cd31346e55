//! First and second derivatives of uniformly sampled columns.
//!
//! Differentiated measurements belong into plots and filters, not into regressors: the noise of `sgn q̇` and `q̈` biases a fit.

use crate::error::{NumericsError, check_finite, check_least, check_range};
use crate::linalg::matrix::{Matrix, dot, norm};
use crate::linalg::orthogonal::{Qr, solve_upper_transposed};

/// First derivative by central differences, `(y₊ − y₋)/2Δ`; three-point one-sided formulas at the ends. Error O(Δ²).
///
/// White noise of standard deviation σ comes out as `σ/(√2 Δ)`.
///
/// * `step` - Δ, time between samples \[s\]
///
/// # Errors
/// [`NumericsError::TooFew`] below 3 samples, [`NumericsError::NotFinite`], [`NumericsError::OutOfRange`] unless the step is 1e-20…1e20.
pub fn first(column: &[f64], step: f64) -> Result<Vec<f64>, NumericsError> {
    check(column, step, 3)?;
    let n = column.len();
    let mut out: Vec<f64> = column
        .windows(3)
        .map(|y| (y[2] - y[0]) / (2.0 * step))
        .collect();
    out.insert(
        0,
        (4.0 * column[1] - 3.0 * column[0] - column[2]) / (2.0 * step),
    );
    out.push((3.0 * column[n - 1] - 4.0 * column[n - 2] + column[n - 3]) / (2.0 * step));
    Ok(out)
}

/// Second derivative by central differences, `(y₊ − 2y + y₋)/Δ²`; four-point one-sided formulas at the ends. Error O(Δ²).
///
/// White noise of standard deviation σ comes out as `√6 σ/Δ²`.
///
/// # Errors
/// [`NumericsError::TooFew`] below 4 samples, [`NumericsError::NotFinite`], [`NumericsError::OutOfRange`] unless the step is 1e-20…1e20.
pub fn second(column: &[f64], step: f64) -> Result<Vec<f64>, NumericsError> {
    check(column, step, 4)?;
    let n = column.len();
    let end = |a: f64, b: f64, c: f64, d: f64| (2.0 * a - 5.0 * b + 4.0 * c - d) / (step * step);
    let mut out: Vec<f64> = column
        .windows(3)
        .map(|y| (y[2] - 2.0 * y[1] + y[0]) / (step * step))
        .collect();
    out.insert(0, end(column[0], column[1], column[2], column[3]));
    out.push(end(
        column[n - 1],
        column[n - 2],
        column[n - 3],
        column[n - 4],
    ));
    Ok(out)
}

/// Savitzky–Golay filter: value or derivative of the polynomial fitted to `2m + 1` samples around each sample.
///
/// Exact for polynomials up to the degree. Near the ends the polynomial of the first or last full window is read off its centre, as
/// `scipy.signal.savgol_filter(mode="interp")` does.
#[derive(Debug, Clone, PartialEq)]
pub struct SavitzkyGolay {
    /// Column `i`: weights of the window's samples for the derivative at the window's sample `i`.
    weights: Matrix,
}

/// What a [`SavitzkyGolay`] filter computes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SavitzkyGolayOptions {
    /// m: the window has `2m + 1` samples.
    pub half_width: usize,
    /// Degree of the polynomial, at most `2m`.
    pub degree: usize,
    /// Which derivative: 0 smooths.
    pub derivative: usize,
    /// Time between samples \[s\].
    pub step: f64,
}

impl SavitzkyGolay {
    /// Weights from a QR factor of the polynomial basis on `[−1, 1]`.
    ///
    /// # Errors
    /// [`NumericsError::OutOfRange`] unless `1 ≤ m ≤ 500`, `derivative ≤ degree ≤ min(2m, 12)` and the step is 1e-20…1e20.
    pub fn new(options: SavitzkyGolayOptions) -> Result<Self, NumericsError> {
        let SavitzkyGolayOptions {
            half_width,
            degree,
            derivative,
            step,
        } = options;
        check_range("half_width", half_width as f64, [1.0, 500.0])?;
        check_range(
            "degree",
            degree as f64,
            [0.0, (2 * half_width).min(12) as f64],
        )?;
        check_range("derivative", derivative as f64, [0.0, degree as f64])?;
        check_range("step", step, [1e-20, 1e20])?;
        let n = 2 * half_width + 1;
        let place = |i: usize| (i as f64 - half_width as f64) / half_width as f64;
        let qr = Qr::new(Matrix::from_fn(n, degree + 1, |i, k| power(place(i), k)));
        let triangle = qr.leading(degree + 1);
        let unit = power(step * half_width as f64, derivative);
        let mut weights = Matrix::zeros(n, n);
        for i in 0..n {
            // d^j/du^j of the basis at u, then through the fit: w = Q R⁻ᵀ d.
            let w = weights.column_mut(i);
            for k in derivative..=degree {
                let falling: f64 = (0..derivative).fold(1.0, |f, l| f * (k - l) as f64);
                w[k] = falling * power(place(i), k - derivative);
            }
            solve_upper_transposed(&triangle, degree + 1, w);
            qr.apply(w);
            w.iter_mut().for_each(|v| *v /= unit);
        }
        Ok(Self { weights })
    }

    /// Filters a column of at least `2m + 1` samples.
    ///
    /// # Errors
    /// [`NumericsError::TooFew`], [`NumericsError::NotFinite`].
    pub fn apply(&self, column: &[f64]) -> Result<Vec<f64>, NumericsError> {
        let (n, width) = (column.len(), self.weights.rows());
        check_least("samples of column", n, width)?;
        check_finite("column", column)?;
        let m = width / 2;
        let at = |i: usize| {
            let start = i.saturating_sub(m).min(n - width);
            dot(
                &column[start..start + width],
                self.weights.column(i - start),
            )
        };
        Ok((0..n).map(at).collect())
    }

    /// Standard deviation of the result for white noise of standard deviation 1, away from the ends.
    pub fn noise_gain(&self) -> f64 {
        norm(self.weights.column(self.weights.rows() / 2))
    }
}

fn check(column: &[f64], step: f64, least: usize) -> Result<(), NumericsError> {
    check_least("samples of column", column.len(), least)?;
    check_finite("column", column)?;
    check_range("step", step, [1e-20, 1e20])
}

/// `x^k` by repeated multiplication: the same bits everywhere.
fn power(x: f64, k: usize) -> f64 {
    (0..k).fold(1.0, |product, _| product * x)
}
