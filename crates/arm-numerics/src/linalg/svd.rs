//! Singular value decomposition of a small matrix by one-sided Jacobi rotations.
//!
//! Short, accurate for small singular values, and the same bits everywhere (Demmel & Veselić 1992; Golub & Van Loan, *Matrix Computations*, 8.6.3).

use crate::linalg::matrix::{Matrix, dot, norm};

/// Sweeps after which rotation stops; six to ten are usual.
const SWEEPS: usize = 60;

/// `A = U diag(σ) Vᵀ` of an `m × n` matrix.
#[derive(Debug, Clone, PartialEq)]
pub struct Svd {
    /// `m × n`; a column that belongs to a singular value of zero is zero.
    pub u: Matrix,
    /// `n` singular values, largest first.
    pub sigma: Vec<f64>,
    /// `n × n`, orthogonal.
    pub v: Matrix,
}

impl Svd {
    /// Decomposes a finite matrix.
    pub fn of(mut a: Matrix) -> Self {
        let n = a.cols();
        // Powers of two only, so that scaling does not round.
        let unit = power_of_two_near(a.max_abs());
        a = a.scaled_columns(&vec![1.0 / unit; n]);
        let mut v = Matrix::identity(n);
        let negligible = f64::EPSILON * norm(a.as_slice());
        for _ in 0..SWEEPS {
            let mut rotated = false;
            for i in 0..n {
                for j in i + 1..n {
                    rotated |= orthogonalise(&mut a, &mut v, [i, j], negligible);
                }
            }
            if !rotated {
                break;
            }
        }
        let norms = a.column_norms();
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|&i, &j| norms[j].total_cmp(&norms[i]));
        let inverse: Vec<f64> = order
            .iter()
            .map(|&j| if norms[j] > 0.0 { 1.0 / norms[j] } else { 0.0 })
            .collect();
        Self {
            u: a.select_columns(&order).scaled_columns(&inverse),
            sigma: order.iter().map(|&j| norms[j] * unit).collect(),
            v: v.select_columns(&order),
        }
    }

    /// Number of singular values above `tolerance · σ₁`.
    pub fn rank(&self, tolerance: f64) -> usize {
        let limit = tolerance * self.sigma.first().copied().unwrap_or(0.0);
        self.sigma.iter().take_while(|&&s| s > limit).count()
    }

    /// Condition number `σ₁ / σ_n`; infinite if the last is zero, 1 for no columns.
    pub fn condition(&self) -> f64 {
        match (self.sigma.first(), self.sigma.last()) {
            (Some(&first), Some(&last)) if last > 0.0 => first / last,
            (Some(_), Some(_)) => f64::INFINITY,
            _ => 1.0,
        }
    }

    /// The shortest `x` that minimises `‖A x − b‖`, using the first `rank` singular values.
    pub fn solve(&self, b: &[f64], rank: usize) -> Vec<f64> {
        let c = self.u.transpose_times(b);
        let y: Vec<f64> = (0..self.sigma.len())
            .map(|k| if k < rank { c[k] / self.sigma[k] } else { 0.0 })
            .collect();
        self.v.times(&y)
    }
}

/// Rotates columns `i` and `j` until they are orthogonal; false if they were.
fn orthogonalise(a: &mut Matrix, v: &mut Matrix, [i, j]: [usize; 2], negligible: f64) -> bool {
    let (x, y) = a.two_columns_mut(i, j);
    let (xx, yy, xy) = (dot(x, x), dot(y, y), dot(x, y));
    let (nx, ny) = (xx.sqrt(), yy.sqrt());
    // A column at rounding level is zero: rotating it on would chase noise.
    let small = if nx < ny { nx } else { ny };
    if small <= negligible || xy.abs() <= f64::EPSILON * nx * ny {
        return false;
    }
    let zeta = (yy - xx) / (2.0 * xy);
    let root = (1.0 + zeta * zeta).sqrt();
    let t = if zeta >= 0.0 {
        1.0 / (zeta + root)
    } else {
        -1.0 / (root - zeta)
    };
    let cos = 1.0 / (1.0 + t * t).sqrt();
    let sin = cos * t;
    rotate(x, y, cos, sin);
    let (x, y) = v.two_columns_mut(i, j);
    rotate(x, y, cos, sin);
    true
}

fn rotate(x: &mut [f64], y: &mut [f64], cos: f64, sin: f64) {
    for (x, y) in x.iter_mut().zip(y) {
        let (a, b) = (*x, *y);
        *x = cos * a - sin * b;
        *y = sin * a + cos * b;
    }
}

/// A power of two within a factor of two of `value`; 1 for zero.
fn power_of_two_near(value: f64) -> f64 {
    if value == 0.0 {
        1.0
    } else {
        libm::ldexp(1.0, libm::frexp(value).1.clamp(-1000, 1000))
    }
}
