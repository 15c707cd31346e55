//! A simulated hypothesis, linearised: readings under other hypotheses, responses to small changes, rows of the nuisances.
//!
//! One trial of each movement is simulated. Repeats follow it along their own handle's path, other hypotheses follow it
//! as changes; both cost a hundredth of a simulation.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use arm_sim::SimulationError;

use crate::GapError;
use crate::data::course::{Channels, Course, difference, divided, smooth};
use crate::data::session::ComparisonMode;
use crate::hypothesis::{Coordinate, Hypothesis, Target};
use crate::linearization::linear_response::{Change, Response};
use crate::linearization::linearized_run::{ASTRAY, Linear};
use crate::linearization::linearized_torques::LinearizedTorques;
use crate::linearization::origin::Origin;
use crate::prepared_session::{PreparedSession, SimulatedRuns};
use crate::sensitivity::rows::WhitenedRows;

/// A hypothesis that was simulated.
#[derive(Clone)]
pub struct LinearizationPoint<'a, const N: usize> {
    /// The hypothesis.
    pub hypothesis: Hypothesis<N>,
    /// The runs along which led arms are followed, by group; nothing where torques are compared.
    pub lines: Arc<Vec<Linear<'a, N>>>,
    /// Results from these runs; nothing where torques are compared.
    runs: Option<Arc<SimulatedRuns<'a, N>>>,
    /// What the sensors would read of each group's reference, in the common band.
    shown: Vec<Channels>,
    /// Measured less predicted channels of the fitted trials.
    pub residuals: Vec<Channels>,
    /// The nuisances.
    pub coordinates: Vec<Coordinate>,
    /// Responses to what differs from trial to trial.
    pub own: Vec<Response>,
    /// Whitened rows of the nuisances.
    pub rows: WhitenedRows,
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
            runs: self.runs.clone(),
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
        self.linearized_for(hypothesis, self.nuisances())
    }

    /// The same without rows of the nuisances, which the cost of the hypothesis itself, the noise and the samples at rest do not need.
    ///
    /// # Errors
    /// As [`PreparedSession::linearize`].
    pub(crate) fn simulate_alone(
        &self,
        hypothesis: &Hypothesis<N>,
    ) -> Result<LinearizationPoint<'a, N>, GapError> {
        let alone = self.linearized_for(hypothesis, Vec::new())?;
        Ok(LinearizationPoint {
            coordinates: self.nuisances(),
            ..alone
        })
    }

    fn linearized_for(
        &self,
        hypothesis: &Hypothesis<N>,
        coordinates: Vec<Coordinate>,
    ) -> Result<LinearizationPoint<'a, N>, GapError> {
        let runs = match self.session.comparison {
            ComparisonMode::Torque => None,
            ComparisonMode::Led => Some(self.simulated(hypothesis)?),
        };
        let lines = runs.as_ref().map(|runs| Arc::clone(&runs.lines));
        let mut point = LinearizationPoint {
            hypothesis: hypothesis.clone(),
            lines: lines.unwrap_or_default(),
            runs,
            shown: Vec::new(),
            residuals: Vec::new(),
            coordinates,
            own: Vec::new(),
            rows: WhitenedRows::default(),
        };
        point.shown = self.shown_on(&point, &self.references)?;
        let shown = self.shown_on(&point, &self.fitted)?;
        let residual =
            |(&trial, shown): (&usize, &Channels)| difference(&self.courses[trial].seen, shown);
        point.residuals = std::iter::zip(&self.fitted, &shown).map(residual).collect();
        let mut all = point.coordinates.clone();
        all.extend(self.session.by_trial());
        let mut responses = self.responses_to(&point, &all)?;
        point.own = responses.split_off(point.coordinates.len());
        point.rows = WhitenedRows::new(self, &responses, &point.own);
        Ok(point)
    }

    /// What the sensors would read on trials under the linearization point's hypothesis, in the common band.
    fn shown_on(
        &self,
        point: &LinearizationPoint<N>,
        trials: &[usize],
    ) -> Result<Vec<Channels>, GapError> {
        let one = |i: usize| {
            let (trial, course) = (trials[i], &self.courses[trials[i]]);
            let known = point.runs.as_ref().map(|runs| locked(&runs.shown));
            let is_it = |other: &&(Arc<Course<N>>, Channels)| Arc::ptr_eq(&other.0, course);
            if let Some((_, shown)) = known.iter().flat_map(|all| all.iter()).find(is_it) {
                return Ok(shown.clone());
            }
            drop(known);
            let shown = self
                .follow(point, &point.hypothesis, (self.group_of[trial], course))
                .map_err(|source| GapError::Simulation { trial, source })?;
            if let Some(runs) = &point.runs {
                locked(&runs.shown).push((Arc::clone(course), shown.clone()));
            }
            Ok(shown)
        };
        let all = self.parallel(trials.len(), one);
        all.into_iter().collect()
    }

    /// The run of a hypothesis on the reference of each group.
    fn simulated(&self, hypothesis: &Hypothesis<N>) -> Result<Arc<SimulatedRuns<'a, N>>, GapError> {
        /// Hypotheses whose runs are kept.
        const MOST_RUNS: usize = 6;
        let has_rhythms =
            |line: &Linear<N>, trial: usize| line.course.rhythms == self.courses[trial].rhythms;
        let is_same = |other: &&Arc<SimulatedRuns<'a, N>>| {
            let mut lines = std::iter::zip(other.lines.iter(), &self.references);
            other.hypothesis == *hypothesis && lines.all(|(line, &trial)| has_rhythms(line, trial))
        };
        if let Some(known) = locked(&self.simulated).iter().find(is_same) {
            return Ok(Arc::clone(known));
        }
        let one = |group: usize| {
            let trial = self.references[group];
            Linear::along(self.session, hypothesis, &self.courses[trial])
                .map_err(|source| GapError::Simulation { trial, source })
        };
        let lines = self.parallel(self.references.len(), one);
        let lines = lines.into_iter().collect::<Result<Vec<_>, _>>()?;
        let fresh = Arc::new(SimulatedRuns {
            hypothesis: hypothesis.clone(),
            lines: Arc::new(lines),
            shown: Mutex::default(),
            responses: Mutex::default(),
        });
        let mut kept = locked(&self.simulated);
        kept.truncate(MOST_RUNS - 1);
        kept.insert(0, Arc::clone(&fresh));
        Ok(fresh)
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

    /// Measured less predicted channels of the fitted trials under a hypothesis near the linearization point.
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

    /// How changes of the linearization point's hypothesis change what the channels of each group's reference read, for one unit.
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
        self.each_response_from(point, (&point.hypothesis, &[]), changes)
    }

    /// The same for changes of another hypothesis, along the runs of the linearization point.
    ///
    /// * `origins` - that hypothesis along each run; empty for the hypothesis of the point itself, and if torques are compared
    fn each_response_from(
        &self,
        point: &LinearizationPoint<N>,
        (hypothesis, origins): (&Hypothesis<N>, &[Origin<N>]),
        changes: &[Change<N>],
    ) -> Vec<Result<Response, GapError>> {
        let groups = self.references.len();
        let torques = match self.session.comparison {
            ComparisonMode::Led => Vec::new(),
            ComparisonMode::Torque => self.parallel(groups, |group| {
                let course = &self.courses[self.references[group]];
                LinearizedTorques::of(self.session, hypothesis, course)
            }),
        };
        let one = |job: usize| {
            let (change, group) = (&changes[job / groups], job % groups);
            let trial = self.references[group];
            let response = match (point.lines.get(group), origins.get(group)) {
                (Some(line), Some(origin)) => line.response_from(origin, change),
                (Some(line), None) => line.response(change),
                (None, _) => match &torques[group] {
                    Ok(beside) => beside.response(change),
                    Err(error) => Err(error.clone()),
                },
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

    /// Responses to numbers of the linearization point's hypothesis.
    ///
    /// # Errors
    /// As [`PreparedSession::responses`].
    pub fn responses_to(
        &self,
        point: &LinearizationPoint<N>,
        coordinates: &[Coordinate],
    ) -> Result<Vec<Response>, GapError> {
        let told = |coordinates: &[Coordinate]| {
            let each = coordinates.iter();
            let changes: Vec<_> = each.map(|c| self.nudged(&point.hypothesis, c)).collect();
            self.responses(point, &changes)
        };
        let Some(runs) = &point.runs else {
            return told(coordinates);
        };
        let mut missing = coordinates.to_vec();
        let is_known = |c: &Coordinate| locked(&runs.responses).iter().any(|(k, _)| k == c);
        missing.retain(|c| !is_known(c));
        let fresh = told(&missing)?;
        let mut known = locked(&runs.responses);
        known.extend(std::iter::zip(missing, fresh));
        let of = |c: &Coordinate| known.iter().find(|(k, _)| k == c).map(|(_, r)| r.clone());
        Ok(coordinates.iter().filter_map(of).collect())
    }

    /// Responses to numbers of a hypothesis away from the linearization point.
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
        let all = self.each_response_from(point, (hypothesis, &origins), &changes);
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

    /// Measured less predicted channels of the fitted trials under the linearization point's hypothesis, before the low-pass.
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

fn locked<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The difference of channels for one unit of a change.
pub(crate) fn slope(up: &Channels, base: &Channels, size: f64) -> Channels {
    divided(difference(up, base), size)
}
