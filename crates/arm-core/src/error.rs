//! Errors for values that the core refuses.

use core::fmt;

/// An input that was refused: which one, what was found and what is allowed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Invalid {
    /// A value that is NaN or infinite.
    NotFinite {
        /// Name of the quantity.
        name: &'static str,
        /// Zero-based index of the segment, joint or sample it belongs to.
        index: usize,
    },
    /// A value outside what is allowed.
    OutOfRange {
        /// Name of the quantity.
        name: &'static str,
        /// Zero-based index of the segment, joint or sample it belongs to.
        index: usize,
        /// The value found.
        found: f64,
        /// Smallest value allowed.
        min: f64,
        /// Largest value allowed.
        max: f64,
    },
    /// A point that the robot cannot reach.
    OutOfReach {
        /// Distance of the point from the robot's base \[m\].
        distance: f64,
        /// Shortest reach \[m\].
        min: f64,
        /// Longest reach \[m\].
        max: f64,
    },
    /// An effect that cannot act where it was put.
    CannotAct {
        /// Name of its kind.
        kind: &'static str,
    },
    /// A name that the catalogue does not hold.
    Unknown {
        /// What kind of name it is.
        name: &'static str,
    },
}

/// A number as messages show it: plainly where that is short, else with an exponent.
#[derive(Clone, Copy, Debug)]
pub struct Shown(
    /// The number.
    pub f64,
);

impl fmt::Display for Shown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let size = self.0.abs();
        if size == 0.0 || (1e-6..1e16).contains(&size) || !size.is_finite() {
            write!(f, "{}", self.0)
        } else {
            write!(f, "{:e}", self.0)
        }
    }
}

impl fmt::Display for Invalid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::NotFinite { name, index } => write!(f, "{name} {} is not finite", index + 1),
            Self::OutOfRange {
                name,
                index,
                found,
                min,
                max,
            } => {
                write!(
                    f,
                    "{name} {} is {}, allowed is {} to {}",
                    index + 1,
                    Shown(found),
                    Shown(min),
                    Shown(max)
                )
            }
            Self::OutOfReach { distance, min, max } => {
                write!(
                    f,
                    "the point is {} m from the robot's base, its reach is {} m to {} m",
                    Shown(distance),
                    Shown(min),
                    Shown(max)
                )
            }
            Self::CannotAct { kind } => {
                write!(f, "`{kind}` needs more than an arm")
            }
            Self::Unknown { name } => write!(f, "unknown {name}"),
        }
    }
}

impl core::error::Error for Invalid {}
