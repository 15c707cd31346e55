//! Trial-specific effects that the search sets aside: rhythms, from the differences of repeats, and disturbances of single trials.

use std::sync::Arc;

use arm_core::effect::Effect;

use crate::GapError;
use crate::candidates::candidate::Candidate;
use crate::data::course::Course;
use crate::data::session::ComparisonMode;
use crate::fitting::fit::FittedHypothesis;
use crate::fitting::lack_of_fit::lack_of_fit;
use crate::prepared_session::PreparedSession;
use crate::selection::search_state::{Progress, SearchState, Settled};
use crate::sensitivity::linearization_point::LinearizationPoint;
use crate::trial_specific::component::{SLOW, TrialSpecific};
use crate::trial_specific::disturbance::is_held;
use crate::trial_specific::tremor_detection::Line;

/// Most disturbances of single trials that are named.
const DISTURBANCES: usize = 4;
/// What is kept apart from effects that last.
#[derive(Clone)]
pub(crate) struct TrialSpecificEffects<const N: usize> {
    /// What is not the same in every trial.
    pub trial_specific: Vec<TrialSpecific>,
    /// Frequency \[Hz\] and phase \[rad\] of a slow oscillation with one phase in all trials, which is tested like other effects.
    pub periodic: Option<[f64; 2]>,
    /// The courses as they were measured.
    pub measured: Vec<Arc<Course<N>>>,
}

impl<const N: usize> TrialSpecificEffects<N> {
    /// Keeps a slow oscillation only if one is named: another may be found later then.
    pub fn keep_periodic_if_named(&mut self, fitted: &FittedHypothesis<N>) {
        let mut kinds = fitted.asked.iter().map(Candidate::kind);
        let named = kinds.any(|kind| kind.prior().nature.swings());
        self.periodic = self.periodic.filter(|_| named);
    }

    /// Drops bursts that dry friction of the final model may hold.
    pub fn without_held(&mut self, effects: &[Effect<f64>]) {
        self.trial_specific.retain(|one| !is_held(one, effects));
    }
}

