//! A hypothesis as it is in one trial: where the hand holds the handle there, and the phase that a rhythm is in.
//!
//! Neither is the same from one trial to the next, so that no other trial tells them. They are read off each trial by itself,
//! whatever its role and whatever hypothesis is shown: two numbers for the handle, within what is declared of it, and one for
//! a rhythm.

use arm_core::effect::{Effect, Nature};
use arm_sim::SimulationError;
use nalgebra::{DMatrix, DVector};

use crate::anchor::Anchor;
use crate::apart::shapes_of;
use crate::hypothesis::{Coordinate, Hypothesis};
use crate::normal::factor;
use crate::predict::{Channels, Course, difference};
use crate::search::SLOW;
use crate::session::Session;
use crate::study::Study;

/// Times that channels are weighed anew by what is left of them.
const TURNS: usize = 2;

/// Whether an effect swings with a phase of its own in every trial; a slow ripple keeps its phase.
fn is_rhythm(effect: &Effect<f64>) -> bool {
    let swings = matches!(
        effect.kind.probe().nature,
        Nature::Rhythm | Nature::Periodic
    );
    swings && effect.parameters[shapes_of(effect.kind)[0]] > SLOW
}

impl<const N: usize> Session<N> {
    /// How the channels of a trial in the common band answer what is its own, for one unit each.
    ///
    /// # Errors
    /// As [`Session::run`].
    pub fn own_slopes(
        &self,
        hypothesis: &Hypothesis<N>,
        course: &Course<N>,
    ) -> Result<Vec<Channels>, SimulationError> {
        let base = self.shown(hypothesis, course)?;
        let one = |c: Coordinate| {
            let moved = hypothesis.clone().with(c.target, c.step);
            let mut slope = difference(&self.shown(&moved, course)?, &base);
            slope.iter_mut().flatten().for_each(|v| *v /= c.step);
            Ok(slope)
        };
        self.by_trial().into_iter().map(one).collect()
    }

    /// A hypothesis and rhythms as they are in a trial.
    ///
    /// * `slopes` - see [`Session::own_slopes`]; those of a repeat do as well
    ///
    /// # Errors
    /// As [`Session::run`].
    pub fn in_trial(
        &self,
        (hypothesis, rhythms): (&Hypothesis<N>, &[Effect<f64>]),
        course: &Course<N>,
        slopes: &[Channels],
    ) -> Result<Hypothesis<N>, SimulationError> {
        let mut own = hypothesis.clone();
        let placed = self.by_trial();
        if placed.is_empty() && rhythms.is_empty() {
            return Ok(own);
        }
        let base = self.shown(hypothesis, course)?;
        let left = difference(&course.seen, &base);
        let mut columns = slopes.to_vec();
        for rhythm in rhythms {
            for phase in [0.0, 0.5 * core::f64::consts::PI] {
                let mut swinging = hypothesis.clone();
                swinging.named.push(with_phase(rhythm, phase));
                columns.push(difference(&self.shown(&swinging, course)?, &base));
            }
        }
        let mut known: Vec<f64> = placed
            .iter()
            .map(|c| c.prior.map_or(0.0, |(_, sd)| 1.0 / (sd * sd)))
            .collect();
        known.resize(columns.len(), 0.0);
        let mut sizes = vec![0.0; columns.len()];
        for _ in 0..TURNS {
            let weights = weights(&left, &columns, &sizes, &course.counted);
            let product = |a: &Channels, b: &Channels| product((a, b), &weights, &course.counted);
            let gram = DMatrix::from_fn(columns.len(), columns.len(), |a, b| {
                let own = if a == b { known[a] } else { 0.0 };
                product(&columns[a], &columns[b]) + own
            });
            let score = DVector::from_fn(columns.len(), |a, _| product(&columns[a], &left));
            // What the trial does not tell stays as it is.
            let Some(solver) = factor(gram) else { break };
            sizes = solver.solve(&score).iter().copied().collect();
        }
        for (c, size) in std::iter::zip(&placed, &sizes) {
            own = own.with(c.target, *size);
        }
        for (rhythm, size) in std::iter::zip(rhythms, sizes[placed.len()..].chunks_exact(2)) {
            let phase = libm::atan2(size[1], size[0]);
            own.named.push(with_phase(rhythm, phase));
        }
        Ok(own)
    }

    /// A hypothesis as it is in a trial, the rhythms among its known effects included; as it was where it cannot be simulated.
    pub fn as_in_trial(&self, hypothesis: &Hypothesis<N>, course: &Course<N>) -> Hypothesis<N> {
        let mut lasting = hypothesis.clone();
        let rhythms: Vec<_> = lasting.known.extract_if(.., |e| is_rhythm(e)).collect();
        let own = self
            .own_slopes(&lasting, course)
            .and_then(|slopes| self.in_trial((&lasting, &rhythms), course, &slopes));
        own.unwrap_or_else(|_| hypothesis.clone())
    }

    fn shown(
        &self,
        hypothesis: &Hypothesis<N>,
        course: &Course<N>,
    ) -> Result<Channels, SimulationError> {
        let run = self.run(hypothesis, course)?;
        self.read(hypothesis, course, &run)
    }
}

impl<const N: usize> Study<'_, N> {
    /// A hypothesis and rhythms as they are in every trial, whatever its role; as they were where one cannot be simulated.
    pub fn in_trials(
        &self,
        believed: (&Hypothesis<N>, &[Effect<f64>]),
        anchor: &Anchor<N>,
    ) -> Vec<Hypothesis<N>> {
        let one = |trial: usize| {
            let group = self.group_of[trial];
            let slopes: Vec<Channels> = anchor.own.iter().map(|r| r.0[group].clone()).collect();
            let own = self
                .session
                .in_trial(believed, &self.courses[trial], &slopes);
            own.unwrap_or_else(|_| believed.0.clone())
        };
        self.parallel(self.courses.len(), one)
    }
}

fn with_phase(rhythm: &Effect<f64>, phase: f64) -> Effect<f64> {
    let mut effect = *rhythm;
    effect.parameters[shapes_of(effect.kind)[1]] = phase;
    effect
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

fn product((a, b): (&Channels, &Channels), weights: &[f64], counted: &[bool]) -> f64 {
    let mut sum = 0.0;
    for (c, weight) in weights.iter().enumerate() {
        for (i, _) in counted.iter().enumerate().filter(|(_, counted)| **counted) {
            sum += weight * a[c][i] * b[c][i];
        }
    }
    sum
}
