//! Joint motion for the regressors, from a simulation of the closed chain along the measured path of the handle.
//!
//! Differentiated camera angles make dry friction and viscosity unreadable: the sign and size of a resting joint's speed
//! are noise. The simulated arm is led by the robot's own angles, which are known far better (an instrument in the sense
//! of Janot, Vandanjon, Gautier 2014). Measured angles stay on the right-hand side, see the module `instrument`.

use core::ops::ControlFlow;

use arm_core::Setup;
use arm_sim::{
    Coupling, Drive, Engine, Experiment, HandlePath, Recording, Springs, Start, longest_step,
    longest_step_on_contact, simulate_in_pieces,
};

use crate::error::IdentError;
use crate::regression::assistance::assist;
use crate::regression::measured_motion::low_pass;
use crate::regression::sensitivity::{Course, HELD, parts};
use crate::regression::trial::{Model, Trial};
use arm_numerics::NumericsError;

/// The step of `armrs simulate` \[s\]: the shortest that a stiff contact leads to.
pub(crate) const USUAL_STEP: f64 = 0.25e-3;
/// Longest step \[s\].
const LONGEST_STEP: f64 = 1e-3;
/// The part of the longest step that is stable on a contact which a run keeps to: 2.6 radians of its vibration are stable, and within 0.4 of
/// them the fourth-order method is off by less than 10⁻⁴ of its amplitude.
const FOLLOWING: f64 = 0.15;
/// The part of the longest step that follows steep dry friction which a run keeps to.
const SAFELY: f64 = 0.7;
/// Shortest step that steep dry friction leads to \[s\].
const SHORTEST_STEP: f64 = 0.0625e-3;
/// Bandwidth of the handle's path, in bandwidths of the rows. Wider, and noise of the robot's encoders makes a resting arm
/// creep to and fro, which is read as friction; narrower, and the corners of the path are rounded twice.
const HANDLE_BAND: f64 = 2.0;
/// The same for an arm that the robot does not hold in every joint. Its own vibrations and the sign of its dry friction answer
/// to what is faster than the rows: rounded corners of the path made the viscosity of a wrist a third too small.
const HANDLE_BAND_OF_FREE: f64 = 4.0;
/// Largest root mean square difference between simulated and measured angles that is still the same movement \[rad\].
const SAME_MOVEMENT: f64 = 0.15;
/// The same with an assistance, for an estimate that is no more than the start of the next \[rad\].
const LIKE_MOVEMENT: f64 = 0.5;

/// The run that the model makes along the handle's path of a trial, with the help of an assistance if there is one.
///
/// # Errors
/// [`IdentError`] when the handle's path is not known or something else acts with it, the simulation stops, or it moves elsewhere than the measured arm.
pub(crate) fn simulated<const N: usize>(
    model: &Model<N>,
    trial: &Trial<N>,
    cutoff: f64,
    assistance: Option<Springs<N>>,
) -> Result<Course<N>, IdentError> {
    if trial.base.is_some() {
        return Err(IdentError::MovingBase);
    }
    if trial.activity.is_some() {
        return Err(IdentError::MuscleActivity);
    }
    let Some(handle) = &trial.handle else {
        return Err(IdentError::Numerics(NumericsError::TooFew {
            name: "robot angles in every trial",
            found: 0,
            expected: 1,
        }));
    };
    let mut experiment = experiment(model, trial, handle, cutoff)?;
    if let Some(springs) = assistance {
        assist(&mut experiment, springs, trial, cutoff)?;
    }
    let recording = moved(&experiment)?;
    let mut course = Course::new(&recording, trial.rate, parts(trial.rate));
    course.assistance = assistance;
    drop(recording);
    let allowed = match assistance {
        Some(_) => LIKE_MOVEMENT,
        None => SAME_MOVEMENT,
    };
    let mut square = [0.0; N];
    for (simulated, q) in course.angles_at_samples().zip(&trial.q) {
        for j in 0..N {
            square[j] += (simulated[j] - q[j]) * (simulated[j] - q[j]);
        }
    }
    for (j, sum) in square.iter().enumerate() {
        let found = libm::sqrt(sum / trial.len() as f64);
        if found > allowed {
            return Err(IdentError::OtherMovement {
                joint: j + 1,
                found,
                allowed,
            });
        }
    }
    Ok(course)
}

/// The motion and the force of a run, the least part of what is recorded.
fn moved<const N: usize>(experiment: &Experiment<N>) -> Result<Recording<N>, IdentError> {
    /// Samples of a run that are held in full at a time: only what moves is kept of them.
    const PIECE: usize = 4096;
    let mut kept = Recording::default();
    simulate_in_pieces(Engine::Native, experiment, PIECE, &mut |piece| {
        let piece = piece.recording;
        kept.q.extend(&piece.q);
        kept.qd.extend(&piece.qd);
        kept.qdd.extend(&piece.qdd);
        kept.force_on_arm.extend(&piece.force_on_arm);
        ControlFlow::Continue(())
    })?;
    Ok(kept)
}

fn experiment<const N: usize>(
    model: &Model<N>,
    trial: &Trial<N>,
    handle: &[[f64; 2]],
    cutoff: f64,
) -> Result<Experiment<N>, IdentError> {
    let band = if N > HELD {
        HANDLE_BAND_OF_FREE
    } else {
        HANDLE_BAND
    };
    let filter = low_pass((band * cutoff).min(0.4 * trial.rate), trial.rate)?;
    let axis = |a: usize| filter.both_ways(&handle.iter().map(|p| p[a]).collect::<Vec<_>>());
    let (y, z) = (axis(0)?, axis(1)?);
    let points: Vec<[f64; 2]> = y.into_iter().zip(z).map(|(y, z)| [y, z]).collect();
    let interval = 1.0 / trial.rate;
    let times: Vec<f64> = (0..trial.len()).map(|i| i as f64 * interval).collect();
    let parts = parts(trial.rate) as f64;
    let effects = model.fitted.iter().chain(&model.held);
    let longest = effects
        .map(|e| longest_step(&model.chain, e))
        .fold(f64::INFINITY, f64::min);
    let setup = Setup::new(&model.chain, model.contact);
    let on_contact = longest_step_on_contact(&setup, &trial.q[0])?;
    let step = (FOLLOWING * on_contact).clamp(USUAL_STEP, LONGEST_STEP);
    let step = step.min((SAFELY * longest).max(SHORTEST_STEP));
    let steps = parts * libm::ceil(interval / parts / step);
    let drive = Drive::Handle {
        path: HandlePath::through_points(&times, &points)?,
        coupling: Coupling::Compliant,
    };
    let mut experiment = Experiment::new(setup, drive, times[times.len() - 1]);
    experiment.effects = model.fitted.iter().chain(&model.held).copied().collect();
    experiment.start = Start::Equilibrium { near: trial.q[0] };
    experiment.dt = interval / steps;
    experiment.output_interval = Some(interval / parts);
    Ok(experiment)
}
