//! The samples of a trial that are compared, and the observable force at each.

use std::sync::Arc;

use arm_core::Plane;
use arm_ident::regression::trial::Trial;

use crate::data::course::{Channels, Course, away_from_gaps, margin};

/// Samples kept for each period of the cutoff.
pub(crate) const SAMPLES_PER_PERIOD: f64 = 2.5;
/// Periods of the cutoff around rest, where dry friction holds a joint, that count as rest.
const NEAR_REST: f64 = 0.6;
/// Fewest samples of a segment: the highest order of the noise's autoregressions. Fewer lie at the edge of rest on both sides.
pub(crate) const SHORTEST: usize = 4;
/// Fewest samples of a trial that is compared.
const FEWEST: usize = 8;

/// Channels that are compared at one sample.
///
/// Dry friction holds a resting joint with any torque up to its own, and the force of the hand bears it. What is left to
/// compare is the component that no torque in the resting joint changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Observable {
    /// All.
    All,
    /// Of the force on the arm the component along a unit vector, which takes the place of the first.
    ForceAlong(Plane<f64>),
    /// All but the force.
    NoForce,
    /// All joint torques but those of the joints whose bits are set.
    TorquesWithout(u32),
}

impl Observable {
    /// Whether one of so many channels is compared.
    pub fn shows(self, channel: usize, channels: usize) -> bool {
        match self {
            Self::All => true,
            Self::ForceAlong(_) => channel + 1 != channels,
            Self::NoForce => channel + 2 < channels,
            Self::TorquesWithout(joints) => joints & (1 << channel) == 0,
        }
    }
}

/// The samples of a trial that are compared: those without a gap near them, thinned to the common band.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ValidSegments {
    samples: Vec<usize>,
    /// Samples of the trial from one that may be compared to the next.
    step: usize,
    /// Channels at every sample of the trial; all where nothing is listed.
    observable: Arc<Vec<Observable>>,
}

impl ValidSegments {
    /// Of one trial.
    ///
    /// * `left_out` - samples that are not compared
    /// * `observable` - channels at every sample; nothing listed: all
    pub fn of<const N: usize>(
        trial: &Trial<N>,
        course: &Course<N>,
        left_out: &[bool],
        observable: Arc<Vec<Observable>>,
    ) -> Self {
        let step = ((course.rate / (SAMPLES_PER_PERIOD * course.band)) as usize).max(1);
        let sound = away_from_gaps(&trial.valid, margin(course.rate, course.band));
        let n = trial.len();
        let usable = |i: usize| sound[i] && left_out.get(i) != Some(&true);
        // On one grid for all trials, so that repeats have the same samples.
        let grid: Vec<usize> = (0..n).step_by(step).collect();
        let pieces = grid.chunk_by(|&a, &b| usable(a) == usable(b));
        let long = pieces.filter(|piece| usable(piece[0]) && piece.len() >= SHORTEST);
        Self {
            samples: long.flatten().copied().collect(),
            step,
            observable,
        }
        .of_some_length()
    }

    /// The same, or nothing where that is too little.
    fn of_some_length(mut self) -> Self {
        if self.samples.len() < FEWEST {
            self.samples.clear();
        }
        self
    }

    /// Those before a sample.
    fn until(&self, end: usize) -> Self {
        self.with(self.samples().filter(|&i| i < end).collect())
            .of_some_length()
    }

    /// Some of them.
    fn with(&self, samples: Vec<usize>) -> Self {
        Self {
            samples,
            step: self.step,
            observable: Arc::clone(&self.observable),
        }
    }

    /// One sample after the last.
    fn end(&self) -> usize {
        self.samples.last().map_or(0, |last| last + 1)
    }

    /// Those of two repeats of which one may have been broken off; `None` where they differ before.
    pub fn shared(&self, other: &Self) -> Option<Self> {
        let end = self.end().min(other.end());
        let own = self.until(end);
        (!own.is_empty() && own == other.until(end)).then_some(own)
    }

    /// The most of some repeats that have the same samples, up to where the shortest ends, and these samples.
    ///
    /// A repeat that holds less than half of another's samples is none of its kind.
    pub fn agreeing(all: &[&Self]) -> Option<(Vec<usize>, Self)> {
        let with = |one: &Self| -> Vec<usize> {
            let far = |other: &Self| one.shared(other).is_some_and(|s| 2 * s.len() >= one.len());
            (0..all.len()).filter(|&o| far(all[o])).collect()
        };
        let mut most: Option<(Vec<usize>, &Self)> = None;
        for one in all {
            let agreeing = with(one);
            if agreeing.len() > most.as_ref().map_or(0, |(m, _)| m.len()) {
                most = Some((agreeing, one));
            }
        }
        let (members, one) = most?;
        let end = members.iter().map(|&o| all[o].end()).min()?;
        Some((members, one.until(end)))
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    /// Whether nothing is left.
    pub fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }

