//! The arm: its kinematics, dynamics and effects.

use core::ffi::{CStr, c_char};
use core::mem::MaybeUninit;

use arm_core::effect::{Effect, KINDS, Kind, Motion, resisting_torque};
use arm_core::{
    Chain, Equation, Load, Pose, Segment, forward_dynamics, gravity, inverse_dynamics, jacobian,
    joint_force, static_torque, tip,
};

use crate::held::{Held, held};
use crate::motion::{armrs_motion, array, joints};
use crate::status::{
    ARMRS_NULL, ARMRS_OUT_OF_RANGE, ARMRS_UNKNOWN, armrs_status, ended, finite, given, place,
};
use crate::{ARMRS_EFFECTS, ARMRS_JOINTS, ARMRS_UNKNOWNS, armrs_real};

/// One rigid segment.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct armrs_segment {
    /// Distance from the proximal to the distal joint [m].
    pub length: armrs_real,
    /// Mass [kg].
    pub mass: armrs_real,
    /// Centre of mass from the proximal joint: along the segment, and normal to it [m].
    pub com: [armrs_real; 2],
    /// Moment of inertia about the centre of mass [kg m^2].
    pub inertia: armrs_real,
}

/// One effect: friction, a spring, an end stop. `armrs_effect_named` fills it.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct armrs_effect {
    /// Number of the kind in the catalogue.
    pub kind: u32,
    /// Joint, counted from zero; joint 1 stands for a pair 0 and 1.
    pub joint: u32,
    /// Parameters in the order of the catalogue; unused ones are zero.
    pub parameters: [armrs_real; 6],
}

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
pub const ARMRS_ARM_WORDS: usize = 192;
/// Size of an `armrs_arm`.
#[cfg(feature = "single")]
pub const ARMRS_ARM_WORDS: usize = 132;

pub(crate) type Core = Equation<armrs_real, ARMRS_JOINTS, ARMRS_UNKNOWNS, ARMRS_EFFECTS>;

/// An arm, its effects with the values given, and the states of those that have one.
#[derive(Clone, Copy)]
pub struct Kept {
    pub(crate) equation: Core,
    pub(crate) memory: [armrs_real; ARMRS_EFFECTS],
}

held!(armrs_arm holds Kept, b"arm  0.1");

/// The effect of the catalogue with a name such as "coulomb", at a joint counted from zero, with its default values.
///
/// # Safety
/// `name` is null or a string that ends with zero; `effect` is null or points to an effect.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_effect_named(
    name: *const c_char,
    joint: u32,
    effect: *mut armrs_effect,
) -> armrs_status {
    let run = || {
        if name.is_null() {
            return Err(ARMRS_NULL);
        }
        // SAFETY: it is not null, and ends with zero.
        let name = unsafe { CStr::from_ptr(name) }.to_bytes();
        // SAFETY: as promised by the caller.
        let effect = unsafe { place(effect)? };
        let mut found = KINDS.iter().enumerate();
        let (number, kind) = found
            .find(|(_, kind)| kind.info().kind.as_bytes() == name)
            .ok_or(ARMRS_UNKNOWN)?;
        *effect = armrs_effect {
            kind: number as u32,
            joint,
            parameters: Effect::new(*kind, joint as usize).parameters,
        };
        Ok(())
    };
    ended(run())
}

/// Makes an arm that hangs at `base` [m] under `gravity` [m/s^2], usually {0, -9.81}.
///
/// `effects`: `count` of them, at most ARMRS_EFFECTS; those that act in joints. Their states start at zero.
///
/// # Safety
/// The pointers are null or point to what is said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_arm_init(
    arm: *mut armrs_arm,
    segments: *const [armrs_segment; ARMRS_JOINTS],
    base: *const [armrs_real; 2],
    gravity: *const [armrs_real; 2],
    effects: *const armrs_effect,
    count: usize,
) -> armrs_status {
    let run = || {
        // SAFETY: as promised by the caller.
        let (arm, segments) = unsafe { (place(arm)?, given(segments)?) };
        // SAFETY: as promised by the caller.
        let (base, gravity) = unsafe { (given(base)?, given(gravity)?) };
        let segments = segments.map(|s| Segment {
            length: s.length,
            mass: s.mass,
            com: s.com,
            inertia: s.inertia,
        });
        let mut kept = [off(); ARMRS_EFFECTS];
        if count > ARMRS_EFFECTS {
            return Err(ARMRS_OUT_OF_RANGE);
        }
        for (i, effect) in kept.iter_mut().take(count).enumerate() {
            // SAFETY: there are `count` effects.
            let from = unsafe { given(effects.wrapping_add(i))? };
            let kind = *KINDS.get(from.kind as usize).ok_or(ARMRS_UNKNOWN)?;
            *effect = Effect {
                parameters: from.parameters,
                ..Effect::new(kind, from.joint as usize)
            };
        }
        arm.keep(&Kept {
            equation: Equation::new(Chain::new(segments, *base, *gravity)?, kept)?,
            memory: [0.0; ARMRS_EFFECTS],
        });
        Ok(())
    };
    ended(run())
}

/// A place without an effect.
fn off() -> Effect<armrs_real> {
    Effect {
        on: false,
        ..Effect::new(Kind::Viscous, 0)
    }
}

/// Carries the states of effects (relaxation, thixotropy) over a period [s]; nothing for arms without any. A motion that is not
/// finite leaves them as they were.
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
        kept.memory = finite(memory)?;
        Ok(())
    };
    ended(run())
}

