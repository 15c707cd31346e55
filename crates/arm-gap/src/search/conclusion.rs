//! The conclusion of a search: effects, precision, lack of fit and detection limits.

use arm_core::effect::{Effect, Place};

use crate::GapError;
use crate::candidates::candidate::Candidate;
use crate::data::session::ComparisonMode;
use crate::fitting::fit::FittedHypothesis;
use crate::fitting::lack_of_fit::{LackOfFit, lack_of_fit};
use crate::fitting::precision::Precision;
use crate::hypothesis::{Hypothesis, Target};
use crate::prepared_session::PreparedSession;
use crate::search::trial_specific_effects::TrialSpecificEffects;
use crate::selection::model_selection::MissingEffect;
use crate::selection::passive_base::BaseLaw;
use crate::selection::search_state::{DetectionLimit, Progress, SearchRound, SearchState, Settled};
use crate::sensitivity::linearization_point::LinearizationPoint;
use crate::trial_specific::component::TrialSpecific;

/// Maximum number of times that laws of the base replace a named effect at the end of the search. Without a limit, a spring over two joints
/// and the springs of both joints, which explain the same data, could replace each other forever.
const EXCHANGES_OF_BASE: usize = 3;
/// Maximum number of times that names are withheld: another name in the same joint may take the place of a withheld one.
const WITHHOLDINGS: usize = 3;

/// What was found.
#[derive(Clone, Debug)]
pub struct Finding<const N: usize> {
    /// The model after refitting what was never exact.
    pub calibrated: FittedHypothesis<N>,
    /// The model with the named effects.
    pub amended: FittedHypothesis<N>,
    /// The named effects, those that explain most first.
    pub named: Vec<MissingEffect>,
    /// Joints in which names are withheld because their torque is open after the search, counted from 0.
    pub withheld: Vec<usize>,
    /// What is not the same in every trial.
    pub trial_specific: Vec<TrialSpecific>,
    /// The calibrated and the amended model as they are in each trial; see [`crate::trial_specific::in_trial`].
    pub in_trials: [Vec<Hypothesis<N>>; 2],
    /// Rounds of the search.
    pub search_trace: Vec<SearchRound>,
    /// How well the amended model is known.
    pub precision: Precision,
    /// Lack of fit of the calibrated and of the amended model.
    pub lack: [LackOfFit; 2],
    /// The other candidates.
    pub detection_limits: Vec<DetectionLimit>,
    /// Misfit for each degree of freedom.
    pub scale: f64,
}

/// What is known of the amended model.
struct AmendedModel<const N: usize> {
    /// The model.
    amended: FittedHypothesis<N>,
    /// Its misfit with the noise that the search had.
    cost: f64,
    /// How well its numbers are known.
    precision: Precision,
    /// What it leaves.
    lack: LackOfFit,
}

/// A search whose names and laws of the passive base were compared with alternatives.
struct Judged<'a, const N: usize> {
    state: SearchState<'a, N>,
    named: Vec<MissingEffect>,
    base: Vec<BaseLaw<N>>,
}

