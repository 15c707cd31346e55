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

/// Most unknowns: six joints, and the force of a rigid coupling.
pub(crate) const MOST: usize = 8;
/// Angles of the joints and the force of a constraint, or what is left of them; zero where there are fewer. In arrays, since reserving memory
/// would take longer than the rest.
pub(crate) type Values = [f64; MOST];

/// What is sought: `residual(x) = 0`.
pub(crate) struct Balance<'a, R> {
    /// Torques left at angles and the forces of a constraint, and behind them what the constraint leaves.
    pub residual: R,
    /// Number of unknowns.
    pub unknowns: usize,
    /// By joint, whether it is held where it is.
    pub held: &'a [bool],
    /// Size of a residual.
    pub size: &'a dyn Fn(&[f64]) -> f64,
    /// Size that is balanced.
    pub enough: f64,
}

impl<R: Fn(&Values) -> Values> Balance<'_, R> {
    /// The angles at which the arm comes to rest from those it starts from, and the forces of a constraint there.
    ///
    /// # Errors
    /// [`SimulationError::NoEquilibrium`] with the reason.
    pub fn settle(&self, mut x: Values) -> Result<Values, SimulationError> {
        let from = x;
        let mut r = (self.residual)(&x);
        for iterations in 0..ITERATIONS {
            let slopes = Slopes::at(self, &x);
            if self.size(&r) < self.enough {
                return if slopes.definite(ROUNDING * slopes.scale) {
                    Ok(x)
                } else {
                    Err(NoRest::Unstable.into())
                };
            }
            let unbalanced = NoRest::Unbalanced {
                residual: self.size(&r),
                iterations,
            };
            (x, r) = self.step(&slopes, &x, &r).ok_or(unbalanced)?;
            let away = (0..self.held.len()).find(|&j| (x[j] - from[j]).abs() > AWAY);
            if let Some(joint) = away {
                return Err(NoRest::FallsAway { joint }.into());
            }
        }
        let residual = self.size(&r);
        let iterations = ITERATIONS;
        Err(NoRest::Unbalanced {
            residual,
            iterations,
        }
        .into())
    }

    fn size(&self, r: &Values) -> f64 {
        (self.size)(&r[..self.unknowns])
    }

    /// The angles after a step, and what is left there; nothing where no step helps.
    fn step(&self, slopes: &Slopes, x: &Values, r: &Values) -> Option<(Values, Values)> {
        let joints = self.held.len();
        let along = |step: &Values, share: f64| {
            let tried = core::array::from_fn(|i| x[i] - share * step[i]);
            (tried, (self.residual)(&tried))
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
                if self.size(&left) < self.size(r) {
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
                if step.as_ref().is_some_and(|step| length(step) <= LONGEST) {
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
    rows: [Values; MOST],
    unknowns: usize,
    joints: usize,
    /// Stiffness of the joints that are not held, symmetric and across a constraint made large, in its first rows and columns.
    stiffness: [Values; MOST],
    /// How many joints are not held.
    free: usize,
    /// Largest stiffness \[N m/rad\]; 1 where there is none.
    scale: f64,
}

impl Slopes {
    /// By central differences.
    fn at<R: Fn(&Values) -> Values>(balance: &Balance<R>, x: &Values) -> Self {
        let unknowns = balance.unknowns;
        let mut rows = [[0.0; MOST]; MOST];
        for k in 0..unknowns {
            let shifted = |by: f64| {
                let mut x = *x;
                x[k] += by;
                (balance.residual)(&x)
            };
            let (more, less) = (shifted(SMALL), shifted(-SMALL));
            for (i, row) in rows[..unknowns].iter_mut().enumerate() {
                row[k] = (more[i] - less[i]) / (2.0 * SMALL);
            }
        }
        Self::of(rows, unknowns, balance.held)
    }

    fn of(rows: [Values; MOST], unknowns: usize, held: &[bool]) -> Self {
        let joints = held.len();
        let mut places = [0; MOST];
        let mut free = 0;
        for joint in (0..joints).filter(|&j| !held[j]) {
            places[free] = joint;
            free += 1;
        }
        let places = &places[..free];
        let mut scale: f64 = 0.0;
        for &p in places {
            for &q in places {
                scale = scale.max(rows[p][q].abs());
            }
        }
        if scale == 0.0 {
            scale = 1.0;
        }
        let mut stiffness = [[0.0; MOST]; MOST];
        for (row, &p) in stiffness.iter_mut().zip(places) {
            for (entry, &q) in row.iter_mut().zip(places) {
                *entry = 0.5 * (rows[p][q] + rows[q][p]);
                for constraint in &rows[joints..unknowns] {
                    let square: f64 = constraint[..joints].iter().map(|g| g * g).sum();
                    *entry += scale / ROUNDING * constraint[p] * constraint[q] / square;
                }
            }
        }
        Self {
            rows,
            unknowns,
            joints,
            stiffness,
            free,
            scale,
        }
    }

    /// Whether the stiffness of the free joints and a damping is positive definite, within a constraint: Cholesky's
    /// factors are real. Across a constraint it is made so by a large multiple (Debreu 1952).
    fn definite(&self, damping: f64) -> bool {
        let (mut a, n) = (self.stiffness, self.free);
        for (i, row) in a[..n].iter_mut().enumerate() {
            row[i] += damping;
        }
        for k in 0..n {
            let above = a[k];
            // NaN is not positive.
            if above[k].partial_cmp(&0.0) != Some(core::cmp::Ordering::Greater) {
                return false;
            }
            for row in &mut a[k + 1..n] {
                let factor = row[k] / above[k];
                for j in k + 1..n {
                    row[j] -= factor * above[j];
                }
            }
        }
        true
    }

    /// Solution of `(∂r/∂x + damping of the joints) s = r` by Gaussian elimination; nothing where it is singular.
    fn solve(&self, damping: f64, r: &Values) -> Option<Values> {
        let n = self.unknowns;
        let (mut rows, mut known) = (self.rows, *r);
        for (i, row) in rows[..self.joints].iter_mut().enumerate() {
            row[i] += damping;
        }
        for k in 0..n {
            let size = |row: usize| f64::abs(rows[row][k]);
            let pivot = (k..n).max_by(|&a, &b| size(a).total_cmp(&size(b)))?;
            rows.swap(k, pivot);
            known.swap(k, pivot);
            let head = rows[k];
            for i in k + 1..n {
                let factor = rows[i][k] / head[k];
                for c in k..n {
                    rows[i][c] -= factor * head[c];
                }
                known[i] -= factor * known[k];
            }
        }
        let mut step = [0.0; MOST];
        for k in (0..n).rev() {
            let sum: f64 = (k + 1..n).map(|c| rows[k][c] * step[c]).sum();
            step[k] = (known[k] - sum) / rows[k][k];
        }
        step[..n].iter().all(|s| s.is_finite()).then_some(step)
    }
}
