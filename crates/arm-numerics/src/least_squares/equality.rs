//! Least squares under linear equalities, by the null-space method (Golub & Van Loan, *Matrix Computations*, 6.2.3).

use crate::linalg::matrix::{Matrix, add_scaled};
use crate::linalg::orthogonal::{Qr, solve_upper, solve_upper_transposed};
use crate::linalg::svd::Svd;

/// Constraint gradients (of unit length) that depend on each other to this degree count as dependent.
const DEPENDENT: f64 = 1e-11;

/// A dependent constraint may be missed by this much (relative to 1 and its value) and still be consistent.
const CONSISTENT: f64 = 1e-9;

/// `min ‖R x − z‖` subject to `Cᵀx = d`.
pub(crate) struct Equality<'a> {
    /// `m × p`.
    pub(crate) r: &'a Matrix,
    /// `m`.
    pub(crate) z: &'a [f64],
    /// `p × k`: one constraint gradient a column, of unit length.
    pub(crate) c: Matrix,
    /// `k`.
    pub(crate) d: &'a [f64],
}

/// What [`Equality::solve`] found.
pub(crate) struct Solved {
    /// The solution nearest to the starting point.
    pub(crate) x: Vec<f64>,
    /// λ of every constraint, where the gradient `Rᵀ(Rx−z) + C λ` vanishes; 0 for a dependent constraint.
    pub(crate) multipliers: Vec<f64>,
}

impl Equality<'_> {
    /// Solves from `start`: where the data leave a direction open, `x` moves as little as possible. `None` if the constraints contradict each other.
    pub(crate) fn solve(self, start: &[f64]) -> Option<Solved> {
        let p = start.len();
        let constraints = Qr::pivoted(self.c);
        let k = constraints.rank(DEPENDENT);
        let t = constraints.leading(k);

        // In y = Qᵀx the constraints fix the first k components.
        let mut y = start.to_vec();
        constraints.apply_transposed(&mut y);
        let mut fixed: Vec<f64> = constraints.pivots.iter().map(|&j| self.d[j]).collect();
        solve_upper_transposed(&t, k, &mut fixed[..k]);
        for (n, &j) in constraints.pivots.iter().enumerate().skip(k) {
            let reached: f64 = (0..k).fold(0.0, |sum, i| sum + constraints.r(i, n) * fixed[i]);
            if (reached - self.d[j]).abs() > CONSISTENT * (1.0 + self.d[j].abs()) {
                return None;
            }
        }

        // R Q, and what is left to explain after the constrained part has moved.
        let mut rq = self.r.transpose();
        for i in 0..rq.cols() {
            constraints.apply_transposed(rq.column_mut(i));
        }
        let rq = rq.transpose();
        let mut left = self.z.to_vec();
        add_scaled(&mut left, -1.0, &self.r.times(start));
        for i in 0..k {
            add_scaled(&mut left, -(fixed[i] - y[i]), rq.column(i));
            y[i] = fixed[i];
        }
        let free: Vec<usize> = (k..p).collect();
        let step = shortest_least_squares(rq.select_columns(&free), &left);
        for (i, s) in free.iter().zip(step) {
            y[*i] += s;
        }
        let mut x = y;
        constraints.apply(&mut x);

        let mut misfit = self.r.times(&x);
        add_scaled(&mut misfit, -1.0, self.z);
        let mut pull = self.r.transpose_times(&misfit);
        constraints.apply_transposed(&mut pull);
        solve_upper(&t, k, &mut pull[..k]);
        let mut multipliers = vec![0.0; constraints.pivots.len()];
        for i in 0..k {
            multipliers[constraints.pivots[i]] = -pull[i];
        }
        Some(Solved { x, multipliers })
    }
}

/// The shortest `x` that minimises `‖A x − b‖`.
pub(crate) fn shortest_least_squares(a: Matrix, b: &[f64]) -> Vec<f64> {
    let n = a.cols();
    let tolerance = f64::EPSILON * (4 * a.rows().max(n)) as f64;
    let qr = Qr::pivoted(a.clone());
    if a.rows() < n || qr.rank(tolerance) < n {
        let svd = Svd::of(a);
        let rank = svd.rank(tolerance);
        return svd.solve(b, rank);
    }
    let mut y = b.to_vec();
    qr.apply_transposed(&mut y);
    solve_upper(&qr.leading(n), n, &mut y[..n]);
    let mut x = vec![0.0; n];
    for (k, &j) in qr.pivots.iter().enumerate() {
        x[j] = y[k];
    }
    x
}
