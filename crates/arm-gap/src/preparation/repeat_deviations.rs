//! Deviations of the repeats of a movement from their mean, from which the noise is estimated.

use crate::data::course::Channels;
use crate::data::noise::{Thinned, orthogonal, project_off};
use crate::data::valid_segments::ValidSegments;
use crate::prepared_session::PreparedSession;
use crate::sensitivity::linearization_point::LinearizationPoint;

/// Mean square of a deviation, in medians of those of all trials, beyond which it is not noise: a sensor
/// that slipped, a muscle that acted.
const OUTLIER: f64 = 25.0;
/// Part of all trials that are left out for that at most.
const MOST: f64 = 0.25;

/// Repeats of one movement: the channels of each at the samples that they share.
pub(crate) struct Repeats {
    /// The movement.
    pub group: usize,
    /// The samples.
    pub samples: ValidSegments,
    /// Channels of each trial.
    trials: Vec<Channels>,
    /// What channels show of whatever differs from trial to trial without being noise, such as how the hand holds the handle.
    shifts: Vec<Channels>,
}

impl Repeats {
    /// What each trial differs by from the mean of all, scaled to the noise of one trial.
    pub fn deviations(&self) -> Vec<Thinned> {
        let n = self.trials.len() as f64;
        let scale = libm::sqrt(n / (n - 1.0));
        let off = |c: usize, i: usize, value: f64| {
            let mean = self.trials.iter().map(|t| t[c][i]).sum::<f64>() / n;
            scale * (value - mean)
        };
        let (spacing, observable) = (self.samples.spacing(), self.samples.observable());
        let one = |trial: &Channels| {
            let channels = trial.iter().enumerate();
            let off = channels
                .map(|(c, own)| own.iter().enumerate().map(|(i, v)| off(c, i, *v)).collect());
            Thinned {
                channels: off.collect(),
                spacing: spacing.clone(),
                observable: observable.clone(),
            }
        };
        self.trials.iter().map(one).collect()
    }
}

impl<const N: usize> PreparedSession<'_, N> {
    /// The repeats of every movement that has some, without trials that differ from theirs by far more than trials usually do.
    pub(crate) fn repeats(&self, point: &LinearizationPoint<N>) -> Vec<Repeats> {
        let of_group = |group: usize| {
            let (members, samples) = self.agreeing(group)?;
            let trials = members
                .iter()
                .map(|&m| samples.pick(&point.residuals[m]))
                .collect();
            let own = point.own.iter();
            let shifts = own.map(|r| samples.pick(&r.0[group])).collect();
            Some(Repeats {
                group,
                samples,
                trials,
                shifts,
            })
        };
        let groups = (0..self.references.len()).filter_map(of_group);
        usual(groups.filter(|g| g.trials.len() > 1).collect())
    }
}

/// Repeats without outliers, the furthest first.
fn usual(mut repeats: Vec<Repeats>) -> Vec<Repeats> {
    let all: usize = repeats.iter().map(|r| r.trials.len()).sum();
    for _ in 0..(MOST * all as f64) as usize {
        let Some((group, trial)) = outlier(&repeats) else {
            break;
        };
        repeats[group].trials.remove(trial);
        repeats.retain(|r| r.trials.len() > 1);
    }
    repeats
}

/// The group and the place in it of the trial that differs most from its repeats, where that is far more than usual: by more than the hand
/// holds the handle elsewhere, which in most rigs is more than noise.
fn outlier(repeats: &[Repeats]) -> Option<(usize, usize)> {
    /// Part of a channel's mean square that is rounding.
    const ROUNDING: f64 = 1e-12;
    let deviations: Vec<Vec<Thinned>> = repeats.iter().map(Repeats::deviations).collect();
    let squares_of = |d: &Thinned| d.channels.iter().map(|c| mean_square(c)).collect();
    let whole: Vec<Vec<f64>> = deviations.iter().flatten().map(squares_of).collect();
    let units: Vec<f64> = medians(&whole)
        .into_iter()
        .map(|median| libm::sqrt(median).max(f64::MIN_POSITIVE))
        .collect();
    let mut places = Vec::new();
    let mut squares: Vec<Vec<f64>> = Vec::new();
    for (group, own) in deviations.iter().enumerate() {
        let shifts = repeats[group].shifts.iter();
        let shifts = orthogonal(shifts.map(|shift| in_units(shift, &units)).collect());
        for (trial, deviation) in own.iter().enumerate() {
            let mut left = in_units(&deviation.channels, &units);
            project_off(&mut left, &shifts);
            let channels = left.chunks(deviation.channels[0].len().max(1));
            places.push((group, trial));
            squares.push(channels.map(mean_square).collect());
        }
    }
    let usual = medians(&squares);
    let far = (0..usual.len()).filter_map(|c| {
        let most = (0..squares.len()).max_by(|&a, &b| squares[a][c].total_cmp(&squares[b][c]))?;
        let own = squares[most][c];
        let is_far = own > OUTLIER * usual[c] && own > ROUNDING;
        is_far.then(|| (own / usual[c], places[most]))
    });
    far.max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, place)| place)
}

