//! Stable equilibrium that an arm reaches from given angles if all its joints are strongly and equally damped.
//!
//! The damped motion `σ q̇ = −r(q)`, with r the torques that are left, is followed by linearly implicit Euler steps,
//! `(∂r/∂q + σ) Δq = −r`: pseudo-transient continuation (Kelley, Keyes 1998). σ is the smallest of a series with which the matrix
//! is safely positive definite and the step short; near a stable equilibrium it is zero, and the steps are Newton's.

use crate::SimulationError;
use crate::error::NoRest;

/// Longest step of any angle \[rad\].
const LONGEST: f64 = 0.05;
/// The same of Newton's method, where the stiffness is positive definite.
const LONGEST_OF_NEWTON: f64 = 0.3;
/// Steps after which a search is given up.
const ITERATIONS: usize = 500;
/// Change of an angle after which an arm counts as falling \[rad\].
const AWAY: f64 = 4.0 * core::f64::consts::PI;
/// Increment of differences \[rad or N\].
const SMALL: f64 = 1e-6;
/// Stiffness that is rounding, in units of the largest.
const ROUNDING: f64 = 1e-7;

/// What is sought: `residual(x) = 0`.
pub(crate) struct Balance<'a> {
    /// Torques left at angles and the forces of a constraint, and behind them what the constraint leaves.
    pub residual: &'a dyn Fn(&[f64]) -> Vec<f64>,
    /// By joint, whether it is held where it is.
    pub held: &'a [bool],
    /// Size of a residual.
    pub size: &'a dyn Fn(&[f64]) -> f64,
    /// Size that is balanced.
    pub enough: f64,
}

impl Balance<'_> {
    /// The angles at which the arm comes to rest from those it starts from, and the forces of a constraint there.
    ///
    /// # Errors
    /// [`SimulationError::NoEquilibrium`] with the reason.
    pub fn settle(&self, mut x: Vec<f64>) -> Result<Vec<f64>, SimulationError> {
        let from = x.clone();
        let mut r = (self.residual)(&x);
        for iterations in 0..ITERATIONS {
            let slopes = Slopes::at(self, &x);
            if (self.size)(&r) < self.enough {
                return if slopes.definite(ROUNDING * slopes.scale) {
                    Ok(x)
                } else {
                    Err(NoRest::Unstable.into())
                };
            }
            let unbalanced = NoRest::Unbalanced {
                residual: (self.size)(&r),
                iterations,
            };
            (x, r) = self.step(&slopes, &x, &r).ok_or(unbalanced)?;
            let away = (0..self.held.len()).find(|&j| (x[j] - from[j]).abs() > AWAY);
            if let Some(joint) = away {
                return Err(NoRest::FallsAway { joint }.into());
            }
        }
        let residual = (self.size)(&r);
        let iterations = ITERATIONS;
        Err(NoRest::Unbalanced {
            residual,
            iterations,
        }
        .into())
    }

    /// The angles after a step, and what is left there; nothing where no step helps.
    fn step(&self, slopes: &Slopes, x: &[f64], r: &[f64]) -> Option<(Vec<f64>, Vec<f64>)> {
        let joints = self.held.len();
        let along = |step: &[f64], share: f64| {
            let tried: Vec<f64> = x.iter().zip(step).map(|(x, s)| x - share * s).collect();
            let left = (self.residual)(&tried);
            (tried, left)
        };
        let length = |step: &[f64]| step[..joints].iter().fold(0.0, |m: f64, s| m.max(s.abs()));
        let most =
            slopes.scale + r[..joints].iter().fold(0.0, |m: f64, r| m.max(r.abs())) / LONGEST;
        if slopes.definite(0.0)
            && let Some(step) = slopes.solve(0.0, r)
            && length(&step) <= LONGEST_OF_NEWTON
        {
            let mut share = 1.0;
            while share > 1e-6 {
                let (tried, left) = along(&step, share);
                if (self.size)(&left) < (self.size)(r) {
                    return Some((tried, left));
                }
                share *= 0.5;
            }
        }
        let mut damping = ROUNDING * most;
        let mut step = None;
        while damping < 1e3 * most {
            damping *= 2.0;
            if slopes.definite(0.5 * damping) {
                step = slopes.solve(damping, r);
                if step.as_deref().is_some_and(|step| length(step) <= LONGEST) {
                    break;
                }
            }
        }
        // The correction of a constraint is not shortened by damping.
        let step = step?;
        Some(along(&step, (LONGEST / length(&step)).min(1.0)))
    }
}

