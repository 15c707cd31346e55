//! Fit of a hypothesis to the fit trials by Gauss and Newton's method, within a region in which its linear model is trusted.

use std::sync::{Arc, OnceLock};

use crate::GapError;
use crate::candidates::candidate::Candidate;
use crate::data::course::Channels;
use crate::fitting::step::{Aim, Equations, Step, TrustRegion};
use crate::hypothesis::{Coordinate, Hypothesis, departure};
use crate::linearization::linear_response::Response;
use crate::prepared_session::PreparedSession;
use crate::sensitivity::linearization_point::LinearizationPoint;
use crate::sensitivity::normal_equations::Cluster;
use crate::sensitivity::rows::Columns;

/// Most steps of a fit.
const STEPS: usize = 6;
/// Steps that are tried from one place, each shorter than the one before.
const TRIES: usize = 5;
/// A step that gains less than this, in units of the noise, is the last,
const ENOUGH: f64 = 0.2;
/// and where the model is far from the data, less than this share of what the cost exceeds the number of rows by.
const SHARE: f64 = 1e-4;
/// The same to first order, as a share of that.
const FIRST_ORDER_SHARE: f64 = 0.25;
/// A step that gains less than so many times as much leads so near that the next one takes its slopes.
const NEAR: f64 = 30.0;
/// Maximum number of further fits in [`PreparedSession::fit_on`], each from the end of the fit before.
const CONTINUATIONS: usize = 4;
/// Times that a fit is simulated anew from where it ended.
const AGAIN: usize = 8;

/// A hypothesis fitted to the fit trials.
#[derive(Clone, Debug)]
pub struct FittedHypothesis<const N: usize> {
    /// The hypothesis at its best.
    pub hypothesis: Hypothesis<N>,
    /// The candidates that its named effects come from.
    pub asked: Vec<Candidate>,
    /// Whitened residual squares, and what the values cost against what was known of them.
    pub cost: f64,
    /// Number of rows behind them.
    pub rows: usize,
    /// Residuals of the fitted trials.
    pub residuals: Vec<Channels>,
    /// Fits without each of its named effects, where they were needed.
    pub(crate) without: Arc<OnceLock<WithoutEach<N>>>,
}

/// Fits of a hypothesis without each of its named effects.
#[derive(Clone, Debug)]
pub(crate) struct WithoutEach<const N: usize> {
    /// The hypothesis.
    pub whole: Hypothesis<N>,
    /// Those fits, in the order of its named effects.
    pub each: Vec<FittedHypothesis<N>>,
}

impl<const N: usize> FittedHypothesis<N> {
    /// A gain below this is none.
    pub(crate) fn enough(&self) -> f64 {
        ENOUGH + SHARE * (self.cost - self.rows as f64).max(0.0)
    }

    /// What is left for each row; noise leaves 1.
    pub fn misfit(&self) -> f64 {
        self.cost / self.rows as f64
    }

    /// Whether more is left than noise leaves.
    pub(crate) fn leaves_much(&self) -> bool {
        /// Misfit for each row from which on much is left: noise leaves 1.
        const MUCH: f64 = 1.5;
        self.cost >= MUCH * self.rows as f64
    }

    /// The place of a named effect that does nothing as it was fitted.
    pub(crate) fn comes_to_nothing(&self) -> Option<usize> {
        let mut named = std::iter::zip(&self.asked, &self.hypothesis.named);
        named.position(|(asked, effect)| asked.is_nothing(effect))
    }

    /// Whether a named effect has come to a shape in which it is another, plainer law.
    pub(crate) fn has_plainer(&self) -> bool {
        self.plainer().next().is_some()
    }

    /// The questions whose effects have come to such a shape.
    pub(crate) fn plainer(&self) -> impl Iterator<Item = Candidate> {
        let named = std::iter::zip(&self.asked, &self.hypothesis.named);
        let plainer = named.filter(|(asked, effect)| asked.is_plainer(effect));
        plainer.map(|(asked, _)| asked.clone())
    }

    /// The numbers of the named effects that a fit may change.
    pub fn named(&self) -> Vec<Coordinate> {
        named(&self.hypothesis, &self.asked)
    }
}

fn named<const N: usize>(hypothesis: &Hypothesis<N>, asked: &[Candidate]) -> Vec<Coordinate> {
    let each = asked.iter().enumerate();
    each.flat_map(|(slot, c)| c.coordinates(slot, &hypothesis.named[slot]))
        .collect()
}

