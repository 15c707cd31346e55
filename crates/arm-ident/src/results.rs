//! The result of an identification, in the terms of files and reports: one type for Rust, Python and JSON.

use std::collections::BTreeSet;
use std::sync::Arc;

use arm_core::effect::{Effect as CoreEffect, Place};
use arm_core::{Chain, Joints};
use arm_model::{Effect, Model, Refused, Segment};
use serde::ser::SerializeStruct;
use serde::{Serialize, Serializer};

use crate::inference::estimate;
pub use crate::inference::estimate::Estimate;
use crate::regression::trial::Role;

/// How a fitted model explains one trial, after the common low-pass.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// Position of each sample that was used in the trial.
    pub samples: Vec<usize>,
    /// Joint torques that follow from the measurement, a row a sample \[N m\].
    pub measured: Vec<Vec<f64>>,
    /// Joint torques of the fitted model \[N m\].
    pub fitted: Vec<Vec<f64>>,
}

impl<const N: usize> From<&estimate::Explained<N>> for Fit {
    fn from(of: &estimate::Explained<N>) -> Self {
        let rows =
            |rows: &[Joints<f64, N>]| rows.iter().map(|r| r.iter().copied().collect()).collect();
        Self {
            samples: of.samples.clone(),
            measured: rows(&of.measured),
            fitted: rows(&of.fitted),
        }
    }
}

/// Values by name, in their order.
pub type Named<T> = indexmap::IndexMap<String, T>;

/// Role and configuration of a trial.
#[derive(Clone, Debug, PartialEq)]
pub struct TrialName {
    /// Whether it is a fit trial or a test trial.
    pub role: Role,
    /// Its movement.
    pub configuration: String,
}

/// The input of an identification, in the terms of the files.
#[derive(Clone, Copy, Debug)]
pub struct IdentificationInput<'a> {
    /// The model as given.
    pub model: &'a Model,
    /// Every effect that was taken into account.
    pub effects: &'a [CoreEffect<f64>],
    /// The trials.
    pub trials: &'a [TrialName],
    /// `joint` or `cascade`.
    pub method: &'a str,
    /// Probability of the intervals.
    pub level: f64,
}

/// The result of an identification.
#[derive(Clone, Debug, PartialEq)]
pub struct Identification {
    /// `joint` or `cascade`.
    pub method: String,
    /// How the solver ended: `solved`, `almost_solved`.
    pub status: String,
    /// How many combinations of the unknowns the data determine.
    pub rank: usize,
    /// Number of unknowns, calibration not counted.
    pub unknowns: usize,
    /// The unknowns and what follows from them.
    pub parameters: Vec<Estimate>,
    /// The base parameters: what any movement of a planar chain can determine at most.
    pub combinations: Vec<Estimate>,
    /// Small imperfections of the measurement that were refitted within the declared tolerance.
    pub calibration: Vec<Estimate>,
    /// Names of the quantities between which `correlations` are: the combinations, then parameters of effects (`coulomb1 torque`).
    pub correlated: Vec<String>,
    /// Correlations of their errors, by rows.
    pub correlations: Vec<Vec<f64>>,
    /// Values of the result that are impossible for this arm and these sensors, in words.
    pub contradictions: Vec<String>,
    /// What the fitted model does not describe well, in words.
    pub misfits: Vec<String>,
    /// What of the model the method does not take into account, in words.
    pub left_out: Vec<String>,
    /// Which unknowns the movements cannot distinguish, in words.
    pub trades: Vec<String>,
    /// Whether all parameters are known up to one common factor only: no torque acted.
    pub scale_free: bool,
    /// Probability of the intervals.
    pub level: f64,
    /// Cutoff of the zero-phase low-pass that motion and torque share \[Hz\].
    pub cutoff: f64,
    /// Root mean square of the torque residual after the low-pass by role and channel \[N m\].
    pub residual_rms: Named<Named<f64>>,
    /// The same by role, configuration and channel.
    pub residual_rms_by_configuration: Named<Named<Named<f64>>>,
    /// By how many standard deviations the inertia that the cascade neglects moves each first moment.
    pub neglected_inertia: Vec<f64>,
    /// Noise of each joint's speed relative to the speed itself; zero where the motion was simulated.
    pub speed_noise: Vec<f64>,
    /// Why the motion was measured where it was to be simulated if that could be done.
    pub not_simulated: Option<String>,
    /// Joints, from 1, whose dry friction is set-valued in `model` though the smooth law was given: they stick.
    pub sticks: Vec<usize>,
    /// The model with the estimates.
    pub model: Model,
    /// How each trial is explained.
    pub explained: Vec<Arc<Fit>>,
}

