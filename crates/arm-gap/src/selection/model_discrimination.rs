//! How well movements that were not made yet would tell two explanations apart.

use arm_core::effect::Effect;
use arm_ident::regression::trial::Trial;

use crate::GapError;
use crate::candidates::candidate::Candidate;
use crate::data::prepared_session::Study;
use crate::data::session::Session;
use crate::measurement_model::hypothesis::{Coordinate, Hypothesis};
use crate::measurement_model::prediction::{Channels, difference};
use crate::selection::fit::{priors, regularise};
use crate::sensitivity::linearization_point::{Anchor, Response};
use crate::sensitivity::normal_equations::{Cluster, Normal, solve};

/// A named effect, and others that would do instead.
pub struct Contest<'a, const N: usize> {
    study: Study<'a, N>,
    /// The session with the named effect.
    named: Hypothesis<N>,
    /// `None` for one that the trials that were made do not show.
    rivals: Vec<Option<Rival<N>>>,
    /// What the trials that were made tell, for every rival.
    made: Vec<Vec<Cluster>>,
}

/// Another effect in the place of the named one.
struct Rival<const N: usize> {
    hypothesis: Hypothesis<N>,
    /// What is free in it.
    coordinates: Vec<Coordinate>,
}

impl<'a, const N: usize> Contest<'a, N> {
    /// Between a named effect and its rivals, on the fit trials of a session.
    ///
    /// * `study` - its session has everything as known effects but the named one
    /// * `rivals` - effects as they fit best, and which of their parameters are free
    ///
    /// # Errors
    /// [`GapError`] where the model cannot be simulated.
    pub fn new(
        mut study: Study<'a, N>,
        named: Effect<f64>,
        rivals: &[(Effect<f64>, Vec<usize>)],
    ) -> Result<Self, GapError> {
        let without = study.session.given();
        let given = study.anchor(&without)?;
        let with = |effect| {
            let mut hypothesis = without.clone();
            hypothesis.named.push(effect);
            hypothesis
        };
        let rivals: Vec<Option<Rival<N>>> = rivals
            .iter()
            .map(|(effect, free)| {
                let candidate = Candidate::again(&study, &given, *effect, free)?;
                Some(Rival {
                    hypothesis: with(*effect),
                    coordinates: candidate.coordinates(without.named.len(), effect),
                })
            })
            .collect();
        let named = with(named);
        let anchor = rested(&mut study, &named)?;
        let made = clusters(&rivals, &study, &anchor)?;
        Ok(Self {
            study,
            named,
            rivals,
            made,
        })
    }

    /// The trials that were made.
    pub fn study(&self) -> &Study<'a, N> {
        &self.study
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
                    ..self.study.session.clone()
                };
                let mut study = Study::with_noise(&session, self.study.noise.of_others(), 1)?;
                let anchor = rested(&mut study, &self.named)?;
                clusters(&self.rivals, &study, &anchor)?
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
        let mut coordinates = self.study.session.nuisances();
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
    study: &mut Study<'a, N>,
    hypothesis: &Hypothesis<N>,
) -> Result<Anchor<'a, N>, GapError> {
    let anchor = study.anchor(hypothesis)?;
    if study.leave_out_rest(&anchor) {
        return study.anchor(hypothesis);
    }
    Ok(anchor)
}

/// For every rival what the named effect shows beyond it on the fit trials of a study, beside the responses to all that may be
/// refitted.
fn clusters<const N: usize>(
    rivals: &[Option<Rival<N>>],
    study: &Study<N>,
    anchor: &Anchor<N>,
) -> Result<Vec<Vec<Cluster>>, GapError> {
    rivals
        .iter()
        .map(|rival| {
            let Some(rival) = rival else {
                return Ok(Vec::new());
            };
            let own = study.responses_at(anchor, &rival.hypothesis, &rival.coordinates)?;
            let left = study.residuals(anchor, &rival.hypothesis)?;
            let shown: Vec<Channels> = std::iter::zip(&left, &anchor.residuals)
                .map(|(a, b)| difference(a, b))
                .collect();
            let columns: Vec<&Response> = own.iter().collect();
            Ok(anchor.rows.clusters(study, &columns, &shown))
        })
        .collect()
}
