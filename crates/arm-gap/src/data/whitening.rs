//! Whitened rows: the prediction error of each sample from those before it, in units of the noise.
//!
//! Where dry friction holds a joint, one component of the force or none is observable, or not the torque of the joint. What was not
//! observed predicts nothing: the next sample is predicted from those observed before, at their lags, or a level of slow noise would
//! count as new after every rest.

use std::collections::BTreeMap;

use arm_core::Plane;
use arm_numerics::statistics::autoregressive::{Predictor, Whitener};

use crate::data::course::Channels;
use crate::data::valid_segments::Observable;

/// Which samples there are, and the channels that are observable at each.
#[derive(Clone, Copy)]
pub struct Observed<'a> {
    /// How far each sample is from the one before it, in samples; the first is not read.
    pub spacing: &'a [usize],
    /// Channels that are observable; all at all samples where nothing is listed.
    pub channels: &'a [Observable],
}

impl Observed<'_> {
    /// Channels at a sample.
    pub fn at(&self, t: usize) -> Observable {
        *self.channels.get(t).unwrap_or(&Observable::All)
    }
}

/// How one sample of a channel is made white.
#[derive(Clone, Debug)]
enum Row {
    /// It is predicted from as many samples directly before it in its channel.
    Next(usize),
    /// It is predicted from samples: channel, sample, factor; with one over the standard deviation of the error.
    From(Vec<(usize, usize, f64)>, f64),
    /// It is not observable.
    Unobserved,
}

/// How the samples of a trial are made white, channel by channel.
#[derive(Clone, Debug)]
pub struct Whitening {
    /// Of each channel.
    whiteners: Vec<Whitener>,
    /// `[channel][sample]`.
    rows: Vec<Vec<Row>>,
}

impl Whitening {
    /// The whitening of some samples by the autoregression of each channel.
    pub fn new(whiteners: &[Whitener], observed: Observed<'_>) -> Self {
        let place = observed.spacing.iter().scan(0, |at, step| {
            *at += step;
            Some(*at)
        });
        let place: Vec<usize> = place.collect();
        let channels = 0..whiteners.len();
        let rows = channels.map(|c| {
            let mut known = Known {
                whiteners,
                place: &place,
                observed,
                predictors: BTreeMap::new(),
            };
            let row = |t: usize| match observed.at(t) {
                at if !at.shows(c, whiteners.len()) => Row::Unobserved,
                Observable::ForceAlong(unit) if c + 2 == whiteners.len() => {
                    known.row((c, t), Some(unit))
                }
                _ => known.row((c, t), None),
            };
            (0..place.len()).map(row).collect()
        });
        Self {
            rows: rows.collect(),
            whiteners: whiteners.to_vec(),
        }
    }

    /// Whether a sample of a channel is observable.
    pub fn is_observable(&self, (channel, sample): (usize, usize)) -> bool {
        !matches!(self.rows[channel][sample], Row::Unobserved)
    }

    /// Makes channels white in place.
    pub fn apply(&self, channels: &mut Channels) {
        for (c, rows) in self.rows.iter().enumerate() {
            // Backwards, so that every sample still finds its unfiltered past; a component of the force finds both in it, since that
            // stands in the channel which is made white first.
            for (t, row) in rows.iter().enumerate().rev() {
                let (predicted, inverse) = match row {
                    Row::Next(count) => {
                        let (factors, inverse) = self.whiteners[c].next(*count);
                        let past = channels[c][..t].iter().rev();
                        let sum = factors.iter().zip(past).fold(0.0, |s, (a, v)| s + a * v);
                        (sum, *inverse)
                    }
                    Row::From(terms, inverse) => {
                        let sum = terms
                            .iter()
                            .fold(0.0, |s, &(c, i, a)| s + a * channels[c][i]);
                        (sum, *inverse)
                    }
                    Row::Unobserved => (0.0, 0.0),
                };
                channels[c][t] = (channels[c][t] - predicted) * inverse;
            }
        }
    }
}

/// What is known when the rows of a channel are made.
struct Known<'a> {
    whiteners: &'a [Whitener],
    /// Where each sample stands, in samples.
    place: &'a [usize],
    observed: Observed<'a>,
    /// Those that were computed, by channel and lags.
    predictors: BTreeMap<(usize, Vec<usize>), Predictor>,
}

impl Known<'_> {
    /// The row of a sample of a channel, or of a component of the force along a unit vector, which stands in its first channel.
    fn row(&mut self, (c, t): (usize, usize), along: Option<Plane<f64>>) -> Row {
        let model = along.map_or(c, |unit| self.louder((c, c + 1), unit));
        let order = self.whiteners[model].order();
        let is_observed = |i: &usize| match self.observed.at(*i) {
            // A component is no sample of the first channel, but one of that component.
            Observable::ForceAlong(_) if c + 2 == self.whiteners.len() => along.is_some(),
            at => at.shows(c, self.whiteners.len()),
        };
        let past: Vec<usize> = (0..t).rev().filter(is_observed).take(order).collect();
        let lags: Vec<usize> = past
            .iter()
            .map(|&i| self.place[t] - self.place[i])
            .collect();
        let is_next = lags.iter().enumerate().all(|(k, lag)| *lag == k + 1);
        if along.is_none() && is_next {
            return Row::Next(past.len());
        }
        let key = (model, lags);
        let (factors, inverse) = match self.predictors.get(&key) {
            Some(known) => known.clone(),
            None => {
                let fresh = self.whiteners[model].predictor(&key.1);
                self.predictors.entry(key).or_insert(fresh).clone()
            }
        };
        let Some(unit) = along else {
            let each = std::iter::zip(past, factors);
            return Row::From(each.map(|(i, a)| (c, i, a)).collect(), inverse);
        };
        let each = std::iter::zip(past, factors).flat_map(|(i, a)| match self.observed.at(i) {
            Observable::All => vec![(c, i, a * unit[0]), (c + 1, i, a * unit[1])],
            _ => vec![(c, i, a)],
        });
        Row::From(
            each.collect(),
            inverse * self.size(model) / self.size_along((c, c + 1), unit),
        )
    }

    /// Standard deviation of the innovations of a channel.
    fn size(&self, c: usize) -> f64 {
        self.whiteners[c].innovation()
    }

    /// The same of a component along a unit vector.
    fn size_along(&self, (first, second): (usize, usize), unit: Plane<f64>) -> f64 {
        libm::hypot(unit[0] * self.size(first), unit[1] * self.size(second))
    }

    /// The channel that has more of a component's noise.
    fn louder(&self, (first, second): (usize, usize), unit: Plane<f64>) -> usize {
        let of = |c: usize, share: f64| (share * self.size(c)).abs();
        if of(first, unit[0]) >= of(second, unit[1]) {
            first
        } else {
            second
        }
    }
}

