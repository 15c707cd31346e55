//! A trial prepared for comparison: its channels in the common band, and what drives its simulation.

use arm_core::effect::Effect;
use arm_core::{Joints, Plane, Pose, static_torque};
use arm_ident::regression::kinematics::Kinematics;
use arm_ident::regression::measured_motion::{
    candidates_of_measured, is_quiet, low_pass, measured, relative_speed_noise,
};
use arm_ident::regression::trial::Trial;
use arm_sim::{HandlePath, Series, SimulationError};

use crate::GapError;
use crate::data::contact_readings::ContactReadings;
use crate::data::handle_path::{handle_path, path_noise};
use crate::data::session::{ComparisonMode, Session};
use crate::hypothesis::Hypothesis;

/// Channels of one trial, each with one value a sample; angles first, then forces on the arm, or joint torques.
pub type Channels = Vec<Vec<f64>>;

/// Bandwidth in which channels are compared \[Hz\], the thesis' own.
///
/// Torques as well: an inverse dynamics of encoder angles that is low-passed as a whole is the equation of motion tested against smooth
/// functions, so that what two differentiations add above the band drops out.
pub(crate) const BAND: f64 = 5.0;
/// Samples at the start whose mean is the position at rest.
const START: usize = 5;
/// Time at the start over which forces are averaged \[s\].
const START_TIME: f64 = 0.2;

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
    pub(crate) times: Vec<f64>,
    pub(crate) handle: Vec<Plane<f64>>,
    /// How far the base is from its place \[m\], where its path was measured and drives a simulation.
    pub(crate) base: Option<Series<2>>,
    /// Rhythms of muscles that are in the run of the trial, not in what is compared with it.
    pub(crate) rhythms: Vec<Effect<f64>>,
    /// Angles and force on the arm that are measured at the start.
    pub(crate) start: Joints<f64, N>,
    pub(crate) start_force: Plane<f64>,
    pub(crate) motion: Option<Kinematics<N>>,
    /// By joint and sample, where dry friction holds a joint of a measured motion: it resists with whatever the measured torque is.
    /// Nothing is listed where nothing is held.
    pub(crate) at_rest: Vec<Vec<bool>>,
    /// What the sensors read of hand and contact, where torques are compared that the contact exerts.
    pub(crate) contact: Option<ContactReadings<N>>,
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

    /// Samples without those at which friction holds a joint of a measured motion, where enough is left: nothing says what its torque is there.
    pub(crate) fn in_motion(&self, joint: usize, counted: Vec<bool>) -> Vec<bool> {
        /// Shortest time that is enough \[s\].
        const ENOUGH: f64 = 1.0;
        let Some(rests) = self.at_rest.get(joint) else {
            return counted;
        };
        let each = std::iter::zip(&counted, rests);
        let moving: Vec<bool> = each.map(|(counted, rests)| *counted && !rests).collect();
        match moving.iter().filter(|m| **m).count() as f64 >= ENOUGH * self.rate {
            true => moving,
            false => counted,
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

    /// Angles \[rad\] and force on the arm \[N\] that are measured at the start of a trial.
    fn measured_at_start(trial: &Trial<N>) -> (Joints<f64, N>, Plane<f64>) {
        let first = trial.valid.iter().position(|v| *v).unwrap_or(0);
        let span = first..(first + START).min(trial.len());
        let count = span.len() as f64;
        let start = span.map(|i| trial.q[i]).sum::<Joints<f64, N>>() / count;
        let resting =
            first..(first + START.max((START_TIME * trial.rate) as usize)).min(trial.len());
        let start_force = trial.force_on_arm.as_ref().map_or([0.0; 2], |force| {
            let count = resting.len() as f64;
            [0, 1].map(|a| force[resting.clone()].iter().map(|f| f[a]).sum::<f64>() / count)
        });
        (start, start_force)
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

/// Channels less channels, over the samples that both have.
pub fn difference(a: &Channels, b: &Channels) -> Channels {
    let one = |(a, b): (&Vec<f64>, &Vec<f64>)| std::iter::zip(a, b).map(|(a, b)| a - b).collect();
    std::iter::zip(a, b).map(one).collect()
}

/// Each value of channels divided by a size.
pub(crate) fn divided(mut channels: Channels, size: f64) -> Channels {
    for value in channels.iter_mut().flatten() {
        *value /= size;
    }
    channels
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