/// Channels one after the other, each in a unit of its own.
fn in_units(channels: &Channels, units: &[f64]) -> Vec<f64> {
    let scaled = std::iter::zip(channels, units);
    let scaled = scaled.flat_map(|(channel, unit)| channel.iter().map(move |v| v / unit));
    scaled.collect()
}

fn mean_square(series: &[f64]) -> f64 {
    let sum: f64 = series.iter().map(|v| v * v).sum();
    sum / series.len().max(1) as f64
}

/// The median of each column.
fn medians(rows: &[Vec<f64>]) -> Vec<f64> {
    let columns = rows.first().map_or(0, Vec::len);
    let median = |c: usize| {
        let mut sorted: Vec<f64> = rows.iter().map(|row| row[c]).collect();
        sorted.sort_by(f64::total_cmp);
        sorted[sorted.len() / 2]
    };
    (0..columns).map(median).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trial_that_slips_tells_nothing_of_noise() {
        let trial = |seed: usize, slip: f64| {
            let noise = |i: usize| libm::sin((i * i + 7 * seed * i + 13 * seed) as f64);
            vec![
                (0..50)
                    .map(|i| noise(i) + if i > 30 { slip } else { 0.0 })
                    .collect::<Vec<f64>>(),
            ]
        };
        let group = |group: usize, slip: f64| Repeats {
            group,
            samples: ValidSegments::default(),
            trials: (0..3)
                .map(|k| trial(3 * group + k, if k == 1 { slip } else { 0.0 }))
                .collect(),
            shifts: Vec::new(),
        };
        let sizes = |slip| -> Vec<usize> {
            let kept = usual(
                (0..4)
                    .map(|g| group(g, if g == 2 { slip } else { 0.0 }))
                    .collect(),
            );
            kept.iter().map(|r| r.trials.len()).collect()
        };
        assert_eq!(sizes(0.0), [3, 3, 3, 3]);
        assert_eq!(sizes(20.0), [3, 3, 2, 3]);
    }

    /// Pairs of trials that differ by a constant in each of two channels: the squares of both go as that of the constant.
    fn pairs(distances: &[[f64; 2]]) -> Vec<Repeats> {
        let channels = |of: &[f64; 2], share: f64| of.map(|d| vec![share * d; 20]).into();
        let one = |(group, distance): (usize, &[f64; 2])| Repeats {
            group,
            samples: ValidSegments::default(),
            trials: [0.0, 1.0].map(|share| channels(distance, share)).into(),
            shifts: Vec::new(),
        };
        distances.iter().enumerate().map(one).collect()
    }

    #[test]
    fn an_outlier_is_five_times_as_far_off_as_others_and_a_quarter_of_the_trials_at_most() {
        let kept = |far: &[[f64; 2]], near: usize| {
            let near = vec![[1.0; 2]; near];
            usual(pairs(&[far, &near].concat())).len()
        };
        assert_eq!(kept(&[[4.9, 1.0]], 3), 4);
        assert_eq!(kept(&[[5.1, 1.0]], 3), 3);
        // Of 24 trials six may go, though each of seven is far off in one channel.
        let far = [vec![[10.0, 1.0]; 3], vec![[1.0, 10.0]; 4]].concat();
        assert_eq!((kept(&far[2..], 7), kept(&far, 5)), (7, 6));
    }

    /// Every hand holds the handle elsewhere, by more than noise; in one trial it slips by no more than that.
    #[test]
    fn a_trial_that_slips_by_no_more_than_hands_differ_tells_nothing_of_noise() {
        let noise = |seed: usize, i: usize| 0.02 * libm::sin((i * i + 7 * seed * i) as f64);
        let held = |i: usize| libm::cos(0.1 * i as f64);
        let group = |group: usize, slip: f64| {
            let trial = |k: usize| {
                let off = [-1.0, 0.3, 0.9][k] * (1.0 + 0.2 * group as f64);
                let slipped = |i: usize| if k == 1 && i > 30 { slip } else { 0.0 };
                let at = |i| off * held(i) + noise(3 * group + k, i) + slipped(i);
                vec![(0..60).map(at).collect::<Vec<f64>>()]
            };
            Repeats {
                group,
                samples: ValidSegments::default(),
                trials: (0..3).map(trial).collect(),
                shifts: vec![vec![(0..60).map(held).collect()]],
            }
        };
        let sizes = |slip| -> Vec<usize> {
            let groups = (0..4).map(|g| group(g, if g == 2 { slip } else { 0.0 }));
            let kept = usual(groups.collect());
            kept.iter().map(|r| r.trials.len()).collect()
        };
        assert_eq!(sizes(0.0), [3, 3, 3, 3]);
        assert_eq!(sizes(0.5), [3, 3, 2, 3]);
    }
}
