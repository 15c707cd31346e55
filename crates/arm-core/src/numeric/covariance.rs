//! Covariances, stored as square roots.

use core::array::from_fn;

use crate::numeric::scalar::Real;

/// Columns that a loop over a triangular matrix takes at once: what is written out costs a third less than one by one.
const BLOCK: usize = 6;

/// Copies a triangular matrix.
// Down the blocks of each row, for what lies together would be copied by the function for memory in general, which takes longer.
#[inline(never)]
pub(crate) fn copy_triangle<T: Copy, const P: usize>(to: &mut [[T; P]; P], from: &[[T; P]; P]) {
    for first in (0..P).step_by(BLOCK) {
        for (to, from) in to.iter_mut().zip(from).take(first + BLOCK) {
            let (to, from) = (to.get_mut(first..), from.get(first..));
            let (to, from) = (to.unwrap_or_default(), from.unwrap_or_default());
            match (to.first_chunk_mut::<BLOCK>(), from.first_chunk()) {
                (Some(to), Some(from)) => *to = *from,
                _ => to.iter_mut().zip(from).for_each(|(to, from)| *to = *from),
            }
        }
    }
}

/// `A Aᵀ` with an upper triangular `A`.
///
/// With a root no rounding makes a variance negative, and where many parts cancel, half as many digits are lost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Covariance<T, const P: usize> {
    /// `A`: how each unknown depends on independent quantities of variance one, its own and those of the unknowns after it.
    pub root: [[T; P]; P],
}

impl<T: Real, const P: usize> Covariance<T, P> {
    /// That of independent unknowns, from their standard deviations.
    pub fn independent(sd: [T; P]) -> Self {
        let mut new = Self {
            root: [[T::ZERO; P]; P],
        };
        new.restart(sd.into_iter());
        new
    }

    /// The same, in place.
    pub fn restart(&mut self, sd: impl Iterator<Item = T>) {
        self.root.as_flattened_mut().fill(T::ZERO);
        for (k, (row, sd)) in self.root.iter_mut().zip(sd).enumerate() {
            row[k] = sd;
        }
    }

    /// Sums of the leading unknowns with weights, each from one of them on, given in the independent quantities.
    #[inline]
    pub fn tails<const N: usize>(&self, weights: &[T; N]) -> Sums<T, N, P> {
        Sums(from_fn(|i| {
            let (mut sum, mut all) = (T::ZERO, [T::ZERO; N]);
            let rows = self.root.iter().zip(weights).zip(&mut all);
            for ((row, &weight), place) in rows.rev() {
                sum += weight * row[i];
                *place = sum;
            }
            all
        }))
    }
}

/// `N` sums of unknowns, in the independent quantities.
pub(crate) struct Sums<T, const N: usize, const P: usize>([[T; N]; P]);

impl<T: Real, const N: usize, const P: usize> Sums<T, N, P> {
    /// Adds an unknown with a weight to one of them.
    #[inline(never)]
    pub fn add(&mut self, number: usize, covariance: &Covariance<T, P>, unknown: usize, weight: T) {
        let Some(row) = covariance.root.get(unknown).filter(|_| number < N) else {
            return;
        };
        // From the block of the unknown on: before it there are zeros.
        let (blocks, last) = self.0.as_chunks_mut::<BLOCK>();
        let (others, rest) = row.as_chunks::<BLOCK>();
        let blocks = blocks.get_mut(unknown / BLOCK..).unwrap_or_default();
        let others = others.get(unknown / BLOCK..).unwrap_or_default();
        for (block, other) in blocks.iter_mut().zip(others) {
            for (places, &value) in block.iter_mut().zip(other) {
                places[number] += weight * value;
            }
        }
        for (places, &value) in last.iter_mut().zip(rest) {
            places[number] += weight * value;
        }
    }

    /// Their standard deviations.
    #[inline]
    pub fn deviations(&self) -> [T; N] {
        let mut variances = [T::ZERO; N];
        for values in &self.0 {
            for (variance, value) in variances.iter_mut().zip(values) {
                *variance += value.squared();
            }
        }
        variances.map(T::sqrt)
    }
}
