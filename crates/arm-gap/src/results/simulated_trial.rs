//! Trials, measured and simulated with each version of the model.

use std::sync::Arc;

use arm_ident::regression::trial::Role;

use super::{SearchInput, root_mean_square};
use crate::data::course::{Channels, Course};
use crate::data::session::Session;
use crate::hypothesis::Hypothesis;
use crate::prepared_session::PreparedSession;

/// A model that is compared with the data.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Version {
    /// The model as given.
    Given,
    /// After refitting what was never exact.
    Calibrated,
    /// With the named effects.
    Amended,
}

impl Version {
    /// All of them, in the order of the workflow.
    pub const ALL: [Self; 3] = [Self::Given, Self::Calibrated, Self::Amended];

    /// Its name.
    pub fn name(self) -> &'static str {
        ["given", "calibrated", "amended"][self as usize]
    }

    /// The version of a name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|v| v.name() == name)
    }
}

/// One trial: what was measured, and what models show of it.
#[derive(Clone, Debug, PartialEq)]
pub struct SimulatedTrial {
    /// Name of its file.
    pub file: String,
    /// The movement; repeats share it.
    pub group: usize,
    /// Whether it is a test trial.
    pub test: bool,
    /// Sampling rate \[Hz\].
    pub rate: f64,
    /// Samples over which gap and scatter of repeats of each channel are measured, `[channel][sample]`: not those that a disturbance affects,
    /// nor a joint's torque while friction holds it in a measured motion.
    pub counted: Vec<Vec<bool>>,
    /// Measured channels.
    pub measured: Channels,
    /// Channels by version; `None` where the trial cannot be simulated.
    pub shown: [Option<Channels>; 3],
    /// Measured less simulated angles \[rad\] of a free run from the state that explains the first second best, by version and joint; none of
    /// a led arm.
    pub free: [Option<Channels>; 3],
}

impl SimulatedTrial {
    /// A trial of a session before anything is simulated.
    ///
    /// * `trial` - its number and its file
    pub fn measured<const N: usize>(
        session: &Session<N>,
        (number, file): (usize, &str),
        course: &Course<N>,
    ) -> Self {
        let trial = &session.trials[number];
        Self {
            file: file.to_owned(),
            group: trial.configuration,
            test: trial.role == Role::Test,
            rate: course.rate,
            counted: vec![course.counted.clone(); session.channels()],
            measured: session.measured_in(course),
            shown: [const { None }; 3],
            free: [const { None }; 3],
        }
    }

    /// Every trial of a session with what the model as given and other hypotheses, as they are in each trial, show of it.
    pub(super) fn played<const N: usize>(
        prepared: &PreparedSession<'_, N>,
        input: &SearchInput<'_>,
        plays: &[(Version, &[Hypothesis<N>])],
    ) -> Vec<Self> {
        let session = prepared.session;
        // Without the passive base.
        let mut given = session.given();
        given.known.truncate(session.effects.len());
        let one = |i: usize| {
            let course = prepared.courses[i].as_ref();
            let mut trial = Self::measured(session, (i, &input.trials[i].file), course);
            trial.group = prepared.group_of[i];
            let left_out = |k: usize| prepared.is_left_out(i, k as f64 / course.rate);
            let left_out: Vec<bool> = (0..course.counted.len()).map(left_out).collect();
            for counted in &mut trial.counted {
                std::iter::zip(counted, &left_out).for_each(|(counted, out)| *counted &= !out);
            }
            for (joint, counted) in trial.counted.iter_mut().enumerate() {
                *counted = course.in_motion(joint, std::mem::take(counted));
            }
            let own = plays
                .iter()
                .map(|(version, beliefs)| (*version, &beliefs[i]));
            for (version, hypothesis) in std::iter::once((Version::Given, &given)).chain(own) {
                trial.shown[version as usize] = session.shown_in(hypothesis, course).ok();
                trial.free[version as usize] = free(session, hypothesis, (i, course));
            }
            trial
        };
        prepared.parallel(prepared.courses.len(), one)
    }

    /// What a version shows.
    pub fn version(&self, version: Version) -> Option<&Channels> {
        self.shown[version as usize].as_ref()
    }

    /// Simulated less measured of one channel, at the samples that count.
    fn differences(&self, version: Version, channel: usize) -> Option<Vec<f64>> {
        let shown = &self.version(version)?[channel];
        let all = shown
            .iter()
            .zip(&self.measured[channel])
            .zip(&self.counted[channel]);
        Some(
            all.filter(|(_, counted)| **counted)
                .map(|((shown, measured), _)| shown - measured)
                .collect(),
        )
    }
}

/// Root mean square of simulated less measured of one channel over trials; `None` where nothing could be simulated.
pub(super) fn size<'t>(
    trials: impl Iterator<Item = &'t SimulatedTrial>,
    version: Version,
    channel: usize,
) -> Option<f64> {
    let each = trials.filter_map(|t| t.differences(version, channel));
    root_mean_square(&each.flatten().collect::<Vec<_>>())
}

/// The same of the angles of free runs.
pub(super) fn free_size<'t>(
    trials: impl Iterator<Item = &'t SimulatedTrial>,
    version: Version,
    joint: usize,
) -> Option<f64> {
    let each = trials.filter_map(|t| t.free[version as usize].as_ref()?.get(joint));
    let known: Vec<f64> = each.flatten().copied().filter(|v| v.is_finite()).collect();
    root_mean_square(&known)
}

/// Root mean square of simulated less measured by channel, over the trials that a version can be simulated on.
pub fn sizes(trials: &[Arc<SimulatedTrial>], version: Version) -> Vec<Option<f64>> {
    let channels = trials.first().map_or(0, |t| t.measured.len());
    let one = |channel| size(trials.iter().map(AsRef::as_ref), version, channel);
    (0..channels).map(one).collect()
}

/// Simulated less measured angles of a free run, where they were measured; none of a led arm.
fn free<const N: usize>(
    session: &Session<N>,
    hypothesis: &Hypothesis<N>,
    (i, course): (usize, &Course<N>),
) -> Option<Channels> {
    let mut angles = session.free_run(hypothesis, (i, course)).ok()?;
    let trial = &session.trials[i];
    for (j, column) in angles.iter_mut().enumerate() {
        let measured = trial.q.iter().zip(&trial.valid);
        for (angle, (q, valid)) in column.iter_mut().zip(measured) {
            *angle = if *valid { *angle - q[j] } else { f64::NAN };
        }
    }
    (!angles.is_empty()).then_some(angles)
}
