//! The second engine: the same experiment with rigid bodies and joints, solved by [rapier](https://rapier.rs).
//!
//! It shares with the native engine the laws of the effects and the contact, how a motion begins, and the recording. The
//! dynamics are its own: three coordinates a segment, joints as constraints, forces by an iterative solver. No inertia
//! matrix, no Coriolis term and no Jacobian of the arm is behind the motion, so that what both engines agree on is not a
//! mistake of one derivation.
//!
//! Impulse joints, not rapier's multibodies: those too are written in joint angles, and would be a second implementation but
//! no second derivation.
//!
//! # Agreement
//! Largest differences to the native engine over a run at steps of 0.25 ms (`tests/suite/rapier.rs`), with contact
//! 10 kN/m, viscosity 0.2 N m s/rad, elasticity 0.5 N m/rad about angles off the path; forces are up to 17 N:
//!
//! | experiment | angles \[rad\] | speeds \[rad/s\] | force \[N\] |
//! | --- | --- | --- | --- |
//! | table 4.10, 20 s, (−68, 40, 0)° to (−56, 80, 5)° and back | 1.2e-8 | 1.2e-6 | 3.8e-5 |
//! | table 4.9, 20 s, (−60, 50)° to (−40, 80)° and back | 5.9e-9 | 8.2e-7 | 1.0e-5 |
//! | table 4.10 in 4 s, contact damped with 25 N s/m | 7.2e-8 | 7.0e-6 | 1.4e-4 |
//! | table 4.10 in 4 s with continuous acceleration, tip held rigidly | 4.8e-8 | 1.2e-6 | 2.6e-3 |
//! | three segments thrown and left alone for 2 s, up to 22 rad/s | 3.2e-5 | 4.3e-4 | |
//!
//! # Why not closer
//! Only for the step: differences fall with its square, as far down as was tried (the force of a rigid coupling with the
//! step itself where the jerk of the handle jumps).
//!
//! | step \[ms\] | 1 | 0.5 | 0.25 | 0.1 | 0.05 | 0.02 | 0.01 | 0.005 |
//! | --- | --- | --- | --- | --- | --- | --- | --- | --- |
//! | table 4.10 in 4 s, damped: angles \[rad\] | 1.2e-6 | 2.9e-7 | 7.2e-8 | 1.2e-8 | 2.9e-9 | 4.6e-10 | 1.2e-10 | 2.9e-11 |
//! | force \[N\] | 2.3e-3 | 5.7e-4 | 1.4e-4 | 2.3e-5 | 5.7e-6 | 9.0e-7 | 2.3e-7 | 5.7e-8 |
//!
//! Rapier's step is semi-implicit Euler, of first order when its speeds are taken for those of the end of the step. They
//! are those of its middle: read so, it is the leapfrog method of Störmer and Verlet, of second order. That needs
//!
//! - a start with the speeds of half a step before, and speeds extrapolated by half a step for dampers and friction;
//! - no second solver pass ("stabilization"): it takes out of the speeds the part with which the joints close over the
//!   step, which is the half step by which they turn with the arm. In its stead joints stay open by `½ ω² r h²`,
//!   1e-10 m in table 4.10;
//! - joints that are not soft: 1e9 Hz, at which a joint's error is removed within one step;
//! - forces that are found to the last: 30 sweeps, from those of the step before.
//!
//! Their errors, table 4.10 in 4 s with damping, 0.25 ms (first order unless stated):
//!
//! | | angles \[rad\] | force \[N\] |
//! | --- | --- | --- |
//! | rapier's defaults: 4 substeps of one sweep, both passes | 1.7e-5 | 1.8e-2 |
//! | 50 sweeps, both passes | 1.2e-5 | 5.6e-3 |
//! | 50 sweeps, one pass | 1.5e-5 | 5.6e-3 |
//! | the contact as spring and damper of a rapier joint (implicit), 20 or 100 sweeps, one pass | 2.8e-5 | 4.0e-2 |
//! | leapfrog, 5 to 50 sweeps (second order) | 7.2e-8 | 1.4e-4 |
//!
//! An implicit contact is not the remedy: it stays stable for any step, but damps the vibration that it steps over. The
//! explicit spring is stable while `ω²h² + 4ch < 4`; above that the run is refused.
//!
//! The energy of a free swing goes up and down with the square of the step, and drifts with its cube: of 8 J in motion
//! 1e-2 J in a minute at 1 ms, 1e-3 J at 0.5 ms, at 0.25 ms nothing beyond the 7e-4 J of the fluctuation.
//!
//! # Speed
//! A step takes 4.4 µs for three segments and 3.6 µs for two (one core of 3.7 GHz), 75 ns of it for each sweep; 13 µs with a
//! rigid coupling, about 25 µs with rotors.
//!
//! # What differs or is missing
//! - A first joint that moves with its angle or heaves, and segments without inertia, are refused.
//! - A rotor turns against two segments, which no inertia of a body can express; it is a damper of rapier's motor,
//!   which makes it exact but the solver slow: eight times as many sweeps. A rotor beyond about 15 times the inertia of the
//!   segments that it turns needs still more; where they are by far too few the run does not stay finite.
//! - Dry friction is a motor with the target speed zero and no more torque than the friction. Where a joint is fast enough
//!   that it cannot stop within the step it is a torque. Switches between sticking and slipping are not located: at each the
//!   speed is off by up to the step times the change of the acceleration, of first order.
//! - Friction that grows with the joint force takes the force that acts, extrapolated from the two steps before; the native
//!   engine takes that of the motion without this friction. They differ by the second order of the friction, 1.6e-3 rad
//!   for 3 mm in the elbow of the thrown arm.
//! - Forces of a rigid coupling are means over the step around a sample: where the acceleration of the handle jumps they
//!   are halfway. If the tip starts moving, the first of them is off by its centripetal part.
//!
//! # Determinism
//! One thread. Rapier's `enhanced-determinism` puts libm in place of the platform's functions (in simba and glam, which
//! compute all of its angles and roots) and hash maps in insertion order; no multiplication is fused. Runs have the same
//! bits in debug and release.

