//! From raw rows to those that are fitted: the common low-pass, decimation, and weights.

use crate::coloured::effective_samples;
use crate::equation::Rows;
use crate::error::IdentError;
use crate::motion::low_pass;
use crate::trial::Trial;

/// Samples kept for each period of the cutoff frequency; a little above the two that the sampling theorem asks for.
const SAMPLES_PER_PERIOD: f64 = 2.5;

/// Periods of the cutoff frequency that are dropped next to an end or a gap, where filters and differences have guessed.
const MARGIN: f64 = 1.5;

/// Fewest decimated samples in a stretch that is used.
const SHORTEST: usize = 8;

/// Columns that are filtered together.
const TOGETHER: usize = 4;

/// Rows after filtering and decimation, in pieces without a gap.
pub type Pieces = Vec<Rows>;

/// Low-passes all columns and the right-hand side alike, keeps one sample in some, and drops what a gap or an end has touched.
///
/// # Errors
/// [`IdentError`] for a trial too short for the filter.
pub fn filtered<const N: usize>(
    rows: &Rows,
    trial: &Trial<N>,
    cutoff: f64,
) -> Result<Pieces, IdentError> {
    let filter = low_pass(cutoff, trial.rate)?;
    let step = ((trial.rate / (SAMPLES_PER_PERIOD * cutoff)) as usize).max(1);
    let margin = ((MARGIN * trial.rate / cutoff) as usize).max(1);
    let mut pieces: Pieces = kept_samples(&trial.valid, margin, step)
        .into_iter()
        .map(|samples| Rows {
            columns: Vec::with_capacity(rows.columns.len()),
            rhs: Vec::new(),
            fits: rows.fits.as_ref().map(|fits| {
                let of_sample = |&i: &usize| &fits[i * N..(i + 1) * N];
                samples.iter().flat_map(of_sample).copied().collect()
            }),
            samples,
        })
        .collect();
    // Some columns at a time: side by side they are filtered faster, and few of full length are held at once.
    let all: Vec<&Vec<f64>> = rows.columns.iter().chain([&rows.rhs]).collect();
    for group in all.chunks(TOGETHER) {
        let channels: Vec<Vec<f64>> = group
            .iter()
            .flat_map(|values| (0..N).map(|j| values.iter().skip(j).step_by(N).copied().collect()))
            .collect();
        let smooth = filter.both_ways_all(&channels)?;
        for column in smooth.chunks_exact(N) {
            for piece in &mut pieces {
                let sample = |&i: &usize| column.iter().map(move |channel| channel[i]);
                piece
                    .columns
                    .push(piece.samples.iter().flat_map(sample).collect());
            }
        }
    }
    for piece in &mut pieces {
        piece.rhs = piece.columns.pop().unwrap_or_default();
    }
    Ok(pieces)
}

/// Indices of the samples to keep, a list for each stretch that is at least `margin` away from gaps and ends.
fn kept_samples(valid: &[bool], margin: usize, step: usize) -> Vec<Vec<usize>> {
    let mut pieces = Vec::new();
    let mut current: Vec<usize> = Vec::new();
    let mut start = 0;
    for i in 0..=valid.len() {
        if i < valid.len() && valid[i] {
            continue;
        }
        let mut at = start + margin;
        while at + margin < i {
            current.push(at);
            at += step;
        }
        if current.len() > SHORTEST {
            pieces.push(core::mem::take(&mut current));
        }
        current.clear();
        start = i + 1;
    }
    pieces
}

/// How much the rows weigh: the inverse Cholesky factor of the covariance of one sample's torques.
///
/// Where a movement was repeated, the covariance is that of the scatter between repeats, which is noise and nothing else;
/// then joints that the same force noise disturbs are weighed together. Without repeats only one variance a joint is
/// taken from the residual: what a model lacks is in it too, and must not steer the estimate through the weights.
/// That rows are not independent in time is left to the clustered covariance; here it only lowers the weight against the
/// prior.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise<const N: usize> {
    /// Lower triangular, row-major \[1/(N m)\].
    inverse: [[f64; N]; N],
}

/// Share of the largest variance that is added to every joint, so that no combination of torques is trusted beyond the model.
const LEAST_SHARE: f64 = 1e-3;

impl<const N: usize> Noise<N> {
    /// The same in every joint \[N m\].
    pub fn even(sd: f64) -> Self {
        Self::from_covariance(&core::array::from_fn(|j| {
            core::array::from_fn(|k| if j == k { sd * sd } else { 0.0 })
        }))
    }

    /// From residuals, given as pieces of joint-interleaved values \[N m\].
    ///
    /// # Errors
    /// [`IdentError::TooFew`] when a piece is too short.
    pub fn of_residuals(residuals: &[Vec<f64>]) -> Result<Self, IdentError> {
        let mut covariance = second_moments::<N>(residuals);
        let shrink = redundancy::<N>(residuals)?;
        for j in 0..N {
            for k in 0..N {
                covariance[j][k] = if j == k {
                    covariance[j][j] * shrink[j]
                } else {
                    0.0
                };
            }
        }
        Ok(Self::from_covariance(&covariance))
    }

    /// From deviations of repeats from their mean, already corrected for the freedom that the mean took.
    ///
    /// # Errors
    /// [`IdentError::TooFew`] when a piece is too short.
    pub fn of_repeats(deviations: &[Vec<f64>]) -> Result<Self, IdentError> {
        let mut covariance = second_moments::<N>(deviations);
        let shrink = redundancy::<N>(deviations)?.into_iter().fold(1.0, f64::max);
        covariance.iter_mut().flatten().for_each(|v| *v *= shrink);
        Ok(Self::from_covariance(&covariance))
    }

