//! Choice between dry friction that sticks and dry friction that creeps at rest, by whole trials.

use arm_core::effect::{Effect, Kind};

use crate::GapError;
use crate::candidates::refined_shapes::CREEP;
use crate::data::session::ComparisonMode;
use crate::fitting::fit::FittedHypothesis;
use crate::fitting::step::Aim;
use crate::hypothesis::{Hypothesis, Target};
use crate::measurement_model::start::creeps;
use crate::prepared_session::PreparedSession;
use crate::selection::search_state::Settled;

/// Speeds below which friction may creep \[rad/s\]; with zero it sticks.
const SMOOTHING: [f64; 4] = [0.0, 0.003, 0.01, CREEP];
/// The same where little is left and a speed need only be simulated. Two neighbours differ by less than a factor of two: between 0.01 and
/// 0.03 rad/s a friction of 0.25 N m misses forces of 0.2 N.
const FINER: [f64; 8] = [0.0, 0.003, 0.0055, 0.01, 0.017, CREEP, 0.055, 0.1];
/// How many speeds are tried for a dry law.
pub(crate) const TRIED_AT_REST: usize = FINER.len();
/// Times that each of these is chosen for all laws, at most.
const SWEEPS: usize = 3;

impl<'a, const N: usize> PreparedSession<'a, N> {
    /// Chooses for each dry law of the base and each named one the speed below which it creeps that whole fit trials show, and fits
    /// anew where that is another one.
    ///
    /// # Errors
    /// As [`PreparedSession::settle`].
    pub(crate) fn with_friction_at_rest(
        &mut self,
        settled: Settled<'a, N>,
    ) -> Result<Settled<'a, N>, GapError> {
        if self.session.comparison != ComparisonMode::Led {
            return Ok(settled);
        }
        let (base, named) = (self.dry_base_laws(), creeping(&settled.0));
        if base.is_empty() && named.is_empty() {
            return Ok(settled);
        }
        let before = &settled.0;
        let slow = |&slot: &usize| is_slow(&before.hypothesis.named[slot]);
        let (slow, fast): (Vec<_>, Vec<_>) = named.into_iter().partition(slow);
        // Whole trials also show where a run starts, which a joint that sticks keeps: in motion, one that creeps so slowly does not differ.
        let stuck = slow
            .iter()
            .fold(before.clone(), |best, &slot| self.sticking(best, slot));
        let chosen = self.over_whole_trials(|whole| {
            let smoothed = whole.smoothed(&stuck, &base);
            fast.iter()
                .fold(smoothed, |best, &slot| whole.sticking(best, slot))
        });
        if chosen.hypothesis == before.hypothesis {
            return Ok(settled);
        }
        if before.asked.is_empty() {
            self.start = Some(chosen.hypothesis.clone());
        }
        self.settle(chosen.hypothesis, chosen.asked).or(Ok(settled))
    }

    /// The dry law of the base alone, where a second one is named in its joint and explains no more than its price beyond what the first
    /// does with another creep speed: a wrong one leaves a residual like that of a second law. `None` where there is none.
    ///
    /// * `scale` - as in [`SearchState`](crate::selection::search_state::SearchState)
    pub(crate) fn with_one_dry_law(
        &self,
        current: &FittedHypothesis<N>,
        scale: f64,
    ) -> Option<Settled<'a, N>> {
        let base = self.dry_base_laws();
        current.asked.iter().enumerate().find_map(|(slot, own)| {
            own.kind().smoothed_by()?;
            let is_beside = |law: &Target| match law {
                Target::Known(e, _) => current.hypothesis.known[*e].index == own.effect.index,
                _ => false,
            };
            if !base.iter().any(is_beside) {
                return None;
            }
            let (mut alone, mut asked) = (current.hypothesis.clone(), current.asked.clone());
            alone.named.remove(slot);
            asked.remove(slot);
            let settled = |hypothesis| self.settle(hypothesis, asked.clone()).ok();
            let fitted = |hypothesis, _| settled(hypothesis).map(|s| s.0);
            let best = cheapest(fitted(alone, 0.0)?, (&base, &SMOOTHING), fitted);
            let price = own.price * own.spread * scale;
            (best.cost < current.cost + price).then(|| settled(best.hypothesis))?
        })
    }

    /// The smoothing of each dry law of the base that is not dropped.
    fn dry_base_laws(&self) -> Vec<Target> {
        let first = self.session.effects.len();
        let laws = self.session.base.iter().enumerate();
        laws.filter(|(b, law)| !self.dropped[*b] && !law.free.is_empty())
            .filter_map(|(b, law)| {
                let smoothing = Kind::smoothed_by(law.effect.kind)?;
                Some(Target::Known(first + b, smoothing))
            })
            .collect()
    }

    /// The hypothesis with the smoothing of each law of the base that costs least; where much is left, with all numbers fitted anew, as they
    /// may have been bent by the smoothing that they were fitted with.
    fn smoothed(&self, fitted: &FittedHypothesis<N>, laws: &[Target]) -> FittedHypothesis<N> {
        // What cannot be simulated is not chosen.
        let simulated = |hypothesis: Hypothesis<N>, aim: f64| {
            let asked = fitted.asked.clone();
            if fitted.leaves_much() {
                let point = self.linearize(&hypothesis).ok()?;
                let aim = Aim::at(aim, true);
                return self.fit_towards(&point, (hypothesis, asked), aim).ok();
            }
            let point = self.simulate_alone(&hypothesis).ok()?;
            self.state(&point, hypothesis, asked).ok()
        };
        let present = simulated(fitted.hypothesis.clone(), f64::INFINITY);
        let present = present.unwrap_or_else(|| fitted.clone());
        let speeds: &[f64] = if fitted.leaves_much() {
            &SMOOTHING
        } else {
            &FINER
        };
        cheapest(present, (laws, speeds), simulated)
    }

    /// The same with a named law that sticks, where that does not cost more by the price of a shape once its other numbers are fitted anew: a
    /// joint that creeps slowly enough hardly differs from one that sticks.
    fn sticking(&self, fitted: FittedHypothesis<N>, slot: usize) -> FittedHypothesis<N> {
        let mut sticking = fitted.clone();
        let named = &mut sticking.hypothesis.named[slot];
        if let Some(smoothing) = named.kind.smoothed_by() {
            named.parameters[smoothing] = 0.0;
        }
        let own = &fitted.asked[slot..=slot];
        sticking.asked[slot] = own[0].clone().at_rest_as(named);
        let more = self.price_of_shapes(own) - self.price_of_shapes(&sticking.asked[slot..=slot]);
        match self.settle(sticking.hypothesis, sticking.asked) {
            Ok((refitted, _)) if refitted.cost < fitted.cost + more => refitted,
            _ => fitted,
        }
    }
}

