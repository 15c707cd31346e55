//! Predicted readings of the channels along a trial under a hypothesis.

use arm_core::effect::{Effect, Motion, Place};
use arm_core::{Joints, Pose, inertia, joint_force};
use arm_sim::{
    Coupling, Drive, Experiment, Integrator, Recording, Sensors, SimulationError, SmoothFriction,
    Start, longest_step_on_contact, simulate,
};

use crate::data::course::{Channels, Course, smooth};
use crate::data::session::{ComparisonMode, Session};
use crate::hypothesis::{Hypothesis, Target};

/// Steps that are tried, longest first \[s\].
pub(crate) const STEPS: [f64; 4] = [2e-3, 1e-3, 5e-4, 2.5e-4];
/// Least rate at which a run is recorded that sensors read \[Hz\]: what a delayed sensor reads lies between samples, where few of them
/// would take a fifth of an arm's ringing on its contact.
const RECORDED: f64 = 250.0;

/// A hypothesis played through on one trial, before the sensors.
#[derive(Clone, Debug)]
pub struct Run<const N: usize> {
    experiment: Option<Experiment<N>>,
    recording: Recording<N>,
}

impl<const N: usize> Run<N> {
    /// What happened in the simulation; empty where torques are compared.
    pub fn recording(&self) -> &Recording<N> {
        &self.recording
    }
}

impl<const N: usize> Session<N> {
    /// Plays a hypothesis through on a trial.
    ///
    /// # Errors
    /// [`SimulationError`] where the hypothesis cannot be simulated.
    pub fn run(
        &self,
        hypothesis: &Hypothesis<N>,
        course: &Course<N>,
    ) -> Result<Run<N>, SimulationError> {
        let parts = libm::ceil(RECORDED / course.rate - 1e-9).max(1.0);
        self.run_finely(hypothesis, course, parts as usize)
    }

    /// The same, recorded `parts` times for each sample of the trial.
    ///
    /// # Errors
    /// As [`Session::run`].
    pub fn run_finely(
        &self,
        hypothesis: &Hypothesis<N>,
        course: &Course<N>,
        parts: usize,
    ) -> Result<Run<N>, SimulationError> {
        if self.comparison == ComparisonMode::Torque {
            return Ok(Run {
                experiment: None,
                recording: Recording::default(),
            });
        }
        let drive = Drive::Handle {
            path: course.handle_path(hypothesis)?,
            coupling: Coupling::Compliant,
        };
        let setup = hypothesis.setup(&self.chain, self.contact)?;
        let interval = 1.0 / course.rate / parts as f64;
        let duration = course.times[course.times.len() - 1];
        let mut experiment = Experiment::new(setup, drive, duration);
        experiment.effects = [hypothesis.effects(), course.rhythms.clone()].concat();
        experiment.base.clone_from(&course.base);
        experiment.output_interval = Some(interval);
        let near = self.near(hypothesis, course)?;
        let mut longest = STEPS[0];
        if is_steep(&experiment, &near) {
            experiment.integrator = Integrator::Imex;
            longest = longest_second_order_step(&experiment, &near);
        }
        let mut last = None;
        for step in STEPS {
            if step > longest && step != STEPS[STEPS.len() - 1] {
                continue;
            }
            experiment.dt = interval / libm::ceil(interval / step - 1e-9);
            let start = self.start(hypothesis, course, &experiment);
            let mut outcome = start.and_then(|start| {
                experiment.start = start;
                simulate(&experiment)
            });
            if matches!(outcome, Err(SimulationError::NoEquilibrium { .. })) {
                experiment.start = Start::Given {
                    q: near,
                    qd: Joints::zeros(),
                };
                outcome = simulate(&experiment);
            }
            match outcome {
                Ok(recording) => {
                    return Ok(Run {
                        experiment: Some(experiment),
                        recording,
                    });
                }
                Err(error) => last = Some(error),
            }
        }
        Err(last.unwrap_or(SimulationError::Setting {
            name: "step",
            found: STEPS[0],
            allowed: "a step that is tried",
        }))
    }

    /// What the sensors would read of a run, in the common band.
    ///
    /// # Errors
    /// [`SimulationError`] for effects that are not valid, or a channel that is not finite.
    pub fn read(
        &self,
        hypothesis: &Hypothesis<N>,
        course: &Course<N>,
        run: &Run<N>,
    ) -> Result<Channels, SimulationError> {
        in_common_band(&self.read_raw(hypothesis, course, run)?, course)
    }

