//! Householder QR of a small dense matrix, with or without column pivoting, and triangular solves.

use crate::linalg::matrix::{Matrix, add_scaled, dot, norm};

/// Among columns this close to the longest the first is taken as pivot, so that a tie is broken by order and not by rounding.
const NEARLY_LONGEST: f64 = 1.0 - 1e-10;

/// Columns shorter than this count as zero: the inverse of their square would overflow.
const NOTHING: f64 = 1e-140;

/// `A P = Q R` of an `m × n` matrix.
#[derive(Debug, Clone)]
pub struct Qr {
    /// `R` on and above the diagonal, reflection vectors below it.
    packed: Matrix,
    /// First element of every reflection vector and 2/‖u‖².
    heads: Vec<(f64, f64)>,
    /// Column `k` of `A P` is column `pivots[k]` of `A`.
    pub pivots: Vec<usize>,
}

impl Qr {
    /// QR in the given order of columns.
    pub fn new(a: Matrix) -> Self {
        Self::build(a, false)
    }

    /// QR that takes the column with the longest remainder first.
    pub fn pivoted(a: Matrix) -> Self {
        Self::build(a, true)
    }

    fn build(mut a: Matrix, pivot: bool) -> Self {
        let (m, n) = (a.rows(), a.cols());
        let mut pivots: Vec<usize> = (0..n).collect();
        let mut heads = Vec::with_capacity(n.min(m));
        for k in 0..n.min(m) {
            if pivot {
                let lengths: Vec<f64> = (k..n).map(|j| norm(&a.column(j)[k..])).collect();
                let longest = lengths
                    .iter()
                    .fold(0.0, |l: f64, &v| if v > l { v } else { l });
                let best = k + lengths
                    .iter()
                    .position(|&v| v >= NEARLY_LONGEST * longest)
                    .unwrap_or(0);
                if best > k {
                    let (left, right) = a.two_columns_mut(k, best);
                    left.swap_with_slice(right);
                    pivots.swap(k, best);
                }
            }
            let alpha = a[(k, k)];
            let length = norm(&a.column(k)[k..]);
            if length < NOTHING {
                heads.push((0.0, 0.0));
                continue;
            }
            let beta = if alpha > 0.0 { -length } else { length };
            let head = alpha - beta;
            let factor = 1.0 / (beta * (beta - alpha));
            for j in k + 1..n {
                let (v, x) = a.two_columns_mut(k, j);
                let s = (head * x[k] + dot(&v[k + 1..], &x[k + 1..])) * factor;
                x[k] -= s * head;
                add_scaled(&mut x[k + 1..], -s, &v[k + 1..]);
            }
            a[(k, k)] = beta;
            heads.push((head, factor));
        }
        Self {
            packed: a,
            heads,
            pivots,
        }
    }

    /// Element of `R`.
    pub fn r(&self, i: usize, j: usize) -> f64 {
        if i > j { 0.0 } else { self.packed[(i, j)] }
    }

    /// The first `k` rows and columns of `R` as a matrix.
    pub fn leading(&self, k: usize) -> Matrix {
        Matrix::from_fn(k, k, |i, j| self.r(i, j))
    }

    /// Number of diagonal elements above `tolerance` times the first (for a pivoted factor: the numerical rank).
    pub fn rank(&self, tolerance: f64) -> usize {
        let limit = tolerance * self.heads.first().map_or(0.0, |_| self.r(0, 0).abs());
        (0..self.heads.len())
            .take_while(|&k| self.r(k, k).abs() > limit)
            .count()
    }

    /// `b ← Qᵀ b`.
    pub fn apply_transposed(&self, b: &mut [f64]) {
        for k in 0..self.heads.len() {
            self.reflect(k, b);
        }
    }

    /// `b ← Q b`.
    pub fn apply(&self, b: &mut [f64]) {
        for k in (0..self.heads.len()).rev() {
            self.reflect(k, b);
        }
    }

    fn reflect(&self, k: usize, b: &mut [f64]) {
        let (head, factor) = self.heads[k];
        let v = &self.packed.column(k)[k + 1..];
        let s = (head * b[k] + dot(v, &b[k + 1..])) * factor;
        b[k] -= s * head;
        add_scaled(&mut b[k + 1..], -s, v);
    }
}

/// `b ← R⁻¹ b` on the first `n` rows and columns of an upper triangular matrix.
pub fn solve_upper(r: &Matrix, n: usize, b: &mut [f64]) {
    for j in (0..n).rev() {
        b[j] /= r[(j, j)];
        let bj = b[j];
        add_scaled(&mut b[..j], -bj, &r.column(j)[..j]);
    }
}

/// `b ← R⁻ᵀ b` on the first `n` rows and columns of an upper triangular matrix.
pub fn solve_upper_transposed(r: &Matrix, n: usize, b: &mut [f64]) {
    for j in 0..n {
        b[j] = (b[j] - dot(&r.column(j)[..j], &b[..j])) / r[(j, j)];
    }
}
