use core::ffi::c_char;

use arm_core::Invalid;

use crate::armrs_real;

/// What a call came to.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum armrs_status {
    /// Done.
    ARMRS_OK = 0,
    /// A pointer is null.
    ARMRS_NULL = 1,
    /// A struct was not made by its `_init` function.
    ARMRS_NOT_INITIALISED = 2,
    /// A value that was given is NaN or infinite, or makes a result so; nothing was written.
    ARMRS_NOT_FINITE = 3,
    /// A value or a number of things is outside what is allowed.
    ARMRS_OUT_OF_RANGE = 4,
    /// The robot does not reach the point.
    ARMRS_OUT_OF_REACH = 5,
    /// No effect has this name or number.
    ARMRS_UNKNOWN = 6,
    /// The monitor has stopped the device.
    ARMRS_STOPPED = 7,
    /// An effect acts on the rig or the sensors, or depends on muscle activity: an arm alone has none.
    ARMRS_CANNOT_ACT = 8,
    /// An arm that cannot be: a tonne, a centre of mass far beyond its segment.
    ARMRS_IMPLAUSIBLE = 9,
    /// A torque farther from that of the arm that was expected than `envelope` allows; nothing was written.
    ARMRS_UNTRUSTED = 10,
    /// Memory that was sealed has changed.
    ARMRS_CORRUPT = 11,
}

/// Length of `armrs_problem.what`, its final zero included.
pub const ARMRS_WHAT: usize = 56;

/// What an `_init` function refused. Filled only where it does not return ARMRS_OK; where nothing more than the status is known,
/// `what` is empty.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct armrs_problem {
    /// Name of the quantity, for effects behind that of the kind: "coulomb: torque". Ends with zero.
    pub what: [c_char; ARMRS_WHAT],
    /// Which segment, joint, effect or channel, counted from zero.
    pub index: u32,
    /// What was found; zero where it is no number.
    pub found: armrs_real,
    /// Smallest value allowed.
    pub min: armrs_real,
    /// Largest value allowed.
    pub max: armrs_real,
}

pub(crate) use armrs_status::*;

/// Why a state is not made.
pub(crate) struct Refusal {
    status: armrs_status,
    words: [&'static str; 2],
    index: usize,
    numbers: [armrs_real; 3],
}

impl Refusal {
    /// With the name of a quantity, or of a kind of effect and its parameter.
    pub fn named(status: armrs_status, words: [&'static str; 2], index: usize) -> Self {
        Self {
            status,
            words,
            index,
            numbers: [0.0; 3],
        }
    }

    /// With `[found, smallest, largest]`.
    pub fn numbers(self, numbers: [armrs_real; 3]) -> Self {
        Self { numbers, ..self }
    }

    /// Of an effect: its kind and its place in the list.
    pub fn of_effect(why: Invalid, kind: &'static str, index: usize) -> Self {
        let whole = Self::from(why);
        Self {
            words: [kind, whole.words[0]],
            index,
            ..whole
        }
    }
}

impl From<armrs_status> for Refusal {
    fn from(status: armrs_status) -> Self {
        Self::named(status, ["", ""], 0)
    }
}

impl From<Invalid> for Refusal {
    #[cold]
    #[inline(never)]
    fn from(why: Invalid) -> Self {
        let status = why.into();
        match why {
            Invalid::NotFinite { name, index } => Self::named(status, [name, ""], index),
            Invalid::OutOfRange {
                name,
                index,
                found,
                min,
                max,
            } => Self::named(status, [name, ""], index)
                .numbers([found, min, max].map(|v| v as armrs_real)),
            Invalid::OutOfReach { distance, min, max } => Self::named(status, ["distance", ""], 0)
                .numbers([distance, min, max].map(|v| v as armrs_real)),
            Invalid::Unknown { name } => Self::named(status, [name, ""], 0),
            Invalid::CannotAct { .. } => Self::named(status, ["needs more than an arm", ""], 0),
            _ => Self::named(status, ["", ""], 0),
        }
    }
}

/// The status of an `_init` function; `problem`, if not null, gets what was wrong.
///
/// # Safety
/// `problem` is null or points to a place for one.
pub(crate) unsafe fn told(
    result: Result<(), Refusal>,
    problem: *mut armrs_problem,
) -> armrs_status {
    match result {
        Ok(()) => ARMRS_OK,
        // SAFETY: as promised by the caller.
        Err(why) => tell(&why, unsafe { problem.as_mut() }),
    }
}

#[cold]
#[inline(never)]
fn tell(why: &Refusal, problem: Option<&mut armrs_problem>) -> armrs_status {
    if let Some(problem) = problem {
        let [first, second] = why.words;
        let colon = if first.is_empty() || second.is_empty() {
            ""
        } else {
            ": "
        };
        let text = [first, colon, second].into_iter().flat_map(str::bytes);
        let [found, min, max] = why.numbers;
        *problem = armrs_problem {
            what: [0; ARMRS_WHAT],
            index: why.index as u32,
            found,
            min,
            max,
        };
        for (place, byte) in problem.what.iter_mut().take(ARMRS_WHAT - 1).zip(text) {
            *place = byte as c_char;
        }
    }
    why.status
}

impl From<Invalid> for armrs_status {
    fn from(invalid: Invalid) -> Self {
        match invalid {
            Invalid::NotFinite { .. } => ARMRS_NOT_FINITE,
            Invalid::OutOfReach { .. } => ARMRS_OUT_OF_REACH,
            Invalid::Unknown { .. } => ARMRS_UNKNOWN,
            Invalid::CannotAct { .. } => ARMRS_CANNOT_ACT,
            _ => ARMRS_OUT_OF_RANGE,
        }
    }
}

/// Turns a result of the body of a function into its status.
pub(crate) fn ended(result: Result<(), armrs_status>) -> armrs_status {
    match result {
        Ok(()) => ARMRS_OK,
        Err(status) => status,
    }
}

/// A result that may be written. One that is not finite never reaches a motor: it comes from a value that was not, or from one
/// beyond all numbers.
pub(crate) fn finite<const N: usize>(
    result: [armrs_real; N],
) -> Result<[armrs_real; N], armrs_status> {
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
pub(crate) unsafe fn given<'a, T>(pointer: *const T) -> Result<&'a T, armrs_status> {
    // SAFETY: as promised by the caller.
    unsafe { pointer.as_ref() }.ok_or(ARMRS_NULL)
}

/// Numbers that a caller's pointer points to.
///
/// # Safety
/// As of [`given`], for `N` of them.
pub(crate) unsafe fn numbers<'a, const N: usize>(
    pointer: *const armrs_real,
) -> Result<&'a [armrs_real; N], armrs_status> {
    // SAFETY: as promised by the caller; an array has the alignment of its elements.
    unsafe { given(pointer.cast()) }
}

/// Places for numbers that a caller's pointer points to.
///
/// # Safety
/// As of [`place`], for `N` of them.
pub(crate) unsafe fn places<'a, const N: usize>(
    pointer: *mut armrs_real,
) -> Result<&'a mut [armrs_real; N], armrs_status> {
    // SAFETY: as promised by the caller.
    unsafe { place(pointer.cast()) }
}

/// A place that a caller's pointer points to.
///
/// # Safety
/// A pointer that is not null is aligned and points to a `T` that nobody else uses during the call.
pub(crate) unsafe fn place<'a, T>(pointer: *mut T) -> Result<&'a mut T, armrs_status> {
    // SAFETY: as promised by the caller.
    unsafe { pointer.as_mut() }.ok_or(ARMRS_NULL)
}
