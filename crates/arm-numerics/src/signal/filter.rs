//! Butterworth low-pass filters, once or without phase.

use crate::error::{NumericsError, check_finite, check_least, check_len, check_range};
use arm_core::simd_dispatch::{Computation, dispatch};
use std::f64::consts::PI;

/// Highest order; no measurement needs a steeper edge.
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
/// a lower one. For −3.01 dB of the zero-phase filter, use [`Butterworth::for_both_ways`].
#[derive(Debug, Clone, PartialEq)]
pub struct Butterworth {
    sections: Vec<Section>,
    order: usize,
    /// `tan(π f_c / f_s)`
    warped: f64,
}

impl Butterworth {
    /// A filter of `order` 1…20 with −3.01 dB at `cutoff_hz` in a single pass.
    ///
    /// # Errors
    /// [`NumericsError::OutOfRange`] unless `0 < cutoff < rate/2`.
    pub fn low_pass(order: usize, cutoff_hz: f64, rate_hz: f64) -> Result<Self, NumericsError> {
        check_range("order", order as f64, [1.0, HIGHEST_ORDER as f64])?;
        check_range("rate_hz", rate_hz, [f64::MIN_POSITIVE, f64::MAX])?;
        check_range(
            "cutoff_hz / rate_hz",
            cutoff_hz / rate_hz,
            [1e-7, 0.499_999],
        )?;
        Ok(Self::of_warped(order, libm::tan(PI * cutoff_hz / rate_hz)))
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
    ) -> Result<Self, NumericsError> {
        let plain = Self::low_pass(order, half_power_hz, rate_hz)?;
        // Where two passes lose 3 dB, in units of the (warped) cutoff.
        let two_pass_factor = libm::pow(2.0_f64.sqrt() - 1.0, 0.5 / order as f64);
        Ok(Self::of_warped(order, plain.warped / two_pass_factor))
    }

    fn of_warped(order: usize, k: f64) -> Self {
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
        }
    }

    /// Samples that [`Butterworth::both_ways`] adds at each end; a column must be longer.
    pub fn padding(&self) -> usize {
        3 * (2 * self.sections.len() + 1 - self.order % 2)
    }

    /// Forward and backward, without phase. Equals `scipy.signal.sosfiltfilt` with its defaults: odd reflection of [`Butterworth::padding`] samples at both
    /// ends, steady-state initial conditions.
    ///
    /// # Errors
    /// [`NumericsError::TooFew`] for a column not longer than the padding, [`NumericsError::NotFinite`].
    pub fn both_ways(&self, column: &[f64]) -> Result<Vec<f64>, NumericsError> {
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
    /// As [`Butterworth::both_ways`]; [`NumericsError::Length`] for columns of different lengths.
    pub fn both_ways_all(&self, columns: &[Vec<f64>]) -> Result<Vec<Vec<f64>>, NumericsError> {
        let slices: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let mut out = Vec::with_capacity(columns.len());
        BothWays::new(self, columns.len())
            .push::<1>(&slices, true, |_, smooth| out.push(smooth.all().collect()))?;
        Ok(out)
    }

    /// Samples after which what was before no longer shows: the slowest of what rings on has fallen below 2⁻⁶⁰.
    pub fn reach(&self) -> usize {
        let slowest = |s: &Section| {
            if s.a[1] == 0.0 {
                s.a[0].abs()
            } else {
                s.a[1].abs().sqrt()
            }
        };
        let radius = self.sections.iter().map(slowest).fold(0.0, f64::max);
        libm::ceil(-60.0 * core::f64::consts::LN_2 / libm::log(radius)) as usize
    }

    /// The state in which constant inputs give the same constant outputs (unit gain at rest).
    fn at_rest(&self, first: Abreast) -> Vec<[Abreast; 2]> {
        let of = |Section { b, a }: &Section| {
            [
                first.map(|x| (1.0 - b[0]) * x),
                first.map(|x| (b[2] - a[1]) * x),
            ]
        };
        self.sections.iter().map(of).collect()
    }

    fn pass_abreast(&self, state: &mut [[Abreast; 2]], rows: &mut [Abreast]) {
        dispatch(SideBySide {
            sections: &self.sections,
            state,
            rows,
        });
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

/// Columns side by side: each step waits for the one before, so that two registers of four take no longer than one.
const WIDTH: usize = 8;

/// One sample of columns side by side.
type Abreast = [f64; WIDTH];

/// A pass over columns side by side that goes on where it stopped.
struct SideBySide<'a> {
    sections: &'a [Section],
    state: &'a mut [[Abreast; 2]],
    rows: &'a mut [Abreast],
}

impl Computation for SideBySide<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let pairs = self.sections.chunks(2).zip(self.state.chunks_mut(2));
        for (sections, state) in pairs {
            match sections.len() {
                2 => together::<2>(sections, state, self.rows),
                _ => together::<1>(sections, state, self.rows),
            }
        }
    }
}

/// A pass through sections at a time: one works on a sample while the next still works on the sample before.
#[inline(always)]
fn together<const N: usize>(
    sections: &[Section],
    state: &mut [[Abreast; 2]],
    rows: &mut [Abreast],
) {
    let mut now: [[Abreast; 2]; N] = core::array::from_fn(|s| state[s]);
    for row in rows {
        let mut sample = *row;
        for s in 0..N {
            sections[s].step(&mut now[s], &mut sample);
        }
        *row = sample;
    }
    state.copy_from_slice(&now);
}