#[cfg(test)]
mod tests {
    use arm_numerics::statistics::autoregressive::AutoRegression;

    use super::*;

    const RHO: f64 = 0.9;

    fn slow(sd: f64) -> Whitener {
        let model = AutoRegression {
            coefficients: vec![RHO],
            sd,
        };
        Whitener::new(&model).expect("stationary")
    }

    /// The information that a constant of the first component has in the rows, by the square of its whitened column.
    fn information(force: &[Observable], column: [f64; 2]) -> f64 {
        let spacing: Vec<usize> = (0..force.len()).map(|t| usize::from(t > 0)).collect();
        let observed = Observed {
            spacing: &spacing,
            channels: force,
        };
        let whitening = Whitening::new(&[slow(1.0), slow(1.0)], observed);
        let values = |c: usize| {
            let observable = |f: &Observable| match (f, c) {
                (Observable::ForceAlong(u), 0) => u[0] * column[0] + u[1] * column[1],
                _ if f.shows(c, 2) => column[c],
                _ => 0.0,
            };
            force.iter().map(observable).collect::<Vec<f64>>()
        };
        let mut channels = vec![values(0), values(1)];
        whitening.apply(&mut channels);
        channels.iter().flatten().map(|v| v * v).sum()
    }

    /// Interruptions do not make a level of slow noise better known: without any rest, with one component observed throughout, and with
    /// rests in which nothing is observed.
    #[test]
    fn a_rest_tells_no_more_of_a_level_than_motion() {
        use Observable::{All as Both, ForceAlong as Along, NoForce as Neither};
        const N: usize = 120;
        let resting = |t: usize| t % 12 >= 9;
        let with = |rest: Observable| -> Vec<Observable> {
            (0..N)
                .map(|t| if resting(t) { rest } else { Both })
                .collect()
        };
        let whole = information(&vec![Both; N], [1.0, 0.0]);
        // The stationary first sample, and the others less nine tenths of the one before.
        let exact = (1.0 - RHO * RHO) + (N - 1) as f64 * (1.0 - RHO) * (1.0 - RHO);
        assert!((whole - exact).abs() < 1e-9 * exact);
        let neither = information(&with(Neither), [1.0, 0.0]);
        assert!(
            neither < whole && neither > 0.7 * whole,
            "{neither} {whole}"
        );
        // Observed throughout along the first component: the rest changes little.
        let along = information(&with(Along([1.0, 0.0])), [1.0, 0.0]);
        assert!((along / whole - 1.0).abs() < 0.25, "{along} {whole}");
        // Along a component that turns within the rest, and the other way round.
        let [y, z] = [[0.6, 0.8], [0.8, -0.6]].map(|u| information(&with(Along(u)), [1.0, 0.0]));
        assert!(y < 1.1 * whole && z < 1.2 * whole, "{y} {z} {whole}");
    }

    /// The torque of a joint that rests is no sample of it, and the other torques are compared.
    #[test]
    fn a_torque_that_is_not_observed_leaves_no_row() {
        let rest: Vec<Observable> = (0..60)
            .map(|t| match t % 12 {
                9.. => Observable::TorquesWithout(0b01),
                _ => Observable::All,
            })
            .collect();
        let all = [Observable::All; 60];
        let [first, second] = [[1.0, 0.0], [0.0, 1.0]];
        assert!(information(&rest, first) < information(&all, first));
        assert_eq!(information(&rest, second), information(&all, second));
        let spacing = [1; 60];
        let observed = Observed {
            spacing: &spacing,
            channels: &rest,
        };
        let whitening = Whitening::new(&[slow(1.0), slow(1.0)], observed);
        let unobserved = (0..60).filter(|&t| !whitening.is_observable((0, t)));
        assert_eq!(unobserved.count(), 15);
        assert!((0..60).all(|t| whitening.is_observable((1, t))));
    }

    #[test]
    fn a_component_has_the_noise_of_both_channels_as_it_has_them() {
        let unit = [0.6, 0.8];
        let force = [Observable::ForceAlong(unit)];
        let observed = Observed {
            spacing: &[0],
            channels: &force,
        };
        let mut channels = vec![vec![1.0], vec![0.0]];
        Whitening::new(&[slow(2.0), slow(1.0)], observed).apply(&mut channels);
        let marginal = libm::hypot(0.6 * 2.0, 0.8) / libm::sqrt(1.0 - RHO * RHO);
        assert!((channels[0][0] - 1.0 / marginal).abs() < 1e-12);
        assert_eq!(channels[1], [0.0]);
    }
}
