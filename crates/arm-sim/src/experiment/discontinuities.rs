//! Times at which the drive is not smooth, where steps are divided.
//!
//! A method has its order where what it integrates is smooth within each step. Simpson's rule, which is what Rk4 makes of the
//! handle's work `∫ F·v dt`, is wrong by up to `h²/24 · F·Δa` where the acceleration jumps by Δa inside a step, by an amount
//! that depends on where. A rigid coupling passes the jump on to its force, and is wrong by `h/6 · ΔF·v` already where the
//! acceleration at the end of a step is that after the jump. So steps end at every such time, and the drive of each piece is
//! that inside the piece.

use crate::experiment::step_grid::StepGrid;
use crate::{Coupling, Drive, Experiment};

/// Nearer to a point of the grid than this, in steps, a break lies on it: what it still does is as the square of that.
pub(crate) const ON_GRID: f64 = 1e-6;

/// The steps of a run that a break touches.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Discontinuities(Vec<Break>);

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Break {
    /// Number of the step; the first is 1.
    step: usize,
    /// Time inside of it \[s\]; infinite where the drive jumps at its start or end only.
    pub inside: f64,
}

impl Discontinuities {
    /// The breaks of an experiment.
    ///
    /// On the grid they matter only where a value jumps that acts on the arm directly: the acceleration of a handle that holds it
    /// rigidly, or a torque.
    pub fn of<const N: usize>(experiment: &Experiment<N>, schedule: &StepGrid) -> Self {
        let (times, acts_directly) = match &experiment.drive {
            Drive::Handle { path, coupling } => (path.breaks(), *coupling == Coupling::Rigid),
            Drive::Torque(Some(series)) => (series.times().to_vec(), true),
            Drive::Torque(None) => (Vec::new(), false),
        };
        let mut breaks = Vec::new();
        let mut touch = |step: usize, inside: f64| {
            if (1..=schedule.steps).contains(&step) {
                breaks.push(Break { step, inside });
            }
        };
        for time in times {
            let steps = time / schedule.dt;
            let nearest = (steps + 0.5).floor();
            // Breaks before the start or after the end are in no step.
            if !(-0.5..=schedule.steps as f64 + 0.5).contains(&steps) {
                continue;
            }
            if (steps - nearest).abs() > ON_GRID {
                touch(steps.ceil().max(0.0) as usize, time);
            } else if acts_directly {
                touch(nearest as usize, f64::INFINITY);
                touch(nearest as usize + 1, f64::INFINITY);
            }
        }
        breaks.sort_by(|a, b| a.step.cmp(&b.step).then(a.inside.total_cmp(&b.inside)));
        Self(breaks)
    }

    /// The steps that are touched, in order.
    pub fn steps(&self) -> impl Iterator<Item = usize> {
        self.0.iter().map(|b| b.step)
    }

    /// What touches a step, in order.
    pub fn within(&self, step: usize) -> &[Break] {
        let from = self.0.partition_point(|b| b.step < step);
        let count = self.0[from..].partition_point(|b| b.step == step);
        &self.0[from..from + count]
    }
}
