//! Where a led arm starts: at rest, with the dry friction that the measured force tells.

use arm_core::effect::{Effect, Kind, Motion, dry_friction, resisting_besides_dry};
use arm_core::{
    Joints, Placement, Plane, Pose, Reading, inverse_dynamics, joint_force, static_torque,
};
use arm_ident::regression::trial::Trial;
use arm_sim::{Experiment, SimulationError, Start, simulate};

use crate::data::session::Session;
use crate::measurement_model::hypothesis::Hypothesis;
use crate::measurement_model::prediction::Course;

/// Samples at the start whose mean tells where the arm was at rest.
const START: usize = 5;
/// Time at the start over which forces are averaged \[s\].
const START_TIME: f64 = 0.2;

impl<const N: usize> Session<N> {
    /// Angles \[rad\] and force on the arm \[N\] that are measured at the start of a trial.
    pub(super) fn measured_at_start(trial: &Trial<N>) -> (Joints<f64, N>, Plane<f64>) {
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

    /// What dry friction resists with at the start, where the handle places a joint \[N m\].
    ///
    /// A joint at rest is held by any torque up to what it resists with in motion, and the force on a resting arm shows which. What the
    /// handle leaves free stays where it is measured instead: see [`held_at_start`].
    ///
    /// # Errors
    /// [`SimulationError`] for a rig that cannot be.
    pub fn friction_at_start(
        &self,
        hypothesis: &Hypothesis<N>,
        course: &Course<N>,
    ) -> Result<Joints<f64, N>, SimulationError> {
        let effects = hypothesis.effects();
        let zero = Joints::zeros();
        if !effects.iter().any(is_set_valued_friction) {
            return Ok(zero);
        }
        let setup = self.rig(hypothesis)?;
        let chain = setup.chain()?;
        let measured = Reading::<f64, N> {
            time: 0.0,
            q: course.start,
            force_on_arm: course.start_force,
            moment_on_arm: 0.0,
        };
        let mut distorted = measured;
        for effect in &effects {
            effect.distort(&mut distorted);
        }
        let force = [0, 1].map(|a| 2.0 * measured.force_on_arm[a] - distorted.force_on_arm[a]);
        let q = measured.q * 2.0 - distorted.q;
        let pose = Pose::new(&q);
        let moment = Placement::of(&setup).map_or(0.0, |p| p.moment(&pose, force));
        let through = joint_force(&chain, &pose, (&zero, &zero), force);
        let motion = Motion::new(0.0, q, zero).with_joint_force(&through);
        let most = Joints::from(dry_friction(&effects, &motion, &[]));
        let held = held_at_start(&most);
        let needed = static_torque(&chain, &pose, force, moment)
            - inverse_dynamics(&chain, &pose, &zero, &zero)
            - resisting_besides_dry(&effects, &motion, &[]);
        Ok(Joints::from_fn(|j, _| match held[j] {
            true => 0.0,
            false => needed[j].clamp(-most[j], most[j]),
        }))
    }

    /// The start of a run: in equilibrium near the measured angles.
    ///
    /// # Errors
    /// As [`simulate`].
    pub(crate) fn start(
        &self,
        hypothesis: &Hypothesis<N>,
        course: &Course<N>,
        experiment: &Experiment<N>,
    ) -> Result<Start<N>, SimulationError> {
        let near = course.start(hypothesis);
        let friction = self.friction_at_start(hypothesis, course)?;
        if friction.iter().all(|&torque| torque == 0.0) {
            return Ok(Start::Equilibrium { near });
        }
        let mut resting = experiment.clone();
        resting.start = Start::Equilibrium { near };
        resting.duration = resting.dt;
        resting.output_interval = None;
        for effect in resting
            .effects
            .iter_mut()
            .filter(|e| is_set_valued_friction(e))
        {
            if friction[effect.index] != 0.0 {
                effect.parameters[0] = 0.0;
            }
        }
        let holding = (0..N).map(|j| Effect::new(Kind::ConstantMoment, j).with(&[friction[j]]));
        resting.effects.extend(holding);
        let begun = simulate(&resting)?;
        Ok(Start::Given {
            q: Joints::from_column_slice(&begun.q[..N]),
            qd: Joints::from_column_slice(&begun.qd[..N]),
        })
    }
}

/// Whether an effect is set-valued dry friction that acts.
pub(crate) fn is_set_valued_friction(effect: &Effect<f64>) -> bool {
    effect.on && effect.is_dry() && effect.parameters[0] > 0.0
}

/// The joints that dry friction holds where a run starts: what the handle leaves free, the last ones first.
pub(crate) fn held_at_start<const N: usize>(friction: &Joints<f64, N>) -> [bool; N] {
    let mut held = [false; N];
    let dry = (0..N).rev().filter(|&j| friction[j] > 0.0);
    dry.take(N.saturating_sub(2)).for_each(|j| held[j] = true);
    held
}
