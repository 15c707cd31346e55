//! The rounds of the search: score tests of the catalogue, beam search, convergence by simulation, comparison with alternatives.

use crate::GapError;
use crate::candidates::candidate::Candidate;
use crate::candidates::library::Library;
use crate::data::session::ComparisonMode;
use crate::fitting::fit::FittedHypothesis;
use crate::fitting::lack_of_fit::lack_of_fit;
use crate::fitting::step::Aim;
use crate::hypothesis::{Hypothesis, Target};
use crate::prepared_session::PreparedSession;
use crate::search::conclusion::Finding;
use crate::search::trial_specific_effects::TrialSpecificEffects;
use crate::selection::model_selection::{MissingEffect, mimicked_by_any};
use crate::selection::score_test::{Choice, ScoreTest};
use crate::selection::search_state::{DetectionLimit, Progress, SearchRound, SearchState, Settled};

/// Most effects that are named.
const MOST: usize = 6;
/// Choices that are converged by simulation in each round.
const CONTENDERS: usize = 4;
/// Choices that are converged one after the other where none of these can be followed.
const RESERVES: usize = 8;
/// Effects that a choice may add in one round: some are significant together only.
const AHEAD: usize = 3;
/// Most comparisons of the result with alternatives, when these have replaced named effects.
const TURNS: usize = 3;
/// Width of the beam search.
const WIDTH: usize = 12;

impl<'a, const N: usize> PreparedSession<'a, N> {
    /// Searches for what the model lacks.
    ///
    /// First effects that differ between trials, from the differences of repeats; then lasting effects, with a slow oscillation among them
    /// where one is plain; then a ripple of the robot, in what is left; and everything that was set apart or found on the way is tested again.
    ///
    /// # Errors
    /// [`GapError`] where the model as given cannot be simulated or fitted.
    pub fn search(&mut self, progress: Progress<'_>) -> Result<Finding<N>, GapError> {
        progress("calibrating", 0.0)?;
        let mut settled = self.calibrate_base()?;
        if !self.repeated {
            self.measure_noise(&settled.1)?;
            settled = self.calibrate_base()?;
        }
        let led = self.session.comparison == ComparisonMode::Led;
        let mut apart = TrialSpecificEffects {
            trial_specific: Vec::new(),
            periodic: None,
            measured: self.courses.clone(),
        };
        if self.session.reads_contact() {
            progress("looking at single trials", 0.05)?;
            settled = self.set_apart(settled, &mut apart)?;
        }
        if led {
            self.slow_oscillation(&settled, &mut apart);
        }
        let mut state = self.search_from(settled, apart.periodic, progress)?;
        state = self.or_as_it_was(state, &mut apart, |all, state, apart| {
            all.with_base_reconsidered(state, apart.periodic, progress)
        })?;
        if led {
            apart.keep_periodic_if_named(&state.current);
            state = self.or_as_it_was(state, &mut apart, |all, state, apart| {
                all.rhythm_asked_again(state, apart, progress)
            })?;
            state = self.or_as_it_was(state, &mut apart, |all, state, apart| {
                all.rhythms_in_phase(state, apart, progress)
            })?;
        }
        state = self.or_as_it_was(state, &mut apart, Self::disturbances_asked_again)?;
        let (state, named) = self.judged_in_turns(state, apart.periodic, progress)?;
        self.concluded((state, named), apart, progress)
    }

