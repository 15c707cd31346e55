//! The safety monitor.

use core::mem::MaybeUninit;

use arm_core::monitor::{Monitor, Reason};

use crate::armrs_status::{self, *};
use crate::call::{ended, given, place};
use crate::held::{Held, held};
use crate::{ARMRS_CHANNELS, armrs_real};

/// What a monitor sees of one control period.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct armrs_observation {
    /// The controller's clock [us].
    pub now: u64,
    /// When the values were measured, by the same clock [us].
    pub stamp: u64,
    /// One value a channel.
    pub values: [armrs_real; ARMRS_CHANNELS],
    /// Not 0 where motion is commanded that must change the channel.
    pub moving: [u8; ARMRS_CHANNELS],
}

/// Why a device was stopped.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum armrs_reason {
    /// A value beyond its limit.
    ARMRS_REASON_LIMIT = 0,
    /// A value that is NaN or infinite.
    ARMRS_REASON_NOT_FINITE = 1,
    /// A value that stayed the same to the last bit; value and limit are times [s].
    ARMRS_REASON_FROZEN = 2,
    /// Data older than allowed; value and limit are ages [s].
    ARMRS_REASON_LATE = 3,
    /// A clock or a time stamp that ran backwards.
    ARMRS_REASON_CLOCK = 4,
    /// A value that changed too fast or too far; `value` and `limit` are that change.
    ARMRS_REASON_JUMP = 5,
    /// Too long since the last check; `value` and `limit` are times [s].
    ARMRS_REASON_STALLED = 6,
    /// A limit that changed in memory.
    ARMRS_REASON_MEMORY = 7,
}

/// The first thing that was not allowed.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct armrs_stop {
    /// Why.
    pub reason: armrs_reason,
    /// The channel, counted from zero; ARMRS_CHANNELS where the time stamp of all was at fault.
    pub channel: u32,
    /// The value found.
    pub value: armrs_real,
    /// The limit that it broke.
    pub limit: armrs_real,
    /// The controller's clock [us].
    pub at: u64,
}

/// A monitor and its stop.
#[repr(C)]
pub struct armrs_monitor {
    tag: u64,
    words: [MaybeUninit<u64>; ARMRS_MONITOR_WORDS],
}

/// Size of an `armrs_monitor`.
pub const ARMRS_MONITOR_WORDS: usize = 176;

type Core = Monitor<armrs_real, ARMRS_CHANNELS>;

held!(armrs_monitor holds Core, b"monit0.1");

/// Looks at one control period. ARMRS_STOPPED from the first fault on until `armrs_monitor_reset`; `stop`, if not null, then
/// says what it was.
///
/// # Safety
/// The pointers are null or point to what is said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_monitor_check(
    monitor: *mut armrs_monitor,
    observation: *const armrs_observation,
    stop: *mut armrs_stop,
) -> armrs_status {
    let run = || {
        // SAFETY: as promised by the caller.
        let (monitor, seen, stop) =
            unsafe { (place(monitor)?, given(observation)?, stop.as_mut()) };
        let moving = |channel: usize| seen.moving.get(channel).is_some_and(|&m| m != 0);
        let times = [seen.now, seen.stamp];
        let Err(found) = monitor
            .inner_mut()?
            .check_values(times, &seen.values, moving)
        else {
            return Ok(());
        };
        if let Some(stop) = stop {
            *stop = armrs_stop {
                reason: match found.reason {
                    Reason::Limit => armrs_reason::ARMRS_REASON_LIMIT,
                    Reason::NotFinite => armrs_reason::ARMRS_REASON_NOT_FINITE,
                    Reason::Frozen => armrs_reason::ARMRS_REASON_FROZEN,
                    Reason::Late => armrs_reason::ARMRS_REASON_LATE,
                    Reason::Clock => armrs_reason::ARMRS_REASON_CLOCK,
                    Reason::Jump => armrs_reason::ARMRS_REASON_JUMP,
                    Reason::Stalled => armrs_reason::ARMRS_REASON_STALLED,
                    Reason::Memory => armrs_reason::ARMRS_REASON_MEMORY,
                },
                channel: found.channel.unwrap_or(ARMRS_CHANNELS) as u32,
                value: found.value,
                limit: found.limit,
                at: found.at,
            };
        }
        Err(ARMRS_STOPPED)
    };
    ended(run())
}

/// Lets a stopped device start again.
///
/// # Safety
/// The pointers are null or point to what is said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_monitor_reset(monitor: *mut armrs_monitor) -> armrs_status {
    let run = || {
        // SAFETY: as promised by the caller.
        unsafe { place(monitor)? }.inner_mut()?.reset();
        Ok(())
    };
    ended(run())
}
