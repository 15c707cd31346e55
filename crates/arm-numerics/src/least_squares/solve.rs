//! Convex least squares: `min ‖R x − z‖²` under bounds, linear constraints and second-order cones. The only file that names clarabel.
//!
//! The way of a solution:
//! 1. Everything is rewritten in `x̃`, `x = S x̃`, and divided by the largest element of `|R S|`.
//! 2. Least squares under the equalities alone. If it satisfies the rest, it is the solution and no interior-point solver runs.
//! 3. clarabel: with `P = RᵀR` while `cond(R S) ≤ 1e6`, else as `min t, ‖R x̃ − z‖ ≤ t`, which does not square the condition number.
//! 4. Constraints with next to no slack are made equalities and the least-squares problem is solved again ([`Route::Polished`]). The result is
//!    taken only if it is feasible and every multiplier has the right sign: then it is the optimum to rounding, and a parameter on its bound *equals* it.
//!
//! One thread, no clock, a fixed order of operations: the same input gives the same bits.

use crate::error::NumericsError;
use crate::least_squares::equality::Equality;
use crate::least_squares::outcome::{Outcome, Reason, Route, Status};
use crate::least_squares::polish;
use crate::least_squares::program::Program;
use crate::least_squares::scaled::{Active, Origin, Scaled};
use crate::linalg::matrix::{Matrix, add_scaled, dot};
use crate::linalg::svd::Svd;
use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};

/// Condition number of `R S` above which the epigraph form is used.
pub const EPIGRAPH_ABOVE: f64 = 1e6;

/// Relative tolerances of the interior-point solver.
const INTERIOR_TOLERANCE: f64 = 1e-9;

/// A constraint of unit gradient with less slack than this (relative to 1 and its value) is first taken as binding.
const NEARLY_BINDING: f64 = 1e-6;

/// A violation below this (relative to 1 and the value) is rounding.
const ROUNDING: f64 = 1e-12;

impl Program {
    /// Solves the problem.
    ///
    /// # Errors
    /// Only if the scaled problem overflows ([`NumericsError::NotFinite`]); a poor solve is a [`Status`].
    pub fn solve(&self) -> Result<Outcome, NumericsError> {
        let scaled = Scaled::of(self)?;
        let svd = Svd::of(scaled.r.clone());
        let p = scaled.p();
        let rank = svd.rank(f64::EPSILON * (4 * p.max(scaled.z.len())) as f64);
        let (c, d) = scaled.equalities();
        let direct = Equality {
            r: &scaled.r,
            z: &scaled.z,
            c,
            d: &d,
        }
        .solve(&vec![0.0; p]);
        let mut found = match direct {
            None => Found::nothing(Status::Infeasible, 0),
            Some(s) if scaled.worst_violation(&s.x) <= ROUNDING => {
                let active = scaled.near(&s.x, ROUNDING);
                Found {
                    status: Status::Solved,
                    route: Route::Direct,
                    point: Some((s.x, active)),
                    iterations: 0,
                }
            }
            Some(_) => constrained(&scaled, svd.condition() > EPIGRAPH_ABOVE),
        };
        Ok(self.outcome(&scaled, &mut found, [rank as f64, svd.condition()]))
    }

    fn outcome(&self, scaled: &Scaled, found: &mut Found, [rank, condition]: [f64; 2]) -> Outcome {
        let p = scaled.p();
        let mut out = Outcome {
            status: found.status,
            route: found.route,
            x: vec![f64::NAN; p],
            active: vec![0; p],
            binding_inequalities: vec![false; self.inequalities.len()],
            binding_cones: vec![false; self.cones.len()],
            objective: f64::NAN,
            gradient: vec![f64::NAN; p],
            rank: rank as usize,
            condition,
            iterations: found.iterations,
        };
        let Some((point, active)) = &found.point else {
            return out;
        };
        for i in 0..p {
            out.x[i] = (self.scale[i] * point[i]).clamp(self.lower[i], self.upper[i]);
        }
        for (row, _) in scaled
            .at_most
            .iter()
            .zip(&active.rows)
            .filter(|(_, active)| **active)
        {
            match row.origin {
                Origin::Lower(i) => (out.x[i], out.active[i]) = (self.lower[i], -1),
                Origin::Upper(i) => (out.x[i], out.active[i]) = (self.upper[i], 1),
                Origin::Inequality(i) => out.binding_inequalities[i] = true,
                Origin::Equality => {}
            }
        }
        out.binding_cones.clone_from(&active.cones);
        let mut misfit = self.r.times(&out.x);
        add_scaled(&mut misfit, -1.0, &self.z);
        out.objective = dot(&misfit, &misfit);
        out.gradient = self.r.transpose_times(&misfit);
        for i in (0..p).filter(|&i| self.lower[i] == self.upper[i]) {
            out.active[i] = if out.gradient[i] < 0.0 { 1 } else { -1 };
        }
        out
    }
}

/// A point in scaled units with what binds there, or none.
struct Found {
    status: Status,
    route: Route,
    point: Option<(Vec<f64>, Active)>,
    iterations: u32,
}

impl Found {
    fn nothing(status: Status, iterations: u32) -> Self {
        Self {
            status,
            route: Route::Interior,
            point: None,
            iterations,
        }
    }
}

