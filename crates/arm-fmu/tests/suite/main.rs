//! Tests of arm-fmu: the C interfaces as a hostile importer meets them.

#![expect(
    clippy::undocumented_unsafe_blocks,
    reason = "the tests are importers: what a call may be given is what they try"
)]

mod hostile;
mod importer;
mod memory;
