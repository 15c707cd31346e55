//! Preparation of a session: leaves out samples at rest, and measures the noise.

use crate::GapError;
use crate::data::noise::NoiseModel;
use crate::data::session::Session;
use crate::prepared_session::PreparedSession;

impl<'a, const N: usize> PreparedSession<'a, N> {
    /// Makes a session ready; the noise is read off the repeats of the fit trials against the model as given.
    ///
    /// # Errors
    /// [`GapError`] for insufficient data, or a model that cannot be simulated.
    pub fn new(session: &'a Session<N>, threads: usize) -> Result<Self, GapError> {
        let noise = NoiseModel::unknown(session.channels())?;
        let mut prepared = Self::with_noise(session, noise, threads)?;
        let mut given = prepared.simulate_alone(&session.starting())?;
        let all = prepared.fitted.clone();
        prepared.leave_out_rest(&given);
        if prepared.fitted != all {
            // A trial in which nothing is left to compare has no place among the residuals either.
            given = prepared.simulate_alone(&session.starting())?;
        }
        prepared.measure_noise(&given)?;
        Ok(prepared)
    }
}