impl<'a, const N: usize> PreparedSession<'a, N> {
    /// A hypothesis near a linearization point with its residuals and their cost.
    pub(crate) fn state(
        &self,
        point: &LinearizationPoint<N>,
        hypothesis: Hypothesis<N>,
        asked: Vec<Candidate>,
    ) -> Result<FittedHypothesis<N>, GapError> {
        let residuals = self.residuals(point, &hypothesis)?;
        let squares = point.rows.squares(self, &residuals);
        let data: f64 = squares.iter().map(|c| c.square).sum();
        let own = named(&hypothesis, &asked);
        let cost = data + departure(&hypothesis, &point.coordinates) + departure(&hypothesis, &own);
        Ok(FittedHypothesis {
            hypothesis,
            asked,
            cost,
            rows: self.compared_rows(),
            residuals,
            without: Arc::default(),
        })
    }

    /// The normal equations of all unknowns at a fitted hypothesis: nuisances first, then the named effects' own, then
    /// other columns.
    ///
    /// # Errors
    /// As [`PreparedSession::responses_at`].
    pub fn equations(
        &self,
        point: &LinearizationPoint<N>,
        fitted: &FittedHypothesis<N>,
        more: &Columns,
    ) -> Result<(Vec<Coordinate>, Vec<Cluster>), GapError> {
        let own = fitted.named();
        let responses = self.responses_at(point, &fitted.hypothesis, &own)?;
        let each: Vec<_> = responses.iter().collect();
        Ok(self.equations_with(point, fitted, (&each, more)))
    }

    /// The same with responses of the named effects that are known.
    pub(crate) fn equations_with(
        &self,
        point: &LinearizationPoint<N>,
        fitted: &FittedHypothesis<N>,
        columns: (&[&Response], &Columns),
    ) -> (Vec<Coordinate>, Vec<Cluster>) {
        let rows = &point.rows;
        let clusters = rows.clusters_beside(self, columns, &fitted.residuals);
        let own = fitted.named();
        let coordinates = point.coordinates.iter().copied().chain(own).collect();
        (coordinates, clusters)
    }

    /// Fits the nuisances and the named effects of a hypothesis, followed from a linearization point.
    ///
    /// * `asked` - the candidate behind each named effect
    ///
    /// # Errors
    /// [`GapError`] where the start cannot be followed from the linearization point.
    pub fn fit(
        &self,
        point: &LinearizationPoint<N>,
        start: Hypothesis<N>,
        asked: Vec<Candidate>,
    ) -> Result<FittedHypothesis<N>, GapError> {
        self.fit_towards(point, (start, asked), Aim::BEST)
    }

    /// The same, given up where the cost will not come down to that of `aim`: the result is unfinished then, and its cost is above it.
    ///
    /// # Errors
    /// As [`PreparedSession::fit`].
    pub(crate) fn fit_towards(
        &self,
        point: &LinearizationPoint<N>,
        (start, asked): (Hypothesis<N>, Vec<Candidate>),
        aim: Aim,
    ) -> Result<FittedHypothesis<N>, GapError> {
        let mut fitted = self.state(point, start, asked)?;
        let mut slopes: Option<Vec<Response>> = None;
        let mut region = TrustRegion {
            radius: f64::INFINITY,
        };
        for steps_left in (0..STEPS).rev() {
            let hypothesis = &fitted.hypothesis;
            let old = slopes.is_some();
            let fresh = || self.responses_at(point, hypothesis, &fitted.named());
            // What cannot be followed a little further on is fitted as far as it was.
            let Ok(responses) = slopes.take().map_or_else(fresh, Ok) else {
                break;
            };
            let each: Vec<&Response> = responses.iter().collect();
            let (coordinates, clusters) =
                self.equations_with(point, &fitted, (&each, &Columns::default()));
            let equations = Equations::new(&clusters, hypothesis, &coordinates);
            let hopeless = equations.is_hopeless(fitted.cost, aim);
            // A step that gains too little to first order need not be tried.
            let enough =
                |fitted: &FittedHypothesis<N>| fitted.enough().max(aim.negligible(fitted.cost));
            let least = FIRST_ORDER_SHARE * enough(&fitted);
            let mut trusted = region;
            let mut found = None;
            for _ in 0..TRIES {
                let step = equations.step_within(trusted.radius);
                let Some(step) = step.filter(|step| !hopeless && step.gain > least) else {
                    break;
                };
                let moved = step.from(hypothesis, &coordinates);
                let next = self.state(point, moved, fitted.asked.clone()).ok();
                let cost = next.as_ref().map_or(f64::INFINITY, |next| next.cost);
                trusted.learn(&step, fitted.cost - cost);
                found = next.filter(|next| next.cost < fitted.cost);
                if found.is_some() {
                    break;
                }
            }
            // Where nothing decides an unknown, and where no step lowers the cost, what was found so far stands.
            let Some(next) = found else {
                if old {
                    continue;
                }
                break;
            };
            region = trusted;
            let gained = fitted.cost - next.cost;
            fitted = next;
            let enough = enough(&fitted);
            if gained < enough || aim.is_out_of_reach(fitted.cost, gained, steps_left) {
                break;
            }
            slopes = (gained < NEAR * enough).then_some(responses);
        }
        Ok(fitted)
    }

