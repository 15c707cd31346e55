//! The noise of a data set, from deviations between repeats of one movement, and rows whitened with it.
//!
//! Residuals of filtered samples are never white. Each channel is an autoregression in time, the innovations of the
//! channels are correlated; both are read off repeats, where the model's errors cancel. Without repeats the residual of a
//! fit takes their place: what the model lacks is in it too, so that less is seen, not more.

use std::sync::Arc;

/// The one sum of products of this crate.
pub use arm_numerics::interleaved_dot as dot;
use arm_numerics::statistics::autoregressive::{AutoRegression, Whitener, effective_samples};

use crate::GapError;
use crate::data::course::{Channels, Course};
use crate::data::valid_segments::{Observable, SHORTEST, ValidSegments};
use crate::data::whitening::{Observed, Whitening};

/// Highest order of the autoregressions: every segment has as many samples.
const ORDER: usize = SHORTEST;
/// Floor of white noise as a share of a channel's range: the path between samples, quantisation and the model's own
/// simplifications are no better, however small the noise of the sensors is.
const LEAST: f64 = 5e-4;

/// Channels at the samples of a trial that are compared.
#[derive(Clone, Debug)]
pub struct Thinned {
    /// `[channel][sample]`; see [`ValidSegments::pick`].
    pub channels: Channels,
    /// How far each sample is from the one before it; see [`ValidSegments::spacing`].
    pub spacing: Vec<usize>,
    /// Channels at each; see [`ValidSegments::observable`].
    pub observable: Vec<Observable>,
}

impl From<Channels> for Thinned {
    /// Channels of which no sample is missing.
    fn from(channels: Channels) -> Self {
        let count = channels.first().map_or(0, Vec::len);
        Self {
            channels,
            spacing: vec![1; count],
            observable: Vec::new(),
        }
    }
}

impl Thinned {
    /// Of channels of a whole trial.
    pub fn of(channels: &Channels, valid_segments: &ValidSegments) -> Self {
        Self {
            channels: valid_segments.pick(channels),
            spacing: valid_segments.spacing(),
            observable: valid_segments.observable(),
        }
    }

    /// Which samples these are.
    pub fn observed(&self) -> Observed<'_> {
        Observed {
            spacing: &self.spacing,
            channels: &self.observable,
        }
    }

    /// The pieces of a channel between which samples are missing.
    fn runs<'a>(&self, channel: &'a [f64]) -> Vec<&'a [f64]> {
        let inner = (1..channel.len()).filter(|&t| self.spacing[t] > 1);
        let ends: Vec<usize> = inner.chain([channel.len()]).collect();
        let starts = std::iter::once(0).chain(ends.iter().copied());
        std::iter::zip(starts, &ends)
            .map(|(a, &b)| &channel[a..b])
            .collect()
    }
}

/// What makes rows white.
#[derive(Clone, Debug)]
pub struct NoiseModel {
    whiteners: Vec<Whitener>,
    /// What each sample weighs, by trial; nothing where all weigh the same.
    weights: Vec<Channels>,
    /// Inverse of the lower Cholesky factor of the innovations' correlation, row-major.
    mix: Vec<f64>,
}

impl NoiseModel {
    /// White noise of unit size, before it is estimated.
    ///
    /// # Errors
    /// None in practice: the model is valid.
    pub fn unknown(channels: usize) -> Result<Self, GapError> {
        let white = AutoRegression {
            coefficients: Vec::new(),
            sd: 1.0,
        };
        let mix = (0..channels * channels)
            .map(|i| if i % (channels + 1) == 0 { 1.0 } else { 0.0 })
            .collect();
        Ok(Self {
            whiteners: vec![Whitener::new(&white)?; channels],
            weights: Vec::new(),
            mix,
        })
    }

