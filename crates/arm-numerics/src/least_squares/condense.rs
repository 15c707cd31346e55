//! Streamed square-root condensation: any number of rows to one small triangular factor.
//!
//! Rows `[yᵀ | b]` of a least-squares problem `min Σ (yᵀx − b)²` are collected in a panel of [`BLOCK`] rows. A full panel is folded into the triangle
//! `[R z; 0 ρ]` by Householder reflections that act on one row of the triangle and the whole panel (the "triangle on top of a rectangle" QR of
//! Golub & Van Loan, *Matrix Computations*, 5.2 and 6.5). The Gram matrix is never formed, so errors grow with `cond(Y)` and not with its square.
//!
//! The order of operations depends on the order of the rows only, never on how they are grouped into calls.

use crate::error::{NumericsError, check_len};
use crate::least_squares::factor::Factor;
use crate::linalg::matrix::Matrix;
use arm_core::simd_dispatch::{Computation, Simd, WithSimd, dispatch};
use core::array::{from_mut, from_ref};

/// Rows in a panel.
pub const BLOCK: usize = 128;

/// Partial sums that a dot product keeps apart, so that it can be vectorised without changing its value.
const LANES: usize = 8;

/// Larger absolute values are refused: their squares, summed over many rows, would overflow. Columns below its inverse count as zero.
pub const LARGEST: f64 = 1e140;

/// Sums of squares below this are taken as zero, as their inverse would overflow.
const NOTHING: f64 = 1e-280;

/// One column of a panel, aligned so that no vector crosses a cache line.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub struct Column(pub [f64; BLOCK]);

/// Folds rows of a least-squares problem into a triangular factor. Memory is fixed at [`Condenser::new`]; pushing never allocates.
///
/// ```
/// use arm_numerics::Condenser;
/// let mut condenser = Condenser::new(2);
/// for (t, b) in [(0.0, 1.0), (1.0, 3.0), (2.0, 5.0)] {
///     condenser.push(&[1.0, t], b)?;
/// }
/// let x = condenser.finish().solve()?;
/// assert!((x[0] - 1.0).abs() < 1e-14 && (x[1] - 2.0).abs() < 1e-14);
/// # Ok::<(), arm_numerics::NumericsError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Condenser {
    /// Number of parameters.
    p: usize,
    /// Rows that were pushed.
    rows: usize,
    /// The triangle `[R z; 0 ρ]`, row after row, `(p+1)²`.
    triangle: Vec<f64>,
    /// `p + 1` columns of rows that wait; the last column is the right-hand side.
    panel: Vec<Column>,
    /// How many rows wait.
    waiting: usize,
}

impl Condenser {
    /// An empty condenser for `p` parameters.
    pub fn new(p: usize) -> Self {
        Self {
            p,
            rows: 0,
            triangle: vec![0.0; (p + 1) * (p + 1)],
            panel: vec![Column([0.0; BLOCK]); p + 1],
            waiting: 0,
        }
    }

    /// Number of rows pushed so far.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Adds one row `yᵀx ≈ b`. Weighting is the caller's: multiply both by 1/sd.
    ///
    /// * `row` - y, `p` numbers
    /// * `rhs` - b
    ///
    /// # Errors
    /// [`NumericsError::Length`]; [`NumericsError::NotFinite`] for NaN, infinity or a magnitude above [`LARGEST`]. A refused row changes nothing.
    #[inline]
    pub fn push(&mut self, row: &[f64], rhs: f64) -> Result<(), NumericsError> {
        if row.len() != self.p || !(acceptable(row) & acceptable(&[rhs])) {
            return Err(self.refusal(row, rhs));
        }
        let at = self.waiting;
        for (column, &value) in self.panel.iter_mut().zip(row.iter().chain([&rhs])) {
            column.0[at] = value;
        }
        self.waiting += 1;
        self.rows += 1;
        if self.waiting == BLOCK {
            self.fold();
        }
        Ok(())
    }

    /// Adds many rows.
    ///
    /// * `rows` - `n × p` numbers, row after row
    /// * `rhs` - `n` numbers
    ///
    /// # Errors
    /// As [`Condenser::push`]; rows before a refused one have been added.
    pub fn push_block(&mut self, rows: &[f64], rhs: &[f64]) -> Result<(), NumericsError> {
        check_len("rows", rows.len(), rhs.len() * self.p)?;
        if self.p == 0 {
            return rhs.iter().try_for_each(|&b| self.push(&[], b));
        }
        let (mut rows, mut rhs) = (rows, rhs);
        while !rhs.is_empty() {
            let take = rhs.len().min(BLOCK - self.waiting);
            let (now, later) = rows.split_at(take * self.p);
            let (b, rest) = rhs.split_at(take);
            if !(acceptable(now) & acceptable(b)) {
                // Row by row up to the bad one, which is then named.
                let mut pairs = now.chunks_exact(self.p).zip(b);
                return pairs.try_for_each(|(row, &b)| self.push(row, b));
            }
            self.take_block(now, b);
            (rows, rhs) = (later, rest);
        }
        Ok(())
    }

