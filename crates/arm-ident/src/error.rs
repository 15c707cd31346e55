//! The one error type of this crate: bad input. A poor solve is a status, not an error.

/// Why an input was refused. Every variant names the argument, what was found and what is allowed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum IdentError {
    /// A numerical routine refused its input.
    #[error(transparent)]
    Numerics(#[from] arm_numerics::NumericsError),
    /// The constrained problem has no usable solution.
    #[error("the fit has no solution: {}", .status.name())]
    NoSolution {
        /// How the solver ended.
        status: arm_numerics::least_squares::outcome::Status,
    },
    /// No movement that was tried respects what is allowed.
    #[error(
        "none of {evaluations} movements respects the limits, slowed or not; of the nearest, {nearest}"
    )]
    NoPlan {
        /// Movements tried.
        evaluations: usize,
        /// The limits that the best movement exceeds at the slowest pace.
        nearest: crate::movement_limits::Excess,
    },
    /// The simulated arm moves elsewhere than the measured one.
    #[error(
        "the simulated arm differs from the measured one by {found:.3} rad in joint {joint}, expected at most {allowed} rad: do the robot's base, lengths and elbow fit?"
    )]
    OtherMovement {
        /// One-based joint.
        joint: usize,
        /// Root mean square difference \[rad\].
        found: f64,
        /// Largest difference allowed \[rad\].
        allowed: f64,
    },
    /// A measured path of the first joint, which simulated motion does not follow.
    #[error("the first joint moves, which is taken into account only with measured motion")]
    MovingBase,
    /// Measured muscle activity, which simulated motion does not follow.
    #[error("muscles are active, which is taken into account only with measured motion")]
    MuscleActivity,
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

impl IdentError {
    /// Adds the trial in which it happened, counted from zero.
    pub(crate) fn in_trial(self, index: usize) -> Self {
        Self::InTrial {
            number: index + 1,
            error: Box::new(self),
        }
    }
}
