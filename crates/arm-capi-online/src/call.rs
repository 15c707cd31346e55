//! Checks that every function shares: pointers become references, and results must be finite.

use arm_core::Joints;

use crate::status::armrs_status::{self, *};
use crate::{ARMRS_JOINTS, armrs_real};

/// Turns a result of the body of a function into its status.
pub fn ended(result: Result<(), armrs_status>) -> armrs_status {
    match result {
        Ok(()) => ARMRS_OK,
        Err(status) => status,
    }
}

/// A result that may be written. One that is not finite never reaches a motor: it comes from a value that was not, or from one
/// beyond all numbers.
pub fn finite<const N: usize>(result: [armrs_real; N]) -> Result<[armrs_real; N], armrs_status> {
    // Zero times a number is zero, times NaN or an infinity NaN: one operation for each, and one look.
    let sum = result.iter().fold(0.0, |sum, &value| sum + 0.0 * value);
    if sum == 0.0 {
        Ok(result)
    } else {
        Err(ARMRS_NOT_FINITE)
    }
}

/// A reference to what a caller's pointer points to.
///
/// # Safety
/// A pointer that is not null is aligned and points to a `T` that nobody writes during the call.
pub unsafe fn given<'a, T>(pointer: *const T) -> Result<&'a T, armrs_status> {
    // SAFETY: as promised by the caller.
    unsafe { pointer.as_ref() }.ok_or(ARMRS_NULL)
}

/// Numbers that a caller's pointer points to.
///
/// # Safety
/// As of [`given`], for `N` of them.
pub unsafe fn numbers<'a, const N: usize>(
    pointer: *const armrs_real,
) -> Result<&'a [armrs_real; N], armrs_status> {
    // SAFETY: as promised by the caller; an array has the alignment of its elements.
    unsafe { given(pointer.cast()) }
}

/// Places for numbers that a caller's pointer points to.
///
/// # Safety
/// As of [`place`], for `N` of them.
pub unsafe fn places<'a, const N: usize>(
    pointer: *mut armrs_real,
) -> Result<&'a mut [armrs_real; N], armrs_status> {
    // SAFETY: as promised by the caller.
    unsafe { place(pointer.cast()) }
}

/// A place that a caller's pointer points to.
///
/// # Safety
/// A pointer that is not null is aligned and points to a `T` that nobody else uses during the call.
pub unsafe fn place<'a, T>(pointer: *mut T) -> Result<&'a mut T, armrs_status> {
    // SAFETY: as promised by the caller.
    unsafe { pointer.as_mut() }.ok_or(ARMRS_NULL)
}

pub fn joints(values: &[armrs_real; ARMRS_JOINTS]) -> Joints<armrs_real, ARMRS_JOINTS> {
    (*values).into()
}

pub fn array(values: &Joints<armrs_real, ARMRS_JOINTS>) -> [armrs_real; ARMRS_JOINTS] {
    (*values).into()
}
