//! Rows along a simulated motion as instruments for measured angles.

use crate::regression::equation::{Building, Sample, effect_value, value_of};
use crate::regression::internal_state::InternalStates;
use crate::regression::kinematics::Kinematics;
use crate::regression::rows::RegressionRows;
use crate::regression::sensitivity::{Course, HELD, Responses};
use crate::regression::trial::{Model, Trial};
use crate::regression::unknown::{Imperfection, Source, Unknown};
use arm_core::effect::resisting_torque;
use arm_core::{inverse_dynamics, static_torque};

/// Puts rows built along a simulated motion in the place of those along measured angles, without the noise of the latter.
///
/// Angles with noise must not stand in columns: a wrist that hangs between forearm and handle moves little more than its
/// noise, and a spring read off such angles comes out too soft, with everything that hangs on it. The columns Z stay those of the
/// simulated motion, with what each unknown changes of it; the right-hand side becomes `τ − Y(q) x + Z x` with the measured angles q and
/// the model's own values x. The fit stands still where `Zᵀ (τ − Y(q) x) = 0`: Z are instruments, and the residual is that of the measured angles.
///
/// A delay of the force channels, as it was last estimated, shifts the force of the simulated motion. Its first order alone would not do:
/// of a force that swings five times a second, ten milliseconds take 5 % in the second order, which a fit buys with gains and masses.
pub(crate) struct Instrument<'a, const N: usize> {
    pub(crate) building: Building<'a, N>,
    pub(crate) course: &'a Course<N>,
    /// Of the force channels \[s\].
    pub(crate) delay: f64,
    pub(crate) responses: Option<Responses<'a, N>>,
    pub(crate) memory: InternalStates<N>,
}

impl<'a, const N: usize> Instrument<'a, N> {
    /// From the first sample on.
    ///
    /// * `motion` - `course` at the samples of the trial
    /// * `delay` - of the force channels \[s\]
    pub fn new(
        (model, unknowns): (&'a Model<N>, &'a [Unknown]),
        trial: &'a Trial<N>,
        (course, motion): (&'a Course<N>, &'a Kinematics<N>),
        delay: f64,
    ) -> Self {
        Self {
            building: Building::new((model, unknowns), trial, motion),
            course,
            delay,
            responses: (N > HELD).then(|| course.responses(model, unknowns)),
            memory: InternalStates::new(model),
        }
    }

    /// The rows of the next samples.
    pub fn next(&mut self, count: usize) -> RegressionRows {
        let mut rows = self.building.next(count);
        let Building {
            model,
            unknowns,
            trial,
            motion,
            ..
        } = self.building;
        if let Some(responses) = &mut self.responses {
            for (column, more) in rows.columns.iter_mut().zip(responses.next(count)) {
                for (value, more) in column.iter_mut().zip(more) {
                    *value += more;
                }
            }
        }
        for (left, &i) in rows.rhs.chunks_exact_mut(N).zip(&rows.samples) {
            let (qd, qdd) = (&motion.qd[i], &motion.qdd[i]);
            let at = Sample::new(&model.chain, trial, (&trial.q[i], qd, qdd), i);
            self.memory.advance(&at.motion, 1.0 / trial.rate);
            let delayed = self.course.change_by_delay(self.delay, i);
            let rest = at.measured
                - static_torque(&model.chain, &at.pose, delayed, 0.0)
                - inverse_dynamics(&model.chain, &at.pose, qd, qdd)
                - resisting_torque(&model.fitted, &at.motion, &self.memory.fitted)
                - resisting_torque(&model.held, &at.motion, &self.memory.held);
            left.copy_from_slice(rest.as_slice());
        }
        self.building.take_held(&mut rows);
        for (unknown, column) in unknowns.iter().zip(&rows.columns) {
            let value = match unknown.source {
                Source::Segment(k, moment) => value_of(&model.chain, k, moment),
                Source::Effect(..) | Source::RestTorque(..) => effect_value(model, unknown.source),
                Source::Calibration(Imperfection::TimeDelay) => self.delay,
                Source::Calibration(_) => continue,
            };
            for (rest, column) in rows.rhs.iter_mut().zip(column) {
                *rest += column * value;
            }
        }
        rows
    }
}