    /// Continues a fit from where an undamped step leads, even if the cost is higher there; keeps the result if its cost is lower. What would
    /// not come down to the cost of `aim` is given up.
    ///
    /// The cost as a function of a size and the rest angle of its law is a curved valley, in which steps that lower the cost are short.
    pub(crate) fn fit_on(
        &self,
        point: &LinearizationPoint<N>,
        mut fitted: FittedHypothesis<N>,
        aim: Aim,
    ) -> FittedHypothesis<N> {
        for _ in 0..CONTINUATIONS {
            let on = self.fit_after_whole_step(point, &fitted, aim);
            let Some(on) = on.filter(|on| on.cost < fitted.cost - fitted.enough()) else {
                break;
            };
            fitted = on;
        }
        fitted
    }

    /// A fit that starts after an undamped step; `None` if the model cannot be evaluated there, or the fit would be given up.
    fn fit_after_whole_step(
        &self,
        point: &LinearizationPoint<N>,
        fitted: &FittedHypothesis<N>,
        aim: Aim,
    ) -> Option<FittedHypothesis<N>> {
        let (coordinates, clusters) = self.equations(point, fitted, &Columns::default()).ok()?;
        let equations = Equations::new(&clusters, &fitted.hypothesis, &coordinates);
        if equations.is_hopeless(fitted.cost, aim) {
            return None;
        }
        let start = equations.step(0.0)?.from(&fitted.hypothesis, &coordinates);
        self.fit_towards(point, (start, fitted.asked.clone()), aim)
            .ok()
    }

    /// Squares of what a fitted hypothesis leaves of each cluster when the others alone decide its numbers, to first order.
    ///
    /// # Errors
    /// As [`PreparedSession::equations`].
    pub fn foretold(
        &self,
        point: &LinearizationPoint<N>,
        fitted: &FittedHypothesis<N>,
    ) -> Result<f64, GapError> {
        let hypothesis = &fitted.hypothesis;
        let (coordinates, clusters) = self.equations(point, fitted, &Columns::default())?;
        let mut sum = 0.0;
        for (out, cluster) in clusters.iter().enumerate() {
            let others: Vec<Cluster> = clusters
                .iter()
                .enumerate()
                .filter(|(i, _)| *i != out)
                .map(|(_, c)| c.clone())
                .collect();
            let Step { usable, sizes, .. } = Equations::new(&others, hypothesis, &coordinates)
                .step(0.0)
                .unwrap_or_default();
            sum += cluster.square;
            for (&i, a) in usable.iter().zip(&sizes) {
                let row = usable.iter().zip(&sizes);
                let product = row.fold(0.0, |s, (&j, b)| s + cluster.gram[(i, j)] * b);
                sum += a * (product - 2.0 * cluster.score[i]);
            }
        }
        Ok(sum)
    }

    /// Fits a hypothesis, simulating it anew from where the fit ended until that changes nothing.
    ///
    /// # Errors
    /// [`GapError`] where the hypothesis cannot be simulated.
    pub fn settle(
        &self,
        start: Hypothesis<N>,
        asked: Vec<Candidate>,
    ) -> Result<(FittedHypothesis<N>, LinearizationPoint<'a, N>), GapError> {
        let mut point = self.linearize(&start)?;
        let mut before = self.state(&point, start, asked)?;
        for _ in 0..AGAIN {
            let after = self.fit(&point, before.hypothesis.clone(), before.asked.clone())?;
            let gained = before.cost - after.cost;
            if gained < 2.0 * after.enough() {
                return Ok((after, point));
            }
            let there = match self.linearize(&after.hypothesis) {
                Ok(there) => there,
                // A solution that can be followed but not simulated is refused.
                Err(_) => break,
            };
            let simulated = self.state(&there, after.hypothesis, after.asked)?;
            if simulated.cost > before.cost {
                break;
            }
            (before, point) = (simulated, there);
        }
        Ok((before, point))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hypothesis::tests::plain;

    /// Noise leaves a cost of one for each row; a gain of 0.2 counts there, and with 10 000 too much left one of a ten thousandth more.
    #[test]
    fn much_is_left_from_a_half_beyond_noise_on_and_little_gains_count_near_it() {
        let fitted = |cost| FittedHypothesis {
            hypothesis: plain(),
            asked: Vec::new(),
            cost,
            rows: 1000,
            residuals: Vec::new(),
            without: Arc::default(),
        };
        assert_eq!(
            [1490.0, 1510.0].map(|cost| fitted(cost).leaves_much()),
            [false, true]
        );
        let enough = [900.0, 1000.0, 11_000.0].map(|cost| fitted(cost).enough());
        assert_eq!(enough, [0.2, 0.2, 1.2]);
    }
}
