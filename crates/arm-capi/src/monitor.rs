//! Functions that create safety monitors.

use arm_capi_online::armrs_status::{self, *};
use arm_capi_online::call::{given, place};
use arm_capi_online::held::Held;
use arm_core::monitor::{Monitor, MonitoredChannel, Quantity, Times};

use crate::refusal::{Refusal, armrs_problem, status_of};
use crate::{ARMRS_CHANNELS, armrs_monitor, armrs_real};

/// What a channel measures.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum armrs_quantity {
    /// Angle [rad].
    ARMRS_ANGLE = 0,
    /// Speed [rad/s].
    ARMRS_SPEED = 1,
    /// Acceleration [rad/s^2].
    ARMRS_ACCELERATION = 2,
    /// Force [N] or torque [N m].
    ARMRS_FORCE = 3,
    /// Power into the arm [W].
    ARMRS_POWER = 4,
}

/// What one channel must not do.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct armrs_channel {
    /// What it measures, an `armrs_quantity`.
    pub quantity: u32,
    /// Smallest value allowed; may be infinite.
    pub min: armrs_real,
    /// Largest value allowed; may be infinite.
    pub max: armrs_real,
    /// Fastest change from one sample to the next [unit/s]; 0 for any.
    pub fastest: armrs_real,
    /// Farthest jump from one sample to the next, however long that took; 0 for any.
    pub farthest: armrs_real,
    /// How long the value may stay the same to the last bit while motion is commanded [us]; 0 for ever.
    pub frozen_after: u64,
}

/// Makes a monitor of `count` channels, 1 to ARMRS_CHANNELS; of the others no value is read.
/// `oldest`: greatest age of the data that is allowed [us]. `period`: longest time from one check to the next [us], usually two
/// control periods. `problem`, if not null, says what was refused.
///
/// # Safety
/// The pointers are null or point to what is said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_monitor_init(
    monitor: *mut armrs_monitor,
    channels: *const armrs_channel,
    count: usize,
    oldest: u64,
    period: u64,
    problem: *mut armrs_problem,
) -> armrs_status {
    let run = || {
        // SAFETY: as promised by the caller.
        let monitor = unsafe { place(monitor)? };
        if count == 0 || count > ARMRS_CHANNELS {
            let limits = [count as armrs_real, 1.0, ARMRS_CHANNELS as armrs_real];
            let refusal = Refusal::named(ARMRS_OUT_OF_RANGE, ["number of channels", ""], 0);
            return Err(refusal.numbers(limits));
        }
        let open = MonitoredChannel::magnitude(Quantity::Force, armrs_real::INFINITY);
        let mut kept = [open; ARMRS_CHANNELS];
        for (i, channel) in kept.iter_mut().take(count).enumerate() {
            // SAFETY: there are `count` channels.
            let given = unsafe { given(channels.wrapping_add(i))? };
            let any = |change: armrs_real| {
                if change == 0.0 {
                    armrs_real::INFINITY
                } else {
                    change
                }
            };
            *channel = MonitoredChannel::range(quantity(given.quantity, i)?, given.min, given.max)
                .fastest(any(given.fastest))
                .farthest(any(given.farthest));
            channel.frozen_after = (given.frozen_after > 0).then_some(given.frozen_after);
        }
        monitor.keep(&Monitor::new(kept, Times { oldest, period })?.watching(count)?);
        Ok(())
    };
    // SAFETY: as promised by the caller.
    unsafe { status_of(run(), problem) }
}

/// A number from outside may be no quantity at all, so that it is not taken as the enum.
fn quantity(number: u32, channel: usize) -> Result<Quantity, Refusal> {
    const ALL: [(armrs_quantity, Quantity); 5] = [
        (armrs_quantity::ARMRS_ANGLE, Quantity::Angle),
        (armrs_quantity::ARMRS_SPEED, Quantity::Speed),
        (armrs_quantity::ARMRS_ACCELERATION, Quantity::Acceleration),
        (armrs_quantity::ARMRS_FORCE, Quantity::Force),
        (armrs_quantity::ARMRS_POWER, Quantity::Power),
    ];
    let found = ALL.iter().find(|(c, _)| *c as u32 == number);
    let limits = [number as armrs_real, 0.0, 4.0];
    let refusal = Refusal::named(ARMRS_OUT_OF_RANGE, ["quantity of channel", ""], channel);
    found.map(|(_, core)| *core).ok_or(refusal.numbers(limits))
}
