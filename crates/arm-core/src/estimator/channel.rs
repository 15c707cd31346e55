//! One sensor channel: what is wrong with its values, and a low-pass that also differentiates.

use crate::scalar::Real;

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
}

/// A second-order low-pass of two integrators (trapezoidal state-variable filter: Zavalishin 2012, chapter 4), with the
/// derivatives of what it lets through. Butterworth: no overshoot in frequency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cutoff<T> {
    /// Frequency-warped cutoff, `tan(π f/f_s)`.
    pub g: T,
    damping: T,
    scale: T,
}

impl<T: Real> Cutoff<T> {
    pub fn new(g: T) -> Self {
        let damping = T::of(core::f64::consts::SQRT_2);
        Self {
            g,
            damping,
            scale: T::ONE / (T::ONE + g * (g + damping)),
        }
    }
}

/// The two integrators.
#[derive(Clone, Copy, Debug, PartialEq)]
struct LowPass<T> {
    first: T,
    second: T,
}

/// A filtered value and its derivatives, in units of the value over the filter's own time `1/(2 g f_s)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Smooth<T> {
    pub value: T,
    pub rate: T,
    pub rate_of_rate: T,
}

impl<T: Real> LowPass<T> {
    /// At rest at a value.
    fn at(value: T) -> Self {
        Self {
            first: T::ZERO,
            second: value,
        }
    }

    #[inline]
    fn step(&mut self, input: T, cutoff: &Cutoff<T>) -> Smooth<T> {
        let error = input - self.second;
        let band = cutoff.scale * (self.first + cutoff.g * error);
        let low = self.second + cutoff.g * band;
        self.first = band + band - self.first;
        self.second = low + low - self.second;
        Smooth {
            value: low,
            rate: band,
            rate_of_rate: input - cutoff.damping * band - low,
        }
    }
}

/// A sensor channel: checks, then two low-passes in a row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Channel<T> {
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
    /// Whether it ever changed: a sensor that is not there cannot freeze.
    alive: bool,
    filter: [LowPass<T>; 2],
}

impl<T: Real> Channel<T> {
    pub fn new() -> Self {
        Self {
            raw: T::ZERO,
            last: T::ZERO,
            trend: T::ZERO,
            bridged: 0,
            unchanged: 0,
            alive: false,
            filter: [LowPass::at(T::ZERO); 2],
        }
    }

    /// Starts anew at a value; false if it is none.
    pub fn restart(&mut self, value: T) -> bool {
        if !value.is_finite() {
            return false;
        }
        self.raw = value;
        self.last = value;
        self.trend = T::ZERO;
        self.bridged = 0;
        self.unchanged = 0;
        self.filter = [LowPass::at(value); 2];
        true
    }

    /// What is wrong with the next value.
    ///
    /// * `farthest` - that a value can move in one period
    /// * `frozen_after` - periods in which the bits may stay the same; `None` while the arm rests
    #[inline]
    pub fn fault(
        &mut self,
        value: Option<T>,
        farthest: T,
        frozen_after: Option<u32>,
    ) -> Option<Fault> {
        let Some(value) = value else {
            return Some(Fault::Missing);
        };
        if !value.is_finite() {
            return Some(Fault::NotFinite);
        }
        let same = value == self.raw;
        self.alive |= !same;
        self.unchanged = if same && self.alive && frozen_after.is_some() {
            self.unchanged.saturating_add(1)
        } else {
            0
        };
        self.raw = value;
        if frozen_after.is_some_and(|limit| self.unchanged > limit) {
            return Some(Fault::Frozen);
        }
        let moved = (value - self.last).abs();
        if moved <= farthest {
            return None;
        }
        let periods = T::of(f64::from(self.bridged + 1));
        (moved > farthest * periods).then_some(Fault::Spike)
    }

    /// Takes a good value, or bridges the lack of one by going on as before.
    #[inline]
    pub fn step(&mut self, value: Option<T>, cutoff: &Cutoff<T>) -> Smooth<T> {
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
        if self.last == T::ZERO && self.filter == [LowPass::at(T::ZERO); 2] {
            // A sensor that is not there costs nothing.
            return Smooth {
                value: T::ZERO,
                rate: T::ZERO,
                rate_of_rate: T::ZERO,
            };
        }
        let [first, second] = &mut self.filter;
        let smooth = first.step(self.last, cutoff);
        self.trend = (cutoff.g + cutoff.g) * smooth.rate;
        second.step(smooth.value, cutoff)
    }

    pub fn bridged(&self) -> u32 {
        self.bridged
    }
}