impl<'a, const N: usize> PreparedSession<'a, N> {
    /// Sets apart effects that differ between trials: a rhythm, from the differences of repeats, and disturbances of single trials. Beside
    /// disturbances the base may be calibrated again.
    pub(crate) fn set_apart(
        &mut self,
        mut settled: Settled<'a, N>,
        apart: &mut TrialSpecificEffects<N>,
    ) -> Result<Settled<'a, N>, GapError> {
        let led = self.session.comparison == ComparisonMode::Led;
        let rhythm = led.then(|| self.rhythm(&settled.1, Line::BetweenRepeats));
        if let Some(found) = rhythm.transpose()?.flatten() {
            self.take_out(&settled.1, &found)?;
            apart.trial_specific.push(found);
            settled = self.calibrate_anew()?;
        }
        settled = self.disturbances(settled, &mut apart.trial_specific, &[])?;
        if apart.trial_specific.iter().any(|one| one.trial.is_some()) {
            settled = self.with_base_anew(settled);
        }
        Ok(settled)
    }

    /// Looks for a slow oscillation where much is left, before effects are named that adapt to it.
    pub(crate) fn slow_oscillation(
        &self,
        settled: &Settled<'a, N>,
        apart: &mut TrialSpecificEffects<N>,
    ) {
        let (fitted, point) = settled;
        if fitted.leaves_much() {
            apart.periodic = self.in_phase((fitted, point), fitted.misfit());
        }
    }

    /// Tests for a rhythm again when an effect was named: the oscillation may have been that effect; the effect may have hidden a
    /// rhythm; and the response to a rhythm depends on it.
    pub(crate) fn rhythm_asked_again(
        &mut self,
        state: SearchState<'a, N>,
        apart: &mut TrialSpecificEffects<N>,
        progress: Progress<'_>,
    ) -> Result<SearchState<'a, N>, GapError> {
        if state.current.asked.is_empty() {
            return Ok(state);
        }
        let found = &mut apart.trial_specific;
        let before = found.iter().position(|a| a.trial.is_none());
        let without = std::mem::replace(&mut self.courses, apart.measured.clone());
        let was_in_runs = without.iter().any(|course| !course.rhythms.is_empty());
        let anew = was_in_runs.then(|| self.linearize(&state.point.hypothesis));
        let anew = anew.transpose()?;
        let point = anew.as_ref().unwrap_or(&state.point);
        let again = self.rhythm(point, Line::BetweenRepeats)?;
        match (before, again) {
            (Some(before), Some(again)) if again.is_like(&found[before]) => {
                self.take_out(point, &again)?;
                found[before] = again;
                self.renewed(state)
            }
            (None, None) => {
                self.courses = without;
                Ok(state)
            }
            (before, again) => {
                before.map(|before| found.remove(before));
                if let Some(again) = again {
                    self.take_out(point, &again)?;
                    found.push(again);
                }
                let settled = self.calibrate_anew()?;
                self.search_from(settled, apart.periodic, progress)
            }
        }
    }

    /// Searches the residuals for oscillations with one phase in all trials, which repeats share, and searches once more beside them.
    ///
    /// A fast swing may hide a slow one, and a slow one a fast one.
    pub(crate) fn rhythms_in_phase(
        &mut self,
        mut state: SearchState<'a, N>,
        apart: &mut TrialSpecificEffects<N>,
        progress: Progress<'_>,
    ) -> Result<SearchState<'a, N>, GapError> {
        for _ in 0..2 {
            if !self.sets_apart_in_phase(&state, apart)? {
                break;
            }
            let again = self.calibrate_anew()?;
            state = self.search_from(again, apart.periodic, progress)?;
            state = self.locked_set_apart_again(state, apart)?;
        }
        Ok(state)
    }

    /// Sets the only rhythm apart once more if it has one phase in all trials, as it is beside what was named: before that, its frequency and its
    /// size were those of a model that lacked the rest.
    fn locked_set_apart_again(
        &mut self,
        state: SearchState<'a, N>,
        apart: &mut TrialSpecificEffects<N>,
    ) -> Result<SearchState<'a, N>, GapError> {
        let all = apart.trial_specific.iter_mut();
        let mut rhythms = all.filter(|one| one.trial.is_none());
        let (Some(only), None) = (rhythms.next(), rhythms.next()) else {
            return Ok(state);
        };
        if !only.locked {
            return Ok(state);
        }
        let without = std::mem::replace(&mut self.courses, apart.measured.clone());
        let point = self.linearize(&state.point.hypothesis)?;
        match self.swinging_near(only, &point)? {
            Some(again) => {
                self.take_out(&point, &again)?;
                *only = again;
                self.renewed(state)
            }
            None => {
                self.courses = without;
                Ok(state)
            }
        }
    }

    /// Sets one oscillation in phase apart; whether there is one. Only one slow oscillation is searched for.
    fn sets_apart_in_phase(
        &mut self,
        state: &SearchState<'a, N>,
        apart: &mut TrialSpecificEffects<N>,
    ) -> Result<bool, GapError> {
        let mut found = None;
        for line in [Line::OfTheRobot, Line::InPhase] {
            let is_new = |f: &TrialSpecific| {
                f.gain > state.least(&f.effect)
                    && (f.locked || line == Line::OfTheRobot && f.wave()[0] > SLOW)
                    // What is left of a rhythm that was taken out has its frequency.
                    && !apart.trial_specific.iter().any(|a| a.swings_with(f))
            };
            if found.is_none() {
                found = self.rhythm(&state.point, line)?.filter(is_new);
            }
        }
        match found {
            Some(fast) if fast.wave()[0] >= SLOW => {
                self.take_out(&state.point, &fast)?;
                apart.trial_specific.push(fast);
                Ok(true)
            }
            _ if apart.periodic.is_some() => Ok(false),
            slow => {
                apart.periodic = match slow {
                    Some(slow) => Some(slow.wave()),
                    None => self.in_phase((&state.current, &state.point), state.scale),
                };
                Ok(apart.periodic.is_some())
            }
        }
    }

    /// Tests for disturbances of single trials again when an effect was named, which may have been taken for one.
    pub(crate) fn disturbances_asked_again(
        &mut self,
        mut state: SearchState<'a, N>,
        apart: &mut TrialSpecificEffects<N>,
    ) -> Result<SearchState<'a, N>, GapError> {
        let found = &mut apart.trial_specific;
        if state.current.asked.is_empty() || found.iter().all(|a| a.trial.is_none()) {
            return Ok(state);
        }
        self.take_back();
        let known: Vec<_> = found.extract_if(.., |a| a.trial.is_some()).collect();
        self.measure_noise(&self.simulate_alone(&state.current.hypothesis)?)?;
        let settled = self.settle(state.current.hypothesis, state.current.asked)?;
        let settled = self.disturbances(settled, found, &known)?;
        let from;
        (state.calibrated, from) = self.settle(state.calibrated.hypothesis, Vec::new())?;
        state.before = lack_of_fit(self, &from, &state.calibrated);
        (state.current, state.point) = self.pruned(settled, &state.calibrated, state.scale)?;
        Ok(state)
    }

    /// Leaves out of single trials what disturbs them, the clearest first.
    ///
    /// * `known` - what was found before dry friction was named: whole trials show it too where it happened while a joint rests
    fn disturbances(
        &mut self,
        (mut fitted, mut point): Settled<'a, N>,
        trial_specific: &mut Vec<TrialSpecific>,
        known: &[TrialSpecific],
    ) -> Result<Settled<'a, N>, GapError> {
        let most = trial_specific.len() + DISTURBANCES;
        while trial_specific.len() < most
            && let Some(one) = self.next_disturbance(&point, known)
            && let Some(trial) = one.trial
        {
            let (one, trial) = self.in_the_likelier_repeat((one, trial), &fitted);
            self.leave_out(trial, one.span());
            trial_specific.push(one);
            self.measure_noise(&self.simulate_alone(&point.hypothesis)?)?;
            (fitted, point) = self.settle(fitted.hypothesis, fitted.asked)?;
        }
        Ok((fitted, point))
    }

    /// A disturbance of one of two repeats, and the repeat without which the model fits all others better. Two repeats deviate alike, and a model
    /// that was fitted to both may be as far from one as from the other.
    fn in_the_likelier_repeat(
        &self,
        (one, trial): (TrialSpecific, usize),
        fitted: &FittedHypothesis<N>,
    ) -> (TrialSpecific, usize) {
        let group = self.group_of[trial];
        let repeats = self.fitted.iter().copied();
        let repeats: Vec<usize> = repeats.filter(|&t| self.group_of[t] == group).collect();
        let [first, second] = repeats[..] else {
            return (one, trial);
        };
        let other = if first == trial { second } else { first };
        let misfit_without = |left_out: usize| {
            let mut prepared = self.clone();
            prepared.leave_out(left_out, one.span());
            let again = prepared.settle(fitted.hypothesis.clone(), fitted.asked.clone());
            again.map_or(f64::INFINITY, |(fitted, _)| {
                fitted.cost - fitted.rows as f64
            })
        };
        if misfit_without(other) < misfit_without(trial) {
            (one.in_the_other_repeat(other), other)
        } else {
            (one, trial)
        }
    }

    /// The clearest disturbance of a single trial where joints move; else one that is known, in whole trials.
    fn next_disturbance(
        &mut self,
        point: &LinearizationPoint<N>,
        known: &[TrialSpecific],
    ) -> Option<TrialSpecific> {
        let moving = self.disturbance(point, 1.0);
        if moving.is_some() || known.is_empty() || !self.leaves_out_rest() {
            return moving;
        }
        // Other trials may have samples then.
        let found = self.over_whole_trials(|whole| {
            let whole_point = whole.linearize(&point.hypothesis).ok()?;
            whole.disturbance(&whole_point, 1.0)
        });
        found.filter(|one| known.iter().any(|before| before.is_same_event(one)))
    }
}
