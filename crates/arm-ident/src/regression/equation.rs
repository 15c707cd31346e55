//! The equation of motion of every sample as rows of a linear regression.
//!
//! One row a joint: `Y π + R(ρ) + C c = τ + Jᵀ F − R_held − rotor`, with inertial parameters π, linear parameters ρ of the
//! fitted effects and small imperfections c of the measurement, each through its first-order influence on the row.
//!
//! Where a joint rests, set-valued dry friction resists with whatever holds it: nothing follows from its row, which is zero there. The equation
//! of every other row is exact, and a low-pass of both sides leaves it so.

use crate::regression::calibration::{Influence, PredictedForce};
use crate::regression::internal_state::InternalStates;
use crate::regression::kinematics::Kinematics;
use crate::regression::rows::RegressionRows;
use crate::regression::trial::{Model, Trial};
use crate::regression::unknown::{Moment, Source, Unknown, spring};
use arm_core::effect::{Effect, Motion, States, resisting_torque};
use arm_core::{Chain, Joints, Pose, inverse_dynamics, joint_force, regressor, static_torque};

/// The rows of a trial, built a stretch after another.
///
/// The measured forces act through the Jacobian of the motion, so that the same filter reaches both sides later.
pub(crate) struct Building<'a, const N: usize> {
    pub(crate) model: &'a Model<N>,
    pub(crate) unknowns: &'a [Unknown],
    /// Which of the unknowns get a column.
    wanted: Vec<bool>,
    /// Whether moments of segments are among them.
    wants_segments: bool,
    pub(crate) trial: &'a Trial<N>,
    pub(crate) motion: &'a Kinematics<N>,
    pub(crate) memory: InternalStates<N>,
    /// Whether the rigid arm has parts that are no unknowns: rotors, or moments of segments that are held.
    has_held_part: bool,
    /// The fitted effects, springs with an unknown rest angle at rest zero.
    pub(crate) regressed: Vec<Effect<f64>>,
    /// Where imperfections of the measurement are among the unknowns.
    pub(crate) prediction: Option<PredictedForce<N>>,
    /// Joints with set-valued dry friction.
    pub(crate) dry: [bool; N],
    /// Samples that are built.
    pub(crate) built: usize,
}

impl<'a, const N: usize> Building<'a, N> {
    /// From the first sample on.
    pub fn new(
        (model, unknowns): (&'a Model<N>, &'a [Unknown]),
        trial: &'a Trial<N>,
        motion: &'a Kinematics<N>,
    ) -> Self {
        Self {
            model,
            unknowns,
            wanted: vec![true; unknowns.len()],
            wants_segments: true,
            trial,
            motion,
            memory: InternalStates::new(model),
            has_held_part: has_held_part(&model.chain, unknowns),
            regressed: regressed(model, unknowns),
            prediction: PredictedForce::of_unknowns(unknowns, model),
            dry: sticking(model),
            built: 0,
        }
    }

    /// With columns of these unknowns only.
    pub fn of_only(mut self, wanted: &[bool]) -> Self {
        let is_segment = |u: &Unknown| matches!(u.source, Source::Segment(..));
        let mut all = self.unknowns.iter().zip(wanted);
        self.wants_segments = all.any(|(u, &wanted)| wanted && is_segment(u));
        self.wanted = wanted.to_vec();
        self
    }

    /// Columns of unknowns.
    pub fn columns(&self) -> usize {
        self.wanted.iter().filter(|&&wanted| wanted).count()
    }

    /// Columns of the rows: those of unknowns and, where some joint sticks, one of [`RegressionRows::held`].
    pub fn width(&self) -> usize {
        self.columns() + usize::from(self.dry.contains(&true))
    }

    /// Whether set-valued friction holds a joint in a sample.
    pub fn rests(&self, sample: usize, joint: usize) -> bool {
        self.dry[joint] && self.motion.qd[sample][joint].abs() <= self.motion.rest[joint]
    }

