//! A small dense matrix, column-major, with a fixed order of operations.

use crate::error::{NumericsError, check_len};
use std::ops::{Index, IndexMut, Range};

/// A dense matrix of `rows × cols` numbers, stored column after column.
///
/// Elements are read and written as `a[(row, column)]`, which panics outside the matrix like a slice does.
#[derive(Debug, Clone, PartialEq)]
pub struct Matrix {
    rows: usize,
    cols: usize,
    data: Vec<f64>,
}

impl Matrix {
    /// A matrix of zeros.
    pub fn zeros(rows: usize, cols: usize) -> Self {
        Self {
            rows,
            cols,
            data: vec![0.0; rows * cols],
        }
    }

    /// The identity of size `n`.
    pub fn identity(n: usize) -> Self {
        Self::from_fn(n, n, |i, j| if i == j { 1.0 } else { 0.0 })
    }

    /// A diagonal matrix.
    pub fn diagonal(values: &[f64]) -> Self {
        let n = values.len();
        Self::from_fn(n, n, |i, j| if i == j { values[i] } else { 0.0 })
    }

    /// The matrix with elements `f(row, column)`.
    pub fn from_fn(rows: usize, cols: usize, mut f: impl FnMut(usize, usize) -> f64) -> Self {
        let mut data = Vec::with_capacity(rows * cols);
        for j in 0..cols {
            for i in 0..rows {
                data.push(f(i, j));
            }
        }
        Self { rows, cols, data }
    }

