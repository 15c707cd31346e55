//! The contact, refitted to how the arm rings on it.
//!
//! Effects are named in the band of the movements, where the damping of the contact hardly shows and takes on whatever laws
//! miss. Above that band an arm that was jolted rings on its contact, which tells stiffness and damping by itself.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use crate::fit::{departure, stepped};
use crate::hypothesis::{Coordinate, Hypothesis, Target};
use crate::noise::dot;
use crate::normal::Cluster;
use crate::predict::{Channels, away_from_gaps, difference, margin, smooth};
use crate::session::Sight;
use crate::study::Study;

/// Most steps of Gauss and Newton's method.
const TURNS: usize = 4;
/// Shares of a step that are tried.
const SHARES: [f64; 3] = [1.0, 0.5, 0.2];
/// A step that lowers the cost by less than this share is the last.
const ENOUGH: f64 = 1e-3;

/// What a hypothesis leaves above the band, in sizes of each channel: one row of numbers for one trial of each movement.
type Left = Vec<f64>;

/// Where a contact is refitted to, and what it then leaves.
struct Tuned<const N: usize> {
    hypothesis: Hypothesis<N>,
    left: Left,
}

impl<const N: usize> Study<'_, N> {
    /// A hypothesis with stiffness and damping of the contact as the ringing tells them in one fit trial of each movement.
    ///
    /// What the band of the comparison told is where they start from and are drawn to, with the uncertainty from before; where
    /// the ringing plainly speaks for the contact as given, that takes its place. `None` where no contact is compared, or the
    /// ringing tells nothing better.
    pub fn tuned(&self, start: &Hypothesis<N>) -> Option<Hypothesis<N>> {
        /// What the other start must gain, in squares of what is left: as an effect of as many parameters must.
        const PLAIN: f64 = 12.0;
        if self.session.sight != Sight::Led {
            return None;
        }
        let trials = self.one_of_each();
        let first = self.above(&trials, start)?;
        let sizes = sizes(&first);
        let before = joined(&first, &sizes);
        let given = Hypothesis {
            contact: self.session.given().contact,
            ..start.clone()
        };
        let from = |hypothesis: &Hypothesis<N>, left: Left| {
            let start = Tuned {
                hypothesis: hypothesis.clone(),
                left,
            };
            self.tuned_from(start, &trials, &sizes)
        };
        let mut best = from(start, before.clone());
        let is_far = |c: &Coordinate| {
            let sd = c.prior.map_or(f64::INFINITY, |(_, sd)| sd);
            (start.get(c.target) - given.get(c.target)).abs() > sd
        };
        let far = self.session.nuisances().iter().any(is_far);
        if far
            && let Some(left) = self.above(&trials, &given)
            && let Some(other) = from(&given, joined(&left, &sizes))
        {
            let least = best.as_ref().map_or(&before, |b| &b.left);
            if dot(&other.left, &other.left) + PLAIN < dot(least, least) {
                best = Some(other);
            }
        }
        best.map(|b| b.hypothesis)
    }

    /// Gauss and Newton's method from a start, whose contact is what is believed; `None` where a step cannot be simulated.
    fn tuned_from(&self, mut best: Tuned<N>, trials: &[usize], sizes: &[f64]) -> Option<Tuned<N>> {
        let coordinates: Vec<Coordinate> = self
            .session
            .nuisances()
            .into_iter()
            .filter(|c| matches!(c.target, Target::Contact(..)))
            .map(|c| Coordinate {
                prior: c.prior.map(|(_, sd)| (best.hypothesis.get(c.target), sd)),
                ..c
            })
            .collect();
        let left = |h: &Hypothesis<N>| Some(joined(&self.above(trials, h)?, sizes));
        let cost = |h: &Hypothesis<N>, left: &Left| dot(left, left) + departure(h, &coordinates);
        for _ in 0..TURNS {
            let before = cost(&best.hypothesis, &best.left);
            let steps = self.step_of(&best, &coordinates, &left)?;
            let shared = |share: f64| {
                let next = std::iter::zip(&coordinates, &steps);
                let next = next.fold(best.hypothesis.clone(), |h, (c, step)| {
                    let value = h.get(c.target) + share * step;
                    h.with(c.target, value)
                });
                let left = left(&next)?;
                let gained = before - cost(&next, &left);
                (gained > 0.0).then_some((
                    Tuned {
                        hypothesis: next,
                        left,
                    },
                    gained,
                ))
            };
            let Some((next, gained)) = SHARES.into_iter().find_map(shared) else {
                break;
            };
            best = next;
            if gained < ENOUGH * before {
                break;
            }
        }
        Some(best)
    }

    /// The step that lowers the cost most to first order, within bounds.
    fn step_of(
        &self,
        at: &Tuned<N>,
        coordinates: &[Coordinate],
        left: &dyn Fn(&Hypothesis<N>) -> Option<Left>,
    ) -> Option<Vec<f64>> {
        let slope = |c: &Coordinate| {
            let change = self.nudged(&at.hypothesis, c);
            let moved = left(&change.changed)?;
            let slope = std::iter::zip(&at.left, moved).map(|(l, m)| (l - m) / change.size);
            Some(slope.collect())
        };
        let slopes: Vec<Left> = coordinates.iter().map(slope).collect::<Option<_>>()?;
        let cluster = Cluster {
            configuration: 0,
            gram: Arc::new(DMatrix::from_fn(slopes.len(), slopes.len(), |a, b| {
                dot(&slopes[a], &slopes[b])
            })),
            score: DVector::from_fn(slopes.len(), |a, _| dot(&slopes[a], &at.left)),
            square: dot(&at.left, &at.left),
            rows: at.left.len(),
        };
        let (usable, steps) = stepped(&[cluster], &at.hypothesis, coordinates, 0.0)?;
        let mut all = vec![0.0; coordinates.len()];
        usable
            .iter()
            .zip(steps)
            .for_each(|(&i, step)| all[i] = step);
        Some(all)
    }

    /// The first trial of each movement that is fitted and that nothing has touched.
    fn one_of_each(&self) -> Vec<usize> {
        let mut seen = Vec::new();
        let mut out = Vec::new();
        for &trial in &self.fitted {
            let group = self.group_of[trial];
            if !self.is_touched(trial) && !seen.contains(&group) {
                seen.push(group);
                out.push(trial);
            }
        }
        out
    }

    /// What a hypothesis leaves of every channel above the band, away from gaps, trial by trial.
    fn above(&self, trials: &[usize], hypothesis: &Hypothesis<N>) -> Option<Vec<Channels>> {
        let one = |i: usize| {
            let (trial, course) = (&self.session.trials[trials[i]], &self.courses[trials[i]]);
            let run = self.session.run(hypothesis, course).ok()?;
            let shown = self.session.read_raw(hypothesis, course, &run).ok()?;
            let left = difference(&course.raw, &shown);
            let above = difference(&left, &smooth(&left, course.band, course.rate).ok()?);
            let kept = away_from_gaps(&trial.valid, margin(course.rate, course.band));
            let pick = |channel: &Vec<f64>| {
                let each = std::iter::zip(channel, &kept);
                each.filter(|(_, kept)| **kept).map(|(v, _)| *v).collect()
            };
            Some(above.iter().map(pick).collect::<Channels>())
        };
        self.parallel(trials.len(), one).into_iter().collect()
    }
}

/// Root mean square of each channel over all trials.
fn sizes(trials: &[Channels]) -> Vec<f64> {
    let channels = trials.first().map_or(0, Vec::len);
    (0..channels)
        .map(|c| {
            let all = trials.iter().flat_map(|t| &t[c]);
            let (sum, count) = all.fold((0.0, 0.0), |(s, n), v| (s + v * v, n + 1.0));
            libm::sqrt(sum / f64::max(count, 1.0)).max(f64::MIN_POSITIVE)
        })
        .collect()
}

/// All trials and channels in one row, each channel in its size.
fn joined(trials: &[Channels], sizes: &[f64]) -> Left {
    let each = trials.iter().flat_map(|t| std::iter::zip(t, sizes));
    each.flat_map(|(channel, size)| channel.iter().map(move |v| v / size))
        .collect()
}