    /// From deviations.
    ///
    /// * `deviations` - of each trial, already scaled for the freedom that their mean took
    /// * `taken` - the like, whose products add up to the covariance of what was taken out of them and may have been noise
    /// * `range` - size of each channel, a share of which is the floor of the noise
    /// * `observable_share` - share of the samples of each channel that are observable; the others are zero
    ///
    /// # Errors
    /// [`GapError::Numerics`] for series too short.
    pub fn of(
        deviations: &[Thinned],
        taken: &[Thinned],
        range: &[f64],
        observable_share: &[f64],
    ) -> Result<Self, GapError> {
        let channels = range.len();
        let mut whiteners = Vec::with_capacity(channels);
        for (c, range) in range.iter().enumerate() {
            let least = (LEAST * range).max(1e-12);
            let rough = |d: &Thinned| roughened(&d.channels[c], least);
            let noisy: Vec<Vec<f64>> = deviations.iter().map(rough).collect();
            let pairs = std::iter::zip(deviations, &noisy);
            let series: Vec<&[f64]> = pairs.flat_map(|(d, own)| d.runs(own)).collect();
            let varies = series.iter().any(|s| s.iter().any(|v| *v != s[0]));
            let model = if varies {
                let taken = taken.iter().flat_map(|d| d.runs(&d.channels[c]));
                let taken: Vec<&[f64]> = taken.collect();
                let longest = series.iter().map(|s| s.len()).max().unwrap_or(0);
                let order = ORDER.min(longest.saturating_sub(2));
                let mut model = AutoRegression::selected_about_zero(&series, &taken, order)?;
                model.sd /= observable_share[c].max(1e-6).sqrt();
                model
            } else {
                AutoRegression {
                    coefficients: Vec::new(),
                    sd: least,
                }
            };
            whiteners.push(Whitener::new(&model)?);
        }
        let mut correlation = vec![0.0; channels * channels];
        let count: usize = deviations.iter().map(|d| d.spacing.len()).sum();
        for series in deviations.iter().chain(taken) {
            let white = whitened(&whiteners, series);
            for a in 0..channels {
                for b in 0..channels {
                    correlation[a * channels + b] += dot(&white[a], &white[b]);
                }
            }
        }
        for a in 0..channels {
            for b in 0..channels {
                let both = count as f64 * f64::min(observable_share[a], observable_share[b]);
                correlation[a * channels + b] /= f64::max(both, 1.0);
            }
            // The floor of white noise is independent between channels.
            correlation[a * (channels + 1)] = correlation[a * (channels + 1)].max(1.0);
        }
        Ok(Self {
            whiteners,
            weights: Vec::new(),
            mix: inverse_factor(&correlation, channels),
        })
    }

    /// The same as if channels did not vary together.
    pub fn uncorrelated(self) -> Self {
        let channels = self.whiteners.len();
        let mut correlation = vec![0.0; channels * channels];
        (0..channels).for_each(|a| correlation[a * (channels + 1)] = 1.0);
        Self {
            mix: inverse_factor(&correlation, channels),
            ..self
        }
    }

    /// Without repeats: white, as large as what is left, and larger by as much as it is correlated in time.
    ///
    /// An autoregression of what is left would take slow effects for noise.
    ///
    /// * `deviations` - what is left, already weighed
    /// * `weights` - of every sample, by trial and channel
    ///
    /// # Errors
    /// [`GapError::Numerics`] for series too short.
    pub fn without_repeats(
        deviations: &[Vec<Vec<f64>>],
        range: &[f64],
        (observable_share, weights): (&[f64], Vec<Channels>),
    ) -> Result<Self, GapError> {
        let mut noise = Self {
            weights,
            ..Self::unknown(range.len())?
        };
        for (c, range) in range.iter().enumerate() {
            let (mut square, mut count, mut effective) = (0.0, 0.0, 0.0);
            for series in deviations {
                square += dot(&series[c], &series[c]);
                count += observable_share[c] * series[c].len() as f64;
                effective += observable_share[c] * effective_samples(&series[c])?.max(1.0);
            }
            let variance = square / f64::max(count, 1.0) * count / f64::max(effective, 1.0);
            let model = AutoRegression {
                coefficients: Vec::new(),
                sd: libm::sqrt(variance).max((LEAST * range).max(1e-12)),
            };
            noise.whiteners[c] = Whitener::new(&model)?;
        }
        Ok(noise)
    }

    /// The same with what the samples of each trial weigh, where that differs from trial to trial.
    pub fn weighed<const N: usize>(self, courses: &[Arc<Course<N>>]) -> Self {
        if courses.iter().all(|course| course.weight == 1.0) {
            return self;
        }
        let channels = self.whiteners.len();
        let weights =
            |course: &Arc<Course<N>>| vec![vec![course.weight; course.counted.len()]; channels];
        Self {
            weights: courses.iter().map(weights).collect(),
            ..self
        }
    }