    /// A matrix from `rows * cols` numbers, row after row.
    ///
    /// # Errors
    /// [`NumericsError::Length`] if `values` has another length.
    pub fn from_row_major(rows: usize, cols: usize, values: &[f64]) -> Result<Self, NumericsError> {
        check_len("values", values.len(), rows * cols)?;
        Ok(Self::from_fn(rows, cols, |i, j| values[i * cols + j]))
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    pub fn cols(&self) -> usize {
        self.cols
    }

    /// All elements, column after column.
    pub fn as_slice(&self) -> &[f64] {
        &self.data
    }

    /// Column `j`.
    pub fn column(&self, j: usize) -> &[f64] {
        &self.data[j * self.rows..(j + 1) * self.rows]
    }

    /// Column `j`, to be changed.
    pub fn column_mut(&mut self, j: usize) -> &mut [f64] {
        &mut self.data[j * self.rows..(j + 1) * self.rows]
    }

    /// Two different columns `i < j`, to be changed together.
    pub fn two_columns_mut(&mut self, i: usize, j: usize) -> (&mut [f64], &mut [f64]) {
        let n = self.rows;
        let (left, right) = self.data.split_at_mut(j * n);
        (&mut left[i * n..(i + 1) * n], &mut right[..n])
    }

    /// The transpose.
    pub fn transpose(&self) -> Self {
        Self::from_fn(self.cols, self.rows, |i, j| self[(j, i)])
    }

    /// The chosen columns, in the chosen order.
    ///
    /// # Panics
    /// If an index is not below [`Matrix::cols`].
    pub fn select_columns(&self, columns: &[usize]) -> Self {
        Self::from_fn(self.rows, columns.len(), |i, j| self[(i, columns[j])])
    }

    /// The elements of the chosen rows and columns, in the chosen order.
    ///
    /// # Panics
    /// If an index is outside the matrix.
    pub fn select(&self, rows: &[usize], columns: &[usize]) -> Self {
        Self::from_fn(rows.len(), columns.len(), |i, j| {
            self[(rows[i], columns[j])]
        })
    }

    /// The elements of a range of rows and of columns.
    ///
    /// # Panics
    /// If a range ends outside the matrix.
    pub fn block(&self, rows: Range<usize>, columns: Range<usize>) -> Self {
        Self::from_fn(rows.len(), columns.len(), |i, j| {
            self[(rows.start + i, columns.start + j)]
        })
    }

    /// Writes a matrix over a block whose first element is `(row, column)`.
    ///
    /// # Panics
    /// If the block does not lie in the matrix.
    pub fn set_block(&mut self, (row, column): (usize, usize), block: &Matrix) {
        for j in 0..block.cols {
            self.column_mut(column + j)[row..row + block.rows].copy_from_slice(block.column(j));
        }
    }

    /// `A S`: column `j` times `scale[j]`.
    ///
    /// # Panics
    /// If `scale` has not [`Matrix::cols`] elements.
    pub fn scaled_columns(&self, scale: &[f64]) -> Self {
        assert_eq!(scale.len(), self.cols, "one scale a column");
        Self::from_fn(self.rows, self.cols, |i, j| self[(i, j)] * scale[j])
    }

    /// `S A`: row `i` times `scale[i]`.
    ///
    /// # Panics
    /// If `scale` has not [`Matrix::rows`] elements.
    pub fn scaled_rows(&self, scale: &[f64]) -> Self {
        assert_eq!(scale.len(), self.rows, "one scale a row");
        Self::from_fn(self.rows, self.cols, |i, j| self[(i, j)] * scale[i])
    }

    /// `A x`.
    ///
    /// # Panics
    /// If `x` has not [`Matrix::cols`] elements.
    pub fn times(&self, x: &[f64]) -> Vec<f64> {
        assert_eq!(x.len(), self.cols, "one factor a column");
        let mut y = vec![0.0; self.rows];
        for (j, &xj) in x.iter().enumerate() {
            for (yi, a) in y.iter_mut().zip(self.column(j)) {
                *yi += a * xj;
            }
        }
        y
    }

    /// `Aᵀ y`.
    ///
    /// # Panics
    /// If `y` has not [`Matrix::rows`] elements.
    pub fn transpose_times(&self, y: &[f64]) -> Vec<f64> {
        assert_eq!(y.len(), self.rows, "one factor a row");
        (0..self.cols).map(|j| dot(self.column(j), y)).collect()
    }

    /// `A B`.
    ///
    /// # Panics
    /// If the inner sizes differ.
    pub fn product(&self, other: &Matrix) -> Self {
        let mut out = Self::zeros(self.rows, other.cols);
        for j in 0..other.cols {
            let column = self.times(other.column(j));
            out.column_mut(j).copy_from_slice(&column);
        }
        out
    }

    /// `Aᵀ B`.
    ///
    /// # Panics
    /// If the numbers of rows differ.
    pub fn transpose_product(&self, other: &Matrix) -> Self {
        let mut out = Self::zeros(self.cols, other.cols);
        for j in 0..other.cols {
            let column = self.transpose_times(other.column(j));
            out.column_mut(j).copy_from_slice(&column);
        }
        out
    }

    /// `A ← A + f B`.
    ///
    /// # Panics
    /// If the sizes differ.
    pub fn add_scaled(&mut self, f: f64, other: &Matrix) {
        let sizes = (self.rows, self.cols);
        assert_eq!(sizes, (other.rows, other.cols), "equal sizes");
        add_scaled(&mut self.data, f, &other.data);
    }

    /// Largest absolute value of an element; 0 for an empty matrix.
    pub fn max_abs(&self) -> f64 {
        max_abs(&self.data)
    }

    /// Euclidean norm of every column.
    pub fn column_norms(&self) -> Vec<f64> {
        (0..self.cols).map(|j| norm(self.column(j))).collect()
    }
}

impl Index<(usize, usize)> for Matrix {
    type Output = f64;
    fn index(&self, (i, j): (usize, usize)) -> &f64 {
        &self.column(j)[i]
    }
}

impl IndexMut<(usize, usize)> for Matrix {
    fn index_mut(&mut self, (i, j): (usize, usize)) -> &mut f64 {
        &mut self.column_mut(j)[i]
    }
}

/// Sum of products, first to last.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |sum, (x, y)| sum + x * y)
}

/// Sum of products in four interleaved partial sums: a fixed order that vector units can follow.
pub fn interleaved_dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 4];
    let (heads, tails) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest: f64 = heads
        .remainder()
        .iter()
        .zip(tails.remainder())
        .fold(0.0, |s, (x, y)| s + x * y);
    for (x, y) in heads.zip(tails) {
        for lane in 0..4 {
            sums[lane] += x[lane] * y[lane];
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

/// `y += f x`.
pub fn add_scaled(y: &mut [f64], f: f64, x: &[f64]) {
    for (yi, xi) in y.iter_mut().zip(x) {
        *yi += f * xi;
    }
}

/// Euclidean norm, safe against overflow and underflow of the squares.
pub fn norm(a: &[f64]) -> f64 {
    let plain = dot(a, a);
    if plain > 1e-280 && plain < 1e280 {
        return plain.sqrt();
    }
    let largest = max_abs(a);
    if largest == 0.0 || !largest.is_finite() {
        return largest;
    }
    let sum = a.iter().fold(0.0, |sum, x| {
        let y = x / largest;
        sum + y * y
    });
    largest * sum.sqrt()
}

/// Largest absolute value; NaN is passed on.
pub fn max_abs(a: &[f64]) -> f64 {
    a.iter().fold(0.0, |m: f64, x| {
        if x.abs() > m || x.is_nan() {
            x.abs()
        } else {
            m
        }
    })
}
