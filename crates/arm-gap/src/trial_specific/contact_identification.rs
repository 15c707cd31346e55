//! Identification of the contact from the free vibrations of the arm on it.
//!
//! Effects are named in the band of the movements, where the damping of the contact hardly shows and takes on whatever laws
//! miss. Above that band a jolted arm vibrates on its contact, which determines stiffness and damping.

use std::sync::Arc;

use arm_core::effect::Effect;
use arm_numerics::{Cholesky, Matrix};

use crate::data::course::{Channels, away_from_gaps, difference, margin, smooth};
use crate::data::noise::dot;
use crate::data::session::ComparisonMode;
use crate::fitting::step::{Equations, Step};
use crate::hypothesis::departure;
use crate::hypothesis::{Coordinate, Hypothesis, Target};
use crate::prepared_session::PreparedSession;
use crate::sensitivity::normal_equations::Cluster;
use crate::trial_specific::component::shapes_of;

/// Most steps of Gauss and Newton's method.
const MOST_STEPS: usize = 4;
/// Shares of a step that are tried.
const SHARES: [f64; 3] = [1.0, 0.5, 0.2];
/// A step that lowers the cost by less than this share is the last.
const CONVERGED: f64 = 1e-3;
/// Powers of time with which the size of a rhythm may change over a trial.
const SLOWLY: i32 = 3;

/// What a hypothesis leaves above the band, in sizes of each channel: one row of numbers for one trial of each movement.
type RingingResidual = Vec<f64>;

/// What of the ringing is compared.
struct ComparedRinging {
    trials: Vec<usize>,
    /// Frequencies of what swings besides, which would pass for ringing \[Hz\].
    swings: Vec<f64>,
    /// In which each channel counts.
    sizes: Vec<f64>,
}

/// Where a contact is refitted to, and what it then leaves.
struct Tuned<const N: usize> {
    hypothesis: Hypothesis<N>,
    left: RingingResidual,
}

