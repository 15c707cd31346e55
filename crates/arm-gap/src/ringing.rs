//! The contact, refitted to how the arm rings on it.
//!
//! Effects are named in the band of the movements, where the damping of the contact hardly shows and takes on whatever laws
//! miss. Above that band an arm that was jolted rings on its contact, which tells stiffness and damping by itself.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use crate::fit::priors;
use crate::hypothesis::{Coordinate, Hypothesis, Target};
use crate::noise::dot;
use crate::normal::{Cluster, Normal, solve};
use crate::predict::{Channels, away_from_gaps, difference, margin, smooth};
use crate::session::Sight;
use crate::study::Study;

/// Most steps of Gauss and Newton's method.
const TURNS: usize = 3;
/// A step that lowers the cost by less than this share is the last.
const ENOUGH: f64 = 1e-3;

/// What a hypothesis leaves above the band, in sizes of each channel: one row of numbers for one trial of each movement.
type Left = Vec<f64>;

impl<const N: usize> Study<'_, N> {
    /// A hypothesis with stiffness and damping of the contact as the ringing on the fit trials tells them.
    ///
    /// What the band of the comparison told is where they start from, and they may leave it as far as they were uncertain
    /// before. `None` where no contact is compared, or the ringing tells nothing better.
    pub fn tuned(&self, start: &Hypothesis<N>) -> Option<Hypothesis<N>> {
        if self.session.sight != Sight::Led {
            return None;
        }
        let trials = self.one_of_each();
        let coordinates: Vec<Coordinate> = self
            .session
            .nuisances()
            .into_iter()
            .filter(|c| matches!(c.target, Target::Contact(..)))
            .map(|c| Coordinate {
                prior: c.prior.map(|(_, sd)| (start.get(c.target), sd)),
                ..c
            })
            .collect();
        let first = self.above(&trials, start)?;
        let sizes = sizes(&first);
        let mut best = start.clone();
        let mut left = joined(&first, &sizes);
        // The ringing changes little from one step to the next: its slopes serve all of them.
        let slopes = coordinates
            .iter()
            .map(|c| {
                let moved = best.clone().with(c.target, best.get(c.target) + c.step);
                let moved = joined(&self.above(&trials, &moved)?, &sizes);
                Some(
                    std::iter::zip(&left, moved)
                        .map(|(l, m)| (l - m) / c.step)
                        .collect(),
                )
            })
            .collect::<Option<Vec<Left>>>()?;
        let gram = Arc::new(DMatrix::from_fn(slopes.len(), slopes.len(), |a, b| {
            dot(&slopes[a], &slopes[b])
        }));
        let all: Vec<usize> = (0..coordinates.len()).collect();
        let mut tuned = None;
        for _ in 0..TURNS {
            let cluster = Cluster {
                configuration: 0,
                gram: Arc::clone(&gram),
                score: DVector::from_fn(slopes.len(), |a, _| dot(&slopes[a], &left)),
                square: dot(&left, &left),
                rows: left.len(),
            };
            let normal = Normal::new(&[cluster], &priors(&best, &coordinates));
            let bounds = |i: usize| {
                let (c, value) = (&coordinates[i], best.get(coordinates[i].target));
                (c.lower - value, c.upper - value)
            };
            let (steps, _) = solve(&normal.gram, &normal.score, &all, &bounds)?;
            let next = std::iter::zip(&coordinates, &steps).fold(best.clone(), |h, (c, step)| {
                let value = h.get(c.target) + step;
                h.with(c.target, value)
            });
            let Some(after) = self.above(&trials, &next) else {
                break;
            };
            let after = joined(&after, &sizes);
            let known = priors(&next, &coordinates).into_iter().flatten();
            let cost = known.fold(dot(&after, &after), |sum, (distance, sd)| {
                sum + (distance / sd) * (distance / sd)
            });
            let gained = normal.square - cost;
            if gained.is_nan() || gained <= 0.0 {
                break;
            }
            (best, left) = (next, after);
            tuned = Some(best.clone());
            if gained < ENOUGH * normal.square {
                break;
            }
        }
        tuned
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
