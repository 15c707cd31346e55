//! How well the unknowns of a fitted hypothesis are known.

use arm_numerics::Cholesky;

use crate::GapError;
use crate::fitting::fit::FittedHypothesis;
use crate::fitting::score_variance::{spread, trial_scores};
use crate::fitting::step::regularise;
use crate::hypothesis::{Coordinate, Target, priors};
use crate::prepared_session::PreparedSession;
use crate::sensitivity::linearization_point::LinearizationPoint;
use crate::sensitivity::normal_equations::{Cluster, Normal};
use crate::sensitivity::rows::Columns;

/// How well the unknowns of a fitted hypothesis are known.
#[derive(Clone, Debug)]
pub struct Precision {
    /// The unknowns: nuisances first, then the named effects' own.
    pub coordinates: Vec<Coordinate>,
    /// Standard deviation of each; infinite where nothing decides it.
    pub sd: Vec<f64>,
}

impl Precision {
    /// Share of what a law may miss of what it shows that may lie along one of its parameters, as sums of squares.
    pub const ALONG: f64 = 1.0 / 9.0;
    /// The same along a parameter of another law of its joint: a third of that in size.
    pub const BESIDE: f64 = 1.0 / 81.0;

    /// Widens what is known of some numbers by what a law may miss.
    ///
    /// * `of` - tells them
    /// * `law_error` - what the law may miss along one of them, in units of twice the log-likelihood
    pub fn widen(&mut self, of: impl Fn(Target) -> bool, law_error: f64) {
        let wider = libm::sqrt(1.0 + law_error.max(0.0));
        for (c, sd) in self.coordinates.iter().zip(&mut self.sd) {
            if of(c.target) {
                *sd *= wider;
            }
        }
    }

    /// The same where the noise is another one: what the laws may miss is as it was.
    ///
    /// * `alone` - with the former noise, before anything was widened
    /// * `other` - with the other noise
    pub fn with_noise(&self, alone: &Self, other: Self) -> Self {
        let sd = (0..other.sd.len()).map(|i| {
            let widened = self.sd[i] * self.sd[i] - alone.sd[i] * alone.sd[i];
            // Where both are infinite, the difference is none.
            libm::sqrt(other.sd[i] * other.sd[i] + f64::max(widened, 0.0))
        });
        Self {
            sd: sd.collect(),
            coordinates: other.coordinates,
        }
    }
}

impl<const N: usize> PreparedSession<'_, N> {
    /// How well the unknowns of a fitted hypothesis are known.
    ///
    /// The spread between trials counts where it is larger than the noise model predicts.
    ///
    /// # Errors
    /// [`GapError::Numerics`] as [`PreparedSession::equations`].
    pub fn precision(
        &self,
        point: &LinearizationPoint<N>,
        fitted: &FittedHypothesis<N>,
        scale: f64,
    ) -> Result<Precision, GapError> {
        match self.equations(point, fitted, &Columns::default()) {
            // Where a small change of the solution cannot be simulated, its precision is unknown.
            Err(GapError::Simulation { .. }) => {
                let mut coordinates = point.coordinates.clone();
                coordinates.extend(fitted.named());
                let sd = vec![f64::INFINITY; coordinates.len()];
                Ok(Precision { coordinates, sd })
            }
            other => Ok(precision_of(fitted, other?, scale)),
        }
    }

    /// How well everything but the numbers of the named effects is known, as if those were exact.
    pub(crate) fn precision_beside_named(
        &self,
        point: &LinearizationPoint<N>,
        fitted: &FittedHypothesis<N>,
    ) -> Precision {
        let clusters = point.rows.clusters(self, &[], &fitted.residuals);
        precision_of(fitted, (point.coordinates.clone(), clusters), 1.0)
    }
}

/// See [`PreparedSession::precision`].
fn precision_of<const N: usize>(
    fitted: &FittedHypothesis<N>,
    (coordinates, clusters): (Vec<Coordinate>, Vec<Cluster>),
    scale: f64,
) -> Precision {
    let mut sd = vec![f64::INFINITY; coordinates.len()];
    if let Some((free, factor)) = decided(fitted, &coordinates, &clusters) {
        let inverse = factor.inverse();
        for (a, &i) in free.iter().enumerate() {
            let row = free.iter().enumerate();
            let weights: Vec<(usize, f64)> = row.map(|(b, &k)| (k, inverse[(a, b)])).collect();
            let widen = f64::max(scale, spread(&trial_scores(&clusters, &weights)));
            sd[i] = (inverse[(a, a)] * widen).sqrt();
        }
    }
    Precision { coordinates, sd }
}

/// The places of the coordinates that data and priors determine, and the factor of their equations.
pub(crate) fn decided<const N: usize>(
    fitted: &FittedHypothesis<N>,
    coordinates: &[Coordinate],
    clusters: &[Cluster],
) -> Option<(Vec<usize>, Cholesky)> {
    let hypothesis = &fitted.hypothesis;
    let mut normal = Normal::new(clusters, &priors(hypothesis, coordinates));
    regularise(&mut normal.gram, hypothesis, coordinates);
    // A size at the limit of its kind is held there: the others are known as if it were exact. What was known before is
    // known no better where it met the end of what is refitted.
    let free: Vec<usize> = (0..coordinates.len())
        .filter(|&i| {
            let c = &coordinates[i];
            let value = hypothesis.get(c.target);
            let inside = !c.is_at_limit(value);
            (inside || c.prior.is_some()) && normal.gram[(i, i)] > 0.0
        })
        .collect();
    let factor = Cholesky::new(normal.gram.select(&free, &free))?;
    Some((free, factor))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A law that may miss as much as noise leaves widens the intervals by the square root of two, others not at all.
    #[test]
    fn what_a_law_may_miss_widens_its_intervals() {
        let coordinate = |joint| Coordinate {
            target: Target::Known(joint, 0),
            prior: None,
            lower: 0.0,
            upper: 1.0,
            step: 1e-3,
        };
        let mut precision = Precision {
            coordinates: vec![coordinate(0), coordinate(1)],
            sd: vec![0.1, 0.2],
        };
        precision.widen(|t| t == Target::Known(0, 0), 1.0);
        assert!((precision.sd[0] - 0.1 * libm::sqrt(2.0)).abs() < 1e-15);
        assert_eq!(precision.sd[1], 0.2);
        precision.widen(|_| true, -1.0);
        assert_eq!(precision.sd[1], 0.2);
        // With half of the noise, and where nothing was known: what the law may miss is as it was.
        let with = |sd: [f64; 2]| Precision {
            sd: sd.to_vec(),
            ..precision.clone()
        };
        let less = precision.with_noise(&with([0.1, 0.2]), with([0.05, 0.1]));
        assert!((less.sd[0] - libm::hypot(0.05, 0.1)).abs() < 1e-15 && less.sd[1] == 0.1);
        let none = with([f64::INFINITY; 2]);
        assert_eq!(none.with_noise(&none, with([0.05, 0.1])).sd, [0.05, 0.1]);
        assert!((Precision::BESIDE - Precision::ALONG * Precision::ALONG).abs() < 1e-15);
    }
}
