//! The search for what a model lacks: ask the whole catalogue, look ahead, converge by simulation, go back.

use arm_core::effect::Effect;

use crate::GapError;
use crate::candidates::candidate::{Candidate, Library};
use crate::data::prepared_session::PreparedSession;
use crate::data::session::ComparisonMode;
use crate::measurement_model::hypothesis::Hypothesis;
use crate::selection::fit::{Fitted, Precision, enough};
use crate::selection::lack_of_fit::{LackOfFit, lack_of_fit};
use crate::selection::model_selection::{FLOOR, Named, mimicked_by_any};
use crate::selection::passive_base::Term;
use crate::selection::score_test::{Choice, ScoreTest};
use crate::sensitivity::linearization_point::LinearizationPoint;
use crate::trial_specific::component::TrialSpecific;
use crate::trial_specific::tremor_detection::Line;

/// Most disturbances of single trials that are named.
const DISTURBANCES: usize = 4;
/// Frequency below which a ripple must keep its phase in every trial and is asked like other effects \[Hz\]: movements and
/// what a model lacks of them reach that far.
pub(crate) const SLOW: f64 = 3.0;
/// Most effects that are named.
const MOST: usize = 6;
/// Choices that are converged by simulation in each round.
const CONTENDERS: usize = 4;
/// Effects that a choice may add in one round: what is invisible alone may be plain together.
const AHEAD: usize = 3;
/// Times that what was found is judged, when others have taken the places of what was named.
const TURNS: usize = 3;
/// Choices that are kept while looking ahead.
const WIDTH: usize = 12;

/// One round of the search.
#[derive(Clone, Debug)]
pub struct SearchStep {
    /// What was added, best first: the candidates and what they gained.
    pub tried: Vec<(Vec<Candidate>, f64)>,
    /// Cost before it.
    pub before: f64,
    /// Cost after it.
    pub after: f64,
}

/// A candidate of the last scan: what it would still explain, and the smallest size that would have been named.
#[derive(Clone, Debug)]
pub struct Ruled {
    /// The candidate.
    pub candidate: Candidate,
    /// What it would gain.
    pub gain: f64,
    /// What it would have to gain.
    pub price: f64,
    /// Smallest size of its first free parameter that would have been named.
    pub smallest: f64,
}

/// What was found.
#[derive(Clone, Debug)]
pub struct Finding<const N: usize> {
    /// The model after refitting what was never exact.
    pub calibrated: Fitted<N>,
    /// The model with the named effects.
    pub amended: Fitted<N>,
    /// The named effects, those that explain most first.
    pub named: Vec<Named>,
    /// What is not the same in every trial.
    pub trial_specific: Vec<TrialSpecific>,
    /// The calibrated and the amended model as they are in each trial; see [`crate::measurement_model::in_trial`].
    pub in_trials: [Vec<Hypothesis<N>>; 2],
    /// Rounds of the search.
    pub search_trace: Vec<SearchStep>,
    /// How well the amended model is known.
    pub precision: Precision,
    /// Lack of fit of the calibrated and of the amended model.
    pub lack: [LackOfFit; 2],
    /// Laws of the passive base that are named.
    pub base: Vec<Term>,
    /// What all named effects together explain.
    pub explained: f64,
    /// What else was asked.
    pub ruled: Vec<Ruled>,
    /// Misfit for each degree of freedom.
    pub scale: f64,
}

/// What a search tells while it works: what it does, and how far it is (0 to 1). [`GapError::Stopped`] in answer ends the search.
pub type Progress<'a> = &'a (dyn Fn(&str, f64) -> Result<(), GapError> + Sync);

/// A fitted hypothesis with the simulation that it was followed from.
pub(crate) type Settled<'a, const N: usize> = (Fitted<N>, LinearizationPoint<'a, N>);

/// What was found of effects that last.
struct SearchState<'a, const N: usize> {
    calibrated: Fitted<N>,
    /// What the calibrated model leaves, at the same samples and with the same noise.
    before: LackOfFit,
    current: Fitted<N>,
    point: LinearizationPoint<'a, N>,
    search_trace: Vec<SearchStep>,
    ruled: Vec<Ruled>,
    /// Number of candidates.
    asked: f64,
    scale: f64,
    /// Where it has been: what was named, the joints that are dry then, and the cost.
    been: Vec<(Vec<Candidate>, [bool; N], f64)>,
}

