//! A hypothesis that was simulated, and everything near it from there: what other hypotheses would show, how the channels
//! answer small changes, and the rows of the nuisances.
//!
//! One trial of each movement is simulated. Repeats follow it along their own handle's path, other hypotheses follow it
//! as changes; both cost a hundredth of a simulation.

use std::sync::{Arc, PoisonError};

use arm_sim::SimulationError;

use crate::GapError;
use crate::data::prepared_session::PreparedSession;
use crate::data::session::ComparisonMode;
use crate::measurement_model::hypothesis::{Coordinate, Hypothesis, Target};
use crate::measurement_model::prediction::{Channels, Course, difference, smooth};
use crate::sensitivity::linear_response::Change;
use crate::sensitivity::linearized_run::{ASTRAY, Linear};
use crate::sensitivity::origin::Origin;
use crate::sensitivity::response::Response;
use crate::sensitivity::rows::Rows;

/// A hypothesis that was simulated.
#[derive(Clone)]
pub struct LinearizationPoint<'a, const N: usize> {
    /// The hypothesis.
    pub hypothesis: Hypothesis<N>,
    /// The runs along which led arms are followed, by group; nothing where torques are compared.
    pub lines: Arc<Vec<Linear<'a, N>>>,
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

impl<const N: usize> LinearizationPoint<'_, N> {
    /// The same with some of the nuisances held where they are.
    pub fn holding(&self, held: impl Fn(Target) -> bool) -> Self {
        let columns: Vec<usize> = (0..self.coordinates.len())
            .filter(|&i| held(self.coordinates[i].target))
            .collect();
        let mut coordinates = self.coordinates.clone();
        coordinates.retain(|c| !held(c.target));
        Self {
            hypothesis: self.hypothesis.clone(),
            lines: Arc::clone(&self.lines),
            shown: self.shown.clone(),
            residuals: self.residuals.clone(),
            coordinates,
            own: self.own.clone(),
            rows: self.rows.without(&columns),
        }
    }
}

