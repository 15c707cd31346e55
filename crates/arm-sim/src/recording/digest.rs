//! A digest of every bit of a recording.

use crate::{Piece, Recording, SimulationError};

/// [`digest_of`] a recording.
///
/// Two recordings with the same digest are, but for a chance of 2⁻⁶⁴, the same in every bit. The digest of a run is the
/// same on every platform, in debug and release.
///
/// # Errors
/// As [`definite`].
pub fn digest<const N: usize>(recording: &Recording<N>) -> Result<u64, SimulationError> {
    definite(&recording.into())?;
    let effects = recording.effects.iter();
    let columns = recording.columns().into_iter();
    Ok(digest_of(
        effects.map(|(kind, joint)| (kind.info().kind, *joint)),
        columns.map(|(name, _, values)| (name, values)),
    ))
}

/// Refuses samples that have no definite bits.
///
/// # Errors
/// [`SimulationError::Samples`] for a value that is not a number: its bits differ between processors.
pub fn definite<const N: usize>(piece: &Piece<'_, N>) -> Result<(), SimulationError> {
    for (name, width, values) in piece.recording.columns() {
        // A loop without an early end is one over vectors.
        let is_any = values.iter().fold(false, |any, v| any | v.is_nan());
        if is_any && let Some(i) = values.iter().position(|v| v.is_nan()) {
            return Err(SimulationError::Samples {
                name,
                sample: piece.from + i / width.max(1) + 1,
                problem: "not a number, which has no definite bits",
            });
        }
    }
    Ok(())
}

/// FNV-1a, 64 bits (Fowler, Noll, Vo) over names, sizes and the little-endian bits of every column.
///
/// * `effects` - kind and joint of each
/// * `columns` - name and values of each
pub fn digest_of<'a>(
    effects: impl Iterator<Item = (&'a str, usize)>,
    columns: impl Iterator<Item = (&'a str, &'a [f64])>,
) -> u64 {
    let mut digest = Digest::of_effects(effects);
    for (name, values) in columns {
        digest.column(name, values.len());
        digest.values(values);
    }
    digest.value()
}

/// [`digest_of`] of columns that come a piece after another.
#[derive(Clone, Debug)]
pub struct Digest(Fnv1a);

impl Digest {
    /// Begins with kind and joint of each effect.
    pub fn of_effects<'a>(effects: impl Iterator<Item = (&'a str, usize)>) -> Self {
        let mut hash = Fnv1a::new();
        for (kind, joint) in effects {
            hash.bytes(kind.as_bytes());
            hash.number(joint as u64);
        }
        Self(hash)
    }

    /// Begins a column with so many values.
    pub fn column(&mut self, name: &str, length: usize) {
        self.0.bytes(name.as_bytes());
        self.0.number(length as u64);
    }

    /// Adds values of the column that was begun last.
    pub fn values(&mut self, values: &[f64]) {
        for value in values {
            self.0.number(value.to_bits());
        }
    }

    /// The number for all that was added.
    pub fn value(&self) -> u64 {
        self.0.0
    }
}

#[derive(Clone, Debug)]
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
