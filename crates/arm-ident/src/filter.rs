//! Butterworth low-pass filters, once or without phase.

use crate::error::{IdentError, check_finite, check_least, check_len, check_range};
use arm_sim::widest::{Computation, widest};
use std::f64::consts::PI;

/// Highest order; beyond it no measurement asks for a steeper edge.
const HIGHEST_ORDER: usize = 20;

/// One second-order section `(b₀ + b₁z⁻¹ + b₂z⁻²) / (1 + a₁z⁻¹ + a₂z⁻²)` with unit gain at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Section {
    b: [f64; 3],
    a: [f64; 2],
}

/// A Butterworth low-pass filter as second-order sections (bilinear transform with pre-warping), for columns sampled at a fixed rate.
///
/// The cutoff is that of a **single pass**: −3.01 dB there. [`Butterworth::both_ways`] passes twice, so it has −6.02 dB at the same frequency and −3.01 dB at
/// [`Butterworth::half_power_both_ways_hz`], which is lower. Whoever means "−3 dB of the zero-phase filter" starts with [`Butterworth::for_both_ways`].
#[derive(Debug, Clone, PartialEq)]
pub struct Butterworth {
    sections: Vec<Section>,
    order: usize,
    /// `tan(π f_c / f_s)`
    warped: f64,
    rate_hz: f64,
}

impl Butterworth {
    /// A filter of `order` 1…20 with −3.01 dB at `cutoff_hz` in a single pass.
    ///
    /// # Errors
    /// [`IdentError::OutOfRange`] unless `0 < cutoff < rate/2`.
    pub fn low_pass(order: usize, cutoff_hz: f64, rate_hz: f64) -> Result<Self, IdentError> {
        check_range("order", order as f64, [1.0, HIGHEST_ORDER as f64])?;
        check_range("rate_hz", rate_hz, [f64::MIN_POSITIVE, f64::MAX])?;
        check_range(
            "cutoff_hz / rate_hz",
            cutoff_hz / rate_hz,
            [1e-7, 0.499_999],
        )?;
        Ok(Self::of_warped(
            order,
            libm::tan(PI * cutoff_hz / rate_hz),
            rate_hz,
        ))
    }

    /// A filter that has −3.01 dB at `half_power_hz` after both passes of [`Butterworth::both_ways`].
    ///
    /// Its single-pass cutoff is higher: `tan(π f_c/f_s) = tan(π f/f_s) / (√2 − 1)^(1/2n)`.
    ///
    /// # Errors
    /// As [`Butterworth::low_pass`].
    pub fn for_both_ways(
        order: usize,
        half_power_hz: f64,
        rate_hz: f64,
    ) -> Result<Self, IdentError> {
        let plain = Self::low_pass(order, half_power_hz, rate_hz)?;
        Ok(Self::of_warped(
            order,
            plain.warped / two_pass_factor(order),
            rate_hz,
        ))
    }

    fn of_warped(order: usize, k: f64, rate_hz: f64) -> Self {
        let mut sections = Vec::with_capacity(order.div_ceil(2));
        if order % 2 == 1 {
            let b = k / (1.0 + k);
            sections.push(Section {
                b: [b, b, 0.0],
                a: [(k - 1.0) / (k + 1.0), 0.0],
            });
        }
        for pair in 0..order / 2 {
            // Poles of the prototype at −cos φ ± i sin φ.
            let m = (2 * pair + 1 + order % 2) as f64;
            let damping = 2.0 * libm::cos(PI * m / (2.0 * order as f64));
            let below = 1.0 + damping * k + k * k;
            let b = k * k / below;
            sections.push(Section {
                b: [b, 2.0 * b, b],
                a: [
                    2.0 * (k * k - 1.0) / below,
                    (1.0 - damping * k + k * k) / below,
                ],
            });
        }
        Self {
            sections,
            order,
            warped: k,
            rate_hz,
        }
    }

    /// Frequency of −3.01 dB in a single pass \[Hz\].
    pub fn cutoff_hz(&self) -> f64 {
        libm::atan(self.warped) * self.rate_hz / PI
    }

    /// Frequency of −3.01 dB after both passes \[Hz\]; at [`Butterworth::cutoff_hz`] it is −6.02 dB.
    pub fn half_power_both_ways_hz(&self) -> f64 {
        libm::atan(self.warped * two_pass_factor(self.order)) * self.rate_hz / PI
    }

    /// Gain of a single pass at a frequency below half the rate; both passes have its square.
    pub fn gain(&self, frequency_hz: f64) -> f64 {
        let ratio = libm::tan(PI * frequency_hz / self.rate_hz) / self.warped;
        1.0 / (1.0 + libm::pow(ratio * ratio, self.order as f64)).sqrt()
    }

