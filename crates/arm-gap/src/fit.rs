//! Fitting a hypothesis by simulation: Gauss and Newton's method with step control.

use nalgebra::DMatrix;

use crate::GapError;
use crate::candidate::Candidate;
use crate::hypothesis::{Coordinate, Hypothesis};
use crate::normal::{Cluster, Normal, factor, solve};
use crate::predict::Channels;
use crate::study::{Response, Study};

/// Most steps of a fit.
const STEPS: usize = 5;
/// Most halvings of a step.
const HALVINGS: usize = 5;
/// A step that gains less than this, in units of the noise, is the last.
const ENOUGH: f64 = 0.5;
/// Share of the cost that a last step gains at most, where the model is far from the data.
const SHARE: f64 = 3e-4;

/// A hypothesis fitted to the fit trials.
#[derive(Clone, Debug)]
pub struct Fitted<const N: usize> {
    /// The hypothesis at its best.
    pub hypothesis: Hypothesis<N>,
    /// The candidates that its named effects come from.
    pub asked: Vec<Candidate>,
    /// Whitened residual squares, and what the values cost against what was known of them.
    pub cost: f64,
    /// Residuals of the fitted trials.
    pub residuals: Vec<Channels>,
}

/// Responses to the nuisances, taken at one hypothesis and used near it.
#[derive(Clone, Debug)]
pub struct Background {
    /// The nuisances.
    pub coordinates: Vec<Coordinate>,
    /// Responses to them.
    pub responses: Vec<Response>,
    /// Responses to what differs from trial to trial.
    pub own: Vec<Response>,
}

impl Background {
    /// Linearised at a hypothesis.
    ///
    /// # Errors
    /// As [`Study::responses`].
    pub fn at<const N: usize>(
        study: &Study<N>,
        hypothesis: &Hypothesis<N>,
    ) -> Result<Self, GapError> {
        let coordinates = study.session.nuisances();
        let all: Vec<Coordinate> = coordinates
            .iter()
            .copied()
            .chain(study.session.by_trial())
            .collect();
        let mut responses = study.responses_to(hypothesis, &all)?;
        let own = responses.split_off(coordinates.len());
        Ok(Self {
            coordinates,
            responses,
            own,
        })
    }
}

/// The distance of each number from what was known of it, with its standard deviation.
pub fn priors<const N: usize>(
    hypothesis: &Hypothesis<N>,
    coordinates: &[Coordinate],
) -> Vec<Option<(f64, f64)>> {
    coordinates
        .iter()
        .map(|c| {
            c.prior
                .map(|(mean, sd)| (hypothesis.get(c.target) - mean, sd))
        })
        .collect()
}

