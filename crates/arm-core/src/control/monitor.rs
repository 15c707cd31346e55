//! The safety monitor: stops a device at the first value that is not allowed, and stays stopped.

use core::array::from_fn;

use crate::numeric::scalar::Real;
use crate::{Invalid, check};

/// What a watched channel measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Angle of a joint \[rad\].
    Angle,
    /// Its speed \[rad/s\].
    Speed,
    /// Its acceleration \[rad/s²\].
    Acceleration,
    /// A force \[N\] or torque \[N m\].
    Force,
    /// Power that flows into the arm \[W\].
    Power,
}

impl Quantity {
    /// The word for it in messages.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Angle => "angle",
            Self::Speed => "speed",
            Self::Acceleration => "acceleration",
            Self::Force => "force",
            Self::Power => "power",
        }
    }
}

/// What one channel must not do.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct MonitoredChannel<T> {
    /// What it measures.
    pub quantity: Quantity,
    /// Smallest value allowed.
    pub min: T,
    /// Largest value allowed.
    pub max: T,
    /// Fastest change allowed between two samples, in the unit of the quantity by second; infinite for any.
    pub fastest: T,
    /// Farthest that the value may jump from one sample to the next, however long that took; infinite for any.
    pub farthest: T,
    /// How long the value may stay the same to the last bit while motion is commanded \[µs\]; `None` for ever.
    pub frozen_after: Option<u64>,
}

impl<T: Real> MonitoredChannel<T> {
    /// A channel with a range, never taken as frozen.
    pub fn range(quantity: Quantity, min: T, max: T) -> Self {
        let infinite = T::of(f64::INFINITY);
        Self {
            quantity,
            min,
            max,
            fastest: infinite,
            farthest: infinite,
            frozen_after: None,
        }
    }

    /// A channel whose magnitude is limited.
    pub fn magnitude(quantity: Quantity, max: T) -> Self {
        Self::range(quantity, -max, max)
    }

    /// The same channel, stopped when it changes faster than this, by second.
    pub const fn fastest(self, fastest: T) -> Self {
        Self { fastest, ..self }
    }

    /// The same channel, stopped when it jumps farther than this from one sample to the next.
    pub const fn farthest(self, farthest: T) -> Self {
        Self { farthest, ..self }
    }

    /// The same channel, stopped when it freezes for longer than this \[µs\].
    ///
    /// Give a sensor that resolves coarsely as long as the slowest commanded motion needs to cross one step.
    pub const fn frozen_after(self, limit: u64) -> Self {
        Self {
            frozen_after: Some(limit),
            ..self
        }
    }
}

/// Input of a monitor in one control period. Times count from any start, in microseconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation<T, const C: usize> {
    /// The controller's clock \[µs\].
    pub now: u64,
    /// When the values were measured, by the same clock \[µs\].
    pub stamp: u64,
    /// One value a channel, in the unit of its quantity.
    pub values: [T; C],
    /// Whether motion is commanded that must change the channel.
    pub moving: [bool; C],
}

/// Why a device was stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// A value above its largest or below its smallest.
    Limit,
    /// A value that is NaN or infinite.
    NotFinite,
    /// A value that stayed the same to the last bit while motion was commanded; value and limit are times \[s\].
    Frozen,
    /// Data older than allowed; value and limit are ages \[s\].
    Late,
    /// A clock or a time stamp that ran backwards, or data from the future; value and limit are ages \[s\].
    Clock,
    /// A value that changed too fast or too far; value and limit are that change, by second or as it is.
    Jump,
    /// A control loop that stood still: too long since the last check; value and limit are times \[s\].
    Stalled,
    /// A limit that changed in memory.
    Memory,
}

