//! Several numbers in SIMD lanes, one simulation in each.

use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use crate::numeric::float::write_sines_and_cosines;
use crate::numeric::scalar::Scalar;
use crate::numeric::transcendental::{exp, tanh};

/// `L` numbers that are computed with together; each lane has the bits of the same computation in `f64`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(32))]
pub struct Lanes<const L: usize>(pub [f64; L]);

impl<const L: usize> Lanes<L> {
    /// A value for each lane. Not by `from_fn` or `map` of arrays, which may become calls: their code would not be of the widest vectors.
    #[inline(always)]
    fn each(value: impl Fn(usize) -> f64) -> Self {
        let mut lanes = [0.0; L];
        for (i, lane) in lanes.iter_mut().enumerate() {
            *lane = value(i);
        }
        Self(lanes)
    }

    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        Self::each(|i| f(self.0[i], other.0[i]))
    }
}

macro_rules! elementwise {
    ($($trait:ident $method:ident $operator:tt)*) => {$(
        impl<const L: usize> $trait for Lanes<L> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                self.zip(other, |a, b| a $operator b)
            }
        }
    )*};
}
elementwise!(Add add + Sub sub - Mul mul * Div div /);

impl<const L: usize> Neg for Lanes<L> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::each(|i| -self.0[i])
    }
}

impl<const L: usize> AddAssign for Lanes<L> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<const L: usize> SubAssign for Lanes<L> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl<const L: usize> Scalar for Lanes<L> {
    const ZERO: Self = Self([0.0; L]);
    const ONE: Self = Self([1.0; L]);
    #[inline(always)]
    fn of(value: f64) -> Self {
        Self([value; L])
    }
    #[inline(always)]
    fn if_less(a: Self, b: Self, then: Self, otherwise: Self) -> Self {
        Self::each(|i| {
            if a.0[i] < b.0[i] {
                then.0[i]
            } else {
                otherwise.0[i]
            }
        })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self::each(|i| f64::abs(self.0[i]))
    }
    #[inline(always)]
    fn every(self, condition: impl Fn(f64) -> bool) -> bool {
        self.0.iter().all(|&a| condition(a))
    }
    #[inline(always)]
    fn is_finite(self) -> bool {
        // Without a branch.
        self.0.iter().fold(true, |all, a| all & a.is_finite())
    }
    #[inline(always)]
    fn map(self, f: impl Fn(f64) -> f64) -> Self {
        Self::each(|i| f(self.0[i]))
    }
    #[inline(always)]
    fn together<const K: usize>(values: [Self; K], f: impl Fn([f64; K]) -> f64) -> Self {
        Self::each(|i| f(core::array::from_fn(|k| values[k].0[i])))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.map(libm::sqrt)
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let [[sin], [cos]] = Self::sines_and_cosines(&[self]);
        (sin, cos)
    }
    /// One loop over all lanes of all angles: long enough that the compiler vectorises it at full width instead of unrolling it.
    #[inline(always)]
    fn sines_and_cosines<const K: usize>(angles: &[Self; K]) -> [[Self; K]; 2] {
        let (mut all, mut sines, mut cosines) = ([[0.0; L]; K], [[0.0; L]; K], [[0.0; L]; K]);
        for k in 0..K {
            all[k] = angles[k].0;
        }
        let found = [sines.as_flattened_mut(), cosines.as_flattened_mut()];
        write_sines_and_cosines(all.as_flattened(), found);
        let mut lanes = [[Self::ZERO; K]; 2];
        for k in 0..K {
            (lanes[0][k], lanes[1][k]) = (Self(sines[k]), Self(cosines[k]));
        }
        lanes
    }
    #[inline(always)]
    fn exp(self) -> Self {
        self.map(exp)
    }
    #[inline(always)]
    fn tanh(self) -> Self {
        self.map(tanh)
    }
    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        self.zip(x, libm::atan2)
    }
}
