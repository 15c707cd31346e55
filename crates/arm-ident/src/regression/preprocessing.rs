//! Preprocessing of rows: the common low-pass, decimation, and weights.

use core::array::from_fn;
use std::collections::BTreeMap;

use crate::error::IdentError;
use crate::regression::measured_motion::low_pass;
use crate::regression::rows::RegressionRows;
use crate::regression::trial::Trial;
use arm_numerics::Condenser;
use arm_numerics::error::check_least;
use arm_numerics::signal::filter::{BothWays, Butterworth};
use arm_numerics::statistics::autoregressive::effective_samples;

/// Samples kept for each period of the cutoff frequency; a little above the two of the sampling theorem.
const SAMPLES_PER_PERIOD: f64 = 2.5;

/// Periods of the cutoff frequency that are dropped next to an end or a gap, where filters and differences extrapolate.
const MARGIN: f64 = 1.5;

/// Fewest decimated samples in a stretch that is used.
const SHORTEST: usize = 8;

/// Fewest samples that are built and filtered at once; a shorter trial is filtered as a whole.
const STRETCH: usize = 4096;
/// The same in lengths of the filter's decay, part of which is filtered twice.
const REACHES: usize = 4;

/// Rows after filtering and decimation, in pieces without a gap.
pub type Pieces = Vec<RegressionRows>;

/// The common low-pass of a trial and the samples that are kept.
pub(crate) struct Thinning {
    filter: Butterworth,
    /// A list for each piece.
    kept: Vec<Vec<usize>>,
    samples: usize,
}

impl Thinning {
    /// For rows that are low-passed at `cutoff` \[Hz\].
    ///
    /// # Errors
    /// [`IdentError`] for a trial too short for the filter.
    pub fn new<const N: usize>(trial: &Trial<N>, cutoff: f64) -> Result<Self, IdentError> {
        let filter = low_pass(cutoff, trial.rate)?;
        check_least("samples of column", trial.len(), filter.padding() + 1)?;
        let step = ((trial.rate / (SAMPLES_PER_PERIOD * cutoff)) as usize).max(1);
        let margin = ((MARGIN * trial.rate / cutoff) as usize).max(1);
        Ok(Self {
            filter,
            kept: kept_samples(&trial.valid, margin, step),
            samples: trial.len(),
        })
    }

    /// Samples in each piece.
    pub fn lengths(&self) -> Vec<usize> {
        self.kept.iter().map(Vec::len).collect()
    }

    /// Room for the samples before `end` that were not given yet, with the number of their piece.
    fn upto(
        &self,
        end: usize,
        (piece, before): &mut (usize, usize),
        room: impl Fn(&[usize]) -> RegressionRows,
    ) -> Vec<(usize, RegressionRows)> {
        let mut list = Vec::new();
        while let Some(samples) = self.kept.get(*piece) {
            let rest = &samples[*before..];
            let count = rest.partition_point(|&sample| sample < end);
            if count > 0 {
                list.push((*piece, room(&rest[..count])));
            }
            if count < rest.len() {
                *before += count;
                break;
            }
            (*piece, *before) = (*piece + 1, 0);
        }
        list
    }

    /// [`filtered`], none of it kept.
    ///
    /// * `take` - gets rows that are kept, in the order of time, and the number of their piece
    ///
    /// # Errors
    /// [`NumericsError::NotFinite`](arm_numerics::NumericsError::NotFinite), and what `take` refuses.
    pub fn stream<const N: usize>(
        &self,
        unknowns: usize,
        mut build: impl FnMut(usize) -> RegressionRows,
        mut take: impl FnMut(usize, RegressionRows) -> Result<(), IdentError>,
    ) -> Result<(), IdentError> {
        let stretch = STRETCH.max(REACHES * self.filter.reach());
        let mut smooth = BothWays::new(&self.filter, (unknowns + 1) * N);
        let (mut left, mut next) = (self.samples, (0, 0));
        while left > 0 {
            // A last one that is short would not hold what is mirrored at the end.
            let count = if left < 2 * stretch { left } else { stretch };
            left -= count;
            let last = left == 0;
            let from = smooth.given();
            let mut ready = self.upto(smooth.given_with(count, last), &mut next, |samples| {
                RegressionRows::zeros::<N>(unknowns, samples.to_vec())
            });
            let raw = build(count);
            let columns = raw.columns.iter().chain([&raw.rhs]);
            let columns: Vec<&[f64]> = columns.map(Vec::as_slice).collect();
            smooth.push::<N>(&columns, last, |channel, values| {
                let (u, j) = (channel / N, channel % N);
                for (_, rows) in &mut ready {
                    let RegressionRows {
                        columns,
                        rhs,
                        samples,
                        ..
                    } = rows;
                    let column = columns.get_mut(u).unwrap_or(rhs);
                    for (place, sample) in column[j..].iter_mut().step_by(N).zip(samples) {
                        *place = values.at(*sample - from);
                    }
                }
            })?;
            ready
                .into_iter()
                .try_for_each(|(piece, rows)| take(piece, rows))?;
        }
        Ok(())
    }
}