impl Identification {
    /// What was identified, in the terms of the files.
    ///
    /// # Errors
    /// [`Refused`] where an estimate is none that a model may have.
    pub fn of<const N: usize>(
        result: &estimate::Identified<N>,
        input: &IdentificationInput<'_>,
    ) -> Result<Self, Refused> {
        let not_simulated = result.not_simulated.as_ref();
        let trials: Vec<_> = result.explained.iter().zip(input.trials).collect();
        Ok(Self {
            method: input.method.to_owned(),
            status: result.status.name().to_owned(),
            rank: result.rank,
            unknowns: result.unknowns,
            parameters: result.parameters.clone(),
            combinations: result.combinations.clone(),
            calibration: result.calibration.clone(),
            correlated: result.correlated.clone(),
            correlations: result.correlations.clone(),
            contradictions: Vec::new(),
            misfits: Vec::new(),
            left_out: Vec::new(),
            trades: result.trades.clone(),
            scale_free: result.scale_free,
            level: input.level,
            cutoff: result.cutoff,
            residual_rms: by_role(&trials),
            residual_rms_by_configuration: by_configuration(&trials),
            neglected_inertia: result.neglected_inertia.clone(),
            speed_noise: result.speed_noise.clone(),
            not_simulated: not_simulated.map(ToString::to_string),
            sticks: sticking_anew(&result.fitted, input.effects),
            model: identified_model(&result.chain, &result.fitted, input)?,
            explained: result
                .explained
                .iter()
                .map(|e| Arc::new(e.into()))
                .collect(),
        })
    }
}

type Fitted<'a, const N: usize> = (&'a estimate::Explained<N>, &'a TrialName);