    /// Takes what resting joints hold out of the right-hand side.
    pub fn take_held(&self, rows: &mut RegressionRows) {
        let Some(held) = rows.columns.get_mut(self.columns()) else {
            return;
        };
        for (k, &i) in rows.samples.iter().enumerate() {
            for j in (0..N).filter(|&j| self.rests(i, j)) {
                held[k * N + j] = core::mem::take(&mut rows.rhs[k * N + j]);
            }
        }
    }

    /// The rows of the next samples.
    pub fn next(&mut self, count: usize) -> RegressionRows {
        let samples = self.built..self.built + count;
        self.built = samples.end;
        let mut rows =
            RegressionRows::of_samples::<N>(self.width(), samples, |rows, k| self.sample(rows, k));
        self.take_held(&mut rows);
        rows
    }

    fn sample(&mut self, rows: &mut RegressionRows, k: usize) {
        let Self {
            model,
            unknowns,
            trial,
            motion,
            ..
        } = *self;
        let i = rows.samples[k];
        let here = k * N..(k + 1) * N;
        let (qd, qdd) = (&motion.qd[i], &motion.qdd[i]);
        let chain = motion.chain_in_moving_frame(&model.chain, i);
        let at = Sample::new(&chain, trial, (&motion.q[i], qd, qdd), i);
        self.memory.advance(&at.motion, 1.0 / trial.rate);
        let memory = &self.memory;
        let predicted = self.prediction.as_mut();
        let predicted = predicted.map(|p| p.next(model, trial, motion));
        let mut influence = predicted
            .map(|force| Influence::at((model, trial, motion), memory, force, (i, &at.pose)));
        let measured = at.measured - resisting_torque(&model.held, &at.motion, &memory.held);
        rows.rhs[here.clone()].copy_from_slice(measured.as_slice());
        let mut inertial = [[Joints::<f64, N>::zeros(); 4]; N];
        if self.has_held_part || self.wants_segments {
            let y = regressor(&chain, &at.pose, qd, qdd);
            inertial = core::array::from_fn(|s| y.segment_columns(&chain, s));
        }
        let wanted = unknowns
            .iter()
            .zip(&self.wanted)
            .filter(|(_, wanted)| **wanted);
        for ((unknown, _), values) in wanted.zip(&mut rows.columns) {
            let column = match unknown.source {
                Source::Segment(s, moment) => inertial[s][position(moment)],
                Source::Effect(e, p) => {
                    gradient(&self.regressed[e], p, &at.motion, memory.fitted[e])
                }
                Source::RestTorque(e, p) => {
                    gradient(&unit(&self.regressed[e]), p, &at.motion, memory.fitted[e])
                }
                Source::Calibration(what) => influence
                    .as_mut()
                    .map_or_else(Joints::zeros, |at| at.of(what)),
            };
            let torques =
                Joints::<f64, N>::from_fn(|j, _| if self.rests(i, j) { 0.0 } else { column[j] });
            values[here.clone()].copy_from_slice(torques.as_slice());
        }
        if self.has_held_part {
            let mut held = inverse_dynamics(&chain, &at.pose, qd, qdd);
            for unknown in unknowns {
                if let Source::Segment(s, moment) = unknown.source {
                    held -= inertial[s][position(moment)] * value_of(&chain, s, moment);
                }
            }
            for (value, held) in rows.rhs[here].iter_mut().zip(&held) {
                *value -= held;
            }
        }
    }
}

fn position(moment: Moment) -> usize {
    match moment {
        Moment::Mass => 0,
        Moment::Along => 1,
        Moment::Normal => 2,
        Moment::Inertia => 3,
    }
}

/// Whether the column of an unknown along a given motion is taken to depend on the estimate: imperfections of the measurement are seen
/// through the force that the model predicts, and some effects through the force in their joint or through states of their own.
pub(crate) fn follows_estimate<const N: usize>(model: &Model<N>, unknown: &Unknown) -> bool {
    match unknown.source {
        Source::Segment(..) => false,
        Source::Calibration(_) => true,
        Source::Effect(e, _) | Source::RestTorque(e, _) => {
            let effect = &model.fitted[e];
            effect.kind.feels_force() || effect.remembers()
        }
    }
}

