//! The one error type of this crate: bad input. A poor solve is a status, not an error.

/// Why an input was refused. Every variant names the argument, what was found and what is allowed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum IdentError {
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
    /// There are too few values for what was asked.
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
    /// The data leave a parameter undetermined where a unique answer was asked for.
    #[error("{name} has rank {found}, expected {expected}")]
    Rank {
        /// The matrix.
        name: &'static str,
        /// Its numerical rank.
        found: usize,
        /// The rank that is needed.
        expected: usize,
    },
    /// The constrained problem has no usable solution.
    #[error("the fit has no solution: {status:?}")]
    NoSolution {
        /// How the solver ended.
        status: crate::outcome::Status,
    },
    /// No movement that was tried respects what is allowed.
    #[error(
        "none of {evaluations} movements respects the limits, slowed or not; of the nearest, {nearest}"
    )]
    NoPlan {
        /// Movements tried.
        evaluations: usize,
        /// What the movement that comes nearest still exceeds when it is slowed as far as may be.
        nearest: crate::design::Excess,
    },
    /// The simulated arm moves elsewhere than the measured one.
    #[error(
        "the simulated arm differs from the measured one by {found:.3} rad in joint {joint}, expected at most {allowed} rad: do the robot's base, lengths and elbow fit?"
    )]
    OtherMovement {
        /// One-based joint.
        joint: usize,
        /// Root mean square difference [rad].
        found: f64,
        /// Largest difference allowed [rad].
        allowed: f64,
    },
    /// Something about one trial.
    #[error("trial {number}: {error}")]
    InTrial {
        /// One-based, in the order given.
        number: usize,
        /// What.
        error: Box<IdentError>,
    },
    /// The simulation that gives the motion was refused or stopped.
    #[error("simulated motion: {0}")]
    Simulation(#[from] arm_sim::SimulationError),
    /// The estimates do not make an arm.
    #[error("the estimates do not make an arm: {0}")]
    Model(arm_core::Invalid),
}

/// Refuses a slice of the wrong length.
pub(crate) fn check_len(
    name: &'static str,
    found: usize,
    expected: usize,
) -> Result<(), IdentError> {
    if found == expected {
        Ok(())
    } else {
        Err(IdentError::Length {
            name,
            found,
            expected,
        })
    }
}

impl IdentError {
    /// Says in which trial it happened, counted from zero.
    pub(crate) fn in_trial(self, index: usize) -> Self {
        Self::InTrial {
            number: index + 1,
            error: Box::new(self),
        }
    }
}

/// Refuses a slice that holds NaN or infinity.
pub(crate) fn check_finite(name: &'static str, values: &[f64]) -> Result<(), IdentError> {
    match values.iter().position(|v| !v.is_finite()) {
        None => Ok(()),
        Some(index) => Err(IdentError::NotFinite {
            name,
            index,
            found: values[index],
        }),
    }
}

/// Refuses too short an input.
pub(crate) fn check_least(
    name: &'static str,
    found: usize,
    expected: usize,
) -> Result<(), IdentError> {
    if found >= expected {
        Ok(())
    } else {
        Err(IdentError::TooFew {
            name,
            found,
            expected,
        })
    }
}

/// Refuses a value outside `[min, max]`, and NaN.
pub(crate) fn check_range(
    name: &'static str,
    found: f64,
    range: [f64; 2],
) -> Result<(), IdentError> {
    let [min, max] = range;
    if found >= min && found <= max {
        Ok(())
    } else {
        Err(IdentError::OutOfRange {
            name,
            found,
            min,
            max,
        })
    }
}