/// The same with what joints hold at rest, the column behind those of the unknowns, beside them.
pub fn with_rest_columns(mut pieces: Pieces, unknowns: usize) -> Pieces {
    for rows in &mut pieces {
        rows.held = (rows.columns.len() > unknowns)
            .then(|| rows.columns.pop())
            .flatten();
    }
    pieces
}

/// Low-passes all columns and the right-hand side of a trial alike, decimates, and drops samples near a gap or an end.
///
/// Rows are built one stretch at a time, so that those of the whole trial are never held in memory.
///
/// * `cutoff` - of the low-pass \[Hz\]
/// * `unknowns` - number of columns
/// * `build` - gives the rows of the next samples, as many as requested
///
/// # Errors
/// [`IdentError`] for a trial too short for the filter.
pub fn filtered<const N: usize>(
    trial: &Trial<N>,
    cutoff: f64,
    unknowns: usize,
    build: impl FnMut(usize) -> RegressionRows,
) -> Result<Pieces, IdentError> {
    let thinning = Thinning::new(trial, cutoff)?;
    let room = |n: &Vec<usize>| RegressionRows {
        columns: (0..unknowns)
            .map(|_| Vec::with_capacity(n.len() * N))
            .collect(),
        rhs: Vec::with_capacity(n.len() * N),
        samples: Vec::with_capacity(n.len()),
        fits: None,
        held: None,
    };
    let mut pieces: Pieces = thinning.kept.iter().map(room).collect();
    thinning.stream::<N>(unknowns, build, |piece, rows| {
        let whole = &mut pieces[piece];
        for (all, some) in whole.columns.iter_mut().zip(&rows.columns) {
            all.extend(some);
        }
        whole.rhs.extend(&rows.rhs);
        whole.samples.extend(&rows.samples);
        Ok(())
    })?;
    Ok(pieces)
}