impl<'a, const N: usize> PreparedSession<'a, N> {
    /// Selects the laws of the passive base, and measures what is left.
    pub(crate) fn concluded(
        &mut self,
        (state, named): (SearchState<'a, N>, Vec<MissingEffect>),
        mut apart: TrialSpecificEffects<N>,
        progress: Progress<'_>,
    ) -> Result<Finding<N>, GapError> {
        let judged = self.judged_with_base((state, named), apart.periodic, progress)?;
        let (judged, withheld) = self.without_open_names(judged, apart.periodic, progress)?;
        let Judged {
            state,
            mut named,
            base,
        } = judged;
        let SearchState {
            mut calibrated,
            mut before,
            current: mut amended,
            point,
            search_trace,
            detection_limits,
            scale,
            ..
        } = state;
        progress("measuring what is left", 0.9)?;
        let gained: Vec<f64> = base.iter().map(|law| law.gain).collect();
        if let Some(rigid) = self.rigid(&gained) {
            (calibrated, before) = rigid;
        }
        let known = self.known((amended, point), &mut named, (&base, scale))?;
        let (lack, cost, mut precision) = (known.lack, known.cost, known.precision);
        amended = known.amended;
        let explained = (calibrated.cost - cost) / scale;
        if let Some((hypothesis, _)) = self.refined(&calibrated) {
            calibrated.hypothesis = hypothesis;
        }
        if let Some((hypothesis, known)) = self.refined(&amended) {
            (amended.hypothesis, precision) = (hypothesis, known);
        }
        apart.without_held(&amended.hypothesis.effects());
        if self.session.comparison == ComparisonMode::Led {
            self.courses = std::mem::take(&mut apart.measured);
        }
        let in_trials = self.in_every_trial((&mut calibrated, &mut amended), &mut apart)?;
        for law in base {
            named.push(self.name(law, &mut amended, &mut precision));
        }
        for fitted in [&mut calibrated, &mut amended] {
            fitted.hypothesis.known.truncate(self.session.effects.len());
        }
        share_out(&mut named, explained);
        progress("done", 1.0)?;
        Ok(Finding {
            calibrated,
            amended,
            named,
            withheld,
            trial_specific: apart.trial_specific,
            in_trials,
            search_trace,
            precision,
            lack: [before, lack],
            detection_limits,
            scale,
        })
    }

    /// Withholds the names of open joints; the joints that stay open without them.
    fn without_open_names(
        &mut self,
        mut judged: Judged<'a, N>,
        periodic: Option<[f64; 2]>,
        progress: Progress<'_>,
    ) -> Result<(Judged<'a, N>, Vec<usize>), GapError> {
        let mut withheld = Vec::new();
        for _ in 0..WITHHOLDINGS {
            let joints = self.withhold(&mut judged.state)?;
            if joints.is_empty() {
                break;
            }
            withheld.extend(joints);
            let again = self.judged(judged.state, periodic, progress)?;
            judged = self.judged_with_base(again, periodic, progress)?;
        }
        if !withheld.is_empty() {
            let open = self.open_joints(&judged.state.current.hypothesis);
            withheld.retain(|&joint| open[joint]);
            withheld.sort_unstable();
            withheld.dedup();
        }
        Ok((judged, withheld))
    }

    /// Selects the laws of the base, and tests the other named effects again where the base changes: a named spring over two joints brings
    /// back the springs of both joints, and the effects that had replaced them become redundant.
    fn judged_with_base(
        &mut self,
        (mut state, mut named): (SearchState<'a, N>, Vec<MissingEffect>),
        periodic: Option<[f64; 2]>,
        progress: Progress<'_>,
    ) -> Result<Judged<'a, N>, GapError> {
        progress("judging the passive base", 0.88)?;
        let found = (state.current.asked.clone(), self.dropped.clone());
        let settled = self.afresh((state.current, state.point));
        let mut settled = self.with_friction_at_rest(settled)?;
        let mut exchanges = 0;
        let base = loop {
            let (with_base, base) = self.judged_base(settled, state.scale)?;
            // What a name with shapes of its own made too weak may stand in for that name.
            if exchanges < EXCHANGES_OF_BASE
                && let Some(instead) = self.with_base_instead(&with_base.0, &with_base.1)?
            {
                exchanges += 1;
                settled = instead;
                continue;
            }
            let before = with_base.0.asked.len();
            settled = self.pruned(with_base, &state.calibrated, state.scale)?;
            if settled.0.asked.len() == before {
                break base;
            }
        };
        (state.current, state.point) = settled;
        if !is_as_judged(&found, &(state.current.asked.clone(), self.dropped.clone())) {
            (state, named) = self.judged(state, periodic, progress)?;
        }
        Ok(Judged { state, named, base })
    }

    /// What is known of the amended model, with the noise of all fitted trials where there are repeats. A name that comes to nothing then is
    /// none.
    fn known(
        &mut self,
        (amended, point): Settled<'a, N>,
        named: &mut Vec<MissingEffect>,
        (base, scale): (&[BaseLaw<N>], f64),
    ) -> Result<AmendedModel<N>, GapError> {
        let alone = self.precision(&point, &amended, scale)?;
        let first = self.session.effects.len();
        let precision = widened(&alone, &amended, named, (first, base));
        let known = AmendedModel {
            lack: lack_of_fit(self, &point, &amended),
            cost: amended.cost,
            amended,
            precision,
        };
        if !self.repeated {
            return Ok(known);
        }
        let before = self.noise.clone();
        let (weighed, other) = self.weighed_by_what_is_left((&known.amended, point))?;
        let Some(slot) = weighed.comes_to_nothing() else {
            return Ok(AmendedModel {
                amended: weighed,
                precision: known.precision.with_noise(&alone, other),
                ..known
            });
        };
        self.noise = before;
        let FittedHypothesis {
            mut hypothesis,
            mut asked,
            ..
        } = known.amended;
        hypothesis.named.remove(slot);
        asked.remove(slot);
        named.retain(|one| one.slot != slot);
        for one in named.iter_mut().filter(|one| one.slot > slot) {
            one.slot -= 1;
        }
        let settled = self.settle(hypothesis, asked)?;
        self.known(settled, named, (base, scale))
    }

    /// The amended model refitted with the noise of all fitted trials, and how well it is known then.
    ///
    /// Of slow noise, the differences of few repeats hold few independent samples, so its estimate from them is uncertain.
    fn weighed_by_what_is_left(
        &mut self,
        (amended, point): (&FittedHypothesis<N>, LinearizationPoint<'a, N>),
    ) -> Result<(FittedHypothesis<N>, Precision), GapError> {
        self.measure_noise_left(&point, amended)?;
        let again = self.settle(amended.hypothesis.clone(), amended.asked.clone());
        let (amended, point) = again.unwrap_or_else(|_| (amended.clone(), point));
        let precision = self.precision(&point, &amended, 1.0)?;
        Ok((amended, precision))
    }

    /// The calibrated and the amended model as they are in each trial, with what was set apart.
    fn in_every_trial(
        &self,
        (calibrated, amended): (&mut FittedHypothesis<N>, &mut FittedHypothesis<N>),
        apart: &mut TrialSpecificEffects<N>,
    ) -> Result<[Vec<Hypothesis<N>>; 2], GapError> {
        let rhythms = rhythms_of(&apart.trial_specific);
        let both = [&calibrated.hypothesis, &amended.hypothesis];
        let tuned = self.parallel(both.len(), |i| self.tuned(both[i], &rhythms));
        for (fitted, tuned) in std::iter::zip([&mut *calibrated, &mut *amended], tuned) {
            if let Some(hypothesis) = tuned {
                fitted.hypothesis = hypothesis;
            }
        }
        if !rhythms.is_empty() {
            // The contact is part of what decides how large a rhythm is.
            let tuned = self.linearize(&amended.hypothesis)?;
            let rhythms = apart.trial_specific.iter_mut();
            for one in rhythms.filter(|a| a.trial.is_none()) {
                if let Some(sized) = self.sized(&tuned, one) {
                    *one = sized;
                }
            }
            let rows = self.rows_of_references();
            let is_seen = |a: &TrialSpecific| a.trial.is_some() || a.is_beyond_noise(rows);
            apart.trial_specific.retain(is_seen);
        }
        let rhythms = rhythms_of(&apart.trial_specific);
        Ok([
            self.in_trials((&calibrated.hypothesis, &[])),
            self.in_trials((&amended.hypothesis, &rhythms)),
        ])
    }
}

/// Whether the named effects and the dropped laws of the base are those of the last selection.
fn is_as_judged(found: &(Vec<Candidate>, Vec<bool>), now: &(Vec<Candidate>, Vec<bool>)) -> bool {
    let same = |(a, b): (&Candidate, &Candidate)| a.is_same_question(b);
    found.1 == now.1 && found.0.len() == now.0.len() && std::iter::zip(&found.0, &now.0).all(same)
}

/// What is known of the numbers, less what the laws may miss.
fn widened<const N: usize>(
    alone: &Precision,
    amended: &FittedHypothesis<N>,
    named: &[MissingEffect],
    (first, base): (usize, &[BaseLaw<N>]),
) -> Precision {
    let mut precision = alone.clone();
    for one in named {
        let law_error = one.gain * amended.asked[one.slot].kind().prior().squared_law_error;
        let is_own = |t| matches!(t, Target::Named(own, _) if own == one.slot);
        precision.widen(is_own, Precision::ALONG * law_error);
        let joint = joint_of(&amended.hypothesis, Target::Named(one.slot, 0));
        let is_beside = |t| joint.is_some() && joint_of(&amended.hypothesis, t) == joint;
        precision.widen(
            |t| is_beside(t) && !is_own(t),
            Precision::BESIDE * law_error,
        );
    }
    for law in base {
        let known = first + law.base;
        let law_error = law.gain * law.question.kind().prior().squared_law_error;
        precision.widen(
            |t| matches!(t, Target::Known(own, _) if own == known),
            Precision::ALONG * law_error,
        );
    }
    precision
}

/// The joint in which the law acts that a number belongs to.
fn joint_of<const N: usize>(hypothesis: &Hypothesis<N>, target: Target) -> Option<usize> {
    let effect = match target {
        Target::Known(e, _) => hypothesis.known[e],
        Target::Named(e, _) => hypothesis.named[e],
        _ => return None,
    };
    (effect.kind.info().place == Place::Joint).then_some(effect.index)
}

/// Those that swing in every trial.
fn rhythms_of(trial_specific: &[TrialSpecific]) -> Vec<Effect<f64>> {
    let rhythms = trial_specific.iter().filter(|a| a.trial.is_none());
    rhythms.map(|a| a.effect).collect()
}

/// Computes the share of all that is explained that is lost without each effect, and sorts by it.
///
/// * `explained` - what all of them explain, in units of twice the log-likelihood; infinite where nothing can be simulated without
///   them
fn share_out(named: &mut [MissingEffect], explained: f64) {
    let all = match explained.is_finite() {
        true => explained,
        false => named.iter().map(|n| n.gain).sum(),
    };
    for one in named.iter_mut() {
        one.share = (one.gain / f64::max(all, one.gain)).min(1.0);
    }
    named.sort_by(|a, b| b.share.total_cmp(&a.share).then(a.slot.cmp(&b.slot)));
}

#[cfg(test)]
mod tests {
    use arm_core::effect::Kind;

    use super::*;

    #[test]
    fn what_was_judged_is_judged_again_where_effects_or_dropped_laws_are_others() {
        let question = |kind| Candidate::about(Effect::new(kind, 1));
        let found = (vec![question(Kind::Biarticular)], vec![true, false]);
        assert!(is_as_judged(&found, &found.clone()));
        let more = vec![question(Kind::Biarticular), question(Kind::Inertia)];
        assert!(!is_as_judged(&found, &(more, found.1.clone())));
        let other = vec![question(Kind::Inertia)];
        assert!(!is_as_judged(&found, &(other, found.1.clone())));
        assert!(!is_as_judged(
            &found,
            &(found.0.clone(), vec![false, false])
        ));
    }
}
