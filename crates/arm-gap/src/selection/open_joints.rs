//! Withholding of names in joints whose torque is open after a search without robot angles.
//!
//! While friction holds a joint, its friction torque is unknown, and just before and after a rest the friction law is only approximate.
//! On an arm whose joints have no known laws, other laws then adapt to this error without closing the gap.

use arm_core::effect::{Effect, Place};
use arm_ident::regression::trial::Role;

use crate::GapError;
use crate::data::course::{Channels, difference, smooth};
use crate::hypothesis::Hypothesis;
use crate::prepared_session::PreparedSession;
use crate::selection::held_out::{TrialResidual, held_out};
use crate::selection::search_state::SearchState;

impl<'a, const N: usize> PreparedSession<'a, N> {
    /// Removes all names but those of the passive base from open joints; returns these joints, empty if no name was removed.
    pub(crate) fn withhold(
        &mut self,
        state: &mut SearchState<'a, N>,
    ) -> Result<Vec<usize>, GapError> {
        if !self.session.compares_contact_torques() || self.session.base.is_empty() {
            return Ok(Vec::new());
        }
        let open = self.open_joints(&state.current.hypothesis);
        let mut hypothesis = state.current.hypothesis.clone();
        let mut asked = state.current.asked.clone();
        let mut joints = Vec::new();
        for slot in (0..asked.len()).rev() {
            let effect = hypothesis.named[slot];
            let mut own = (0..N).filter(|&j| open[j] && acts_in(&effect, j));
            if let Some(joint) = own.next().filter(|_| !self.is_passive_law(&effect)) {
                hypothesis.named.remove(slot);
                asked.remove(slot);
                joints.push(joint);
            }
        }
        if !joints.is_empty() {
            (state.current, state.point) = self.settle(hypothesis, asked)?;
            // Laws of the base that a removed effect had replaced are fitted again.
            if let Some(revived) = self.with_base_revived(&state.current)? {
                (state.current, state.point) = revived;
            }
        }
        Ok(joints)
    }

    /// Whether the torque of each joint is open, on the fit trials or on the test trials. The result is used only to remove names.
    pub(crate) fn open_joints(&self, hypothesis: &Hypothesis<N>) -> [bool; N] {
        let left = self.parallel(self.courses.len(), |trial| self.left_of(hypothesis, trial));
        let gaps = [Role::Fit, Role::Test].map(|role| {
            let trials: Vec<TrialResidual> = left
                .iter()
                .enumerate()
                .map(|(trial, residuals)| TrialResidual {
                    group: self.group_of[trial],
                    test: self.session.trials[trial].role == role,
                    rate: self.courses[trial].rate,
                    residuals: residuals.clone(),
                    counted: (0..N).map(|joint| self.counted_of(trial, joint)).collect(),
                })
                .collect();
            held_out(&trials)
        });
        std::array::from_fn(|joint| {
            let mut own = gaps.iter().filter_map(|gaps| gaps.get(joint));
            own.any(|gap| gap.open.is_some())
        })
    }

    /// Residual torques of a trial (measured minus model) in the common band; `None` if the model cannot be evaluated.
    fn left_of(&self, hypothesis: &Hypothesis<N>, trial: usize) -> Option<Channels> {
        let course = &self.courses[trial];
        let raw = self.session.torques(hypothesis, course).ok()?;
        let shown = smooth(&raw, course.band, course.rate).ok()?;
        Some(difference(&course.seen, &shown))
    }

    /// The samples of a trial over which the gap of a joint's torque is measured.
    fn counted_of(&self, trial: usize, joint: usize) -> Vec<bool> {
        let course = &self.courses[trial];
        let counts =
            |i: usize| course.counted[i] && !self.is_left_out(trial, i as f64 / course.rate);
        course.in_motion(joint, (0..course.counted.len()).map(counts).collect())
    }

    /// Whether an effect is of a kind of the passive base.
    fn is_passive_law(&self, effect: &Effect<f64>) -> bool {
        let mut base = self.session.base.iter();
        base.any(|law| law.effect.kind == effect.kind)
    }
}

/// Whether an effect acts in a joint or in the sensor of its angle.
fn acts_in(effect: &Effect<f64>, joint: usize) -> bool {
    match effect.kind.info().place {
        Place::Joint => joint == effect.index || effect.kind.crosses() && joint + 1 == effect.index,
        Place::AngleSensor => joint == effect.index,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use arm_core::effect::Kind;

    use super::*;

    #[test]
    fn a_spring_over_two_joints_acts_in_both_and_a_bias_of_the_force_in_none() {
        let places = |kind, index| -> Vec<bool> {
            let effect = Effect::new(kind, index);
            (0..3).map(|joint| acts_in(&effect, joint)).collect()
        };
        assert_eq!(places(Kind::Biarticular, 2), [false, true, true]);
        assert_eq!(places(Kind::Relaxation, 1), [false, true, false]);
        assert_eq!(places(Kind::AngleOffset, 0), [true, false, false]);
        assert_eq!(places(Kind::ForceBias, 1), [false; 3]);
    }
}
