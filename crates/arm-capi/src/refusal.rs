//! Messages of functions that refuse their arguments.

use core::ffi::c_char;

use arm_capi_online::armrs_status::{self, *};
use arm_core::Invalid;

use crate::armrs_real;

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
pub(crate) unsafe fn status_of(
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
