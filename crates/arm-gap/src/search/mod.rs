//! The search for missing effects, from the first screening to its conclusion.

pub mod conclusion;
pub mod first_order_screening;
pub mod rounds;
pub mod trial_specific_effects;
