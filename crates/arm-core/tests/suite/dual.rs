//! Dual numbers: a value and its derivative along one direction, exact to rounding.

use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use arm_core::{Joints, Scalar};

/// `value + slope ε` with ε² = 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual {
    pub value: f64,
    pub slope: f64,
}

impl Dual {
    pub const fn new(value: f64, slope: f64) -> Self {
        Self { value, slope }
    }

    /// A function of the value with its derivative there.
    fn chain(self, value: f64, derivative: f64) -> Self {
        Self::new(value, derivative * self.slope)
    }
}

/// Joint values with their rates.
pub fn along<const N: usize>(values: &Joints<f64, N>, rates: &Joints<f64, N>) -> Joints<Dual, N> {
    Joints::from_fn(|i, _| Dual::new(values[i], rates[i]))
}

impl Add for Dual {
    type Output = Self;
    fn add(self, b: Self) -> Self {
        Self::new(self.value + b.value, self.slope + b.slope)
    }
}
impl Sub for Dual {
    type Output = Self;
    fn sub(self, b: Self) -> Self {
        Self::new(self.value - b.value, self.slope - b.slope)
    }
}
impl Mul for Dual {
    type Output = Self;
    fn mul(self, b: Self) -> Self {
        Self::new(
            self.value * b.value,
            self.slope * b.value + self.value * b.slope,
        )
    }
}
impl Div for Dual {
    type Output = Self;
    fn div(self, b: Self) -> Self {
        let value = self.value / b.value;
        Self::new(value, (self.slope - value * b.slope) / b.value)
    }
}
impl Neg for Dual {
    type Output = Self;
    fn neg(self) -> Self {
        Self::new(-self.value, -self.slope)
    }
}
impl AddAssign for Dual {
    fn add_assign(&mut self, b: Self) {
        *self = *self + b;
    }
}
impl SubAssign for Dual {
    fn sub_assign(&mut self, b: Self) {
        *self = *self - b;
    }
}

impl Scalar for Dual {
    const ZERO: Self = Self::new(0.0, 0.0);
    const ONE: Self = Self::new(1.0, 0.0);

    fn of(value: f64) -> Self {
        Self::new(value, 0.0)
    }
    fn if_less(a: Self, b: Self, then: Self, otherwise: Self) -> Self {
        if a.value < b.value { then } else { otherwise }
    }
    fn every(self, condition: impl Fn(f64) -> bool) -> bool {
        condition(self.value)
    }
    fn map(self, _: impl Fn(f64) -> f64) -> Self {
        unimplemented!("the derivative of an unknown function")
    }
    fn together<const K: usize>(_: [Self; K], _: impl Fn([f64; K]) -> f64) -> Self {
        unimplemented!("the derivatives of an unknown function")
    }
    fn sqrt(self) -> Self {
        let root = Scalar::sqrt(self.value);
        self.chain(root, 0.5 / root)
    }
    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = Scalar::sin_cos(self.value);
        (self.chain(sin, cos), self.chain(cos, -sin))
    }
    fn exp(self) -> Self {
        let e = Scalar::exp(self.value);
        self.chain(e, e)
    }
    fn tanh(self) -> Self {
        let t = Scalar::tanh(self.value);
        self.chain(t, 1.0 - t * t)
    }
    fn atan2(self, x: Self) -> Self {
        let square = self.value * self.value + x.value * x.value;
        let slope = (x.value * self.slope - self.value * x.slope) / square;
        Self::new(Scalar::atan2(self.value, x.value), slope)
    }
}

#[test]
fn derivatives_in_the_head() {
    let x = Dual::new(3.0, 1.0);
    assert_eq!(x * x, Dual::new(9.0, 6.0));
    assert_eq!(Dual::ONE / x, Dual::new(1.0 / 3.0, -1.0 / 9.0));
    assert_eq!(Scalar::sqrt(Dual::new(4.0, 1.0)), Dual::new(2.0, 0.25));
    let (sin, cos) = Dual::new(0.0, 2.0).sin_cos();
    assert_eq!((sin, cos), (Dual::new(0.0, 2.0), Dual::new(1.0, 0.0)));
    assert_eq!(Dual::new(0.0, 1.0).tanh(), Dual::new(0.0, 1.0));
    assert_eq!(Dual::new(0.0, 1.0).exp(), Dual::new(1.0, 1.0));
    assert_eq!(Dual::new(0.0, 1.0).atan2(Dual::ONE), Dual::new(0.0, 1.0));
}
