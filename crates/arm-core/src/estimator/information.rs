//! Least squares one row at a time: the square root of the information matrix.

use crate::scalar::Real;

/// The triangular system `R x = z` whose least-squares solution is the estimate; `RᵀR` is the inverse covariance.
///
/// Rows are taken in by Givens rotations. Unlike a covariance, R cannot lose its definiteness to rounding, so single
/// precision is enough (Bierman 1977; Golub, Van Loan 2013, section 5.1.8).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Information<T, const P: usize> {
    r: [[T; P]; P],
    z: [T; P],
}

impl<T: Real, const P: usize> Information<T, P> {
    /// Independent values with standard deviations.
    pub fn independent(values: impl Iterator<Item = (T, T)>) -> Self {
        let mut new = Self {
            r: [[T::ZERO; P]; P],
            z: [T::ZERO; P],
        };
        for (i, (mean, sd)) in values.take(P).enumerate() {
            new.r[i][i] = T::ONE / sd;
            new.z[i] = mean / sd;
        }
        new
    }

    /// Takes in `row · x = value`, both in units of their noise.
    pub fn absorb(&mut self, row: [T; P], value: T) {
        self.rotate(row, value, 0);
    }

    fn rotate(&mut self, mut row: [T; P], mut value: T, first: usize) {
        for i in first..P {
            let b = row[i];
            if b == T::ZERO {
                continue;
            }
            let own = &mut self.r[i];
            let a = own[i];
            let reciprocal = T::ONE / (a.squared() + b.squared()).sqrt();
            let (cos, sin) = (a * reciprocal, b * reciprocal);
            for k in i..P {
                let (upper, lower) = (own[k], row[k]);
                own[k] = cos * upper + sin * lower;
                row[k] = cos * lower - sin * upper;
            }
            let upper = self.z[i];
            self.z[i] = cos * upper + sin * value;
            value = cos * value - sin * upper;
        }
    }

    /// Makes all that is known weaker by a factor of its standard deviations.
    pub fn fade(&mut self, factor: T) {
        for i in 0..P {
            for k in i..P {
                self.r[i][k] = self.r[i][k] * factor;
            }
            self.z[i] = self.z[i] * factor;
        }
    }

    /// The estimate.
    pub fn solve(&self) -> [T; P] {
        let mut x = self.z;
        for i in (0..P).rev() {
            let mut value = x[i];
            for k in i + 1..P {
                value -= self.r[i][k] * x[k];
            }
            x[i] = value / self.r[i][i];
        }
        x
    }

    /// Sets one unknown to a value; the others become the best under this condition.
    pub fn fix(&mut self, unknown: usize, to: T) {
        if unknown >= P {
            return;
        }
        for i in 0..unknown {
            self.z[i] -= self.r[i][unknown] * to;
            self.r[i][unknown] = T::ZERO;
        }
        // Without its column, the unknown's own row is one more row for those that follow.
        let (mut row, value) = (
            self.r[unknown],
            self.z[unknown] - self.r[unknown][unknown] * to,
        );
        row[unknown] = T::ZERO;
        self.rotate(row, value, unknown + 1);
        self.r[unknown] = [T::ZERO; P];
        self.r[unknown][unknown] = T::ONE;
        self.z[unknown] = to;
    }

    /// Standard deviation of a weighted sum of the unknowns, `‖R⁻ᵀ w‖`, in units of the noise.
    pub fn deviation(&self, weights: &[T; P]) -> T {
        let mut w = *weights;
        let mut sum = T::ZERO;
        for i in 0..P {
            if w[i] == T::ZERO {
                continue;
            }
            let value = w[i] / self.r[i][i];
            sum += value.squared();
            for k in i + 1..P {
                w[k] -= self.r[i][k] * value;
            }
        }
        sum.sqrt()
    }

    /// One over the standard deviation of an unknown, were all others known.
    ///
    /// Only those that follow it are; it serves to compare unknowns of different units.
    pub fn sharpness(&self, unknown: usize) -> T {
        let row = self.r.get(unknown);
        row.and_then(|r| r.get(unknown)).copied().unwrap_or(T::ZERO)
    }

    /// Standard deviation of one unknown, in units of the noise.
    pub fn deviation_of(&self, unknown: usize) -> T {
        let mut weights = [T::ZERO; P];
        if let Some(weight) = weights.get_mut(unknown) {
            *weight = T::ONE;
        }
        self.deviation(&weights)
    }
}
