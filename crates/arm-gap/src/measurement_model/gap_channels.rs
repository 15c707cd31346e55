//! The channels in which a gap is measured.

use arm_sim::SimulationError;

use crate::data::course::{Channels, Course};
use crate::data::session::{ComparisonMode, Session};
use crate::hypothesis::Hypothesis;
use crate::measurement_model::prediction::in_common_band;

impl<const N: usize> Session<N> {
    /// Measured channels as a gap is measured to them: as the sensors read them where the arm is led, but for forces whose robot is not
    /// known between its samples; torques in the common band, as differentiated angles are noise above it.
    pub fn measured_in(&self, course: &Course<N>) -> Channels {
        match self.comparison {
            ComparisonMode::Led if course.weight < 1.0 => {
                [&course.raw[..N], &course.seen[N..]].concat()
            }
            ComparisonMode::Led => course.raw.clone(),
            ComparisonMode::Torque => course.seen.clone(),
        }
    }

    /// What a hypothesis shows in the place of [`Session::measured_in`].
    ///
    /// # Errors
    /// As [`Session::run`] and [`Session::read`].
    pub fn shown_in(
        &self,
        hypothesis: &Hypothesis<N>,
        course: &Course<N>,
    ) -> Result<Channels, SimulationError> {
        let run = self.run(hypothesis, course)?;
        match self.comparison {
            ComparisonMode::Led if course.weight < 1.0 => {
                let raw = self.read_raw(hypothesis, course, &run)?;
                Ok([&raw[..N], &in_common_band(&raw[N..], course)?].concat())
            }
            ComparisonMode::Led => self.read_raw(hypothesis, course, &run),
            ComparisonMode::Torque => self.read(hypothesis, course, &run),
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::data::course::tests::resting;

    #[test]
    fn forces_are_compared_in_the_band_where_the_path_is_unresolved() {
        let mut session = resting(100.0);
        let force = session.trials[0].force_on_arm.as_mut().expect("forces");
        force[50][0] = 1.0;
        session.trials[0].q[50][0] = 1.0;
        let as_read = session.course(0).expect("a course");
        assert_eq!(session.measured_in(&as_read), as_read.raw);
        session.weights = vec![0.3];
        let course = session.course(0).expect("a course");
        let compared = session.measured_in(&course);
        assert_eq!(compared[..2], course.raw[..2]);
        assert_eq!(compared[2..], course.seen[2..]);
        assert!(compared[2][50] < 0.5, "{}", compared[2][50]);
        let shown = session.shown_in(&session.given(), &course).expect("a run");
        let read = session
            .run(&session.given(), &course)
            .and_then(|run| session.read(&session.given(), &course, &run));
        assert_eq!(shown[2..], read.expect("channels")[2..]);
    }
}
