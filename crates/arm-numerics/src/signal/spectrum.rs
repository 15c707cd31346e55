//! Lines in the spectrum of residuals: frequencies at which they oscillate in every trial.

use core::f64::consts::TAU;

use crate::statistics::distributions::chi_square_tail;

/// Highest frequency of the search for a line \[Hz\]: no muscle and no led arm oscillates faster.
const HIGHEST: f64 = 15.0;
/// Significance level of a line, over all frequencies and channels.
const CHANCE: f64 = 1e-6;
/// Distances at which the neighbourhood of a frequency starts and ends \[Hz\].
const AROUND: (f64, f64) = (0.3, 1.5);

/// One Fourier coefficient of a column, tapered by a Hann window.
pub fn coefficient(column: &[f64], frequency: f64, rate: f64) -> [f64; 2] {
    swing(&tapered(column), frequency, rate)
}

/// A column without its mean under a Hann window, scaled so that the coefficient of an oscillation is its amplitude.
fn tapered(column: &[f64]) -> Vec<f64> {
    let n = column.len() as f64;
    let mean = column.iter().sum::<f64>() / n;
    let one = |(i, value): (usize, &f64)| {
        let taper = 0.5 - 0.5 * libm::cos(TAU * (i as f64 + 0.5) / n);
        taper * (value - mean) * 4.0 / n
    };
    column.iter().enumerate().map(one).collect()
}

/// One Fourier coefficient of a tapered column.
fn swing(tapered: &[f64], frequency: f64, rate: f64) -> [f64; 2] {
    /// Samples over which a phase is advanced by rotation before it is computed anew, which limits the rounding error.
    const SAMPLES_PER_SINCOS: usize = 32;
    let (sin, cos) = libm::sincos(TAU * frequency / rate);
    let mut sum = [0.0; 2];
    for (chunk, values) in tapered.chunks(SAMPLES_PER_SINCOS).enumerate() {
        let phase = TAU * frequency * (chunk * SAMPLES_PER_SINCOS) as f64 / rate;
        let (mut s, mut c) = libm::sincos(phase);
        for value in values {
            sum[0] += value * c;
            sum[1] -= value * s;
            (s, c) = (s * cos + c * sin, c * cos - s * sin);
        }
    }
    sum
}

/// How oscillations of several trials are combined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sum {
    /// By their power: each may have a phase of its own.
    Powers,
    /// As they are: oscillations with the same phase in every trial add up; noise and the rest average out.
    Swings,
}

impl Sum {
    /// Power of one channel of all trials at a frequency.
    ///
    /// * `tapered` - the channel in every trial
    fn power(self, tapered: &[Vec<f64>], (frequency, rate): (f64, f64)) -> f64 {
        let count = tapered.len() as f64;
        let each = tapered.iter().map(|t| swing(t, frequency, rate));
        match self {
            Self::Powers => each.map(|[a, b]| a * a + b * b).sum::<f64>() / count,
            Self::Swings => {
                let [a, b] = each.fold([0.0; 2], |[a, b], [x, y]| [a + x, b + y]);
                (a * a + b * b) / (count * count)
            }
        }
    }

    fn freedom(self, trials: usize) -> usize {
        match self {
            Self::Powers => 2 * trials,
            Self::Swings => 2,
        }
    }
}