    /// Goes on from what was found; where that leads to an arm that cannot be simulated, what was found before stands.
    fn or_as_it_was(
        &mut self,
        state: SearchState<'a, N>,
        apart: &mut TrialSpecificEffects<N>,
        go_on: impl FnOnce(
            &mut Self,
            SearchState<'a, N>,
            &mut TrialSpecificEffects<N>,
        ) -> Result<SearchState<'a, N>, GapError>,
    ) -> Result<SearchState<'a, N>, GapError> {
        let before = (self.clone(), state.clone(), apart.clone());
        match go_on(self, state, apart) {
            Err(GapError::Simulation { .. }) => {
                let found;
                (*self, found, *apart) = before;
                Ok(found)
            }
            other => other,
        }
    }

    /// Compares the result with alternatives, and continues the search where one replaced a named effect: beside a coarser law another
    /// effect could have been missed.
    fn judged_in_turns(
        &mut self,
        mut state: SearchState<'a, N>,
        periodic: Option<[f64; 2]>,
        progress: Progress<'_>,
    ) -> Result<(SearchState<'a, N>, Vec<MissingEffect>), GapError> {
        let kinds =
            |f: &FittedHypothesis<N>| f.asked.iter().map(Candidate::kind).collect::<Vec<_>>();
        let mut outcomes = Vec::new();
        for turn in 1.. {
            let before = kinds(&state.current);
            let named;
            (state, named) = self.judged(state, periodic, progress)?;
            if turn < TURNS
                && let Some(instead) = self.with_base_instead(&state.current, &state.point)?
            {
                state = self.with_base_changed(state, instead, periodic, progress)?;
                continue;
            }
            let after = kinds(&state.current);
            let rounds = state.search_trace.len();
            if turn < TURNS && after != before && !outcomes.contains(&after) {
                outcomes.push(after.clone());
                state = self.search_on(state, periodic, progress)?;
            }
            // A search that returns to an earlier state has other effects than the last comparison.
            if state.search_trace.len() == rounds && kinds(&state.current) == after {
                return Ok((state, named));
            }
        }
        unreachable!("the last turn returns")
    }

    /// Searches for lasting effects, round by round, from a calibrated model.
    pub(crate) fn search_from(
        &mut self,
        (calibrated, point): Settled<'a, N>,
        periodic: Option<[f64; 2]>,
        progress: Progress<'_>,
    ) -> Result<SearchState<'a, N>, GapError> {
        let start = SearchState {
            before: lack_of_fit(self, &point, &calibrated),
            current: calibrated.clone(),
            calibrated,
            point,
            search_trace: Vec::new(),
            detection_limits: Vec::new(),
            asked: 1.0,
            scale: 1.0,
            been: Vec::new(),
            barred: Vec::new(),
        };
        self.search_on(start, periodic, progress)
    }

    /// Goes on looking from what was found.
    fn search_on(
        &mut self,
        mut state: SearchState<'a, N>,
        periodic: Option<[f64; 2]>,
        progress: Progress<'_>,
    ) -> Result<SearchState<'a, N>, GapError> {
        state.is_back(self.dry);
        let mut has_barred = false;
        for round in 0..MOST {
            progress("asking the catalogue", 0.1 + 0.1 * round as f64)?;
            let library = Library::build(self, &state.point, periodic)?;
            let score_test = match ScoreTest::new(self, &state.current, &state.point, &library) {
                // What was found so far stands.
                Err(GapError::Simulation { .. } | GapError::Singular { .. })
                    if !state.current.asked.is_empty() =>
                {
                    break;
                }
                other => other?.scaled(),
            };
            state.asked = library.candidates.len() as f64;
            state.scale = score_test.scale;
            state.detection_limits = self.detection_limits(&library, &score_test);
            let room = MOST - state.current.asked.len();
            let asking = (&library, &score_test, room);
            let Some((settled, step)) = self.round(&state, asking) else {
                break;
            };
            state.search_trace.push(step);
            let settled = self.afresh(settled);
            let settled = self.with_friction_at_rest(settled)?;
            let asked = settled.0.asked.clone();
            (state.current, state.point) = self.pruned(settled, &state.calibrated, state.scale)?;
            if self.leave_out_rest(&state.point) {
                state = self.renewed_without_rest(state)?;
            }
            if state.is_back(self.dry) {
                state.search_trace.pop();
                // What stands in their place may be behind it; where nothing was, what is barred next would not have stayed either.
                if self.repeated && !has_barred && state.bar_lost(asked) {
                    has_barred = true;
                    continue;
                }
                break;
            }
            // Without repeats a second search has only its own residual to distinguish noise from missing effects.
            if state.current.asked.len() >= MOST || !self.repeated {
                break;
            }
        }
        Ok(state)
    }

    /// Goes on from laws of the passive base that came back once something else was named, or that stand in for it.
    fn with_base_reconsidered(
        &mut self,
        state: SearchState<'a, N>,
        periodic: Option<[f64; 2]>,
        progress: Progress<'_>,
    ) -> Result<SearchState<'a, N>, GapError> {
        let revived = self.with_base_revived(&state.current)?;
        match revived.or_else(|| self.with_one_dry_law(&state.current, state.scale)) {
            Some(revived) => self.with_base_changed(state, revived, periodic, progress),
            None => Ok(state),
        }
    }

    /// Goes on from what was found with other laws of the passive base.
    fn with_base_changed(
        &mut self,
        mut state: SearchState<'a, N>,
        revived: Settled<'a, N>,
        periodic: Option<[f64; 2]>,
        progress: Progress<'_>,
    ) -> Result<SearchState<'a, N>, GapError> {
        let known = revived.0.hypothesis.known.clone();
        self.start = Some(Hypothesis {
            known: known.clone(),
            ..self.given()
        });
        let mut rigid = state.calibrated.hypothesis.clone();
        rigid.known = known;
        // What is calibrated without what was named may go on from where it was.
        if let Ok((calibrated, point)) = self.settle(rigid, Vec::new()) {
            state.before = lack_of_fit(self, &point, &calibrated);
            state.calibrated = calibrated;
        }
        (state.current, state.point) = self.pruned(revived, &state.calibrated, state.scale)?;
        self.search_on(state, periodic, progress)
    }

    /// What was found, after rest has been left out. Stribeck's law is gone where joints move: where that leaves no dry law, rest is compared
    /// again, as it alone shows that law.
    fn renewed_without_rest(
        &mut self,
        state: SearchState<'a, N>,
    ) -> Result<SearchState<'a, N>, GapError> {
        let renewed = self.renewed(state.clone())?;
        if !self.leaves_out_rest_for_nothing(&renewed.current.hypothesis) {
            return Ok(renewed);
        }
        self.compare_rest();
        self.renewed(state)
    }

    /// What was found, after the data that are compared have changed.
    pub(crate) fn renewed(
        &mut self,
        mut state: SearchState<'a, N>,
    ) -> Result<SearchState<'a, N>, GapError> {
        self.measure_noise(&self.simulate_alone(&state.current.hypothesis)?)?;
        let from;
        (state.calibrated, from) = self.settle(state.calibrated.hypothesis, Vec::new())?;
        state.before = lack_of_fit(self, &from, &state.calibrated);
        let settled = self.settle(state.current.hypothesis, state.current.asked)?;
        (state.current, state.point) = self.pruned(settled, &state.calibrated, state.scale)?;
        Ok(state)
    }

    /// What was found, fitted once more with segments and sensors as given, where much is left or a sensor is far from what was
    /// promised of it: without what was found they were bent far, and may not find back by themselves.
    pub(crate) fn afresh(&self, (fitted, point): Settled<'a, N>) -> Settled<'a, N> {
        let sensors = point
            .coordinates
            .iter()
            .filter_map(|c| match (c.target, c.prior) {
                (Target::Calibration(_), Some((mean, sd))) => {
                    Some((fitted.hypothesis.get(c.target) - mean) / sd)
                }
                _ => None,
            });
        if !fitted.leaves_much() && !is_beyond_promise(sensors) {
            return (fitted, point);
        }
        let start = Hypothesis {
            known: fitted.hypothesis.known.clone(),
            named: fitted.hypothesis.named.clone(),
            ..self.given()
        };
        match self.settle(start, fitted.asked.clone()) {
            Ok(again) if again.0.cost < fitted.cost => again,
            _ => (fitted, point),
        }
    }

    /// The same after the data have changed, with the noise read anew.
    pub(crate) fn calibrate_anew(&mut self) -> Result<Settled<'a, N>, GapError> {
        let given = self.simulate_alone(&self.given())?;
        self.measure_noise(&given)?;
        self.calibrate()
    }

    /// One round: the best choices of the score tests, converged by simulation; `None` when none is worth its price and possible.
    ///
    /// Where the shape of a law converges to that of a simpler one, the score tests are repeated without it.
    fn round(
        &self,
        state: &SearchState<'a, N>,
        (library, score_test, room): (&Library, &ScoreTest, usize),
    ) -> Option<(Settled<'a, N>, SearchRound)> {
        let current = &state.current;
        // Less than every effect must explain need not be converged.
        let explained = state.calibrated.cost - current.cost;
        let least = |member: &usize| {
            let effect = &library.candidates[*member].effect;
            mimicked_by_any(effect, &current.asked, explained)
        };
        let mut converged = Converged {
            worthy: Vec::new(),
            tried: Vec::new(),
            met: Vec::new(),
            plainer: state.barred.clone(),
        };
        for _ in 0..TURNS {
            let fresh = |members: &[usize], c: usize| {
                let candidate = &library.candidates[c];
                let is_plainer = |other: &Candidate| other.is_same_effect(&candidate.effect);
                // All oscillating candidates have the same frequency and phase: they have one cause.
                let is_asked = |other: &Candidate| {
                    let swings = |c: &Candidate| c.kind().prior().nature.swings();
                    other.is_same_question(candidate) || swings(other) && swings(candidate)
                };
                // Families before members: two laws of a family together fit the effect of one. A second one is tested in a separate round.
                let is_kin = |other: &Candidate| {
                    is_asked(other) || other.is_of_family_in_joint(&candidate.effect)
                };
                !current.asked.iter().any(is_asked)
                    && !members.iter().any(|&m| is_kin(&library.candidates[m]))
                    && !converged.plainer.iter().any(is_plainer)
            };
            let choices = score_test.search(&[], AHEAD.min(room), WIDTH, &fresh);
            let choices: Vec<Choice> = choices
                .into_iter()
                .filter(|c| c.gain > c.members.iter().map(least).sum())
                .collect();
            let before = converged.plainer.len();
            let (best, reserves) = contenders(&choices, library);
            for choice in best {
                self.converge(choice, state, (library, score_test), &mut converged);
            }
            for choice in reserves {
                if !converged.tried.is_empty() {
                    break;
                }
                self.converge(choice, state, (library, score_test), &mut converged);
            }
            if converged.plainer.len() == before {
                break;
            }
        }
        let Converged { worthy, tried, .. } = &mut converged;
        tried.sort_by(|a, b| b.1.total_cmp(&a.1));
        worthy.sort_by(|a, b| b.0.total_cmp(&a.0));
        // A solution that can be followed but not simulated is refused.
        converged.worthy.into_iter().find_map(|(_, better)| {
            let step = SearchRound {
                tried: converged.tried.clone(),
                before: current.cost,
                after: better.cost,
            };
            let settled = self.settle(better.hypothesis, better.asked).ok()?;
            Some((settled, step))
        })
    }

    /// Converges a choice by simulation, unless it has been or has an effect that came to a plainer law; given up where it will not be worth
    /// its price, or not more than the best so far.
    fn converge(
        &self,
        choice: Choice,
        state: &SearchState<'a, N>,
        (library, score_test): (&Library, &ScoreTest),
        converged: &mut Converged<N>,
    ) {
        let question = |&m: &usize| {
            let mut candidate = library.candidates[m].clone();
            (candidate.price, candidate.spread) = (score_test.price[m], score_test.spread[m]);
            candidate
        };
        let asked: Vec<Candidate> = choice.members.iter().map(question).collect();
        let is_plainer = |c: &Candidate| {
            let mut plainer = converged.plainer.iter();
            plainer.any(|other| other.is_same_effect(&c.effect))
        };
        if converged.met.contains(&choice.members) || asked.iter().any(is_plainer) {
            return;
        }
        let SearchState { current, point, .. } = state;
        let price: f64 = asked.iter().map(|c| c.price * c.spread).sum();
        let shapes = self.price_of_shapes(&asked);
        // Worth its price, and more than the best so far.
        let best = converged.worthy.iter().map(|(simple, _)| *simple);
        let least = best.map(|simple| simple + price + shapes);
        let least = least.fold(price, f64::max) * score_test.scale;
        let aim = Aim::at(
            current.cost - least,
            asked.iter().any(Candidate::is_dry_friction),
        );
        let fitted = self.attempt(current, (&asked, &choice.coefficients), (point, aim));
        converged.met.push(choice.members);
        let Some(fitted) = fitted else { return };
        let gain = current.cost - fitted.cost;
        let worth = gain / score_test.scale - price;
        converged.tried.push((asked, gain));
        if fitted.has_plainer() {
            converged.plainer.extend(fitted.plainer());
        } else if worth > 0.0 {
            converged.worthy.push((worth - shapes, fitted));
        }
    }

    fn detection_limits(&self, library: &Library, score_test: &ScoreTest) -> Vec<DetectionLimit> {
        (0..score_test.len())
            .map(|c| DetectionLimit {
                effect: library.candidates[c].effect,
                free: library.candidates[c].free.clone(),
                gain: score_test.evaluate(&[c]).map_or(0.0, |choice| choice.gain)
                    / score_test.scale,
                price: score_test.price[c] * score_test.spread[c],
                smallest: score_test.smallest_seen(c, library.candidates[c].free.len()),
            })
            .collect()
    }
}

