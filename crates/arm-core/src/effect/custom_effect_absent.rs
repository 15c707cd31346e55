//! Without the feature `custom-effects` there is no kind but those of the catalogue: this one has no value.

use super::law::{Info, Local, Parameters, States};
use super::prior::Prior;
use crate::Scalar;

/// A user-defined kind; none can be made without the feature `custom-effects`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum CustomEffect {}

impl CustomEffect {
    pub(super) fn info(self) -> &'static Info {
        match self {}
    }

    pub(super) fn prior(self) -> Prior {
        match self {}
    }

    pub(super) fn feels_force(self) -> bool {
        match self {}
    }

    pub(super) fn torque<T: Scalar>(self, _p: &Parameters<T>, _at: &Local<T>) -> T {
        match self {}
    }

    pub(super) fn memory_rate<T: Scalar>(self, _p: &Parameters<T>, _at: &Local<T>) -> States<T> {
        match self {}
    }
}
