//! Polish of a nearly optimal interior point: the binding constraints become equalities.
//!
//! Linear constraints give an equality-constrained least-squares problem. A binding cone is followed by Newton's method on the optimality conditions:
//! the curvature of `λ(‖Ax+b‖ − cᵀx − d)` is a sum of squares, so each step is again such a least-squares problem and `R` is never squared.

use crate::least_squares::equality::{Equality, Solved};
use crate::least_squares::scaled::{Active, Scaled, sides};
use crate::linalg::matrix::{Matrix, add_scaled, dot, max_abs, norm};

/// Newton steps on binding cones.
const NEWTON_STEPS: usize = 25;

/// Newton's method ends when a step changes the prediction `R x̃` by less than this part of `z`, or by its rounding …
const CONVERGED: f64 = 1e-12;

/// … and x̃ by less than this part of 1 and x̃: what a cone curves away over such a step is its square.
const SHORT: f64 = 1e-6;

/// Violation (relative to 1 and the value) that is accepted as rounding.
const FEASIBLE: f64 = 1e-10;

/// A multiplier may be this negative, relative to the size of the gradient's terms, and count as zero.
const ZERO_MULTIPLIER: f64 = 1e-10;

/// Refines `start`. `None` if no set of binding constraints near it gives a feasible point with multipliers of the right sign.
pub(crate) fn polish(scaled: &Scaled, start: &[f64], guess: &Active) -> Option<(Vec<f64>, Active)> {
    let mut active = guess.clone();
    let largest = norm(scaled.r.as_slice());
    let rounding = 16.0 * f64::EPSILON * largest * largest * norm(start);
    let least = -ZERO_MULTIPLIER * largest * norm(&scaled.z) - rounding;
    // Every round drops or adds one constraint; a cycle ends with the count.
    for _ in 0..4 * (active.rows.len() + active.cones.len()) + 4 {
        let solved = newton(scaled, start, &active)?;
        if let Some(worst) = most_negative(&solved.multipliers[scaled.equal.len()..], least) {
            release(&mut active, worst);
            continue;
        }
        let rows = scaled.row_slack(&solved.x);
        let cones = scaled.cone_slack(&solved.x);
        let violation = |slack: f64, is_active: bool| if is_active { 0.0 } else { slack };
        let slacks: Vec<f64> = rows
            .iter()
            .zip(&active.rows)
            .chain(cones.iter().zip(&active.cones))
            .map(|(s, a)| violation(*s, *a))
            .collect();
        match most_negative(&slacks, -FEASIBLE) {
            Some(worst) if worst < rows.len() => active.rows[worst] = true,
            Some(worst) => active.cones[worst - rows.len()] = true,
            None if scaled.worst_violation(&solved.x) <= FEASIBLE => {
                return Some((solved.x, active));
            }
            None => return None,
        }
    }
    None
}

/// Solves with the active constraints as equalities.
fn newton(scaled: &Scaled, start: &[f64], active: &Active) -> Option<Solved> {
    let binding: Vec<usize> = (0..active.cones.len())
        .filter(|&i| active.cones[i])
        .collect();
    let mut x = start.to_vec();
    if binding.is_empty() {
        return step(scaled, &x, active, &[]);
    }
    let first = scaled.equal.len() + active.rows.iter().filter(|a| **a).count();
    let mut lambda = estimate(scaled, &x, active)?[first..].to_vec();
    for _ in 0..NEWTON_STEPS {
        let curved: Vec<(usize, f64)> = binding
            .iter()
            .copied()
            .zip(lambda.iter().copied())
            .collect();
        let mut solved = step(scaled, &x, active, &curved)?;
        lambda = solved.multipliers[first..].to_vec();
        let mut moved = solved.x.clone();
        add_scaled(&mut moved, -1.0, &x);
        x.clone_from(&solved.x);
        let rounding = 4.0 * f64::EPSILON * norm(scaled.r.as_slice()) * norm(&x);
        let seen = norm(&scaled.r.times(&moved)) <= CONVERGED * norm(&scaled.z) + rounding;
        if seen && max_abs(&moved) <= SHORT * (1.0 + max_abs(&x)) {
            solved.multipliers = in_order(scaled, active, &solved.multipliers);
            return Some(solved);
        }
    }
    None
}

/// One least-squares problem with the constraints linearised at `x`, and the curvature of the cones weighted by their multipliers.
fn step(scaled: &Scaled, x: &[f64], active: &Active, curved: &[(usize, f64)]) -> Option<Solved> {
    let (c, d) = linearised(scaled, x, active)?;
    let mut solved = if curved.is_empty() {
        Equality {
            r: &scaled.r,
            z: &scaled.z,
            c,
            d: &d,
        }
        .solve(x)?
    } else {
        let (r, z) = with_curvature(scaled, x, curved)?;
        Equality {
            r: &r,
            z: &z,
            c,
            d: &d,
        }
        .solve(x)?
    };
    if curved.is_empty() {
        solved.multipliers = in_order(scaled, active, &solved.multipliers);
    }
    Some(solved)
}