    /// Adds up to [`BLOCK`] rows at once.
    ///
    /// * `rows` - their number
    /// * `write` - writes them into `p + 1` columns, the last of them b
    ///
    /// # Errors
    /// [`NumericsError::NotFinite`] as [`Condenser::push`]; then none of the rows is added.
    ///
    /// # Panics
    /// If an earlier call left a partly filled panel, or for more than [`BLOCK`] rows.
    #[inline]
    pub fn push_panel(
        &mut self,
        rows: usize,
        write: impl FnOnce(&mut [Column]),
    ) -> Result<(), NumericsError> {
        assert_eq!(self.waiting, 0, "rows wait");
        write(&mut self.panel);
        for column in &self.panel {
            let column = &column.0[..rows];
            if !dispatch(Accept(column)) {
                let bad = |v: &&f64| v.abs() >= LARGEST || v.is_nan();
                return Err(NumericsError::NotFinite {
                    name: "rows",
                    index: self.rows,
                    found: column.iter().find(bad).copied().unwrap_or(f64::NAN),
                });
            }
        }
        self.waiting = rows;
        self.rows += rows;
        if rows == BLOCK {
            self.fold();
        }
        Ok(())
    }

    /// Adds the problem of a factor, its residual included.
    ///
    /// # Errors
    /// [`NumericsError::Length`] if `factor` has another number of parameters; [`NumericsError::NotFinite`].
    pub fn merge_factor(&mut self, factor: &Factor) -> Result<(), NumericsError> {
        check_len("factor", factor.z.len(), self.p)?;
        factor.check()?;
        let rows = self.rows + factor.rows;
        let (p, rho) = (self.p, factor.rho2.sqrt());
        for i in 0..p {
            self.push_with(|j| if j < p { factor.r[(i, j)] } else { factor.z[i] });
        }
        self.push_with(|j| if j < p { 0.0 } else { rho });
        self.rows = rows;
        Ok(())
    }

    /// The factor of all rows pushed. Its diagonal is not negative.
    pub fn finish(mut self) -> Factor {
        self.fold();
        let (p, width) = (self.p, self.p + 1);
        let sign = |i: usize| {
            if self.triangle[i * width + i] < 0.0 {
                -1.0
            } else {
                1.0
            }
        };
        let r = Matrix::from_fn(p, p, |i, j| {
            if j < i {
                0.0
            } else {
                sign(i) * self.triangle[i * width + j]
            }
        });
        let z = (0..p)
            .map(|i| sign(i) * self.triangle[i * width + p])
            .collect();
        let rho = self.triangle[p * width + p];
        Factor {
            r,
            z,
            rho2: rho * rho,
            rows: self.rows,
        }
    }

    /// Copies acceptable rows, at most as many as there is room for.
    fn take_block(&mut self, rows: &[f64], rhs: &[f64]) {
        let places = self.waiting..self.waiting + rhs.len();
        for (j, column) in self.panel.iter_mut().enumerate() {
            let column = &mut column.0[places.clone()];
            if j == self.p {
                column.copy_from_slice(rhs);
            } else {
                let values = rows[j..].iter().step_by(self.p);
                for (place, value) in column.iter_mut().zip(values) {
                    *place = *value;
                }
            }
        }
        self.waiting = places.end;
        self.rows += rhs.len();
        if self.waiting == BLOCK {
            self.fold();
        }
    }

    fn push_with(&mut self, value: impl Fn(usize) -> f64) {
        for (j, column) in self.panel.iter_mut().enumerate() {
            column.0[self.waiting] = value(j);
        }
        self.waiting += 1;
        if self.waiting == BLOCK {
            self.fold();
        }
    }

    /// Folds the waiting rows into the triangle.
    fn fold(&mut self) {
        if self.waiting == 0 {
            return;
        }
        if self.waiting < BLOCK {
            for column in &mut self.panel {
                column.0[self.waiting..].fill(0.0);
            }
        }
        self.waiting = 0;
        dispatch(Reflect {
            panel: &mut self.panel,
            triangle: &mut self.triangle,
        });
    }