/// The strongest line: its frequency \[Hz\]; `None` when no line is significant.
///
/// * `trials` - channels of every trial, all at the same rate
/// * `lowest` - lowest frequency of the search \[Hz\]: below it movements have power of their own
///
/// Each channel's power over trials is compared with the upper quartile of its neighbourhood.
pub fn line(trials: &[&Vec<Vec<f64>>], rate: f64, lowest: f64, sum: Sum) -> Option<f64> {
    if trials.is_empty() {
        return None;
    }
    let shortest = trials.iter().map(|t| t[0].len()).min()?;
    let channels = trials[0].len();
    let step = 0.5 * rate / shortest as f64;
    let highest = HIGHEST.min(0.45 * rate);
    let count = ((highest - lowest) / step) as usize;
    let frequency = |k: usize| lowest + step * k as f64;
    let all = by_channel(trials, channels);
    let mut best: Option<(f64, f64)> = None;
    for channel in &all {
        let power: Vec<f64> = (0..count)
            .map(|k| sum.power(channel, (frequency(k), rate)))
            .collect();
        for k in 0..count {
            let around: Vec<f64> = (0..count)
                .filter(|&o| {
                    let apart = (frequency(o) - frequency(k)).abs();
                    apart > AROUND.0 && apart < AROUND.1
                })
                .map(|o| power[o])
                .collect();
            // Both sides must be there, or a slope would be taken for a line.
            let both = frequency(k) - AROUND.0 > lowest && frequency(k) + AROUND.0 < highest;
            if around.len() < 8 || !both {
                continue;
            }
            let mut sorted = around;
            sorted.sort_by(f64::total_cmp);
            // The upper quartile: red noise rises to one side.
            let level = sorted[sorted.len() * 3 / 4];
            let ratio = power[k] / level.max(f64::MIN_POSITIVE);
            let dof = sum.freedom(trials.len());
            let chance = chi_square_tail(ratio * dof as f64, dof) * (count * channels) as f64;
            if chance < CHANCE && best.is_none_or(|(most, _)| ratio > most) {
                best = Some((ratio, frequency(k)));
            }
        }
    }
    let (_, near) = best?;
    peak_of(&all, rate, (near, step), sum)
}

/// Each channel of every trial, tapered.
fn by_channel(trials: &[&Vec<Vec<f64>>], channels: usize) -> Vec<Vec<Vec<f64>>> {
    let of_channel = |c: usize| trials.iter().map(|t| tapered(&t[c])).collect();
    (0..channels).map(of_channel).collect()
}

/// The frequency near another at which all channels together have most power \[Hz\]; `None` without trials.
///
/// * `near` - that frequency, and how far from it is looked \[Hz\]: no further than the width of a line
pub fn peak(
    trials: &[&Vec<Vec<f64>>],
    rate: f64,
    (near, apart): (f64, f64),
    sum: Sum,
) -> Option<f64> {
    let channels = trials.first()?.len();
    peak_of(&by_channel(trials, channels), rate, (near, apart), sum)
}

/// The peak of tapered channels; see [`peak`].
fn peak_of(all: &[Vec<Vec<f64>>], rate: f64, (near, apart): (f64, f64), sum: Sum) -> Option<f64> {
    let square = |t: &Vec<f64>| t.iter().map(|v| v * v).sum::<f64>();
    let size = |channel: &Vec<Vec<f64>>| channel.iter().map(square).sum::<f64>();
    let sizes: Vec<f64> = all.iter().map(|c| size(c).max(f64::MIN_POSITIVE)).collect();
    // The peak of all channels together, on a finer grid.
    let total = |f: f64| -> f64 {
        let share = |(channel, size): (&Vec<_>, &f64)| sum.power(channel, (f, rate)) / size;
        std::iter::zip(all, &sizes).map(share).sum()
    };
    let fine = 0.1 * apart;
    let around = (-10..=10).map(|k| near + fine * f64::from(k));
    let (most, peak) = around
        .map(|f| (total(f), f))
        .max_by(|a, b| a.0.total_cmp(&b.0))?;
    // Between the points of the grid a parabola: over a trial, a frequency that is a little off turns out of phase.
    let [below, above] = [peak - fine, peak + fine].map(total);
    let curvature = below - 2.0 * most + above;
    let shift = if curvature < 0.0 {
        (0.5 * (below - above) / curvature).clamp(-1.0, 1.0)
    } else {
        0.0
    };
    Some(peak + fine * shift)
}
