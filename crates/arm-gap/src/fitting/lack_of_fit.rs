//! Lack of fit of a fitted hypothesis, compared with the scatter between repeats.

use crate::data::noise::{orthogonal, project_off};
use crate::fitting::fit::FittedHypothesis;
use crate::prepared_session::PreparedSession;
use crate::sensitivity::linearization_point::LinearizationPoint;

/// Rows whose squares are summed to estimate the scatter of such sums: about a second.
const RUN: usize = 12;

/// Lack of fit against pure error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LackOfFit {
    /// Variance of what repeats have in common over the variance of what they differ in, both for each degree of freedom.
    pub ratio: f64,
    /// The ratio minus one in its standard deviations, which are estimated from seconds of the differences of repeats; NaN
    /// without repeats.
    pub z: f64,
    /// What repeats have in common beyond the noise, as a sum of squares.
    pub excess: f64,
}

impl LackOfFit {
    /// What is left at least, as a sum of squares: the excess less two of its standard deviations, one time in forty more by chance.
    pub fn certain(&self) -> f64 {
        /// Standard deviations that chance takes.
        const CHANCE: f64 = 2.0;
        if self.z > CHANCE {
            self.excess * (1.0 - CHANCE / self.z)
        } else {
            0.0
        }
    }
}

/// Lack of fit of a hypothesis over the groups of repeats. Movements with an unknown path between the samples of the robot have none:
/// that path is the same in every repeat.
pub fn lack_of_fit<const N: usize>(
    prepared: &PreparedSession<N>,
    point: &LinearizationPoint<N>,
    fitted: &FittedHypothesis<N>,
) -> LackOfFit {
    let (mut common, mut common_dof, mut trial_specific, mut apart_dof) = (0.0, 0.0, 0.0, 0.0);
    let mut runs = Vec::new();
    for group in 0..prepared.references.len() {
        if prepared.courses[prepared.references[group]].weight < 1.0 {
            continue;
        }
        let Some((members, valid_segments)) = prepared.agreeing(group) else {
            continue;
        };
        let valid_segments = &valid_segments;
        let white = prepared.noise.white_at(valid_segments);
        let own = point.own.iter();
        let columns = orthogonal(own.map(|r| white(&r.0[group])).collect());
        let rows: Vec<Vec<f64>> = members
            .iter()
            .map(|&m| {
                let mut row = white(&fitted.residuals[m]);
                project_off(&mut row, &columns);
                row
            })
            .collect();
        let n = rows.len() as f64;
        let size = rows[0].len();
        let compared: usize = valid_segments
            .rows_per_channel(prepared.session.channels())
            .iter()
            .sum();
        let free = compared.saturating_sub(columns.len()) as f64;
        let mut differ = vec![0.0; size];
        for (i, differ) in differ.iter_mut().enumerate() {
            let mean = rows.iter().map(|r| r[i]).sum::<f64>() / n;
            common += n * mean * mean;
            let each = rows.iter().map(|r| (r[i] - mean) * (r[i] - mean));
            *differ = each.sum::<f64>();
            trial_specific += *differ;
        }
        if n > 1.0 {
            let channels = differ.chunks_exact(valid_segments.len());
            let each = channels.flat_map(|channel| channel.chunks_exact(RUN));
            let sums = each.map(|run| (run.iter().sum::<f64>(), n - 1.0));
            // Where rest removes a component of the force, nothing is compared.
            runs.extend(sums.filter(|(sum, _)| *sum > 0.0));
        }
        common_dof += free;
        apart_dof += free * (n - 1.0);
    }
    let unknowns = prepared.nuisances().len() + fitted.asked.len();
    let common_dof = (common_dof - unknowns as f64).max(1.0);
    if apart_dof < 1.0 {
        return LackOfFit {
            ratio: f64::NAN,
            z: f64::NAN,
            excess: f64::NAN,
        };
    }
    let noise = trial_specific / apart_dof;
    let ratio = common / common_dof / noise;
    // Rows that are not quite white, or larger at some times than at others, scatter more than white ones.
    let scatter = runs.iter().fold(0.0, |s, (sum, freedom)| {
        let dof = RUN as f64 * freedom;
        let off = sum / noise - dof;
        s + off * off / (2.0 * dof)
    }) / f64::max(runs.len() as f64, 1.0);
    let variance = (2.0 / common_dof + 2.0 / apart_dof) * scatter.max(1.0);
    LackOfFit {
        ratio,
        z: (ratio - 1.0) / libm::sqrt(variance),
        excess: common / noise - common_dof,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_chance_may_leave_is_not_certain() {
        let certain = |z: f64| {
            let (ratio, excess) = (1.1, 100.0);
            LackOfFit { ratio, z, excess }.certain()
        };
        assert_eq!([1.0, 2.0, f64::NAN].map(certain), [0.0; 3]);
        assert_eq!(certain(4.0), 50.0);
    }
}
