//! Selection among effects: the gain of each, its alternatives, and the price of its parameters.

use std::cmp::Ordering;
use std::sync::Arc;

use arm_core::effect::{Effect, Place};

use crate::GapError;
use crate::candidates::candidate::Candidate;
use crate::candidates::library::{Library, LibraryEntry};
use crate::fitting::fit::{FittedHypothesis, WithoutEach};
use crate::fitting::lack_of_fit::lack_of_fit;
use crate::fitting::step::Aim;
use crate::hypothesis::Hypothesis;
use crate::prepared_session::PreparedSession;
use crate::selection::score_test::{Choice, ScoreTest};
use crate::selection::search_state::{Progress, SearchState, Settled};
use crate::sensitivity::linearization_point::LinearizationPoint;
use arm_numerics::statistics::distributions::chi_square_tail;

/// Share of all that is explained that an effect must explain, whatever the others are.
pub(crate) const FLOOR: f64 = 2e-5;
/// The same without repeats: errors of sensors and of a rigid model cannot be distinguished from noise then, and an effect may be no
/// more than the best approximation of them.
const FLOOR_UNREPEATED: f64 = 0.03;
/// The same of what is left when all are named: a name for a small part of an unexplained residual is unreliable.
const OF_WHAT_IS_LEFT: f64 = 0.2;
/// An effect that explains as much but for this (in units of twice the log-likelihood) is an alternative.
pub(crate) const TIE: f64 = 10.0;
/// Alternatives that are converged by simulation for each named effect.
const CONVERGED_ALTERNATIVES: usize = 5;
/// Share of what a named effect gains that another must gain to first order to be converged in its place.
const LEAST_ALTERNATIVE_GAIN: f64 = 0.6;
/// Times that an alternative may take the place of a named effect where it is hardly better,
const EXCHANGES: usize = 4;
/// and where it explains more by a tie or more: each time less is left, so that this ends by itself.
const CLEAR_EXCHANGES: usize = 16;

/// Part of the error of a law that an effect in another place can explain: the error acts in the joint of the law, and seldom
/// resembles another effect.
const ELSEWHERE: f64 = 0.25;
/// The same of what swings there: it has one frequency and is alike in every movement, and what a law misses is neither.
const ELSEWHERE_OSCILLATING: f64 = 0.05;

/// What an effect may explain, as a sum of squares, without being there: what the law of another one misses of what it shows.
///
/// * `gain` - what the other one explains
fn mimicked(effect: &Effect<f64>, by: &Effect<f64>, gain: f64) -> f64 {
    let joints = |e: &Effect<f64>| match e.kind.info().place {
        Place::Joint => e.index + 1 - usize::from(e.kind.crosses())..e.index + 2,
        _ => 0..0,
    };
    let (own, other) = (joints(effect), joints(by));
    let is_near = own.start < other.end && other.start < own.end;
    let part = match (is_near, effect.kind.prior().nature.swings()) {
        (true, _) => 1.0,
        (false, false) => ELSEWHERE,
        (false, true) => ELSEWHERE_OSCILLATING,
    };
    by.kind.prior().squared_law_error * gain * part
}

/// The most that an absent effect may explain beside named ones that together explain so much: of each by its gain in the last
/// comparison.
pub(crate) fn mimicked_by_any(effect: &Effect<f64>, named: &[Candidate], explained: f64) -> f64 {
    let each = named
        .iter()
        .map(|c| mimicked(effect, &c.effect, c.gained.min(explained)));
    each.fold(0.0, f64::max)
}

/// One effect that was named.
#[derive(Clone, Debug)]
pub struct MissingEffect {
    /// Its place in the hypothesis.
    pub slot: usize,
    /// Probability of such a gain by chance, with all candidates that were tested.
    pub p_value: f64,
    /// What it gains, in units of twice the log-likelihood as the data scatter.
    pub gain: f64,
    /// Share of what can be explained that is lost without it.
    pub share: f64,
    /// What would explain the same: the candidate, and how much worse it does.
    pub alternatives: Vec<FittedAlternative>,
}

/// Another effect that explains the same as a named one.
#[derive(Clone, Debug)]
pub struct FittedAlternative {
    /// Its candidate.
    pub candidate: Candidate,
    /// The effect as it fits best.
    pub effect: Effect<f64>,
    /// How much worse it explains the data, in units of twice the log-likelihood.
    pub worse: f64,
    /// Squared cosine between the responses to the two.
    pub likeness: f64,
}

