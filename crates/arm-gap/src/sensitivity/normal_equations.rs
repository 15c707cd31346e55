//! Normal equations of each trial, from which every candidate is tested.

use std::sync::Arc;

use arm_numerics::linalg::matrix::add_scaled;
use arm_numerics::{Cholesky, Matrix};

/// Whitened rows of one trial condensed: `gram = AᵀA`, `score = Aᵀr`, `square = rᵀr`.
#[derive(Clone, Debug)]
pub struct Cluster {
    /// The movement; repeats share it.
    pub configuration: usize,
    /// Products of columns.
    pub gram: Arc<Matrix>,
    /// Products of columns and residual.
    pub score: Vec<f64>,
    /// Square of the residual.
    pub square: f64,
    /// Number of rows.
    pub rows: usize,
}

/// The sum over trials, with the priors.
#[derive(Clone, Debug)]
pub struct Normal {
    /// `Σ AᵀA + Λ`.
    pub gram: Matrix,
    /// `Σ Aᵀr + Λ (prior − x)`.
    pub score: Vec<f64>,
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
            gram: Matrix::zeros(n, n),
            score: vec![0.0; n],
            square: 0.0,
            rows: 0,
        };
        for cluster in clusters {
            sum.gram.add_scaled(1.0, &cluster.gram);
            add_scaled(&mut sum.score, 1.0, &cluster.score);
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

/// Steps for the chosen columns that reduce the cost most, within bounds on each step; no step at all is within them.
///
/// The primal active set of bounded least squares (Stark and Parker 1995): every move reduces the cost, and a column is let
/// go of its bound when that reduces it further. Returns the steps and the reduction of the cost; `None` where the equations
/// are singular.
pub fn solve(
    gram: &Matrix,
    score: &[f64],
    columns: &[usize],
    bounds: &dyn Fn(usize) -> (f64, f64),
) -> Option<(Vec<f64>, f64)> {
    let n = columns.len();
    let limits: Vec<(f64, f64)> = (0..n).map(bounds).collect();
    let entry = |a: usize, b: usize| gram[(columns[a], columns[b])];
    let mut steps = vec![0.0; n];
    let mut held = vec![false; n];
    // What is left of the score of a column at the present steps.
    let left = |steps: &[f64], a: usize| {
        let product = (0..n).fold(0.0, |s, b| s + entry(a, b) * steps[b]);
        score[columns[a]] - product
    };
    for _ in 0..4 * n + 4 {
        let free: Vec<usize> = (0..n).filter(|&i| !held[i]).collect();
        let mut aim = Vec::new();
        if !free.is_empty() {
            let right: Vec<f64> = free.iter().map(|&i| left(&steps, i)).collect();
            let matrix = Matrix::from_fn(free.len(), free.len(), |a, b| entry(free[a], free[b]));
            aim = Cholesky::new(matrix)?.solve(&right);
        }
        // As far as the first bound in the way.
        let mut share = 1.0;
        let mut first = None;
        for (&i, &by) in free.iter().zip(&aim) {
            let (lower, upper) = limits[i];
            let room = if by < 0.0 { lower } else { upper } - steps[i];
            if by != 0.0 && room / by < share {
                (share, first) = ((room / by).max(0.0), Some(i));
            }
        }
        for (&i, &by) in free.iter().zip(&aim) {
            steps[i] = (steps[i] + share * by).clamp(limits[i].0, limits[i].1);
        }
        if let Some(i) = first {
            let (lower, upper) = limits[i];
            // Exactly there, whatever the rounding.
            steps[i] = if (steps[i] - lower).abs() < (upper - steps[i]).abs() {
                lower
            } else {
                upper
            };
            held[i] = true;
            continue;
        }
        let pull = |i: usize| {
            let (lower, upper) = limits[i];
            let inward = match (steps[i] <= lower, steps[i] >= upper) {
                (true, true) => 0.0,
                (true, false) => left(&steps, i),
                _ => -left(&steps, i),
            };
            inward / entry(i, i).max(f64::MIN_POSITIVE).sqrt()
        };
        let freed = (0..n)
            .filter(|&i| held[i])
            .map(|i| (pull(i), i))
            .max_by(|a, b| a.0.total_cmp(&b.0));
        match freed {
            Some((most, i)) if most > 1e-9 => held[i] = false,
            _ => break,
        }
    }
    let mut reduction = 0.0;
    for a in 0..n {
        let product = (0..n).fold(0.0, |s, b| s + entry(a, b) * steps[b]);
        reduction += steps[a] * (2.0 * score[columns[a]] - product);
    }
    Some((steps, reduction))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pseudo-random numbers between -1 and 1.
    fn numbers(seed: u64, count: usize) -> Vec<f64> {
        let mut state = seed;
        (0..count)
            .map(|_| {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1);
                (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
            })
            .collect()
    }

    #[test]
    fn bounded_steps_meet_the_conditions_of_an_optimum() {
        let mut bounded = 0;
        for seed in 1..300 {
            let n = 2 + seed as usize % 6;
            let a = Matrix::from_row_major(2 * n, n, &numbers(seed, 2 * n * n)).unwrap();
            let gram = a.transpose_product(&a);
            let score: Vec<f64> = numbers(seed + 1000, n).iter().map(|v| 3.0 * v).collect();
            let limits: Vec<(f64, f64)> = numbers(seed + 2000, n)
                .iter()
                .map(|v| (-0.3 * v.abs(), if *v > 0.0 { 0.2 } else { 0.0 }))
                .collect();
            let columns: Vec<usize> = (0..n).collect();
            let (steps, reduction) = solve(&gram, &score, &columns, &|i| limits[i]).unwrap();
            assert!(reduction >= 0.0);
            let taken = gram.times(&steps);
            let left: Vec<f64> = std::iter::zip(&score, taken).map(|(s, t)| s - t).collect();
            for i in 0..n {
                let (lower, upper) = limits[i];
                assert!(steps[i] >= lower && steps[i] <= upper);
                let up = steps[i] < upper;
                let down = steps[i] > lower;
                bounded += usize::from(!up || !down);
                // Moving where there is room must not help.
                let better = up && left[i] > 1e-7 || down && left[i] < -1e-7;
                assert!(!better, "{seed}");
            }
        }
        assert!(bounded > 300);
    }

    #[test]
    fn columns_that_can_hardly_be_told_apart_are_not_solved_for() {
        // The squared sine between both columns is just above and just below 1e-9.
        let gram = |sine: f64| {
            let cosine = (1.0 - sine * sine).sqrt();
            Matrix::from_row_major(2, 2, &[4.0, 6.0 * cosine, 6.0 * cosine, 9.0]).unwrap()
        };
        let bounds = |_: usize| (f64::NEG_INFINITY, f64::INFINITY);
        let none = solve(&gram(2.5e-5), &[0.0; 2], &[0, 1], &bounds);
        assert!(none.is_none());
        let some = solve(&gram(4e-5), &[0.0; 2], &[0, 1], &bounds);
        assert!(some.is_some());
    }

    #[test]
    fn clusters_and_what_is_known_beforehand_add_up() {
        let cluster = |value: f64| Cluster {
            configuration: 0,
            gram: Arc::new(Matrix::diagonal(&[value])),
            score: vec![2.0 * value],
            square: value,
            rows: 3,
        };
        // 0.5 from where it is expected, to 0.1: a weight of 100.
        let sum = Normal::new(&[cluster(1.0), cluster(2.0)], &[Some((0.5, 0.1))]);
        assert!(
            (sum.gram[(0, 0)] - 103.0).abs() < 1e-9 && (sum.score[0] - (6.0 - 50.0)).abs() < 1e-9
        );
        assert!((sum.square - (3.0 + 25.0)).abs() < 1e-9 && sum.rows == 6);
    }
}
