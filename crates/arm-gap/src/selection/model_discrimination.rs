//! Expected discrimination between two explanations by new movements.

use arm_core::effect::Effect;
use arm_ident::regression::trial::Trial;

use crate::GapError;
use crate::candidates::candidate::Candidate;
use crate::data::course::{Channels, difference};
use crate::data::session::Session;
use crate::fitting::step::regularise;
use crate::hypothesis::priors;
use crate::hypothesis::{Coordinate, Hypothesis};
use crate::linearization::linear_response::Response;
use crate::prepared_session::PreparedSession;
use crate::sensitivity::linearization_point::LinearizationPoint;
use crate::sensitivity::normal_equations::{Cluster, Normal, solve};

/// A named effect, and others that would do instead.
pub struct Discrimination<'a, const N: usize> {
    prepared: PreparedSession<'a, N>,
    /// The session with the named effect.
    named: Hypothesis<N>,
    /// `None` for one that the trials that were made do not show.
    alternatives: Vec<Option<AlternativeHypothesis<N>>>,
    /// Distances from the measured trials, for every alternative.
    made: Vec<Vec<Cluster>>,
}

/// Another effect in the place of the named one.
struct AlternativeHypothesis<const N: usize> {
    hypothesis: Hypothesis<N>,
    /// What is free in it.
    coordinates: Vec<Coordinate>,
}

impl<'a, const N: usize> Discrimination<'a, N> {
    /// Between a named effect and its alternatives, on the fit trials of a session.
    ///
    /// * `prepared` - its session has everything as known effects but the named one
    /// * `alternatives` - effects as they fit best, and which of their parameters are free
    ///
    /// # Errors
    /// [`GapError`] where the model cannot be simulated.
    pub fn new(
        mut prepared: PreparedSession<'a, N>,
        named: Effect<f64>,
        alternatives: &[(Effect<f64>, Vec<usize>)],
    ) -> Result<Self, GapError> {
        let without = prepared.session.given();
        let given = prepared.simulate_alone(&without)?;
        let with = |effect| {
            let mut hypothesis = without.clone();
            hypothesis.named.push(effect);
            hypothesis
        };
        let alternatives: Vec<Option<AlternativeHypothesis<N>>> = alternatives
            .iter()
            .map(|(effect, free)| {
                let mut candidate = Candidate::again(&prepared, &given, *effect, free)?;
                // Only distances that the data determine count.
                candidate.expected.clear();
                Some(AlternativeHypothesis {
                    hypothesis: with(*effect),
                    coordinates: candidate.coordinates(without.named.len(), effect),
                })
            })
            .collect();
        let named = with(named);
        let point = rested(&mut prepared, &named)?;
        let made = clusters(&alternatives, &prepared, &point)?;
        Ok(Self {
            prepared,
            named,
            alternatives,
            made,
        })
    }

    /// The trials that were made.
    pub fn prepared(&self) -> &PreparedSession<'a, N> {
        &self.prepared
    }

    /// For every alternative the distance between what it and the named effect would show, in standard deviations of the noise,
    /// the alternative and everything that was never exact refitted to first order: by the trials that were made alone, or with a
    /// planned one more. NaN for an alternative that the trials that were made do not show.
    ///
    /// # Errors
    /// [`GapError`] for a movement that cannot be simulated.
    pub fn distances(&self, planned: Option<&Trial<N>>) -> Result<Vec<f64>, GapError> {
        let more = match planned {
            None => vec![Vec::new(); self.alternatives.len()],
            Some(trial) => {
                let session = Session {
                    trials: vec![trial.clone()],
                    weights: Vec::new(),
                    ..self.prepared.session.clone()
                };
                let mut prepared =
                    PreparedSession::with_noise(&session, self.prepared.noise.of_others(), 1)?;
                let point = rested(&mut prepared, &self.named)?;
                clusters(&self.alternatives, &prepared, &point)?
            }
        };
        let each = self.alternatives.iter().zip(self.made.iter().zip(&more));
        Ok(each
            .map(|(alternative, (made, more))| match alternative {
                Some(alternative) => self.distance(
                    alternative,
                    &made.iter().chain(more).cloned().collect::<Vec<_>>(),
                ),
                None => f64::NAN,
            })
            .collect())
    }

    fn distance(&self, alternative: &AlternativeHypothesis<N>, clusters: &[Cluster]) -> f64 {
        let mut coordinates = self.prepared.session.nuisances();
        coordinates.extend(&alternative.coordinates);
        let mut normal = Normal::new(clusters, &priors(&alternative.hypothesis, &coordinates));
        regularise(&mut normal.gram, &alternative.hypothesis, &coordinates);
        let usable: Vec<usize> = (0..coordinates.len())
            .filter(|&i| normal.gram[(i, i)] > 0.0)
            .collect();
        let bounds = |i: usize| {
            let c = &coordinates[usable[i]];
            let value = alternative.hypothesis.get(c.target);
            (c.lower - value, c.upper - value)
        };
        let explained = solve(&normal.gram, &normal.score, &usable, &bounds);
        let left = normal.square - explained.map_or(0.0, |(_, gain)| gain);
        libm::sqrt(left.max(0.0))
    }
}

/// A hypothesis on a session, without the samples at which dry friction of it holds a joint.
fn rested<'a, const N: usize>(
    prepared: &mut PreparedSession<'a, N>,
    hypothesis: &Hypothesis<N>,
) -> Result<LinearizationPoint<'a, N>, GapError> {
    let point = prepared.simulate_alone(hypothesis)?;
    prepared.leave_out_rest(&point);
    prepared.linearize(hypothesis)
}

/// For every alternative what the named effect shows beyond it on the fit trials of a session, beside the responses to all that may be
/// refitted.
fn clusters<const N: usize>(
    alternatives: &[Option<AlternativeHypothesis<N>>],
    prepared: &PreparedSession<N>,
    point: &LinearizationPoint<N>,
) -> Result<Vec<Vec<Cluster>>, GapError> {
    alternatives
        .iter()
        .map(|alternative| {
            let Some(alternative) = alternative else {
                return Ok(Vec::new());
            };
            let own =
                prepared.responses_at(point, &alternative.hypothesis, &alternative.coordinates)?;
            let left = prepared.residuals(point, &alternative.hypothesis)?;
            let shown: Vec<Channels> = std::iter::zip(&left, &point.residuals)
                .map(|(a, b)| difference(a, b))
                .collect();
            let columns: Vec<&Response> = own.iter().collect();
            Ok(point.rows.clusters(prepared, &columns, &shown))
        })
        .collect()
}