/// An alternative, fitted.
pub(crate) struct ConvergedAlternative<const N: usize> {
    pub alternative: FittedAlternative,
    pub fitted: FittedHypothesis<N>,
}

impl<'a, const N: usize> PreparedSession<'a, N> {
    /// A fitted hypothesis without the effect at a place, fitted again; of infinite cost where nothing goes without it.
    fn without(
        &self,
        fitted: &FittedHypothesis<N>,
        slot: usize,
        point: &LinearizationPoint<N>,
    ) -> Result<FittedHypothesis<N>, GapError> {
        let mut hypothesis: Hypothesis<N> = fitted.hypothesis.clone();
        let mut asked = fitted.asked.clone();
        hypothesis.named.remove(slot);
        asked.remove(slot);
        let aim = Aim::beside(fitted.cost);
        let again = |hypothesis: &Hypothesis<N>| {
            let start = (hypothesis.clone(), asked.clone());
            match self.fit_towards(point, start, aim) {
                Err(GapError::Simulation { .. }) => Ok(None),
                other => other.map(Some),
            }
        };
        if let Some(less) = again(&hypothesis)? {
            return Ok(less);
        }
        // The laws of the base whose place it took are gone, and the arm cannot be simulated without either: then from where the
        // calibration starts.
        hypothesis = Hypothesis {
            named: hypothesis.named,
            ..self.given()
        };
        if let Some(less) = again(&hypothesis)? {
            return Ok(less);
        }
        // Or too far away to be followed.
        let settled = self.settle(hypothesis.clone(), asked.clone());
        Ok(settled.map_or_else(
            |_| FittedHypothesis {
                hypothesis,
                asked,
                cost: f64::INFINITY,
                rows: fitted.rows,
                residuals: fitted.residuals.clone(),
                without: Arc::default(),
            },
            |(less, _)| less,
        ))
    }

    /// A fitted hypothesis without each of its effects, whose gains are set.
    fn without_each(
        &self,
        fitted: &mut FittedHypothesis<N>,
        point: &LinearizationPoint<N>,
    ) -> Result<Vec<FittedHypothesis<N>>, GapError> {
        let known = fitted.without.get();
        let known = known.filter(|known| known.whole == fitted.hypothesis);
        let each = match known {
            Some(known) => known.each.clone(),
            None => {
                let one = |slot| self.without(fitted, slot, point);
                let each = self.parallel(fitted.asked.len(), one);
                let each = each.into_iter().collect::<Result<Vec<_>, _>>()?;
                let whole = fitted.hypothesis.clone();
                let _ = fitted.without.set(WithoutEach {
                    whole,
                    each: each.clone(),
                });
                each
            }
        };
        for (candidate, less) in std::iter::zip(&mut fitted.asked, &each) {
            candidate.gained = less.cost - fitted.cost;
        }
        Ok(each)
    }

    /// What a named effect may explain without being there: the imperfect shape of another one that is named, or of a law of the base.
    ///
    /// * `slot`, `less` - the effect, and what was fitted without it
    /// * `base` - laws of the base, and what each gains
    pub(super) fn mimicked_beside(
        &self,
        (fitted, slot, less): (&FittedHypothesis<N>, usize, &FittedHypothesis<N>),
        base: &[(Effect<f64>, f64)],
        point: &LinearizationPoint<N>,
    ) -> f64 {
        let candidate = &fitted.asked[slot];
        let others = fitted.asked.iter().enumerate();
        let others = others.filter(|(o, other)| *o != slot && other.gained.is_finite());
        let others = others.map(|(_, other)| (other.effect, other.gained));
        // A second dry law may be the imperfect shape of the first one, which explains less beside it than by itself.
        let is_dry = candidate.kind().smoothed_by().is_some() && less.cost.is_finite();
        let dry = is_dry
            .then(|| self.gain_of_dry_law(point, less, candidate.effect.index))
            .flatten();
        others
            .chain(base.iter().copied())
            .chain(dry)
            .map(|(other, gain)| mimicked(&candidate.effect, &other, gain))
            .fold(0.0, f64::max)
    }

