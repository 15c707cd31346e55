//! Least squares one row at a time: the square root of the information matrix.

use core::array::from_fn;

use crate::numeric::covariance::copy_triangle;
use crate::numeric::scalar::Real;

/// The triangular system `R x = z` whose least-squares solution is the estimate, with `RᵀR = UᵀDU` the inverse covariance.
///
/// Kept as `D` and `U` with ones on its diagonal, and rows taken in by Givens rotations without square roots (Gentleman
/// 1973): half the operations of plain rotations, and as well conditioned. Unlike a covariance it cannot lose its
/// definiteness to rounding, so single precision is enough (Bierman 1977).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Information<T, const P: usize> {
    /// Above the diagonal.
    pub(super) u: [[T; P]; P],
    pub(super) d: [T; P],
    /// `U x = z`.
    z: [T; P],
}

/// `columns · x = value`, with a weight: one over its variance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Row<T, const P: usize> {
    pub columns: [T; P],
    pub value: T,
    pub weight: T,
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

    /// Becomes a copy of another.
    pub fn set(&mut self, other: &Self) {
        copy_triangle(&mut self.u, &other.u);
        (self.d, self.z) = (other.d, other.z);
    }

    /// Takes in what some of the unknowns, `first` to before `end`, have of a row; the row goes on with what is left.
    // Once in the code: its loop is what a period of a device costs.
    #[inline(never)]
    pub fn absorb(&mut self, taken: &mut Row<T, P>, first: usize, end: usize) {
        let (mut value, mut weight) = (taken.value, taken.weight);
        let row = &mut taken.columns;
        for i in first..end.min(P) {
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
            for (r, u) in beyond(row, i).iter_mut().zip(beyond(&mut self.u[i], i)) {
                let left = *r - own * *u;
                *u += gain * left;
                *r = left;
            }
            value -= own * self.z[i];
            self.z[i] += gain * value;
        }
        (taken.value, taken.weight) = (value, weight);
    }

    /// Makes all that is known weaker by a factor of its weights.
    pub fn fade(&mut self, factor: T) {
        for d in &mut self.d {
            *d = *d * factor;
        }
    }

    /// The estimate.
    #[inline(never)]
    pub fn solve(&self, x: &mut [T; P]) {
        *x = self.z;
        for i in (0..P).rev() {
            let mut value = x[i];
            let row = self.u[i].get(i + 1..).unwrap_or_default();
            for (&x, &u) in beyond(x, i).iter().zip(row) {
                value -= u * x;
            }
            x[i] = value;
        }
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
        let mut row = Row {
            columns: self.u[unknown],
            value: self.z[unknown] - to,
            weight: self.d[unknown],
        };
        self.absorb(&mut row, unknown + 1, P);
        self.u[unknown] = [T::ZERO; P];
        self.z[unknown] = to;
    }

    /// Rows of `U⁻¹`, from `first` on.
    ///
    /// Two columns of `U` in one loop, whose sums stay in registers.
    pub fn inverse_rows<const N: usize>(&self, first: usize, rows: &mut [[T; P]; N]) {
        for (j, row) in rows.iter_mut().enumerate() {
            row.fill(T::ZERO);
            if let Some(diagonal) = row.get_mut(first + j) {
                *diagonal = T::ONE;
            }
        }
        for pair in first / 2..P.div_ceil(2) {
            let k = 2 * pair;
            if k >= P {
                break;
            }
            // The last of an odd number stands beside itself.
            let next = if k + 1 < P { k + 1 } else { k };
            let mut here: [T; N] = from_fn(|j| rows[j][k]);
            let mut there: [T; N] = from_fn(|j| rows[j][next]);
            for i in first..k {
                let Some(upper) = self.u.get(i) else { break };
                let [u, v] = [upper[k], upper[next]];
                for j in 0..N {
                    here[j] -= u * rows[j][i];
                    there[j] -= v * rows[j][i];
                }
            }
            for j in 0..N {
                rows[j][k] = here[j];
                if next > k {
                    rows[j][next] = there[j] - self.u[k][next] * here[j];
                }
            }
        }
    }

    /// One over the variance of an unknown, were those that follow it known; it serves to compare unknowns of different
    /// units.
    pub fn sharpness(&self, unknown: usize) -> T {
        self.d.get(unknown).copied().unwrap_or(T::ZERO)
    }
}

/// What stands behind the place `i` of an array.
#[inline(always)]
fn beyond<T, const P: usize>(values: &mut [T; P], i: usize) -> &mut [T] {
    values.get_mut(i + 1..).unwrap_or_default()
}
