//! One module per source file, or more where one is not enough; `noise`, `synthetic` and `joint_method` are what they share.

mod bits;
mod by_simulation;
mod cascade;
mod design;
// What they simulate and identify is compiled for this suite as it is.
#[path = "../../../crosscheck/src/digests.rs"]
mod digests;
mod imperfections;
mod joint;
mod joint_input;
mod joint_method;
mod little_known;
#[path = "../../../arm-numerics/tests/suite/noise.rs"]
#[expect(dead_code, reason = "shared with the suite of arm-numerics")]
mod noise;
mod online;
mod quasi_static;
mod rank;
mod streamed;
mod synthetic;
