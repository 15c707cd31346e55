//! First-order screening: the effect of calibration, and the gain of each candidate alone.

use arm_core::effect::Effect;

use crate::GapError;
use crate::candidates::candidate::Candidate;
use crate::candidates::library::Library;
use crate::data::session::ComparisonMode;
use crate::fitting::fit::FittedHypothesis;
use crate::fitting::lack_of_fit::{LackOfFit, lack_of_fit};
use crate::hypothesis::Hypothesis;
use crate::prepared_session::PreparedSession;
use crate::selection::score_test::ScoreTest;
use crate::selection::search_state::Progress;
use crate::trial_specific::tremor_detection::Line;

/// Result of the screening; only the calibration was converged by simulation.
#[derive(Clone, Debug)]
pub struct FirstOrderScreening<const N: usize> {
    /// The model after refitting what was never exact.
    pub calibrated: FittedHypothesis<N>,
    /// The same as it is in each trial; see [`crate::trial_specific::in_trial`].
    pub in_trials: Vec<Hypothesis<N>>,
    /// Its lack of fit.
    pub lack: LackOfFit,
    /// Every candidate alone, the one that is most worth its price first.
    pub suspects: Vec<ScreenedCandidate>,
}

/// One candidate alone, to first order.
#[derive(Clone, Debug)]
pub struct ScreenedCandidate {
    /// The question.
    pub candidate: Candidate,
    /// The effect as it would be.
    pub effect: Effect<f64>,
    /// What it would explain.
    pub gain: f64,
    /// What it must explain to be named.
    pub price: f64,
    /// Smallest size of its first free parameter that would be named.
    pub smallest: f64,
}

impl<const N: usize> PreparedSession<'_, N> {
    /// Calibrates, and tests every candidate alone to first order.
    ///
    /// # Errors
    /// [`GapError`] where the model as given cannot be simulated or fitted.
    pub fn screen(&mut self, progress: Progress<'_>) -> Result<FirstOrderScreening<N>, GapError> {
        progress("calibrating", 0.1)?;
        let (mut calibrated, mut point) = self.calibrate()?;
        if !self.repeated {
            self.measure_noise(&point)?;
            (calibrated, point) = self.calibrate()?;
        }
        progress("asking the catalogue", 0.6)?;
        let library = Library::build(self, &point, None)?;
        let score_test = ScoreTest::new(self, &calibrated, &point, &library)?.scaled();
        let lack = lack_of_fit(self, &point, &calibrated);
        let mut suspects: Vec<ScreenedCandidate> = (0..score_test.len())
            .filter_map(|c| {
                let choice = score_test.evaluate(&[c])?;
                let candidate = library.candidates[c].clone();
                Some(ScreenedCandidate {
                    effect: candidate.found(&choice.coefficients[0]),
                    gain: choice.gain / score_test.scale,
                    price: score_test.price[c] * score_test.spread[c],
                    smallest: score_test.smallest_seen(c, candidate.free.len())[0],
                    candidate,
                })
            })
            .collect();
        suspects.sort_by(|a, b| (b.gain - b.price).total_cmp(&(a.gain - a.price)));
        // Of several shapes and candidates of one effect the best represents it, with the smallest visible size.
        let mut best: Vec<ScreenedCandidate> = Vec::new();
        for suspect in suspects {
            match best
                .iter_mut()
                .find(|b| b.candidate.is_same_effect(&suspect.effect))
            {
                Some(known) if known.candidate.free == suspect.candidate.free => {
                    known.smallest = known.smallest.min(suspect.smallest);
                }
                Some(_) => {}
                None => best.push(suspect),
            }
        }
        if self.session.comparison == ComparisonMode::Led {
            let rhythm = self.rhythm(&point, Line::BetweenRepeats)?.map(|r| r.effect);
            if let Some(hypothesis) = self.tuned(&calibrated.hypothesis, rhythm.as_slice()) {
                calibrated.hypothesis = hypothesis;
            }
        }
        progress("done", 1.0)?;
        Ok(FirstOrderScreening {
            in_trials: self.in_trials((&calibrated.hypothesis, &[])),
            calibrated,
            lack,
            suspects: best,
        })
    }
}