/// Indices of the samples to keep, a list for each stretch that is at least `margin` away from gaps and ends.
///
/// They stand on one grid, so that repeats of which some have gaps are compared at the same samples.
fn kept_samples(valid: &[bool], margin: usize, step: usize) -> Vec<Vec<usize>> {
    let mut pieces = Vec::new();
    let mut current: Vec<usize> = Vec::new();
    let mut start = 0_usize;
    for i in 0..=valid.len() {
        if i < valid.len() && valid[i] {
            continue;
        }
        let mut at = margin + start.div_ceil(step) * step;
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
/// Where a movement was repeated, the covariance is that of the scatter between repeats, which is noise alone;
/// then joints that the same force noise disturbs are weighed together. Without repeats only one variance a joint is
/// taken from the residual: the lack of fit is in it too, and must not affect the estimate through cross-weights.
/// The correlation of rows in time is treated by the clustered covariance; here it only lowers the weight against the
/// prior.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TorqueCovariance<const N: usize> {
    /// Lower triangular, row-major \[1/(N m)\].
    inverse: [[f64; N]; N],
}

/// Share of the largest variance that is added to every joint, so that no combination of torques is weighted beyond the accuracy of the model.
pub(crate) const LEAST_SHARE: f64 = 1e-3;

impl<const N: usize> TorqueCovariance<N> {
    /// The same in every joint \[N m\].
    pub fn even(sd: f64) -> Self {
        Self::from_covariance(&core::array::from_fn(|j| {
            core::array::from_fn(|k| if j == k { sd * sd } else { 0.0 })
        }))
    }

    /// Rows as they are.
    pub(crate) fn none() -> Self {
        let one = |j, k| if j == k { 1.0 } else { 0.0 };
        Self {
            inverse: core::array::from_fn(|j| core::array::from_fn(|k| one(j, k))),
        }
    }

    /// From residuals, given as pieces of joint-interleaved values \[N m\].
    ///
    /// # Errors
    /// [`NumericsError::TooFew`](arm_numerics::NumericsError::TooFew) when a piece is too short.
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
    /// [`NumericsError::TooFew`](arm_numerics::NumericsError::TooFew) when a piece is too short.
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

    /// The same weights, lowered until the residuals are no larger than the noise: a lack of fit that the scatter of
    /// repeats does not contain limits the weight of the data against the prior.
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

    /// Folds rows into a factor, weighed.
    ///
    /// * `range` - samples of them
    ///
    /// # Errors
    /// [`NumericsError::NotFinite`](arm_numerics::NumericsError::NotFinite) for rows that are not finite.
    pub(crate) fn condense(
        &self,
        condenser: &mut Condenser,
        rows: &RegressionRows,
        range: core::ops::Range<usize>,
    ) -> Result<(), IdentError> {
        let width = rows.columns.len() + 1;
        let mut sample = vec![0.0; N * width];
        for i in range {
            for (u, values) in rows.columns.iter().chain([&rows.rhs]).enumerate() {
                let values = &values[i * N..(i + 1) * N];
                for j in 0..N {
                    sample[j * width + u] =
                        (0..=j).fold(0.0, |sum, k| sum + self.inverse[j][k] * values[k]);
                }
            }
            for row in sample.chunks_exact(width) {
                condenser.push(&row[..width - 1], row[width - 1])?;
            }
        }
        Ok(())
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

/// Deviations of what repeats measured, at rest too, from their mean, scaled by `√(n/(n−1))`; stretches of the samples that all have.
///
/// * `repeats` - filtered rows of trials of one movement
///
/// `None` unless there are at least three, and samples that all have.
pub fn repeat_deviations<const N: usize>(repeats: &[&Pieces]) -> Option<Vec<Vec<f64>>> {
    let n = repeats.len() as f64;
    if repeats.len() < 3 {
        return None;
    }
    // What each measured at a sample, if it has it.
    let own = |pieces: &Pieces| -> BTreeMap<usize, [f64; N]> {
        let each = |rows: &RegressionRows| {
            let at = |k: usize| from_fn(|j| rows.measured(k * N + j));
            let samples = rows.samples.iter().enumerate();
            samples.map(|(k, &i)| (i, at(k))).collect::<Vec<_>>()
        };
        pieces.iter().flat_map(each).collect()
    };
    let repeats: Vec<BTreeMap<usize, [f64; N]>> = repeats.iter().map(|p| own(p)).collect();
    let shared: Vec<usize> = repeats[0]
        .keys()
        .filter(|i| repeats.iter().all(|own| own.contains_key(i)))
        .copied()
        .collect();
    let step = shared.windows(2).map(|w| w[1] - w[0]).min()?;
    let mut all = Vec::new();
    for stretch in shared.chunk_by(|a, b| b - a == step) {
        if stretch.len() <= SHORTEST {
            continue;
        }
        let mean = |i: usize, j: usize| repeats.iter().map(|own| own[&i][j]).sum::<f64>() / n;
        let means: Vec<[f64; N]> = stretch.iter().map(|&i| from_fn(|j| mean(i, j))).collect();
        let correction = libm::sqrt(n / (n - 1.0));
        let apart = |own: &BTreeMap<usize, [f64; N]>| {
            let sample = |(&i, means): (&usize, &[f64; N])| -> [f64; N] {
                from_fn(|j| (own[&i][j] - means[j]) * correction)
            };
            stretch.iter().zip(&means).flat_map(sample).collect()
        };
        all.extend(repeats.iter().map(apart));
    }
    (!all.is_empty()).then_some(all)
}

/// Residual of rows at given parameters, joint-interleaved.
pub fn residual(rows: &RegressionRows, x: &[f64]) -> Vec<f64> {
    let mut out = rows.rhs.clone();
    for (column, &value) in rows.columns.iter().zip(x) {
        for (r, c) in out.iter_mut().zip(column) {
            *r -= c * value;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A repeat of one joint that measures `value` at every kept sample.
    fn repeat(valid: &[bool], value: impl Fn(usize) -> f64) -> Pieces {
        let rows = |samples: Vec<usize>| RegressionRows {
            columns: Vec::new(),
            rhs: samples.iter().map(|&i| value(i)).collect(),
            samples,
            fits: None,
            held: None,
        };
        kept_samples(valid, 10, 4).into_iter().map(rows).collect()
    }

    #[test]
    fn a_gap_of_one_repeat_leaves_the_scatter_of_the_samples_that_all_have() {
        let whole = vec![true; 400];
        let mut broken = whole.clone();
        broken[150..203].fill(false);
        let course = |offset: f64| move |i: usize| 0.3 * i as f64 + offset;
        let (a, b) = (repeat(&whole, course(0.0)), repeat(&whole, course(3.0)));
        let c = repeat(&broken, course(-3.0));
        let deviations = repeat_deviations::<1>(&[&a, &b, &c]).expect("shared samples");
        // Two stretches of three repeats, whose deviations are 0, 3 and -3 times √(3/2).
        assert_eq!(deviations.len(), 6);
        let count: usize = deviations[..3].iter().map(Vec::len).sum();
        assert_eq!(count, 3 * c[0].samples.len());
        for (values, offset) in deviations.iter().zip([0.0, 3.0, -3.0].iter().cycle()) {
            assert!(
                values
                    .iter()
                    .all(|v| (v - offset * 1.5_f64.sqrt()).abs() < 1e-12)
            );
        }
        // The scatter is that of whole repeats.
        let all = [&a, &b, &repeat(&whole, course(-3.0))];
        let complete = repeat_deviations::<1>(&all).expect("shared samples");
        let scatter = [&deviations, &complete].map(|d| second_moments::<1>(d)[0][0]);
        assert!((scatter[0] - scatter[1]).abs() < 1e-12);
        assert!(repeat_deviations::<1>(&[&a, &c]).is_none());
    }
}
