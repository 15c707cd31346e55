//! A hypothesis in one trial: the place of the handle in the hand and in space, and the phase of each rhythm.
//!
//! Both differ from one trial to the next, so they are estimated from each trial alone,
//! whatever its role and hypothesis: two numbers each for the handle, as far as what is declared of it lets them
//! go, and one for a rhythm.

use std::sync::Arc;

use arm_core::effect::{Effect, Nature};
use arm_numerics::Matrix;
use arm_sim::SimulationError;

use crate::data::course::{Channels, Course, difference};
use crate::data::noise::dot;
use crate::data::session::{ComparisonMode, FURTHEST, Session};
use crate::hypothesis::{Hypothesis, Target};
use crate::linearization::linear_response::Change;
use crate::linearization::linearized_run::Linear;
use crate::linearization::linearized_torques::LinearizedTorques;
use crate::prepared_session::PreparedSession;
use crate::sensitivity::normal_equations::solve;
use crate::trial_specific::component::{SLOW, shapes_of};

/// Times that channels are weighed anew by what is left of them.
const REWEIGHTINGS: usize = 2;

/// Whether an effect swings with a phase of its own in every trial: muscles do, and so does what shakes a robot fast.
fn is_rhythm(effect: &Effect<f64>) -> bool {
    match effect.kind.prior().nature {
        Nature::Rhythm => true,
        Nature::Periodic => effect.parameters[shapes_of(effect.kind)[0]] > SLOW,
        Nature::Lasting | Nature::Burst | Nature::Slip => false,
    }
}

impl<const N: usize> Session<N> {
    /// A hypothesis and rhythms, its own known ones besides, as they are in a trial.
    ///
    /// # Errors
    /// [`SimulationError`] where the trial cannot be simulated with them.
    pub fn in_trial(
        &self,
        (hypothesis, rhythms): (&Hypothesis<N>, &[Effect<f64>]),
        course: &Arc<Course<N>>,
    ) -> Result<Hypothesis<N>, SimulationError> {
        let mut own = hypothesis.clone();
        let mut rhythms = rhythms.to_vec();
        rhythms.extend(own.known.extract_if(.., |e| is_rhythm(e)));
        let placed = self.by_trial();
        if placed.is_empty() && rhythms.is_empty() {
            return Ok(own);
        }
        let trial = ShownTrial::of(self, &own, course)?;
        let mut columns = Vec::new();
        for c in &placed {
            columns.push(trial.response(&Change {
                changed: own.clone().with(c.target, own.get(c.target) + c.step),
                size: c.step,
                sensing: self.is_sensing(&own, c.target),
                moves_handle: matches!(c.target, Target::Shift(_)),
            })?);
        }
        columns.extend(trial.swings(&own, &rhythms)?);
        let left = difference(&course.seen, &trial.shown);
        let sd: Vec<Option<f64>> = (0..columns.len())
            .map(|i| placed.get(i)?.prior.map(|(_, sd)| sd))
            .collect();
        let sizes = sizes(&left, &columns, &sd, course);
        for (c, size) in std::iter::zip(&placed, &sizes) {
            let value = own.get(c.target) + size;
            own = own.with(c.target, value);
        }
        in_phase(&mut rhythms, &sizes[placed.len()..]);
        if !rhythms.is_empty() && own.has_dry_friction() {
            rhythms = self.phased_by_runs((&own, rhythms), course)?;
        }
        own.named.extend(rhythms);
        Ok(own)
    }

    /// Rhythms with phases from runs with them: a joint that sticks without a rhythm slips with it, and responds differently.
    fn phased_by_runs(
        &self,
        (own, mut rhythms): (&Hypothesis<N>, Vec<Effect<f64>>),
        course: &Arc<Course<N>>,
    ) -> Result<Vec<Effect<f64>>, SimulationError> {
        for _ in 0..REWEIGHTINGS {
            let mut swinging = own.clone();
            swinging.named.extend_from_slice(&rhythms);
            let Ok(trial) = ShownTrial::of(self, &swinging, course) else {
                break;
            };
            let columns = trial.swings(&swinging, &rhythms)?;
            let left = difference(&course.seen, &trial.shown);
            let further = sizes(&left, &columns, &vec![None; columns.len()], course);
            let now = rhythms.iter().flat_map(|rhythm| {
                let phase = rhythm.parameters[shapes_of(rhythm.kind)[1]];
                [libm::cos(phase), libm::sin(phase)]
            });
            let sizes: Vec<f64> = std::iter::zip(now, further).map(|(a, b)| a + b).collect();
            in_phase(&mut rhythms, &sizes);
        }
        Ok(rhythms)
    }
}

/// Sets the phases of rhythms from their sizes at 0 and 90°; an unobservable phase stays as it is.
fn in_phase(rhythms: &mut [Effect<f64>], sizes: &[f64]) {
    for (rhythm, size) in std::iter::zip(rhythms, sizes.chunks_exact(2)) {
        if size != [0.0, 0.0] {
            *rhythm = with_phase(rhythm, libm::atan2(size[1], size[0]));
        }
    }
}

/// Predicted channels of one trial under a hypothesis, in the common band, and the reference for their responses to small changes.
struct ShownTrial<'a, const N: usize> {
    beside: Beside<'a, N>,
    shown: Channels,
}

