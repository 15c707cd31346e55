//! One sensor channel: checks of its values, and low-passes that also differentiate.

use core::array::from_fn;

use crate::numeric::scalar::Real;

/// What was wrong with a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// There was none.
    Missing,
    /// A value that is NaN or infinite.
    NotFinite,
    /// A value that jumped farther than it can move.
    Spike,
    /// A value that stayed the same to the last bit while the arm moved.
    Frozen,
    /// Torques that what has been learned so far does not explain.
    Unexpected,
    /// A value that the arm cannot have: an angle outside its range (a turn off, degrees), a load that it does not bear.
    Implausible,
    /// The estimator's own state was not finite; it started anew from what was known before.
    Restarted,
}

/// A second-order low-pass of two integrators (trapezoidal state-variable filter: Zavalishin 2012, chapter 4), with the
/// derivative of what it lets through. Butterworth: no overshoot in frequency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cutoff<T> {
    /// Frequency-warped cutoff, `tan(π f/f_s)`.
    pub g: T,
    scale: T,
}

impl<T: Real> Cutoff<T> {
    pub fn new(g: T) -> Self {
        let damping = T::of(core::f64::consts::SQRT_2);
        Self {
            g,
            scale: T::ONE / (T::ONE + g * (g + damping)),
        }
    }
}

/// Kept out of the way of the usual case.
#[cold]
#[inline(never)]
fn no_number<T: Real>(value: T) -> bool {
    !value.is_finite()
}

/// The two integrators.
///
/// Well below the cutoff the second one moves by less than a last bit of single precision in a period. It would stick, and the
/// rates with it, did it not keep what rounding takes.
#[derive(Clone, Copy, Debug, PartialEq)]
struct LowPass<T> {
    first: T,
    second: T,
    /// What `second` lacks by rounding (fast two-sum: Dekker 1971).
    lost: T,
}

/// A filtered value and its derivative, in units of the value over the filter's own time `1/(2 g f_s)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Smooth<T> {
    pub value: T,
    pub rate: T,
}

impl<T: Real> LowPass<T> {
    /// At rest at a value.
    fn at(value: T) -> Self {
        Self {
            first: T::ZERO,
            second: value,
            lost: T::ZERO,
        }
    }

    #[inline]
    fn step(&mut self, input: T, cutoff: &Cutoff<T>) -> Smooth<T> {
        let error = (input - self.second) - self.lost;
        let band = cutoff.scale * (self.first + cutoff.g * error);
        let half = cutoff.g * band;
        let value = self.second + (self.lost + half);
        self.first = band + band - self.first;
        let step = self.lost + (half + half);
        let moved = self.second + step;
        self.lost = step - (moved - self.second);
        self.second = moved;
        Smooth { value, rate: band }
    }
}

/// A sensor channel: checks, then two low-passes in a row.
///
/// The rates are those of the first low-pass and pass the second as they are. Taken from the second they would be the same
/// but for rounding: a difference of nearly equal angles, whose last bits the pace of the filter, squared, makes large.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FilteredChannel<T> {
    /// Last value that came, good or not.
    raw: T,
    /// Last value that was used, measured or bridged.
    last: T,
    /// Change in the next period, if it goes on as it does.
    trend: T,
    /// Periods in a row without a good value.
    bridged: u32,
    /// Periods in a row with the same bits.
    unchanged: u32,
    /// Whether it ever changed: a sensor that is not there cannot freeze. Until then its low-passes are at rest, and cost nothing.
    alive: bool,
    first: LowPass<T>,
    of_value: LowPass<T>,
    of_rate: LowPass<T>,
}

impl<T: Real> FilteredChannel<T> {
    pub fn new() -> Self {
        Self {
            raw: T::ZERO,
            last: T::ZERO,
            trend: T::ZERO,
            bridged: 0,
            unchanged: 0,
            alive: false,
            first: LowPass::at(T::ZERO),
            of_value: LowPass::at(T::ZERO),
            of_rate: LowPass::at(T::ZERO),
        }
    }

    /// Starts anew at a value; false if it is none.
    #[inline(never)]
    fn restart(&mut self, value: T) -> bool {
        if !value.is_finite() {
            return false;
        }
        self.raw = value;
        self.last = value;
        self.trend = T::ZERO;
        self.bridged = 0;
        self.unchanged = 0;
        self.first = LowPass::at(value);
        self.of_value = self.first;
        self.of_rate = LowPass::at(T::ZERO);
        true
    }

