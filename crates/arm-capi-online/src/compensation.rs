//! Torques that carry an arm identified elsewhere.

use core::mem::MaybeUninit;

use arm_core::effect::MAX_STATES;
use arm_core::{Compensation, GravityCompensation};

use crate::armrs_status::{self, *};
use crate::call::{array, ended, finite, given, places};
use crate::held::{Held, held};
use crate::motion::armrs_motion;
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
pub fn write_carry(
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