    /// What the sensors would read of a run.
    ///
    /// # Errors
    /// As [`Session::read`].
    pub fn read_raw(
        &self,
        hypothesis: &Hypothesis<N>,
        course: &Course<N>,
        run: &Run<N>,
    ) -> Result<Channels, SimulationError> {
        let Some(experiment) = &run.experiment else {
            return self.torques(hypothesis, course);
        };
        let mut experiment = experiment.clone();
        experiment.effects = hypothesis.effects();
        let mut sensors = Sensors::<N>::ideal();
        sensors.rate = course.rate;
        let readings = sensors.read(&experiment, &run.recording)?;
        let count = course.times.len().min(readings.time.len());
        let column = |values: &[f64], width: usize, entry: usize| -> Vec<f64> {
            let mut out: Vec<f64> = (0..count).map(|i| values[i * width + entry]).collect();
            let last = out.last().copied().unwrap_or(0.0);
            out.resize(course.times.len(), last);
            out
        };
        let angles = (0..N).map(|j| column(&readings.q, N, j));
        let forces = (0..2).map(|c| column(&readings.force_on_arm, 2, c));
        Ok(angles.chain(forces).collect())
    }

    /// Whether a change reaches the sensors alone, so that a run need not be repeated.
    pub fn is_sensing(&self, hypothesis: &Hypothesis<N>, target: Target) -> bool {
        let sensing = |effect: &Effect<f64>| {
            matches!(
                effect.kind.info().place,
                Place::AngleSensor | Place::ForceSensor | Place::Sensors
            )
        };
        match target {
            Target::Segment(..)
            | Target::Contact(..)
            | Target::Shift(_)
            | Target::Placement(_)
            | Target::Eccentricity(..) => false,
            Target::Known(e, _) => sensing(&hypothesis.known[e]),
            Target::Calibration(_) => true,
            Target::Named(e, _) => sensing(&hypothesis.named[e]),
        }
    }
}

/// Simulated channels in the common band of a trial.
///
/// # Errors
/// [`SimulationError`] for a channel that is not finite.
pub(super) fn in_common_band<const N: usize>(
    channels: &[Vec<f64>],
    course: &Course<N>,
) -> Result<Channels, SimulationError> {
    smooth(channels, course.band, course.rate).map_err(|_| SimulationError::Setting {
        name: "simulated channel",
        found: f64::NAN,
        allowed: "finite numbers",
    })
}

/// Whether what resists to speed is too steep at rest for an explicit method with the longest step: viscosity, and smooth dry friction. Set-valued
/// dry friction is solved, whatever the step.
fn is_steep<const N: usize>(experiment: &Experiment<N>, q: &Joints<f64, N>) -> bool {
    /// Decay in a step that the fourth-order method follows, rounded down.
    const FOLLOWED: f64 = 2.7;
    let Some(chain) = experiment
        .altered()
        .ok()
        .and_then(|setup| setup.chain().ok())
    else {
        return false;
    };
    let (pose, zero) = (Pose::new(q), Joints::<f64, N>::zeros());
    let Some(yielding) = inertia(&chain, &pose).try_inverse() else {
        return false;
    };
    let through = joint_force(&chain, &pose, (&zero, &zero), [0.0; 2]);
    let resting = Motion::new(0.0, *q, zero).with_joint_force(&through);
    let effects = &experiment.effects;
    let viscous = effects.iter().filter(|e| e.index < N).map(|e| {
        let viscosity = e.affine().map_or(0.0, |terms| terms[2]);
        yielding[(e.index, e.index)] * viscosity
    });
    let smooth = SmoothFriction::among(effects, &resting, &[]).map(|friction| {
        let slope = friction.most / friction.smoothing;
        yielding[(friction.joint, friction.joint)] * slope
    });
    // The trace is no less than the largest rate of decay.
    viscous.chain(smooth).sum::<f64>() * STEPS[0] > FOLLOWED
}

/// Longest step at which [`Integrator::Imex`] follows the vibration of the arm on its contact \[s\]: `ωh = 0.3`, where the phase error is 0.2 %
/// without damping.
fn longest_second_order_step<const N: usize>(
    experiment: &Experiment<N>,
    q: &Joints<f64, N>,
) -> f64 {
    /// Ratio of that `ωh` to the stability limit of the fourth-order method.
    const SHARE: f64 = 0.3 / 2.61;
    let setup = experiment.altered();
    let stable = setup.and_then(|setup| longest_step_on_contact(&setup, [q]));
    stable.map_or(f64::INFINITY, |step| SHARE * step)
}