    /// The same for other trials than those it was read off: there every sample weighs the same.
    pub fn of_others(&self) -> Self {
        Self {
            whiteners: self.whiteners.clone(),
            weights: Vec::new(),
            mix: self.mix.clone(),
        }
    }

    /// How the samples of a trial are made white.
    pub fn whitening(&self, valid_segments: &ValidSegments) -> Whitening {
        let (spacing, observable) = (valid_segments.spacing(), valid_segments.observable());
        self.whitening_at(Observed {
            spacing: &spacing,
            channels: &observable,
        })
    }

    /// The same of samples that are thinned already.
    pub fn whitening_at(&self, observed: Observed<'_>) -> Whitening {
        Whitening::new(&self.whiteners, observed)
    }

    /// Whitens sets of channels at the samples of a trial; the rows of all channels, one after the other.
    pub fn white_at(&self, valid_segments: &ValidSegments) -> impl Fn(&Channels) -> Vec<f64> {
        let whitening = self.whitening(valid_segments);
        move |channels| self.rows(valid_segments.pick(channels), &whitening)
    }

    /// Whitens a set of channels of one trial, whose samples weigh as they do there.
    ///
    /// * `whitening` - of the samples
    pub fn whiten_in(
        &self,
        trial: usize,
        channels: &Channels,
        (valid_segments, whitening): (&ValidSegments, &Whitening),
    ) -> Vec<f64> {
        let mut row = self.rows(valid_segments.pick(channels), whitening);
        if let Some(weights) = self.weights.get(trial) {
            let each = weights
                .iter()
                .flat_map(|w| valid_segments.samples().map(|i| w[i]));
            for (value, weight) in row.iter_mut().zip(each) {
                *value *= weight;
            }
        }
        row
    }

    /// The rows of channels at the samples of a whitening, made white there: each channel by itself, then free of what it shares with
    /// those before it.
    pub fn rows(&self, mut rows: Channels, whitening: &Whitening) -> Vec<f64> {
        whitening.apply(&mut rows);
        let n = self.whiteners.len();
        // From the last channel up: each row needs those before it unmixed.
        for c in (0..n).rev() {
            for i in (0..rows[c].len()).filter(|&i| whitening.is_observable((c, i))) {
                rows[c][i] = (0..=c).fold(0.0, |s, b| s + self.mix[c * n + b] * rows[b][i]);
            }
        }
        rows.into_iter().flatten().collect()
    }
}

/// Each channel of a series, whitened by itself.
fn whitened(whiteners: &[Whitener], series: &Thinned) -> Channels {
    let mut white = series.channels.clone();
    Whitening::new(whiteners, series.observed()).apply(&mut white);
    white
}

