//! The input of a search: the model as given, the trials, and the tolerances of the calibration.

use arm_core::effect::{Effect, KINDS, Kind, Place, Promise};
use arm_core::{Chain, Contact, Setup};
use arm_ident::regression::trial::{Role, Tolerance, Trial};
use arm_sim::{SimulationError, altered};

use crate::GapError;
use crate::data::passive_law::Passive;
use crate::hypothesis::{Coordinate, Hypothesis, Target};

/// A data set, the input of the workflow.
#[derive(Clone, Debug)]
pub struct Session<const N: usize> {
    /// The rigid arm of the model.
    pub chain: Chain<f64, N>,
    /// Contact between hand and handle.
    pub contact: Contact<f64>,
    /// Effects that the model has.
    pub effects: Vec<Effect<f64>>,
    /// Relative standard deviation of masses, centres of mass and inertias; 0 holds them.
    pub segment_uncertainty: f64,
    /// Tolerances of the calibration.
    pub tolerance: Tolerance,
    /// The trials.
    pub trials: Vec<Trial<N>>,
    /// What is compared.
    pub comparison: ComparisonMode,
    /// Weights of the samples of each trial, one where there is no entry: less where the motion of the robot between its samples is
    /// unknown, by the ratio of the scatter of repeats to that plus the error of the robot's path.
    pub weights: Vec<f64>,
    /// User-defined kinds that are tested besides those of the catalogue.
    pub own: Vec<Kind>,
    /// Laws of joints that the model leaves without one; see [`crate::data::identified_base`].
    pub base: Vec<Passive>,
    /// Relative changes of the segments from which calibration starts.
    pub start: [[f64; 3]; N],
}

/// What is compared with the data.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ComparisonMode {
    /// Angles and forces of the closed chain, simulated along the robot's own path.
    Led,
    /// Joint torques, from inverse dynamics of the measured motion.
    Torque,
}

/// Standard deviations beyond which nothing that is known is refitted: what is further off is a fault, and has a name.
pub(crate) const FURTHEST: f64 = 4.0;
/// Relative standard deviation of the effects in the model, and of the compliance of its contact.
const KNOWN: f64 = 0.05;
/// Relative standard deviation of the damping of the contact in the model.
const DAMPED: f64 = 0.3;

impl<const N: usize> Session<N> {
    /// The rig as a hypothesis has it, with all effects applied that alter it.
    ///
    /// # Errors
    /// [`SimulationError`] for segments that cannot be, or an effect with a value or a place outside what its kind allows.
    pub fn rig(&self, hypothesis: &Hypothesis<N>) -> Result<Setup<f64, N>, SimulationError> {
        let setup = hypothesis.setup(&self.chain, self.contact)?;
        altered(&setup, &hypothesis.effects())
    }