impl<const N: usize> Study<'_, N> {
    /// Cost of residuals under a hypothesis, for the trials that are fitted.
    fn cost(
        &self,
        hypothesis: &Hypothesis<N>,
        coordinates: &[Coordinate],
        residuals: &[Channels],
        own: &[Response],
    ) -> f64 {
        let clusters = self.clusters(&self.fitted, residuals, &[], own);
        let data: f64 = clusters.iter().map(|c| c.square).sum();
        let known: f64 = priors(hypothesis, coordinates)
            .into_iter()
            .flatten()
            .map(|(distance, sd)| (distance / sd) * (distance / sd))
            .sum();
        data + known
    }

    /// Fits the nuisances and the named effects of a hypothesis.
    ///
    /// * `asked` - the candidate behind each named effect
    /// * `steps` - most steps
    ///
    /// # Errors
    /// [`GapError`] where the start cannot be simulated, or nothing decides an unknown.
    pub fn fit(
        &self,
        start: Hypothesis<N>,
        asked: Vec<Candidate>,
        background: &Background,
    ) -> Result<Fitted<N>, GapError> {
        let mut hypothesis = start;
        let mut residuals = self.residuals(&hypothesis, &self.fitted)?;
        let nuisances = &background.coordinates;
        let mut cost = self.cost(&hypothesis, nuisances, &residuals, &background.own);
        for _ in 0..STEPS {
            let named: Vec<Coordinate> = asked
                .iter()
                .enumerate()
                .flat_map(|(slot, c)| c.coordinates(slot, &hypothesis.named[slot]))
                .collect();
            let own_columns = self.responses_to(&hypothesis, &named)?;
            let coordinates: Vec<Coordinate> = nuisances.iter().chain(&named).copied().collect();
            let columns: Vec<&Response> = background.responses.iter().chain(&own_columns).collect();
            let clusters = self.clusters(&self.fitted, &residuals, &columns, &background.own);
            let list: Vec<&Cluster> = clusters.iter().collect();
            let mut normal = Normal::new(&list, &priors(&hypothesis, &coordinates));
            let usable: Vec<usize> = (0..coordinates.len())
                .filter(|&i| normal.gram[(i, i)] > 0.0)
                .collect();
            regularise(&mut normal.gram, &hypothesis, &coordinates);
            let bounds = |i: usize| {
                let c = &coordinates[usable[i]];
                let value = hypothesis.get(c.target);
                (c.lower - value, c.upper - value)
            };
            // Where nothing decides an unknown, what was found so far stands.
            let Some((step, _)) = solve(&normal.gram, &normal.score, &usable, &bounds) else {
                break;
            };
            let Some((next, rest, less)) = self.shortened(
                &hypothesis,
                (&coordinates, &usable, &step),
                background,
                cost,
            )?
            else {
                break;
            };
            let gained = cost - less;
            (hypothesis, residuals, cost) = (next, rest, less);
            if gained < ENOUGH + SHARE * cost {
                break;
            }
        }
        Ok(Fitted {
            hypothesis,
            asked,
            cost,
            residuals,
        })
    }

    /// The first of a step, its half, its quarter … that lowers the cost.
    #[allow(clippy::type_complexity)]
    fn shortened(
        &self,
        from: &Hypothesis<N>,
        (coordinates, usable, step): (&[Coordinate], &[usize], &[f64]),
        background: &Background,
        cost: f64,
    ) -> Result<Option<(Hypothesis<N>, Vec<Channels>, f64)>, GapError> {
        let mut share = 1.0;
        for _ in 0..HALVINGS {
            let mut next = from.clone();
            for (&i, change) in usable.iter().zip(step) {
                let c = &coordinates[i];
                let value = from.get(c.target) + share * change;
                next = next.with(c.target, value.clamp(c.lower, c.upper));
            }
            if let Ok(residuals) = self.residuals(&next, &self.fitted) {
                let less = self.cost(&next, &background.coordinates, &residuals, &background.own);
                if less < cost {
                    return Ok(Some((next, residuals, less)));
                }
            }
            share *= 0.5;
        }
        Ok(None)
    }
}

/// Shapes that the data hardly decide move no further than their own size in one step.
pub fn regularise<const N: usize>(
    gram: &mut DMatrix<f64>,
    hypothesis: &Hypothesis<N>,
    coordinates: &[Coordinate],
) {
    for (i, c) in coordinates.iter().enumerate() {
        if c.prior.is_none() {
            let size = hypothesis.get(c.target).abs().max(10.0 * c.step);
            gram[(i, i)] += 1.0 / (size * size);
        }
    }
}

/// Standard deviations of the named parameters of a fitted hypothesis, and the covariance of all unknowns.
#[derive(Clone, Debug)]
pub struct Precision {
    /// The unknowns: nuisances first, then the named effects' own.
    pub coordinates: Vec<Coordinate>,
    /// Standard deviation of each; infinite where nothing decides it.
    pub sd: Vec<f64>,
}