    /// Number of samples at which each channel is observable.
    pub fn rows_per_channel(&self, channels: usize) -> Vec<usize> {
        let rows = |c: usize| {
            self.samples()
                .filter(|&i| self.at(i).shows(c, channels))
                .count()
        };
        (0..channels).map(rows).collect()
    }

    /// Parts of the same number of samples, in order; the last may be shorter.
    pub fn parts(&self, count: usize) -> Vec<Self> {
        let size = self.len().div_ceil(count.max(1)).max(1);
        let parts = self.samples.chunks(size);
        parts.map(|part| self.with(part.to_vec())).collect()
    }

    /// The values of channels at the samples: `[channel][sample]`.
    ///
    /// Where one component of the force is observable, it replaces the first. What is not observable is zero.
    pub fn pick(&self, channels: &Channels) -> Channels {
        let one = |channel: &Vec<f64>| self.samples().map(|i| channel[i]).collect();
        let mut picked: Channels = channels.iter().map(one).collect();
        if self.observable.is_empty() {
            return picked;
        }
        for (at, &i) in self.samples.iter().enumerate() {
            let observable = self.at(i);
            if let (Observable::ForceAlong(unit), [.., y, z]) = (observable, picked.as_mut_slice())
            {
                y[at] = unit[0] * y[at] + unit[1] * z[at];
            }
            for (c, channel) in picked.iter_mut().enumerate() {
                if !observable.shows(c, channels.len()) {
                    channel[at] = 0.0;
                }
            }
        }
        picked
    }

    /// The samples one after the other.
    pub fn samples(&self) -> impl Iterator<Item = usize> + '_ {
        self.samples.iter().copied()
    }

    /// Channels at the samples; nothing is listed where that is all of them everywhere.
    pub fn observable(&self) -> Vec<Observable> {
        match self.observable.is_empty() {
            true => Vec::new(),
            false => self.samples().map(|i| self.at(i)).collect(),
        }
    }

    /// How far each sample is from the one before it, where 1 is next to it; the first is from nothing.
    pub fn spacing(&self) -> Vec<usize> {
        let first = self.samples.first().map(|_| 0);
        let steps = self.samples.windows(2).map(|w| (w[1] - w[0]) / self.step);
        first.into_iter().chain(steps).collect()
    }

    fn at(&self, sample: usize) -> Observable {
        self.observable
            .get(sample)
            .copied()
            .unwrap_or(Observable::All)
    }
}

/// Flags with everything near a flag flagged too.
pub fn widened<const N: usize>(flags: &[bool], course: &Course<N>) -> Vec<bool> {
    let near = ((NEAR_REST * course.rate / course.band) as usize).max(1);
    let n = flags.len();
    (0..n)
        .map(|i| around(i, near, n).any(|k| flags[k]))
        .collect()
}

