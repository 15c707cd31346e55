//! The torque that carries an arm that was identified elsewhere.

use core::mem::MaybeUninit;

use arm_core::effect::MAX_STATES;
use arm_core::{Compensation, GravityCompensation};

use crate::arm::armrs_arm;
use crate::held::{Held, held};
use crate::motion::{armrs_motion, array};
use crate::status::{
    ARMRS_UNTRUSTED, armrs_problem, armrs_status, ended, finite, given, numbers, place, places,
    told,
};
use crate::{ARMRS_EFFECTS, ARMRS_JOINTS, ARMRS_UNKNOWNS, armrs_real};

/// An identified arm and the covariance of its unknowns.
#[repr(C)]
pub struct armrs_compensation {
    tag: u64,
    words: [MaybeUninit<u64>; ARMRS_COMPENSATION_WORDS],
}

/// Size of an `armrs_compensation`.
#[cfg(not(feature = "single"))]
pub const ARMRS_COMPENSATION_WORDS: usize = 560;
/// Size of an `armrs_compensation`.
#[cfg(feature = "single")]
pub const ARMRS_COMPENSATION_WORDS: usize = 320;

type Core = Compensation<armrs_real, ARMRS_JOINTS, ARMRS_UNKNOWNS, ARMRS_EFFECTS>;

held!(armrs_compensation holds Core, b"compe0.1");

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
    unsafe { told(run(), problem) }
}

/// Torques that carry the arm: its weight, and what its effects resist with at the speeds of `motion`; accelerations are not
/// read, and effects with a state are taken at rest. `sd`, if not null: their standard deviations [N m].
///
/// cbindgen:ptrs-as-arrays=[[torque; ARMRS_JOINTS], [sd; ARMRS_JOINTS]]
/// # Safety
/// The pointers are null or point to what is said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_compensation_carry(
    compensation: *const armrs_compensation,
    motion: *const armrs_motion,
    torque: *mut armrs_real,
    sd: *mut armrs_real,
) -> armrs_status {
    let run = || {
        // SAFETY: as promised by the caller.
        let (compensation, motion) = unsafe { (given(compensation)?, given(motion)?) };
        // SAFETY: as promised by the caller.
        let (torque, sd) = unsafe { (places(torque)?, places(sd).ok()) };
        let core = compensation.inner()?;
        let carry = core.carry(&motion.still().core()?, &[[0.0; MAX_STATES]; ARMRS_EFFECTS]);
        write_carry(&carry, torque, sd)
    };
    ended(run())
}

/// Writes torques, and their standard deviations where there is a place for them; both or none.
pub(crate) fn write_carry(
    carry: &GravityCompensation<armrs_real, ARMRS_JOINTS>,
    torque: &mut [armrs_real; ARMRS_JOINTS],
    sd: Option<&mut [armrs_real; ARMRS_JOINTS]>,
) -> Result<(), armrs_status> {
    if !carry.within {
        finite(array(&carry.torque))?;
        return Err(ARMRS_UNTRUSTED);
    }
    let (found, uncertain) = (finite(array(&carry.torque))?, finite(array(&carry.sd))?);
    *torque = found;
    if let Some(sd) = sd {
        *sd = uncertain;
    }
    Ok(())
}