impl<const N: usize> Study<'_, N> {
    /// How well the unknowns of a fitted hypothesis are known.
    ///
    /// The spread between trials counts where it is larger than the noise tells: the covariance is that of the sandwich
    /// of trial scores, or the model's own if that is larger.
    ///
    /// # Errors
    /// As [`Study::responses`].
    pub fn precision(&self, fitted: &Fitted<N>, scale: f64) -> Result<Precision, GapError> {
        let hypothesis = &fitted.hypothesis;
        let background = Background::at(self, hypothesis)?;
        let named: Vec<Coordinate> = fitted
            .asked
            .iter()
            .enumerate()
            .flat_map(|(slot, c)| c.coordinates(slot, &hypothesis.named[slot]))
            .collect();
        let responses = self.responses_to(hypothesis, &named)?;
        let coordinates: Vec<Coordinate> = background
            .coordinates
            .iter()
            .chain(&named)
            .copied()
            .collect();
        let columns: Vec<&Response> = background.responses.iter().chain(&responses).collect();
        let clusters = self.clusters(&self.fitted, &fitted.residuals, &columns, &background.own);
        let list: Vec<&Cluster> = clusters.iter().collect();
        let mut normal = Normal::new(&list, &priors(hypothesis, &coordinates));
        regularise(&mut normal.gram, hypothesis, &coordinates);
        let mut sd = vec![f64::INFINITY; coordinates.len()];
        // A value at its limit is held there: the others are known as if it were exact.
        let free: Vec<usize> = (0..coordinates.len())
            .filter(|&i| {
                let value = hypothesis.get(coordinates[i].target);
                let inside = value > coordinates[i].lower && value < coordinates[i].upper;
                inside && normal.gram[(i, i)] > 0.0
            })
            .collect();
        let left = DMatrix::from_fn(free.len(), free.len(), |a, b| {
            normal.gram[(free[a], free[b])]
        });
        if let Some(factor) = factor(left) {
            let inverse = factor.inverse();
            // Scores that scatter more between trials than the noise allows widen everything alike.
            let spread = self.score_spread(&clusters, &free, &inverse);
            for (a, &i) in free.iter().enumerate() {
                let widen = f64::max(scale, spread[a]);
                sd[i] = (inverse[(a, a)] * widen).sqrt();
            }
        }
        Ok(Precision { coordinates, sd })
    }

    /// For each free unknown the ratio of its variance from the scatter of trials within groups to that from the noise,
    /// shrunk towards one.
    fn score_spread(
        &self,
        clusters: &[Cluster],
        free: &[usize],
        inverse: &DMatrix<f64>,
    ) -> Vec<f64> {
        /// Weight of "as the noise says", in trials.
        const BELIEF: f64 = 6.0;
        let n = free.len();
        (0..n)
            .map(|a| {
                let score =
                    |c: &Cluster| (0..n).fold(0.0, |s, b| s + inverse[(a, b)] * c.score[free[b]]);
                let expected = |c: &Cluster| {
                    let mut sum = 0.0;
                    for b in 0..n {
                        for d in 0..n {
                            sum += inverse[(a, b)] * c.gram[(free[b], free[d])] * inverse[(a, d)];
                        }
                    }
                    sum
                };
                let (mut observed, mut predicted, mut dof) = (0.0, 0.0, 0.0);
                for group in 0..self.references.len() {
                    let own: Vec<&Cluster> = clusters
                        .iter()
                        .filter(|c| c.configuration == group)
                        .collect();
                    if own.len() < 2 {
                        continue;
                    }
                    let mean = own.iter().map(|c| score(c)).sum::<f64>() / own.len() as f64;
                    let variance = own.iter().map(|c| expected(c)).sum::<f64>() / own.len() as f64;
                    observed += own
                        .iter()
                        .map(|c| (score(c) - mean) * (score(c) - mean))
                        .sum::<f64>();
                    predicted += variance * (own.len() - 1) as f64;
                    dof += (own.len() - 1) as f64;
                }
                if predicted <= 0.0 {
                    return 1.0;
                }
                let ratio = observed / predicted;
                ((BELIEF + dof * ratio) / (BELIEF + dof)).max(1.0)
            })
            .collect()
    }
}