impl<'a, const N: usize> PreparedSession<'a, N> {
    /// Simulates a hypothesis, and linearises around it.
    ///
    /// # Errors
    /// [`GapError::Simulation`] names the first trial that it cannot be simulated on.
    pub fn linearize(
        &self,
        hypothesis: &Hypothesis<N>,
    ) -> Result<LinearizationPoint<'a, N>, GapError> {
        let failed = |trial: usize| move |source| GapError::Simulation { trial, source };
        let lines = match self.session.comparison {
            ComparisonMode::Torque => Arc::default(),
            ComparisonMode::Led => self.simulated(hypothesis)?,
        };
        let mut point = LinearizationPoint {
            hypothesis: hypothesis.clone(),
            lines,
            shown: Vec::new(),
            residuals: Vec::new(),
            coordinates: self.nuisances(),
            own: Vec::new(),
            rows: Rows::default(),
        };
        point.shown = self.shown(&point, hypothesis)?;
        let one = |i: usize| {
            let trial = self.fitted[i];
            let course = &self.courses[trial];
            let shown = self.follow(&point, hypothesis, (self.group_of[trial], course));
            Ok(difference(&course.seen, &shown.map_err(failed(trial))?))
        };
        let residuals = self.parallel(self.fitted.len(), one);
        point.residuals = residuals.into_iter().collect::<Result<_, GapError>>()?;
        let mut all = point.coordinates.clone();
        all.extend(self.session.by_trial());
        let mut responses = self.responses_to(&point, &all)?;
        point.own = responses.split_off(point.coordinates.len());
        point.rows = Rows::new(self, &responses, &point.own);
        Ok(point)
    }

    /// The run of a hypothesis on the reference of each group.
    fn simulated(&self, hypothesis: &Hypothesis<N>) -> Result<Arc<Vec<Linear<'a, N>>>, GapError> {
        /// Hypotheses whose runs are kept.
        const KEPT: usize = 6;
        let kept = || {
            self.simulated
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
        };
        let has_rhythms =
            |line: &Linear<N>, trial: usize| line.course.rhythms == self.courses[trial].rhythms;
        let is_same = |(other, lines): &&(Hypothesis<N>, Arc<Vec<Linear<'a, N>>>)| {
            let mut runs = std::iter::zip(lines.iter(), &self.references);
            other == hypothesis && runs.all(|(line, &trial)| has_rhythms(line, trial))
        };
        if let Some((_, lines)) = kept().iter().find(is_same) {
            return Ok(Arc::clone(lines));
        }
        let one = |group: usize| {
            let trial = self.references[group];
            Linear::along(self.session, hypothesis, &self.courses[trial])
                .map_err(|source| GapError::Simulation { trial, source })
        };
        let lines = self.parallel(self.references.len(), one);
        let lines = Arc::new(lines.into_iter().collect::<Result<Vec<_>, _>>()?);
        let mut kept = kept();
        kept.truncate(KEPT - 1);
        kept.insert(0, (hypothesis.clone(), Arc::clone(&lines)));
        Ok(lines)
    }

    /// What the sensors would read on a trial of a group, in the common band.
    fn follow(
        &self,
        point: &LinearizationPoint<N>,
        hypothesis: &Hypothesis<N>,
        (group, course): (usize, &Course<N>),
    ) -> Result<Channels, SimulationError> {
        let raw = self.follow_raw(point, hypothesis, (group, course))?;
        smooth(&raw, course.band, course.rate).map_err(|_| ASTRAY)
    }

    /// The same before the low-pass.
    ///
    /// # Errors
    /// [`SimulationError`] for a hypothesis that is not possible or too far away.
    pub fn follow_raw(
        &self,
        point: &LinearizationPoint<N>,
        hypothesis: &Hypothesis<N>,
        (group, course): (usize, &Course<N>),
    ) -> Result<Channels, SimulationError> {
        match point.lines.get(group) {
            Some(line) => line.play(hypothesis, course),
            None => self.session.torques(hypothesis, course),
        }
    }

    /// What the sensors would read of each group's reference.
    fn shown(
        &self,
        point: &LinearizationPoint<N>,
        hypothesis: &Hypothesis<N>,
    ) -> Result<Vec<Channels>, GapError> {
        let one = |group: usize| {
            let trial = self.references[group];
            self.follow(point, hypothesis, (group, &self.courses[trial]))
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
        point: &LinearizationPoint<N>,
        hypothesis: &Hypothesis<N>,
    ) -> Result<Vec<Channels>, GapError> {
        if *hypothesis == point.hypothesis {
            return Ok(point.residuals.clone());
        }
        let shown = self.shown(point, hypothesis)?;
        let changes: Vec<Channels> = std::iter::zip(&shown, &point.shown)
            .map(|(now, then)| difference(now, then))
            .collect();
        let one = |(residual, &trial)| difference(residual, &changes[self.group_of[trial]]);
        let residuals = std::iter::zip(&point.residuals, &self.fitted).map(one);
        Ok(residuals.collect())
    }

    /// How changes of the anchor's hypothesis change what the channels of each group's reference read, for one unit.
    ///
    /// # Errors
    /// [`GapError::Simulation`] where a change is not possible.
    pub fn responses(
        &self,
        point: &LinearizationPoint<N>,
        changes: &[Change<N>],
    ) -> Result<Vec<Response>, GapError> {
        self.each_response(point, changes).into_iter().collect()
    }

    /// The same, where some of the changes may not be possible.
    pub fn each_response(
        &self,
        point: &LinearizationPoint<N>,
        changes: &[Change<N>],
    ) -> Vec<Result<Response, GapError>> {
        self.each_response_from(point, (&[], &point.shown), changes)
    }

    /// The same for changes of another hypothesis, along the runs of the anchor.
    ///
    /// * `origins`, `base` - that hypothesis beside each run, or nothing for the anchor's own; and where torques are compared, what it shows
    fn each_response_from(
        &self,
        point: &LinearizationPoint<N>,
        (origins, base): (&[Origin<N>], &[Channels]),
        changes: &[Change<N>],
    ) -> Vec<Result<Response, GapError>> {
        let groups = self.references.len();
        let one = |job: usize| {
            let (change, group) = (&changes[job / groups], job % groups);
            let trial = self.references[group];
            let response = match (point.lines.get(group), origins.get(group)) {
                (Some(line), Some(origin)) => line.response_from(origin, change),
                (Some(line), None) => line.response(change),
                (None, _) => self
                    .follow(point, &change.changed, (group, &self.courses[trial]))
                    .map(|shown| slope(&shown, &base[group], change.size)),
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
    /// As [`PreparedSession::responses`].
    pub fn responses_to(
        &self,
        point: &LinearizationPoint<N>,
        coordinates: &[Coordinate],
    ) -> Result<Vec<Response>, GapError> {
        let changes: Vec<_> = coordinates
            .iter()
            .map(|c| self.nudged(&point.hypothesis, c))
            .collect();
        self.responses(point, &changes)
    }

    /// Responses to numbers of a hypothesis away from the anchor.
    ///
    /// # Errors
    /// As [`PreparedSession::residuals`].
    pub fn responses_at(
        &self,
        point: &LinearizationPoint<N>,
        hypothesis: &Hypothesis<N>,
        coordinates: &[Coordinate],
    ) -> Result<Vec<Response>, GapError> {
        if *hypothesis == point.hypothesis || coordinates.is_empty() {
            return self.responses_to(point, coordinates);
        }
        let each = coordinates.iter();
        let changes: Vec<_> = each.map(|c| self.nudged(hypothesis, c)).collect();
        let origin = |group: usize| {
            let (line, trial) = (&point.lines[group], self.references[group]);
            let origin = line.origin(hypothesis);
            origin.map_err(|source| GapError::Simulation { trial, source })
        };
        let origins = self.parallel(point.lines.len(), origin);
        let origins = origins.into_iter().collect::<Result<Vec<_>, _>>()?;
        let base = match point.lines.is_empty() {
            true => self.shown(point, hypothesis)?,
            false => Vec::new(),
        };
        let all = self.each_response_from(point, (&origins, &base), &changes);
        all.into_iter().collect()
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
    /// As [`PreparedSession::residuals`].
    pub fn raw_residuals(&self, point: &LinearizationPoint<N>) -> Result<Vec<Channels>, GapError> {
        let one = |i: usize| {
            let trial = self.fitted[i];
            let course: &Arc<Course<N>> = &self.courses[trial];
            let place = (self.group_of[trial], course.as_ref());
            let shown = self.follow_raw(point, &point.hypothesis, place);
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
