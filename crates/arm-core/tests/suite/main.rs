//! Tests of arm-core: identities between two independent ways, limits, arithmetic in the head, refused inputs.

mod activity;
mod anthropometry;
mod body;
mod calculus;
mod catalogue;
mod chain;
mod common;
mod contact;
#[cfg(feature = "custom-effects")]
mod custom_effect;
mod declared;
mod dual;
mod effects;
mod faults;
mod identities;
mod lanes;
mod monitor;
mod newton_euler;
mod online;
mod pendulum;
mod robot;
mod scalar;
mod thesis;
mod trajectory;
