//! Sine, cosine, exponential and hyperbolic tangent by polynomials, for one number or many at once. The scalar versions branch on their
//! argument; all branches give the same bits.

use crate::Scalar;

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
pub(crate) const SINGLE: Trigonometry<3, 3> = Trigonometry {
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
    polynomials(quarters, r, k)
}

/// Sine and cosine of a single number, with the bits of [`turned`] and [`reduced_sin_cos`], but with branches on the quarter turn. Along a
/// motion it rarely changes, so that branch prediction hides the latency of the argument reduction.
#[inline]
pub(crate) fn expected_sin_cos(x: f64) -> (f64, f64) {
    let k = &DOUBLE;
    let [first, second, third] = k.half_pi;
    let quarters = x * core::f64::consts::FRAC_2_PI + ROUND;
    let n = quarters - ROUND;
    if n == 0.0 {
        let Reduced { sin, cos, .. } = polynomials(quarters, x, k);
        (sin, cos)
    } else if n == -1.0 {
        let r = ((x + first) + second) + third;
        let Reduced { sin, cos, .. } = polynomials(quarters, r, k);
        (-cos, sin)
    } else if n == 1.0 {
        let r = ((x - first) - second) - third;
        let Reduced { sin, cos, .. } = polynomials(quarters, r, k);
        (cos, -sin)
    } else {
        turned(reduced_sin_cos(x, k))
    }
}

/// Sine and cosine of the rest `r` of a reduction, within ±π/4.
#[inline]
fn polynomials<T: Scalar, const S: usize, const C: usize>(
    quarters: T,
    r: T,
    k: &Trigonometry<S, C>,
) -> Reduced<T> {
    let z = r * r;
    let sin = r + r * z * series(&k.sine, z);
    let half = T::of(0.5) * z;
    let w = T::ONE - half;
    let cos = w + (((T::ONE - w) - half) + z * z * series(&k.cosine, z));
    Reduced { quarters, sin, cos }
}

/// As [`reduced_sin_cos`], for single precision from 2¹² to 2²⁷: with the quarter turns in integers of 64 bits, of which
/// the upper two count the whole ones. No double precision, which small processors compute in software.
pub(crate) fn far_reduced_sin_cos_single(x: f32) -> Reduced<f32> {
    /// 2/π times 2⁶⁴.
    const QUARTERS_PER_RADIAN: u64 = 0xa2f9_836e_4e44_152a;
    /// π/2 times 2³¹.
    const HALF_PI: i64 = 0xc90f_daa2;
    let bits = x.abs().to_bits();
    let mantissa = u64::from(bits & 0x007f_ffff | 0x0080_0000);
    // |x| is the mantissa times 2^(exponent − 150), and the quarters below are times 2⁶².
    let exponent = bits >> 23;
    let scaled = if exponent > 152 {
        QUARTERS_PER_RADIAN << ((exponent - 152) & 63)
    } else {
        QUARTERS_PER_RADIAN >> ((152 - exponent) & 63)
    };
    let quarters = scaled.wrapping_mul(mantissa);
    let nearest = quarters.wrapping_add(1 << 61) >> 62;
    // To radians in integers too, so that there is one rounding.
    let rest = (quarters.wrapping_sub(nearest << 62) as i64) >> 31;
    let r = rest.wrapping_mul(HALF_PI) as f32 * (1.0 / (1_u64 << 62) as f32);
    let sign = 1.0_f32.copysign(x);
    let whole = sign * nearest as u32 as f32;
    polynomials(SINGLE.round as f32 + whole, sign * r, &SINGLE)
}

/// The same in double precision, from 2¹⁶ to 2⁵³·2 rad: with the quarter turns in integers of 128 bits.
pub(crate) fn far_reduced_sin_cos(x: f64) -> Reduced<f64> {
    /// 2/π times 2¹²⁸.
    const QUARTERS_PER_RADIAN: u128 = 0xa2f9_836e_4e44_1529_fc27_57d1_f534_ddc0;
    let bits = x.abs().to_bits();
    let mantissa = u128::from(bits & 0x000f_ffff_ffff_ffff | 0x0010_0000_0000_0000);
    // |x| is the mantissa times 2^(exponent − 1075), and the quarters below are times 2¹²⁶.
    let exponent = bits >> 52;
    let quarters =
        (QUARTERS_PER_RADIAN >> (1077_u64.wrapping_sub(exponent) & 127)).wrapping_mul(mantissa);
    let nearest = quarters.wrapping_add(1 << 125) >> 126;
    // The rest times 2⁶⁴, to radians.
    let rest = (quarters.wrapping_sub(nearest << 126) as i128 >> 62) as i64;
    // By halves, which processors convert themselves; their sum is rounded once.
    let [high, low] = [f64::from((rest >> 32) as i32), f64::from(rest as u32)];
    let rest = high * 4_294_967_296.0 + low;
    let r = rest * (core::f64::consts::FRAC_PI_2 / 18_446_744_073_709_551_616.0);
    let sign = 1.0_f64.copysign(x);
    polynomials(ROUND + sign * nearest as u32 as f64, sign * r, &DOUBLE)
}

