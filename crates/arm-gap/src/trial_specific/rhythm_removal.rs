//! Removal of a rhythm: subtracted from the measured channels, or added to the runs that are compared with them.

use std::sync::Arc;

use arm_core::effect::Nature;

use crate::GapError;
use crate::data::course::{Course, smooth};
use crate::linearization::linear_response::Change;
use crate::prepared_session::PreparedSession;
use crate::sensitivity::linearization_point::LinearizationPoint;
use crate::trial_specific::component::TrialSpecific;
use crate::trial_specific::tremor_detection::{UNIT, common_swing, small};

impl<const N: usize> PreparedSession<'_, N> {
    /// Takes a rhythm out of what the measured channels and the runs differ by, so that it does not disturb what is fitted.
    ///
    /// It is taken out of the channels; where joints rub it is put into the runs instead. Dry friction resists in a joint that is shaken as
    /// a viscous one does, and what a movement shows is not what it would show without the rhythm.
    ///
    /// # Errors
    /// [`GapError::Numerics`] for channels that the filter refuses.
    pub fn take_out(
        &mut self,
        point: &LinearizationPoint<N>,
        trial_specific: &TrialSpecific,
    ) -> Result<(), GapError> {
        let is_of_muscles = trial_specific.effect.kind.prior().nature == Nature::Rhythm;
        if is_of_muscles && point.hypothesis.has_dry_friction() {
            let measured = self.courses.clone();
            if let Ok(true) = self.put_into_runs(point, trial_specific) {
                return Ok(());
            }
            self.courses = measured;
        }
        self.subtract(point, trial_specific, &trial_specific.sizes)
    }

    /// Has a rhythm in the run of every trial, with its size and phase there, and takes out of the channels what that does not show of it.
    /// Whether that can be simulated and compared.
    fn put_into_runs(
        &mut self,
        point: &LinearizationPoint<N>,
        trial_specific: &TrialSpecific,
    ) -> Result<bool, GapError> {
        let Some(sized) = self.sized(point, trial_specific) else {
            return Ok(false);
        };
        let (frequency, columns) = (sized.wave()[0], &sized.columns);
        for (sizes, &trial) in std::iter::zip(&sized.sizes, &self.fitted) {
            let (own, _) = common_swing(columns, std::slice::from_ref(sizes), frequency);
            Arc::make_mut(&mut self.courses[trial]).rhythms.push(own);
        }
        let there = self.linearize(&point.hypothesis)?;
        let residuals = self.raw_residuals(&there)?;
        let answers = self.answers(&there, frequency, columns);
        let Some(left) = self.explain(&residuals, frequency, (columns, &answers)) else {
            return Ok(false);
        };
        self.subtract(&there, trial_specific, &left.sizes)?;
        Ok(true)
    }

    /// Takes swings of given sizes out of the measured channels.
    fn subtract(
        &mut self,
        point: &LinearizationPoint<N>,
        trial_specific: &TrialSpecific,
        sizes: &[Vec<f64>],
    ) -> Result<(), GapError> {
        for (sizes, &trial) in std::iter::zip(sizes, &self.fitted.clone()) {
            let Some(line) = point.lines.get(self.group_of[trial]) else {
                continue;
            };
            let mut course = Course::clone(&self.courses[trial]);
            for (k, column) in trial_specific.columns.iter().enumerate() {
                for quarter in [false, true] {
                    let size = sizes[2 * k + usize::from(quarter)];
                    let mut changed = point.hypothesis.clone();
                    changed
                        .named
                        .push(small(column, trial_specific.wave()[0], quarter));
                    let Ok(swing) = line.response_raw(&Change::of(changed, UNIT)) else {
                        continue;
                    };
                    for (channel, swing) in course.raw.iter_mut().zip(&swing) {
                        for (value, swing) in channel.iter_mut().zip(swing) {
                            *value -= size * swing;
                        }
                    }
                }
            }
            course.seen = smooth(&course.raw, course.band, course.rate)?;
            self.courses[trial] = Arc::new(course);
        }
        Ok(())
    }
}
