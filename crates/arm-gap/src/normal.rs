//! Normal equations, trial by trial: what every question is answered from.

use std::sync::Arc;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Whitened rows of one trial condensed: `gram = AᵀA`, `score = Aᵀr`, `square = rᵀr`.
#[derive(Clone, Debug)]
pub struct Cluster {
    /// The movement; repeats share it.
    pub configuration: usize,
    /// Products of columns.
    pub gram: Arc<DMatrix<f64>>,
    /// Products of columns and residual.
    pub score: DVector<f64>,
    /// Square of the residual.
    pub square: f64,
    /// Number of rows.
    pub rows: usize,
}

/// The sum over trials, with what is known beforehand.
#[derive(Clone, Debug)]
pub struct Normal {
    /// `Σ AᵀA + Λ`.
    pub gram: DMatrix<f64>,
    /// `Σ Aᵀr + Λ (prior − x)`.
    pub score: DVector<f64>,
    /// `Σ rᵀr` and what the present values cost against their priors.
    pub square: f64,
    /// Number of rows of the data.
    pub rows: usize,
}

impl Normal {
    /// Sums clusters and adds priors.
    ///
    /// * `priors` - for each column its present distance from the prior value, and the prior's standard deviation
    pub fn new(clusters: &[Cluster], priors: &[Option<(f64, f64)>]) -> Self {
        let n = priors.len();
        let mut sum = Self {
            gram: DMatrix::zeros(n, n),
            score: DVector::zeros(n),
            square: 0.0,
            rows: 0,
        };
        for cluster in clusters {
            sum.gram += &*cluster.gram;
            sum.score += &cluster.score;
            sum.square += cluster.square;
            sum.rows += cluster.rows;
        }
        for (i, prior) in priors.iter().enumerate() {
            if let Some((distance, sd)) = prior {
                let weight = 1.0 / (sd * sd);
                sum.gram[(i, i)] += weight;
                sum.score[i] -= weight * distance;
                sum.square += weight * distance * distance;
            }
        }
        sum
    }
}

/// Steps for the chosen columns that reduce the cost most, within bounds on each step.
///
/// By an active set: columns whose step would leave its bounds are held there and the others solved again. Returns the
/// steps and the reduction of the cost; `None` where the equations are singular.
pub fn solve(
    gram: &DMatrix<f64>,
    score: &DVector<f64>,
    columns: &[usize],
    bounds: &dyn Fn(usize) -> (f64, f64),
) -> Option<(Vec<f64>, f64)> {
    let n = columns.len();
    let mut steps = vec![0.0; n];
    let mut held = vec![false; n];
    for _ in 0..=n {
        let free: Vec<usize> = (0..n).filter(|&i| !held[i]).collect();
        if !free.is_empty() {
            let right = DVector::from_fn(free.len(), |a, _| {
                let i = free[a];
                let taken = (0..n)
                    .filter(|&b| held[b])
                    .fold(0.0, |s, b| s + gram[(columns[i], columns[b])] * steps[b]);
                score[columns[i]] - taken
            });
            let left = DMatrix::from_fn(free.len(), free.len(), |a, b| {
                gram[(columns[free[a]], columns[free[b]])]
            });
            let solution = factor(left)?.solve(&right);
            for (a, &i) in free.iter().enumerate() {
                steps[i] = solution[a];
            }
        }
        let mut worst = None;
        for &i in &free {
            let (lower, upper) = bounds(i);
            let beyond = (lower - steps[i]).max(steps[i] - upper);
            if beyond > 0.0 && worst.is_none_or(|(_, most)| beyond > most) {
                worst = Some((i, beyond));
            }
        }
        let Some((i, _)) = worst else { break };
        let (lower, upper) = bounds(i);
        steps[i] = steps[i].clamp(lower, upper);
        held[i] = true;
    }
    let mut reduction = 0.0;
    for a in 0..n {
        let product = (0..n).fold(0.0, |s, b| s + gram[(columns[a], columns[b])] * steps[b]);
        reduction += steps[a] * (2.0 * score[columns[a]] - product);
    }
    Some((steps, reduction))
}

/// Cholesky factor after scaling to a unit diagonal, so that units do not matter.
pub struct Scaled {
    factor: Cholesky<f64, Dyn>,
    scale: Vec<f64>,
}

/// Factorises a symmetric matrix; `None` unless it is safely positive definite.
pub fn factor(mut matrix: DMatrix<f64>) -> Option<Scaled> {
    /// Columns closer to a combination of the others than this (squared sine) are not told apart.
    const LEAST: f64 = 1e-9;
    let n = matrix.nrows();
    let scale: Vec<f64> = (0..n)
        .map(|i| matrix[(i, i)])
        .map(|d| if d > 0.0 { 1.0 / d.sqrt() } else { 0.0 })
        .collect();
    if scale.iter().any(|s| !s.is_finite() || *s == 0.0) {
        return None;
    }
    for a in 0..n {
        for b in 0..n {
            matrix[(a, b)] *= scale[a] * scale[b];
        }
    }
    let factor = Cholesky::new(matrix)?;
    if (0..n).any(|i| {
        let pivot = factor.l_dirty()[(i, i)];
        pivot * pivot < LEAST
    }) {
        return None;
    }
    Some(Scaled { factor, scale })
}

impl Scaled {
    /// Solves for one right-hand side.
    pub fn solve(&self, right: &DVector<f64>) -> DVector<f64> {
        let mut x = DVector::from_fn(right.len(), |i, _| right[i] * self.scale[i]);
        self.factor.solve_mut(&mut x);
        DVector::from_fn(right.len(), |i, _| x[i] * self.scale[i])
    }

    /// The inverse.
    pub fn inverse(&self) -> DMatrix<f64> {
        let n = self.scale.len();
        let inverse = self.factor.inverse();
        DMatrix::from_fn(n, n, |a, b| inverse[(a, b)] * self.scale[a] * self.scale[b])
    }
}