/// Interior point, in the other form too if the first fails, then the clean-up of the active set.
fn constrained(scaled: &Scaled, epigraph: bool) -> Found {
    let (mut status, mut x, mut iterations) = interior(scaled, epigraph);
    if matches!(status, Status::Failed(_)) {
        let (other, point, more) = interior(scaled, !epigraph);
        iterations += more;
        if !matches!(other, Status::Failed(_)) {
            (status, x) = (other, point);
        }
    }
    if !matches!(status, Status::Solved | Status::AlmostSolved) {
        return Found::nothing(status, iterations);
    }
    let near = scaled.near(&x, NEARLY_BINDING);
    match polish::polish(scaled, &x, &near) {
        Some(point) => Found {
            status: Status::Solved,
            route: Route::Polished,
            point: Some(point),
            iterations,
        },
        None => Found {
            status,
            route: Route::Interior,
            point: Some((x, near)),
            iterations,
        },
    }
}

/// One run of clarabel: status, x̃, iterations.
fn interior(scaled: &Scaled, epigraph: bool) -> (Status, Vec<f64>, u32) {
    let p = scaled.p();
    let n = p + usize::from(epigraph);
    let mut rows: Vec<(Vec<f64>, f64)> = Vec::new();
    let mut cones = Vec::new();
    if !scaled.equal.is_empty() {
        cones.push(SupportedConeT::ZeroConeT(scaled.equal.len()));
        rows.extend(scaled.equal.iter().map(|row| (row.a.clone(), row.b)));
    }
    if !scaled.at_most.is_empty() {
        cones.push(SupportedConeT::NonnegativeConeT(scaled.at_most.len()));
        rows.extend(scaled.at_most.iter().map(|row| (row.a.clone(), row.b)));
    }
    let negative = |values: &mut dyn Iterator<Item = f64>| values.map(|v| -v).collect::<Vec<f64>>();
    for cone in &scaled.cones {
        cones.push(SupportedConeT::SecondOrderConeT(cone.b.len() + 1));
        rows.push((negative(&mut cone.c.iter().copied()), cone.d));
        rows.extend(
            (0..cone.b.len()).map(|i| (negative(&mut (0..p).map(|j| cone.a[(i, j)])), cone.b[i])),
        );
    }
    rows.iter_mut().for_each(|row| row.0.resize(n, 0.0));
    let mut q = vec![0.0; n];
    let mut gram = Matrix::zeros(n, n);
    if epigraph {
        // ‖R x̃ − z‖ ≤ t
        q[p] = 1.0;
        cones.push(SupportedConeT::SecondOrderConeT(scaled.z.len() + 1));
        rows.push((negative(&mut q.iter().copied()), 0.0));
        for (i, z) in scaled.z.iter().enumerate() {
            let mut row = negative(&mut (0..p).map(|j| scaled.r[(i, j)]));
            row.push(0.0);
            rows.push((row, -z));
        }
    } else {
        q = negative(&mut scaled.r.transpose_times(&scaled.z).into_iter());
        gram = Matrix::from_fn(p, p, |i, j| {
            if i <= j {
                dot(scaled.r.column(i), scaled.r.column(j))
            } else {
                0.0
            }
        });
    }
    let b: Vec<f64> = rows.iter().map(|row| row.1).collect();
    let a = sparse(rows.len(), n, |i, j| rows[i].0[j]);
    let settings = DefaultSettings {
        verbose: false,
        max_threads: 1,
        direct_solve_method: "qdldl".to_owned(),
        tol_gap_abs: INTERIOR_TOLERANCE,
        tol_gap_rel: INTERIOR_TOLERANCE,
        tol_feas: INTERIOR_TOLERANCE,
        ..DefaultSettings::default()
    };
    let Ok(mut solver) = DefaultSolver::new(
        &sparse(n, n, |i, j| gram[(i, j)]),
        &q,
        &a,
        &b,
        &cones,
        settings,
    ) else {
        return (Status::Failed(Reason::Other), Vec::new(), 0);
    };
    solver.solve();
    let status = status_of(solver.solution.status);
    let mut x = solver.solution.x.clone();
    x.truncate(p);
    (status, x, solver.solution.iterations)
}

fn status_of(ended: SolverStatus) -> Status {
    match ended {
        SolverStatus::Solved => Status::Solved,
        SolverStatus::AlmostSolved => Status::AlmostSolved,
        SolverStatus::PrimalInfeasible | SolverStatus::AlmostPrimalInfeasible => Status::Infeasible,
        SolverStatus::DualInfeasible | SolverStatus::AlmostDualInfeasible => {
            Status::Failed(Reason::Unbounded)
        }
        SolverStatus::MaxIterations => Status::Failed(Reason::Iterations),
        SolverStatus::NumericalError => Status::Failed(Reason::Numerical),
        SolverStatus::InsufficientProgress => Status::Failed(Reason::Progress),
        _ => Status::Failed(Reason::Other),
    }
}

fn sparse(rows: usize, cols: usize, value: impl Fn(usize, usize) -> f64) -> CscMatrix<f64> {
    let (mut starts, mut places, mut values) = (vec![0], Vec::new(), Vec::new());
    for j in 0..cols {
        for i in 0..rows {
            let v = value(i, j);
            if v != 0.0 {
                places.push(i);
                values.push(v);
            }
        }
        starts.push(values.len());
    }
    CscMatrix::new(rows, cols, starts, places, values)
}