    /// Samples that [`Butterworth::both_ways`] adds at each end; a column must be longer.
    pub fn padding(&self) -> usize {
        3 * (2 * self.sections.len() + 1 - self.order % 2)
    }

    /// One causal pass, as a sensor's filter would do; starts at rest on the first value.
    ///
    /// # Errors
    /// [`IdentError::NotFinite`].
    pub fn once(&self, column: &[f64]) -> Result<Vec<f64>, IdentError> {
        check_finite("column", column)?;
        let mut out = column.to_vec();
        self.pass(&mut out);
        Ok(out)
    }

    /// Forward and backward, without phase. Equals `scipy.signal.sosfiltfilt` with its defaults: odd reflection of [`Butterworth::padding`] samples at both
    /// ends, steady-state initial conditions.
    ///
    /// # Errors
    /// [`IdentError::TooFew`] for a column not longer than the padding, [`IdentError::NotFinite`].
    pub fn both_ways(&self, column: &[f64]) -> Result<Vec<f64>, IdentError> {
        let (n, edge) = (column.len(), self.padding());
        check_least("samples of column", n, edge + 1)?;
        check_finite("column", column)?;
        let (first, last) = (column[0], column[n - 1]);
        let mut long = Vec::with_capacity(n + 2 * edge);
        long.extend((1..=edge).rev().map(|i| 2.0 * first - column[i]));
        long.extend_from_slice(column);
        long.extend((1..=edge).map(|i| 2.0 * last - column[n - 1 - i]));
        self.pass(&mut long);
        long.reverse();
        self.pass(&mut long);
        long.reverse();
        long.truncate(edge + n);
        long.drain(..edge);
        Ok(long)
    }

    /// [`Butterworth::both_ways`] of several columns of one length, with the same bits: side by side they take hardly longer than one.
    ///
    /// # Errors
    /// As [`Butterworth::both_ways`]; [`IdentError::Length`] for columns of different lengths.
    pub fn both_ways_all(&self, columns: &[Vec<f64>]) -> Result<Vec<Vec<f64>>, IdentError> {
        /// Columns side by side.
        const WIDTH: usize = 4;
        let n = columns.first().map_or(0, Vec::len);
        let edge = self.padding();
        for column in columns {
            check_len("samples of columns", column.len(), n)?;
            check_least("samples of column", n, edge + 1)?;
            check_finite("column", column)?;
        }
        let mut out = Vec::with_capacity(columns.len());
        for group in columns.chunks(WIDTH) {
            let mut long = vec![[0.0; WIDTH]; n + 2 * edge];
            for (c, column) in group.iter().enumerate() {
                let (first, last) = (column[0], column[n - 1]);
                for i in 1..=edge {
                    long[edge - i][c] = 2.0 * first - column[i];
                    long[edge + n - 1 + i][c] = 2.0 * last - column[n - 1 - i];
                }
                for (row, value) in long[edge..].iter_mut().zip(column) {
                    row[c] = *value;
                }
            }
            for _ in 0..2 {
                widest(SideBySide {
                    sections: &self.sections,
                    rows: &mut long,
                });
                long.reverse();
            }
            for c in 0..group.len() {
                out.push(long[edge..edge + n].iter().map(|row| row[c]).collect());
            }
        }
        Ok(out)
    }

    fn pass(&self, column: &mut [f64]) {
        let Some(&first) = column.first() else { return };
        for Section { b, a } in &self.sections {
            // State in which a constant input gives the same constant output (unit gain at rest).
            let mut z = [(1.0 - b[0]) * first, (b[2] - a[1]) * first];
            for x in column.iter_mut() {
                let y = b[0] * *x + z[0];
                z = [b[1] * *x - a[0] * y + z[1], b[2] * *x - a[1] * y];
                *x = y;
            }
        }
    }
}

/// A pass over columns side by side.
struct SideBySide<'a, const W: usize> {
    sections: &'a [Section],
    rows: &'a mut [[f64; W]],
}

impl<const W: usize> Computation for SideBySide<'_, W> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Some(&first) = self.rows.first() else {
            return;
        };
        for Section { b, a } in self.sections {
            // As in `pass`. The next section starts on the first value as it was, which this one passes on.
            let mut z0 = first.map(|first| (1.0 - b[0]) * first);
            let mut z1 = first.map(|first| (b[2] - a[1]) * first);
            for row in self.rows.iter_mut() {
                for c in 0..W {
                    let x = row[c];
                    let y = b[0] * x + z0[c];
                    z0[c] = b[1] * x - a[0] * y + z1[c];
                    z1[c] = b[2] * x - a[1] * y;
                    row[c] = y;
                }
            }
        }
    }
}

/// `(√2 − 1)^(1/2n)`: where two passes lose 3 dB, in units of the (warped) cutoff.
fn two_pass_factor(order: usize) -> f64 {
    libm::pow(2.0_f64.sqrt() - 1.0, 0.5 / order as f64)
}