impl<const N: usize> SearchState<'_, N> {
    /// Whether it has been here before and was no worse off: from here it would go round in a circle.
    fn is_back(&mut self, dry: [bool; N]) -> bool {
        let Fitted { asked, cost, .. } = &self.current;
        let same = |other: &[Candidate]| {
            other.len() == asked.len()
                && other
                    .iter()
                    .all(|o| asked.iter().any(|a| a.is_same_question(o)))
        };
        let back = self.been.iter().any(|(named, then, before)| {
            *then == dry && same(named) && before - cost < enough(*cost)
        });
        self.been.push((asked.clone(), dry, *cost));
        back
    }

    /// What a further effect must gain so as not to be the imperfect shape of a named one.
    fn least(&self, effect: &Effect<f64>) -> f64 {
        let explained = self.calibrated.cost - self.current.cost;
        f64::max(
            FLOOR * explained,
            mimicked_by_any(effect, &self.current.asked, explained),
        )
    }
}

impl<'a, const N: usize> PreparedSession<'a, N> {
    /// Searches for what the model lacks.
    ///
    /// First what is not the same in every trial, told by what repeats differ in; then what lasts; then a ripple of the
    /// robot, in what is left; and whatever was set apart or found on the way is asked once more.
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
        let mut trial_specific: Vec<TrialSpecific> = Vec::new();
        let mut periodic = None;
        let measured = self.courses.clone();
        if led {
            progress("looking at single trials", 0.05)?;
            if let Some(found) = self.rhythm(&settled.1, Line::BetweenRepeats)? {
                self.take_out(&settled.1, &found)?;
                trial_specific.push(found);
                settled = self.calibrate_anew()?;
            }
            settled = self.disturbances(settled, &mut trial_specific)?;
        }
        let mut state = self.search_from(settled, periodic, progress)?;
        if led && !state.current.asked.is_empty() {
            // What rang may have been what was named since; what was named may have hidden a rhythm; and how an arm answers one
            // depends on what was named.
            let before = trial_specific.iter().position(|a| a.trial.is_none());
            let without = std::mem::replace(&mut self.courses, measured.clone());
            let again = self.rhythm(&state.point, Line::BetweenRepeats)?;
            match (before, again) {
                (Some(before), Some(again)) if again.is_like(&trial_specific[before]) => {
                    self.take_out(&state.point, &again)?;
                    trial_specific[before] = again;
                    state = self.renewed(state)?;
                }
                (None, None) => self.courses = without,
                (before, again) => {
                    before.map(|before| trial_specific.remove(before));
                    if let Some(again) = again {
                        self.take_out(&state.point, &again)?;
                        trial_specific.push(again);
                    }
                    let settled = self.calibrate_anew()?;
                    state = self.search_from(settled, periodic, progress)?;
                }
            }
        }
        if led {
            let found = self.rhythm(&state.point, Line::OfTheRobot)?;
            let found = found.filter(|f| {
                (f.locked || f.wave()[0] > SLOW)
                    && f.gain > state.least(&f.effect)
                    // What is left of a rhythm that was taken out has its frequency.
                    && !trial_specific.iter().any(|a| a.swings_with(f))
            });
            periodic = match &found {
                Some(found) => Some(found.wave()).filter(|[frequency, _]| *frequency < SLOW),
                None => self.slow_ripple((&state.current, &state.point), state.scale),
            };
            if let (Some(found), None) = (&found, periodic) {
                self.take_out(&state.point, found)?;
                trial_specific.push(found.clone());
            }
            if found.is_some() || periodic.is_some() {
                let again = self.calibrate_anew()?;
                state = self.search_from(again, periodic, progress)?;
            }
        }
        if trial_specific.iter().any(|a| a.trial.is_some()) && !state.current.asked.is_empty() {
            // What looked like a disturbance may have been what was named since.
            self.take_back();
            trial_specific.retain(|a| a.trial.is_none());
            self.measure_noise(&self.linearize(&state.current.hypothesis)?)?;
            let settled = self.settle(state.current.hypothesis, state.current.asked)?;
            let settled = self.disturbances(settled, &mut trial_specific)?;
            let from;
            (state.calibrated, from) = self.settle(state.calibrated.hypothesis, Vec::new())?;
            state.before = lack_of_fit(self, &from, &state.calibrated);
            (state.current, state.point) = self.pruned(settled, &state.calibrated, state.scale)?;
        }
        let mut named;
        let mut turns = 0;
        let mut outcomes = Vec::new();
        loop {
            let kinds = |f: &Fitted<N>| f.asked.iter().map(Candidate::kind).collect::<Vec<_>>();
            let before = kinds(&state.current);
            (state.current, state.point, named) = self.judged(
                (state.current, state.point),
                &state.calibrated,
                (state.asked, state.scale, periodic),
                progress,
            )?;
            turns += 1;
            let after = kinds(&state.current);
            if turns == TURNS || after == before || outcomes.contains(&after) {
                break;
            }
            outcomes.push(after);
            // What a coarser law could have missed may be seen beside the one that took its place.
            let rounds = state.search_trace.len();
            state = self.search_on(state, periodic, progress)?;
            if state.search_trace.len() == rounds {
                break;
            }
        }
        let SearchState {
            mut calibrated,
            before,
            current: mut amended,
            point,
            search_trace,
            ruled,
            scale,
            ..
        } = state;
        progress("judging the passive base", 0.88)?;
        let ((fitted, point), base) = self.judged_base((amended, point), scale)?;
        amended = fitted;
        progress("measuring what is left", 0.9)?;
        let mut precision = self.precision(&point, &amended, scale)?;
        for one in &named {
            let missed = amended.asked[one.slot].kind().probe().missed;
            precision.widen(one.slot, missed, one.gain);
        }
        let mut explained = calibrated.cost - amended.cost;
        let mut before = before;
        if let Some((rigid, lack)) = self.rigid(&base) {
            explained = rigid.cost - amended.cost;
            (calibrated, before) = (rigid, lack);
        }
        let lack = [before, lack_of_fit(self, &point, &amended)];
        if let Some((hypothesis, _)) = self.refined(&calibrated) {
            calibrated.hypothesis = hypothesis;
        }
        if let Some((hypothesis, known)) = self.refined(&amended) {
            (amended.hypothesis, precision) = (hypothesis, known);
        }
        self.courses = measured;
        let rhythms = rhythms_of(&trial_specific);
        for fitted in [&mut calibrated, &mut amended] {
            if let Some(hypothesis) = self.tuned(&fitted.hypothesis, &rhythms) {
                fitted.hypothesis = hypothesis;
            }
        }
        if !rhythms.is_empty() {
            // The contact is part of what decides how large a rhythm is.
            let tuned = self.linearize(&amended.hypothesis)?;
            for one in trial_specific.iter_mut().filter(|a| a.trial.is_none()) {
                if let Some(sized) = self.sized(&tuned, one) {
                    *one = sized;
                }
            }
        }
        let rhythms = rhythms_of(&trial_specific);
        let in_trials = [
            self.in_trials((&calibrated.hypothesis, &[])),
            self.in_trials((&amended.hypothesis, &rhythms)),
        ];
        progress("done", 1.0)?;
        Ok(Finding {
            calibrated,
            amended,
            named,
            trial_specific,
            in_trials,
            search_trace,
            precision,
            lack,
            base,
            explained,
            ruled,
            scale,
        })
    }

    /// Looks for effects that last, round by round, from a calibrated model.
    fn search_from(
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
            ruled: Vec::new(),
            asked: 1.0,
            scale: 1.0,
            been: Vec::new(),
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
            state.ruled = self.ruled(&library, &score_test);
            let room = MOST - state.current.asked.len();
            let from = (&state.calibrated, &state.current);
            let Some((settled, step)) =
                self.round(from, &state.point, (&library, &score_test), room)
            else {
                break;
            };
            state.search_trace.push(step);
            let settled = self.afresh(settled);
            (state.current, state.point) = self.pruned(settled, &state.calibrated, state.scale)?;
            if self.leave_out_rest(&state.point) {
                state = self.renewed(state)?;
            }
            if state.is_back(self.dry) {
                state.search_trace.pop();
                break;
            }
            // Without repeats a second look has only its own residual to tell noise from what the model lacks.
            if state.current.asked.len() >= MOST || !self.repeated {
                break;
            }
        }
        Ok(state)
    }

    /// What was found, after the data that are compared have changed.
    fn renewed(&mut self, mut state: SearchState<'a, N>) -> Result<SearchState<'a, N>, GapError> {
        self.measure_noise(&self.linearize(&state.current.hypothesis)?)?;
        let from;
        (state.calibrated, from) = self.settle(state.calibrated.hypothesis, Vec::new())?;
        state.before = lack_of_fit(self, &from, &state.calibrated);
        let settled = self.settle(state.current.hypothesis, state.current.asked)?;
        (state.current, state.point) = self.pruned(settled, &state.calibrated, state.scale)?;
        Ok(state)
    }

    /// What was found, fitted once more with segments and sensors as given, where much is left: without it they were bent far,
    /// and may not find back by themselves.
    fn afresh(&self, (fitted, point): Settled<'a, N>) -> Settled<'a, N> {
        /// Misfit for each row beyond which much is left.
        const MUCH: f64 = 1.5;
        let channels = self.session.channels();
        let told = self
            .fitted
            .iter()
            .map(|&t| self.valid_segments[t].rows_per_channel(channels));
        let rows: usize = told.flatten().sum();
        if fitted.cost < MUCH * rows as f64 {
            return (fitted, point);
        }
        let start = Hypothesis {
            named: fitted.hypothesis.named.clone(),
            ..self.given()
        };
        match self.settle(start, fitted.asked.clone()) {
            Ok(again) if again.0.cost < fitted.cost => again,
            _ => (fitted, point),
        }
    }

    /// Leaves out of single trials what disturbs them, the clearest first.
    fn disturbances(
        &mut self,
        (mut fitted, mut point): Settled<'a, N>,
        trial_specific: &mut Vec<TrialSpecific>,
    ) -> Result<Settled<'a, N>, GapError> {
        let most = trial_specific.len() + DISTURBANCES;
        while trial_specific.len() < most
            && let Some(one) = self.disturbance(&point, 1.0)
            && let Some(trial) = one.trial
        {
            self.leave_out(trial, one.span());
            trial_specific.push(one);
            self.measure_noise(&self.linearize(&point.hypothesis)?)?;
            (fitted, point) = self.settle(fitted.hypothesis, fitted.asked)?;
        }
        Ok((fitted, point))
    }

    /// The model as given, with everything refitted that was never exact.
    ///
    /// # Errors
    /// As [`PreparedSession::settle`].
    pub fn calibrate(&self) -> Result<Settled<'a, N>, GapError> {
        self.settle(self.given(), Vec::new())
    }

    /// The same after the data have changed, with the noise read anew.
    fn calibrate_anew(&mut self) -> Result<Settled<'a, N>, GapError> {
        let given = self.linearize(&self.given())?;
        self.measure_noise(&given)?;
        self.calibrate()
    }

    /// One round: the best choices of the scan, converged by simulation; `None` when none is worth its price and possible.
    fn round(
        &self,
        (calibrated, current): (&Fitted<N>, &Fitted<N>),
        point: &LinearizationPoint<N>,
        (library, score_test): (&Library, &ScoreTest),
        room: usize,
    ) -> Option<(Settled<'a, N>, SearchStep)> {
        let fresh = |members: &[usize], c: usize| {
            let candidate = &library.candidates[c];
            !current.asked.iter().any(|a| a.is_same_question(candidate))
                && !members
                    .iter()
                    .any(|&m| library.candidates[m].is_same_question(candidate))
        };
        let choices = score_test.search(&[], AHEAD.min(room), WIDTH, &fresh);
        // Less than every effect must explain need not be converged.
        let explained = calibrated.cost - current.cost;
        let least = |member: &usize| {
            let effect = &library.candidates[*member].effect;
            mimicked_by_any(effect, &current.asked, explained)
        };
        let choices: Vec<Choice> = choices
            .into_iter()
            .filter(|c| c.gain > c.members.iter().map(least).sum())
            .collect();
        let mut contenders: Vec<Choice> = Vec::new();
        let most = choices.first().map_or(0.0, |c| c.worth);
        for choice in choices.iter().filter(|c| c.worth > 0.5 * most) {
            if contenders.len() >= CONTENDERS {
                break;
            }
            // Another shape of the same effects is refined by the fit, it need not be converged by itself.
            let same = |other: &Choice| {
                other.members.len() == choice.members.len()
                    && std::iter::zip(&other.members, &choice.members).all(|(&a, &b)| {
                        library.candidates[a].is_same_effect(&library.candidates[b].effect)
                    })
            };
            if !contenders.iter().any(same) {
                contenders.push(choice.clone());
            }
        }
        if let Some(single) = choices
            .iter()
            .find(|c| c.members.len() == 1 && c.worth > 0.0)
            && !contenders.iter().any(|c| c.members == single.members)
        {
            contenders.push(single.clone());
        }
        let mut worthy: Vec<(f64, Fitted<N>)> = Vec::new();
        let mut tried = Vec::new();
        for choice in &contenders {
            let asked: Vec<Candidate> = choice
                .members
                .iter()
                .map(|&m| {
                    let mut candidate = library.candidates[m].clone();
                    (candidate.price, candidate.spread) =
                        (score_test.price[m], score_test.spread[m]);
                    candidate
                })
                .collect();
            let Some(fitted) = self.attempt(current, (&asked, &choice.coefficients), point) else {
                continue;
            };
            let price: f64 = asked.iter().map(|c| c.price * c.spread).sum();
            let gain = current.cost - fitted.cost;
            let worth = gain / score_test.scale - price;
            let simple = worth - self.price_of_shapes(&asked);
            tried.push((asked, gain));
            if worth > 0.0 {
                worthy.push((simple, fitted));
            }
        }
        tried.sort_by(|a, b| b.1.total_cmp(&a.1));
        worthy.sort_by(|a, b| b.0.total_cmp(&a.0));
        // What can be followed but not simulated is no answer.
        worthy.into_iter().find_map(|(_, better)| {
            let step = SearchStep {
                tried: tried.clone(),
                before: current.cost,
                after: better.cost,
            };
            let settled = self.settle(better.hypothesis, better.asked).ok()?;
            Some((settled, step))
        })
    }

    /// A hypothesis with further effects, fitted; `None` where it cannot be followed.
    ///
    /// The first-order coefficients are halved until they lower the cost: effects that are strong are not linear.
    pub(crate) fn attempt(
        &self,
        current: &Fitted<N>,
        (asked, coefficients): (&[Candidate], &[Vec<f64>]),
        point: &LinearizationPoint<N>,
    ) -> Option<Fitted<N>> {
        const SHARES: [f64; 4] = [1.0, 0.5, 0.2, 0.05];
        let mut all = current.asked.clone();
        all.extend_from_slice(asked);
        let mut best: Option<Fitted<N>> = None;
        for share in SHARES {
            let mut hypothesis = current.hypothesis.clone();
            for (candidate, own) in std::iter::zip(asked, coefficients) {
                let own: Vec<f64> = own.iter().map(|b| share * b).collect();
                hypothesis.named.push(candidate.found(&own));
            }
            if let Ok(fitted) = self.fit(point, hypothesis.handed_over(), all.clone()) {
                if fitted.cost < current.cost {
                    return Some(fitted);
                }
                if best.as_ref().is_none_or(|b| fitted.cost < b.cost) {
                    best = Some(fitted);
                }
            }
        }
        best
    }

    fn ruled(&self, library: &Library, score_test: &ScoreTest) -> Vec<Ruled> {
        (0..score_test.len())
            .map(|c| Ruled {
                candidate: library.candidates[c].clone(),
                gain: score_test.evaluate(&[c]).map_or(0.0, |choice| choice.gain)
                    / score_test.scale,
                price: score_test.price[c] * score_test.spread[c],
                smallest: score_test.smallest_seen(c),
            })
            .collect()
    }
}

/// Those that swing in every trial.
fn rhythms_of(trial_specific: &[TrialSpecific]) -> Vec<Effect<f64>> {
    let rhythms = trial_specific.iter().filter(|a| a.trial.is_none());
    rhythms.map(|a| a.effect).collect()
}