/// Multipliers that come nearest to balance at `x`: least squares of `C λ = −gradient`.
fn estimate(scaled: &Scaled, x: &[f64], active: &Active) -> Option<Vec<f64>> {
    let (c, _) = linearised(scaled, x, active)?;
    let mut misfit = scaled.r.times(x);
    add_scaled(&mut misfit, -1.0, &scaled.z);
    let pull: Vec<f64> = scaled
        .r
        .transpose_times(&misfit)
        .into_iter()
        .map(|g| -g)
        .collect();
    Some(crate::least_squares::equality::shortest_least_squares(
        c, &pull,
    ))
}

/// Gradients (one a column) and values of equalities, active rows and active cones at `x`. `None` at the tip of a cone, which has no gradient.
fn linearised(scaled: &Scaled, x: &[f64], active: &Active) -> Option<(Matrix, Vec<f64>)> {
    let mut columns: Vec<Vec<f64>> = Vec::new();
    let mut d = Vec::new();
    let rows = scaled
        .at_most
        .iter()
        .zip(&active.rows)
        .filter(|(_, a)| **a)
        .map(|(row, _)| row);
    for row in scaled.equal.iter().chain(rows) {
        columns.push(row.a.clone());
        d.push(row.b);
    }
    for (cone, _) in scaled.cones.iter().zip(&active.cones).filter(|(_, a)| **a) {
        let (u, right) = sides(cone, x);
        let length = norm(&u);
        if length <= 1e-9 * (1.0 + right.abs()) {
            return None;
        }
        let direction: Vec<f64> = u.iter().map(|v| v / length).collect();
        let mut gradient = cone.a.transpose_times(&direction);
        add_scaled(&mut gradient, -1.0, &cone.c);
        d.push(dot(&gradient, x) - (length - right));
        columns.push(gradient);
    }
    Some((
        Matrix::from_fn(x.len(), columns.len(), |i, j| columns[j][i]),
        d,
    ))
}

/// `R` and `z` with rows `√(λ/‖u‖)(I − ûûᵀ)A` below, whose squares are the curvature of `λ‖Ax+b‖`, pulling towards `x`.
fn with_curvature(
    scaled: &Scaled,
    x: &[f64],
    curved: &[(usize, f64)],
) -> Option<(Matrix, Vec<f64>)> {
    let mut below: Vec<Matrix> = Vec::new();
    let mut z = scaled.z.clone();
    for &(i, lambda) in curved {
        let cone = &scaled.cones[i];
        let (u, _) = sides(cone, x);
        let length = norm(&u);
        let weight = if lambda > 0.0 {
            (lambda / length).sqrt()
        } else {
            0.0
        };
        let across = cone.a.transpose_times(&u);
        let rows = Matrix::from_fn(u.len(), x.len(), |k, j| {
            weight * (cone.a[(k, j)] - u[k] * across[j] / (length * length))
        });
        z.extend(rows.times(x));
        below.push(rows);
    }
    let mut offset = scaled.r.rows();
    let mut r = Matrix::zeros(z.len(), x.len());
    for j in 0..x.len() {
        r.column_mut(j)[..offset].copy_from_slice(scaled.r.column(j));
    }
    for rows in below {
        for j in 0..x.len() {
            r.column_mut(j)[offset..offset + rows.rows()].copy_from_slice(rows.column(j));
        }
        offset += rows.rows();
    }
    Some((r, z))
}

/// Multipliers of all constraints in the order equalities, inequalities, cones, zero for those that are not active.
fn in_order(scaled: &Scaled, active: &Active, multipliers: &[f64]) -> Vec<f64> {
    let mut given = multipliers.iter();
    let always = scaled.equal.iter().map(|_| true);
    always
        .chain(active.rows.iter().copied())
        .chain(active.cones.iter().copied())
        .map(|a| {
            if a {
                given.next().copied().unwrap_or(0.0)
            } else {
                0.0
            }
        })
        .collect()
}

/// Position of the smallest value if it is below `limit`.
fn most_negative(values: &[f64], limit: f64) -> Option<usize> {
    let mut worst = None;
    for (i, &v) in values.iter().enumerate() {
        if v < worst.map_or(limit, |w: usize| values[w]) {
            worst = Some(i);
        }
    }
    worst
}

fn release(active: &mut Active, index: usize) {
    match active.rows.get_mut(index) {
        Some(row) => *row = false,
        None => active.cones[index - active.rows.len()] = false,
    }
}
