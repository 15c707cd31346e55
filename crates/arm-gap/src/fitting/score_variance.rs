//! Variance of scores between repeats, beyond that of the noise.

use std::sync::Arc;

use crate::sensitivity::normal_equations::Cluster;

/// Prior weight of the variance of the noise model, in trials.
const BELIEF: f64 = 6.0;

/// Score of an effect in one trial.
pub struct TrialScore {
    /// The movement; repeats share it.
    configuration: usize,
    /// Product of the residual with the effect.
    score: f64,
    /// Variance of that product by the noise model.
    expected: f64,
}

/// Scores of an effect in each trial.
///
/// * `weights` - columns and their weights in the effect, from all movements together
pub fn trial_scores(clusters: &[Cluster], weights: &[(usize, f64)]) -> Vec<TrialScore> {
    let mut all: Vec<TrialScore> = Vec::with_capacity(clusters.len());
    for (i, c) in clusters.iter().enumerate() {
        // Repeats with the same samples share their products.
        let same = (0..i).rfind(|&k| Arc::ptr_eq(&clusters[k].gram, &c.gram));
        all.push(TrialScore {
            configuration: c.configuration,
            score: weights.iter().fold(0.0, |s, (i, w)| s + w * c.score[*i]),
            expected: same.map_or_else(|| expected(c, weights), |k| all[k].expected),
        });
    }
    all
}

fn expected(c: &Cluster, weights: &[(usize, f64)]) -> f64 {
    weights.iter().fold(0.0, |s, (i, w)| {
        let row = weights.iter();
        s + w * row.fold(0.0, |t, (j, v)| t + v * c.gram[(*i, *j)])
    })
}

/// By how much movements differ in the size that they give an effect, beyond what the noise makes: the part of their squared
/// distances from the common size that exceeds what chance makes in one of a thousand.
pub fn unlike(trial_scores: &[TrialScore]) -> f64 {
    let groups = trial_scores.iter().map(|t| t.configuration + 1).max();
    let (mut square, mut dof) = (0.0, -1.0);
    for group in 0..groups.unwrap_or(0) {
        let own = trial_scores.iter().filter(|t| t.configuration == group);
        let (score, information) = own.fold((0.0, 0.0), |(s, i), t| (s + t.score, i + t.expected));
        if information > 0.0 {
            square += (score - information) * (score - information) / information;
            dof += 1.0;
        }
    }
    if dof < 1.0 {
        return 0.0;
    }
    // Wilson and Hilferty's approximation of the quantile of chi squared.
    let part = 2.0 / (9.0 * dof);
    let root = 1.0 - part + 3.09 * libm::sqrt(part);
    (square - dof * root * root * root).max(0.0)
}

/// Variance of a score between repeats of one movement over what the noise allows, shrunk towards one; at least one.
pub fn spread(trial_scores: &[TrialScore]) -> f64 {
    let groups = trial_scores.iter().map(|t| t.configuration + 1).max();
    let (mut observed, mut predicted, mut dof) = (0.0, 0.0, 0.0);
    for group in 0..groups.unwrap_or(0) {
        let own: Vec<&TrialScore> = trial_scores
            .iter()
            .filter(|t| t.configuration == group)
            .collect();
        if own.len() < 2 {
            continue;
        }
        let n = own.len() as f64;
        let mean = own.iter().map(|t| t.score).sum::<f64>() / n;
        let squares = own.iter().map(|t| (t.score - mean) * (t.score - mean));
        observed += squares.sum::<f64>();
        predicted += own.iter().map(|t| t.expected).sum::<f64>() / n * (n - 1.0);
        dof += n - 1.0;
    }
    if predicted <= 0.0 {
        return 1.0;
    }
    ((BELIEF + dof * observed / predicted) / (BELIEF + dof)).max(1.0)
}

#[cfg(test)]
mod tests {
    use arm_numerics::Matrix;

    use super::*;

    /// Trials of several movements that give one effect these sizes, each known to a fifth.
    fn trials(sizes: &[f64]) -> Vec<Cluster> {
        const INFORMATION: f64 = 25.0;
        let one = |(configuration, size): (usize, &f64)| Cluster {
            configuration,
            gram: Arc::new(Matrix::diagonal(&[INFORMATION])),
            score: vec![INFORMATION * size],
            square: 0.0,
            rows: 1,
        };
        sizes.iter().enumerate().map(one).collect()
    }

    #[test]
    fn movements_are_unlike_where_their_sizes_differ_by_more_than_chance() {
        let of = |sizes| unlike(&trial_scores(&trials(sizes), &[(0, 1.0)]));
        assert_eq!(of(&[1.1, 0.8, 1.2, 0.9, 1.0, 1.0]), 0.0);
        // One movement makes it all: squared distances of 5 · 25 + 625, less the 20.5 that chance makes of five.
        let one = of(&[6.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert!((one - (750.0 - 20.5)).abs() < 0.3, "{one}");
    }

    /// Two repeats whose scores, of variance 25 by the noise, are 0 and 50: 50 times what it allows with one degree of freedom, beside
    /// six with the variance of the noise model.
    #[test]
    fn six_trials_as_the_noise_says_stand_beside_what_repeats_scatter() {
        let of = |trials: &[Cluster]| spread(&trial_scores(trials, &[(0, 1.0)]));
        let mut repeats = trials(&[0.0, 2.0]);
        repeats[1].configuration = 0;
        let found = of(&repeats);
        assert!((found - (6.0 + 50.0) / 7.0).abs() < 1e-12, "{found}");
        assert_eq!(of(&trials(&[0.0, 2.0])), 1.0);
    }
}
