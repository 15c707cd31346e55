//! Predicted readings of the channels along a trial under a hypothesis.

use arm_core::effect::{Effect, Motion, Place, resisting_besides_dry};
use arm_core::{Joints, Plane, Pose, inverse_dynamics, joint_force, static_torque};
use arm_ident::regression::kinematics::Kinematics;
use arm_ident::regression::measured_motion::{
    candidates_of_measured, is_quiet, low_pass, measured, relative_speed_noise,
};
use arm_ident::regression::trial::Trial;
use arm_sim::{
    Coupling, Drive, Experiment, HandlePath, Recording, Sensors, Series, SimulationError, Start,
    simulate,
};

use crate::GapError;
use crate::data::session::{ComparisonMode, Session};
use crate::measurement_model::contact_readings::ContactReadings;
use crate::measurement_model::handle_path::{handle_path, path_noise};
use crate::measurement_model::hypothesis::{Hypothesis, Target};

/// Channels of one trial, each with one value a sample; angles first, then forces on the arm, or joint torques.
pub type Channels = Vec<Vec<f64>>;

/// Bandwidth in which channels are compared \[Hz\], the thesis' own.
///
/// Torques as well: an inverse dynamics of encoder angles that is low-passed as a whole is the equation of motion tested against smooth
/// functions, so that what two differentiations add above the band drops out.
pub(crate) const BAND: f64 = 5.0;
/// Steps that are tried, longest first \[s\]; the last one is taken even where dry friction would like it shorter.
pub(crate) const STEPS: [f64; 4] = [2e-3, 1e-3, 5e-4, 2.5e-4];
/// Least rate at which a run is recorded that sensors read \[Hz\]: what a delayed sensor reads lies between samples, where few of them
/// would take a fifth of an arm's ringing on its contact.
const RECORDED: f64 = 250.0;

/// A trial made ready: what was measured in the common band, and what drives the simulation.
#[derive(Clone, Debug)]
pub struct Course<const N: usize> {
    /// Measured channels as they are.
    pub raw: Channels,
    /// Measured channels after the low-pass.
    pub seen: Channels,
    /// Sampling rate \[Hz\].
    pub rate: f64,
    /// Cutoff of the low-pass \[Hz\].
    pub band: f64,
    /// Samples over which a gap is measured: those that were measured. Where torques are compared, those `MARGIN` away from ends
    /// and gaps, next to which filters and differences extrapolate.
    pub counted: Vec<bool>,
    /// What its samples weigh. Where that is less than one, forces are compared in the common band only: above it they hang on what the
    /// robot did between its samples.
    pub weight: f64,
    pub(super) times: Vec<f64>,
    pub(super) handle: Vec<Plane<f64>>,
    /// How far the base is from its place \[m\], where its path was measured and drives a simulation.
    pub(crate) base: Option<Series<2>>,
    /// Rhythms of muscles that are in the run of the trial, not in what is compared with it.
    pub(crate) rhythms: Vec<Effect<f64>>,
    /// Angles and force on the arm that are measured at the start.
    pub(crate) start: Joints<f64, N>,
    pub(crate) start_force: Plane<f64>,
    pub(super) motion: Option<Kinematics<N>>,
    /// By joint and sample, where dry friction holds a joint of a measured motion: it resists with whatever the measured torque is.
    /// Nothing is listed where nothing is held.
    pub(crate) at_rest: Vec<Vec<bool>>,
    /// What the sensors read of hand and contact, where torques are compared that the contact exerts.
    pub(super) contact: Option<ContactReadings<N>>,
}

impl<const N: usize> Course<N> {
    /// The path of the handle under a hypothesis: its base may be shifted.
    ///
    /// # Errors
    /// As [`HandlePath::through_points`].
    pub fn handle_path(
        &self,
        hypothesis: &Hypothesis<N>,
    ) -> Result<HandlePath<N>, SimulationError> {
        let shift = hypothesis.shift;
        let points: Vec<Plane<f64>> = self
            .handle
            .iter()
            .map(|p| [p[0] + shift[0], p[1] + shift[1]])
            .collect();
        HandlePath::through_points(&self.times, &points)
    }

    /// Where the movement goes: the handle of a led arm \[m\], else the joints \[rad\].
    pub fn path(&self) -> Vec<Vec<f64>> {
        match &self.motion {
            None => self.handle.iter().map(|p| p.to_vec()).collect(),
            Some(motion) => motion
                .q
                .iter()
                .map(|q| q.iter().copied().collect())
                .collect(),
        }
    }

    /// Whether torques are compared that a contact exerts.
    pub fn has_contact_readings(&self) -> bool {
        self.contact.is_some()
    }