    /// Goes back: effects that are no longer worth their price are taken out.
    pub(crate) fn pruned(
        &self,
        (mut fitted, mut point): Settled<'a, N>,
        calibrated: &FittedHypothesis<N>,
        scale: f64,
    ) -> Result<Settled<'a, N>, GapError> {
        let floor = match self.repeated {
            true => FLOOR,
            false => FLOOR_UNREPEATED,
        };
        while !fitted.asked.is_empty() {
            let mut weakest: Option<(f64, FittedHypothesis<N>)> = None;
            let left = OF_WHAT_IS_LEFT * lack_of_fit(self, &point, &fitted).certain();
            let floor = f64::max(floor * (calibrated.cost - fitted.cost), left);
            let base = self.gains_of_base(&point, &fitted)?;
            let without = self.without_each(&mut fitted, &point)?;
            // Without repeats the noise level is unknown: an effect must also predict parts of the movement from others.
            let foretold = match self.repeated {
                true => None,
                false => Some(self.foretold(&point, &fitted)?),
            };
            for (slot, less) in without.into_iter().enumerate() {
                let candidate = &fitted.asked[slot];
                let mut gain = candidate.gained;
                if let Some(with) = foretold
                    && gain.is_finite()
                {
                    gain = gain.min(self.foretold(&point, &less)? - with);
                }
                // Less may be the imperfect shape of another one, or of a law of the base.
                let beside = self.mimicked_beside((&fitted, slot, &less), &base, &point);
                let least = f64::max(floor, beside);
                let worth = gain / scale - candidate.price * candidate.spread;
                let worth = if gain < least {
                    worth.min(gain - least)
                } else if candidate.is_plainer(&fitted.hypothesis.named[slot]) {
                    worth.min(-gain)
                } else {
                    worth
                };
                if worth < 0.0 && weakest.as_ref().is_none_or(|(least, _)| worth < *least) {
                    weakest = Some((worth, less));
                }
            }
            let Some((_, less)) = weakest else { break };
            match self.settle(less.hypothesis, less.asked) {
                Ok(settled) => (fitted, point) = settled,
                // It may be worth little, and nothing can be simulated without it.
                Err(GapError::Simulation { .. }) => break,
                Err(error) => return Err(error),
            }
        }
        Ok((fitted, point))
    }

    /// What could stand in the place of each named effect; a better one takes it.
    pub(crate) fn judged(
        &self,
        mut state: SearchState<'a, N>,
        periodic: Option<[f64; 2]>,
        progress: Progress<'_>,
    ) -> Result<(SearchState<'a, N>, Vec<MissingEffect>), GapError> {
        let (mut fitted, mut point) = (state.current, state.point);
        let (asked, scale) = (state.asked, state.scale);
        let mut exchanges = 0;
        'again: loop {
            let mut named = Vec::new();
            let mut library = match fitted.asked.len() {
                0 => None,
                _ => Some(Library::build(self, &point, periodic)?),
            };
            let entries = match &mut library {
                Some(library) => {
                    let effects = fitted.hypothesis.named.iter().copied();
                    let named: Vec<_> = fitted.asked.iter().cloned().zip(effects).collect();
                    library.add_named(self, &point, &named)?
                }
                None => Vec::new(),
            };
            let without = self.without_each(&mut fitted, &point)?;
            for (slot, (entry, less)) in std::iter::zip(&entries, &without).enumerate() {
                progress(
                    "comparing alternatives",
                    0.7 + 0.2 * slot as f64 / fitted.asked.len() as f64,
                )?;
                let gain = fitted.asked[slot].gained.min(f64::MAX);
                // A shape that is refined may explain the error of the law of another one.
                let bent = self.mimicked_beside((&fitted, slot, less), &[], &point);
                let most = self.most_worse(&fitted.asked[slot], gain / scale, bent / scale);
                let alternatives = match &library {
                    // Where the run cannot be followed without it, its gain is unknown.
                    Some(library) if less.cost.is_finite() => {
                        let place = (slot, less, entry.as_ref());
                        let near = (&point, library);
                        let found = self.alternatives(&fitted, place, near, (scale, most));
                        found.unwrap_or_default()
                    }
                    _ => Vec::new(),
                };
                let better = alternatives.iter().find(|r| {
                    let clear = r.alternative.worse < -TIE;
                    exchanges < if clear { CLEAR_EXCHANGES } else { EXCHANGES }
                        && self.takes_over(
                            &r.alternative,
                            (&fitted.asked[slot], gain / scale),
                            bent / scale,
                        )
                });
                if let Some(better) = better {
                    exchanges += 1;
                    let better = better.fitted.clone();
                    // A solution that can be followed but not simulated is refused.
                    if let Ok(settled) = self.settle(better.hypothesis, better.asked) {
                        // Others may have stood for what the former one missed.
                        (fitted, point) = self.pruned(settled, &state.calibrated, scale)?;
                        continue 'again;
                    }
                }
                let candidate = &fitted.asked[slot];
                let chance = chi_square_tail(gain / scale, candidate.width());
                named.push(MissingEffect {
                    slot,
                    p_value: (asked * chance).min(1.0),
                    gain: gain / scale,
                    share: 0.0,
                    alternatives: self.ties(alternatives, candidate, gain / scale),
                });
            }
            (state.current, state.point) = (fitted, point);
            return Ok((state, named));
        }
    }

    /// Those of the others that explain the data as well as what gained so much.
    pub(crate) fn ties(
        &self,
        alternatives: Vec<ConvergedAlternative<N>>,
        own: &Candidate,
        gain: f64,
    ) -> Vec<FittedAlternative> {
        let all = alternatives.into_iter().map(|r| r.alternative);
        all.filter(|a| a.worse <= self.tie(own, gain)).collect()
    }

    /// How much worse another effect may explain the data and still be an alternative to one that gained so much.
    ///
    /// Without repeats an inexact law cannot be distinguished from another one: a difference below the possible error of its kind decides nothing.
    fn tie(&self, own: &Candidate, gain: f64) -> f64 {
        match self.repeated {
            true => TIE,
            false => TIE.max(own.kind().prior().squared_law_error * gain),
        }
    }

    /// How much worse another effect may be and still matter, as an alternative or in the place of one that gained so much; arguments as of
    /// [`PreparedSession::takes_over`].
    pub(crate) fn most_worse(&self, own: &Candidate, gain: f64, bent: f64) -> f64 {
        let shapes = self.price_of_shapes(std::slice::from_ref(own));
        self.tie(own, gain).max(shapes).max(bent)
    }

    /// Whether another effect takes the place of a named one.
    ///
    /// The better one does, when its gain exceeds the price of the shapes that are refined with it. Without repeats a tie goes to the plainer law, the
    /// one with fewer parameters or, with as many, the one that stands before it in the catalogue: an intricate one bends itself to
    /// what sensors and a rigid model get wrong.
    pub(crate) fn takes_over(
        &self,
        alternative: &FittedAlternative,
        (own, gain): (&Candidate, f64),
        bent: f64,
    ) -> bool {
        /// Units of twice the log-likelihood by which a alternative must beat its handicap: two laws that show the same must not take
        /// each other's place in turn.
        const BETTER: f64 = 0.05;
        let shapes = |c: &Candidate| self.price_of_shapes(std::slice::from_ref(c));
        let plain = |c: &Candidate| {
            let place = self.session.kinds().position(|k| k == c.kind());
            (c.kind().info().parameters.len(), place)
        };
        let handicap = match plain(&alternative.candidate).cmp(&plain(own)) {
            _ if self.repeated && own.shapes() > alternative.candidate.shapes() => {
                f64::max(shapes(own) - shapes(&alternative.candidate), bent)
            }
            _ if self.repeated => shapes(own) - shapes(&alternative.candidate),
            Ordering::Less => self.tie(own, gain),
            Ordering::Equal => 0.0,
            Ordering::Greater => -self.tie(own, gain),
        };
        alternative.worse < handicap - BETTER
    }

    /// Other effects in the place of one, fitted, the best first.
    ///
    /// Two criteria select another effect: what it explains once all is refitted without the named one, and how well it replaces
    /// that one where all is as it was fitted. The first fails where the refit is at its bounds, the second where much
    /// else changes with the exchange.
    ///
    /// * `most` - how much worse they may be and still matter; the fit of one that will be worse is given up
    pub(crate) fn alternatives(
        &self,
        fitted: &FittedHypothesis<N>,
        (slot, less, entry): (usize, &FittedHypothesis<N>, Option<&LibraryEntry>),
        (point, library): (&LinearizationPoint<N>, &Library),
        (scale, most): (f64, f64),
    ) -> Result<Vec<ConvergedAlternative<N>>, GapError> {
        let own = &fitted.asked[slot];
        let refitted = ScoreTest::new(self, less, point, library)?;
        let others = others(own, &less.asked, library);
        // What the effect itself would gain to first order: what others gain to first order is held against that.
        let gain = (0..refitted.len())
            .filter(|&c| own.is_same_effect(&library.candidates[c].effect))
            .filter_map(|c| refitted.evaluate(&[c]))
            .map(|c| c.gain)
            .fold(0.0, f64::max)
            .min(less.cost - fitted.cost);
        let mut hypothesis = fitted.hypothesis.clone();
        hypothesis.named.remove(slot);
        let as_fitted = FittedHypothesis {
            hypothesis,
            residuals: fitted.residuals.clone(),
            ..less.clone()
        };
        let in_place = entry.and_then(|entry| {
            let score_test = ScoreTest::new(self, &as_fitted, point, library).ok()?;
            Some((score_test, entry))
        });
        let mut singles: Vec<(f64, Choice, (&ScoreTest, &FittedHypothesis<N>))> = Vec::new();
        for &c in &others {
            let choice = refitted.evaluate(&[c]);
            let choice = choice.map(|choice| (choice.gain / gain, choice, (&refitted, less)));
            let stand_in = in_place.as_ref().and_then(|(score_test, entry)| {
                let (part, choice) = score_test.stand_in(c, entry)?;
                Some((part, choice, (score_test, &as_fitted)))
            });
            let both = choice.into_iter().chain(stand_in);
            // The members of a family are held against each other whatever they show to first order: their shapes are refined first.
            let is_kin = own.is_of_family_in_joint(&library.candidates[c].effect);
            singles.extend(both.filter(|(part, ..)| is_kin || *part > LEAST_ALTERNATIVE_GAIN));
        }
        singles.sort_by(|a, b| b.0.total_cmp(&a.0));
        let candidate = |choice: &Choice| &library.candidates[choice.members[0]];
        let best = best_of_each(&singles, library);
        let converged = |place: usize| {
            let (_, choice, (score_test, from)) = best[place];
            let member = choice.members[0];
            let mut asked = candidate(choice).clone();
            (asked.price, asked.spread) = (score_test.price[member], score_test.spread[member]);
            let choice = (std::slice::from_ref(&asked), choice.coefficients.as_slice());
            // A tie to spare, for fits that are slow at the end. What is clearly nearer to the data matters at any price.
            let worse = f64::max(most + TIE + own.price - asked.price, -TIE);
            let dry = own.is_dry_friction() || asked.is_dry_friction();
            let aim = Aim::at(fitted.cost + worse * scale, dry);
            let mut again = self.attempt(from, choice, (point, aim))?;
            if own.is_of_family_in_joint(&asked.effect) {
                again = self.fit_on(point, again, aim);
            }
            let effect = again.hypothesis.named.last().copied();
            let effect = effect.filter(|effect| !asked.is_plainer(effect))?;
            let worse = (again.cost - fitted.cost) / scale + asked.price - own.price;
            let likeness = entry.map_or(0.0, |t| score_test.likeness(t.place, member));
            Some(ConvergedAlternative {
                alternative: FittedAlternative {
                    candidate: asked,
                    effect,
                    worse,
                    likeness,
                },
                fitted: again,
            })
        };
        let alternatives = self.parallel(best.len(), converged);
        let mut alternatives: Vec<_> = alternatives.into_iter().flatten().collect();
        alternatives.sort_by(|a, b| a.alternative.worse.total_cmp(&b.alternative.worse));
        Ok(alternatives)
    }

    /// What refined shapes must earn before a simpler explanation is given up for them (Schwarz' criterion).
    pub(crate) fn price_of_shapes(&self, asked: &[Candidate]) -> f64 {
        let shapes: f64 = asked.iter().map(Candidate::shapes).sum();
        shapes * libm::log(self.rows_of_references() as f64)
    }

    /// A hypothesis with further effects, fitted; `None` where it cannot be followed.
    ///
    /// The first-order coefficients are halved until they lower the cost: effects that are strong are not linear.
    ///
    /// * `aim` - as of [`PreparedSession::fit_towards`]
    pub(crate) fn attempt(
        &self,
        current: &FittedHypothesis<N>,
        (asked, coefficients): (&[Candidate], &[Vec<f64>]),
        (point, aim): (&LinearizationPoint<N>, Aim),
    ) -> Option<FittedHypothesis<N>> {
        /// Shares of the first-order coefficients that are tried: the response to a strong effect is smaller than to first order.
        const SHARES: [f64; 4] = [1.0, 0.5, 0.2, 0.05];
        let mut all = current.asked.clone();
        all.extend_from_slice(asked);
        let mut best: Option<FittedHypothesis<N>> = None;
        for share in SHARES {
            let mut hypothesis = current.hypothesis.clone();
            for (candidate, own) in std::iter::zip(asked, coefficients) {
                let own: Vec<f64> = own.iter().map(|b| share * b).collect();
                hypothesis.named.push(candidate.found(&own));
            }
            let start = (hypothesis.handed_over(), all.clone());
            if let Ok(fitted) = self.fit_towards(point, start, aim) {
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
}

impl<const N: usize> SearchState<'_, N> {
    /// What a further effect must gain so as not to be the imperfect shape of a named one.
    pub fn least(&self, effect: &Effect<f64>) -> f64 {
        let explained = self.calibrated.cost - self.current.cost;
        f64::max(
            FLOOR * explained,
            mimicked_by_any(effect, &self.current.asked, explained),
        )
    }
}

/// The best choice of each effect, for at most [`CONVERGED_ALTERNATIVES`] effects.
///
/// * `singles` - choices of one candidate each, sorted with the best first
fn best_of_each<'s, T>(
    singles: &'s [(f64, Choice, T)],
    library: &Library,
) -> Vec<&'s (f64, Choice, T)> {
    let candidate = |choice: &Choice| &library.candidates[choice.members[0]];
    let mut best: Vec<&(f64, Choice, T)> = Vec::new();
    for single in singles {
        let effect = &candidate(&single.1).effect;
        if best.len() < CONVERGED_ALTERNATIVES
            && !best.iter().any(|b| candidate(&b.1).is_same_effect(effect))
        {
            best.push(single);
        }
    }
    best
}