/// The model's own value of an inertial parameter.
pub fn value_of<const N: usize>(chain: &Chain<f64, N>, segment: usize, moment: Moment) -> f64 {
    let s = &chain.segments()[segment];
    match moment {
        Moment::Mass => s.mass,
        Moment::Along => s.mass * s.com[0],
        Moment::Normal => s.mass * s.com[1],
        Moment::Inertia => s.inertia + s.mass * (s.com[0] * s.com[0] + s.com[1] * s.com[1]),
    }
}

/// Whether an arm has rotors, or moments of segments that are neither unknown nor zero.
fn has_held_part<const N: usize>(chain: &Chain<f64, N>, unknowns: &[Unknown]) -> bool {
    let is_unknown = |s, moment| {
        let source = Source::Segment(s, moment);
        unknowns.iter().any(|u| u.source == source)
    };
    let moments = [Moment::Mass, Moment::Along, Moment::Normal, Moment::Inertia];
    let holds = |s| {
        let held = |&m: &Moment| value_of(chain, s, m) != 0.0 && !is_unknown(s, m);
        moments.iter().any(held)
    };
    (0..N).any(holds) || chain.rotor_inertia().iter().any(|&rotor| rotor != 0.0)
}

/// The joints that set-valued dry friction can hold.
fn sticking<const N: usize>(model: &Model<N>) -> [bool; N] {
    let dry = |j| move |e: &Effect<f64>| e.index == j && e.is_dry();
    core::array::from_fn(|j| model.fitted.iter().chain(&model.held).any(dry(j)))
}

/// The fitted effects in the form of their columns: where amplitude · rest is an unknown, the amplitude acts about zero.
fn regressed<const N: usize>(model: &Model<N>, unknowns: &[Unknown]) -> Vec<Effect<f64>> {
    let mut effects = model.fitted.clone();
    for unknown in unknowns {
        if let Source::RestTorque(e, rest) = unknown.source {
            effects[e].parameters[rest] = 0.0;
        }
    }
    effects
}

/// A spring of unit amplitude.
fn unit(effect: &Effect<f64>) -> Effect<f64> {
    let mut one = *effect;
    if let Some((amplitude, _)) = spring(effect) {
        one.parameters[amplitude] = 1.0;
    }
    one
}

/// The model's own value of a parameter of a fitted effect, or of amplitude · rest of a spring; zero for other unknowns.
pub(crate) fn effect_value<const N: usize>(model: &Model<N>, source: Source) -> f64 {
    match source {
        Source::Effect(e, p) => model.fitted[e].parameters[p],
        Source::RestTorque(e, rest) => {
            let effect = &model.fitted[e];
            spring(effect).map_or(0.0, |(amplitude, _)| {
                effect.parameters[amplitude] * effect.parameters[rest]
            })
        }
        Source::Segment(..) | Source::Calibration(_) => 0.0,
    }
}

/// Derivative of the resisting torques to one parameter of one effect.
pub(crate) fn gradient<const N: usize>(
    effect: &Effect<f64>,
    p: usize,
    motion: &Motion<f64, N>,
    memory: States<f64>,
) -> Joints<f64, N> {
    let mut column = Joints::zeros();
    if effect.index < N {
        let value = effect.gradient(&motion.local(effect.index, memory))[p];
        column[effect.index] = value;
        if effect.index > 0 {
            column[effect.index - 1] = effect.proximal_share() * value;
        }
    }
    column
}

/// One sample: what moves and what was measured.
pub(crate) struct Sample<const N: usize> {
    pub(crate) pose: Pose<f64, N>,
    pub(crate) motion: Motion<f64, N>,
    pub(crate) measured: Joints<f64, N>,
}