mod leapfrog;
mod settings;
mod world;

pub use settings::RapierSettings;

use crate::closed_chain::model::Link;
use crate::closed_chain::state::State;
use crate::preparation::prepared_run::Prepared;
use crate::recording::recorder::{Instant, Pieces, Recorder, Row};
use crate::{Experiment, Partial, SimulationError, Vibration};
use leapfrog::Arm;

/// Runs an experiment with the default settings, recorded as a whole or in pieces.
pub(crate) fn run<const N: usize>(
    experiment: &Experiment<N>,
    pieces: Option<Pieces<'_, N>>,
) -> Result<Partial<N>, SimulationError> {
    recorded(experiment, &RapierSettings::default(), pieces)
}

/// Simulates with rapier and keeps what was recorded before a state ceased to be finite.
///
/// The method is rapier's own, of second order; [`Experiment::integrator`] has no meaning here.
///
/// # Errors
/// What is refused before the first step, among it a first joint that moves, a segment without inertia, no sweeps, and a
/// contact too stiff for this engine.
pub fn simulate_rapier<const N: usize>(
    experiment: &Experiment<N>,
    settings: &RapierSettings,
) -> Result<Partial<N>, SimulationError> {
    recorded(experiment, settings, None)
}

fn recorded<const N: usize>(
    experiment: &Experiment<N>,
    settings: &RapierSettings,
    pieces: Option<Pieces<'_, N>>,
) -> Result<Partial<N>, SimulationError> {
    let prepared = Prepared::recorded(experiment, pieces.is_some())?;
    check(&prepared, settings)?;
    let schedule = prepared.schedule;
    let mut arm = Arm::new(&prepared, settings)?;
    let (mut recorder, mut row) = (Recorder::with(&prepared, pieces)?, Row::new());
    let (mut work, mut power) = ([0.0; 4], [0.0; 4]);
    let mut stopped = None;
    let mut input = prepared.input(0.0);
    // A sample is complete when the step from it is made, and so one step more than there are.
    for done in 0..=schedule.steps {
        let next = prepared.input(schedule.time(done + 1));
        let sample = match arm.step(&input, &next) {
            Ok(sample) => sample,
            Err(joint) => {
                stopped = Some(SimulationError::Diverged {
                    step: done,
                    time: schedule.time(done),
                    joint,
                });
                break;
            }
        };
        if done > 0 {
            // Trapezoidal rule.
            for (work, (now, before)) in work.iter_mut().zip(sample.power.iter().zip(power)) {
                *work += 0.5 * schedule.dt * (now + before);
            }
        }
        power = sample.power;
        if done % schedule.every == 0 {
            let state = State {
                q: sample.q,
                qd: sample.qd,
                work,
            };
            let instant = Instant {
                model: &prepared.model,
                input: &input,
                state: &state,
                memory: &arm.memory,
            };
            row.fill_with(&instant, &sample.forces);
            if recorder.push(&row, |value| *value).is_break() {
                break;
            }
        }
        arm.remember(&sample);
        input = next;
    }
    Ok(Partial {
        recording: recorder.finish(),
        stopped,
    })
}

/// What this engine cannot do, or not with this step.
fn check<const N: usize>(
    prepared: &Prepared<N>,
    settings: &RapierSettings,
) -> Result<(), SimulationError> {
    if settings.sweeps == 0 {
        return Err(SimulationError::Setting {
            name: "sweeps",
            found: 0.0,
            allowed: "at least one",
        });
    }
    let model = &prepared.model;
    if model.base.is_some() {
        return Err(SimulationError::Unsupported {
            engine: "rapier",
            what: "a first joint that moves with its angle",
        });
    }
    if model.heaves {
        return Err(SimulationError::Unsupported {
            engine: "rapier",
            what: "a first joint that heaves",
        });
    }
    let Link::Compliant(contact) = &model.link else {
        return Ok(());
    };
    let vibration = Vibration::at(contact, model, &prepared.start.0);
    let Vibration { frequency, damping } = vibration;
    // ω²h² + 4ch < 4: the mode ẍ + c ẋ + ω² x = 0 with its damper at a speed extrapolated from two half steps.
    let largest = 2.0 / (damping + (damping * damping + frequency * frequency).sqrt());
    let dt = prepared.schedule.dt;
    if dt <= largest {
        return Ok(());
    }
    Err(SimulationError::TooStiff {
        frequency,
        damping,
        largest,
        dt,
    })
}
