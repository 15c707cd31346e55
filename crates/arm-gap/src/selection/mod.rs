//! Which effects are missing: first-order score tests, search by fitting, model selection.

pub mod conclusion;
pub mod first_order_screening;
pub mod fit;
mod friction_at_rest;
pub mod held_out;
pub mod lack_of_fit;
pub mod model_discrimination;
pub mod model_selection;
pub mod passive_base;
mod passive_base_evidence;
pub mod score_test;
pub mod score_variance;
pub mod search;
pub mod search_state;
pub mod set_apart;
