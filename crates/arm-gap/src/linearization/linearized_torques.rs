//! Responses of the joint torques of a measured motion to small changes of a hypothesis.

use arm_sim::SimulationError;

use crate::data::course::{Channels, Course, difference, divided, smooth};
use crate::data::session::Session;
use crate::hypothesis::Hypothesis;
use crate::linearization::linear_response::Change;
use crate::linearization::linearized_run::ASTRAY;
use crate::measurement_model::joint_torques::RigTorques;

/// The joint torques of a hypothesis on one trial, the reference for responses to changes.
pub(crate) struct LinearizedTorques<'a, const N: usize> {
    session: &'a Session<N>,
    course: &'a Course<N>,
    hypothesis: Hypothesis<N>,
    /// `None` where no motion was measured.
    rig: Option<RigTorques<N>>,
    /// The torques of the hypothesis before the low-pass.
    shown: Channels,
}

impl<'a, const N: usize> LinearizedTorques<'a, N> {
    /// Computes the torques of a hypothesis on a trial.
    ///
    /// # Errors
    /// As [`Session::torques`].
    pub fn of(
        session: &'a Session<N>,
        hypothesis: &Hypothesis<N>,
        course: &'a Course<N>,
    ) -> Result<Self, SimulationError> {
        let rig = session.rig_torques(hypothesis, course)?;
        let shown = rig.as_ref().map(|rig| rig.with(&hypothesis.effects()));
        Ok(Self {
            session,
            course,
            hypothesis: hypothesis.clone(),
            rig,
            shown: shown.unwrap_or_default(),
        })
    }

    /// The channels of the hypothesis, in the common band.
    ///
    /// # Errors
    /// [`SimulationError`] for a channel that is not finite.
    pub fn shown(&self) -> Result<Channels, SimulationError> {
        self.in_band(&self.shown)
    }

    /// Response of the channels to one unit of a change. If only effects in joints change, the inverse dynamics is not computed again.
    ///
    /// # Errors
    /// As [`Session::torques`].
    pub fn response(&self, change: &Change<N>) -> Result<Channels, SimulationError> {
        let Some(rig) = &self.rig else {
            return Ok(Vec::new());
        };
        let in_joints = rig.difference(self.session, &self.hypothesis, &change.changed)?;
        let out = match in_joints {
            Some(more) => more,
            None => {
                let changed = self.session.torques(&change.changed, self.course)?;
                difference(&changed, &self.shown)
            }
        };
        self.in_band(&divided(out, change.size))
    }

    fn in_band(&self, channels: &Channels) -> Result<Channels, SimulationError> {
        smooth(channels, self.course.band, self.course.rate).map_err(|_| ASTRAY)
    }
}
