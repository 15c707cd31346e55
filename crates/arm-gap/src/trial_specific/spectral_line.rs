//! A line in the spectra of residuals: its share, the noise beside it, and the part that oscillations explain.

use arm_numerics::Matrix;

use crate::data::course::Channels;
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
    ) -> (Matrix, Vec<f64>) {
        let k = swings.len();
        let at_line =
            |column: &Channels, c: usize| coefficient(&column[c], self.frequency, self.rate);
        let mut gram = Matrix::zeros(2 * k, 2 * k);
        let mut score = vec![0.0; 2 * k];
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

#[cfg(test)]
mod tests {
    use core::f64::consts::TAU;

    use arm_numerics::Cholesky;

    use super::*;

    const LINE: SpectralLine = SpectralLine {
        frequency: 4.0,
        rate: 50.0,
    };

    /// Ten seconds of a swing of one frequency.
    fn swing(size: f64, frequency: f64, phase: f64) -> Vec<f64> {
        let at = |i: i32| size * libm::sin(TAU * frequency * f64::from(i) / 50.0 + phase);
        (0..500).map(at).collect()
    }

    #[test]
    fn a_line_has_the_share_of_its_square() {
        let both = std::iter::zip(swing(3.0, 4.0, 0.2), swing(4.0, 7.0, 0.0));
        let channel: Vec<f64> = both.map(|(a, b)| a + b + 5.0).collect();
        // 3² of 3² + 4²; a constant is no variance.
        assert!((LINE.share(&[vec![channel]], 0) - 0.36).abs() < 1e-3);
        assert!(LINE.share(&[vec![vec![5.0; 500]]], 0) < 1e-3);
    }

    #[test]
    fn noise_is_told_beside_the_line_and_not_on_it() {
        let on = LINE.noise_beside(&[vec![swing(3.0, 4.0, 0.0)]], 0);
        let beside = LINE.noise_beside(&[vec![swing(3.0, 4.6, 0.0)]], 0);
        assert!(on < 1e-3 * beside, "{on} {beside}");
        assert_eq!(LINE.noise_beside(&[], 0), 1e-30);
    }

    #[test]
    fn a_swing_is_found_with_its_size_and_phase() {
        let shown = vec![swing(2.0, 4.0, 0.0)];
        // Three times as large, and a quarter of a period earlier.
        let seen = vec![swing(6.0, 4.0, 0.25 * TAU)];
        let (gram, score) = LINE.normal_equations(&seen, &[shown], &[1.0]);
        let size = Cholesky::new(gram).expect("two columns").solve(&score);
        assert!(
            size[0].abs() < 1e-6 && (size[1].abs() - 3.0).abs() < 1e-6,
            "{size:?}"
        );
    }
}