impl Section {
    /// Filters one sample of columns side by side.
    #[inline(always)]
    fn step(&self, [z0, z1]: &mut [Abreast; 2], row: &mut Abreast) {
        let Self { b, a } = self;
        for c in 0..WIDTH {
            let x = row[c];
            let y = b[0] * x + z0[c];
            z0[c] = b[1] * x - a[0] * y + z1[c];
            z1[c] = b[2] * x - a[1] * y;
            row[c] = y;
        }
    }
}

/// [`Butterworth::both_ways`] of columns that come a stretch after another, in memory that does not grow with them.
///
/// What comes more than [`Butterworth::reach`] later no longer shows. Columns that come in one stretch have the same bits.
pub struct BothWays<'a> {
    filter: &'a Butterworth,
    groups: Vec<Group>,
    /// Room for the way back.
    back: Vec<Abreast>,
    /// Samples that came.
    taken: usize,
    /// Samples that were given.
    given: usize,
}

/// Columns side by side on their way.
#[derive(Default)]
struct Group {
    /// Filtered forward, waiting for what comes later; before the first sample is given with the padding in front.
    ahead: Vec<Abreast>,
    state: Vec<[Abreast; 2]>,
}

/// Some samples of one column, filtered both ways.
pub struct Smooth<'a> {
    /// From the last to the first.
    back: &'a [Abreast],
    lane: usize,
}

impl Smooth<'_> {
    /// One of them, counted from the first.
    pub fn at(&self, i: usize) -> f64 {
        self.back[self.back.len() - 1 - i][self.lane]
    }

    /// All of them, from the first to the last.
    fn all(&self) -> impl Iterator<Item = f64> {
        self.back.iter().rev().map(|row| row[self.lane])
    }
}

impl<'a> BothWays<'a> {
    /// For a number of columns.
    pub fn new(filter: &'a Butterworth, columns: usize) -> Self {
        let groups = columns.div_ceil(WIDTH);
        Self {
            filter,
            groups: (0..groups).map(|_| Group::default()).collect(),
            back: Vec::new(),
            taken: 0,
            given: 0,
        }
    }

    /// Samples that were given.
    pub fn given(&self) -> usize {
        self.given
    }

    /// Samples that will have been given after so many more.
    pub fn given_with(&self, count: usize, last: bool) -> usize {
        let taken = self.taken + count;
        if last {
            return taken;
        }
        self.given.max(taken.saturating_sub(self.filter.reach()))
    }

    /// Adds samples of every column, and gives those that are known by now.
    ///
    /// * `last` - whether these are the last ones
    /// * `columns` - as many as the filter is for, `N` side by side in each slice
    /// * `out` - called for every column, in this order
    ///
    /// # Errors
    /// [`NumericsError::TooFew`] for a first or last stretch not longer than the padding; [`NumericsError::NotFinite`].
    pub fn push<const N: usize>(
        &mut self,
        columns: &[&[f64]],
        last: bool,
        mut out: impl FnMut(usize, Smooth<'_>),
    ) -> Result<(), NumericsError> {
        let count = columns.first().map_or(0, |values| values.len() / N);
        let ready = self.given_with(count, last) - self.given;
        let (filter, edge) = (self.filter, self.filter.padding());
        let ends = (self.taken == 0, last);
        for values in columns {
            check_len("samples of columns", values.len(), count * N)?;
            if ends.0 || ends.1 {
                check_least("samples of column", count, edge + 1)?;
            }
            if let Some(at) = values.iter().position(|v| !v.is_finite()) {
                return Err(NumericsError::NotFinite {
                    name: "column",
                    index: self.taken + at / N,
                    found: values[at],
                });
            }
        }
        let front = if self.given == 0 { edge } else { 0 };
        let wait = if last { edge } else { filter.reach() };
        for (number, group) in self.groups.iter_mut().enumerate() {
            let channels = number * WIDTH..((number + 1) * WIDTH).min(columns.len() * N);
            group.add(filter, (count, ends), |rows| {
                for (lane, channel) in channels.clone().enumerate() {
                    let values = columns[channel / N][channel % N..].iter().step_by(N);
                    for (row, value) in rows.iter_mut().zip(values) {
                        row[lane] = *value;
                    }
                }
            });
            if ready == 0 {
                continue;
            }
            self.back.clear();
            self.back.extend(group.ahead.iter().rev());
            let mut state = filter.at_rest(self.back[0]);
            filter.pass_abreast(&mut state, &mut self.back);
            let back = &self.back[wait..wait + ready];
            for (lane, channel) in channels.enumerate() {
                out(channel, Smooth { back, lane });
            }
            if last {
                group.ahead = Vec::new();
            } else {
                group.ahead.drain(..front + ready);
            }
        }
        self.taken += count;
        self.given += ready;
        Ok(())
    }
}

impl Group {
    /// Filters more samples forward; before the first and after the last with the padding.
    fn add(
        &mut self,
        filter: &Butterworth,
        (count, (first, last)): (usize, (bool, bool)),
        fill: impl FnOnce(&mut [Abreast]),
    ) {
        let edge = filter.padding();
        let known = self.ahead.len();
        let start = known + if first { edge } else { 0 };
        let end = start + count;
        self.ahead
            .resize(end + if last { edge } else { 0 }, [0.0; WIDTH]);
        fill(&mut self.ahead[start..end]);
        let mut mirror = |at: usize, from: usize, to: usize| {
            self.ahead[to] =
                core::array::from_fn(|c| 2.0 * self.ahead[at][c] - self.ahead[from][c]);
        };
        for i in 1..=edge {
            if first {
                mirror(start, start + i, start - i);
            }
            if last {
                mirror(end - 1, end - 1 - i, end - 1 + i);
            }
        }
        if first {
            self.state = filter.at_rest(self.ahead[0]);
        }
        filter.pass_abreast(&mut self.state, &mut self.ahead[known..]);
    }
}