/// A series with white noise of a given size on it, the same in every run.
fn roughened(series: &[f64], size: f64) -> Vec<f64> {
    let mut state: u64 = 0x9e37_79b9_7f4a_7c15;
    let mut uniform = || {
        // Knuth's multiplier; the upper bits are good enough for a floor of noise.
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    // A uniform number between −½ and ½ has the variance 1/12.
    let scale = size * libm::sqrt(12.0);
    series.iter().map(|v| v + scale * uniform()).collect()
}

/// Inverse of the lower Cholesky factor; a little of the diagonal is added where channels repeat each other.
fn inverse_factor(correlation: &[f64], n: usize) -> Vec<f64> {
    /// Share of the diagonal that is added: a channel that repeats another makes the matrix singular.
    const RIDGE: f64 = 1e-3;
    let mut lower = vec![0.0; n * n];
    for j in 0..n {
        for k in 0..=j {
            let ridge = if j == k {
                RIDGE * correlation[j * n + j].max(1e-6)
            } else {
                0.0
            };
            let mut value = correlation[j * n + k] + ridge;
            for i in 0..k {
                value -= lower[j * n + i] * lower[k * n + i];
            }
            lower[j * n + k] = if j == k {
                value.max(1e-9).sqrt()
            } else {
                value / lower[k * n + k]
            };
        }
    }
    let mut inverse = vec![0.0; n * n];
    for column in 0..n {
        for j in column..n {
            let mut value = if j == column { 1.0 } else { 0.0 };
            for k in column..j {
                value -= lower[j * n + k] * inverse[k * n + column];
            }
            inverse[j * n + column] = value / lower[j * n + j];
        }
    }
    inverse
}

/// Columns made orthogonal to each other, one after the other; those that add nothing are left out.
pub fn orthogonal(columns: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for mut column in columns {
        let before = dot(&column, &column);
        project_off(&mut column, &basis);
        if dot(&column, &column) > 1e-9 * before {
            basis.push(column);
        }
    }
    basis
}

/// Takes the least-squares share of orthogonal columns out of rows.
pub fn project_off(rows: &mut [f64], basis: &[Vec<f64>]) {
    for column in basis {
        let share = dot(rows, column) / dot(column, column);
        for (v, c) in rows.iter_mut().zip(column) {
            *v -= share * c;
        }
    }
}

#[cfg(test)]
mod tests {
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::{RngCore, SeedableRng};

    use super::*;
    use crate::data::course::tests::resting;

    #[test]
    fn samples_of_a_movement_whose_path_is_not_known_weigh_less() {
        let mut session = resting(100.0);
        session.trials[0].q[50][0] = 1.0;
        session.weights = vec![0.25];
        let course = Arc::new(session.course(0).expect("a course"));
        let samples = ValidSegments::of(&session.trials[0], &course, &[], Arc::default());
        let noise = NoiseModel::unknown(4).expect("a model");
        let noise = noise.weighed(std::slice::from_ref(&course));
        let compared = (&samples, &noise.whitening(&samples));
        let weighed = noise.whiten_in(0, &course.seen, compared);
        let plain = noise.of_others().whiten_in(0, &course.seen, compared);
        assert!(plain.iter().any(|v| *v != 0.0));
        assert!(std::iter::zip(&weighed, &plain).all(|(w, p)| *w == 0.25 * p));
    }

    /// Sums of whitened rows have at most the variance that independent rows would have: the floor of white noise must not be
    /// removed where channels are made independent.
    #[test]
    fn slow_noise_below_the_floor_is_not_better_known_than_it_is() {
        const CHANNELS: usize = 3;
        const N: usize = 90;
        const RHO: f64 = 0.92;
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let mut normal = || {
            // Twelve uniform numbers have the variance 1.
            let sum: f64 = (0..12)
                .map(|_| (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64)
                .sum();
            sum - 6.0
        };
        let size = 1.5e-4;
        let mut slow = || {
            let mut x = size * normal();
            let step = size * (1.0 - RHO * RHO).sqrt();
            (0..N)
                .map(|_| {
                    let now = x;
                    x = RHO * x + step * normal();
                    now
                })
                .collect::<Vec<f64>>()
        };
        let mut one = || (0..CHANNELS).map(|_| slow()).collect::<Channels>();
        let series: Vec<Thinned> = (0..400).map(|_| one().into()).collect();
        let noise = NoiseModel::of(&series, &[], &[1.0; CHANNELS], &[1.0; CHANNELS]).unwrap();
        for c in 0..CHANNELS {
            let squares = series.iter().map(|s| {
                let whitening = noise.whitening_at(s.observed());
                let rows = noise.rows(s.channels.clone(), &whitening);
                let sum: f64 = rows[c * N..(c + 1) * N].iter().sum();
                sum * sum / N as f64
            });
            let variance = squares.sum::<f64>() / series.len() as f64;
            // Yule and Walker's equations of fourth order for slow and white noise together leave 1.22.
            assert!(variance < 1.3, "{variance}");
        }
    }

    /// Of two channels that are one, the second adds what the ridge of a thousandth leaves it.
    #[test]
    fn a_channel_that_repeats_another_counts_as_a_thousandth_allows() {
        let inverse = inverse_factor(&[1.0; 4], 2);
        let second = 1.0 / libm::sqrt(1.001 - 1.0 / 1.001);
        assert!((inverse[3] - second).abs() < 1e-9 * second, "{inverse:?}");
        assert!((inverse[0] - 1.0 / libm::sqrt(1.001)).abs() < 1e-12);
    }
}