/// The fit with the smoothing of each law that costs least.
///
/// * `laws`, `speeds` - where each law has its smoothing, and the ones that are tried, ascending \[rad/s\]
/// * `fitted` - the fit of a hypothesis, which may be given up where it will not cost less than a bound; `None` where it cannot be simulated
fn cheapest<const N: usize>(
    mut best: FittedHypothesis<N>,
    (laws, speeds): (&[Target], &[f64]),
    fitted: impl Fn(Hypothesis<N>, f64) -> Option<FittedHypothesis<N>>,
) -> FittedHypothesis<N> {
    // The mode of one joint at rest changes the motion of others: a choice is tested again when another one has changed since.
    let mut since_change = 0;
    for &law in laws.iter().cycle().take(SWEEPS * laws.len()) {
        if since_change == laws.len() {
            break;
        }
        let before = best.hypothesis.get(law);
        // From speed to speed, up or down, as long as that costs less: the misfit has one minimum along them.
        for upwards in [true, false] {
            while let Some(next) = next_smoothing(speeds, best.hypothesis.get(law), upwards)
                && let Some(other) = fitted(best.hypothesis.clone().with(law, next), best.cost)
                && is_cheaper(&other, &best)
            {
                best = other;
            }
        }
        let is_changed = best.hypothesis.get(law) != before;
        since_change = if is_changed { 1 } else { since_change + 1 };
    }
    best
}

/// The next of some speeds above or below one.
fn next_smoothing(speeds: &[f64], present: f64, upwards: bool) -> Option<f64> {
    let mut speeds = speeds.iter().copied();
    match upwards {
        true => speeds.find(|&s| s > present),
        false => speeds.rfind(|&s| s < present),
    }
}

/// Whether a law creeps more slowly than at any speed that is tried.
fn is_slow(effect: &Effect<f64>) -> bool {
    let speed = Kind::smoothed_by(effect.kind).map(|at| effect.parameters[at]);
    speed.is_some_and(|speed| speed < SMOOTHING[1])
}

/// Whether another fit costs less by more than nothing.
fn is_cheaper<const N: usize>(other: &FittedHypothesis<N>, present: &FittedHypothesis<N>) -> bool {
    other.cost + other.enough() < present.cost
}

/// The places of named dry laws that creep at rest.
fn creeping<const N: usize>(fitted: &FittedHypothesis<N>) -> Vec<usize> {
    let named = fitted.hypothesis.named.iter().enumerate();
    named
        .filter(|(_, effect)| creeps(effect))
        .map(|(slot, _)| slot)
        .collect()
}
