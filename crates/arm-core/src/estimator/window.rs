//! Rows of a few control periods, summed.

use super::information::Row;
use super::settings::Tuning;
use crate::numeric::scalar::Real;

/// Sums over a window of rows that the movement made meaningful.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Window<T, const N: usize, const P: usize> {
    /// Periods since it was begun.
    pub age: u32,
    /// Whether the arm moved at any time.
    pub moved: bool,
    /// Rows of each joint.
    pub counts: [u32; N],
    columns: [[T; P]; N],
    values: [T; N],
}

impl<T: Real, const N: usize, const P: usize> Window<T, N, P> {
    pub const EMPTY: Self = Self {
        age: 0,
        moved: false,
        counts: [0; N],
        columns: [[T::ZERO; P]; N],
        values: [T::ZERO; N],
    };

    /// Begins anew. Sums are not cleared: the first row takes their place.
    pub fn clear(&mut self) {
        (self.age, self.moved, self.counts) = (0, false, [0; N]);
    }

    /// Adds the row of a joint.
    // Once in the code, not for each joint.
    #[inline(never)]
    pub fn add(&mut self, joint: usize, columns: &[T; P], value: T) {
        if joint >= N {
            return;
        }
        self.counts[joint] += 1;
        let pairs = self.columns[joint].iter_mut().zip(columns);
        if self.counts[joint] == 1 {
            // Added to nothing: the copying of memory in general takes longer.
            pairs.for_each(|(sum, &column)| *sum = T::ZERO + column);
            self.values[joint] = value;
        } else {
            pairs.for_each(|(sum, &column)| *sum += column);
            self.values[joint] += value;
        }
    }

    /// The mean row of a joint. `None` with too few rows.
    ///
    /// A window with gaps counts less, as a mean of fewer rows does.
    #[inline(never)]
    pub fn mean(&self, joint: usize, tuning: &Tuning<T, N>) -> Option<Row<T, P>> {
        let count = *self.counts.get(joint)?;
        if count < tuning.enough {
            return None;
        }
        let (columns, value) = (self.columns.get(joint)?, *self.values.get(joint)?);
        let [count, full] = [count, tuning.rows].map(T::of_count);
        let share = T::ONE / count;
        let weight = *tuning.weight.get(joint)? * count / full;
        Some(Row {
            columns: columns.map(|c| c * share),
            value: value * share,
            weight,
        })
    }
}

/// The window that is being filled, and the full one that is worked on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Windows<T, const N: usize, const P: usize> {
    both: [Window<T, N, P>; 2],
    second: bool,
}

impl<T: Real, const N: usize, const P: usize> Windows<T, N, P> {
    pub const EMPTY: Self = Self {
        both: [Window::EMPTY; 2],
        second: false,
    };

    pub fn open(&mut self) -> &mut Window<T, N, P> {
        let [first, second] = &mut self.both;
        if self.second { second } else { first }
    }

    pub fn full(&self) -> &Window<T, N, P> {
        let [first, second] = &self.both;
        if self.second { first } else { second }
    }

    /// The open one is full; the other begins.
    pub fn exchange(&mut self) {
        self.second = !self.second;
        self.open().clear();
    }
}
