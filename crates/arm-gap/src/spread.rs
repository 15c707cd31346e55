//! How much scores scatter between repeats, beside what the noise allows.

use crate::normal::Cluster;

/// Weight of "as the noise says", in trials.
const BELIEF: f64 = 6.0;

/// Variance of a score between repeats of one movement over what the noise allows, shrunk towards one; at least one.
///
/// * `weights` - columns and their weights in the score
pub fn spread(clusters: &[Cluster], weights: &[(usize, f64)]) -> f64 {
    let score = |c: &Cluster| weights.iter().fold(0.0, |s, (i, w)| s + w * c.score[*i]);
    let expected = |c: &Cluster| {
        weights.iter().fold(0.0, |s, (i, w)| {
            let row = weights.iter();
            s + w * row.fold(0.0, |t, (j, v)| t + v * c.gram[(*i, *j)])
        })
    };
    let groups = clusters.iter().map(|c| c.configuration + 1).max();
    let (mut observed, mut predicted, mut dof) = (0.0, 0.0, 0.0);
    for group in 0..groups.unwrap_or(0) {
        let own: Vec<&Cluster> = clusters
            .iter()
            .filter(|c| c.configuration == group)
            .collect();
        if own.len() < 2 {
            continue;
        }
        let n = own.len() as f64;
        let scores: Vec<f64> = own.iter().map(|c| score(c)).collect();
        let mean = scores.iter().sum::<f64>() / n;
        observed += scores.iter().map(|s| (s - mean) * (s - mean)).sum::<f64>();
        predicted += own.iter().map(|c| expected(c)).sum::<f64>() / n * (n - 1.0);
        dof += n - 1.0;
    }
    if predicted <= 0.0 {
        return 1.0;
    }
    ((BELIEF + dof * observed / predicted) / (BELIEF + dof)).max(1.0)
}
