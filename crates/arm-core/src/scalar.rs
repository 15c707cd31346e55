//! The number that the core computes with, and the only door to transcendental functions.

use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A real number, or several side by side.
///
/// Implemented for `f64`, `f32` and [`Lanes`](crate::Lanes). Every operation is elementwise and has the same bits on
/// every platform: `+ − × ÷ √` are exact by IEEE 754, `sin_cos` is a polynomial written here, the rest is `libm`.
/// There is no branch on a value but [`Scalar::if_less`], so that lanes and single runs take the same steps.
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
    /// Whether every lane satisfies a condition.
    fn every(self, condition: impl Fn(f64) -> bool) -> bool;
    /// Each lane through a function of one `f64`.
    fn map(self, f: impl Fn(f64) -> f64) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// Sine and cosine of an angle \[rad\].
    ///
    /// Largest error found against 160-bit arithmetic at 60 000 angles of each range: 1.01 units in the last place within
    /// ±0.8, 1.45 within ±10³, 2.1 within ±10⁵ (absolute 1.5·10⁻¹⁶), beyond which `libm` takes over; in single precision
    /// 7·10⁻⁸ absolute.
    fn sin_cos(self) -> (Self, Self);
    /// Exponential.
    fn exp(self) -> Self;
    /// Hyperbolic tangent.
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

/// Constants of the sine and cosine polynomials in one precision.
pub(crate) struct Trigonometry<const S: usize, const C: usize> {
    /// 1.5·2^(p−1): adding and subtracting it rounds to the nearest integer.
    pub round: f64,
    /// π/2 in three parts, the first two short enough that their products with an integer are exact.
    pub half_pi: [f64; 3],
    /// Sine: x + x³(s₀ + s₁x² + …).
    pub sine: [f64; S],
    /// Cosine: 1 − x²/2 + x⁴(c₀ + c₁x² + …).
    pub cosine: [f64; C],
}

/// Coefficients of FreeBSD's `k_sin.c` and `k_cos.c` (error below 1 ulp on ±π/4).
#[expect(clippy::excessive_precision, reason = "the digits of the source")]
pub(crate) const DOUBLE: Trigonometry<6, 6> = Trigonometry {
    round: 6_755_399_441_055_744.0,
    half_pi: [
        1.570_796_326_734_125_614_17,
        6.077_100_506_303_965_976_60e-11,
        2.022_266_248_795_950_631_54e-21,
    ],
    sine: [
        -1.666_666_666_666_663_243_48e-01,
        8.333_333_333_322_489_461_24e-03,
        -1.984_126_982_985_794_931_34e-04,
        2.755_731_370_707_006_767_89e-06,
        -2.505_076_025_340_686_341_95e-08,
        1.589_690_995_211_550_102_21e-10,
    ],
    cosine: [
        4.166_666_666_666_660_190_37e-02,
        -1.388_888_888_887_410_957_49e-03,
        2.480_158_728_947_672_941_78e-05,
        -2.755_731_435_139_066_330_35e-07,
        2.087_572_321_298_174_827_90e-09,
        -1.135_964_755_778_819_482_65e-11,
    ],
};

/// Coefficients of Cephes `sinf.c` and `cosf.c`.
#[allow(clippy::excessive_precision, reason = "the digits of the source")]
const SINGLE: Trigonometry<3, 3> = Trigonometry {
    round: 12_582_912.0,
    half_pi: [
        1.570_312_5,
        4.837_512_969_970_703e-4,
        7.549_789_948_768_648e-8,
    ],
    sine: [-1.666_665_461_1e-1, 8.332_160_873_6e-3, -1.951_529_589_1e-4],
    cosine: [
        4.166_664_568_298_827e-2,
        -1.388_731_625_493_765e-3,
        2.443_315_711_809_948e-5,
    ],
};

/// An angle reduced to the nearest multiple of a quarter turn.
pub(crate) struct Reduced<T> {
    /// That multiple plus [`Trigonometry::round`]: the lowest bits of its mantissa are those of the integer.
    pub quarters: T,
    /// Sine of the rest.
    pub sin: T,
    /// Cosine of the rest.
    pub cos: T,
}

/// Sine and cosine by reduction to ±π/4 and two polynomials, up to the quarter turns; without a branch.
#[inline]
pub(crate) fn reduced_sin_cos<T: Scalar, const S: usize, const C: usize>(
    x: T,
    k: &Trigonometry<S, C>,
) -> Reduced<T> {
    let quarters = x * T::of(core::f64::consts::FRAC_2_PI) + T::of(k.round);
    let n = quarters - T::of(k.round);
    // In this order: the first two products and differences are exact, which the tiny rest at a multiple of π/2 needs.
    let r = ((x - n * T::of(k.half_pi[0])) - n * T::of(k.half_pi[1])) - n * T::of(k.half_pi[2]);
    let z = r * r;
    let sin = r + r * z * series(&k.sine, z);
    let half = T::of(0.5) * z;
    let w = T::ONE - half;
    let cos = w + (((T::ONE - w) - half) + z * z * series(&k.cosine, z));
    Reduced { quarters, sin, cos }
}

