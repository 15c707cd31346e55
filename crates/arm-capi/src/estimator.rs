//! Identification while the arm moves.

use core::mem::MaybeUninit;

use arm_core::Measured;
use arm_core::estimator::{Decision, Estimator, Fault, Heed, Sample, Settings};

use crate::arm::armrs_arm;
use crate::compensation::write_carry;
use crate::held::{Held, held};
use crate::motion::{armrs_motion, joints};
use crate::status::{ARMRS_OUT_OF_RANGE, armrs_status, ended, given, place};
use crate::{ARMRS_EFFECTS, ARMRS_JOINTS, ARMRS_UNKNOWNS, armrs_load, armrs_real};

/// How an estimator works; `armrs_estimator_settings` fills it. Infinite values switch a check off.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct armrs_settings {
    /// Control period [s].
    pub period: armrs_real,
    /// Cutoff of the low-pass from which speeds and accelerations come [Hz].
    pub cutoff: armrs_real,
    /// Time over which the equation of motion is averaged before it counts [s].
    pub window: armrs_real,
    /// Standard deviation of such an average, by joint [N m].
    pub noise: [armrs_real; ARMRS_JOINTS],
    /// Speed below which a joint counts as at rest [rad/s].
    pub dead_band: armrs_real,
    /// Fastest that a joint can move [rad/s].
    pub fastest: armrs_real,
    /// Fastest that a force [N/s] or torque [N m/s] can change.
    pub steepest: armrs_real,
    /// Unexplained torques beyond this many times the usual ones are not learned from.
    pub gate: armrs_real,
    /// How long a sensor may show the same bits while the arm moves [s].
    pub frozen_after: armrs_real,
    /// Time in which what was learned fades while the arm moves [s].
    pub forgetting: armrs_real,
}

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
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum armrs_heed {
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
}

impl From<Heed> for armrs_heed {
    fn from(heed: Heed) -> Self {
        match heed {
            Heed::Taken => Self::ARMRS_TAKEN,
            Heed::Resting => Self::ARMRS_RESTING,
            Heed::Settling => Self::ARMRS_SETTLING,
            Heed::Refused(Fault::Missing) => Self::ARMRS_MISSING,
            Heed::Refused(Fault::NotFinite) => Self::ARMRS_BAD_VALUE,
            Heed::Refused(Fault::Spike) => Self::ARMRS_SPIKE,
            Heed::Refused(Fault::Frozen) => Self::ARMRS_FROZEN,
            Heed::Refused(Fault::Unexpected) => Self::ARMRS_UNEXPECTED,
        }
    }
}

/// What a value rests on.
#[repr(C)]
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

/// An estimator and all that it has learned.
#[repr(C)]
pub struct armrs_estimator {
    tag: u64,
    words: [MaybeUninit<u64>; ARMRS_ESTIMATOR_WORDS],
}

/// Size of an `armrs_estimator`.
#[cfg(not(feature = "single"))]
pub const ARMRS_ESTIMATOR_WORDS: usize = 1368;
/// Size of an `armrs_estimator`.
#[cfg(feature = "single")]
pub const ARMRS_ESTIMATOR_WORDS: usize = 736;

type Core = Estimator<armrs_real, ARMRS_JOINTS, ARMRS_UNKNOWNS, ARMRS_EFFECTS>;

held!(armrs_estimator holds Core, b"estim0.1");

/// Settings of C from those of the core, and back: the fields have the same names.
macro_rules! with_fields_of {
    ($to:ident, $from:ident) => {
        $to {
            period: $from.period,
            cutoff: $from.cutoff,
            window: $from.window,
            noise: $from.noise,
            dead_band: $from.dead_band,
            fastest: $from.fastest,
            steepest: $from.steepest,
            gate: $from.gate,
            frozen_after: $from.frozen_after,
            forgetting: $from.forgetting,
        }
    };
}

/// Fills settings for a control period [s]: movements to 3 Hz, only what is not finite is refused.
///
/// # Safety
/// The pointers are null or point to what is said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_estimator_settings(
    settings: *mut armrs_settings,
    period: armrs_real,
) -> armrs_status {
    let run = || {
        // SAFETY: as promised by the caller.
        let settings = unsafe { place(settings)? };
        let s = Settings::<armrs_real, ARMRS_JOINTS>::new(period);
        *settings = with_fields_of!(armrs_settings, s);
        Ok(())
    };
    ended(run())
}

/// Makes an estimator that starts from an arm: base parameters as of the arm, uncertain by `uncertainty` of masses, centres of
/// mass and inertias; effects as given, their linear parameters otherwise open.
///
/// # Safety
/// The pointers are null or point to what is said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_estimator_init(
    estimator: *mut armrs_estimator,
    arm: *const armrs_arm,
    uncertainty: armrs_real,
    settings: *const armrs_settings,
) -> armrs_status {
    let run = || {
        // SAFETY: as promised by the caller.
        let (estimator, arm, s) = unsafe { (place(estimator)?, given(arm)?, given(settings)?) };
        let equation = arm.inner()?.equation;
        let settings = with_fields_of!(Settings, s);
        let priors = equation.priors(uncertainty);
        estimator.keep(&Estimator::new(equation, priors, &settings)?);
        Ok(())
    };
    ended(run())
}

/// One control period; `sample` is null where one is missing. `heed`, if not null, says what became of it.
///
/// # Safety
/// The pointers are null or point to what is said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_estimator_update(
    estimator: *mut armrs_estimator,
    sample: *const armrs_sample,
    heed: *mut armrs_heed,
) -> armrs_status {
    let run = || {
        // SAFETY: as promised by the caller.
        let (estimator, sample, heed) =
            unsafe { (place(estimator)?, sample.as_ref(), heed.as_mut()) };
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
        if let Some(heed) = heed {
            *heed = found.into();
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
/// read. `sd`, if not null: their standard deviations [N m].
///
/// # Safety
/// The pointers are null or point to what is said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_estimator_carry(
    estimator: *const armrs_estimator,
    motion: *const armrs_motion,
    torque: *mut [armrs_real; ARMRS_JOINTS],
    sd: *mut [armrs_real; ARMRS_JOINTS],
) -> armrs_status {
    let run = || {
        // SAFETY: as promised by the caller.
        let (estimator, motion) = unsafe { (given(estimator)?, given(motion)?) };
        // SAFETY: as promised by the caller.
        let (torque, sd) = unsafe { (place(torque)?, sd.as_mut()) };
        let carry = estimator.inner()?.carry(&motion.still().core()?);
        write_carry(&carry, torque, sd)
    };
    ended(run())
}
