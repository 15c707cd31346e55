//! Autoregressive residuals: effective number of samples, models and whitening.
//!
//! A series is one uninterrupted trial. Several trials are given side by side and never joined: no lag crosses their ends.

use crate::error::{NumericsError, check_finite, check_least, check_range};
use crate::linalg::matrix::{Matrix, dot};
use crate::linalg::orthogonal::{Qr, solve_upper};

/// How many independent samples would fix the mean of this series as well as its `n` correlated ones: `n / (1 + 2 Σ ρ_k)`, between 1 and `n`.
///
/// The sum ends where a pair `ρ_{2m} + ρ_{2m+1}` is no longer positive (initial positive sequence, Geyer 1992).
///
/// # Errors
/// [`NumericsError::TooFew`] below 2 samples, [`NumericsError::NotFinite`].
pub fn effective_samples(series: &[f64]) -> Result<f64, NumericsError> {
    check_least("samples of series", series.len(), 2)?;
    check_finite("series", series)?;
    let x = centred(series);
    let n = x.len() as f64;
    let variance = dot(&x, &x);
    if variance == 0.0 {
        return Ok(1.0);
    }
    let mut time = -1.0;
    for m in (0..x.len() - 1).step_by(2) {
        let pair = (lagged(&x, m) + lagged(&x, m + 1)) / variance;
        if pair <= 0.0 {
            break;
        }
        time += 2.0 * pair;
    }
    Ok((n / time.max(1.0)).clamp(1.0, n))
}

/// `x_t = Σ_k a_k x_{t−k} + e_t`, `k = 1 … p`, with white `e` of standard deviation `sd`.
#[derive(Debug, Clone, PartialEq)]
pub struct AutoRegression {
    /// `a_1 … a_p`.
    pub coefficients: Vec<f64>,
    /// Standard deviation of the innovation, in the unit of the series.
    pub sd: f64,
}

impl AutoRegression {
    /// The order `0 … most` with the smallest corrected Akaike criterion, fitted by Burg's method to several trials whose mean is known to be zero.
    /// The model is always stationary. Subtracting an estimated mean from short series would remove slow noise.
    ///
    /// Other fitted quantities that were subtracted have removed noise, too. Its expected power is added to every product, but
    /// not to the number of samples: the expectation step of restricted maximum likelihood (Dempster, Laird and Rubin 1977).
    ///
    /// * `taken` - series whose products add up to the posterior covariance of what was subtracted
    ///
    /// # Errors
    /// [`NumericsError::TooFew`] unless some series is longer than `most` and not constant, [`NumericsError::NotFinite`].
    pub fn selected_about_zero(
        series: &[&[f64]],
        taken: &[&[f64]],
        most: usize,
    ) -> Result<Self, NumericsError> {
        check(series, most)?;
        let all = series.iter().chain(taken).map(|s| s.to_vec()).collect();
        let n = series.iter().map(|s| s.len()).sum();
        Ok(Self::best(burg_path(all, most, n), n))
    }

    fn best(path: Vec<Self>, samples: usize) -> Self {
        let criterion = |model: &Self| {
            let k = model.coefficients.len() as f64 + 1.0;
            let n = samples as f64;
            2.0 * n * libm::log(model.sd.max(f64::MIN_POSITIVE))
                + 2.0 * k * n / (n - k - 1.0).max(1.0)
        };
        let mut path = path.into_iter();
        let first = path.next().unwrap_or(Self {
            coefficients: Vec::new(),
            sd: 0.0,
        });
        path.fold(first, |best, model| {
            if criterion(&model) < criterion(&best) {
                model
            } else {
                best
            }
        })
    }
}

/// Burg's models of order 0, 1, … `order` of series; power is divided by a number of samples.
fn burg_path(mut forward: Vec<Vec<f64>>, order: usize, samples: usize) -> Vec<AutoRegression> {
    let mut backward = forward.clone();
    let mut variance = forward.iter().fold(0.0, |sum, x| sum + dot(x, x)) / samples as f64;
    let mut a: Vec<f64> = Vec::with_capacity(order);
    let mut path = vec![AutoRegression {
        coefficients: Vec::new(),
        sd: variance.sqrt(),
    }];
    for m in 1..=order {
        let (mut cross, mut power) = (0.0, 0.0);
        for (f, b) in forward.iter().zip(&backward) {
            for t in m..f.len() {
                cross += f[t] * b[t - 1];
                power += f[t] * f[t] + b[t - 1] * b[t - 1];
            }
        }
        let k = if power > 0.0 {
            2.0 * cross / power
        } else {
            0.0
        };
        for (f, b) in forward.iter_mut().zip(&mut backward) {
            for t in (m..f.len()).rev() {
                let (ft, bt) = (f[t], b[t - 1]);
                f[t] = ft - k * bt;
                b[t] = bt - k * ft;
            }
        }
        extend(&mut a, k);
        variance *= 1.0 - k * k;
        path.push(AutoRegression {
            coefficients: a.clone(),
            sd: variance.max(0.0).sqrt(),
        });
    }
    path
}

