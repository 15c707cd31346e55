//! Tests of arm-core: identities between two independent ways, limits, arithmetic in the head, refused inputs.

mod common;
mod identities;
mod robot;
mod trajectory;