impl<const N: usize> Sample<N> {
    pub(crate) fn new(
        chain: &Chain<f64, N>,
        trial: &Trial<N>,
        (q, qd, qdd): (&Joints<f64, N>, &Joints<f64, N>, &Joints<f64, N>),
        i: usize,
    ) -> Self {
        let pose = Pose::new(q);
        let force = trial.force_on_arm.as_ref().map_or([0.0; 2], |f| f[i]);
        let moment = trial.moment_on_arm.as_ref().map_or(0.0, |m| m[i]);
        let torque = trial.torque.as_ref().map_or_else(Joints::zeros, |t| t[i]);
        let joint = joint_force(chain, &pose, (qd, qdd), force);
        let mut seen = trial.motion(i, q, qd).with_joint_force(&joint);
        seen.qdd = *qdd;
        Self {
            pose,
            motion: seen,
            measured: torque + static_torque(chain, &pose, force, moment),
        }
    }
}

#[cfg(test)]
mod tests {
    use arm_core::effect::{KINDS, Place};
    use arm_core::{Contact, Segment, sample_arms};

    use super::*;
    use crate::regression::measured_motion::measured;
    use crate::regression::trial::Tolerance;
    use crate::regression::unknown::unknowns;

    fn trial() -> Trial<2> {
        let course = |i: i32, rate: f64| libm::sin(rate * f64::from(i));
        let q = |i| Joints::from([-1.0 + 0.5 * course(i, 0.03), 0.9 + 0.4 * course(i, 0.05)]);
        Trial {
            force_on_arm: Some((0..200).map(|i| [5.0 * course(i, 0.04), 9.0]).collect()),
            torque: Some((0..200).map(|i| Joints::repeat(course(i, 0.02))).collect()),
            ..Trial::new(100.0, (0..200).map(q).collect())
        }
    }

    /// The mechanical arm with an effect in its elbow. Masses are scaled by `0.5 + part`; linear parameters are `part`, within their bounds.
    fn estimated(kind: arm_core::effect::Kind, part: f64) -> Model<2> {
        let arm = sample_arms::mechanical_arm();
        let segments = arm.segments().map(|s| Segment {
            mass: s.mass * (0.5 + part),
            ..s
        });
        let mut effect = Effect::new(kind, 1);
        for (value, p) in effect.parameters.iter_mut().zip(kind.info().parameters) {
            if p.linear {
                *value = part.clamp(p.min, p.max);
            }
        }
        Model {
            chain: Chain::new(segments, arm.base(), arm.gravity()).unwrap(),
            segment_uncertainty: 0.1,
            fitted: vec![effect],
            held: Vec::new(),
            contact: Contact::new([1e4; 2], [25.0; 2]),
        }
    }

    /// What a later round does not compute again is the same for any estimate, whatever the kind of the effect; and the columns that it
    /// computes again are those of a whole build.
    #[test]
    fn only_columns_that_follow_the_estimate_are_others_for_another_estimate() {
        let (trial, mut renewed) = (trial(), 0);
        let motion = measured(&trial, 5.0).unwrap();
        for &kind in KINDS.iter().filter(|k| k.info().place == Place::Joint) {
            let models = [0.3, 0.7].map(|part| estimated(kind, part));
            let unknowns = unknowns(&models[0], &Tolerance::default(), &[&trial]);
            let of = |model| Building::new((model, &unknowns), &trial, &motion);
            let [one, other] = [0, 1].map(|k| of(&models[k]).next(trial.len()));
            let follow: Vec<bool> = unknowns
                .iter()
                .map(|u| follows_estimate(&models[0], u))
                .collect();
            let fresh = of(&models[1]).of_only(&follow).next(trial.len());
            assert_eq!(fresh.rhs, other.rhs);
            let mut fresh = fresh.columns.iter();
            for (u, follows) in follow.into_iter().enumerate() {
                if follows {
                    assert_eq!(fresh.next(), Some(&other.columns[u]));
                    renewed += usize::from(one.columns[u] != other.columns[u]);
                } else {
                    assert_eq!(
                        one.columns[u], other.columns[u],
                        "{kind:?} {}",
                        unknowns[u].name
                    );
                }
            }
        }
        assert!(renewed > 0);
    }
}
