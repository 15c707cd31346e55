//! The measured path of the first joint, along which the base of a simulated arm moves.

use arm_ident::regression::measured_motion::displacement_of_base;
use arm_sim::{Interpolation, Series};

use crate::GapError;
use crate::data::session::{ComparisonMode, Session};

impl<const N: usize> Session<N> {
    /// How far the first joint is from the place of the base in a trial, where its path was measured and drives a simulation.
    ///
    /// # Errors
    /// [`GapError`] for a path that the filter or a spline refuses.
    pub(super) fn base_path(
        &self,
        trial: usize,
        times: &[f64],
    ) -> Result<Option<Series<2>>, GapError> {
        let own = &self.trials[trial];
        let (Some(path), ComparisonMode::Led) = (&own.base, self.comparison) else {
            return Ok(None);
        };
        let points = displacement_of_base(path, self.chain.base(), own.rate)?;
        let series = Series::new("path of the base", times, &points, Interpolation::Cubic);
        let refused = |source| GapError::Simulation { trial, source };
        Ok(Some(series.map_err(refused)?))
    }
}