/// Reference for responses: a simulated run if a robot leads the arm, otherwise the torques of the measured motion.
enum Beside<'a, const N: usize> {
    Run(Box<Linear<'a, N>>),
    Torques(Box<LinearizedTorques<'a, N>>),
}

impl<'a, const N: usize> ShownTrial<'a, N> {
    fn of(
        session: &'a Session<N>,
        hypothesis: &Hypothesis<N>,
        course: &'a Arc<Course<N>>,
    ) -> Result<Self, SimulationError> {
        let beside = match session.comparison {
            ComparisonMode::Led => {
                Beside::Run(Box::new(Linear::along(session, hypothesis, course)?))
            }
            ComparisonMode::Torque => Beside::Torques(Box::new(LinearizedTorques::of(
                session, hypothesis, course,
            )?)),
        };
        let shown = match &beside {
            Beside::Run(line) => line.shown()?,
            Beside::Torques(torques) => torques.shown()?,
        };
        Ok(Self { beside, shown })
    }

    /// Response of the channels to one unit of a change.
    fn response(&self, change: &Change<N>) -> Result<Channels, SimulationError> {
        match &self.beside {
            Beside::Run(line) => line.response(change),
            Beside::Torques(torques) => torques.response(change),
        }
    }

    /// What each rhythm would show more with a phase of 0 and of 90°.
    fn swings(
        &self,
        hypothesis: &Hypothesis<N>,
        rhythms: &[Effect<f64>],
    ) -> Result<Vec<Channels>, SimulationError> {
        let mut columns = Vec::with_capacity(2 * rhythms.len());
        for rhythm in rhythms {
            for phase in [0.0, 0.5 * core::f64::consts::PI] {
                let mut swinging = hypothesis.clone();
                swinging.named.push(with_phase(rhythm, phase));
                columns.push(self.response(&Change::of(swinging, 1.0))?);
            }
        }
        Ok(columns)
    }
}

impl<const N: usize> PreparedSession<'_, N> {
    /// A hypothesis and rhythms as they are in every trial, whatever its role; as they were where one cannot be simulated.
    pub fn in_trials(&self, hypothesis: (&Hypothesis<N>, &[Effect<f64>])) -> Vec<Hypothesis<N>> {
        let one = |trial: usize| {
            let own = self.session.in_trial(hypothesis, &self.courses[trial]);
            own.unwrap_or_else(|_| {
                let mut all = hypothesis.0.clone();
                all.named.extend_from_slice(hypothesis.1);
                all
            })
        };
        self.parallel(self.courses.len(), one)
    }
}

fn with_phase(rhythm: &Effect<f64>, phase: f64) -> Effect<f64> {
    let mut effect = *rhythm;
    effect.parameters[shapes_of(effect.kind)[1]] = phase;
    effect
}

/// Coefficients of the columns in the residual of a trial; zeros where it does not determine them.
///
/// * `sd` - prior standard deviation of a column's size, which is limited to [`FURTHEST`] of them
fn sizes<const N: usize>(
    left: &Channels,
    columns: &[Channels],
    sd: &[Option<f64>],
    course: &Course<N>,
) -> Vec<f64> {
    let all: Vec<usize> = (0..columns.len()).collect();
    let mut sizes = vec![0.0; columns.len()];
    // In a band as many samples are independent as it has room for.
    let share = f64::min(2.0 * course.band / course.rate, 1.0);
    for _ in 0..REWEIGHTINGS {
        let weights = weights(left, columns, &sizes, &course.counted);
        let weighed = |channels: &Channels| -> Vec<f64> {
            let each = std::iter::zip(channels, &weights);
            each.flat_map(|(channel, weight)| {
                let scale = libm::sqrt(share * weight);
                let counted = std::iter::zip(channel, &course.counted);
                counted.filter(|(_, c)| **c).map(move |(v, _)| scale * v)
            })
            .collect()
        };
        let rows: Vec<Vec<f64>> = columns.iter().map(weighed).collect();
        let gram = Matrix::from_fn(columns.len(), columns.len(), |a, b| {
            let known = sd[a].filter(|_| a == b).map_or(0.0, |sd| 1.0 / (sd * sd));
            dot(&rows[a], &rows[b]) + known
        });
        let left = weighed(left);
        let score: Vec<f64> = rows.iter().map(|row| dot(row, &left)).collect();
        let bounds = |i: usize| {
            let furthest = sd[i].map_or(f64::INFINITY, |sd| FURTHEST * sd);
            (-furthest, furthest)
        };
        match solve(&gram, &score, &all, &bounds) {
            Some((found, _)) => sizes = found,
            None => break,
        }
    }
    sizes
}

/// One over the mean square of what columns of so many sizes leave of each channel.
fn weights(left: &Channels, columns: &[Channels], sizes: &[f64], counted: &[bool]) -> Vec<f64> {
    let one = |c: usize| {
        let mut sum = f64::MIN_POSITIVE;
        let mut count = 0.0;
        for i in (0..left[c].len()).filter(|&i| counted[i]) {
            let taken = std::iter::zip(columns, sizes);
            let v = taken.fold(left[c][i], |v, (column, size)| v - size * column[c][i]);
            sum += v * v;
            count += 1.0;
        }
        count / sum
    };
    (0..left.len()).map(one).collect()
}

#[cfg(test)]
mod tests {
    use arm_core::effect::Kind;

    use super::*;

    #[test]
    fn a_ripple_has_a_phase_of_its_own_in_every_trial_above_three_hertz() {
        let ripple = |frequency: f64| {
            let mut effect = Effect::new(Kind::RobotRipple, 0);
            effect.parameters[shapes_of(effect.kind)[0]] = frequency;
            is_rhythm(&effect)
        };
        assert_eq!([2.9, 3.1].map(ripple), [false, true]);
        let of = |kind| is_rhythm(&Effect::new(kind, 0));
        assert!(of(Kind::Tremor) && !of(Kind::Voluntary) && !of(Kind::Elastic));
    }
}