    /// What is wrong with the next value.
    ///
    /// * `farthest` - that a value can move in one period; finite
    /// * `frozen_after` - periods in which the bits may stay the same; `None` while the arm rests
    #[inline]
    fn fault(&mut self, value: Option<T>, farthest: T, frozen_after: Option<u32>) -> Option<Fault> {
        let Some(value) = value else {
            return Some(Fault::Missing);
        };
        let moved = (value - self.last).abs();
        // What is near is finite.
        let near = moved <= farthest;
        if !near && no_number(value) {
            return Some(Fault::NotFinite);
        }
        let same = value == self.raw;
        if same && !self.alive {
            return None;
        }
        self.alive = true;
        self.unchanged = if same && frozen_after.is_some() {
            self.unchanged.saturating_add(1)
        } else {
            0
        };
        self.raw = value;
        if frozen_after.is_some_and(|limit| self.unchanged > limit) {
            return Some(Fault::Frozen);
        }
        if near {
            return None;
        }
        let periods = T::of_count(self.bridged.saturating_add(1));
        (moved > farthest * periods).then_some(Fault::Spike)
    }

    /// Takes a good value, or bridges the lack of one by going on as before; what the first low-pass lets through.
    #[inline]
    fn step(&mut self, value: Option<T>, cutoff: &Cutoff<T>) -> Smooth<T> {
        match value {
            Some(value) => {
                self.last = value;
                self.bridged = 0;
            }
            None => {
                self.last += self.trend;
                self.bridged = self.bridged.saturating_add(1);
            }
        }
        if !self.alive {
            return Smooth {
                value: self.last,
                rate: T::ZERO,
            };
        }
        let smooth = self.first.step(self.last, cutoff);
        self.trend = (cutoff.g + cutoff.g) * smooth.rate;
        smooth
    }

    /// The value behind the second low-pass.
    #[inline]
    fn value(&mut self, first: &Smooth<T>, cutoff: &Cutoff<T>) -> T {
        if !self.alive {
            return first.value;
        }
        self.of_value.step(first.value, cutoff).value
    }

    /// The first and the second rate of [`FilteredChannel::value`].
    #[inline]
    pub fn rates(&mut self, first: &Smooth<T>, cutoff: &Cutoff<T>) -> [T; 2] {
        if !self.alive {
            return [T::ZERO; 2];
        }
        let smooth = self.of_rate.step(first.rate, cutoff);
        [smooth.value, smooth.rate]
    }
}

/// Starts channels anew at values; false if one is none.
// Once in the code for all kinds of channels, as what follows.
#[inline(never)]
pub(super) fn restart<T: Real, const K: usize>(
    channels: &mut [FilteredChannel<T>; K],
    values: &[T; K],
) -> bool {
    let pairs = channels.iter_mut().zip(values);
    pairs.fold(true, |good, (channel, &value)| {
        good & channel.restart(value)
    })
}

/// The values of channels behind the second low-pass.
#[inline(never)]
pub(super) fn values<T: Real, const K: usize>(
    channels: &mut [FilteredChannel<T>; K],
    first: &[Smooth<T>; K],
    cutoff: &Cutoff<T>,
) -> [T; K] {
    from_fn(|i| channels[i].value(&first[i], cutoff))
}

/// What is wrong with the values of one period.
pub(super) struct Checks {
    /// See [`FilteredChannel::fault`].
    pub frozen_after: Option<u32>,
    /// The first fault.
    pub fault: Option<Fault>,
    /// Most periods in a row for which a channel is bridged.
    pub longest: u32,
}

impl Checks {
    /// Channels of one kind: the values are checked, and what the first low-pass lets through is returned.
    #[inline(never)]
    pub fn passed<T: Real, const K: usize>(
        &mut self,
        channels: &mut [FilteredChannel<T>; K],
        values: Option<&[T; K]>,
        farthest: T,
        cutoff: &Cutoff<T>,
    ) -> [Smooth<T>; K] {
        from_fn(|i| self.passed_one(&mut channels[i], values.map(|v| v[i]), farthest, cutoff))
    }

    #[inline]
    fn passed_one<T: Real>(
        &mut self,
        channel: &mut FilteredChannel<T>,
        value: Option<T>,
        farthest: T,
        cutoff: &Cutoff<T>,
    ) -> Smooth<T> {
        let found = channel.fault(value, farthest, self.frozen_after);
        self.fault = self.fault.or(found);
        let good = if found.is_some() { None } else { value };
        let smooth = channel.step(good, cutoff);
        if good.is_none() {
            self.longest = self.longest.max(channel.bridged);
        }
        smooth
    }
}
