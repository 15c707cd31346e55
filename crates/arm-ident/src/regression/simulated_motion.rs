//! Joint motion for the regressors, from a simulation of the closed chain along the measured path of the handle.
//!
//! Differentiated camera angles make dry friction and viscosity unreadable: the sign and size of a resting joint's speed
//! are noise. The simulated arm is led by the robot's own angles, which are known far better (an instrument in the sense
//! of Janot, Vandanjon, Gautier 2014). Measured angles stay on the right-hand side, see the module `instrument`.

use core::ops::ControlFlow;

use arm_core::{Chain, Joints, Setup};
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
/// The part of the longest step that is stable on a contact which a run keeps to: 2.61 radians of its vibration are stable, and in 0.39 of
/// them the fourth-order method errs by less than 10⁻⁴ of the amplitude.
const FOLLOWING: f64 = 0.15;
/// Poses of a trial at which the contact is judged, at most.
const POSES: usize = 64;
/// The part of the longest step that is stable, or follows steep dry friction, which a run keeps to in any case.
const SAFELY: f64 = 0.7;
/// Shortest step that this leads to \[s\].
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
    let drive = Drive::Handle {
        path: HandlePath::through_points(&times, &points)?,
        coupling: Coupling::Compliant,
    };
    let setup = Setup::new(&model.chain, model.contact);
    let mut experiment = Experiment::new(setup, drive, times[times.len() - 1]);
    experiment.effects = model.fitted.iter().chain(&model.held).copied().collect();
    experiment.start = Start::Equilibrium { near: trial.q[0] };
    let step = step(&model.chain, &experiment, &trial.q)?;
    experiment.dt = interval / (parts * libm::ceil(interval / parts / step));
    experiment.output_interval = Some(interval / parts);
    Ok(experiment)
}

/// The longest step that follows the contact in the poses of a trial, and dry friction \[s\].
fn step<const N: usize>(
    chain: &Chain<f64, N>,
    experiment: &Experiment<N>,
    poses: &[Joints<f64, N>],
) -> Result<f64, IdentError> {
    let some = poses.iter().step_by(poses.len().div_ceil(POSES).max(1));
    let stable = longest_step_on_contact(&experiment.altered()?, some)?;
    let followed = (FOLLOWING * stable).clamp(USUAL_STEP, LONGEST_STEP);
    let effects = experiment.effects.iter();
    let shortest = effects.fold(stable, |step, e| step.min(longest_step(chain, e)));
    Ok(followed.min((SAFELY * shortest).max(SHORTEST_STEP)))
}

#[cfg(test)]
mod tests {
    use arm_core::effect::{Effect, Kind};
    use arm_core::{Contact, sample_arms};

    use super::*;

    const NEAR: [f64; 2] = [-1.0, 0.8];

    fn on(contact: Contact<f64>, friction: Vec<Effect<f64>>) -> Experiment<2> {
        let setup = Setup::new(&sample_arms::mechanical_arm(), contact);
        let path = HandlePath::through_points(&[0.0, 1.0], &[[0.3, 0.0]; 2]).unwrap();
        let drive = Drive::Handle {
            path,
            coupling: Coupling::Compliant,
        };
        let mut experiment = Experiment::new(setup, drive, 1.0);
        experiment.effects = friction;
        experiment
    }

    fn chosen_at(poses: &[[f64; 2]], contact: Contact<f64>, friction: Vec<Effect<f64>>) -> f64 {
        let poses: Vec<Joints<f64, 2>> = poses.iter().map(|&q| q.into()).collect();
        let experiment = on(contact, friction);
        step(&sample_arms::mechanical_arm(), &experiment, &poses).unwrap()
    }

    fn chosen(stiffness: f64, friction: Vec<Effect<f64>>) -> f64 {
        let contact = Contact::new([stiffness; 2], [0.0; 2]);
        chosen_at(&[NEAR], contact, friction)
    }

    fn stable(stiffness: f64) -> f64 {
        let setup = on(Contact::new([stiffness; 2], [0.0; 2]), Vec::new()).setup;
        longest_step_on_contact(&setup, [&NEAR.into()]).unwrap()
    }

