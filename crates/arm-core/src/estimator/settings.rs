//! Settings of an estimator, and the quantities of one control period that follow from them.

use super::filtered_channel::Cutoff;
use super::sample::Sample;
use super::schedule::budget;
use crate::check::{SMALLEST, at_least_zero, finite, ordered, positive};
use crate::numeric::scalar::Real;
use crate::{Chain, Invalid, Joints};

/// How an estimator works. Made by [`Settings::new`]; every guard has a finite value that fits the arm.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Settings<T, const N: usize> {
    /// Control period \[s\].
    pub period: T,
    /// Cutoff of the low-pass from which speeds and accelerations come \[Hz\]; three times the fastest movement is enough.
    pub cutoff: T,
    /// Time over which the equation of motion is averaged before it counts \[s\].
    pub window: T,
    /// Standard deviation of such an average, of what the model leaves, by joint \[N m\].
    pub noise: [T; N],
    /// Speed below which a joint counts as at rest; while all rest, nothing is learned and nothing forgotten \[rad/s\].
    pub dead_band: T,
    /// Smallest and largest angle of each joint \[rad\]; beyond it a sample is refused.
    pub range: [[T; 2]; N],
    /// Fastest that a joint can move \[rad/s\]; an angle that jumps farther is a spike. Infinite for no check.
    pub fastest: T,
    /// Fastest that a force \[N/s\] or torque \[N m/s\] can change. Infinite for no check.
    pub steepest: T,
    /// Largest force at the hand \[N\]. Infinite for no check.
    pub largest_force: T,
    /// Largest torque in a joint and moment at the hand \[N m\]. Infinite for no check.
    pub largest_torque: T,
    /// Torques that the estimate does not explain, in multiples of what it usually leaves and of what is not known, are not
    /// learned from.
    pub gate: T,
    /// How long a sensor may show the same bits while the arm moves \[s\]; infinite for ever.
    pub frozen_after: T,
    /// Farthest that the torque which carries the arm may be from that of the arm that was expected, by joint \[N m\]. It
    /// bounds what any error of a sensor can do.
    pub envelope: [T; N],
    /// Time constant of forgetting, counted while the arm moves \[s\]; infinite for none.
    pub forgetting: T,
}

/// Fastest joint of an arm that is led \[rad/s\].
const FASTEST: f64 = 20.0;
/// Half the range of a joint \[rad\]: half a turn, and a little for joints that are defined otherwise. Less than a turn in
/// all, so that an angle that is a turn off is seen.
const HALF_RANGE: f64 = core::f64::consts::PI - 1e-3;
/// Weights of the arm by which a load changes in a second, and at least in a period (noise of the sensor).
const STEEPEST: [f64; 2] = [100.0, 0.05];
/// Weights of the arm that it bears.
const STRONGEST: f64 = 10.0;
/// Share of a joint's own largest weight torque, and of the first joint's, that a support may differ from the expected one.
const ENVELOPE: [f64; 2] = [0.5, 0.02];
/// Longest time with the same bits in motion \[s\].
const FROZEN_AFTER: f64 = 0.5;

impl<T: Real, const N: usize> Settings<T, N> {
    /// Settings for an arm and a control period \[s\]: movements to 3 Hz, 0.1 N m of noise, nothing forgotten; joints within
    /// half a turn to either side and below 20 rad/s, loads below ten times the arm's weight, a support that differs from the
    /// expected one by at most half of a joint's largest weight torque.
    pub fn new(chain: &Chain<T, N>, period: T) -> Self {
        let infinite = T::of(f64::INFINITY);
        let [y, z] = chain.gravity();
        let gravity = (y.squared() + z.squared()).sqrt();
        let weight = chain.segments().iter().fold(T::ZERO, |sum, s| sum + s.mass) * gravity;
        let level = chain.first_moments().map(|x| x.abs() * gravity);
        let first = level.first().copied().unwrap_or(T::ZERO);
        let [per_second, per_period] = STEEPEST.map(T::of);
        let [own, whole] = ENVELOPE.map(T::of);
        let half = T::of(HALF_RANGE);
        Self {
            period,
            cutoff: T::of(15.0).min(T::of(0.2) / period),
            window: T::of(0.1).max(T::of(4.0) * period),
            noise: [T::of(0.1); N],
            dead_band: T::of(0.005),
            range: [[-half, half]; N],
            fastest: T::of(FASTEST),
            steepest: weight * per_second.max(per_period / period),
            largest_force: weight * T::of(STRONGEST),
            largest_torque: first * T::of(STRONGEST),
            gate: T::of(8.0),
            frozen_after: T::of(FROZEN_AFTER),
            envelope: level.map(|torque| own * torque + whole * first),
            forgetting: infinite,
        }
    }
}

