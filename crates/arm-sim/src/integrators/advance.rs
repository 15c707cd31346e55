//! One step of any integrator.

use super::friction;
use super::imex::imex;
use super::step::{self, Inputs, Memory};
use crate::Integrator;
use crate::closed_chain::model::Model;
use crate::closed_chain::state::State;

/// Advances a state by one step of length `h`, with dry friction where there is any.
#[inline(always)]
pub(crate) fn advance<const N: usize>(
    model: &Model<f64, N>,
    integrator: Integrator,
    h: f64,
    inputs: Inputs<f64, N>,
    at: (&mut State<f64, N>, &mut Memory<f64>),
) {
    if integrator == Integrator::Imex {
        imex(model, h, &inputs, at);
    } else if model.has_dry {
        friction::step(model, integrator, h, inputs, at);
    } else {
        step::step(model, integrator, h, inputs, at);
    }
}
