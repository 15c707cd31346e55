//! Errors of a search.

use arm_ident::IdentError;
use arm_sim::SimulationError;

/// What stops the gap workflow. Candidates that cannot be simulated do not: they are left out.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GapError {
    /// Insufficient data.
    #[error("{what}: {found} found, {allowed} needed")]
    Data {
        /// What of it.
        what: &'static str,
        /// What was found.
        found: String,
        /// What is allowed.
        allowed: &'static str,
    },
    /// The model as given cannot be simulated on a trial.
    #[error("trial {}: {source}", .trial + 1)]
    Simulation {
        /// Zero-based trial.
        trial: usize,
        /// Why.
        source: SimulationError,
    },
    /// A numerical step failed.
    #[error(transparent)]
    Numerics(#[from] IdentError),
    /// The normal equations of a fit are not positive definite: a parameter that nothing decides.
    #[error("the fit of {unknowns} unknowns is singular")]
    Singular {
        /// Number of unknowns.
        unknowns: usize,
    },
    /// The receiver of progress reports ended the work.
    #[error("stopped")]
    Stopped,
}

impl From<arm_numerics::NumericsError> for GapError {
    fn from(error: arm_numerics::NumericsError) -> Self {
        Self::Numerics(error.into())
    }
}