    /// The measured joint motion, where torques are compared.
    pub fn motion(&self) -> Option<&Kinematics<N>> {
        self.motion.as_ref()
    }
}

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
    /// Makes a trial ready.
    ///
    /// # Errors
    /// [`GapError::Numerics`] for a trial too short for the filters.
    pub fn course(&self, number: usize) -> Result<Course<N>, GapError> {
        let trial = &self.trials[number];
        let band = self.band(trial.rate)?;
        let raw = self.measured(trial);
        let seen = smooth(&raw, band, trial.rate)?;
        let handle = match &trial.handle {
            Some(points) if self.comparison == ComparisonMode::Led => {
                let paths = self.trials.iter();
                let noise = path_noise(paths.filter_map(|t| Some((t.handle.as_deref()?, t.rate))))?;
                let forces = raw.split_at(raw.len() - 2).1;
                handle_path(
                    points,
                    (noise, forces, self.contact.stiffness),
                    band,
                    trial.rate,
                )?
            }
            _ => Vec::new(),
        };
        let times: Vec<f64> = (0..trial.len()).map(|i| i as f64 / trial.rate).collect();
        let base = self.base_path(number, &times)?;
        let (start, start_force) = Self::measured_at_start(trial);
        let motion = match self.comparison {
            ComparisonMode::Led => None,
            ComparisonMode::Torque => Some(motion(trial, band)?),
        };
        let contact = self.contact_readings(number, &times)?;
        let margin = match self.comparison {
            ComparisonMode::Led => 0,
            ComparisonMode::Torque => margin(trial.rate, band),
        };
        Ok(Course {
            raw,
            seen,
            rate: trial.rate,
            band,
            counted: away_from_gaps(&trial.valid, margin),
            weight: self.weights.get(number).copied().unwrap_or(1.0),
            times,
            handle,
            base,
            rhythms: Vec::new(),
            start,
            start_force,
            motion,
            at_rest: Vec::new(),
            contact,
        })
    }

    /// Cutoff in which channels of a sampling rate are compared \[Hz\]: lower where torques of a contact are compared in a motion that is
    /// known with noise, as of cameras.
    ///
    /// # Errors
    /// [`GapError::Numerics`] for a trial too short for the filters.
    fn band(&self, rate: f64) -> Result<f64, GapError> {
        let band = BAND.min(0.2 * rate);
        if !self.compares_contact_torques() {
            return Ok(band);
        }
        let trials: Vec<&Trial<N>> = self.trials.iter().collect();
        Ok(band.min(candidates_of_measured(&trials)?[0]))
    }

    fn measured(&self, trial: &Trial<N>) -> Channels {
        let joint = |j: usize| trial.q.iter().map(|q| q[j]).collect::<Vec<_>>();
        match self.comparison {
            ComparisonMode::Led => {
                let force = |c: usize| {
                    let forces = trial.force_on_arm.iter().flatten();
                    forces.map(|f| f[c]).collect::<Vec<_>>()
                };
                (0..N).map(joint).chain((0..2).map(force)).collect()
            }
            ComparisonMode::Torque => {
                let torque: Vec<Joints<f64, N>> = (0..trial.len())
                    .map(|i| {
                        let motors = trial.torque.as_ref().map_or_else(Joints::zeros, |t| t[i]);
                        let force = trial.force_on_arm.as_ref().map_or([0.0; 2], |f| f[i]);
                        let moment = trial.moment_on_arm.as_ref().map_or(0.0, |m| m[i]);
                        motors + static_torque(&self.chain, &Pose::new(&trial.q[i]), force, moment)
                    })
                    .collect();
                (0..N)
                    .map(|j| torque.iter().map(|t| t[j]).collect())
                    .collect()
            }
        }
    }

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
        let limit = friction_limit(&experiment, &near);
        let mut last = None;
        for (i, step) in STEPS.into_iter().enumerate() {
            if step > limit && i + 1 < STEPS.len() {
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

/// Periods of the cutoff that are dropped next to an end or a gap.
const MARGIN: f64 = 1.5;

/// Samples next to an end or a gap that are no measurement any more once filters have passed.
pub fn margin(rate: f64, band: f64) -> usize {
    ((MARGIN * rate / band) as usize).max(1)
}

/// Samples that are at least so many away from ends and gaps.
pub fn away_from_gaps(valid: &[bool], margin: usize) -> Vec<bool> {
    let n = valid.len();
    // How many samples without a gap end at each.
    let mut run = 0;
    let mut behind: Vec<usize> = Vec::with_capacity(n);
    for &v in valid {
        run = if v { run + 1 } else { 0 };
        behind.push(run);
    }
    (0..n)
        .map(|i| i >= margin && i + margin < n && behind[i + margin] > 2 * margin)
        .collect()
}

/// Motion of the joints from measured angles, and from measured speeds only where the angles are too noisy for it.
///
/// A controller's speed is the derivative of its angles behind an unknown filter. Its delay counteracts viscous
/// friction: 0.8 ms take all damping away from a pendulum of 0.3 m that rings for a minute.
fn motion<const N: usize>(trial: &Trial<N>, band: f64) -> Result<Kinematics<N>, GapError> {
    let mut angles = trial.clone();
    angles.speed = None;
    let quiet = is_quiet(&relative_speed_noise(&[&angles], band)?);
    Ok(measured(if quiet { &angles } else { trial }, band)?)
}

/// Low-passes every channel without phase.
///
/// # Errors
/// [`GapError::Numerics`] for channels too short for the filter or not finite.
pub fn smooth(channels: &[Vec<f64>], band: f64, rate: f64) -> Result<Channels, GapError> {
    Ok(low_pass(band, rate)?.both_ways_all(channels)?)
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

/// Channels less channels, over the samples that both have.
pub fn difference(a: &Channels, b: &Channels) -> Channels {
    let one = |(a, b): (&Vec<f64>, &Vec<f64>)| std::iter::zip(a, b).map(|(a, b)| a - b).collect();
    std::iter::zip(a, b).map(one).collect()
}

/// Longest step with which steep resistance does not rattle \[s\]: one time constant of its slope at rest on the inertia of its
/// joint. Set-valued dry friction is solved, whatever the step.
fn friction_limit<const N: usize>(experiment: &Experiment<N>, q: &Joints<f64, N>) -> f64 {
    /// Speed at which the slope at rest is taken \[rad/s\]: a thousandth of the default smoothing of dry laws, 0.01 rad/s.
    const SPEED: f64 = 1e-5;
    let Ok(setup) = experiment.altered() else {
        return f64::INFINITY;
    };
    let Ok(chain) = setup.chain() else {
        return f64::INFINITY;
    };
    let pose = Pose::new(q);
    let zero = Joints::<f64, N>::zeros();
    let weight = inverse_dynamics(&chain, &pose, &zero, &zero);
    let through = joint_force(&chain, &pose, (&zero, &zero), [0.0; 2]);
    let mut limit = f64::INFINITY;
    for j in 0..N {
        let resisting = |speed: f64| {
            let mut qd = zero;
            qd[j] = speed;
            let motion = Motion::new(0.0, *q, qd).with_joint_force(&through);
            resisting_besides_dry(&experiment.effects, &motion, &[])[j]
        };
        let slope = (resisting(SPEED) - resisting(-SPEED)) / (2.0 * SPEED);
        let mut unit = zero;
        unit[j] = 1.0;
        let inertia = (inverse_dynamics(&chain, &pose, &zero, &unit) - weight)[j];
        if slope > 0.0 {
            limit = f64::min(limit, inertia / slope);
        }
    }
    limit
}

#[cfg(test)]
pub(crate) mod tests {
    use arm_core::{Chain, Contact, sample_arms};
    use arm_ident::regression::trial::Tolerance;

    use super::*;

    /// A trial at rest of which a handle that shakes at 20 Hz is recorded.
    pub(crate) fn resting(rate: f64) -> Session<2> {
        let at = |i: usize| i as f64 / rate;
        let handle = |i| [0.6, 1e-3 * libm::sin(core::f64::consts::TAU * 20.0 * at(i))];
        let trial = Trial {
            handle: Some((0..200).map(handle).collect()),
            force_on_arm: Some(vec![[0.0; 2]; 200]),
            ..Trial::new(rate, vec![Joints::zeros(); 200])
        };
        of_one(sample_arms::mechanical_arm(), trial)
    }

    /// A session of one trial that an arm is led through.
    pub(crate) fn of_one<const N: usize>(chain: Chain<f64, N>, trial: Trial<N>) -> Session<N> {
        Session {
            chain,
            contact: Contact::new([1e4; 2], [25.0; 2]),
            effects: Vec::new(),
            segment_uncertainty: 0.02,
            tolerance: Tolerance::default(),
            trials: vec![trial],
            comparison: ComparisonMode::Led,
            weights: Vec::new(),
            own: Vec::new(),
            base: Vec::new(),
            start: [[0.0; 3]; N],
        }
    }

    #[test]
    fn an_arm_starts_at_the_mean_of_five_samples_and_of_a_fifth_of_a_second_of_force() {
        let starts = |sample: usize| {
            let mut session = resting(100.0);
            session.trials[0].q[sample][0] = 1.0;
            let force = session.trials[0].force_on_arm.as_mut().expect("forces");
            force[sample][1] = 1.0;
            let course = session.course(0).expect("a course");
            (course.start[0], course.start_force[1])
        };
        let shares = [
            (0.2, 0.05),
            (0.2, 0.05),
            (0.0, 0.05),
            (0.0, 0.05),
            (0.0, 0.0),
        ];
        assert_eq!([0, 4, 5, 19, 20].map(starts), shares);
    }

    /// Four times 5 Hz is the cutoff of the filter, at which it leaves half of the power.
    #[test]
    fn the_path_of_the_handle_keeps_what_is_within_four_bands_of_the_comparison() {
        let course = resting(200.0).course(0).expect("a course");
        // Ten whole periods.
        let middle = course.handle[50..150].iter().map(|p| p[1] * p[1]);
        let power = middle.sum::<f64>() / 100.0;
        assert!((power / 0.5e-6 - 0.5).abs() < 0.01, "{power}");
    }

    /// At 50 Hz the band of the path is 0.4 of the rate.
    #[test]
    fn a_path_of_few_samples_is_not_rounded() {
        let session = resting(50.0);
        let recorded = session.trials[0].handle.as_ref().expect("a path");
        assert_eq!(&session.course(0).expect("a course").handle, recorded);
        assert_ne!(
            resting(60.0).course(0).expect("a course").handle,
            resting(60.0).trials[0].handle.clone().expect("a path")
        );
    }
}
