//! Preparation of an experiment: checks, effects applied, and the initial state.

mod equilibrium;
pub(crate) mod initial_state;
pub(crate) mod prepared_run;