/// The samples of `n` that are no further than `reach` from one.
fn around(i: usize, reach: usize, n: usize) -> std::ops::Range<usize> {
    i.saturating_sub(reach)..(i + reach + 1).min(n)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::course::tests::resting;

    fn of(stretches: Vec<Vec<usize>>) -> ValidSegments {
        ValidSegments {
            samples: stretches.concat(),
            step: 1,
            observable: Arc::default(),
        }
    }

    #[test]
    fn a_repeat_that_was_broken_off_agrees_up_to_its_end() {
        let whole = of(vec![(0..30).collect(), (40..80).collect()]);
        let broken = of(vec![(0..30).collect(), (40..55).collect()]);
        let disturbed = of(vec![(0..10).collect(), (40..80).collect()]);
        let stub = of(vec![(0..12).collect()]);
        assert_eq!(whole.shared(&broken), Some(broken.clone()));
        assert_eq!(whole.shared(&disturbed), None);
        let (members, samples) =
            ValidSegments::agreeing(&[&disturbed, &whole, &broken]).expect("two repeats");
        assert_eq!((members, samples), (vec![1, 2], broken));
        let (members, samples) = ValidSegments::agreeing(&[&whole, &disturbed]).expect("one");
        assert_eq!((members, samples), (vec![0], whole.clone()));
        assert_eq!(whole.shared(&stub), Some(stub));
    }

    #[test]
    fn a_trial_of_less_than_eight_samples_is_not_compared() {
        let until = |end| of(vec![(0..20).collect()]).until(end).len();
        assert_eq!((until(7), until(8), until(30)), (0, 8, 20));
    }

    #[test]
    fn channels_are_compared_up_to_5_hz_or_a_fifth_of_the_rate() {
        let band = |rate| resting(rate).course(0).expect("a course").band;
        assert_eq!([100.0, 20.0].map(band), [5.0, 4.0]);
        // One and a half periods of the cutoff lie next to an end or a gap.
        assert_eq!((margin(100.0, 5.0), margin(1.0, 5.0)), (30, 1));
    }

    /// Of two seconds at 100 Hz those 0.3 s away from the ends, every eighth: 2.5 in each period of 5 Hz.
    #[test]
    fn samples_are_thinned_to_the_common_band_and_short_segments_are_left_out() {
        let session = resting(100.0);
        let course = session.course(0).expect("a course");
        let without = |left_out: usize| {
            let flags: Vec<bool> = (0..200).map(|i| i == left_out).collect();
            let all = ValidSegments::of(&session.trials[0], &course, &flags, Arc::default());
            all.samples().collect::<Vec<_>>()
        };
        let whole: Vec<usize> = (32..=168).step_by(8).collect();
        assert_eq!(without(0), whole);
        // Four samples before the one that is left out are compared, three are not.
        assert_eq!(without(64), [&whole[..4], &whole[5..]].concat());
        assert_eq!(without(56), whole[4..]);
    }

    /// 0.6 periods of 5 Hz at 100 Hz are 12 samples.
    #[test]
    fn what_is_near_rest_counts_as_rest() {
        let course = resting(100.0).course(0).expect("a course");
        let flags: Vec<bool> = (0..200).map(|i| i == 100).collect();
        let near: Vec<bool> = (0..200).map(|i: usize| i.abs_diff(100) <= 12).collect();
        assert_eq!(widened(&flags, &course), near);
    }

    #[test]
    fn samples_know_how_far_they_are_from_those_before_them() {
        let mut some = of(vec![vec![0, 4, 8], vec![20], vec![28, 32]]);
        some.step = 4;
        assert_eq!(some.spacing(), [0, 1, 1, 3, 2, 1]);
        assert!(of(Vec::new()).spacing().is_empty());
    }

    #[test]
    fn parts_have_equal_numbers_of_samples_across_stretches() {
        let all = of(vec![(0..10).collect(), (20..33).collect()]);
        let parts = all.parts(5);
        let sizes: Vec<usize> = parts.iter().map(ValidSegments::len).collect();
        assert_eq!(sizes, [5, 5, 5, 5, 3]);
        let joined: Vec<usize> = parts.iter().flat_map(ValidSegments::samples).collect();
        assert!(joined.iter().copied().eq(all.samples()));
    }

    #[test]
    fn where_a_joint_rests_one_component_of_the_force_is_compared_or_none() {
        let mut observable = vec![Observable::All; 8];
        observable[1] = Observable::ForceAlong([0.6, 0.8]);
        observable[2] = Observable::NoForce;
        let segments = ValidSegments {
            samples: (0..8).collect(),
            step: 1,
            observable: Arc::new(observable),
        };
        assert_eq!(segments.rows_per_channel(3), [8, 7, 6]);
        let picked = segments.pick(&vec![vec![1.0; 8], vec![10.0; 8], vec![20.0; 8]]);
        assert_eq!(picked[0], [1.0; 8]);
        // 0.6 · 10 + 0.8 · 20.
        assert_eq!(picked[1][..3], [10.0, 22.0, 0.0]);
        assert_eq!(picked[2][..3], [20.0, 0.0, 0.0]);
        assert_eq!(of(vec![(0..8).collect()]).rows_per_channel(3), [8; 3]);
    }

    #[test]
    fn the_torque_of_a_joint_that_rests_is_not_compared() {
        let mut observable = vec![Observable::All; 8];
        observable[1] = Observable::TorquesWithout(0b100);
        observable[2] = Observable::TorquesWithout(0b011);
        let segments = ValidSegments {
            samples: (0..8).collect(),
            step: 1,
            observable: Arc::new(observable),
        };
        assert_eq!(segments.rows_per_channel(3), [7, 7, 7]);
        let picked = segments.pick(&vec![vec![1.0; 8]; 3]);
        let at = |i: usize| [0, 1, 2].map(|c| picked[c][i]);
        assert_eq!(
            [at(0), at(1), at(2)],
            [[1.0; 3], [1.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
        );
    }
}
