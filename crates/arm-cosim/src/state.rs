//! The saved state of a slave, which this or another process can restore.

use crate::hash::fnv1a;
use crate::mode::Mode;
use crate::plant::SavedPlant;
use crate::status::Refused;

/// Marks the bytes, with the version of their layout.
const MAGIC: [u8; 8] = *b"ARMRSST2";

/// Everything that the future of a slave depends on.
#[derive(Clone, Debug, PartialEq)]
pub struct SlaveState {
    pub(crate) mode: Mode,
    /// Whether the plant is yet to be made from the values.
    pub(crate) stale: bool,
    /// Time at the start; the time at which the run ends, or infinity \[s\].
    pub(crate) span: (f64, f64),
    /// By value reference: inputs, parameters, start values.
    pub(crate) values: Vec<f64>,
    pub(crate) plant: SavedPlant,
    /// Token of the arm that the state belongs to.
    pub(crate) token: String,
}

impl SlaveState {
    /// The state as bytes, little-endian, the same on every machine: no addresses, a checksum at the end.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        let word = |bytes: &mut Vec<u8>, w: u64| bytes.extend(w.to_le_bytes());
        word(&mut bytes, self.token.len() as u64);
        bytes.extend(self.token.as_bytes());
        word(&mut bytes, self.mode as u64 | u64::from(self.stale) << 8);
        word(&mut bytes, self.plant.ticks);
        for numbers in [
            &[self.span.0, self.span.1][..],
            &self.values,
            &self.plant.numbers,
        ] {
            word(&mut bytes, numbers.len() as u64);
            for number in numbers {
                word(&mut bytes, number.to_bits());
            }
        }
        let check = fnv1a(&bytes);
        word(&mut bytes, check);
        bytes
    }

    /// Reads what [`SlaveState::to_bytes`] has written.
    ///
    /// # Errors
    /// [`Refused`] for bytes that are anything else.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, Refused> {
        let Some((content, check)) = bytes.split_last_chunk::<8>() else {
            return Err(Refused::error("a serialized state is longer"));
        };
        if !content.starts_with(&MAGIC) {
            return Err(Refused::error(
                "the bytes are no serialized state of this version",
            ));
        }
        if fnv1a(content) != u64::from_le_bytes(*check) {
            return Err(Refused::error("the serialized state is damaged"));
        }
        Reader(&content[MAGIC.len()..])
            .state()
            .ok_or_else(|| Refused::error("the serialized state is damaged"))
    }
}

struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn state(mut self) -> Option<SlaveState> {
        let length = usize::try_from(self.word()?).ok()?;
        let token = String::from_utf8(self.0.get(..length)?.to_vec()).ok()?;
        self.0 = &self.0[length..];
        let mode = self.word()?;
        let ticks = self.word()?;
        let span = self.numbers()?;
        let values = self.numbers()?;
        let numbers = self.numbers()?;
        let known = span.len() == 2 && self.0.is_empty() && mode >> 9 == 0;
        known.then_some(SlaveState {
            mode: Mode::numbered(mode & 0xff)?,
            stale: mode >> 8 == 1,
            span: (span[0], span[1]),
            values,
            plant: SavedPlant { numbers, ticks },
            token,
        })
    }

    fn word(&mut self) -> Option<u64> {
        let (word, rest) = self.0.split_first_chunk::<8>()?;
        self.0 = rest;
        Some(u64::from_le_bytes(*word))
    }

    fn numbers(&mut self) -> Option<Vec<f64>> {
        let count = usize::try_from(self.word()?).ok()?;
        if count > self.0.len() / 8 {
            return None;
        }
        (0..count)
            .map(|_| self.word().map(f64::from_bits))
            .collect()
    }
}
