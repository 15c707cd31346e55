//! Functions that create arms and their effects.

use core::ffi::{CStr, c_char};

use arm_capi_online::armrs_status::{self, *};
use arm_capi_online::call::{ended, given, numbers, place};
use arm_capi_online::held::Held;
use arm_core::effect::{ActsOn, Effect, KINDS, MAX_STATES, applied};
use arm_core::{Chain, Equation, Segment};

use crate::refusal::{Refusal, armrs_problem, status_of};
use crate::{ARMRS_EFFECTS, ARMRS_JOINTS, Kept, armrs_arm, armrs_real};

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

/// The effect of the catalogue with a name such as "coulomb", at a joint (or segment) counted from zero, with its default
/// values. ARMRS_CANNOT_ACT for those of the rig, the sensors and active muscles, ARMRS_UNKNOWN for a name that does not exist.
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
        if kind.needs_more_than_an_arm() {
            return Err(ARMRS_CANNOT_ACT);
        }
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
/// `segments`: ARMRS_JOINTS of them, proximal first. `effects`: `count` of them, at most ARMRS_EFFECTS. Those that act on the
/// arm itself (added_mass, gravity_moment, inertia, segment_length, motor_inertia, gravity_tilt) become part of it; those of
/// the joints stay effects, and their states start at zero. Those of the rig, of the sensors and of active muscles are refused with
/// ARMRS_CANNOT_ACT. An arm that cannot be is ARMRS_IMPLAUSIBLE: a segment longer than 3 m or heavier than 200 kg, a centre of
/// mass more than a quarter of the length beyond its segment, a radius of gyration above twice the length, gravity above
/// 30 m/s^2. `problem`, if not null, says what was refused.
///
/// cbindgen:ptrs-as-arrays=[[segments; ARMRS_JOINTS], [base; 2], [gravity; 2]]
/// # Safety
/// The pointers are null or point to what is said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_arm_init(
    arm: *mut armrs_arm,
    segments: *const armrs_segment,
    base: *const armrs_real,
    gravity: *const armrs_real,
    effects: *const armrs_effect,
    count: usize,
    problem: *mut armrs_problem,
) -> armrs_status {
    let run = || {
        // SAFETY: as promised by the caller; an array has the alignment of its elements.
        let (arm, segments) = unsafe {
            (
                place(arm)?,
                given(segments.cast::<[armrs_segment; ARMRS_JOINTS]>())?,
            )
        };
        // SAFETY: as promised by the caller.
        let (base, gravity) = unsafe { (numbers(base)?, numbers(gravity)?) };
        let segments = segments.map(|s| Segment {
            length: s.length,
            mass: s.mass,
            com: s.com,
            inertia: s.inertia,
        });
        if count > ARMRS_EFFECTS {
            let limits = [count as armrs_real, 0.0, ARMRS_EFFECTS as armrs_real];
            return Err(
                Refusal::named(ARMRS_OUT_OF_RANGE, ["number of effects", ""], 0).numbers(limits),
            );
        }
        // SAFETY: there are `count` effects.
        let mut kept = unsafe { taken(effects, count)? };
        let bare = Chain::new(segments, *base, *gravity)?;
        let chain = applied(&bare, &kept).map_err(|(index, why)| {
            let kind = kept.get(index).map_or("", |e| e.kind.info().kind);
            Refusal::of_effect(why, kind, index)
        })?;
        plausible(&chain)?;
        // What is now part of the arm must not act twice.
        for effect in kept.iter_mut().filter(|e| e.kind.acts_on() == ActsOn::Arm) {
            *effect = off();
        }
        arm.keep(&Kept {
            equation: Equation::new(chain, kept)?,
            memory: [[0.0; MAX_STATES]; ARMRS_EFFECTS],
        });
        Ok(())
    };
    // SAFETY: as promised by the caller.
    unsafe { status_of(run(), problem) }
}

/// The effects of a list, and none in the other places.
///
/// # Safety
/// There are `count` effects behind the pointer, at most ARMRS_EFFECTS, or it is null.
unsafe fn taken(
    effects: *const armrs_effect,
    count: usize,
) -> Result<[Effect<armrs_real>; ARMRS_EFFECTS], Refusal> {
    let mut kept = [off(); ARMRS_EFFECTS];
    for (i, effect) in kept.iter_mut().take(count).enumerate() {
        // SAFETY: as promised by the caller.
        let from = unsafe { given(effects.wrapping_add(i))? };
        let unknown = || Refusal::named(ARMRS_UNKNOWN, ["number of the kind", ""], i);
        let kind = *KINDS.get(from.kind as usize).ok_or_else(unknown)?;
        *effect = Effect {
            parameters: from.parameters,
            ..Effect::new(kind, from.joint as usize)
        };
    }
    Ok(kept)
}

/// Longest segment [m], and heaviest [kg].
const LARGEST: [f64; 2] = [3.0, 200.0];
/// How far beyond its segment a centre of mass may lie, in lengths: a hand's grip is nearer than its fingers.
const BEYOND: f64 = 0.25;
/// Largest radius of gyration, in lengths.
const WIDEST: f64 = 2.0;
/// Strongest gravity [m/s^2].
const STRONGEST: f64 = 30.0;

#[inline(never)]
fn within(
    name: &'static str,
    index: usize,
    found: armrs_real,
    min: armrs_real,
    max: armrs_real,
) -> Result<(), Refusal> {
    if found >= min && found <= max {
        return Ok(());
    }
    Err(Refusal::named(ARMRS_IMPLAUSIBLE, [name, ""], index).numbers([found, min, max]))
}

/// Whether an arm can be one of a person or of a machine that a person is led by; units that were confused make it none.
#[inline(never)]
fn plausible(chain: &Chain<armrs_real, ARMRS_JOINTS>) -> Result<(), Refusal> {
    let [longest, heaviest] = LARGEST.map(|v| v as armrs_real);
    let beyond = BEYOND as armrs_real;
    for (index, s) in chain.segments().iter().enumerate() {
        within("length of segment", index, s.length, 0.0, longest)?;
        within("mass of segment", index, s.mass, 0.0, heaviest)?;
        let (min, max) = (-beyond * s.length, (1.0 + beyond) * s.length);
        within(
            "centre of mass of segment, along",
            index,
            s.com[0],
            min,
            max,
        )?;
        let side = (1.0 + beyond) * s.length;
        within(
            "centre of mass of segment, normal",
            index,
            s.com[1],
            -side,
            side,
        )?;
        let reach = WIDEST as armrs_real * s.length;
        within(
            "inertia of segment",
            index,
            s.inertia,
            0.0,
            s.mass * reach * reach,
        )?;
    }
    let strongest = STRONGEST as armrs_real;
    for (index, &g) in chain.gravity().iter().enumerate() {
        within("gravity component", index, g, -strongest, strongest)?;
    }
    Ok(())
}

/// A place without an effect.
fn off() -> Effect<armrs_real> {
    Effect {
        on: false,
        ..Effect::new(KINDS[0], 0)
    }
}