/// Settings in control periods.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tuning<T, const N: usize> {
    pub period: T,
    /// The low-pass of every channel.
    pub cutoff: Cutoff<T>,
    /// One over the low-pass's own time, `2 g/period` \[1/s\].
    pub pace: T,
    /// Periods in a window.
    pub window: u32,
    /// Periods from one row to the next.
    pub stride: u32,
    /// Rows of a joint in a full window.
    pub rows: u32,
    /// Rows of a joint that a window needs.
    pub enough: u32,
    /// Noise of each joint's average, and one over its square.
    pub noise: [T; N],
    pub weight: [T; N],
    pub dead_band: T,
    pub gate: T,
    /// Range of each angle.
    pub range: [[T; 2]; N],
    /// Largest force and torque.
    pub largest: [T; 2],
    /// Farthest that an angle and a load move in one period.
    pub farthest: [T; 2],
    pub envelope: [T; N],
    pub frozen_after: u32,
    /// Periods that may be bridged before the filters start anew.
    pub longest_gap: u32,
    /// Periods until restarted filters have settled.
    pub settling: u32,
    /// Periods that a full window waits, so that a sensor found frozen can still spoil it.
    pub quarantine: u32,
    /// Multiplications that a period may spend on the last window.
    pub budget: usize,
    /// Factor on the weight of former windows, for each window; one for no forgetting.
    pub fade: T,
    /// Share of its weight with which one prior row comes back for each window.
    pub refresh: T,
}

/// What is positive, infinite too.
const POSITIVE: [f64; 2] = [SMALLEST, f64::INFINITY];
/// Longest time that is bridged by going on as before \[s\].
const LONGEST_GAP: f64 = 0.02;
/// Time after which restarted filters have settled, in periods of their cutoff.
const SETTLING: f64 = 1.5;
/// Rows in a period of the low-pass' cutoff. Its output changes so slowly that more rows would add nothing.
const ROWS_PER_PERIOD: f64 = 20.0;
/// Largest change in a period that can be distinguished from an infinite one.
const LARGEST: f64 = f32::MAX as f64;
/// Share of its samples that a window needs.
const LEAST_SHARE: f64 = 0.5;
/// Rows that a window has at least, where the sampling allows.
const FEWEST_ROWS: u32 = 20;

