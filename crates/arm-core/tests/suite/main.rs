//! Tests of arm-core: identities between two independent ways, limits, arithmetic in the head, refused inputs.

mod anthropometry;
mod body;
mod catalogue;
mod common;
mod effects;
mod identities;
mod robot;
mod trajectory;