/// Turns a stationary autoregressive series into white noise of unit variance. Applied alike to the residual (or right-hand side) and to every regressor column
/// of a trial, it turns generalised least squares into ordinary least squares.
///
/// The first `p` samples are whitened with the predictors of lower order, so no sample is lost.
#[derive(Debug, Clone, PartialEq)]
pub struct Whitener {
    /// Predictor of order 0, 1, … p.
    predictors: Vec<Predictor>,
}

/// Coefficients of the samples before, the nearest first, with one over the standard deviation of the error.
pub type Predictor = (Vec<f64>, f64);

impl Whitener {
    /// The whitener of a model.
    ///
    /// # Errors
    /// [`NumericsError::OutOfRange`] if the model is not stationary or its `sd` not positive.
    pub fn new(model: &AutoRegression) -> Result<Self, NumericsError> {
        check_range("sd", model.sd, [f64::MIN_POSITIVE, f64::MAX])?;
        check_finite("coefficients", &model.coefficients)?;
        let mut a = model.coefficients.clone();
        let mut sd = model.sd;
        let mut predictors = vec![(a.clone(), 1.0 / sd)];
        while let Some(k) = a.pop() {
            check_range(
                "partial correlation of the model",
                k,
                [-1.0 + 1e-12, 1.0 - 1e-12],
            )?;
            let below = 1.0 - k * k;
            a = (0..a.len())
                .map(|i| (a[i] + k * a[a.len() - 1 - i]) / below)
                .collect();
            sd /= below.sqrt();
            predictors.push((a.clone(), 1.0 / sd));
        }
        predictors.reverse();
        Ok(Self { predictors })
    }

    /// The order of the model.
    pub fn order(&self) -> usize {
        self.predictors.len() - 1
    }

    /// Standard deviation of the innovations.
    pub fn innovation(&self) -> f64 {
        self.predictors
            .last()
            .map_or(0.0, |(_, inverse)| 1.0 / inverse)
    }

    /// The predictor from so many samples right before, at most as many as the model has coefficients.
    pub fn next(&self, count: usize) -> &Predictor {
        &self.predictors[count.min(self.order())]
    }

    /// The best linear predictor from the samples at some lags, nearest first, with one over the standard deviation of its error.
    ///
    /// Where samples are missing, each is predicted from as many known ones before it as the model has coefficients, at the lags that they
    /// have: exactly where none is missing, and nearly (Vecchia 1988) after a gap.
    pub fn predictor(&self, lags: &[usize]) -> Predictor {
        let is_next = lags.iter().enumerate().all(|(k, lag)| *lag == k + 1);
        if let Some(known) = self.predictors.get(lags.len()).filter(|_| is_next) {
            return known.clone();
        }
        let covariance = self.covariance(lags.last().copied().unwrap_or(0));
        let gram = Matrix::from_fn(lags.len(), lags.len(), |i, j| {
            covariance[lags[i].abs_diff(lags[j])]
        });
        let towards: Vec<f64> = lags.iter().map(|&lag| covariance[lag]).collect();
        let mut a = towards.clone();
        let factor = Qr::new(gram);
        factor.apply_transposed(&mut a);
        solve_upper(&factor.leading(lags.len()), lags.len(), &mut a);
        let known = dot(&a, &towards);
        // Never better known than from all that came before it.
        let best = self.innovation() * self.innovation();
        (a, 1.0 / (covariance[0] - known).max(best).sqrt())
    }

    /// Autocovariance at lags up to one: each from those below it, by the predictor of the highest order that they allow.
    fn covariance(&self, most: usize) -> Vec<f64> {
        let (_, inverse) = self.predictors[0];
        let mut covariance = vec![1.0 / (inverse * inverse)];
        for lag in 1..=most {
            let (a, _) = self.next(lag);
            let next = a.iter().enumerate();
            covariance.push(next.fold(0.0, |sum, (i, a)| sum + a * covariance[lag - 1 - i]));
        }
        covariance
    }
}

/// Levinson's step: from order m − 1 to m by the partial correlation `k`.
fn extend(a: &mut Vec<f64>, k: f64) {
    let m = a.len();
    *a = (0..m).map(|i| a[i] - k * a[m - 1 - i]).chain([k]).collect();
}

fn check(series: &[&[f64]], order: usize) -> Result<(), NumericsError> {
    series.iter().try_for_each(|s| check_finite("series", s))?;
    let longest = series.iter().map(|s| s.len()).max().unwrap_or(0);
    check_least("samples of the longest series", longest, order + 2)?;
    let varies = |s: &&&[f64]| centred(s).iter().any(|v| *v != 0.0);
    check_least("series that vary", series.iter().filter(varies).count(), 1)
}

fn centred(series: &[f64]) -> Vec<f64> {
    let mean = series.iter().sum::<f64>() / series.len().max(1) as f64;
    series.iter().map(|v| v - mean).collect()
}

/// `Σ_t x_t x_{t+k}`.
fn lagged(x: &[f64], k: usize) -> f64 {
    if k < x.len() {
        dot(&x[..x.len() - k], &x[k..])
    } else {
        0.0
    }
}
