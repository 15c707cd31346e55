//! Least squares one row at a time: the square root of the information matrix.

use crate::scalar::Real;

/// The triangular system `R x = z` whose least-squares solution is the estimate, with `RᵀR = UᵀDU` the inverse covariance.
///
/// Kept as `D` and `U` with ones on its diagonal, and rows taken in by Givens rotations without square roots (Gentleman
/// 1973): half the operations of plain rotations, and as well conditioned. Unlike a covariance it cannot lose its
/// definiteness to rounding, so single precision is enough (Bierman 1977).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Information<T, const P: usize> {
    /// Above the diagonal.
    u: [[T; P]; P],
    d: [T; P],
    /// `U x = z`.
    z: [T; P],
}

impl<T: Real, const P: usize> Information<T, P> {
    /// Independent values with standard deviations.
    pub fn independent(values: impl Iterator<Item = (T, T)>) -> Self {
        let mut new = Self {
            u: [[T::ZERO; P]; P],
            d: [T::ZERO; P],
            z: [T::ZERO; P],
        };
        new.restart(values);
        new
    }

    /// The same, in place.
    pub fn restart(&mut self, values: impl Iterator<Item = (T, T)>) {
        for row in &mut self.u {
            row.fill(T::ZERO);
        }
        let places = self.d.iter_mut().zip(&mut self.z);
        for ((d, z), (mean, sd)) in places.zip(values) {
            *d = T::ONE / sd.squared();
            *z = mean;
        }
    }

    /// Takes in `row · x = value`, which has a weight: one over its variance.
    pub fn absorb(&mut self, row: &[T; P], value: T, weight: T) {
        self.rotate(*row, value, weight, 0);
    }

    fn rotate(&mut self, mut row: [T; P], mut value: T, mut weight: T, first: usize) {
        for i in first..P {
            let own = row[i];
            if own == T::ZERO {
                continue;
            }
            let pushed = weight * own;
            let sum = self.d[i] + pushed * own;
            let reciprocal = T::ONE / sum;
            let gain = pushed * reciprocal;
            weight = weight * (self.d[i] * reciprocal);
            self.d[i] = sum;
            for k in i + 1..P {
                let left = row[k] - own * self.u[i][k];
                self.u[i][k] += gain * left;
                row[k] = left;
            }
            value -= own * self.z[i];
            self.z[i] += gain * value;
        }
    }

    /// Makes all that is known weaker by a factor of its weights.
    pub fn fade(&mut self, factor: T) {
        for d in &mut self.d {
            *d = *d * factor;
        }
    }

    /// The estimate.
    pub fn solve(&self) -> [T; P] {
        let mut x = self.z;
        for i in (0..P).rev() {
            let mut value = x[i];
            for k in i + 1..P {
                value -= self.u[i][k] * x[k];
            }
            x[i] = value;
        }
        x
    }

    /// Sets one unknown to a value; the others become the best under this condition.
    pub fn fix(&mut self, unknown: usize, to: T) {
        if unknown >= P {
            return;
        }
        for i in 0..unknown {
            self.z[i] -= self.u[i][unknown] * to;
            self.u[i][unknown] = T::ZERO;
        }
        // Without its column, the unknown's own row is one more row for those that follow.
        let (row, value) = (self.u[unknown], self.z[unknown] - to);
        self.rotate(row, value, self.d[unknown], unknown + 1);
        self.u[unknown] = [T::ZERO; P];
        self.z[unknown] = to;
    }

    /// Standard deviation of a weighted sum of the unknowns, `‖R⁻ᵀ w‖`.
    pub fn deviation(&self, weights: &[T; P]) -> T {
        let mut w = *weights;
        let mut sum = T::ZERO;
        for i in 0..P {
            let own = w[i];
            if own == T::ZERO {
                continue;
            }
            sum += own.squared() / self.d[i];
            for k in i + 1..P {
                w[k] -= self.u[i][k] * own;
            }
        }
        sum.sqrt()
    }

    /// One over the variance of an unknown, were those that follow it known; it serves to compare unknowns of different
    /// units.
    pub fn sharpness(&self, unknown: usize) -> T {
        self.d.get(unknown).copied().unwrap_or(T::ZERO)
    }

    /// Standard deviation of one unknown.
    pub fn deviation_of(&self, unknown: usize) -> T {
        let mut weights = [T::ZERO; P];
        if let Some(weight) = weights.get_mut(unknown) {
            *weight = T::ONE;
        }
        self.deviation(&weights)
    }
}
