//! Rows of a regression.

use std::ops::Range;

/// Rows of a regression over a whole trial, column by column.
///
/// `columns[u][i * N + j]` belongs to unknown `u`, sample `i`, joint `j`; the right-hand side `rhs` is laid out alike.
#[derive(Clone, Debug, PartialEq)]
pub struct RegressionRows {
    /// One column for each unknown.
    pub columns: Vec<Vec<f64>>,
    /// Measured torque that the columns explain \[N m\].
    pub rhs: Vec<f64>,
    /// Index in the trial of each sample.
    pub samples: Vec<usize>,
    /// Which rows the cascade fits, laid out like `rhs`; all where there is none.
    pub fits: Option<Vec<bool>>,
    /// Torque that is held by joints at rest and therefore not in `rhs` \[N m\], laid out like it; none where no joint sticks.
    pub held: Option<Vec<f64>>,
}

impl RegressionRows {
    /// Whether the row at a place in `rhs` is fitted.
    pub fn fits(&self, at: usize) -> bool {
        self.fits.as_ref().is_none_or(|fits| fits[at])
    }

    /// Measured torque of the row at a place in `rhs`, with what is held at rest \[N m\].
    pub fn measured(&self, at: usize) -> f64 {
        self.rhs[at] + self.held.as_ref().map_or(0.0, |held| held[at])
    }

    /// Rows of some samples, one after another.
    ///
    /// * `fill` - puts those of the sample at a place into the rows
    pub(crate) fn of_samples<const N: usize>(
        unknowns: usize,
        samples: Range<usize>,
        mut fill: impl FnMut(&mut Self, usize),
    ) -> Self {
        let count = samples.len();
        let mut rows = Self::zeros::<N>(unknowns, samples.collect());
        for k in 0..count {
            fill(&mut rows, k);
        }
        rows
    }

    /// Rows of zeros.
    pub(crate) fn zeros<const N: usize>(unknowns: usize, samples: Vec<usize>) -> Self {
        let length = samples.len() * N;
        Self {
            columns: vec![vec![0.0; length]; unknowns],
            rhs: vec![0.0; length],
            samples,
            fits: None,
            held: None,
        }
    }
}