impl Reason {
    /// The words for it in messages.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Limit => "beyond the limit",
            Self::NotFinite => "not finite",
            Self::Frozen => "frozen",
            Self::Late => "late data",
            Self::Clock => "clock runs backwards",
            Self::Jump => "jump",
            Self::Stalled => "control loop stalled",
            Self::Memory => "limits changed in memory",
        }
    }
}

/// The stop of a device: the first thing that was not allowed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop<T> {
    /// Why.
    pub reason: Reason,
    /// Zero-based channel; `None` where the time stamp of all was at fault.
    pub channel: Option<usize>,
    /// The value found.
    pub value: T,
    /// The limit that it broke.
    pub limit: T,
    /// The controller's clock \[µs\].
    pub at: u64,
}

/// Longest times of a control loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Times {
    /// Greatest age of the data that is allowed \[µs\], usually one or two control periods.
    pub oldest: u64,
    /// Longest time from one check to the next \[µs\], usually two control periods.
    pub period: u64,
}

/// Watches `C` channels in fixed time and memory.
///
/// A fault is reported in the control period in which it is seen: a value beyond its limit at once, late or frozen data in
/// the first period after the time allowed. The first stop is kept, whatever comes after it, until [`Monitor::reset`].
///
/// ```
/// use arm_core::monitor::{MonitoredChannel, Monitor, Observation, Quantity, Reason, Times};
/// let channels = [MonitoredChannel::range(Quantity::Angle, -1.5, 0.5).frozen_after(50_000)];
/// let mut monitor = Monitor::new(channels, Times { oldest: 2_000, period: 2_000 })?;
/// let mut seen = Observation { now: 1_000, stamp: 1_000, values: [0.2], moving: [true] };
/// assert!(monitor.check(&seen).is_ok());
/// seen = Observation { now: 2_000, stamp: 2_000, values: [0.6], ..seen };
/// let stop = monitor.check(&seen).unwrap_err();
/// assert_eq!((stop.reason, stop.channel, stop.value, stop.limit), (Reason::Limit, Some(0), 0.6, 0.5));
/// # Ok::<(), arm_core::Invalid>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Monitor<T, const C: usize> {
    channels: [MonitoredChannel<T>; C],
    times: Times,
    /// Sum over the words of the limits of each channel, and the channel that is next compared with it. A single bit that
    /// flips is seen for certain.
    sums: [u32; C],
    next: usize,
    /// How many channels are watched, from the first one on.
    watched: usize,
    last: Option<Seen<T, C>>,
    stop: Option<Stop<T>>,
}

/// What is remembered of the observations before.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Seen<T, const C: usize> {
    now: u64,
    stamp: u64,
    values: [T; C],
    /// The stamp from which each channel that can freeze has not changed under a command to move.
    unchanged: [u64; C],
}

impl<T: Real, const C: usize> Monitor<T, C> {
    /// A monitor that has not stopped.
    ///
    /// # Errors
    /// [`Invalid`] for no channel, a limit that is NaN, a range that is empty, a change that is not positive, and times of zero.
    /// An infinite limit is none.
    pub fn new(channels: [MonitoredChannel<T>; C], times: Times) -> Result<Self, Invalid> {
        at_least_one("number of channels", C as u64)?;
        at_least_one("longest period", times.period)?;
        for (index, channel) in channels.iter().enumerate() {
            check::ordered("limit of channel", index, [channel.min, channel.max])?;
            for change in [channel.fastest, channel.farthest] {
                check::ordered("change of channel", index, [T::of(check::SMALLEST), change])?;
            }
        }
        Ok(Self {
            sums: from_fn(|i| sum_of(&channels[i], &times, C)),
            next: 0,
            watched: C,
            channels,
            times,
            last: None,
            stop: None,
        })
    }

