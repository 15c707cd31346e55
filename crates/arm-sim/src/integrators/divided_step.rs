//! One step of the grid, divided where the drive is not smooth.

use crate::closed_chain::state::{Input, State};
use crate::experiment::discontinuities::ON_GRID;
use crate::integrators::advance::advance;
use crate::integrators::step::{Inputs, Memory};
use crate::preparation::prepared_run::Prepared;

/// Distance from the ends of a piece at which one-sided values are taken, as a fraction of the piece.
const INWARD: f64 = 1e-6;

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
