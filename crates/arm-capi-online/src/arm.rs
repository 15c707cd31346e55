//! The arm: its kinematics, dynamics and effects.

use core::mem::MaybeUninit;

use arm_core::effect::States;
use arm_core::{Equation, Load, Measured, Pose, forward_dynamics, gravity, jacobian, tip};

use crate::armrs_status::{self, *};
use crate::call::{array, ended, finite, given, joints, numbers, place, places};
use crate::held::{Held, held};
use crate::motion::armrs_motion;
use crate::{ARMRS_EFFECTS, ARMRS_JOINTS, ARMRS_UNKNOWNS, armrs_real};

/// What acts on an arm.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct armrs_load {
    /// Torques of motors or muscles in the joints [N m].
    pub torque: [armrs_real; ARMRS_JOINTS],
    /// Force on the arm at its tip, y and z [N].
    pub force_on_arm: [armrs_real; 2],
    /// Moment on the arm at its tip [N m].
    pub moment_on_arm: armrs_real,
}

/// An arm with its effects and their states.
#[repr(C)]
pub struct armrs_arm {
    tag: u64,
    words: [MaybeUninit<u64>; ARMRS_ARM_WORDS],
}

/// Size of an `armrs_arm`.
#[cfg(not(feature = "single"))]
pub const ARMRS_ARM_WORDS: usize = 216;
/// Size of an `armrs_arm`.
#[cfg(feature = "single")]
pub const ARMRS_ARM_WORDS: usize = 144;

/// What an arm is to the core.
pub type Core = Equation<armrs_real, ARMRS_JOINTS, ARMRS_UNKNOWNS, ARMRS_EFFECTS>;

/// An arm, its effects with the values given, and the states of those that have one.
#[derive(Clone, Copy)]
pub struct Kept {
    /// Its equation of motion.
    pub equation: Core,
    /// The states of each effect.
    pub memory: [States<armrs_real>; ARMRS_EFFECTS],
}

held!(armrs_arm holds Kept, b"arm  0.1");

/// Carries the states of effects (relaxation, thixotropy, a late stretch_reflex) over a period [s]; nothing for arms without
/// any. A motion that is not finite leaves them as they were.
///
/// # Safety
/// The pointers are null or point to what is said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_arm_advance(
    arm: *mut armrs_arm,
    motion: *const armrs_motion,
    period: armrs_real,
) -> armrs_status {
    let run = || {
        // SAFETY: as promised by the caller.
        let (arm, motion) = unsafe { (place(arm)?, given(motion)?) };
        let kept = arm.inner_mut()?;
        let [period] = finite([period])?;
        if period < 0.0 {
            return Err(ARMRS_OUT_OF_RANGE);
        }
        // A bad sample must not stay in the memory for ever.
        let mut memory = kept.memory;
        kept.equation.advance(&motion.core()?, &mut memory, period);
        for states in memory {
            finite(states)?;
        }
        kept.memory = memory;
        Ok(())
    };
    ended(run())
}

/// Where the tip is at joint angles: `point` is its position [m], `rows` the derivative of that to the angles, row y, then row z
/// [m/rad]. Either may be null.
///
/// cbindgen:ptrs-as-arrays=[[q; ARMRS_JOINTS], [point; 2]]
/// # Safety
/// The pointers are null or point to what is said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_kinematics(
    arm: *const armrs_arm,
    q: *const armrs_real,
    point: *mut armrs_real,
    rows: *mut [armrs_real; ARMRS_JOINTS],
) -> armrs_status {
    let run = || {
        // SAFETY: as promised by the caller.
        let (arm, q) = unsafe { (given(arm)?, numbers(q)?) };
        let (chain, pose) = (
            arm.inner()?.equation.chain(),
            Pose::new(&joints(&finite(*q)?)),
        );
        let position = finite(tip(chain, &pose))?;
        let columns: [[armrs_real; 2]; ARMRS_JOINTS] = jacobian(chain, &pose).into();
        let derivative = [columns.map(|[y, _]| y), columns.map(|[_, z]| z)];
        for row in derivative {
            finite(row)?;
        }
        // SAFETY: as promised by the caller.
        if let Ok(point) = unsafe { places(point) } {
            *point = position;
        }
        // SAFETY: as promised by the caller.
        if let Ok(rows) = unsafe { place(rows.cast::<[[armrs_real; ARMRS_JOINTS]; 2]>()) } {
            *rows = derivative;
        }
        Ok(())
    };
    ended(run())
}