/// The candidates that are neither an effect nor among those that are named beside it.
fn others(own: &Candidate, named: &[Candidate], library: &Library) -> Vec<usize> {
    let is_other = |candidate: &Candidate| {
        let is_named = named.iter().any(|a| a.is_same_effect(&candidate.effect));
        !is_named && !own.is_same_effect(&candidate.effect)
    };
    (0..library.candidates.len())
        .filter(|&c| is_other(&library.candidates[c]))
        .collect()
}

#[cfg(test)]
mod tests {
    use arm_core::effect::Kind;

    use super::*;

    /// Dry friction represents a family of laws with an error up to 3 %: what is near its joint may be that, elsewhere a quarter of it.
    #[test]
    fn an_effect_must_explain_more_than_the_law_of_another_misses() {
        let friction = Effect::<f64>::new(Kind::Coulomb, 1);
        let law_error = friction.kind.prior().squared_law_error;
        assert_eq!(law_error, 0.03);
        let in_joint = |kind, joint| mimicked(&Effect::<f64>::new(kind, joint), &friction, 1000.0);
        assert_eq!(in_joint(Kind::Viscous, 1), 1000.0 * law_error);
        assert_eq!(in_joint(Kind::Viscous, 0), 7.5);
        // A spring over joints 1 and 2 acts in both, a bias of the sensor in none.
        assert_eq!(in_joint(Kind::Biarticular, 1), 1000.0 * law_error);
        assert_eq!(in_joint(Kind::ForceBias, 0), 7.5);
        // A ripple of the robot is alike in every movement, which what a law misses is not.
        assert_eq!(in_joint(Kind::RobotRipple, 0), 1.5);
        // An exact law misses next to nothing.
        let spring = Effect::<f64>::new(Kind::Elastic, 1);
        assert!(mimicked(&friction, &spring, 1000.0) <= 0.02);
    }
}
