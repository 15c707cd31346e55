//! Tests of the world that hides effects.

mod agreement;
mod common;
mod session;
mod sticking;
mod truth;