    /// Dry friction whose speed at rest decays within a time \[s\].
    fn decaying_in(seconds: f64) -> Vec<Effect<f64>> {
        let gentle = Effect::new(Kind::Coulomb, 0).with(&[1.0, 1.0]);
        let longest = longest_step(&sample_arms::mechanical_arm(), &gentle);
        let smoothing = seconds / longest;
        vec![Effect::new(Kind::Coulomb, 0).with(&[1.0, smoothing])]
    }

    #[test]
    fn the_step_follows_the_contact_between_the_shortest_and_the_longest() {
        assert_eq!(chosen(1e3, Vec::new()), LONGEST_STEP);
        assert_eq!(chosen(2e6, Vec::new()), USUAL_STEP);
        let ratio = FOLLOWING * stable(1e3) / 0.5e-3;
        let between = 1e3 * ratio * ratio;
        let step = chosen(between, Vec::new());
        assert!((step - 0.5e-3).abs() < 1e-9, "{step}");
        assert_eq!(step, FOLLOWING * stable(between));
    }

    #[test]
    fn a_contact_beyond_the_usual_step_is_followed_as_far_as_it_is_stable() {
        let stiff = 3e5 * (stable(3e5) / 0.2e-3) * (stable(3e5) / 0.2e-3);
        assert!((stable(stiff) - 0.2e-3).abs() < 1e-9);
        assert_eq!(chosen(stiff, Vec::new()), SAFELY * stable(stiff));
        assert_eq!(chosen(1e12, Vec::new()), SHORTEST_STEP);
    }

    /// Stiff along y only: a stretched arm along y hardly feels it, a bent one does. Judged at the start of a trial, an estimate was off by
    /// 2.4 standard deviations.
    #[test]
    fn a_contact_that_is_stiff_in_one_direction_is_judged_in_all_poses() {
        let contact = Contact::new([3e6, 1e3], [0.0; 2]);
        let [stretched, bent] = [[0.0, 0.02], [-0.6, -0.8]];
        let [first, second] = [stretched, bent].map(|q| chosen_at(&[q], contact, Vec::new()));
        assert!(second < first, "{first} {second}");
        assert_eq!(chosen_at(&[stretched, bent], contact, Vec::new()), second);
        // Every so many of a long trial.
        let long: Vec<_> = (0..1000)
            .map(|i| if i < 900 { stretched } else { bent })
            .collect();
        assert_eq!(chosen_at(&long, contact, Vec::new()), second);
    }

    #[test]
    fn effects_that_change_the_contact_count() {
        let damping = vec![Effect::new(Kind::ContactDamping, 0).with(&[3e3])];
        let contact = Contact::new([1e3; 2], [0.0; 2]);
        assert!(chosen_at(&[NEAR], contact, damping) < chosen(1e3, Vec::new()));
    }

    #[test]
    fn the_step_follows_steep_friction_as_far_as_the_shortest() {
        let near = |step: f64, wanted: f64| assert!((step / wanted - 1.0).abs() < 1e-12, "{step}");
        near(chosen(1e3, decaying_in(2e-3)), LONGEST_STEP);
        near(chosen(1e3, decaying_in(1e-3)), SAFELY * 1e-3);
        near(chosen(2e6, decaying_in(0.2e-3)), SAFELY * 0.2e-3);
        near(chosen(1e3, decaying_in(50e-6)), SHORTEST_STEP);
        let both = [decaying_in(1e-3), decaying_in(0.5e-3)].concat();
        near(chosen(1e3, both), SAFELY * 0.5e-3);
    }

    /// One step of the fourth-order method multiplies an undamped vibration by the Taylor polynomial of its turn.
    #[test]
    fn a_vibration_is_followed_to_a_ten_thousandth_in_a_step() {
        let turn = FOLLOWING * 2.61;
        let [square, cube] = [turn * turn, turn * turn * turn];
        let real = 1.0 - square / 2.0 + square * square / 24.0 - libm::cos(turn);
        let imaginary = turn - cube / 6.0 - libm::sin(turn);
        assert!(libm::hypot(real, imaginary) < 1e-4);
    }
}
