//! Columns of small imperfections of the measurement in the rows of the regression.
//!
//! Each imperfection is a column: its first-order influence on the left-hand side. The columns are computed from the
//! force that the *model* predicts, never from the measured one: a column that carries the noise of the right-hand side
//! would explain that noise, and gain and parameters would be biased towards zero.

use arm_core::effect::{Effect, Motion, States, resisting_torque};
use arm_core::{
    JointMatrix, Joints, Plane, Pose, Scalar, gravity, inverse_dynamics, jacobian, static_torque,
    torque_by_angle,
};

use crate::regression::internal_state::InternalStates;
use crate::regression::kinematics::Kinematics;
use crate::regression::trial::{Model, Trial};
use crate::regression::unknown::{Imperfection, Source, Unknown};

/// The force on the arm \[N\] that the model predicts for a motion, sample after sample.
///
/// That of the simulation where the motion is simulated. Else least squares of `Jᵀ F = B q̈ + C q̇ + G + R − τ − M` over the two
/// components of the force; in a pose in which a component does no work (a stretched arm) that component is zero. Zero where the arm is
/// not led by a force.
pub(crate) struct PredictedForce<const N: usize> {
    memory: InternalStates<N>,
    near: Nearby,
    /// Samples of which the force is known.
    known: usize,
}

/// The predicted force \[N\] at a sample and at its neighbours; at an end the sample itself replaces the missing one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Nearby {
    before: Plane<f64>,
    here: Plane<f64>,
    after: Plane<f64>,
    /// Intervals from `before` to `after`.
    span: usize,
}

impl<const N: usize> PredictedForce<N> {
    /// Before the first sample; none where no imperfection of the measurement is among the unknowns.
    pub fn of_unknowns(unknowns: &[Unknown], model: &Model<N>) -> Option<Self> {
        let is_calibration = |u: &Unknown| matches!(u.source, Source::Calibration(_));
        unknowns.iter().any(is_calibration).then(|| Self {
            memory: InternalStates::new(model),
            near: Nearby::default(),
            known: 0,
        })
    }

    /// The force about the next sample.
    pub fn next(&mut self, model: &Model<N>, trial: &Trial<N>, motion: &Kinematics<N>) -> Nearby {
        let first = self.known == 0;
        if first {
            self.near.after = self.force(model, trial, motion);
            self.near.here = self.near.after;
        }
        self.near.before = self.near.here;
        self.near.here = self.near.after;
        let last = self.known == trial.len();
        if !last {
            self.near.after = self.force(model, trial, motion);
        }
        self.near.span = (2 - usize::from(first) - usize::from(last)).max(1);
        self.near
    }

    /// The force at the first sample of which it is not known yet.
    fn force(&mut self, model: &Model<N>, trial: &Trial<N>, motion: &Kinematics<N>) -> Plane<f64> {
        let i = self.known;
        self.known += 1;
        if trial.force_on_arm.is_none() {
            return [0.0; 2];
        }
        if let Some(force) = &motion.force {
            return force[i];
        }
        let (q, qd, qdd) = (&motion.q[i], &motion.qd[i], &motion.qdd[i]);
        let pose = Pose::new(q);
        let seen = trial.motion(i, q, qd);
        self.memory.advance(&seen, 1.0 / trial.rate);
        let torque = inverse_dynamics(
            &motion.chain_in_moving_frame(&model.chain, i),
            &pose,
            qd,
            qdd,
        ) + resisting_torque(&model.fitted, &seen, &self.memory.fitted)
            + resisting_torque(&model.held, &seen, &self.memory.held)
            - trial.torque.as_ref().map_or_else(Joints::zeros, |t| t[i])
            - Joints::repeat(trial.moment_on_arm.as_ref().map_or(0.0, |m| m[i]));
        let j = jacobian(&model.chain, &pose);
        let (a, b, c) = (
            j.row(0).dot(&j.row(0)),
            j.row(0).dot(&j.row(1)),
            j.row(1).dot(&j.row(1)),
        );
        let rhs = j * torque;
        // The smaller eigenvalue of J Jᵀ is set off from zero by this share of the larger.
        let damping = 1e-3 * (a + c);
        let (a, c) = (a + damping, c + damping);
        let determinant = a * c - b * b;
        [
            (c * rhs[0] - b * rhs[1]) / determinant,
            (a * rhs[1] - b * rhs[0]) / determinant,
        ]
    }
}

/// What one unit of an imperfection adds to the left-hand side of the rows of one sample \[N m\].
pub(crate) struct Influence<'a, const N: usize> {
    model: &'a Model<N>,
    trial: &'a Trial<N>,
    motion: &'a Kinematics<N>,
    memory: &'a InternalStates<N>,
    /// The predicted force on the arm.
    force: Nearby,
    sample: usize,
    pose: &'a Pose<f64, N>,
    /// Slopes of the left-hand side to the angles, once they are needed.
    slopes: Option<JointMatrix<f64, N>>,
}

