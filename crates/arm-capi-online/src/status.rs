//! Status codes that functions return.

use arm_core::Invalid;

use armrs_status::*;

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