/// What came of the choices that were converged by simulation.
struct Converged<const N: usize> {
    /// Those worth their price: their worth less the price of their shapes, and how they fit.
    worthy: Vec<(f64, FittedHypothesis<N>)>,
    /// All with what they gained.
    tried: Vec<(Vec<Candidate>, f64)>,
    /// Their members, also of those that cannot be followed: none is converged twice.
    met: Vec<Vec<usize>>,
    /// Questions that came to a plainer law, now or in a round before.
    plainer: Vec<Candidate>,
}

/// The choices that are converged by simulation, the best first, each with other effects, and the best of a single effect; and those
/// behind them, for where none of these can be followed.
fn contenders(choices: &[Choice], library: &Library) -> (Vec<Choice>, Vec<Choice>) {
    let mut best: Vec<Choice> = Vec::new();
    let most = choices.first().map_or(0.0, |c| c.worth);
    for choice in choices.iter().filter(|c| c.worth > 0.5 * most) {
        if best.len() >= CONTENDERS + RESERVES {
            break;
        }
        // Another shape of the same effects is refined by the fit, it need not be converged by itself.
        let same = |other: &Choice| {
            other.members.len() == choice.members.len()
                && std::iter::zip(&other.members, &choice.members).all(|(&a, &b)| {
                    library.candidates[a].is_same_effect(&library.candidates[b].effect)
                })
        };
        if !best.iter().any(same) {
            best.push(choice.clone());
        }
    }
    let mut reserves = best.split_off(CONTENDERS.min(best.len()));
    let single = choices
        .iter()
        .find(|c| c.members.len() == 1 && c.worth > 0.0);
    if let Some(single) = single
        && !best.iter().any(|c| c.members == single.members)
    {
        reserves.retain(|c| c.members != single.members);
        best.push(single.clone());
    }
    (best, reserves)
}

