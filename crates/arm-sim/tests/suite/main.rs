//! Tests of arm-sim: order and energy of the integrators, long runs, limits, lanes against single runs, refused inputs.

mod accuracy;
mod activity;
mod assistance;
mod batch;
mod chosen_step;
mod common;
mod controlled;
mod energy;
mod friction;
mod friction_reference;
mod golden;
mod heave;
mod interaction;
mod long;
mod pendulum;
mod pieces;
mod placement;
#[cfg(feature = "rapier")]
mod rapier;
mod refused;
mod rigid;
mod sensor;
mod series;
mod stepper;
mod switch;
