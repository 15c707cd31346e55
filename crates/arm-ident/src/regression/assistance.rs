//! A virtual spring and damper in every joint that hold a simulated arm near the measured one.
//!
//! An arm of which little is known moves elsewhere than its model, and a fit that is linearised along such a run may end in a wrong minimum. With
//! `K (q_m − q) + D (q̇_m − q̇)` in its joints the model moves nearly as measured whatever its parameters are. A fit along such runs starts the
//! next with a weaker assistance, until there is none: a homotopy (Vyasarayani, Uchida, Carvalho and McPhee 2011, Parameter identification in
//! dynamic systems using the homotopy optimization approach).

use arm_sim::{Assistance, Experiment, Interpolation, Series, Springs};

use crate::error::IdentError;
use crate::regression::measured_motion::low_pass;
use crate::regression::trial::Trial;

/// Bandwidth of the angles that it pulls towards, in bandwidths of the rows.
const BAND: f64 = 2.0;

/// Lets springs and dampers pull the simulated arm towards the measured angles of its trial.
///
/// # Errors
/// [`IdentError`] when the trial is too short for the filter.
pub(crate) fn assist<const N: usize>(
    experiment: &mut Experiment<N>,
    springs: Springs<N>,
    trial: &Trial<N>,
    cutoff: f64,
) -> Result<(), IdentError> {
    let filter = low_pass((BAND * cutoff).min(0.4 * trial.rate), trial.rate)?;
    let measured: Vec<Vec<f64>> = (0..N)
        .map(|j| trial.q.iter().map(|q| q[j]).collect())
        .collect();
    let smooth = filter.both_ways_all(&measured)?;
    let angles: Vec<[f64; N]> = (0..trial.len())
        .map(|i| core::array::from_fn(|j| smooth[j][i]))
        .collect();
    let times: Vec<f64> = (0..trial.len()).map(|i| i as f64 / trial.rate).collect();
    experiment.assistance = Some(Assistance {
        towards: Series::new("measured angles", &times, &angles, Interpolation::Cubic)?,
        springs,
    });
    Ok(())
}
