//! Identification while the arm moves.

use core::mem::MaybeUninit;

use arm_core::Measured;
use arm_core::estimator::{Decision, Estimator, Fault, Sample, SampleStatus};

use crate::arm::armrs_load;
use crate::armrs_status::{self, *};
use crate::call::{ended, finite, given, joints, place, places};
use crate::compensation::write_carry;
use crate::held::{Held, held};
use crate::motion::armrs_motion;
use crate::{ARMRS_EFFECTS, ARMRS_JOINTS, ARMRS_UNKNOWNS, armrs_real};

/// The measurements of one control period.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct armrs_sample {
    /// Joint angles [rad].
    pub q: [armrs_real; ARMRS_JOINTS],
    /// Joint angles from which speeds are taken, where better ones than `q` are known: from the robot's encoders or its
    /// command [rad].
    pub lead: [armrs_real; ARMRS_JOINTS],
    /// Not 0 where `lead` is given.
    pub led: u32,
    /// What acts on the arm.
    pub load: armrs_load,
}

/// What became of a sample.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum armrs_sample_status {
    /// It counts.
    ARMRS_TAKEN = 0,
    /// No joint moves: it says nothing.
    ARMRS_RESTING = 1,
    /// The filters have not yet settled after a start or a gap.
    ARMRS_SETTLING = 2,
    /// There was none.
    ARMRS_MISSING = 3,
    /// A value that is NaN or infinite.
    ARMRS_BAD_VALUE = 4,
    /// A value that jumped farther than it can move.
    ARMRS_SPIKE = 5,
    /// A value that stayed the same to the last bit while the arm moved.
    ARMRS_FROZEN = 6,
    /// Torques that what has been learned so far does not explain.
    ARMRS_UNEXPECTED = 7,
    /// A value that the arm cannot have: an angle outside its range (a turn off, degrees), a load that it does not bear.
    ARMRS_NOT_POSSIBLE = 8,
    /// The estimator's own state was not finite; it started anew.
    ARMRS_RESTARTED = 9,
}

impl From<SampleStatus> for armrs_sample_status {
    fn from(sample_status: SampleStatus) -> Self {
        match sample_status {
            SampleStatus::Taken => Self::ARMRS_TAKEN,
            SampleStatus::Resting => Self::ARMRS_RESTING,
            SampleStatus::Settling => Self::ARMRS_SETTLING,
            SampleStatus::Refused(Fault::Missing) => Self::ARMRS_MISSING,
            SampleStatus::Refused(Fault::NotFinite) => Self::ARMRS_BAD_VALUE,
            SampleStatus::Refused(Fault::Spike) => Self::ARMRS_SPIKE,
            SampleStatus::Refused(Fault::Frozen) => Self::ARMRS_FROZEN,
            SampleStatus::Refused(Fault::Unexpected) => Self::ARMRS_UNEXPECTED,
            SampleStatus::Refused(Fault::Implausible) => Self::ARMRS_NOT_POSSIBLE,
            SampleStatus::Refused(Fault::Restarted) => Self::ARMRS_RESTARTED,
        }
    }
}

/// What a value rests on.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum armrs_decision {
    /// The data.
    ARMRS_BY_DATA = 0,
    /// What was assumed beforehand: it is not yet identified.
    ARMRS_BY_PRIOR = 1,
    /// A bound that the data push against.
    ARMRS_BY_BOUND = 2,
}

/// What is known of one unknown.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct armrs_estimate {
    /// The value, within its bounds.
    pub value: armrs_real,
    /// Its standard deviation.
    pub sd: armrs_real,
    /// What it rests on.
    pub decided_by: armrs_decision,
}

/// How well an estimator does.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct armrs_health {
    /// What became of the last sample.
    pub last: armrs_sample_status,
    /// How often the estimator's state was not finite, and was started anew.
    pub restarts: u32,
    /// How much larger the standard deviations are than the declared noise would make them; at least 1.
    pub excess: armrs_real,
    /// Usual size of the torque that the estimate does not explain, by joint [N m].
    pub residual: [armrs_real; ARMRS_JOINTS],
    /// Time since a sample was last learned from [s].
    pub age: armrs_real,
}

/// An estimator and all that it has learned.
#[repr(C)]
pub struct armrs_estimator {
    tag: u64,
    words: [MaybeUninit<u64>; ARMRS_ESTIMATOR_WORDS],
}

