//! A number that stands for every bit of a recording.

use crate::{Recording, SimulationError};

/// FNV-1a, 64 bits (Fowler, Noll, Vo) over names, sizes and the little-endian bits of every column.
///
/// Two recordings with the same digest are, but for a chance of 2⁻⁶⁴, the same in every bit. The digest of a run is the
/// same on every platform, in debug and release.
///
/// # Errors
/// [`SimulationError::Samples`] for a value that is not a number: its bits differ between processors.
pub fn digest<const N: usize>(recording: &Recording<N>) -> Result<u64, SimulationError> {
    let mut hash = Fnv1a::new();
    for (kind, joint) in &recording.effects {
        hash.bytes(kind.info().kind.as_bytes());
        hash.number(*joint as u64);
    }
    for (name, width, values) in recording.columns() {
        hash.bytes(name.as_bytes());
        hash.number(values.len() as u64);
        for (i, value) in values.iter().enumerate() {
            if value.is_nan() {
                return Err(SimulationError::Samples {
                    name,
                    sample: i / width.max(1) + 1,
                    problem: "not a number, which has no definite bits",
                });
            }
            hash.number(value.to_bits());
        }
    }
    Ok(hash.0)
}

struct Fnv1a(u64);

impl Fnv1a {
    fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    fn bytes(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }

    fn number(&mut self, value: u64) {
        self.bytes(&value.to_le_bytes());
    }
}
