//! State and progress of a search.

use arm_core::effect::Effect;

use crate::GapError;
use crate::candidates::candidate::Candidate;
use crate::fitting::fit::FittedHypothesis;
use crate::fitting::lack_of_fit::LackOfFit;
use crate::sensitivity::linearization_point::LinearizationPoint;

/// One round of the search.
#[derive(Clone, Debug)]
pub struct SearchRound {
    /// What was added, best first: the candidates and what they gained.
    pub tried: Vec<(Vec<Candidate>, f64)>,
    /// Cost before it.
    pub before: f64,
    /// Cost after it.
    pub after: f64,
}

/// A candidate that was not named: what it would still explain, and the smallest size that would have been named.
#[derive(Clone, Debug)]
pub struct DetectionLimit {
    /// The effect.
    pub effect: Effect<f64>,
    /// Its free parameters.
    pub free: Vec<usize>,
    /// What it would gain.
    pub gain: f64,
    /// What it would have to gain.
    pub price: f64,
    /// Smallest size of each of these that would have been named.
    pub smallest: Vec<f64>,
}

/// Receiver of progress: the current step, and the share that is done (0 to 1). Returning [`GapError::Stopped`] ends the search.
pub type Progress<'a> = &'a (dyn Fn(&str, f64) -> Result<(), GapError> + Sync);

/// A fitted hypothesis with the simulation that it was followed from.
pub(crate) type Settled<'a, const N: usize> = (FittedHypothesis<N>, LinearizationPoint<'a, N>);

/// What was found of effects that last.
#[derive(Clone)]
pub(crate) struct SearchState<'a, const N: usize> {
    pub calibrated: FittedHypothesis<N>,
    /// What the calibrated model leaves, at the same samples and with the same noise.
    pub before: LackOfFit,
    pub current: FittedHypothesis<N>,
    pub point: LinearizationPoint<'a, N>,
    pub search_trace: Vec<SearchRound>,
    pub detection_limits: Vec<DetectionLimit>,
    /// Number of candidates.
    pub asked: f64,
    pub scale: f64,
    /// Where it has been: what was named, the joints that are dry then, and the cost.
    pub been: Vec<(Vec<Candidate>, [bool; N], f64)>,
    /// What led back to where it has been: laws of many shapes that were named and are lost again, as plainer ones do as well.
    pub barred: Vec<Candidate>,
}

impl<const N: usize> SearchState<'_, N> {
    /// Bars candidates with shapes that are no longer named; whether one was not barred before.
    pub fn bar_lost(&mut self, asked: Vec<Candidate>) -> bool {
        let known = self.barred.len();
        add_lost(&mut self.barred, asked, &self.current.asked);
        self.barred.len() > known
    }

    /// Whether it has been here before and was hardly worse off: from here it would go round in a circle.
    pub fn is_back(&mut self, dry: [bool; N]) -> bool {
        /// Share of the cost by which the same names must have become better to be tested again: fits with joints that stick end in
        /// different minima.
        const BETTER: f64 = 0.05;
        let FittedHypothesis { asked, cost, .. } = &self.current;
        let enough = self.current.enough().max(BETTER * cost);
        let same = |other: &[Candidate]| {
            other.len() == asked.len()
                && other
                    .iter()
                    .all(|o| asked.iter().any(|a| a.is_same_question(o)))
        };
        let back = self
            .been
            .iter()
            .any(|(named, then, before)| *then == dry && same(named) && before - cost < enough);
        self.been.push((asked.clone(), dry, *cost));
        back
    }
}

/// Adds candidates with shapes that are no longer named.
fn add_lost(barred: &mut Vec<Candidate>, asked: Vec<Candidate>, named: &[Candidate]) {
    for one in asked.into_iter().filter(|one| one.shapes() > 0.0) {
        let same = |other: &Candidate| other.is_same_effect(&one.effect);
        if !named.iter().any(same) && !barred.iter().any(same) {
            barred.push(one);
        }
    }
}

#[cfg(test)]
mod tests {
    use arm_core::effect::Kind;

    use super::*;

    #[test]
    fn what_has_shapes_and_is_named_no_more_is_barred_once() {
        let shaped = |kind, index| {
            let mut one = Candidate::about(Effect::new(kind, index));
            one.refined = vec![(1, (0.1, 1.0))];
            one
        };
        let asked = || {
            vec![
                shaped(Kind::Thixotropy, 0),
                shaped(Kind::Stribeck, 1),
                Candidate::about(Effect::new(Kind::Viscous, 0)),
            ]
        };
        let mut barred = Vec::new();
        add_lost(&mut barred, asked(), &[shaped(Kind::Stribeck, 1)]);
        add_lost(&mut barred, asked(), &[shaped(Kind::Stribeck, 1)]);
        assert_eq!(barred.len(), 1);
        assert!(barred[0].is_same_effect(&Effect::new(Kind::Thixotropy, 0)));
    }
}
