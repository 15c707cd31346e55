//! What dry friction of the passive base does at rest: it sticks, or it creeps below some speed. Whole trials tell, rest included.

use arm_core::effect::Kind;

use crate::GapError;
use crate::data::prepared_session::PreparedSession;
use crate::data::session::ComparisonMode;
use crate::measurement_model::hypothesis::{Hypothesis, Target};
use crate::selection::fit::enough;
use crate::selection::search_state::Settled;

/// Speeds below which friction may creep \[rad/s\]; with zero it sticks.
const SMOOTHING: [f64; 4] = [0.0, 0.003, 0.01, 0.03];

impl<'a, const N: usize> PreparedSession<'a, N> {
    /// Chooses for each dry law of the base the speed below which it creeps that whole fit trials show, and fits anew where that is
    /// another one.
    ///
    /// # Errors
    /// As [`PreparedSession::settle`].
    pub(crate) fn with_friction_at_rest(
        &mut self,
        settled: Settled<'a, N>,
    ) -> Result<Settled<'a, N>, GapError> {
        let before = &settled.0.hypothesis;
        let dry = self.dry_base_laws();
        if dry.is_empty() || self.session.comparison != ComparisonMode::Led {
            return Ok(settled);
        }
        let chosen = self.over_whole_trials(|whole| whole.smoothed(before.clone(), &dry));
        if chosen == *before {
            return Ok(settled);
        }
        self.start = Some(chosen.clone());
        let asked = settled.0.asked.clone();
        self.settle(chosen, asked).or(Ok(settled))
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

    /// The hypothesis with the smoothing of each law that costs least.
    fn smoothed(&self, mut best: Hypothesis<N>, laws: &[Target]) -> Hypothesis<N> {
        let cost = |hypothesis: &Hypothesis<N>| {
            let state = self
                .linearize(hypothesis)
                .and_then(|point| self.state(&point, hypothesis.clone(), Vec::new()));
            // What cannot be simulated is not chosen.
            state.map_or(f64::INFINITY, |fitted| fitted.cost)
        };
        let mut least = cost(&best);
        for &law in laws {
            let present = best.get(law);
            for smoothing in SMOOTHING.into_iter().filter(|&s| s != present) {
                let other = best.clone().with(law, smoothing);
                let its = cost(&other);
                if its + enough(its) < least {
                    (best, least) = (other, its);
                }
            }
        }
        best
    }
}
