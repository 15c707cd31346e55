//! How well new movements would distinguish two explanations.

use arm_core::effect::Effect;
use arm_ident::regression::trial::Trial;

use crate::GapError;
use crate::candidates::candidate::Candidate;
use crate::data::course::{Channels, difference};
use crate::data::session::Session;
use crate::fitting::fit::regularise;
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
    rivals: Vec<Option<Rival<N>>>,
    /// Distances from the measured trials, for every rival.
    made: Vec<Vec<Cluster>>,
}

/// Another effect in the place of the named one.
struct Rival<const N: usize> {
    hypothesis: Hypothesis<N>,
    /// What is free in it.
    coordinates: Vec<Coordinate>,
}

impl<'a, const N: usize> Discrimination<'a, N> {
    /// Between a named effect and its rivals, on the fit trials of a session.
    ///
    /// * `prepared` - its session has everything as known effects but the named one
    /// * `rivals` - effects as they fit best, and which of their parameters are free
    ///
    /// # Errors
    /// [`GapError`] where the model cannot be simulated.
    pub fn new(
        mut prepared: PreparedSession<'a, N>,
        named: Effect<f64>,
        rivals: &[(Effect<f64>, Vec<usize>)],
    ) -> Result<Self, GapError> {
        let without = prepared.session.given();
        let given = prepared.linearize(&without)?;
        let with = |effect| {
            let mut hypothesis = without.clone();
            hypothesis.named.push(effect);
            hypothesis
        };
        let rivals: Vec<Option<Rival<N>>> = rivals
            .iter()
            .map(|(effect, free)| {
                let mut candidate = Candidate::again(&prepared, &given, *effect, free)?;
                // Only distances that the data determine count.
                candidate.expected.clear();
                Some(Rival {
                    hypothesis: with(*effect),
                    coordinates: candidate.coordinates(without.named.len(), effect),
                })
            })
            .collect();
        let named = with(named);
        let point = rested(&mut prepared, &named)?;
        let made = clusters(&rivals, &prepared, &point)?;
        Ok(Self {
            prepared,
            named,
            rivals,
            made,
        })
    }

    /// The trials that were made.
    pub fn prepared(&self) -> &PreparedSession<'a, N> {
        &self.prepared
    }

    /// For every rival the distance between what it and the named effect would show, in standard deviations of the noise,
    /// the rival and everything that was never exact refitted to first order: by the trials that were made alone, or with a
    /// planned one more. NaN for a rival that the trials that were made do not show.
    ///
    /// # Errors
    /// [`GapError`] for a movement that cannot be simulated.
    pub fn distances(&self, planned: Option<&Trial<N>>) -> Result<Vec<f64>, GapError> {
        let more = match planned {
            None => vec![Vec::new(); self.rivals.len()],
            Some(trial) => {
                let session = Session {
                    trials: vec![trial.clone()],
                    weights: Vec::new(),
                    ..self.prepared.session.clone()
                };
                let mut prepared =
                    PreparedSession::with_noise(&session, self.prepared.noise.of_others(), 1)?;
                let point = rested(&mut prepared, &self.named)?;
                clusters(&self.rivals, &prepared, &point)?
            }
        };
        let each = self.rivals.iter().zip(self.made.iter().zip(&more));
        Ok(each
            .map(|(rival, (made, more))| match rival {
                Some(rival) => {
                    self.distance(rival, &made.iter().chain(more).cloned().collect::<Vec<_>>())
                }
                None => f64::NAN,
            })
            .collect())
    }

    fn distance(&self, rival: &Rival<N>, clusters: &[Cluster]) -> f64 {
        let mut coordinates = self.prepared.session.nuisances();
        coordinates.extend(&rival.coordinates);
        let mut normal = Normal::new(clusters, &priors(&rival.hypothesis, &coordinates));
        regularise(&mut normal.gram, &rival.hypothesis, &coordinates);
        let usable: Vec<usize> = (0..coordinates.len())
            .filter(|&i| normal.gram[(i, i)] > 0.0)
            .collect();
        let bounds = |i: usize| {
            let c = &coordinates[usable[i]];
            let value = rival.hypothesis.get(c.target);
            (c.lower - value, c.upper - value)
        };
        let explained = solve(&normal.gram, &normal.score, &usable, &bounds);
        let left = normal.square - explained.map_or(0.0, |(_, gain)| gain);
        libm::sqrt(left.max(0.0))
    }
}

/// A hypothesis on a study, without the samples at which dry friction of it holds a joint.
fn rested<'a, const N: usize>(
    prepared: &mut PreparedSession<'a, N>,
    hypothesis: &Hypothesis<N>,
) -> Result<LinearizationPoint<'a, N>, GapError> {
    let point = prepared.linearize(hypothesis)?;
    if prepared.leave_out_rest(&point) {
        return prepared.linearize(hypothesis);
    }
    Ok(point)
}

/// For every rival what the named effect shows beyond it on the fit trials of a study, beside the responses to all that may be
/// refitted.
fn clusters<const N: usize>(
    rivals: &[Option<Rival<N>>],
    prepared: &PreparedSession<N>,
    point: &LinearizationPoint<N>,
) -> Result<Vec<Vec<Cluster>>, GapError> {
    rivals
        .iter()
        .map(|rival| {
            let Some(rival) = rival else {
                return Ok(Vec::new());
            };
            let own = prepared.responses_at(point, &rival.hypothesis, &rival.coordinates)?;
            let left = prepared.residuals(point, &rival.hypothesis)?;
            let shown: Vec<Channels> = std::iter::zip(&left, &point.residuals)
                .map(|(a, b)| difference(a, b))
                .collect();
            let columns: Vec<&Response> = own.iter().collect();
            Ok(point.rows.clusters(prepared, &columns, &shown))
        })
        .collect()
}