/// `c₀ + c₁z + c₂z² + …` by pairs, which wait for each other half as often as one by one.
#[inline]
fn series<T: Scalar>(c: &[f64], z: T) -> T {
    let square = z * z;
    let (pairs, odd) = c.as_chunks();
    let mut pairs = pairs.iter().rev().map(|&[a, b]| T::of(a) + T::of(b) * z);
    let last = match odd {
        &[last] => T::of(last),
        _ => pairs.next().unwrap_or(T::ZERO),
    };
    pairs.fold(last, |sum, next| next + square * sum)
}

/// Turns sine and cosine by quarters: exchanges them for odd ones, and sets the signs.
#[inline]
pub(crate) fn turned(reduced: Reduced<f64>) -> (f64, f64) {
    let n = reduced.quarters.to_bits();
    // The same where a number takes two registers, and its bits more instructions than its value.
    if cfg!(target_pointer_width = "32") {
        let n = n as u32;
        let (sin, cos) = match n & 1 {
            0 => (reduced.sin, reduced.cos),
            _ => (reduced.cos, reduced.sin),
        };
        let sin = if n & 2 == 0 { sin } else { -sin };
        let cos = if n.wrapping_add(1) & 2 == 0 {
            cos
        } else {
            -cos
        };
        return (sin, cos);
    }
    let (sin, cos) = (reduced.sin.to_bits(), reduced.cos.to_bits());
    let exchange = (sin ^ cos) & (n & 1).wrapping_neg();
    (
        f64::from_bits((sin ^ exchange) ^ ((n & 2) << 62)),
        f64::from_bits((cos ^ exchange) ^ ((n.wrapping_add(1) & 2) << 62)),
    )
}

/// As [`turned`], in single precision.
#[inline]
pub(crate) fn turned_single(reduced: Reduced<f32>) -> (f32, f32) {
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
/// Beyond these, in double and single precision, neighbouring numbers are more than a turn apart: no angle \[rad\].
pub(crate) const LARGEST_ANGLES: (f64, f32) = (1e16, 1e8);

/// 1.5·2⁵²: adding and subtracting it rounds to the nearest integer.
const ROUND: f64 = DOUBLE.round;
/// ln 2 in two parts, the first short enough that its product with an exponent is exact (FreeBSD's `e_exp.c`).
const LN_2: [f64; 2] = [6.931_471_803_691_238e-1, 1.908_214_929_270_587_7e-10];
/// 1/2!, 1/3!, … 1/13!: the first term left out is below 10⁻¹⁷ within ±½ ln 2.
const FACTORIALS: [f64; 12] = [
    1.0 / 2.0,
    1.0 / 6.0,
    1.0 / 24.0,
    1.0 / 120.0,
    1.0 / 720.0,
    1.0 / 5_040.0,
    1.0 / 40_320.0,
    1.0 / 362_880.0,
    1.0 / 3_628_800.0,
    1.0 / 39_916_800.0,
    1.0 / 479_001_600.0,
    1.0 / 6_227_020_800.0,
];

/// `[2ⁿ⁻¹, eʳ − 1]` of `x = n ln 2 + r`.
#[inline]
fn power_and_rest(x: f64) -> [f64; 2] {
    let biased = x * core::f64::consts::LOG2_E + ROUND;
    let n = biased - ROUND;
    let r = (x - n * LN_2[0]) - n * LN_2[1];
    let rest = r + r * r * series(&FACTORIALS, r);
    // The lowest bits of the mantissa are those of n.
    let exponent = (biased.to_bits() << 52).wrapping_add(1022 << 52);
    [f64::from_bits(exponent), rest]
}

/// Below this the exponential would not be a normal number, and is zero.
pub(crate) const LEAST_EXPONENT: f64 = -708.0;
/// Beyond this the exponential is infinite.
pub(crate) const LARGEST_EXPONENT: f64 = 710.0;

/// Exponential; zero below −708.
#[inline]
pub(crate) fn exp(x: f64) -> f64 {
    let inside = if x < LEAST_EXPONENT {
        LEAST_EXPONENT
    } else {
        x
    };
    let value = exp_within(inside);
    if x < LEAST_EXPONENT { 0.0 } else { value }
}

/// Exponential from −708 on.
#[cfg_attr(target_os = "none", inline(never))]
#[cfg_attr(not(target_os = "none"), inline)]
pub(crate) fn exp_within(x: f64) -> f64 {
    let inside = if x > LARGEST_EXPONENT {
        LARGEST_EXPONENT
    } else {
        x
    };
    let [half, rest] = power_and_rest(inside);
    2.0 * (half + half * rest)
}

/// Beyond this the hyperbolic tangent is 1 in double precision.
pub(crate) const SATURATED: f64 = 20.0;

/// Hyperbolic tangent.
#[inline]
pub(crate) fn tanh(x: f64) -> f64 {
    let size = if x.abs() > SATURATED {
        SATURATED
    } else {
        x.abs()
    };
    tanh_within(size).copysign(x)
}

/// Hyperbolic tangent from zero to its saturation, `(e²ˣ − 1)/(e²ˣ + 1)`.
#[cfg_attr(target_os = "none", inline(never))]
#[cfg_attr(not(target_os = "none"), inline)]
pub(crate) fn tanh_within(x: f64) -> f64 {
    let [half, rest] = power_and_rest(2.0 * x);
    let power = 2.0 * half;
    let grown = power * rest + (power - 1.0);
    grown / (grown + 2.0)
}
