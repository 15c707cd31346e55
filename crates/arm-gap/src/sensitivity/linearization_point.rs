//! A hypothesis that was simulated, and everything near it from there: what other hypotheses would show, how the channels
//! answer small changes, and the rows of the nuisances.
//!
//! One trial of each movement is simulated. Repeats follow it along their own handle's path, other hypotheses follow it
//! as changes; both cost a hundredth of a simulation.

use std::sync::Arc;

use arm_sim::SimulationError;

use crate::GapError;
use crate::data::prepared_session::Study;
use crate::data::session::Sight;
use crate::measurement_model::hypothesis::{Coordinate, Hypothesis, Target};
use crate::measurement_model::prediction::{Channels, Course, difference, smooth};
use crate::sensitivity::linearized_run::{ASTRAY, Linear};
use crate::sensitivity::rows::Rows;

/// Response of the channels to one unit of a number, by group.
#[derive(Clone, Debug)]
pub struct Response(pub Vec<Channels>);

/// A change of a hypothesis whose response is asked.
#[derive(Clone, Debug)]
pub struct Change<const N: usize> {
    /// The hypothesis with the change made.
    pub changed: Hypothesis<N>,
    /// Its size.
    pub size: f64,
    /// Whether it reaches the sensors alone.
    pub sensing: bool,
    /// Whether it moves the handle's path.
    pub moves_handle: bool,
}

/// A hypothesis that was simulated.
pub struct Anchor<'a, const N: usize> {
    /// The hypothesis.
    pub hypothesis: Hypothesis<N>,
    /// The runs along which led arms are followed, by group; nothing where torques are compared.
    pub lines: Vec<Linear<'a, N>>,
    /// What the sensors would read of each group's reference, in the common band.
    shown: Vec<Channels>,
    /// Measured less predicted channels of the fitted trials.
    pub residuals: Vec<Channels>,
    /// The nuisances.
    pub coordinates: Vec<Coordinate>,
    /// Responses to what differs from trial to trial.
    pub own: Vec<Response>,
    /// Rows of the nuisances.
    pub rows: Rows,
}

