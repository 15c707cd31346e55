//! Refused input of the numerical routines. A poor solve is a status, not an error.

/// Why an input was refused. Every variant names the argument, what was found and what is allowed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NumericsError {
    /// A slice or matrix has the wrong size.
    #[error("{name} has length {found}, expected {expected}")]
    Length {
        /// The argument.
        name: &'static str,
        /// Its length.
        found: usize,
        /// The length that fits the other arguments.
        expected: usize,
    },
    /// There are too few values for the computation.
    #[error("{name}: found {found}, expected at least {expected}")]
    TooFew {
        /// What is counted.
        name: &'static str,
        /// How many there are.
        found: usize,
        /// How many are needed.
        expected: usize,
    },
    /// A value is NaN, infinite, or so large that its square would overflow.
    #[error("{name} holds {found} at index {index}, expected a finite number")]
    NotFinite {
        /// The argument.
        name: &'static str,
        /// Position of the first such value in the argument.
        index: usize,
        /// The value.
        found: f64,
    },
    /// A value lies outside its domain.
    #[error("{name} is {found}, expected {min} to {max}")]
    OutOfRange {
        /// The argument.
        name: &'static str,
        /// Its value.
        found: f64,
        /// Least allowed value.
        min: f64,
        /// Greatest allowed value.
        max: f64,
    },
    /// A lower bound lies above its upper bound, or is not a number.
    #[error("bounds of parameter {index}: lower {lower} is not below or equal to upper {upper}")]
    Bounds {
        /// The parameter.
        index: usize,
        /// Its lower bound.
        lower: f64,
        /// Its upper bound.
        upper: f64,
    },
    /// The data leave a parameter undetermined where a unique solution is required.
    #[error("{name} has rank {found}, expected {expected}")]
    Rank {
        /// The matrix.
        name: &'static str,
        /// Its numerical rank.
        found: usize,
        /// The rank that is needed.
        expected: usize,
    },
}

/// Refuses a slice of the wrong length.
pub fn check_len(name: &'static str, found: usize, expected: usize) -> Result<(), NumericsError> {
    if found == expected {
        Ok(())
    } else {
        Err(NumericsError::Length {
            name,
            found,
            expected,
        })
    }
}

/// Refuses a slice that holds NaN or infinity.
pub fn check_finite(name: &'static str, values: &[f64]) -> Result<(), NumericsError> {
    match values.iter().position(|v| !v.is_finite()) {
        None => Ok(()),
        Some(index) => Err(NumericsError::NotFinite {
            name,
            index,
            found: values[index],
        }),
    }
}

/// Refuses too short an input.
pub fn check_least(name: &'static str, found: usize, expected: usize) -> Result<(), NumericsError> {
    if found >= expected {
        Ok(())
    } else {
        Err(NumericsError::TooFew {
            name,
            found,
            expected,
        })
    }
}

/// Refuses a value outside `[min, max]`, and NaN.
pub fn check_range(name: &'static str, found: f64, range: [f64; 2]) -> Result<(), NumericsError> {
    let [min, max] = range;
    if found >= min && found <= max {
        Ok(())
    } else {
        Err(NumericsError::OutOfRange {
            name,
            found,
            min,
            max,
        })
    }
}
