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

/// Sine and cosine by reduction to ±π/4 and two polynomials, without a branch.
#[inline]
pub(crate) fn sin_cos_polynomial<T: Scalar, const S: usize, const C: usize>(
    x: T,
    k: &Trigonometry<S, C>,
) -> (T, T) {
    let round = |v: T| (v + T::of(k.round)) - T::of(k.round);
    let n = round(x * T::of(core::f64::consts::FRAC_2_PI));
    let r = ((x - n * T::of(k.half_pi[0])) - n * T::of(k.half_pi[1])) - n * T::of(k.half_pi[2]);
    let z = r * r;
    let series = |c: &[f64]| {
        c.iter()
            .rev()
            .skip(1)
            .fold(T::of(c[c.len() - 1]), |sum, &next| T::of(next) + z * sum)
    };
    let s = r + r * z * series(&k.sine);
    let half = T::of(0.5) * z;
    let w = T::ONE - half;
    let c = w + (((T::ONE - w) - half) + z * z * series(&k.cosine));
    // The quadrant as −2, −1, 0, 1 or 2 (±2 are the same).
    let quadrant = n - T::of(4.0) * round(n * T::of(0.25));
    let odd = quadrant.abs();
    let is_odd = |then: T, otherwise: T| {
        T::if_less(
            T::of(0.5),
            odd,
            T::if_less(odd, T::of(1.5), then, otherwise),
            otherwise,
        )
    };
    let (s, c) = (is_odd(c, s), is_odd(s, c));
    let sine = T::if_less(
        quadrant,
        T::of(-0.5),
        -s,
        T::if_less(T::of(1.5), quadrant, -s, s),
    );
    let cosine = T::if_less(
        quadrant,
        T::of(-1.5),
        -c,
        T::if_less(T::of(0.5), quadrant, -c, c),
    );
    (sine, cosine)
}

/// Beyond this angle \[rad\] the short reduction would lose accuracy.
pub(crate) const LARGEST_REDUCED: f64 = 1e5;

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
            sin_cos_polynomial(self, &DOUBLE)
        } else {
            libm::sincos(self)
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
            sin_cos_polynomial(self, &SINGLE)
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