    /// The same monitor of fewer channels: those before `count`. Of the others no value is read.
    ///
    /// # Errors
    /// [`Invalid`] for no channel, and for more than there are.
    pub fn watching(self, count: usize) -> Result<Self, Invalid> {
        at_least_one("number of channels", count as u64)?;
        if count > C {
            return Err(Invalid::OutOfRange {
                name: "number of channels",
                index: 0,
                found: count as f64,
                min: 1.0,
                max: C as f64,
            });
        }
        let sums = from_fn(|i| sum_of(&self.channels[i], &self.times, count));
        Ok(Self {
            sums,
            watched: count,
            ..self
        })
    }

    /// Checks one control period.
    ///
    /// # Errors
    /// The first [`Stop`], in every period from then on.
    #[inline]
    pub fn check(&mut self, seen: &Observation<T, C>) -> Result<(), Stop<T>> {
        let times = [seen.now, seen.stamp];
        self.check_values(times, &seen.values, |channel| {
            seen.moving.get(channel) == Some(&true)
        })
    }

    /// [`Monitor::check`] of values that stand elsewhere, which need not be copied.
    ///
    /// * `times` - the controller's clock, and when the values were measured \[µs\]
    /// * `moving` - whether motion is commanded that must change a channel
    ///
    /// # Errors
    /// As of [`Monitor::check`].
    #[inline]
    pub fn check_values(
        &mut self,
        times: [u64; 2],
        values: &[T; C],
        moving: impl Fn(usize) -> bool,
    ) -> Result<(), Stop<T>> {
        if self.stop.is_none() {
            let Some(found) = self.fault(times, values, moving) else {
                return Ok(());
            };
            self.stop = Some(found);
        }
        self.stop.map_or(Ok(()), Err)
    }

    /// Why the device was stopped, if it was.
    pub fn stop(&self) -> Option<&Stop<T>> {
        self.stop.as_ref()
    }

    /// Lets the device start again; nothing is remembered of the time before.
    pub fn reset(&mut self) {
        self.last = None;
        self.stop = None;
    }

    fn fault(
        &mut self,
        times: [u64; 2],
        values: &[T; C],
        moving: impl Fn(usize) -> bool,
    ) -> Option<Stop<T>> {
        let memory = self.memory_fault(times[0]);
        if memory.is_some() {
            return memory;
        }
        let clock = self.clock_fault(times);
        let value = self.value_fault(times, values, moving);
        clock.or(value)
    }

    /// A limit that is not what it was. One channel in each period.
    fn memory_fault(&mut self, now: u64) -> Option<Stop<T>> {
        let index = self.next;
        self.next = if index + 1 < self.watched {
            index + 1
        } else {
            0
        };
        let channel = self.channels.get(index);
        let found = channel.map(|c| sum_of(c, &self.times, self.watched));
        (found != self.sums.get(index).copied()).then_some(Stop {
            reason: Reason::Memory,
            channel: Some(index),
            value: T::ZERO,
            limit: T::ZERO,
            at: now,
        })
    }

    fn clock_fault(&self, [now, stamp]: [u64; 2]) -> Option<Stop<T>> {
        let Times { oldest, period } = self.times;
        let last = self.last.as_ref().map_or([0; 2], |l| [l.now, l.stamp]);
        let first = self.last.is_none();
        let (reason, time, limit) = if stamp > now {
            (Reason::Clock, stamp - now, oldest)
        } else if now < last[0] || stamp < last[1] {
            (Reason::Clock, now - stamp, oldest)
        } else if !first && now - last[0] > period {
            (Reason::Stalled, now - last[0], period)
        } else if now - stamp > oldest {
            (Reason::Late, now - stamp, oldest)
        } else {
            return None;
        };
        let time = seconds::<T>(time);
        Some(Stop {
            reason,
            channel: None,
            value: if stamp > now { -time } else { time },
            limit: seconds(limit),
            at: now,
        })
    }

