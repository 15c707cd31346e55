//! How small imperfections of the measurement show in the rows of the regression.
//!
//! Each imperfection is a column: its first-order influence on the left-hand side. The columns are computed from the
//! force that the *model* predicts, never from the measured one: a column that carries the noise of the right-hand side
//! would explain that noise, and the fit would buy it with a wrong gain and parameters shrunk to match.

use arm_core::effect::{Motion, resisting_torque};
use arm_core::{Joints, Plane, Pose, Scalar, inverse_dynamics, jacobian, static_torque};

use crate::equation::{Kinematics, Memory};
use crate::trial::{Model, Trial};
use crate::unknown::Imperfection;

/// The force on the arm \[N\] at every sample that the model predicts for a motion.
///
/// Least squares of `Jᵀ F = B q̈ + C q̇ + G + R − τ − M` over the two components of the force; in a pose in which a component
/// does no work (a stretched arm) that component is zero. Zero where the arm is not led by a force.
pub fn predicted_force<const N: usize>(
    model: &Model<N>,
    trial: &Trial<N>,
    motion: &Kinematics<N>,
) -> Vec<Plane<f64>> {
    if trial.force_on_arm.is_none() {
        return vec![[0.0; 2]; trial.len()];
    }
    let mut memory = Memory::new(model);
    (0..trial.len())
        .map(|i| {
            let (q, qd, qdd) = (&motion.q[i], &motion.qd[i], &motion.qdd[i]);
            let pose = Pose::new(q);
            let seen = Motion::new(i as f64 / trial.rate, *q, *qd);
            memory.advance(&seen, 1.0 / trial.rate);
            let torque = inverse_dynamics(&model.chain, &pose, qd, qdd)
                + resisting_torque(&model.fitted, &seen, &memory.fitted)
                + resisting_torque(&model.held, &seen, &memory.held)
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
        })
        .collect()
}

/// What one unit of an imperfection adds to the left-hand side of a sample's rows \[N m\].
pub(crate) fn influence<const N: usize>(
    model: &Model<N>,
    trial: &Trial<N>,
    motion: &Kinematics<N>,
    (force, memory, i): (&[Plane<f64>], &Memory, usize),
    what: Imperfection,
) -> Joints<f64, N> {
    let pose = Pose::new(&motion.q[i]);
    match what {
        Imperfection::AngleOffset(joint) => {
            let time = i as f64 / trial.rate;
            angle_offset(model, motion, (force[i], memory, i, time), joint)
        }
        Imperfection::ForceBias(channel) => {
            let mut unit = [0.0; 2];
            unit[channel] = 1.0;
            static_torque(&model.chain, &pose, unit, 0.0)
        }
        Imperfection::ForceGain(channel) => {
            let mut share = [0.0; 2];
            share[channel] = force[i][channel];
            static_torque(&model.chain, &pose, share, 0.0)
        }
        Imperfection::TimeDelay => {
            let (before, after) = (i.saturating_sub(1), (i + 1).min(force.len() - 1));
            let span = (after - before).max(1) as f64 / trial.rate;
            let rate = [0, 1].map(|c| (force[after][c] - force[before][c]) / span);
            -static_torque(&model.chain, &pose, rate, 0.0)
        }
        Imperfection::HandlePlacement(axis) => {
            // A displaced handle lengthens the lever of the last segment; every joint feels the same moment.
            let angle = motion.q[i].iter().fold(0.0, |sum, q| sum + q);
            let (s, c) = Scalar::sin_cos(angle);
            let direction = if axis == 0 { [c, s] } else { [-s, c] };
            let moment = direction[0] * force[i][1] - direction[1] * force[i][0];
            Joints::repeat(-moment)
        }
    }
}

/// The measured angle is the true one plus the offset: the row moves against the offset, and springs of the joints with it.
fn angle_offset<const N: usize>(
    model: &Model<N>,
    motion: &Kinematics<N>,
    (force, memory, i, time): (Plane<f64>, &Memory, usize, f64),
    joint: usize,
) -> Joints<f64, N> {
    const STEP: f64 = 1e-5;
    let row = |shift: f64| {
        let mut q = motion.q[i];
        q[joint] += shift;
        let (pose, moving) = (Pose::new(&q), Motion::new(time, q, motion.qd[i]));
        inverse_dynamics(&model.chain, &pose, &motion.qd[i], &motion.qdd[i])
            + resisting_torque(&model.fitted, &moving, &memory.fitted)
            + resisting_torque(&model.held, &moving, &memory.held)
            - static_torque(&model.chain, &pose, force, 0.0)
    };
    (row(-STEP) - row(STEP)) / (2.0 * STEP)
}
