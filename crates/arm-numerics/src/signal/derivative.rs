//! First and second derivatives of uniformly sampled columns.
//!
//! Differentiated measurements belong into plots and filters, not into regressors: the noise of `sgn q̇` and `q̈` biases a fit.

use crate::error::{NumericsError, check_finite, check_least, check_range};

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

fn check(column: &[f64], step: f64, least: usize) -> Result<(), NumericsError> {
    check_least("samples of column", column.len(), least)?;
    check_finite("column", column)?;
    check_range("step", step, [1e-20, 1e20])
}