    /// Stores the observation and finds the first channel that is not as allowed. Repeats of one sample count as one.
    fn value_fault(
        &mut self,
        [now, stamp]: [u64; 2],
        values: &[T; C],
        moving: impl Fn(usize) -> bool,
    ) -> Option<Stop<T>> {
        let first = self.last.is_none();
        let last = self.last.get_or_insert(Seen {
            now,
            stamp,
            values: *values,
            unchanged: [stamp; C],
        });
        // Between samples, not between checks: the same sample twice is no change.
        let passed: T = seconds(stamp.saturating_sub(last.stamp));
        (last.now, last.stamp) = (now, stamp);
        let mut found = None;
        for index in 0..self.watched.min(C) {
            let (channel, value) = (&self.channels[index], values[index]);
            let before = last.values[index];
            last.values[index] = value;
            let moved = (value - before).abs();
            let mut fault = None;
            if channel.refuses(value, moved, passed) {
                fault = channel.fault(value, moved, passed);
            }
            if let Some(limit) = channel.frozen_after
                && fault.is_none()
            {
                let same = !first && value == before && moving(index);
                if !same {
                    last.unchanged[index] = stamp;
                }
                let time = stamp.saturating_sub(last.unchanged[index]);
                fault = (time > limit).then(|| (Reason::Frozen, seconds(time), seconds(limit)));
            }
            if let Some((reason, value, limit)) = fault
                && found.is_none()
            {
                found = Some(Stop {
                    reason,
                    channel: Some(index),
                    value,
                    limit,
                    at: now,
                });
            }
        }
        found
    }
}

impl<T: Real> MonitoredChannel<T> {
    /// Whether a value is not allowed, or may not be. One that is not finite has moved by no finite amount.
    #[inline]
    fn refuses(&self, value: T, moved: T, passed: T) -> bool {
        !(value <= self.max
            && value >= self.min
            && moved < T::of(f64::INFINITY)
            && moved <= self.farthest
            && moved <= self.fastest * passed)
    }

    /// What is wrong with a value: why, what was found, and the limit.
    #[cold]
    #[inline(never)]
    fn fault(&self, value: T, moved: T, passed: T) -> Option<(Reason, T, T)> {
        if !value.is_finite() {
            Some((Reason::NotFinite, value, self.min))
        } else if value > self.max {
            Some((Reason::Limit, value, self.max))
        } else if value < self.min {
            Some((Reason::Limit, value, self.min))
        } else if moved > self.farthest {
            Some((Reason::Jump, moved, self.farthest))
        } else if moved > self.fastest * passed && moved > T::ZERO {
            Some((Reason::Jump, moved / passed, self.fastest))
        } else {
            // An infinite speed in no time is none.
            None
        }
    }
}

/// What must not change in memory: the limits of a channel, the times, and how many channels are watched.
fn sum_of<T: Real>(channel: &MonitoredChannel<T>, times: &Times, watched: usize) -> u32 {
    let limits = [channel.min, channel.max, channel.fastest, channel.farthest];
    let sum = added(added(added(0, watched as u64), times.oldest), times.period);
    let sum = limits
        .iter()
        .fold(sum, |sum, limit| added(sum, limit.bits()));
    added(sum, channel.frozen_after.unwrap_or(u64::MAX))
}

/// A sum over words in which their order counts.
#[inline]
fn added(sum: u32, bits: u64) -> u32 {
    let low = sum.rotate_left(1).wrapping_add(bits as u32);
    low.rotate_left(1).wrapping_add((bits >> 32) as u32)
}

fn at_least_one(name: &'static str, found: u64) -> Result<(), Invalid> {
    if found > 0 {
        return Ok(());
    }
    Err(Invalid::OutOfRange {
        name,
        index: 0,
        found: 0.0,
        min: 1.0,
        max: f64::INFINITY,
    })
}

#[inline(never)]
fn seconds<T: Real>(microseconds: u64) -> T {
    let [low, high] = [microseconds as u32, (microseconds >> 32) as u32].map(T::of_count);
    (high * T::of(4_294_967_296.0) + low) * T::of(1e-6)
}
