use arm_core::Invalid;

use crate::armrs_real;

/// What a call came to.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum armrs_status {
    /// Done.
    ARMRS_OK = 0,
    /// A pointer is null.
    ARMRS_NULL = 1,
    /// A struct was not made by its `_init` function.
    ARMRS_NOT_INITIALISED = 2,
    /// A value that was given is NaN or infinite, or makes a result so; nothing was written.
    ARMRS_NOT_FINITE = 3,
    /// A value or a number of things is outside what is allowed.
    ARMRS_OUT_OF_RANGE = 4,
    /// The robot does not reach the point.
    ARMRS_OUT_OF_REACH = 5,
    /// No effect has this name or number.
    ARMRS_UNKNOWN = 6,
    /// The monitor has stopped the device.
    ARMRS_STOPPED = 7,
}

pub(crate) use armrs_status::*;

impl From<Invalid> for armrs_status {
    fn from(invalid: Invalid) -> Self {
        match invalid {
            Invalid::NotFinite { .. } => ARMRS_NOT_FINITE,
            Invalid::OutOfReach { .. } => ARMRS_OUT_OF_REACH,
            Invalid::Unknown { .. } => ARMRS_UNKNOWN,
            _ => ARMRS_OUT_OF_RANGE,
        }
    }
}

/// Turns a result of the body of a function into its status.
pub(crate) fn ended(result: Result<(), armrs_status>) -> armrs_status {
    match result {
        Ok(()) => ARMRS_OK,
        Err(status) => status,
    }
}

/// A result that may be written. One that is not finite never reaches a motor: it comes from a value that was not, or from one
/// beyond all numbers.
pub(crate) fn finite<const N: usize>(
    result: [armrs_real; N],
) -> Result<[armrs_real; N], armrs_status> {
    match result.iter().all(|value| value.is_finite()) {
        true => Ok(result),
        false => Err(ARMRS_NOT_FINITE),
    }
}

/// A reference to what a caller's pointer points to.
///
/// # Safety
/// A pointer that is not null is aligned and points to a `T` that nobody writes during the call.
pub(crate) unsafe fn given<'a, T>(pointer: *const T) -> Result<&'a T, armrs_status> {
    // SAFETY: as promised by the caller.
    unsafe { pointer.as_ref() }.ok_or(ARMRS_NULL)
}

/// A place that a caller's pointer points to.
///
/// # Safety
/// A pointer that is not null is aligned and points to a `T` that nobody else uses during the call.
pub(crate) unsafe fn place<'a, T>(pointer: *mut T) -> Result<&'a mut T, armrs_status> {
    // SAFETY: as promised by the caller.
    unsafe { pointer.as_mut() }.ok_or(ARMRS_NULL)
}