/// Whether a sensor is far outside its tolerance.
///
/// * `sensors` - how far each is off, in standard deviations of the tolerance
fn is_beyond_promise(mut sensors: impl Iterator<Item = f64>) -> bool {
    /// Standard deviations beyond which a sensor is far: one in twenty by chance.
    const FAR: f64 = 2.0;
    sensors.any(|off| off.abs() > FAR)
}

#[cfg(test)]
mod tests {
    use arm_core::effect::Effect;

    use super::*;

    /// Pairs, all distinct, and behind them the best of a single effect.
    #[test]
    fn the_best_of_a_single_effect_stands_behind_the_best_four_and_before_the_reserves() {
        let kinds = arm_core::effect::KINDS.iter().take(16);
        let library = Library {
            candidates: kinds
                .map(|&kind| Candidate::about(Effect::new(kind, 0)))
                .collect(),
            responses: Vec::new(),
            columns: std::sync::OnceLock::new(),
        };
        let choice = |members: Vec<usize>, worth| Choice {
            coefficients: vec![vec![1.0]; members.len()],
            gain: worth,
            worth,
            members,
        };
        let pairs = (1..16).map(|k| choice(vec![0, k], 100.0 - k as f64));
        let all: Vec<Choice> = pairs.chain([choice(vec![3], 51.0)]).collect();
        let (best, reserves) = contenders(&all, &library);
        let members: Vec<_> = best.iter().map(|c| c.members.clone()).collect();
        assert_eq!(members[..CONTENDERS], [[0, 1], [0, 2], [0, 3], [0, 4]]);
        assert_eq!(members[CONTENDERS..], [[3]]);
        assert_eq!(
            (&reserves[0].members[..], reserves.len()),
            (&[0, 5][..], RESERVES)
        );
    }

    #[test]
    fn what_was_found_is_fitted_afresh_where_a_sensor_is_far_off() {
        let far = |sensor: f64| is_beyond_promise([0.1, sensor].into_iter());
        assert!(!far(1.99) && !far(-1.99) && far(2.01) && far(-2.01));
        assert!(!is_beyond_promise(std::iter::empty()));
    }
}
