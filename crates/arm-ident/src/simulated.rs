//! Joint motion for the regressors, from a simulation of the closed chain along the measured path of the handle.
//!
//! Differentiated camera angles make dry friction and viscosity unreadable: the sign and size of a resting joint's speed
//! are noise. The simulated arm is led by the robot's own angles, which are known far better (an instrument in the sense
//! of Janot, Vandanjon, Gautier 2014); only its speeds and accelerations are used, the angles stay the measured ones.

use arm_core::Setup;
use arm_sim::{Coupling, Drive, Experiment, HandlePath, Start, simulate};

use crate::equation::Kinematics;
use crate::error::IdentError;
use crate::motion::low_pass;
use crate::trial::{Model, Trial};

/// Longest simulation step \[s\]; small enough for stiff contacts and smoothed dry friction.
const LONGEST_STEP: f64 = 0.25e-3;
/// Bandwidth of the handle's path, in bandwidths of the rows. Wider, and noise of the robot's encoders makes a resting arm
/// creep to and fro, which is read as friction; narrower, and the corners of the path are rounded twice.
const HANDLE_BAND: f64 = 2.0;
/// Largest root mean square difference between simulated and measured angles that is still the same movement \[rad\].
const SAME_MOVEMENT: f64 = 0.15;

/// Simulated speeds and accelerations under measured angles.
///
/// # Errors
/// [`IdentError`] when the handle's path is not known, the simulation stops, or it moves elsewhere than the measured arm.
pub fn simulated<const N: usize>(
    model: &Model<N>,
    trial: &Trial<N>,
    seen: Kinematics<N>,
    cutoff: f64,
) -> Result<Kinematics<N>, IdentError> {
    let Some(handle) = &trial.handle else {
        return Err(IdentError::TooFew {
            name: "robot angles in every trial",
            found: 0,
            expected: 1,
        });
    };
    let recording = simulate(&experiment(model, trial, handle, &seen, cutoff)?)?;
    let joint =
        |values: &[f64], i: usize| arm_core::Joints::from_column_slice(&values[i * N..(i + 1) * N]);
    let mut square = [0.0; N];
    for (i, q) in seen.q.iter().enumerate() {
        let simulated: arm_core::Joints<f64, N> = joint(&recording.q, i);
        for j in 0..N {
            square[j] += (simulated[j] - q[j]) * (simulated[j] - q[j]);
        }
    }
    for (j, sum) in square.iter().enumerate() {
        let found = libm::sqrt(sum / trial.len() as f64);
        if found > SAME_MOVEMENT {
            return Err(IdentError::OtherMovement {
                joint: j + 1,
                found,
                allowed: SAME_MOVEMENT,
            });
        }
    }
    Ok(Kinematics {
        q: seen.q,
        qd: (0..trial.len()).map(|i| joint(&recording.qd, i)).collect(),
        qdd: (0..trial.len()).map(|i| joint(&recording.qdd, i)).collect(),
    })
}

fn experiment<const N: usize>(
    model: &Model<N>,
    trial: &Trial<N>,
    handle: &[[f64; 2]],
    seen: &Kinematics<N>,
    cutoff: f64,
) -> Result<Experiment<N>, IdentError> {
    let filter = low_pass((HANDLE_BAND * cutoff).min(0.4 * trial.rate), trial.rate)?;
    let axis = |a: usize| filter.both_ways(&handle.iter().map(|p| p[a]).collect::<Vec<_>>());
    let (y, z) = (axis(0)?, axis(1)?);
    let points: Vec<[f64; 2]> = y.into_iter().zip(z).map(|(y, z)| [y, z]).collect();
    let interval = 1.0 / trial.rate;
    let times: Vec<f64> = (0..trial.len()).map(|i| i as f64 * interval).collect();
    let steps = libm::ceil(interval / LONGEST_STEP);
    let drive = Drive::Handle {
        path: HandlePath::through_points(&times, &points)?,
        coupling: Coupling::Compliant,
    };
    let mut experiment = Experiment::new(
        Setup::new(&model.chain, model.contact),
        drive,
        times[times.len() - 1],
    );
    experiment.effects = model.fitted.iter().chain(&model.held).copied().collect();
    experiment.start = Start::Equilibrium { near: seen.q[0] };
    experiment.dt = interval / steps;
    experiment.output_interval = Some(interval);
    Ok(experiment)
}