/// Derivatives of a residual.
struct Slopes {
    /// By row of the residual.
    rows: Vec<Vec<f64>>,
    /// Joints that are not held.
    free: Vec<usize>,
    joints: usize,
    /// Largest stiffness \[N m/rad\]; 1 where there is none.
    scale: f64,
}

impl Slopes {
    /// By central differences.
    fn at(balance: &Balance, x: &[f64]) -> Self {
        let (n, joints) = (x.len(), balance.held.len());
        let mut rows = vec![vec![0.0; n]; n];
        for k in 0..n {
            let shifted = |by: f64| {
                let mut x = x.to_vec();
                x[k] += by;
                (balance.residual)(&x)
            };
            let (more, less) = (shifted(SMALL), shifted(-SMALL));
            for (i, row) in rows.iter_mut().enumerate() {
                row[k] = (more[i] - less[i]) / (2.0 * SMALL);
            }
        }
        let free: Vec<usize> = (0..joints).filter(|&j| !balance.held[j]).collect();
        let stiffness = |&i: &usize| free.iter().fold(0.0, |m: f64, &k| m.max(rows[i][k].abs()));
        let largest = free.iter().map(stiffness).fold(0.0, f64::max);
        let scale = if largest > 0.0 { largest } else { 1.0 };
        Self {
            rows,
            free,
            joints,
            scale,
        }
    }

    /// Whether the stiffness of the free joints and a damping is positive definite, within a constraint: Cholesky's
    /// factors are real. Across a constraint it is made so by a large multiple (Debreu 1952).
    fn definite(&self, damping: f64) -> bool {
        let n = self.free.len();
        // By rows, in one piece: this is called often, and reserving memory takes longer than the rest.
        let mut a = vec![0.0; n * n];
        for (i, &p) in self.free.iter().enumerate() {
            for (k, &q) in self.free.iter().enumerate() {
                a[n * i + k] = 0.5 * (self.rows[p][q] + self.rows[q][p]);
                for constraint in &self.rows[self.joints..] {
                    let square: f64 = constraint[..self.joints].iter().map(|g| g * g).sum();
                    a[n * i + k] += self.scale / ROUNDING * constraint[p] * constraint[q] / square;
                }
            }
            a[n * i + i] += damping;
        }
        for k in 0..n {
            // NaN is not positive.
            if a[n * k + k].partial_cmp(&0.0) != Some(core::cmp::Ordering::Greater) {
                return false;
            }
            for i in k + 1..n {
                let factor = a[n * i + k] / a[n * k + k];
                for j in k + 1..n {
                    a[n * i + j] -= factor * a[n * k + j];
                }
            }
        }
        true
    }

    /// Solution of `(∂r/∂x + damping of the joints) s = r` by Gaussian elimination; nothing where it is singular.
    fn solve(&self, damping: f64, r: &[f64]) -> Option<Vec<f64>> {
        let n = r.len();
        let width = n + 1;
        let mut rows: Vec<f64> = Vec::with_capacity(n * width);
        for (row, r) in self.rows.iter().zip(r) {
            rows.extend(row.iter().chain([r]));
        }
        for i in 0..self.joints {
            rows[width * i + i] += damping;
        }
        for k in 0..n {
            let size = |row: usize| f64::abs(rows[width * row + k]);
            let pivot = (k..n).max_by(|&a, &b| size(a).total_cmp(&size(b)))?;
            for c in 0..width {
                rows.swap(width * k + c, width * pivot + c);
            }
            let (above, below) = rows.split_at_mut(width * (k + 1));
            let head = &above[width * k..];
            for row in below.chunks_exact_mut(width) {
                let factor = row[k] / head[k];
                for (value, above) in row.iter_mut().zip(head).skip(k) {
                    *value -= factor * above;
                }
            }
        }
        let mut step = vec![0.0; n];
        for k in (0..n).rev() {
            let row = &rows[width * k..];
            let known: f64 = (k + 1..n).map(|c| row[c] * step[c]).sum();
            step[k] = (row[n] - known) / row[k];
        }
        step.iter().all(|s| s.is_finite()).then_some(step)
    }
}
