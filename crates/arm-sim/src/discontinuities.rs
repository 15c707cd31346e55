//! Where steps are cut: at the times at which the drive is not smooth.
//!
//! A method has its order where what it integrates is smooth within each step. Simpson's rule, which is what Rk4 makes of the
//! handle's work `∫ F·v dt`, is wrong by up to `h²/24 · F·Δa` where the acceleration jumps by Δa inside a step, by an amount
//! that depends on where. A rigid coupling passes the jump on to its force, and is wrong by `h/6 · ΔF·v` already where the
//! acceleration at the end of a step is that after the jump. So steps end at every such time, and each piece sees the drive as
//! it is within that piece.

use crate::model::{Input, State};
use crate::prepare::{Prepared, Schedule};
use crate::step::{Inputs, Memory, advance};
use crate::{Coupling, Drive, Experiment};

/// Nearer to a point of the grid than this, in steps, a break lies on it: what it still does is as the square of that.
const ON_GRID: f64 = 1e-6;
/// How far into a piece its ends are looked at from, as a fraction of the piece.
const INWARD: f64 = 1e-6;

/// The steps of a run that a break touches.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Discontinuities(Vec<Break>);

#[derive(Clone, Copy, Debug, PartialEq)]
struct Break {
    /// Number of the step; the first is 1.
    step: usize,
    /// Time inside of it \[s\]; infinite where the drive jumps at its start or end only.
    inside: f64,
}

impl Discontinuities {
    /// The breaks of an experiment.
    ///
    /// On the grid they matter only where a value jumps that the arm feels at once: the acceleration of a handle that holds it
    /// rigidly, or a torque.
    pub fn of<const N: usize>(experiment: &Experiment<N>, schedule: &Schedule) -> Self {
        let (times, felt) = match &experiment.drive {
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
            // What lies before the start or after the end is nobody's.
            if !(-0.5..=schedule.steps as f64 + 0.5).contains(&steps) {
                continue;
            }
            if (steps - nearest).abs() > ON_GRID {
                touch(steps.ceil().max(0.0) as usize, time);
            } else if felt {
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

    fn within(&self, step: usize) -> &[Break] {
        let from = self.0.partition_point(|b| b.step < step);
        let count = self.0[from..].partition_point(|b| b.step == step);
        &self.0[from..from + count]
    }
}

/// Makes one step of the grid, in pieces where the drive breaks.
pub(crate) fn step_in_pieces<const N: usize>(
    prepared: &Prepared<N>,
    number: usize,
    (state, memory): (&mut State<f64, N>, &mut Memory<f64>),
) {
    let Prepared {
        schedule, model, ..
    } = prepared;
    let mut make = |h, [start, middle, end]: [Input<f64, N>; 3]| {
        let inputs = Inputs {
            start: &start,
            middle: &middle,
            end: &end,
        };
        advance(model, prepared.integrator(), h, inputs, (state, memory));
    };
    let (begin, end) = (schedule.time(number - 1), schedule.time(number));
    let touched = prepared.discontinuities.within(number);
    if touched.is_empty() {
        let middle = prepared.input(schedule.half_time(2 * number - 1));
        let (start, end) = (prepared.input(begin), prepared.input(end));
        return make(schedule.dt, [start, middle, end]);
    }
    let inside = touched.iter().map(|b| b.inside).filter(|t| *t < end);
    let mut from = begin;
    for to in inside.chain([end]) {
        let h = to - from;
        if h < ON_GRID * schedule.dt {
            continue;
        }
        let inputs = [
            seen_from(prepared, from, from + INWARD * h),
            prepared.input(from + 0.5 * h),
            seen_from(prepared, to, to - INWARD * h),
        ];
        make(h, inputs);
        from = to;
    }
}

/// The drive at a time, with what may jump there as it is a little to one side.
fn seen_from<const N: usize>(prepared: &Prepared<N>, time: f64, beside: f64) -> Input<f64, N> {
    let (mut input, beside) = (prepared.input(time), prepared.input(beside));
    input.handle.acceleration = beside.handle.acceleration;
    input.torque = beside.torque;
    input
}