impl<'a, const N: usize> Influence<'a, N> {
    /// At a sample, with the pose and the predicted force on the arm there.
    pub fn at(
        (model, trial, motion): (&'a Model<N>, &'a Trial<N>, &'a Kinematics<N>),
        memory: &'a InternalStates<N>,
        force: Nearby,
        (sample, pose): (usize, &'a Pose<f64, N>),
    ) -> Self {
        Self {
            model,
            trial,
            motion,
            memory,
            force,
            sample,
            pose,
            slopes: None,
        }
    }

    /// The influence of one imperfection.
    pub fn of(&mut self, what: Imperfection) -> Joints<f64, N> {
        let (chain, pose) = (&self.model.chain, self.pose);
        let (force, i) = (self.force, self.sample);
        let motion = self.motion;
        match what {
            // The measured angle is the true one plus the offset: the row moves against the offset, and springs of the joints with it.
            Imperfection::AngleOffset(joint) => {
                let slopes = self.slopes.take().unwrap_or_else(|| self.by_angle());
                self.slopes = Some(slopes);
                -slopes.column(joint)
            }
            Imperfection::ForceBias(channel) => {
                let mut unit = [0.0; 2];
                unit[channel] = 1.0;
                static_torque(chain, pose, unit, 0.0)
            }
            Imperfection::ForceGain(channel) => {
                let mut share = [0.0; 2];
                share[channel] = force.here[channel];
                static_torque(chain, pose, share, 0.0)
            }
            Imperfection::TimeDelay => {
                let span = force.span as f64 / self.trial.rate;
                let rate = [0, 1].map(|c| (force.after[c] - force.before[c]) / span);
                -static_torque(chain, pose, rate, 0.0)
            }
            Imperfection::NeglectedInertia => {
                inverse_dynamics(chain, pose, &motion.qd[i], &motion.qdd[i]) - gravity(chain, pose)
            }
            Imperfection::HandlePlacement(axis) => {
                // A displaced handle lengthens the lever of the last segment; the moment acts alike on every joint.
                let angle = motion.q[i].iter().fold(0.0, |sum, q| sum + q);
                let (s, c) = Scalar::sin_cos(angle);
                let direction = if axis == 0 { [c, s] } else { [-s, c] };
                let moment = direction[0] * force.here[1] - direction[1] * force.here[0];
                Joints::repeat(-moment)
            }
        }
    }

    /// Slopes of the left-hand side to the angles, a column for each joint \[N m/rad\].
    fn by_angle(&self) -> JointMatrix<f64, N> {
        let (i, motion) = (self.sample, self.motion);
        let (q, qd, qdd) = (&motion.q[i], &motion.qd[i], &motion.qdd[i]);
        let chain = motion.chain_in_moving_frame(&self.model.chain, i);
        let seen = self.trial.motion(i, q, qd);
        let of = |effects, memory| resistance_by_angle(effects, &seen, memory);
        torque_by_angle(&chain, self.pose, (qd, qdd), self.force.here)
            + of(&self.model.fitted, &self.memory.fitted)
            + of(&self.model.held, &self.memory.held)
    }
}

/// Derivatives of the resisting torques of effects with respect to the angles, a column for each joint \[N m/rad\].
fn resistance_by_angle<const N: usize>(
    effects: &[Effect<f64>],
    motion: &Motion<f64, N>,
    memory: &[States<f64>],
) -> JointMatrix<f64, N> {
    /// Half of the step of the central difference \[rad\]: its square is the error of truncation, rounding over it about 1e-11.
    const STEP: f64 = 1e-5;
    let mut slopes = JointMatrix::<f64, N>::zeros();
    for (k, effect) in effects.iter().enumerate() {
        let own = effect.index;
        if own >= N || effect.kind.is_rate_independent() {
            continue;
        }
        if let Some([_, to_angle, _]) = effect.affine() {
            slopes[(own, own)] += to_angle;
            continue;
        }
        // An effect depends on the angle of its own joint and of the one before.
        for joint in own.saturating_sub(1)..=own {
            let [up, down] = [STEP, -STEP].map(|step| {
                let mut moved = *motion;
                moved.q[joint] += step;
                resisting_torque(&effects[k..=k], &moved, &memory[k..=k])
            });
            let mut column = slopes.column_mut(joint);
            column += (up - down) / (2.0 * STEP);
        }
    }
    slopes
}

#[cfg(test)]
mod tests {
    use arm_core::effect::{ActsOn, KINDS};

    use super::*;

    /// Every kind in every joint of three where it can be, against finite differences of all torques with respect to all angles.
    #[test]
    fn resistance_by_angle_agrees_with_differences_for_every_angle() {
        const STEP: f64 = 1e-4;
        let mut motion = Motion::<f64, 3>::new(
            0.7,
            Joints::<f64, 3>::new(-1.1, 1.9, 0.4),
            Joints::<f64, 3>::new(0.6, -0.8, 0.3),
        );
        motion.activity = [0.2, 0.4, 0.6];
        let memory = [[0.1, 0.2, 0.3]];
        let mut depend = 0;
        for &kind in KINDS.iter().filter(|k| k.acts_on() == ActsOn::Joints) {
            for joint in usize::from(kind.crosses())..3 {
                let mut effect = Effect::new(kind, joint);
                for (value, p) in effect.parameters.iter_mut().zip(kind.info().parameters) {
                    if p.linear {
                        *value = 0.5f64.clamp(p.min, p.max);
                    }
                }
                let effects = [effect];
                let found = resistance_by_angle(&effects, &motion, &memory);
                for angle in 0..3 {
                    let [up, down] = [STEP, -STEP].map(|step| {
                        let mut moved = motion;
                        moved.q[angle] += step;
                        resisting_torque(&effects, &moved, &memory)
                    });
                    let expected = (up - down) / (2.0 * STEP);
                    let off = (found.column(angle) - expected).amax();
                    assert!(
                        off <= 1e-6 * (1.0 + expected.amax()),
                        "{kind:?} in joint {joint}, angle {angle}: {off}"
                    );
                    depend += usize::from(expected.amax() > 0.0);
                }
            }
        }
        assert!(depend > 20, "{depend}");
    }
}