/// Torques that hold the arm still against gravity [N m].
///
/// cbindgen:ptrs-as-arrays=[[q; ARMRS_JOINTS], [torque; ARMRS_JOINTS]]
/// # Safety
/// The pointers are null or point to what is said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_gravity(
    arm: *const armrs_arm,
    q: *const armrs_real,
    torque: *mut armrs_real,
) -> armrs_status {
    let run = || {
        // SAFETY: as promised by the caller.
        let (arm, q, torque) = unsafe { (given(arm)?, numbers(q)?, places(torque)?) };
        let found = gravity(arm.inner()?.equation.chain(), &Pose::new(&joints(q)));
        *torque = finite(array(&found))?;
        Ok(())
    };
    ended(run())
}

/// Torques with which the effects resist a motion [N m]. `force_on_arm`: at the tip, for friction that grows with the load;
/// null for none.
///
/// cbindgen:ptrs-as-arrays=[[force_on_arm; 2], [torque; ARMRS_JOINTS]]
/// # Safety
/// The pointers are null or point to what is said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_resistance(
    arm: *const armrs_arm,
    motion: *const armrs_motion,
    force_on_arm: *const armrs_real,
    torque: *mut armrs_real,
) -> armrs_status {
    let run = || {
        // SAFETY: as promised by the caller.
        let (arm, motion, torque) = unsafe { (given(arm)?, given(motion)?, places(torque)?) };
        // SAFETY: as promised by the caller.
        let force = unsafe { numbers(force_on_arm) }
            .copied()
            .unwrap_or_default();
        let seen = motion.core()?;
        let (kept, pose) = (arm.inner()?, Pose::new(&seen.q));
        let found = kept.equation.resisting(&pose, &seen, &kept.memory, force);
        *torque = finite(array(&found))?;
        Ok(())
    };
    ended(run())
}

/// Torques that motors would need for a motion under a load [N m]: inertia, gravity and effects, less what the load's force
/// and moment do. The load's own torques are not counted.
///
/// cbindgen:ptrs-as-arrays=[[torque; ARMRS_JOINTS]]
/// # Safety
/// The pointers are null or point to what is said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_inverse_dynamics(
    arm: *const armrs_arm,
    motion: *const armrs_motion,
    load: *const armrs_load,
    torque: *mut armrs_real,
) -> armrs_status {
    let run = || {
        // SAFETY: as promised by the caller.
        let (arm, motion) = unsafe { (given(arm)?.inner()?, given(motion)?) };
        // SAFETY: as promised by the caller.
        let (load, torque) = unsafe { (given(load)?, places::<ARMRS_JOINTS>(torque)?) };
        let load = Measured {
            torque: joints(&[0.0; ARMRS_JOINTS]),
            force_on_arm: load.force_on_arm,
            moment_on_arm: load.moment_on_arm,
        };
        let found = arm.equation.demanded(&motion.core()?, &arm.memory, &load);
        *torque = finite(array(&found))?;
        Ok(())
    };
    ended(run())
}

/// Accelerations of the joints under a load, effects included [rad/s^2]; those in `motion` are not read.
///
/// cbindgen:ptrs-as-arrays=[[acceleration; ARMRS_JOINTS]]
/// # Safety
/// The pointers are null or point to what is said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_forward_dynamics(
    arm: *const armrs_arm,
    motion: *const armrs_motion,
    load: *const armrs_load,
    acceleration: *mut armrs_real,
) -> armrs_status {
    let run = || {
        // SAFETY: as promised by the caller.
        let (arm, motion) = unsafe { (given(arm)?.inner()?, given(motion)?) };
        // SAFETY: as promised by the caller.
        let (load, acceleration) = unsafe { (given(load)?, places(acceleration)?) };
        let seen = motion.still().core()?;
        let pose = Pose::new(&seen.q);
        let (equation, force) = (&arm.equation, load.force_on_arm);
        let resisting = equation.resisting(&pose, &seen, &arm.memory, force);
        let net = Load {
            torque: joints(&core::array::from_fn(|j| load.torque[j] - resisting[j])),
            force_on_arm: force,
            moment_on_arm: load.moment_on_arm,
        };
        let found = forward_dynamics(equation.chain(), &pose, &seen.qd, &net);
        *acceleration = finite(array(&found))?;
        Ok(())
    };
    ended(run())
}
