//! A covariance by its root.

use crate::scalar::Real;

/// `A V Aᵀ` with a diagonal `V`.
///
/// With a root no rounding makes a variance negative, and where many parts cancel, half as many digits are lost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Covariance<T, const P: usize> {
    /// `A`: how each unknown depends on independent quantities.
    pub rows: [[T; P]; P],
    /// `V`: the variances of these.
    pub variances: [T; P],
}

impl<T: Real, const P: usize> Covariance<T, P> {
    /// That of independent unknowns.
    pub fn independent(variances: [T; P]) -> Self {
        let mut rows = [[T::ZERO; P]; P];
        for (k, row) in rows.iter_mut().enumerate() {
            row[k] = T::ONE;
        }
        Self { rows, variances }
    }

    /// Standard deviation of a weighted sum of the unknowns. Those without a weight cost nothing.
    #[inline(never)]
    pub fn deviation(&self, weights: &[T; P]) -> T {
        let mut sums = [T::ZERO; P];
        for (&weight, row) in weights.iter().zip(&self.rows) {
            if weight != T::ZERO {
                for (sum, &value) in sums.iter_mut().zip(row) {
                    *sum += weight * value;
                }
            }
        }
        let squares = sums.iter().zip(&self.variances);
        squares
            .fold(T::ZERO, |all, (&sum, &v)| all + sum.squared() * v)
            .sqrt()
    }
}
