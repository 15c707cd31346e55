//! The number type of the core, and the only access to transcendental functions.

use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A real number, or several side by side.
///
/// Implemented for `f64`, `f32` and [`Lanes`](crate::Lanes). Every operation is elementwise and has the same bits on
/// every platform: `+ − × ÷ √` are exact by IEEE 754, `sin_cos`, `exp` and `tanh` are polynomials written here (in `f32`
/// the last two are `libm`'s), the rest is `libm`.
/// There is no branch on a value but [`Scalar::if_less`], so that lanes and single runs take the same steps. The scalar
/// versions of `sin_cos`, `exp` and `tanh` branch on their argument; all branches give the same bits.
pub trait Scalar:
    nalgebra::Scalar
    + Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
{
    /// Zero.
    const ZERO: Self;
    /// One.
    const ONE: Self;

    /// The nearest number to `value`, in every lane.
    fn of(value: f64) -> Self;
    /// `then` where `a < b`, else `otherwise`.
    fn if_less(a: Self, b: Self, then: Self, otherwise: Self) -> Self;
    /// [`Scalar::if_less`] between values that take long to compute: for a single number only the selected one is computed.
    #[inline(always)]
    fn where_less(
        a: Self,
        b: Self,
        then: impl FnOnce() -> Self,
        otherwise: impl FnOnce() -> Self,
    ) -> Self {
        Self::if_less(a, b, then(), otherwise())
    }
    /// Whether every lane satisfies a condition.
    fn every(self, condition: impl Fn(f64) -> bool) -> bool;
    /// Whether every lane lies in a range, its ends rounded to this number and included.
    #[inline]
    fn within(self, min: f64, max: f64) -> bool {
        self.every(|value| value >= min && value <= max)
    }
    /// Each lane through a function of one `f64`.
    fn map(self, f: impl Fn(f64) -> f64) -> Self;
    /// A function of several values, for each lane.
    fn together<const K: usize>(values: [Self; K], f: impl Fn([f64; K]) -> f64) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// Sine and cosine of an angle \[rad\].
    ///
    /// Largest error found against 160-bit arithmetic at 60 000 angles of each range: 1.01 units in the last place within
    /// ±0.8, 1.45 within ±10³, 2.1 within ±10⁵ (absolute 1.5·10⁻¹⁶); in single precision 7·10⁻⁸ absolute. NaN from 10¹⁶ on, in
    /// single precision from 10⁸, where an angle has no digit left.
    fn sin_cos(self) -> (Self, Self);
    /// [`Scalar::sin_cos`] of several angles \[rad\]: all sines, all cosines.
    #[inline(always)]
    fn sines_and_cosines<const K: usize>(angles: &[Self; K]) -> [[Self; K]; 2] {
        // Not by `map`, which may become a call: its code would not be of the widest vectors.
        let [mut sines, mut cosines] = [[Self::ZERO; K]; 2];
        for i in 0..K {
            (sines[i], cosines[i]) = angles[i].sin_cos();
        }
        [sines, cosines]
    }
    /// Exponential; within 1 unit in the last place of `libm`, zero below −708.
    fn exp(self) -> Self;
    /// Hyperbolic tangent; within 3 units in the last place of `libm`.
    fn tanh(self) -> Self;
    /// Angle of the vector `[x, self]` from the first axis, in ±π \[rad\].
    fn atan2(self, x: Self) -> Self;

    /// Absolute value.
    #[inline]
    fn abs(self) -> Self {
        Self::if_less(self, Self::ZERO, -self, self)
    }
    /// The larger of two numbers.
    #[inline]
    fn max(self, other: Self) -> Self {
        Self::if_less(self, other, other, self)
    }
    /// The smaller of two numbers.
    #[inline]
    fn min(self, other: Self) -> Self {
        Self::if_less(other, self, other, self)
    }
    /// The square.
    #[inline]
    fn squared(self) -> Self {
        self * self
    }
    /// Whether every lane is finite.
    #[inline]
    fn is_finite(self) -> bool {
        self.every(f64::is_finite)
    }
}

/// One real number that can be compared: `f64` or `f32`, but not lanes.
pub trait Real: Scalar + PartialOrd {
    /// The same number in double precision.
    fn to_f64(self) -> f64;
    /// Its bits.
    fn bits(self) -> u64;
    /// The nearest number to a count.
    fn of_count(count: u32) -> Self;
    /// Its whole part; zero for what is negative or no number, the largest count for what is larger.
    fn whole(self) -> u32;
}