/// `c₀ + c₁z + c₂z² + …` by pairs, which wait for each other half as often as one by one.
#[inline]
fn series<T: Scalar>(c: &[f64], z: T) -> T {
    let square = z * z;
    let pair = |p: &[f64]| {
        p[1..]
            .iter()
            .fold(T::of(p[0]), |sum, &next| sum + T::of(next) * z)
    };
    let mut pairs = c.chunks(2).rev().map(pair);
    let last = pairs.next().unwrap_or(T::ZERO);
    pairs.fold(last, |sum, next| next + square * sum)
}

/// Turns sine and cosine by quarters: exchanges them for odd ones, and sets the signs.
#[inline]
pub(crate) fn turned(reduced: Reduced<f64>) -> (f64, f64) {
    let n = reduced.quarters.to_bits();
    let (sin, cos) = (reduced.sin.to_bits(), reduced.cos.to_bits());
    let exchange = (sin ^ cos) & (n & 1).wrapping_neg();
    (
        f64::from_bits((sin ^ exchange) ^ ((n & 2) << 62)),
        f64::from_bits((cos ^ exchange) ^ ((n.wrapping_add(1) & 2) << 62)),
    )
}

/// As [`turned`], in single precision.
#[inline]
fn turned_single(reduced: Reduced<f32>) -> (f32, f32) {
    let n = reduced.quarters.to_bits();
    let (sin, cos) = (reduced.sin.to_bits(), reduced.cos.to_bits());
    let exchange = (sin ^ cos) & (n & 1).wrapping_neg();
    (
        f32::from_bits((sin ^ exchange) ^ ((n & 2) << 30)),
        f32::from_bits((cos ^ exchange) ^ ((n.wrapping_add(1) & 2) << 30)),
    )
}

/// Beyond this angle \[rad\] the short reduction would lose accuracy.
pub(crate) const LARGEST_REDUCED: f64 = 1e5;

/// Kept out of the way of the usual case.
#[cold]
#[inline(never)]
fn far_sin_cos(x: f64) -> (f64, f64) {
    libm::sincos(x)
}

impl Scalar for f64 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    #[inline]
    fn of(value: f64) -> Self {
        value
    }
    #[inline]
    fn if_less(a: Self, b: Self, then: Self, otherwise: Self) -> Self {
        if a < b { then } else { otherwise }
    }
    #[inline]
    fn every(self, condition: impl Fn(f64) -> bool) -> bool {
        condition(self)
    }
    #[inline]
    fn map(self, f: impl Fn(f64) -> f64) -> Self {
        f(self)
    }
    #[inline]
    fn sqrt(self) -> Self {
        libm::sqrt(self)
    }
    #[inline]
    fn sin_cos(self) -> (Self, Self) {
        if self.abs() <= LARGEST_REDUCED {
            turned(reduced_sin_cos(self, &DOUBLE))
        } else {
            far_sin_cos(self)
        }
    }
    #[inline]
    fn exp(self) -> Self {
        libm::exp(self)
    }
    #[inline]
    fn tanh(self) -> Self {
        libm::tanh(self)
    }
    #[inline]
    fn atan2(self, x: Self) -> Self {
        libm::atan2(self, x)
    }
}

impl Scalar for f32 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    #[inline]
    fn of(value: f64) -> Self {
        value as f32
    }
    #[inline]
    fn if_less(a: Self, b: Self, then: Self, otherwise: Self) -> Self {
        if a < b { then } else { otherwise }
    }
    #[inline]
    fn every(self, condition: impl Fn(f64) -> bool) -> bool {
        condition(f64::from(self))
    }
    #[inline]
    fn map(self, f: impl Fn(f64) -> f64) -> Self {
        f(f64::from(self)) as f32
    }
    #[inline]
    fn sqrt(self) -> Self {
        libm::sqrtf(self)
    }
    #[inline]
    fn sin_cos(self) -> (Self, Self) {
        // 3-part reduction in single precision holds to a few thousand radians.
        if self.abs() <= 4096.0 {
            turned_single(reduced_sin_cos(self, &SINGLE))
        } else {
            libm::sincosf(self)
        }
    }
    #[inline]
    fn exp(self) -> Self {
        libm::expf(self)
    }
    #[inline]
    fn tanh(self) -> Self {
        libm::tanhf(self)
    }
    #[inline]
    fn atan2(self, x: Self) -> Self {
        libm::atan2f(self, x)
    }
}
