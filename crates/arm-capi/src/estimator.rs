//! Functions that create estimators.

use arm_capi_online::armrs_status;
use arm_capi_online::call::{ended, given, place};
use arm_capi_online::held::Held;
use arm_core::estimator::{Estimator, Settings};

use crate::refusal::{armrs_problem, status_of};
use crate::{ARMRS_JOINTS, armrs_arm, armrs_estimator, armrs_real};

/// How an estimator works; `armrs_estimator_settings` fills it for an arm, with every guard on. Infinite values switch one off.
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
    /// Smallest and largest angle of each joint [rad]; beyond it a sample is refused.
    pub range: [[armrs_real; 2]; ARMRS_JOINTS],
    /// Fastest that a joint can move [rad/s].
    pub fastest: armrs_real,
    /// Fastest that a force [N/s] or torque [N m/s] can change.
    pub steepest: armrs_real,
    /// Largest force at the hand [N].
    pub largest_force: armrs_real,
    /// Largest torque in a joint and moment at the hand [N m].
    pub largest_torque: armrs_real,
    /// Unexplained torques beyond this many times the usual ones are not learned from.
    pub gate: armrs_real,
    /// How long a sensor may show the same bits while the arm moves [s].
    pub frozen_after: armrs_real,
    /// Farthest that the torque which carries the arm may be from that of the arm given to `armrs_estimator_init`, by joint
    /// [N m]; beyond it `armrs_estimator_carry` is ARMRS_UNTRUSTED.
    pub envelope: [armrs_real; ARMRS_JOINTS],
    /// Time in which what was learned fades while the arm moves [s].
    pub forgetting: armrs_real,
}

/// Copies settings from C to the core, or back: the fields have the same names.
macro_rules! copy_settings {
    ($to:expr, $from:expr) => {{
        let (to, from) = (&mut $to, &$from);
        to.period = from.period;
        to.cutoff = from.cutoff;
        to.window = from.window;
        to.noise = from.noise;
        to.dead_band = from.dead_band;
        to.range = from.range;
        to.fastest = from.fastest;
        to.steepest = from.steepest;
        to.largest_force = from.largest_force;
        to.largest_torque = from.largest_torque;
        to.gate = from.gate;
        to.frozen_after = from.frozen_after;
        to.envelope = from.envelope;
        to.forgetting = from.forgetting;
    }};
}

/// Fills settings for an arm and a control period [s]: movements to 3 Hz, joints within half a turn and below 20 rad/s, loads
/// below ten times the arm's weight, sensors not frozen for half a second, a support within half of each joint's largest
/// weight torque of the expected one.
///
/// # Safety
/// The pointers are null or point to what is said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_estimator_settings(
    settings: *mut armrs_settings,
    arm: *const armrs_arm,
    period: armrs_real,
) -> armrs_status {
    let run = || {
        // SAFETY: as promised by the caller.
        let (settings, arm) = unsafe { (place(settings)?, given(arm)?) };
        let found = Settings::new(arm.inner()?.equation.chain(), period);
        copy_settings!(*settings, found);
        Ok(())
    };
    ended(run())
}

/// Makes an estimator that starts from an arm: base parameters as of the arm, uncertain by `uncertainty` of masses, centres of
/// mass and inertias; effects as given, their linear parameters otherwise open. `problem`, if not null, says what was refused.
///
/// # Safety
/// The pointers are null or point to what is said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_estimator_init(
    estimator: *mut armrs_estimator,
    arm: *const armrs_arm,
    uncertainty: armrs_real,
    settings: *const armrs_settings,
    problem: *mut armrs_problem,
) -> armrs_status {
    let run = || {
        // SAFETY: as promised by the caller.
        let (estimator, arm, s) = unsafe { (place(estimator)?, given(arm)?, given(settings)?) };
        let equation = arm.inner()?.equation;
        let mut settings = Settings::new(equation.chain(), s.period);
        copy_settings!(settings, *s);
        let priors = equation.priors(uncertainty);
        estimator.keep(&Estimator::new(equation, priors, &settings)?);
        Ok(())
    };
    // SAFETY: as promised by the caller.
    unsafe { status_of(run(), problem) }
}
