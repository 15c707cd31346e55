//! Estimation of the noise of a session without repeats.

use arm_numerics::Matrix;

use crate::GapError;
use crate::candidates::library::Library;
use crate::data::course::Channels;
use crate::data::noise::{NoiseModel, dot};
use crate::hypothesis::priors;
use crate::linearization::linear_response::Response;
use crate::prepared_session::PreparedSession;
use crate::sensitivity::linearization_point::LinearizationPoint;
use crate::sensitivity::normal_equations::solve;

/// Samples of the common band, on either side, among which the size of what is left is measured.
const AROUND: usize = 32;

impl<const N: usize> PreparedSession<'_, N> {
    /// The noise by what no question could explain of a hypothesis' residuals.
    ///
    /// The errors of encoders and of a rigid model grow with the motion, so residuals of a decaying oscillation fall. Every
    /// sample is weighted by the residuals around it, with the mean over all as one sample more.
    ///
    /// * `range` - size of each channel, a share of which is the floor of the noise
    /// * `observable_share` - share of the samples of each channel that are observable
    pub(crate) fn noise_of_residuals(
        &self,
        point: &LinearizationPoint<N>,
        (range, observable_share): (&[f64], &[f64]),
    ) -> Result<NoiseModel, GapError> {
        let mut left = self.unexplained(point)?;
        let mut weights = vec![Channels::new(); self.courses.len()];
        let mean: Vec<f64> = (0..range.len())
            .map(|c| {
                let all = left.iter().flat_map(|l| &l[c]);
                let (sum, count) = all.fold((0.0, 0.0), |(s, n), v| (s + v * v, n + 1.0));
                f64::max(sum / f64::max(count, 1.0), f64::MIN_POSITIVE)
            })
            .collect();
        for (own, &trial) in left.iter_mut().zip(&self.fitted) {
            let samples: Vec<usize> = self.valid_segments[trial].samples().collect();
            let length = self.courses[trial].counted.len();
            for (channel, mean) in own.iter_mut().zip(&mean) {
                let weigh = |i: usize| {
                    let near = i.saturating_sub(AROUND)..(i + AROUND + 1).min(channel.len());
                    let count = near.len() as f64;
                    let square = channel[near].iter().map(|v| v * v).sum::<f64>();
                    libm::sqrt(mean * (count + 1.0) / (square + mean))
                };
                let local: Vec<f64> = (0..channel.len()).map(weigh).collect();
                for (value, weight) in channel.iter_mut().zip(&local) {
                    *value *= weight;
                }
                // Samples between are not compared; they get what stands before them.
                let mut whole = vec![1.0; length];
                for (k, weight) in local.iter().enumerate() {
                    let next = samples.get(k + 1).copied().unwrap_or(length);
                    whole[samples[k]..next].fill(*weight);
                }
                weights[trial].push(whole);
            }
        }
        NoiseModel::without_repeats(&left, range, (observable_share, weights))
    }

    /// What is left of residuals when everything that the catalogue could explain is taken out, to first order.
    ///
    /// Without repeats the noise is estimated from this alone: a residual with the missing effects in it would count
    /// them as noise.
    fn unexplained(&self, point: &LinearizationPoint<N>) -> Result<Vec<Vec<Vec<f64>>>, GapError> {
        let nuisances = self.responses_to(point, &point.coordinates)?;
        let library = Library::build(self, point, None)?;
        let columns: Vec<&Response> = nuisances
            .iter()
            .chain(library.responses.iter().flatten())
            .collect();
        let channels = self.session.channels();
        let size: Vec<f64> = (0..channels)
            .map(|c| {
                let all = point.residuals.iter().flat_map(|r| &r[c]);
                let (sum, count) = all.fold((0.0, 0.0), |(s, n), v| (s + v * v, n + 1.0));
                libm::sqrt(sum / f64::max(count, 1.0)).max(1e-12)
            })
            .collect();
        let rows = |channels: &Channels, trial: usize| -> Vec<f64> {
            let picked = self.valid_segments[trial].pick(channels);
            std::iter::zip(picked, &size)
                .flat_map(|(values, size)| values.into_iter().map(move |v| v / size))
                .collect()
        };
        let matrices = self.parallel(self.fitted.len(), |i| {
            let trial = self.fitted[i];
            let list: Vec<Vec<f64>> = columns
                .iter()
                .map(|r| rows(&r.0[self.group_of[trial]], trial))
                .collect();
            (list, rows(&point.residuals[i], trial))
        });
        let count = columns.len();
        let mut gram = Matrix::zeros(count, count);
        let mut score = vec![0.0; count];
        for (list, residual) in &matrices {
            for a in 0..count {
                for b in 0..count {
                    gram[(a, b)] += dot(&list[a], &list[b]);
                }
                score[a] += dot(&list[a], residual);
            }
        }
        for (i, prior) in priors(&point.hypothesis, &point.coordinates)
            .into_iter()
            .enumerate()
        {
            if let Some((distance, sd)) = prior {
                gram[(i, i)] += 1.0 / (sd * sd);
                score[i] -= distance / (sd * sd);
            }
        }
        // Columns repeat each other: a little of the diagonal settles how they share.
        for i in 0..count {
            gram[(i, i)] *= 1.0 + 1e-4;
        }
        let usable: Vec<usize> = (0..count).filter(|&i| gram[(i, i)] > 0.0).collect();
        let free = |_: usize| (f64::NEG_INFINITY, f64::INFINITY);
        let steps = solve(&gram, &score, &usable, &free).map(|(steps, _)| steps);
        let mut out = Vec::with_capacity(matrices.len());
        for (list, mut residual) in matrices {
            for (&i, step) in usable.iter().zip(steps.iter().flatten()) {
                for (r, c) in residual.iter_mut().zip(&list[i]) {
                    *r -= step * c;
                }
            }
            let count = residual.len() / channels;
            out.push(
                (0..channels)
                    .map(|c| {
                        let own = &residual[c * count..(c + 1) * count];
                        own.iter().map(|v| v * size[c]).collect()
                    })
                    .collect(),
            );
        }
        Ok(out)
    }
}
