//! Tests of arm-sim: order and energy of the integrators, long runs, limits, lanes against single runs, refused inputs.

mod accuracy;
mod activity;
mod assistance;
mod batch;
mod chosen_step;
mod common;
mod energy;
mod friction;
mod friction_reference;
mod golden;
mod heave;
mod imex;
mod interaction_control;
mod joint_controller;
mod long;
mod pendulum;
mod pieces;
mod piecewise_cubic;
mod placement;
#[cfg(feature = "rapier")]
mod rapier;
mod refused;
mod rigid;
mod sensors;
mod stepper;
mod switch;
