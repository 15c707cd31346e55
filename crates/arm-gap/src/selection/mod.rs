//! Selection of effects: score tests, comparison with alternatives, the passive base, the test on test trials.

mod friction_at_rest;
pub mod held_out;
pub mod model_discrimination;
pub mod model_selection;
mod open_joints;
pub mod passive_base;
mod passive_base_evidence;
pub mod score_test;
pub mod search_state;
