//! Statuses of calls, in the words of the FMI standard.

use arm_sim::SimulationError;

/// Statuses, in the order and with the numbers of FMI 2.0 and 3.0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(i32)]
pub enum Status {
    /// Done.
    Ok = 0,
    /// Done, with a message.
    Warning = 1,
    /// Not done, and the state is as before: another value or a shorter step may do.
    Discard = 2,
    /// Not done; only reading, going back to a state, resetting and freeing are possible.
    Error = 3,
    /// The instance is lost.
    Fatal = 4,
}

/// A call that was not done.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct Refused {
    /// [`Status::Discard`] or [`Status::Error`].
    pub status: Status,
    /// What was found and what is allowed, on one line.
    pub message: String,
}

impl Refused {
    pub(crate) fn error(message: impl Into<String>) -> Self {
        Self {
            status: Status::Error,
            message: message.into(),
        }
    }

    pub(crate) fn discard(message: impl Into<String>) -> Self {
        Self {
            status: Status::Discard,
            message: message.into(),
        }
    }
}

impl From<SimulationError> for Refused {
    fn from(error: SimulationError) -> Self {
        Self::error(error.to_string())
    }
}