impl<T: Real, const N: usize> Tuning<T, N> {
    /// * `unknowns` - how many there are: they make the work that is spread over a window
    pub fn new(s: &Settings<T, N>, unknowns: usize) -> Result<Self, Invalid> {
        let (period, cutoff, window) = (s.period, s.cutoff, s.window);
        positive("control period", 0, s.period)?;
        finite("control period", 0, s.period)?;
        positive("cutoff", 0, s.cutoff)?;
        let name = "cutoff in units of the sampling rate";
        in_range(name, 0, cutoff * period, [0.0, 0.45])?;
        let name = "control periods in a window";
        in_range(name, 0, window / period, [2.0, 1e6])?;
        for (index, &noise) in s.noise.iter().enumerate() {
            positive("noise of joint", index, noise)?;
        }
        for (name, value) in [
            ("fastest speed", s.fastest),
            ("steepest force", s.steepest),
            ("largest force", s.largest_force),
            ("largest torque", s.largest_torque),
            ("gate", s.gate),
            ("freezing time", s.frozen_after),
            ("time of forgetting", s.forgetting),
        ] {
            in_range(name, 0, value, POSITIVE)?;
        }
        at_least_zero("dead band", 0, s.dead_band)?;
        for (index, (&range, &envelope)) in s.range.iter().zip(&s.envelope).enumerate() {
            ordered("range of joint", index, range)?;
            in_range("envelope of joint", index, envelope, POSITIVE)?;
        }

        let (sin, cos) = (T::of(core::f64::consts::PI) * cutoff * period).sin_cos();
        let g = sin / cos;
        let length = periods(window / period);
        let stride = (T::ONE / (T::of(ROWS_PER_PERIOD) * cutoff * period) + T::of(0.5))
            .whole()
            .min(length / FEWEST_ROWS)
            .max(1);
        let rows = length / stride;
        let frozen = periods(s.frozen_after / period);
        let quarantine = quarantine(frozen, length);
        // Done in the periods that have no row, if there are such.
        let free = length - quarantine;
        let free = if stride > 1 {
            free - free.div_ceil(stride)
        } else {
            free
        };
        let forgotten = (-s.window / s.forgetting).exp();
        Ok(Self {
            period: s.period,
            cutoff: Cutoff::new(g),
            pace: (g + g) / s.period,
            window: length,
            stride,
            rows,
            enough: periods(T::of(LEAST_SHARE) * T::of_count(rows)).max(1),
            noise: s.noise,
            weight: s.noise.map(|noise| T::ONE / noise.squared()),
            dead_band: s.dead_band,
            gate: s.gate,
            range: s.range,
            largest: [s.largest_force, s.largest_torque],
            farthest: [s.fastest, s.steepest].map(|pace| (pace * s.period).min(T::of(LARGEST))),
            envelope: s.envelope,
            frozen_after: frozen,
            longest_gap: periods(T::of(LONGEST_GAP) / period).max(2),
            settling: periods(T::of(SETTLING) / (cutoff * period)),
            quarantine,
            budget: budget([N, unknowns], free),
            fade: forgotten,
            // One of the unknowns in turn, so that each comes back at the pace at which it fades.
            refresh: (T::ONE - forgotten) * T::of_count(unknowns as u32),
        })
    }
}

/// Periods that a full window waits. Where a sensor is found frozen only after most of a window, waiting does not help: the
/// windows before are taken in.
fn quarantine(frozen: u32, length: u32) -> u32 {
    if frozen <= length / 2 {
        frozen
    } else {
        length / 4
    }
}

/// Counted up; an infinite time is as many periods as can be counted.
fn periods<T: Real>(count: T) -> u32 {
    let whole = count.whole();
    whole.saturating_add(u32::from(T::of_count(whole) < count))
}

#[inline(never)]
fn in_range<T: Real>(
    name: &'static str,
    index: usize,
    found: T,
    [min, max]: [f64; 2],
) -> Result<(), Invalid> {
    if found.within(min, max) {
        return Ok(());
    }
    if found.partial_cmp(&T::ZERO).is_none() {
        return Err(Invalid::NotFinite { name, index });
    }
    Err(Invalid::OutOfRange {
        name,
        index,
        found: found.to_f64(),
        min,
        max,
    })
}

impl<T: Real, const N: usize> Tuning<T, N> {
    /// Whether the arm can have these values. NaN is checked elsewhere.
    pub(super) fn plausible(&self, sample: &Sample<T, N>) -> bool {
        let within = |angles: &Joints<T, N>| {
            let mut pairs = angles.iter().zip(&self.range);
            pairs.all(|(q, [min, max])| !(q < min || q > max))
        };
        let [force, torque] = self.largest;
        let measured = &sample.measured;
        let beyond = |value: &T, most: T| value.abs() > most;
        within(&sample.q)
            && sample.lead.as_ref().is_none_or(within)
            && !measured.torque.iter().any(|t| beyond(t, torque))
            && !measured.force_on_arm.iter().any(|f| beyond(f, force))
            && !beyond(&measured.moment_on_arm, torque)
    }
}
