//! The function that creates the gravity compensation of an arm identified elsewhere.

use arm_capi_online::armrs_status;
use arm_capi_online::call::{given, numbers, place};
use arm_capi_online::held::Held;
use arm_core::Compensation;

use crate::refusal::{armrs_problem, status_of};
use crate::{ARMRS_UNKNOWNS, armrs_arm, armrs_compensation, armrs_real};

/// Makes it from the values of the unknowns of an arm and their covariance, row by row, of which the lower triangle is read. What is known
/// exactly, and unknowns that are not used, have zeros there. `problem`, if not null, says what was refused.
///
/// cbindgen:ptrs-as-arrays=[[values; ARMRS_UNKNOWNS], [covariance; ARMRS_UNKNOWNS * ARMRS_UNKNOWNS]]
/// # Safety
/// The pointers are null or point to what is said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_compensation_init(
    compensation: *mut armrs_compensation,
    arm: *const armrs_arm,
    values: *const armrs_real,
    covariance: *const armrs_real,
    problem: *mut armrs_problem,
) -> armrs_status {
    let run = || {
        // SAFETY: as promised by the caller.
        let (compensation, arm) = unsafe { (place(compensation)?, given(arm)?) };
        // SAFETY: as promised by the caller.
        let (values, covariance) = unsafe {
            (
                numbers(values)?,
                given(covariance.cast::<[[armrs_real; ARMRS_UNKNOWNS]; ARMRS_UNKNOWNS]>())?,
            )
        };
        let equation = arm.inner()?.equation;
        compensation.keep(&Compensation::new(equation, *values, covariance)?);
        Ok(())
    };
    // SAFETY: as promised by the caller.
    unsafe { status_of(run(), problem) }
}
