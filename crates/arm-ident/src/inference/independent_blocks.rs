//! Blocks of data whose errors are independent: their scatter gives the uncertainty of an estimate.

use core::ops::Range;

use crate::error::IdentError;
use crate::regression::preprocessing::Pieces;
use crate::regression::rows::RegressionRows;
use arm_numerics::NumericsError;
use arm_numerics::statistics::sandwich_covariance::blocks;

/// From this number of trials on, a trial is a cluster; below, trials are cut into blocks.
const ENOUGH_TRIALS: usize = 10;
/// Fewest clusters aimed at when trials are cut into blocks.
const BLOCKS: usize = 12;
/// Shortest block, in decimated samples.
const SHORTEST_BLOCK: usize = 20;

/// Stretches of one cluster: trial, piece and samples of it.
type Cluster = Vec<((usize, usize), Range<usize>)>;

/// A trial each, or blocks of trials where there are few.
///
/// * `lengths` - samples in each piece of each trial
///
/// # Errors
/// [`NumericsError::TooFew`] when there are fewer than two.
pub(crate) fn clusters(lengths: &[Vec<usize>]) -> Result<Vec<Cluster>, IdentError> {
    let samples: usize = lengths.iter().flatten().sum();
    let block = (samples / BLOCKS).max(SHORTEST_BLOCK);
    let mut clusters: Vec<Cluster> = Vec::new();
    for (trial, pieces) in lengths.iter().enumerate().filter(|(_, p)| !p.is_empty()) {
        let numbered = pieces.iter().enumerate();
        if lengths.len() >= ENOUGH_TRIALS {
            clusters.push(numbered.map(|(piece, &n)| ((trial, piece), 0..n)).collect());
            continue;
        }
        for (piece, &n) in numbered {
            let ranges = blocks(n, block.min(n))?;
            clusters.extend(
                ranges
                    .into_iter()
                    .map(|range| vec![((trial, piece), range)]),
            );
        }
    }
    if clusters.len() < 2 {
        return Err(IdentError::Numerics(NumericsError::TooFew {
            name: "usable stretches of data",
            found: clusters.len(),
            expected: 2,
        }));
    }
    Ok(clusters)
}

/// [`clusters`] of the rows of trials.
///
/// # Errors
/// As [`clusters`].
#[expect(clippy::type_complexity, reason = "a list of lists of stretches")]
pub(crate) fn cluster_ranges<'a>(
    fit: &[&'a Pieces],
) -> Result<Vec<Vec<(&'a RegressionRows, Range<usize>)>>, IdentError> {
    let length = |pieces: &&Pieces| pieces.iter().map(|rows| rows.samples.len()).collect();
    let lengths: Vec<Vec<usize>> = fit.iter().map(length).collect();
    let of_rows = |cluster: Cluster| {
        let stretches = cluster.into_iter();
        stretches
            .map(|((trial, piece), range)| (&fit[trial][piece], range))
            .collect()
    };
    Ok(clusters(&lengths)?.into_iter().map(of_rows).collect())
}
