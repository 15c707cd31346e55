//! Slow oscillations with one phase in all trials, of the robot, the shoulder or a muscle.
//!
//! Movements have power at the same frequencies, so
//! they are no lines in a spectrum; they are tested as other effects are, frequency by frequency.

use core::f64::consts::FRAC_PI_2;

use crate::candidates::library::Library;
use crate::fitting::fit::FittedHypothesis;
use crate::prepared_session::PreparedSession;
use crate::selection::score_test::ScoreTest;
use crate::sensitivity::linearization_point::LinearizationPoint;
use crate::trial_specific::component::{SLOW, shapes_of};
use crate::trial_specific::tremor_detection::UNSTEADY;

/// Lowest frequency that is tested \[Hz\], that of slow breathing.
const SLOWEST: f64 = 0.1;
/// Turns of the phase over the longest trial that must be there: fewer are a drift.
const LEAST_TURNS: f64 = 1.5;
/// Turns of the phase, over the longest trial, between two frequencies that are tested.
const TURNS_BETWEEN: f64 = 0.7;
/// Most frequencies that are tested: in longer trials a line in the spectrum shows the oscillation as well.
const MOST_FREQUENCIES: usize = 120;
/// [`UNSTEADY`] where joints have dry friction: an oscillation that reverses them changes the friction, which no linear response contains.
/// Movements have nothing else in common: what is no swing differs in most of its square.
const UNSTEADY_IF_DRY: f64 = 0.3;
/// Frequencies tested at a time: products of all their columns are kept.
const AT_ONCE: usize = 8;
/// Frequencies tested on either side of the best one, between it and the next.
const CLOSER: i32 = 5;
/// Times that this is done, each time closer: a wave whose phase runs away over a trial is not alike in trials of other lengths.
const LOOKS: i32 = 2;

impl<const N: usize> PreparedSession<'_, N> {
    /// Frequency \[Hz\] and phase \[rad\] of what swings slowly, is plain in all movements together, and alike in each; `None` where there
    /// is nothing, trials are too long for it, or what was fitted cannot be followed a little further.
    ///
    /// * `scale` - misfit for each degree of freedom
    pub fn in_phase(
        &self,
        (fitted, point): (&FittedHypothesis<N>, &LinearizationPoint<N>),
        scale: f64,
    ) -> Option<[f64; 2]> {
        let longest = |&t: &usize| self.courses[t].seen[0].len() as f64 / self.courses[t].rate;
        let longest = self.references.iter().map(longest).fold(1.0, f64::max);
        let slowest = f64::max(SLOWEST, LEAST_TURNS / longest);
        let step = TURNS_BETWEEN / longest;
        let count = libm::ceil((SLOW - slowest) / step) as usize + 1;
        if !self.repeated || count > MOST_FREQUENCIES {
            return None;
        }
        let coarse: Vec<f64> = (0..count).map(|k| slowest + step * k as f64).collect();
        let mut best: Option<Wave> = None;
        for frequencies in coarse.chunks(AT_ONCE) {
            best = better(best, self.waves_at(frequencies, (fitted, point)));
        }
        // Between two tested frequencies a wave gains at most twice as much.
        best = best.filter(|(gain, _)| gain / scale.max(1.0) > libm::log(count as f64));
        let mut apart = step;
        for _ in 0..LOOKS {
            let (_, [near, _]) = best?;
            apart /= f64::from(CLOSER + 1);
            let closer: Vec<f64> = (-CLOSER..=CLOSER)
                .map(|k| near + apart * f64::from(k))
                .collect();
            best = better(best, self.waves_at(&closer, (fitted, point)));
        }
        let (_, wave) = best?;
        let (library, score_test) = self.scanned(&[wave], (fitted, point))?;
        let unsteady = if self.dry.contains(&true) {
            UNSTEADY_IF_DRY
        } else {
            UNSTEADY
        };
        let is_plain = |c: usize| {
            let Some(choice) = score_test.evaluate(&[c]) else {
                return false;
            };
            let tried =
                2.0 * libm::log(count as f64) + self.price_of_shapes(&library.candidates[c..=c]);
            let worth =
                choice.gain / scale.max(1.0) - score_test.spread[c] * score_test.price[c] - tried;
            worth > 0.0 && score_test.unlike[c] < unsteady * choice.gain
        };
        (0..score_test.len()).any(is_plain).then_some(wave)
    }

    fn scanned(
        &self,
        waves: &[[f64; 2]],
        (fitted, point): (&FittedHypothesis<N>, &LinearizationPoint<N>),
    ) -> Option<(Library, ScoreTest)> {
        let library = Library::of_waves(self, point, waves).ok()?;
        let score_test = ScoreTest::new(self, fitted, point, &library).ok()?;
        Some((library, score_test))
    }

    /// What explains most at one of some frequencies, with any phase and in both axes: its gain, and frequency and phase.
    fn waves_at(
        &self,
        frequencies: &[f64],
        (fitted, point): (&FittedHypothesis<N>, &LinearizationPoint<N>),
    ) -> Option<Wave> {
        let waves: Vec<[f64; 2]> = frequencies
            .iter()
            .flat_map(|&f| [[f, 0.0], [f, FRAC_PI_2]])
            .collect();
        let (library, score_test) = self.scanned(&waves, (fitted, point))?;
        let of = |c: usize| {
            let effect = &library.candidates[c].effect;
            let [frequency, phase] = shapes_of(effect.kind).map(|p| effect.parameters[p]);
            (effect.kind, effect.index, frequency, phase)
        };
        let wave = |sine: usize| {
            let ((kind, index, frequency, _), cosine) = (of(sine), sine + 1);
            if of(cosine) != (kind, index, frequency, FRAC_PI_2) {
                return None;
            }
            let choice = score_test.evaluate(&[sine, cosine])?;
            let phase = common_phase(&choice.coefficients[0], &choice.coefficients[1]);
            Some((choice.gain, [frequency, phase]))
        };
        let all = (1..score_test.len()).map(|cosine| wave(cosine - 1));
        all.fold(None, better)
    }
}

/// What a wave gains, and its frequency and phase.
type Wave = (f64, [f64; 2]);

/// The one that gains more.
fn better(a: Option<Wave>, b: Option<Wave>) -> Option<Wave> {
    match (a, b) {
        (Some(a), Some(b)) => Some(if b.0 > a.0 { b } else { a }),
        (a, b) => a.or(b),
    }
}

/// The phase \[rad\] that axes have in common whose sines and cosines are so large, in step or against each other.
fn common_phase(sines: &[f64], cosines: &[f64]) -> f64 {
    let (mut mixed, mut trial_specific) = (0.0, 0.0);
    for (s, c) in std::iter::zip(sines, cosines) {
        mixed += 2.0 * s * c;
        trial_specific += s * s - c * c;
    }
    0.5 * libm::atan2(mixed, trial_specific)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_against_each_other_have_one_phase() {
        for phase in [-1.4_f64, -0.3, 0.0, 0.9, 1.5] {
            let part = |size: f64| (size * libm::cos(phase), size * libm::sin(phase));
            let ((ys, yc), (zs, zc)) = (part(3e-4), part(-1e-4));
            let found = common_phase(&[ys, zs], &[yc, zc]);
            assert!((found - phase).abs() < 1e-12, "{found} {phase}");
        }
    }
}