/// Where the tip is at joint angles: `point` is its position [m], `rows` the derivative of that to the angles, row y, then row z
/// [m/rad]. Either may be null.
///
/// # Safety
/// The pointers are null or point to what is said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_kinematics(
    arm: *const armrs_arm,
    q: *const [armrs_real; ARMRS_JOINTS],
    point: *mut [armrs_real; 2],
    rows: *mut [[armrs_real; ARMRS_JOINTS]; 2],
) -> armrs_status {
    let run = || {
        // SAFETY: as promised by the caller.
        let (arm, q) = unsafe { (given(arm)?, given(q)?) };
        let (chain, pose) = (
            arm.inner()?.equation.chain(),
            Pose::new(&joints(&finite(*q)?)),
        );
        // SAFETY: as promised by the caller.
        if let Some(point) = unsafe { point.as_mut() } {
            *point = tip(chain, &pose);
        }
        // SAFETY: as promised by the caller.
        if let Some(rows) = unsafe { rows.as_mut() } {
            let found = jacobian(chain, &pose);
            *rows = [0, 1].map(|row| core::array::from_fn(|j| found[(row, j)]));
        }
        Ok(())
    };
    ended(run())
}

/// Torques that hold the arm still against gravity [N m].
///
/// # Safety
/// The pointers are null or point to what is said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_gravity(
    arm: *const armrs_arm,
    q: *const [armrs_real; ARMRS_JOINTS],
    torque: *mut [armrs_real; ARMRS_JOINTS],
) -> armrs_status {
    let run = || {
        // SAFETY: as promised by the caller.
        let (arm, q, torque) = unsafe { (given(arm)?, given(q)?, place(torque)?) };
        let found = gravity(arm.inner()?.equation.chain(), &Pose::new(&joints(q)));
        *torque = finite(array(&found))?;
        Ok(())
    };
    ended(run())
}

/// Torques with which the effects resist a motion [N m]. `force_on_arm`: at the tip, for friction that grows with the load;
/// null for none.
///
/// # Safety
/// The pointers are null or point to what is said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_resistance(
    arm: *const armrs_arm,
    motion: *const armrs_motion,
    force_on_arm: *const [armrs_real; 2],
    torque: *mut [armrs_real; ARMRS_JOINTS],
) -> armrs_status {
    let run = || {
        // SAFETY: as promised by the caller.
        let (arm, motion, torque) = unsafe { (given(arm)?, given(motion)?, place(torque)?) };
        // SAFETY: as promised by the caller.
        let force = unsafe { force_on_arm.as_ref() }
            .copied()
            .unwrap_or_default();
        let seen = motion.core()?;
        let found = resistance(arm.inner()?, &Pose::new(&seen.q), &seen, force);
        *torque = finite(array(&found))?;
        Ok(())
    };
    ended(run())
}

fn resistance(
    arm: &Kept,
    pose: &Pose<armrs_real, ARMRS_JOINTS>,
    seen: &Motion<armrs_real, ARMRS_JOINTS>,
    force: [armrs_real; 2],
) -> arm_core::Joints<armrs_real, ARMRS_JOINTS> {
    let chain = arm.equation.chain();
    let effects = arm.equation.effects();
    if !arm.equation.feels_force() {
        return resisting_torque(effects, seen, &arm.memory);
    }
    let bearing = joint_force(chain, pose, (&seen.qd, &seen.qdd), force);
    resisting_torque(effects, &seen.with_joint_force(&bearing), &arm.memory)
}

/// Torques that motors would need for a motion under a load [N m]: inertia, gravity and effects, less what the load's force
/// and moment do. The load's own torques are not counted.
///
/// # Safety
/// The pointers are null or point to what is said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_inverse_dynamics(
    arm: *const armrs_arm,
    motion: *const armrs_motion,
    load: *const armrs_load,
    torque: *mut [armrs_real; ARMRS_JOINTS],
) -> armrs_status {
    let run = || {
        // SAFETY: as promised by the caller.
        let (arm, motion) = unsafe { (given(arm)?.inner()?, given(motion)?) };
        // SAFETY: as promised by the caller.
        let (load, torque) = unsafe { (given(load)?, place(torque)?) };
        let (chain, seen) = (arm.equation.chain(), motion.core()?);
        let pose = Pose::new(&seen.q);
        let moving = inverse_dynamics(chain, &pose, &seen.qd, &seen.qdd);
        let resisting = resistance(arm, &pose, &seen, load.force_on_arm);
        let pushed = static_torque(chain, &pose, load.force_on_arm, load.moment_on_arm);
        *torque = finite(core::array::from_fn(|j| {
            moving[j] + resisting[j] - pushed[j]
        }))?;
        Ok(())
    };
    ended(run())
}

/// Accelerations of the joints under a load, effects included [rad/s^2]; those in `motion` are not read.
///
/// # Safety
/// The pointers are null or point to what is said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_forward_dynamics(
    arm: *const armrs_arm,
    motion: *const armrs_motion,
    load: *const armrs_load,
    acceleration: *mut [armrs_real; ARMRS_JOINTS],
) -> armrs_status {
    let run = || {
        // SAFETY: as promised by the caller.
        let (arm, motion) = unsafe { (given(arm)?.inner()?, given(motion)?) };
        // SAFETY: as promised by the caller.
        let (load, acceleration) = unsafe { (given(load)?, place(acceleration)?) };
        let seen = motion.still().core()?;
        let pose = Pose::new(&seen.q);
        let resisting = resistance(arm, &pose, &seen, load.force_on_arm);
        let net = Load {
            torque: joints(&core::array::from_fn(|j| load.torque[j] - resisting[j])),
            force_on_arm: load.force_on_arm,
            moment_on_arm: load.moment_on_arm,
        };
        let found = forward_dynamics(arm.equation.chain(), &pose, &seen.qd, &net);
        *acceleration = finite(array(&found))?;
        Ok(())
    };
    ended(run())
}
