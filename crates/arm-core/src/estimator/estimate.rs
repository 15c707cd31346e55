//! Estimates of the unknowns, and the state of an estimator.

use super::sample::SampleStatus;
use crate::numeric::scalar::Real;
use crate::regression::Prior;

/// What a value rests on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decision {
    /// The data.
    Data,
    /// The prior: the data do not determine it.
    Prior,
    /// A bound that the data push against.
    Bound,
}

impl Decision {
    /// The word for it in tables and files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Data => "data",
            Self::Prior => "prior",
            Self::Bound => "bound",
        }
    }
}

/// How well an estimator does.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Health<T, const N: usize> {
    /// What became of the last sample.
    pub last: SampleStatus,
    /// See [`Estimator::excess`](super::Estimator::excess).
    pub excess: T,
    /// Usual size of the torque that the estimate does not explain, by joint \[N m\].
    pub residual: [T; N],
    /// Time since a sample was last learned from \[s\].
    pub age: T,
    /// How often its state was not finite, and was started anew.
    pub restarts: u32,
}

/// What is known of one unknown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate<T> {
    /// The value, within its bounds.
    pub value: T,
    /// Its standard deviation, never above the prior's.
    pub sd: T,
    /// What it rests on; anything but data is not yet identified.
    pub decided_by: Decision,
}

impl<T: Real> Estimate<T> {
    /// What is known before any sample.
    pub(super) fn of_prior(p: &Prior<T>) -> Self {
        Self {
            value: p.mean.max(p.min).min(p.max),
            sd: p.sd,
            decided_by: Decision::Prior,
        }
    }
}
