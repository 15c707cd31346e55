//! Times of the steps and of the samples.

use crate::{Experiment, SimulationError};

/// Most steps of a run: at 4 kHz three days. More is an error of units.
pub const MOST_STEPS: f64 = 1e9;

/// When steps are made and samples taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StepGrid {
    /// Step \[s\].
    pub dt: f64,
    /// Number of steps.
    pub steps: usize,
    /// Steps from one sample to the next.
    pub every: usize,
}

impl StepGrid {
    /// Samples of a complete run, the start included.
    pub fn samples(&self) -> usize {
        self.steps / self.every + 1
    }

    /// Time after a number of steps \[s\]; a product, so that it does not drift.
    #[inline]
    pub fn time(&self, steps: usize) -> f64 {
        steps as f64 * self.dt
    }

    /// Time after a number of half steps \[s\].
    #[inline]
    pub fn half_time(&self, half_steps: usize) -> f64 {
        0.5 * half_steps as f64 * self.dt
    }

    /// Steps from `done` on to the end of the run, the next sample or the next step where the drive breaks, whatever is first.
    pub fn smooth(&self, done: usize, sampled: usize, broken: Option<&usize>) -> usize {
        let to = (sampled + self.every).min(self.steps);
        broken.map_or(to, |broken| to.min(broken - 1)) - done
    }

    pub fn of<const N: usize>(experiment: &Experiment<N>) -> Result<Self, SimulationError> {
        let dt = experiment.dt;
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(SimulationError::Setting {
                name: "step",
                found: dt,
                allowed: "a positive number of seconds",
            });
        }
        let whole = |name, found: f64, allowed| {
            let steps = found / dt;
            let rounded = (steps + 0.5).floor();
            // The quotient of two decimal numbers is whole up to their rounding.
            let is_whole = (steps - rounded).abs() <= 1e-9 * rounded;
            if is_whole && (1.0..=MOST_STEPS).contains(&rounded) {
                Ok(rounded as usize)
            } else {
                Err(SimulationError::Setting {
                    name,
                    found,
                    allowed,
                })
            }
        };
        let allowed = "a whole number of steps, 1 to 1000000000";
        let steps = whole("duration", experiment.duration, allowed)?;
        let every = match experiment.output_interval {
            Some(interval) => whole("output interval", interval, allowed)?,
            None => 1,
        };
        if every > steps {
            return Err(SimulationError::Setting {
                name: "output interval",
                found: experiment.output_interval.unwrap_or(dt),
                allowed: "up to the duration",
            });
        }
        Ok(Self { dt, steps, every })
    }
}
