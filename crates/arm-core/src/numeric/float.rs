//! Single numbers as [`Scalar`]s.

use crate::numeric::scalar::{Real, Scalar};
use crate::numeric::transcendental::{
    DOUBLE, LARGEST_ANGLES, LARGEST_REDUCED, LEAST_EXPONENT, SATURATED, SINGLE, exp_within,
    expected_sin_cos, far_reduced_sin_cos, far_reduced_sin_cos_single, reduced_sin_cos,
    tanh_within, turned, turned_single,
};

/// Square roots of the processor where it has them: the compiler recognises these two names, and takes the instruction or the
/// function of its own support. Either is exact by IEEE 754.
#[cfg(target_os = "none")]
#[expect(
    unsafe_code,
    reason = "two declarations; no stable function of core takes a square root"
)]
mod root {
    unsafe extern "C" {
        pub safe fn sqrt(x: f64) -> f64;
        pub safe fn sqrtf(x: f32) -> f32;
    }
}
#[cfg(not(target_os = "none"))]
use libm as root;

impl Real for f64 {
    #[inline]
    fn bits(self) -> u64 {
        self.to_bits()
    }
    #[inline]
    fn to_f64(self) -> f64 {
        self
    }
    #[inline]
    fn of_count(count: u32) -> Self {
        f64::from(count)
    }
    #[inline]
    fn whole(self) -> u32 {
        self as u32
    }
}

impl Real for f32 {
    #[inline]
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
    #[inline]
    fn bits(self) -> u64 {
        u64::from(self.to_bits())
    }
    #[inline]
    fn of_count(count: u32) -> Self {
        count as f32
    }
    #[inline]
    fn whole(self) -> u32 {
        self as u32
    }
}

/// Sines and cosines of many angles \[rad\]: one pass without a branch, which the compiler vectorises. Where any angle is beyond the short
/// reduction, all are computed again one by one.
///
/// # Panics
/// Where `sines` or `cosines` is shorter than `angles`.
#[inline(always)]
pub fn write_sines_and_cosines(angles: &[f64], [sines, cosines]: [&mut [f64]; 2]) {
    let count = angles.len();
    let (sines, cosines) = (&mut sines[..count], &mut cosines[..count]);
    let mut within = true;
    for i in 0..count {
        (sines[i], cosines[i]) = turned(reduced_sin_cos(angles[i], &DOUBLE));
        within &= f64::abs(angles[i]) <= LARGEST_REDUCED;
    }
    if !within {
        for i in 0..count {
            (sines[i], cosines[i]) = Scalar::sin_cos(angles[i]);
        }
    }
}

/// Kept out of the way of the usual case.
#[cold]
#[inline(never)]
fn far_sin_cos(x: f64) -> (f64, f64) {
    if x.abs() < LARGEST_ANGLES.0 {
        turned(far_reduced_sin_cos(x))
    } else {
        (f64::NAN, f64::NAN)
    }
}

#[cold]
#[inline(never)]
fn far_sin_cos_single(x: f32) -> (f32, f32) {
    if x.abs() < LARGEST_ANGLES.1 {
        turned_single(far_reduced_sin_cos_single(x))
    } else {
        (f32::NAN, f32::NAN)
    }
}

impl Scalar for f64 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    #[inline]
    fn of(value: f64) -> Self {
        value
    }
    #[inline]
    fn abs(self) -> Self {
        f64::abs(self)
    }
    #[inline]
    fn if_less(a: Self, b: Self, then: Self, otherwise: Self) -> Self {
        if a < b { then } else { otherwise }
    }
    #[inline]
    fn where_less(
        a: Self,
        b: Self,
        then: impl FnOnce() -> Self,
        otherwise: impl FnOnce() -> Self,
    ) -> Self {
        if a < b { then() } else { otherwise() }
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
    fn together<const K: usize>(values: [Self; K], f: impl Fn([f64; K]) -> f64) -> Self {
        f(values)
    }
    #[inline]
    fn sqrt(self) -> Self {
        root::sqrt(self)
    }
    // On a device once in the code.
    #[cfg_attr(target_os = "none", inline(never))]
    #[cfg_attr(not(target_os = "none"), inline)]
    fn sin_cos(self) -> (Self, Self) {
        if self.abs() <= LARGEST_REDUCED {
            // A microcontroller executes in order and has little program memory.
            if cfg!(target_os = "none") {
                turned(reduced_sin_cos(self, &DOUBLE))
            } else {
                expected_sin_cos(self)
            }
        } else {
            far_sin_cos(self)
        }
    }
    #[inline]
    fn exp(self) -> Self {
        if self < LEAST_EXPONENT {
            0.0
        } else {
            exp_within(self)
        }
    }
    #[inline]
    fn tanh(self) -> Self {
        let size = f64::abs(self);
        // The usual cases of dry friction, motion and rest; the polynomial gives the same bits.
        let value = if size > SATURATED {
            1.0
        } else if size == 0.0 {
            0.0
        } else {
            tanh_within(size)
        };
        value.copysign(self)
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
    fn abs(self) -> Self {
        f32::abs(self)
    }
    #[inline]
    fn if_less(a: Self, b: Self, then: Self, otherwise: Self) -> Self {
        if a < b { then } else { otherwise }
    }
    #[inline]
    fn where_less(
        a: Self,
        b: Self,
        then: impl FnOnce() -> Self,
        otherwise: impl FnOnce() -> Self,
    ) -> Self {
        if a < b { then() } else { otherwise() }
    }
    #[inline]
    fn every(self, condition: impl Fn(f64) -> bool) -> bool {
        condition(f64::from(self))
    }
    #[inline]
    fn is_finite(self) -> bool {
        // Not through double precision, which small processors compute in software.
        Self::is_finite(self)
    }
    #[inline]
    fn within(self, min: f64, max: f64) -> bool {
        self >= min as f32 && self <= max as f32
    }
    #[inline]
    fn map(self, f: impl Fn(f64) -> f64) -> Self {
        f(f64::from(self)) as f32
    }
    #[inline]
    fn together<const K: usize>(values: [Self; K], f: impl Fn([f64; K]) -> f64) -> Self {
        f(values.map(f64::from)) as f32
    }
    #[inline]
    fn sqrt(self) -> Self {
        root::sqrtf(self)
    }
    // On a device once in the code.
    #[cfg_attr(target_os = "none", inline(never))]
    #[cfg_attr(not(target_os = "none"), inline)]
    fn sin_cos(self) -> (Self, Self) {
        // 3-part reduction in single precision holds to a few thousand radians.
        if self.abs() <= 4096.0 {
            turned_single(reduced_sin_cos(self, &SINGLE))
        } else {
            far_sin_cos_single(self)
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