impl<const N: usize> PreparedSession<'_, N> {
    /// A hypothesis with stiffness and damping of the contact from the vibrations in one fit trial of each movement.
    ///
    /// Start and prior mean are the values from the band of the comparison, with the uncertainty from before; where the
    /// vibrations fit the given contact clearly better, that takes their place. `None` where no contact is compared, or the
    /// vibrations give no improvement.
    /// * `rhythms` - what swings besides and would pass for ringing: it is taken out, with a size and phase that change slowly
    pub fn tuned(&self, start: &Hypothesis<N>, rhythms: &[Effect<f64>]) -> Option<Hypothesis<N>> {
        /// What the other start must gain, in squares of what is left: as an effect of as many parameters must.
        const LEAST_GAIN: f64 = 12.0;
        if self.session.comparison != ComparisonMode::Led {
            return None;
        }
        let swing = |r: &Effect<f64>| r.parameters[shapes_of(r.kind)[0]];
        let mut compared = ComparedRinging {
            trials: self.one_of_each(),
            swings: rhythms.iter().map(swing).collect(),
            sizes: vec![1.0; self.session.channels()],
        };
        let above = self.above(&compared, start)?;
        compared.sizes = sizes(&above);
        let before = compared.row(&above);
        let given = Hypothesis {
            contact: self.session.given().contact,
            ..start.clone()
        };
        let from = |hypothesis: &Hypothesis<N>, left: RingingResidual| {
            let start = Tuned {
                hypothesis: hypothesis.clone(),
                left,
            };
            self.tuned_from(start, &compared)
        };
        let mut best = from(start, before.clone());
        let is_far = |c: &Coordinate| {
            let sd = c.prior.map_or(f64::INFINITY, |(_, sd)| sd);
            (start.get(c.target) - given.get(c.target)).abs() > sd
        };
        let far = self.session.nuisances().iter().any(is_far);
        if far
            && let Some(left) = self.left_ringing(&compared, &given)
            && let Some(other) = from(&given, left)
        {
            let least = best.as_ref().map_or(&before, |b| &b.left);
            if dot(&other.left, &other.left) + LEAST_GAIN < dot(least, least) {
                best = Some(other);
            }
        }
        best.map(|b| b.hypothesis)
    }

    /// Gauss and Newton's method from a start, whose contact is the prior mean; `None` where a step cannot be simulated.
    fn tuned_from(&self, mut best: Tuned<N>, compared: &ComparedRinging) -> Option<Tuned<N>> {
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
        let left = |h: &Hypothesis<N>| self.left_ringing(compared, h);
        let cost = |h: &Hypothesis<N>, left: &RingingResidual| {
            dot(left, left) + departure(h, &coordinates)
        };
        for _ in 0..MOST_STEPS {
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
            if gained < CONVERGED * before {
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
        left: &(dyn Fn(&Hypothesis<N>) -> Option<RingingResidual> + Sync),
    ) -> Option<Vec<f64>> {
        let slope = |i: usize| {
            let change = self.nudged(&at.hypothesis, &coordinates[i]);
            let moved = left(&change.changed)?;
            let slope = std::iter::zip(&at.left, moved).map(|(l, m)| (l - m) / change.size);
            Some(slope.collect::<RingingResidual>())
        };
        let slopes = self.parallel(coordinates.len(), slope);
        let slopes: Vec<RingingResidual> = slopes.into_iter().collect::<Option<_>>()?;
        let cluster = Cluster {
            configuration: 0,
            gram: Arc::new(Matrix::from_fn(slopes.len(), slopes.len(), |a, b| {
                dot(&slopes[a], &slopes[b])
            })),
            score: slopes.iter().map(|s| dot(s, &at.left)).collect(),
            square: dot(&at.left, &at.left),
            rows: at.left.len(),
        };
        let Step { usable, sizes, .. } =
            Equations::new(&[cluster], &at.hypothesis, coordinates).step(0.0)?;
        let mut all = vec![0.0; coordinates.len()];
        usable
            .iter()
            .zip(sizes)
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

    /// What a hypothesis leaves of every channel above the band, away from gaps and without what swings, trial by trial.
    fn above(
        &self,
        compared: &ComparedRinging,
        hypothesis: &Hypothesis<N>,
    ) -> Option<Vec<Channels>> {
        let one = |i: usize| {
            let trial = compared.trials[i];
            let (valid, course) = (&self.session.trials[trial].valid, &self.courses[trial]);
            let run = self.session.run(hypothesis, course).ok()?;
            let shown = self.session.read_raw(hypothesis, course, &run).ok()?;
            let left = difference(&course.raw, &shown);
            let mut above = difference(&left, &smooth(&left, course.band, course.rate).ok()?);
            let kept = away_from_gaps(valid, margin(course.rate, course.band));
            let kept: Vec<usize> = (0..kept.len()).filter(|&i| kept[i]).collect();
            for channel in &mut above {
                *channel = kept.iter().map(|&i| channel[i]).collect();
            }
            let swings = Swings::of(&compared.swings, &kept, course.rate);
            swings.take_out(&mut above);
            Some(above)
        };
        let trials = compared.trials.len();
        self.parallel(trials, one).into_iter().collect()
    }

    /// The same in one row, each channel in its size.
    fn left_ringing(
        &self,
        compared: &ComparedRinging,
        hypothesis: &Hypothesis<N>,
    ) -> Option<RingingResidual> {
        Some(compared.row(&self.above(compared, hypothesis)?))
    }
}

impl ComparedRinging {
    /// What is left of every trial in one row, each channel in its size.
    fn row(&self, trials: &[Channels]) -> RingingResidual {
        let each = trials
            .iter()
            .flat_map(|t| std::iter::zip(t, &self.sizes))
            .flat_map(|(channel, size)| channel.iter().map(move |v| v / size));
        each.collect()
    }
}

/// Swings of fixed frequencies whose sizes and phases change slowly, as those of a trembling arm do that is led elsewhere.
struct Swings {
    columns: Vec<Vec<f64>>,
    solver: Option<Cholesky>,
}

impl Swings {
    /// * `kept` - which samples are compared
    fn of(frequencies: &[f64], kept: &[usize], rate: f64) -> Self {
        let last = kept.last().map_or(1.0, |&i| i.max(1) as f64);
        let columns: Vec<Vec<f64>> = frequencies
            .iter()
            .flat_map(|frequency| {
                let turns = core::f64::consts::TAU * frequency / rate;
                let swing = move |i: f64, quarter: bool| {
                    let (sin, cos) = libm::sincos(turns * i);
                    if quarter { cos } else { sin }
                };
                (0..SLOWLY).flat_map(move |power| {
                    [false, true].map(|quarter| {
                        let one = |&i: &usize| {
                            let i = i as f64;
                            libm::pow(2.0 * i / last - 1.0, f64::from(power)) * swing(i, quarter)
                        };
                        kept.iter().map(one).collect()
                    })
                })
            })
            .collect();
        let count = columns.len();
        let gram = Matrix::from_fn(count, count, |a, b| dot(&columns[a], &columns[b]));
        Self {
            solver: Cholesky::new(gram).filter(|_| count > 0),
            columns,
        }
    }

    fn take_out(&self, channels: &mut Channels) {
        let Some(solver) = &self.solver else { return };
        for channel in channels {
            let score: Vec<f64> = self.columns.iter().map(|c| dot(c, channel)).collect();
            for (column, size) in std::iter::zip(&self.columns, &solver.solve(&score)) {
                for (value, swing) in std::iter::zip(channel.iter_mut(), column) {
                    *value -= size * swing;
                }
            }
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_swing_whose_size_changes_slowly_is_taken_out_and_ringing_is_left() {
        let rate = 100.0;
        let kept: Vec<usize> = (0..600).filter(|i| !(200..230).contains(i)).collect();
        let at = |i: usize, frequency: f64| {
            libm::sin(core::f64::consts::TAU * frequency * i as f64 / rate + 0.4)
        };
        let ringing = |i: usize| libm::exp(-((i % 150) as f64) / 15.0) * at(i, 17.0);
        let grows = |i: usize| (1.0 + (i as f64 / 600.0)) * at(i, 9.0);
        let channel =
            |of: &dyn Fn(usize) -> f64| -> Channels { vec![kept.iter().map(|&i| of(i)).collect()] };
        let size = |channels: &Channels| dot(&channels[0], &channels[0]);
        let swings = Swings::of(&[9.0], &kept, rate);
        let mut alone = channel(&grows);
        let before = size(&alone);
        swings.take_out(&mut alone);
        assert!(size(&alone) < 1e-12 * before);
        let mut both = channel(&|i| grows(i) + ringing(i));
        swings.take_out(&mut both);
        let kept_of_ringing = size(&both) / size(&channel(&ringing));
        assert!((0.9..1.0).contains(&kept_of_ringing), "{kept_of_ringing}");
        // Without a rhythm nothing is taken out.
        let mut as_is = channel(&ringing);
        Swings::of(&[], &kept, rate).take_out(&mut as_is);
        assert_eq!(as_is, channel(&ringing));
    }

    #[test]
    fn channels_count_in_their_own_size() {
        let trials = [
            vec![vec![3.0, -3.0], vec![0.0; 2]],
            vec![vec![4.0, 4.0], vec![0.0; 2]],
        ];
        let found = sizes(&trials);
        assert_eq!(found, [12.5_f64.sqrt(), f64::MIN_POSITIVE]);
    }
}