    #[cold]
    fn refusal(&self, row: &[f64], rhs: f64) -> NumericsError {
        if row.len() != self.p {
            return NumericsError::Length {
                name: "row",
                found: row.len(),
                expected: self.p,
            };
        }
        let bad = |v: &f64| v.abs() >= LARGEST || v.is_nan();
        match row.iter().find(|v| bad(v)) {
            Some(&found) => NumericsError::NotFinite {
                name: "row",
                index: self.rows,
                found,
            },
            None => NumericsError::NotFinite {
                name: "rhs",
                index: self.rows,
                found: rhs,
            },
        }
    }
}

/// Reflects a panel into a triangle, a column after another.
struct Reflect<'a> {
    panel: &'a mut [Column],
    triangle: &'a mut [f64],
}

impl WithSimd for Reflect<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { panel, triangle } = self;
        let width = panel.len();
        for k in 0..width {
            let (head, rest) = panel.split_at_mut(k + 1);
            let v = &head[k];
            let [below] = dots(simd, v, from_ref(v));
            if below < NOTHING {
                continue;
            }
            let row = &mut triangle[k * width + k..(k + 1) * width];
            let alpha = row[0];
            let length = (alpha * alpha + below).sqrt();
            let beta = if alpha > 0.0 { -length } else { length };
            row[0] = beta;
            // The reflection is I − u uᵀ / (β(β−α)) with u = [α−β; v]: no division of the panel, no cancellation.
            let first = alpha - beta;
            let reflection = Reflection {
                v,
                first,
                factor: 1.0 / (beta * (beta - alpha)),
            };
            let (pairs, single) = rest.as_chunks_mut::<2>();
            let (heads, head) = row[1..].as_chunks_mut::<2>();
            for (x, r) in pairs.iter_mut().zip(heads) {
                reflection.apply(simd, x, r);
            }
            if let ([x], [r]) = (single, head) {
                reflection.apply(simd, from_mut(x), from_mut(r));
            }
        }
    }
}

/// What a column is reflected with.
struct Reflection<'a> {
    v: &'a Column,
    /// In the row of the triangle.
    first: f64,
    factor: f64,
}

impl Reflection<'_> {
    /// Reflects some columns and their numbers in the triangle.
    #[inline(always)]
    fn apply<S: Simd, const C: usize>(&self, simd: S, x: &mut [Column; C], r: &mut [f64; C]) {
        let mut s = dots(simd, self.v, x);
        for (s, r) in s.iter_mut().zip(r) {
            *s = (self.first * *r + *s) * self.factor;
            *r -= *s * self.first;
        }
        subtract(simd, x, s, self.v);
    }
}

/// Whether a column is [`acceptable`].
struct Accept<'a>(&'a [f64]);

impl Computation for Accept<'_> {
    type Output = bool;

    #[inline(always)]
    fn call(self) -> bool {
        acceptable(self.0)
    }
}

/// Whether all numbers are finite and small enough to be added; false for NaN.
#[inline(always)]
pub fn acceptable(values: &[f64]) -> bool {
    values.iter().fold(true, |ok, v| ok & (v.abs() < LARGEST))
}

/// Dot products of a column with some others. Explicit vectors, because the compiler uses half-width ones for the partial sums. There are
/// always [`LANES`] partial sums, whatever the width, so the bits are the same.
#[inline(always)]
fn dots<S: Simd, const C: usize>(simd: S, a: &Column, others: &[Column; C]) -> [f64; C] {
    let vectors = LANES / S::F64_LANES;
    let mut sums = [[simd.splat_f64s(0.0); LANES]; C];
    let a = S::as_simd_f64s(&a.0).0;
    for start in (0..a.len()).step_by(vectors) {
        for (b, sums) in others.iter().zip(&mut sums) {
            let b = S::as_simd_f64s(&b.0).0;
            for i in 0..vectors {
                let product = simd.mul_f64s(a[start + i], b[start + i]);
                sums[i] = simd.add_f64s(sums[i], product);
            }
        }
    }
    let mut found = [0.0; C];
    for (found, sums) in found.iter_mut().zip(&sums) {
        let mut s = [0.0; LANES];
        S::as_mut_simd_f64s(&mut s)
            .0
            .copy_from_slice(&sums[..vectors]);
        *found = ((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7]));
    }
    found
}

/// `x −= s v` for some columns.
#[inline(always)]
fn subtract<S: Simd, const C: usize>(simd: S, x: &mut [Column; C], s: [f64; C], v: &Column) {
    let v = S::as_simd_f64s(&v.0).0;
    for i in 0..v.len() {
        for (x, s) in x.iter_mut().zip(s) {
            let x = &mut S::as_mut_simd_f64s(&mut x.0).0[i];
            *x = simd.sub_f64s(*x, simd.mul_f64s(simd.splat_f64s(s), v[i]));
        }
    }
}