impl<'a, const N: usize> Study<'a, N> {
    /// Simulates a hypothesis, and linearises around it.
    ///
    /// # Errors
    /// [`GapError::Simulation`] names the first trial that it cannot be simulated on.
    pub fn anchor(&self, hypothesis: &Hypothesis<N>) -> Result<Anchor<'a, N>, GapError> {
        let failed = |trial: usize| move |source| GapError::Simulation { trial, source };
        let lines = match self.session.sight {
            Sight::Torque => Vec::new(),
            Sight::Led => {
                let one = |group: usize| {
                    let trial = self.references[group];
                    Linear::along(self.session, hypothesis, &self.courses[trial])
                        .map_err(failed(trial))
                };
                let lines = self.parallel(self.references.len(), one);
                lines.into_iter().collect::<Result<Vec<_>, _>>()?
            }
        };
        let mut anchor = Anchor {
            hypothesis: hypothesis.clone(),
            lines,
            shown: Vec::new(),
            residuals: Vec::new(),
            coordinates: self.session.nuisances(),
            own: Vec::new(),
            rows: Rows::default(),
        };
        anchor.shown = self.shown(&anchor, hypothesis)?;
        let one = |i: usize| {
            let trial = self.fitted[i];
            let course = &self.courses[trial];
            let shown = self.follow(&anchor, hypothesis, (self.group_of[trial], course));
            Ok(difference(&course.seen, &shown.map_err(failed(trial))?))
        };
        let residuals = self.parallel(self.fitted.len(), one);
        anchor.residuals = residuals.into_iter().collect::<Result<_, GapError>>()?;
        let mut all = anchor.coordinates.clone();
        all.extend(self.session.by_trial());
        let mut responses = self.responses_to(&anchor, &all)?;
        anchor.own = responses.split_off(anchor.coordinates.len());
        anchor.rows = Rows::new(self, &responses, &anchor.own);
        Ok(anchor)
    }

    /// What the sensors would read on a trial of a group, in the common band.
    fn follow(
        &self,
        anchor: &Anchor<N>,
        hypothesis: &Hypothesis<N>,
        (group, course): (usize, &Course<N>),
    ) -> Result<Channels, SimulationError> {
        let raw = self.follow_raw(anchor, hypothesis, (group, course))?;
        smooth(&raw, course.band, course.rate).map_err(|_| ASTRAY)
    }

    /// The same before the low-pass.
    ///
    /// # Errors
    /// [`SimulationError`] for a hypothesis that is not possible or too far away.
    pub fn follow_raw(
        &self,
        anchor: &Anchor<N>,
        hypothesis: &Hypothesis<N>,
        (group, course): (usize, &Course<N>),
    ) -> Result<Channels, SimulationError> {
        match anchor.lines.get(group) {
            Some(line) => line.play(hypothesis, course),
            None => self.session.torques(hypothesis, course),
        }
    }

    /// What the sensors would read of each group's reference.
    fn shown(
        &self,
        anchor: &Anchor<N>,
        hypothesis: &Hypothesis<N>,
    ) -> Result<Vec<Channels>, GapError> {
        let one = |group: usize| {
            let trial = self.references[group];
            self.follow(anchor, hypothesis, (group, &self.courses[trial]))
                .map_err(|source| GapError::Simulation { trial, source })
        };
        let all = self.parallel(self.references.len(), one);
        all.into_iter().collect()
    }

    /// Measured less predicted channels of the fitted trials under a hypothesis near the anchor.
    ///
    /// # Errors
    /// [`GapError::Simulation`] names the first trial on which it cannot be followed.
    pub fn residuals(
        &self,
        anchor: &Anchor<N>,
        hypothesis: &Hypothesis<N>,
    ) -> Result<Vec<Channels>, GapError> {
        if *hypothesis == anchor.hypothesis {
            return Ok(anchor.residuals.clone());
        }
        let shown = self.shown(anchor, hypothesis)?;
        let changes: Vec<Channels> = std::iter::zip(&shown, &anchor.shown)
            .map(|(now, then)| difference(now, then))
            .collect();
        let one = |(residual, &trial)| difference(residual, &changes[self.group_of[trial]]);
        Ok(std::iter::zip(&anchor.residuals, &self.fitted)
            .map(one)
            .collect())
    }

    /// How changes of the anchor's hypothesis change what the channels of each group's reference read, for one unit.
    ///
    /// # Errors
    /// [`GapError::Simulation`] where a change is not possible.
    pub fn responses(
        &self,
        anchor: &Anchor<N>,
        changes: &[Change<N>],
    ) -> Result<Vec<Response>, GapError> {
        self.each_response(anchor, changes).into_iter().collect()
    }

    /// The same, where some of the changes may not be possible.
    pub fn each_response(
        &self,
        anchor: &Anchor<N>,
        changes: &[Change<N>],
    ) -> Vec<Result<Response, GapError>> {
        let groups = self.references.len();
        let one = |job: usize| {
            let (change, group) = (&changes[job / groups], job % groups);
            let trial = self.references[group];
            let response = match anchor.lines.get(group) {
                Some(line) => {
                    let reach = (change.sensing, change.moves_handle);
                    line.response(&change.changed, change.size, reach)
                }
                None => self
                    .follow(anchor, &change.changed, (group, &self.courses[trial]))
                    .map(|shown| slope(&shown, &anchor.shown[group], change.size)),
            };
            response.map_err(|source| GapError::Simulation { trial, source })
        };
        let mut all = self.parallel(changes.len() * groups, one).into_iter();
        changes
            .iter()
            .map(|_| {
                // All of a change are taken, so that the next one meets its own.
                let own: Vec<_> = all.by_ref().take(groups).collect();
                Ok(Response(own.into_iter().collect::<Result<_, _>>()?))
            })
            .collect()
    }

    /// Responses to numbers of the anchor's hypothesis.
    ///
    /// # Errors
    /// As [`Study::responses`].
    pub fn responses_to(
        &self,
        anchor: &Anchor<N>,
        coordinates: &[Coordinate],
    ) -> Result<Vec<Response>, GapError> {
        let changes: Vec<_> = coordinates
            .iter()
            .map(|c| self.nudged(&anchor.hypothesis, c))
            .collect();
        self.responses(anchor, &changes)
    }

    /// Responses to numbers of a hypothesis away from the anchor.
    ///
    /// # Errors
    /// As [`Study::residuals`].
    pub fn responses_at(
        &self,
        anchor: &Anchor<N>,
        hypothesis: &Hypothesis<N>,
        coordinates: &[Coordinate],
    ) -> Result<Vec<Response>, GapError> {
        if *hypothesis == anchor.hypothesis || coordinates.is_empty() {
            return self.responses_to(anchor, coordinates);
        }
        let base = self.shown(anchor, hypothesis)?;
        let one = |c: &Coordinate| {
            let change = self.nudged(hypothesis, c);
            let shown = self.shown(anchor, &change.changed)?;
            let each = std::iter::zip(&shown, &base).map(|(a, b)| slope(a, b, change.size));
            Ok(Response(each.collect()))
        };
        coordinates.iter().map(one).collect()
    }

    /// A hypothesis with one number changed a little.
    pub(crate) fn nudged(&self, hypothesis: &Hypothesis<N>, c: &Coordinate) -> Change<N> {
        let value = hypothesis.get(c.target);
        let step = if value + c.step > c.upper {
            -c.step
        } else {
            c.step
        };
        Change {
            changed: hypothesis.clone().with(c.target, value + step),
            size: step,
            sensing: self.session.is_sensing(hypothesis, c.target),
            moves_handle: matches!(c.target, Target::Shift(_)),
        }
    }

    /// Measured less predicted channels of the fitted trials under the anchor's hypothesis, before the low-pass.
    ///
    /// # Errors
    /// As [`Study::residuals`].
    pub fn raw_residuals(&self, anchor: &Anchor<N>) -> Result<Vec<Channels>, GapError> {
        let one = |i: usize| {
            let trial = self.fitted[i];
            let course: &Arc<Course<N>> = &self.courses[trial];
            let place = (self.group_of[trial], course.as_ref());
            let shown = self.follow_raw(anchor, &anchor.hypothesis, place);
            let shown = shown.map_err(|source| GapError::Simulation { trial, source })?;
            Ok(difference(&course.raw, &shown))
        };
        let all = self.parallel(self.fitted.len(), one);
        all.into_iter().collect()
    }
}

/// The difference of channels for one unit of a change.
pub(crate) fn slope(up: &Channels, base: &Channels, size: f64) -> Channels {
    let mut out = difference(up, base);
    for value in out.iter_mut().flatten() {
        *value /= size;
    }
    out
}
