//! The measured path of the first joint, along which the base of a simulated arm moves.

use arm_core::Plane;
use arm_sim::{Interpolation, Series};

use crate::GapError;
use crate::data::session::{ComparisonMode, Session};
use crate::measurement_model::prediction::smooth;

impl<const N: usize> Session<N> {
    /// How far the first joint is from the place of the base in a trial, where its path was measured and drives a simulation; within the
    /// band of the comparison, as what is faster would be noise in its acceleration.
    ///
    /// # Errors
    /// [`GapError`] for a path that the filter or a spline refuses.
    pub(super) fn base_path(
        &self,
        trial: usize,
        band: f64,
        times: &[f64],
    ) -> Result<Option<Series<2>>, GapError> {
        let own = &self.trials[trial];
        let (Some(path), ComparisonMode::Led) = (&own.base, self.comparison) else {
            return Ok(None);
        };
        let place = self.chain.base();
        let axis = |a: usize| path.iter().map(|p| p[a] - place[a]).collect::<Vec<_>>();
        let smooth = smooth(&[axis(0), axis(1)], band, own.rate)?;
        let points: Vec<Plane<f64>> = std::iter::zip(&smooth[0], &smooth[1])
            .map(|(&y, &z)| [y, z])
            .collect();
        let series = Series::new("path of the base", times, &points, Interpolation::Cubic);
        let refused = |source| GapError::Simulation { trial, source };
        Ok(Some(series.map_err(refused)?))
    }
}