/// Root mean square residual by role and channel, of the roles that there are.
fn by_role<const N: usize>(trials: &[Fitted<'_, N>]) -> Named<Named<f64>> {
    let role = |(role, name): (Role, &str)| {
        let own = trials.iter().filter(|(_, trial)| trial.role == role);
        let rows = own.flat_map(|(fit, _)| fit.measured.iter().zip(&fit.fitted));
        let (mut sum, mut n) = ([0.0; N], 0);
        for (measured, fitted) in rows {
            for j in 0..N {
                sum[j] += (measured[j] - fitted[j]) * (measured[j] - fitted[j]);
            }
            n += 1;
        }
        let channel = |(j, sum)| (format!("tau{}_Nm", j + 1), libm::sqrt(sum / f64::from(n)));
        (n > 0).then(|| {
            (
                name.to_owned(),
                sum.into_iter().enumerate().map(channel).collect(),
            )
        })
    };
    let roles = [(Role::Fit, "fit"), (Role::Test, "test")];
    roles.into_iter().filter_map(role).collect()
}

/// The same by role, configuration and channel.
fn by_configuration<const N: usize>(trials: &[Fitted<'_, N>]) -> Named<Named<Named<f64>>> {
    let mut configurations: Named<Vec<Fitted<'_, N>>> = Named::new();
    for trial in trials {
        let own = configurations.entry(trial.1.configuration.clone());
        own.or_default().push(*trial);
    }
    let mut all: Named<Named<Named<f64>>> = Named::new();
    for (configuration, own) in configurations {
        for (role, channels) in by_role(&own) {
            let listed = all.entry(role).or_default();
            listed.insert(configuration.clone(), channels);
        }
    }
    all
}

/// Joints, from 1, with a fitted effect that is set-valued and was given as smooth.
fn sticking_anew(fitted: &[CoreEffect<f64>], given: &[CoreEffect<f64>]) -> Vec<usize> {
    let was_smooth = |one: &CoreEffect<f64>| {
        let mut same = given.iter();
        same.any(|e| (e.kind, e.index) == (one.kind, one.index) && !e.is_dry())
    };
    let anew = fitted.iter().filter(|e| e.is_dry() && was_smooth(e));
    let joints: BTreeSet<usize> = anew.map(|e| e.index + 1).collect();
    joints.into_iter().collect()
}

/// An inertia below this part of mass · length² is a difference of equal numbers.
const ROUNDING: f64 = 1e-12;

/// The model with estimates; effects that its joints state stay there, the others become effects.
fn identified_model<const N: usize>(
    chain: &Chain<f64, N>,
    fitted: &[CoreEffect<f64>],
    input: &IdentificationInput<'_>,
) -> Result<Model, Refused> {
    let model = input.model;
    let fitted: Vec<Effect> = fitted.iter().map(Effect::from_core).collect();
    // Effects of segments and of the hand are contained in the segments now.
    let held = input.effects.iter().filter(|e| {
        let place = e.kind.info().place;
        !matches!(place, Place::Joint | Place::Segment | Place::Hand)
    });
    let held: Vec<Effect> = held.map(Effect::from_core).collect();
    let segments = model.segments.iter().zip(chain.segments());
    let segments = segments.map(|(old, s)| {
        let scale = s.mass * (s.length * s.length);
        Segment {
            name: old.name.clone(),
            length: s.length,
            mass: s.mass,
            com: s.com[0].clamp(0.0, s.length),
            inertia: if s.inertia.abs() > ROUNDING * scale {
                s.inertia
            } else {
                0.0
            },
            com_normal: s.com[1],
        }
    });
    let segments = segments.collect();
    let changed = model.change(|parts| parts.segments = segments)?;
    changed.with_joint_effects(&fitted, &held)
}

/// The file beside `identified.json` that has the model.
const MODEL_FILE: &str = "identified.toml";

impl Serialize for Identification {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let warnings = [&self.contradictions[..], &self.misfits, &self.left_out].concat();
        let mut out = to.serialize_struct("Identification", 18)?;
        out.serialize_field("method", &self.method)?;
        out.serialize_field("status", &self.status)?;
        out.serialize_field("rank", &self.rank)?;
        out.serialize_field("unknowns", &self.unknowns)?;
        out.serialize_field("parameters", &self.parameters)?;
        out.serialize_field("combinations", &self.combinations)?;
        out.serialize_field("calibration", &self.calibration)?;
        out.serialize_field("correlated", &self.correlated)?;
        out.serialize_field("correlations", &self.correlations)?;
        out.serialize_field("warnings", &warnings)?;
        out.serialize_field("not_separable", &self.trades)?;
        out.serialize_field("scale_free", &self.scale_free)?;
        out.serialize_field("level", &self.level)?;
        out.serialize_field("cutoff_Hz", &self.cutoff)?;
        out.serialize_field("sticks", &self.sticks)?;
        out.serialize_field("residual_rms", &self.residual_rms)?;
        let by_configuration = &self.residual_rms_by_configuration;
        out.serialize_field("residual_rms_by_configuration", by_configuration)?;
        out.serialize_field("model", MODEL_FILE)?;
        out.end()
    }
}

#[cfg(test)]
mod tests {
    use arm_numerics::least_squares::program::Status;

    use super::*;

    /// Once it was the lower-cased name of a variant, `almostsolved`.
    #[test]
    fn a_status_is_written_in_words() {
        assert_eq!(Status::Solved.name(), "solved");
        assert_eq!(Status::AlmostSolved.name(), "almost_solved");
    }

    fn explained(rows: &[f64]) -> estimate::Explained<1> {
        estimate::Explained {
            samples: (0..rows.len()).collect(),
            measured: rows.iter().map(|&v| Joints::from([v])).collect(),
            fitted: rows.iter().map(|_| Joints::from([0.0])).collect(),
        }
    }

    /// Residuals of 3 and 4 N m in one trial to fit, 1 N m in the other, and none where no sample was used.
    #[test]
    fn residuals_are_listed_by_role_and_movement() {
        let name = |role, configuration: &str| TrialName {
            role,
            configuration: configuration.to_owned(),
        };
        let fits = [explained(&[3.0, 4.0]), explained(&[1.0]), explained(&[])];
        let names = [
            name(Role::Fit, "slow"),
            name(Role::Fit, "fast"),
            name(Role::Test, "slow"),
        ];
        let trials: Vec<_> = fits.iter().zip(&names).collect();
        let all = by_role(&trials);
        assert_eq!(all.keys().collect::<Vec<_>>(), ["fit"]);
        assert_eq!(all["fit"]["tau1_Nm"], libm::sqrt(26.0 / 3.0));
        let each = &by_configuration(&trials)["fit"];
        assert_eq!(each.keys().collect::<Vec<_>>(), ["slow", "fast"]);
        assert_eq!(each["slow"]["tau1_Nm"], libm::sqrt(12.5));
    }
}
