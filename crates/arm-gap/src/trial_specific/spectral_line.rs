//! A line in the spectra of residuals: the noise beside it, its share, and what swings explain of it.

use nalgebra::{DMatrix, DVector};

use crate::measurement_model::prediction::Channels;
use arm_numerics::signal::spectrum::coefficient;

/// A frequency in the spectra of residuals.
pub(super) struct SpectralLine {
    /// \[Hz\]
    pub frequency: f64,
    /// Of the samples \[Hz\].
    pub rate: f64,
}

impl SpectralLine {
    /// The noise of a channel next to the line.
    pub fn noise_beside(&self, residuals: &[Channels], channel: usize) -> f64 {
        let beside = [-0.9, -0.6, 0.6, 0.9].map(|d| self.frequency + d);
        let powers = residuals.iter().flat_map(|r| {
            beside
                .iter()
                .map(move |&f| coefficient(&r[channel], f, self.rate))
                .map(|[a, b]| a * a + b * b)
        });
        let (sum, count) = powers.fold((0.0, 0.0), |(s, n), p| (s + p, n + 1.0));
        f64::max(sum / f64::max(count, 1.0), 1e-30)
    }

    /// Gram matrix and score of some swings in one trial: complex least squares as real ones, each swing turned by 0 and by 90°.
    pub fn normal_equations(
        &self,
        residual: &Channels,
        swings: &[Channels],
        noise: &[f64],
    ) -> (DMatrix<f64>, DVector<f64>) {
        let k = swings.len();
        let at_line =
            |column: &Channels, c: usize| coefficient(&column[c], self.frequency, self.rate);
        let mut gram = DMatrix::zeros(2 * k, 2 * k);
        let mut score = DVector::zeros(2 * k);
        for (c, noise) in noise.iter().enumerate() {
            let seen = at_line(residual, c);
            let turned: Vec<[f64; 2]> = swings
                .iter()
                .map(|column| at_line(column, c))
                .flat_map(|[a, b]| [[a, b], [-b, a]])
                .collect();
            for (a, x) in turned.iter().enumerate() {
                score[a] += (x[0] * seen[0] + x[1] * seen[1]) / noise;
                for (b, y) in turned.iter().enumerate() {
                    gram[(a, b)] += (x[0] * y[0] + x[1] * y[1]) / noise;
                }
            }
        }
        (gram, score)
    }

    /// Share of the line in the variance of a channel.
    pub fn share(&self, residuals: &[Channels], channel: usize) -> f64 {
        let (mut line, mut all) = (0.0, 0.0);
        for residual in residuals {
            let values = &residual[channel];
            let [a, b] = coefficient(values, self.frequency, self.rate);
            let count = values.len() as f64;
            line += 0.5 * (a * a + b * b);
            let mean = values.iter().sum::<f64>() / count;
            all += values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / count;
        }
        line / f64::max(all, 1e-300)
    }
}