    /// Of all that residuals have in common between joints, as if they were independent in time.
    pub fn of_all(residuals: &[Vec<f64>]) -> Self {
        Self::from_covariance(&second_moments::<N>(residuals))
    }

    fn from_covariance(covariance: &[[f64; N]; N]) -> Self {
        let largest = (0..N)
            .map(|j| covariance[j][j])
            .fold(f64::MIN_POSITIVE, f64::max);
        let mut lower = [[0.0; N]; N];
        for j in 0..N {
            for k in 0..=j {
                let mut value = covariance[j][k] + if j == k { LEAST_SHARE * largest } else { 0.0 };
                for i in 0..k {
                    value -= lower[j][i] * lower[k][i];
                }
                lower[j][k] = if j == k {
                    value.max(LEAST_SHARE * largest).sqrt()
                } else {
                    value / lower[k][k]
                };
            }
        }
        let mut inverse = [[0.0; N]; N];
        for column in 0..N {
            for j in column..N {
                let mut value = if j == column { 1.0 } else { 0.0 };
                for k in column..j {
                    value -= lower[j][k] * inverse[k][column];
                }
                inverse[j][column] = value / lower[j][j];
            }
        }
        Self { inverse }
    }

    /// The same weights, lowered until the residuals are no larger than the noise: what repeats do not show but the
    /// model cannot explain limits how far data may overrule what is known beforehand.
    pub fn at_least(mut self, residuals: &[Vec<f64>]) -> Self {
        let (mut sum, mut count) = (0.0, 0.0);
        for sample in residuals.iter().flat_map(|p| p.chunks_exact(N)) {
            for j in 0..N {
                let value = (0..=j).fold(0.0, |sum, k| sum + self.inverse[j][k] * sample[k]);
                sum += value * value;
                count += 1.0;
            }
        }
        let excess = libm::sqrt(sum / f64::max(count, 1.0));
        if excess > 1.0 {
            self.inverse.iter_mut().flatten().for_each(|v| *v /= excess);
        }
        self
    }

    /// Logarithm of the covariance's determinant.
    pub fn log_determinant(&self) -> f64 {
        (0..N).map(|j| -2.0 * libm::log(self.inverse[j][j])).sum()
    }

    /// Weighs rows in place.
    pub fn weigh(&self, rows: &mut Rows) {
        for values in rows.columns.iter_mut().chain([&mut rows.rhs]) {
            for sample in values.chunks_exact_mut(N) {
                // From the last joint up: each row needs those before it unchanged.
                for j in (0..N).rev() {
                    sample[j] = (0..=j).fold(0.0, |sum, k| sum + self.inverse[j][k] * sample[k]);
                }
            }
        }
    }
}

/// Mean products of the joints' values.
fn second_moments<const N: usize>(pieces: &[Vec<f64>]) -> [[f64; N]; N] {
    let mut sum = [[0.0; N]; N];
    let mut count = 0.0;
    for sample in pieces.iter().flat_map(|p| p.chunks_exact(N)) {
        count += 1.0;
        for j in 0..N {
            for k in 0..N {
                sum[j][k] += sample[j] * sample[k];
            }
        }
    }
    sum.map(|row| row.map(|v| v / f64::max(count, 1.0)))
}

/// Samples for each effective sample, by joint; at least one.
fn redundancy<const N: usize>(pieces: &[Vec<f64>]) -> Result<[f64; N], IdentError> {
    let mut out = [1.0; N];
    for (j, value) in out.iter_mut().enumerate() {
        let (mut count, mut effective) = (0.0, 0.0);
        for piece in pieces {
            let series: Vec<f64> = piece.iter().skip(j).step_by(N).copied().collect();
            count += series.len() as f64;
            effective += effective_samples(&series)?.max(1.0);
        }
        *value = f64::max(count / effective, 1.0);
    }
    Ok(out)
}

/// Deviations of the right-hand sides of repeats from their mean, scaled by `√(n/(n−1))`.
///
/// * `repeats` - filtered rows of trials of one movement
///
/// `None` unless there are at least three, all with the same samples in one piece.
pub fn repeat_deviations(repeats: &[&Pieces]) -> Option<Vec<Vec<f64>>> {
    let n = repeats.len();
    let first = repeats.first()?.first()?;
    if n < 3
        || repeats
            .iter()
            .any(|p| p.len() != 1 || p[0].samples != first.samples)
    {
        return None;
    }
    let mean = |i: usize| repeats.iter().map(|p| p[0].rhs[i]).sum::<f64>() / n as f64;
    let correction = libm::sqrt(n as f64 / (n as f64 - 1.0));
    let means: Vec<f64> = (0..first.rhs.len()).map(mean).collect();
    let deviation = |p: &&Pieces| {
        p[0].rhs
            .iter()
            .zip(&means)
            .map(|(v, m)| (v - m) * correction)
            .collect()
    };
    Some(repeats.iter().map(deviation).collect())
}

/// Residual of rows at given parameters, joint-interleaved.
pub fn residual(rows: &Rows, x: &[f64]) -> Vec<f64> {
    let mut out = rows.rhs.clone();
    for (column, &value) in rows.columns.iter().zip(x) {
        for (r, c) in out.iter_mut().zip(column) {
            *r -= c * value;
        }
    }
    out
}