    /// All kinds that are tested.
    pub fn kinds(&self) -> impl Iterator<Item = Kind> + '_ {
        KINDS.iter().chain(&self.own).copied()
    }

    /// Number of channels.
    pub fn channels(&self) -> usize {
        match self.comparison {
            ComparisonMode::Led => N + 2,
            ComparisonMode::Torque => N,
        }
    }

    /// Whether torques are compared that a contact alone exerts, whose force a sensor reads in every trial.
    pub fn compares_contact_torques(&self) -> bool {
        let mut trials = self.trials.iter();
        self.comparison == ComparisonMode::Torque
            && trials.all(|t| t.force_on_arm.is_some() && t.torque.is_none())
    }

    /// Whether what a sensor reads of a contact is compared, as a force or as the torques of one.
    pub fn reads_contact(&self) -> bool {
        self.comparison == ComparisonMode::Led || self.compares_contact_torques()
    }

    /// Trials on which things are chosen and fitted.
    pub fn fit_trials(&self) -> Vec<usize> {
        (0..self.trials.len())
            .filter(|&i| self.trials[i].role == Role::Fit)
            .collect()
    }

    /// The model as given.
    pub fn given(&self) -> Hypothesis<N> {
        let mut calibration = Vec::new();
        for &kind in KINDS {
            let Some(promise) = kind.prior().promise else {
                continue;
            };
            if !self.reads_contact() && promise != Promise::AngleOffset {
                continue;
            }
            let places = match kind.info().place {
                Place::AngleSensor => N,
                Place::ForceSensor => 2,
                _ => 1,
            };
            calibration.extend((0..places).map(|index| Effect::new(kind, index)));
        }
        Hypothesis {
            segments: [[0.0; 3]; N],
            contact: [[0.0; 2]; 2],
            shift: [0.0; 2],
            placement: [0.0; 2],
            eccentricity: [[0.0; 2]; N],
            known: self.known(),
            calibration,
            named: Vec::new(),
        }
    }

    /// The model as given, with its base and the segments that measured motion suggests.
    pub fn starting(&self) -> Hypothesis<N> {
        Hypothesis {
            segments: self.start,
            ..self.given()
        }
    }

    /// The effects of the model, then those of its passive base.
    fn known(&self) -> Vec<Effect<f64>> {
        let base = self.base.iter().map(|passive| passive.effect);
        self.effects.iter().copied().chain(base).collect()
    }

    fn promised(&self, promise: Promise) -> f64 {
        match promise {
            Promise::AngleOffset => self.tolerance.angle_offset(),
            Promise::ForceBias => self.tolerance.force_bias,
            Promise::ForceGain => self.tolerance.force_gain,
            Promise::TimeDelay => self.tolerance.time_delay,
        }
    }

    /// What is refitted with every question because it was never exact: segments, known effects, calibration.
    pub fn nuisances(&self) -> Vec<Coordinate> {
        let given = self.given();
        let mut list = Vec::new();
        let mut add = |target, sd: f64, lower: f64, upper: f64| {
            if sd > 0.0 {
                let value = given.get(target);
                list.push(Coordinate {
                    target,
                    prior: Some((value, sd)),
                    lower: f64::max(lower, value - FURTHEST * sd),
                    upper: f64::min(upper, value + FURTHEST * sd),
                    step: 0.25 * sd,
                });
            }
        };
        for k in 0..N {
            for part in 0..3 {
                // Where no torque acts, everything is known up to one common factor: the first segment's mass sets it.
                if k == 0 && part == 0 && self.swings_freely() {
                    continue;
                }
                add(
                    Target::Segment(k, part),
                    self.segment_uncertainty,
                    -0.9,
                    9.0,
                );
            }
        }
        for (e, effect) in self.effects.iter().enumerate() {
            for (p, parameter) in effect.kind.info().parameters.iter().enumerate() {
                let value = effect.parameters[p];
                if parameter.linear && value != 0.0 {
                    let target = Target::Known(e, p);
                    add(target, KNOWN * value.abs(), parameter.min, parameter.max);
                }
            }
        }
        for (e, effect) in given.calibration.iter().enumerate() {
            if let Some(promise) = effect.kind.prior().promise {
                let sd = self.promised(promise);
                add(Target::Calibration(e), sd, f64::NEG_INFINITY, f64::INFINITY);
            }
        }
        if self.comparison == ComparisonMode::Torque {
            let sd = self.tolerance.angle_offset();
            for (j, part) in (0..N).flat_map(|j| [(j, 0), (j, 1)]) {
                let target = Target::Eccentricity(j, part);
                add(target, sd, f64::NEG_INFINITY, f64::INFINITY);
            }
        }
        if self.comparison == ComparisonMode::Led {
            let sd = self.tolerance.handle_placement;
            for axis in 0..2 {
                add(Target::Contact(0, axis), KNOWN, -0.3, 0.5);
                // A contact that damps much more cannot be stepped through.
                add(Target::Contact(1, axis), DAMPED, -0.9, 0.5);
                add(Target::Shift(axis), sd, f64::NEG_INFINITY, f64::INFINITY);
            }
        }
        list.extend(self.coordinates_of_base());
        list
    }

    fn coordinates_of_base(&self) -> Vec<Coordinate> {
        let mut list = Vec::new();
        for (b, passive) in self.base.iter().enumerate() {
            for own in &passive.free {
                let parameter = &passive.effect.kind.info().parameters[own.parameter];
                list.push(Coordinate {
                    target: Target::Known(self.effects.len() + b, own.parameter),
                    prior: Some((own.mean, own.sd)),
                    lower: parameter.min.max(own.lower),
                    upper: parameter.max,
                    step: own.step,
                });
            }
        }
        list
    }

    /// Whether no torque acts in any trial.
    pub fn swings_freely(&self) -> bool {
        self.trials.iter().all(Trial::is_unloaded)
    }

    /// What differs from one trial to the next: where the hand holds the handle, and where the handle is in the room.
    pub fn by_trial(&self) -> Vec<Coordinate> {
        let sd = self.tolerance.handle_placement;
        let placed = |target| Coordinate {
            target,
            prior: Some((0.0, sd)),
            lower: f64::NEG_INFINITY,
            upper: f64::INFINITY,
            step: 0.25 * sd,
        };
        if sd <= 0.0 || !self.reads_contact() {
            return Vec::new();
        }
        let mut list = [0, 1].map(|axis| placed(Target::Placement(axis))).to_vec();
        if self.comparison == ComparisonMode::Led {
            list.extend([0, 1].map(|axis| placed(Target::Shift(axis))));
        }
        list
    }

    /// Refuses what no comparison can be made of.
    ///
    /// # Errors
    /// [`GapError::Data`].
    pub fn check(&self) -> Result<(), GapError> {
        let refuse = |what, found: String, allowed| {
            Err(GapError::Data {
                what,
                found,
                allowed,
            })
        };
        if self.fit_trials().is_empty() {
            return refuse("trials to fit", "none".into(), "at least one");
        }
        for trial in &self.trials {
            let missing = match self.comparison {
                ComparisonMode::Led => trial.handle.is_none() || trial.force_on_arm.is_none(),
                ComparisonMode::Torque => trial.torque.is_none() && trial.force_on_arm.is_none(),
            };
            if missing {
                return refuse(
                    "channels",
                    "a trial without them".into(),
                    "the same channels in every trial",
                );
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::course::tests::resting;

    #[test]
    fn the_force_of_a_led_arm_is_read_whether_or_not_torques_were_recorded_beside_it() {
        let mut session = resting(100.0);
        let properties = |session: &Session<2>| {
            let torques = session.compares_contact_torques();
            (
                session.reads_contact(),
                torques,
                session.given().calibration.len(),
                session.by_trial().len(),
            )
        };
        let led = properties(&session);
        assert!(led.0 && !led.1);
        session.comparison = ComparisonMode::Torque;
        // Of a contact alone the same sensors are read; where the robot's base stands is no question.
        assert_eq!(properties(&session), (true, true, led.2, led.3 - 2));
        session.trials[0].torque = Some(vec![arm_core::Joints::zeros(); 200]);
        // Angle sensors alone.
        assert_eq!(properties(&session), (false, false, 2, 0));
        session.comparison = ComparisonMode::Led;
        assert_eq!(properties(&session), led);
    }

    #[test]
    fn what_was_never_exact_is_free_within_four_standard_deviations() {
        let mut session = resting(100.0);
        session.effects = vec![Effect::new(Kind::Viscous, 0).with(&[0.5])];
        let all = session.nuisances();
        let of = |target| {
            let found = all.iter().find(|c| c.target == target).expect("free");
            (found.prior.expect("known").1, found.lower, found.upper)
        };
        let near = |(sd, lower, upper): (f64, f64, f64), expected: [f64; 3]| {
            std::iter::zip([sd, lower, upper], expected).all(|(a, b)| (a - b).abs() < 1e-12)
        };
        // Segments are known to 2 % in this session, effects of the model and the stiffness of the contact to 5 %.
        assert!(near(of(Target::Segment(0, 1)), [0.02, -0.08, 0.08]));
        assert!(near(of(Target::Known(0, 0)), [0.025, 0.4, 0.6]));
        assert!(near(of(Target::Contact(0, 0)), [0.05, -0.2, 0.2]));
        // The damping of the contact to 30 %, and a contact that damps half as much again cannot be stepped through.
        assert!(near(of(Target::Contact(1, 0)), [0.3, -0.9, 0.5]));
    }
}