/// Size of an `armrs_estimator`.
#[cfg(not(feature = "single"))]
pub const ARMRS_ESTIMATOR_WORDS: usize = 1850;
/// Size of an `armrs_estimator`.
#[cfg(feature = "single")]
pub const ARMRS_ESTIMATOR_WORDS: usize = 910;

type Core = Estimator<armrs_real, ARMRS_JOINTS, ARMRS_UNKNOWNS, ARMRS_EFFECTS>;

held!(armrs_estimator holds Core, b"estim0.1");

/// One control period; `sample` is null where one is missing. `sample_status`, if not null, says what became of it.
///
/// # Safety
/// The pointers are null or point to what is said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_estimator_update(
    estimator: *mut armrs_estimator,
    sample: *const armrs_sample,
    sample_status: *mut armrs_sample_status,
) -> armrs_status {
    let run = || {
        // SAFETY: as promised by the caller.
        let (estimator, sample, sample_status) =
            unsafe { (place(estimator)?, sample.as_ref(), sample_status.as_mut()) };
        let sample = sample.map(|s| Sample {
            q: joints(&s.q),
            lead: (s.led != 0).then(|| joints(&s.lead)),
            measured: Measured {
                torque: joints(&s.load.torque),
                force_on_arm: s.load.force_on_arm,
                moment_on_arm: s.load.moment_on_arm,
            },
        });
        let found = estimator.inner_mut()?.update(sample.as_ref());
        if let Some(sample_status) = sample_status {
            *sample_status = found.into();
        }
        Ok(())
    };
    ended(run())
}

/// What is known of an unknown: first moments of the joints, second moments, then the linear parameters of the effects.
///
/// # Safety
/// The pointers are null or point to what is said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_estimator_get(
    estimator: *const armrs_estimator,
    unknown: usize,
    estimate: *mut armrs_estimate,
) -> armrs_status {
    let run = || {
        // SAFETY: as promised by the caller.
        let (estimator, estimate) = unsafe { (given(estimator)?, place(estimate)?) };
        let core = estimator.inner()?;
        let used = core.estimates().iter().take(core.equation().used());
        let found = used.into_iter().nth(unknown).ok_or(ARMRS_OUT_OF_RANGE)?;
        *estimate = armrs_estimate {
            value: found.value,
            sd: found.sd,
            decided_by: match found.decided_by {
                Decision::Data => armrs_decision::ARMRS_BY_DATA,
                Decision::Prior => armrs_decision::ARMRS_BY_PRIOR,
                Decision::Bound => armrs_decision::ARMRS_BY_BOUND,
            },
        };
        Ok(())
    };
    ended(run())
}

/// Torques that carry the arm: its weight, and what its effects resist with at the speeds of `motion`; accelerations are not
/// read. `sd`, if not null: their standard deviations [N m]. ARMRS_UNTRUSTED where they leave the `envelope` of the settings.
///
/// cbindgen:ptrs-as-arrays=[[torque; ARMRS_JOINTS], [sd; ARMRS_JOINTS]]
/// # Safety
/// The pointers are null or point to what is said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_estimator_carry(
    estimator: *const armrs_estimator,
    motion: *const armrs_motion,
    torque: *mut armrs_real,
    sd: *mut armrs_real,
) -> armrs_status {
    let run = || {
        // SAFETY: as promised by the caller.
        let (estimator, motion) = unsafe { (given(estimator)?, given(motion)?) };
        // SAFETY: as promised by the caller.
        let (torque, sd) = unsafe { (places(torque)?, places(sd).ok()) };
        let carry = estimator.inner()?.carry(&motion.still().core()?);
        write_carry(&carry, torque, sd)
    };
    ended(run())
}

/// How well an estimator does: limit the support, or end it, by `age`, `residual` and `excess`.
///
/// # Safety
/// The pointers are null or point to what is said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_estimator_health(
    estimator: *const armrs_estimator,
    health: *mut armrs_health,
) -> armrs_status {
    let run = || {
        // SAFETY: as promised by the caller.
        let (estimator, health) = unsafe { (given(estimator)?, place(health)?) };
        let found = estimator.inner()?.health();
        let [excess, age] = finite([found.excess, found.age])?;
        *health = armrs_health {
            last: found.last.into(),
            restarts: found.restarts,
            excess,
            residual: finite(found.residual)?,
            age,
        };
        Ok(())
    };
    ended(run())
}
