//! What dry friction does at rest: it sticks, or it creeps below some speed. Whole trials tell, rest included.

use arm_core::effect::Kind;

use crate::GapError;
use crate::candidates::refined_shapes::CREEP;
use crate::data::prepared_session::PreparedSession;
use crate::data::session::ComparisonMode;
use crate::measurement_model::hypothesis::{Hypothesis, Target};
use crate::selection::fit::Fitted;
use crate::selection::search_state::Settled;

/// Speeds below which friction may creep \[rad/s\] that are tried first; with zero it sticks.
const SMOOTHING: [f64; 4] = [0.0, 0.003, 0.01, CREEP];
/// Speeds between those that are tried next, each at the minimum of the parabola through the three that cost least: with the nearest of
/// the first alone, another law would be found beside the friction that makes up for the difference.
const BETWEEN: usize = 2;

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
        let chosen = self.over_whole_trials(|whole| {
            let smoothed = whole.smoothed(before, &base);
            named
                .iter()
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

    /// What is found when no sample is left out because a joint rests there.
    fn over_whole_trials<R>(&mut self, find: impl FnOnce(&Self) -> R) -> R {
        let resting = std::mem::take(&mut self.resting);
        self.cut();
        let found = find(self);
        self.resting = resting;
        self.cut();
        found
    }

    /// The hypothesis with the smoothing of each law of the base that costs least.
    fn smoothed(&self, fitted: &Fitted<N>, laws: &[Target]) -> Fitted<N> {
        // What cannot be simulated is not chosen.
        let simulated = |hypothesis: Hypothesis<N>| {
            let point = self.linearize(&hypothesis).ok()?;
            self.fit(&point, hypothesis, fitted.asked.clone()).ok()
        };
        let mut best = simulated(fitted.hypothesis.clone()).unwrap_or_else(|| fitted.clone());
        for &law in laws {
            let mut tried = vec![(best.hypothesis.get(law), best.cost)];
            let cheaper = |best: &mut Fitted<N>, next: f64, tried: &mut Vec<_>| {
                let other = simulated(best.hypothesis.clone().with(law, next));
                tried.push((next, other.as_ref().map_or(f64::INFINITY, |o| o.cost)));
                let other = other.filter(|other| is_cheaper(other, best));
                other.map(|other| *best = other).is_some()
            };
            // From speed to speed, up or down, as long as that costs less: the misfit has one minimum along them.
            for upwards in [true, false] {
                while let Some(next) = next_smoothing(best.hypothesis.get(law), upwards)
                    && cheaper(&mut best, next, &mut tried)
                {}
            }
            for _ in 0..BETWEEN {
                if let Some(next) = minimum(&mut tried) {
                    cheaper(&mut best, next, &mut tried);
                }
            }
        }
        best
    }

    /// The same with a named law that sticks, where that costs less once its other numbers are fitted anew.
    fn sticking(&self, fitted: Fitted<N>, slot: usize) -> Fitted<N> {
        let mut sticking = fitted.clone();
        let named = &mut sticking.hypothesis.named[slot];
        if let Some(smoothing) = named.kind.smoothed_by() {
            named.parameters[smoothing] = 0.0;
        }
        let question = sticking.asked[slot].clone().at_rest_as(named);
        sticking.asked[slot] = question;
        match self.settle(sticking.hypothesis, sticking.asked) {
            Ok((refitted, _)) if is_cheaper(&refitted, &fitted) => refitted,
            _ => fitted,
        }
    }
}

/// The next of [`SMOOTHING`] above or below a speed.
fn next_smoothing(present: f64, upwards: bool) -> Option<f64> {
    match upwards {
        true => SMOOTHING.into_iter().find(|&s| s > present),
        false => SMOOTHING.into_iter().rfind(|&s| s < present),
    }
}

/// The minimum of the parabola through the speed \[rad/s\] that costs least and its neighbours, over their logarithms; `None` where a
/// neighbour is missing or cannot be simulated, and where it is not another speed.
///
/// * `tried` - speeds and what they cost, which are sorted
fn minimum(tried: &mut [(f64, f64)]) -> Option<f64> {
    /// Logarithm of a speed that stands for zero: a tenth of it moves nobody.
    const STICKS: f64 = 1e-3;
    /// Least difference of logarithms that counts.
    const ANOTHER: f64 = 0.05;
    tried.sort_by(|a, b| a.0.total_cmp(&b.0));
    let least = (0..tried.len()).min_by(|&a, &b| tried[a].1.total_cmp(&tried[b].1))?;
    let three = tried.get(least.checked_sub(1)?..least + 2)?;
    let [x0, x1, x2] = [0, 1, 2].map(|i| libm::log(three[i].0.max(STICKS)));
    let [left, right] = [three[0].1 - three[1].1, three[2].1 - three[1].1];
    let (before, after) = (x1 - x0, x2 - x1);
    let bend = 2.0 * (left * after + right * before);
    let x = x1 + (left * after * after - right * before * before) / bend;
    let is_another = (x - x1).abs() > ANOTHER && x > x0 && x < x2;
    (three[1].0 > 0.0 && is_another).then(|| libm::exp(x))
}

/// Whether another fit costs less by more than nothing.
fn is_cheaper<const N: usize>(other: &Fitted<N>, present: &Fitted<N>) -> bool {
    other.cost + other.enough() < present.cost
}

/// The places of named dry laws that creep at rest.
fn creeping<const N: usize>(fitted: &Fitted<N>) -> Vec<usize> {
    let named = fitted.hypothesis.named.iter().enumerate();
    named
        .filter(|(_, effect)| effect.kind.smoothed_by().is_some() && !effect.is_dry())
        .map(|(slot, _)| slot)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_speed_of_creep_is_sought_between_those_that_are_tried() {
        let cost = |s: f64| 100.0 * libm::log(s / 0.013).powi(2) + 7.0;
        let with_costs = |speeds: [f64; 3]| speeds.map(|s| (s, cost(s)));
        let found = minimum(&mut with_costs([CREEP, 0.01, 0.003])).expect("a minimum");
        assert!((found / 0.013 - 1.0).abs() < 1e-9, "{found}");
        // At an end, at the minimum and next to what cannot be simulated.
        assert_eq!(minimum(&mut with_costs([0.1, CREEP, 0.05])), None);
        assert_eq!(minimum(&mut with_costs([0.003, 0.0131, CREEP])), None);
        let mut open = with_costs([0.003, 0.01, CREEP]);
        open[2].1 = f64::INFINITY;
        assert_eq!(minimum(&mut open), None);
        // What sticks stays so.
        assert_eq!(minimum(&mut [(0.0, 1.0), (0.003, 2.0), (0.01, 4.0)]), None);
    }
}
