#![doc = include_str!("../README.md")]
#![allow(non_snake_case, reason = "names of the standards")]
#![allow(
    clippy::missing_safety_doc,
    reason = "the contract is that of the standards, see `pointers`"
)]

mod exchange;
pub mod fmi2;
pub mod fmi3;
mod instance;
mod pointers;
mod refused;
mod resources;
mod shared;

pub use instance::{Handle, guarded};

const MARK: &str = concat!("armrs library for FMUs ", env!("CARGO_PKG_VERSION"), "\0");

/// Names the library and its version in the file, for tools that pack libraries of several machines into one FMU.
#[unsafe(no_mangle)]
pub static ARMRS_LIBRARY: [u8; MARK.len()] = {
    let mut bytes = [0; MARK.len()];
    bytes.copy_from_slice(MARK.as_bytes());
    bytes
};
