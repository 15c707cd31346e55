//! Quasi-static rows of a trial.

use super::unknowns::{is_dissipative, is_found};
use crate::error::IdentError;
use crate::regression::calibration::{Influence, PredictedForce};
use crate::regression::equation::gradient;
use crate::regression::internal_state::InternalStates;
use crate::regression::kinematics::Kinematics;
use crate::regression::measured_motion::{low_pass, slowest, speed, speed_noise};
use crate::regression::preprocessing::{Pieces, filtered};
use crate::regression::rows::RegressionRows;
use crate::regression::trial::{Model, Trial};
use crate::regression::unknown::{Imperfection, Moment, Source, Unknown};
use arm_core::effect::{MAX_STATES, Motion, resisting_torque};
use arm_core::{Joints, Pose, gravity, joint_force, regressor, static_torque};
use arm_numerics::signal::derivative::{first, second};

/// Direction is read from angles below this frequency \[Hz\]: a quasi-static movement has nothing above.
pub(super) const DIRECTION_CUTOFF: f64 = 1.0;

/// Periods of the direction's cutoff next to rest or a turn that do not count as motion: the filter moves a start forward by no more,
/// and its ringing beside a movement has one sign for less than twice as long.
pub(super) const TURN: f64 = 0.5;

/// Quasi-static rows of a trial, a stretch after another: gravity and the static contact torque, inertia left out.
pub(super) struct Building<'a, const N: usize> {
    pub(super) model: &'a Model<N>,
    pub(super) unknowns: &'a [Unknown],
    pub(super) trial: &'a Trial<N>,
    /// Angles, without speeds and accelerations.
    pub(super) still: Kinematics<N>,
    /// The same with speeds and accelerations, for the inertia that is neglected.
    pub(super) moving: Kinematics<N>,
    /// Speeds from which the direction of motion is computed.
    pub(super) speed: Vec<Joints<f64, N>>,
    /// Where each joint moves.
    pub(super) moves: [Vec<bool>; N],
    /// What is not found, held at its values.
    pub(super) kept: Model<N>,
    pub(super) memory: InternalStates<N>,
    /// Where imperfections of the measurement are among the unknowns.
    pub(super) prediction: Option<PredictedForce<N>>,
    /// Samples that are built.
    pub(super) built: usize,
}

impl<'a, const N: usize> Building<'a, N> {
    pub(super) fn new(
        (model, unknowns): (&'a Model<N>, &'a [Unknown]),
        trial: &'a Trial<N>,
        cutoff: f64,
    ) -> Result<Self, IdentError> {
        let (q, speed, moves) = motion(trial, cutoff)?;
        let rest = vec![Joints::zeros(); trial.len()];
        let kept = Model {
            fitted: Vec::new(),
            held: model
                .fitted
                .iter()
                .filter(|e| !is_found(e))
                .chain(&model.held)
                .copied()
                .collect(),
            ..model.clone()
        };
        Ok(Self {
            model,
            unknowns,
            trial,
            still: Kinematics {
                q,
                qd: rest.clone(),
                qdd: rest,
                base: None,
                rest: [0.0; N],
                force: None,
            },
            moving: moving_at(trial, cutoff)?,
            speed,
            moves,
            memory: InternalStates::new(&kept),
            prediction: PredictedForce::of_unknowns(unknowns, &kept),
            kept,
            built: 0,
        })
    }

    /// The rows of the trial, filtered and thinned, and which of them are fitted.
    pub(super) fn filtered(mut self, cutoff: f64) -> Result<Pieces, IdentError> {
        let count = self.unknowns.len();
        let mut pieces = filtered(self.trial, cutoff, count, |count| self.next(count))?;
        if let Some(has) = has_friction(self.model) {
            let moves = &self.moves;
            for rows in &mut pieces {
                let fits = |&i: &usize| (0..N).map(move |j| !has[j] || moves[j][i]);
                rows.fits = Some(rows.samples.iter().flat_map(fits).collect());
            }
        }
        Ok(pieces)
    }

    /// The rows of the next samples.
    pub(super) fn next(&mut self, count: usize) -> RegressionRows {
        let samples = self.built..self.built + count;
        self.built = samples.end;
        RegressionRows::of_samples::<N>(self.unknowns.len(), samples, |rows, k| {
            self.sample(rows, k)
        })
    }

    pub(super) fn sample(&mut self, rows: &mut RegressionRows, k: usize) {
        let Self { model, trial, .. } = *self;
        let (kept, still) = (&self.kept, &self.still);
        let rest = Joints::<f64, N>::zeros();
        let i = rows.samples[k];
        let here = k * N..(k + 1) * N;
        let q = still.q[i];
        let pose = Pose::new(&q);
        let force = trial.force_on_arm.as_ref().map_or([0.0; 2], |f| f[i]);
        let joint = joint_force(&model.chain, &pose, (&rest, &rest), force);
        let at = Motion::new(i as f64 / trial.rate, q, self.speed[i]).with_joint_force(&joint);
        self.memory.advance(&at, 1.0 / trial.rate);
        let memory = &self.memory;
        let predicted = self.prediction.as_mut();
        let predicted = predicted.map(|p| p.next(kept, trial, still));
        let along = |motion| {
            predicted.map(|force| Influence::at((kept, trial, motion), memory, force, (i, &pose)))
        };
        // Both have the same angles.
        let (mut at_rest, mut in_motion) = (along(still), along(&self.moving));
        let moment = trial.moment_on_arm.as_ref().map_or(0.0, |m| m[i]);
        let mut measured = static_torque(&model.chain, &pose, force, moment)
            - resisting_torque(&kept.held, &at, &memory.held);
        if let Some(torque) = &trial.torque {
            measured += torque[i];
        }
        let y = regressor(&model.chain, &pose, &rest, &rest);
        let mut held = gravity(&model.chain, &pose);
        for (column, unknown) in rows.columns.iter_mut().zip(self.unknowns) {
            let value = match unknown.source {
                Source::Segment(k, moment) => {
                    let [mass, along, ..] = y.segment_columns(&model.chain, k);
                    let value = if moment == Moment::Mass { mass } else { along };
                    held -= value * unknown.mean;
                    value
                }
                Source::Effect(e, p) | Source::RestTorque(e, p) => {
                    gradient(&model.fitted[e], p, &at, [0.0; MAX_STATES])
                }
                Source::Calibration(what) => {
                    let influence = match what {
                        Imperfection::NeglectedInertia => &mut in_motion,
                        _ => &mut at_rest,
                    };
                    influence
                        .as_mut()
                        .map_or_else(Joints::zeros, |at| at.of(what))
                }
            };
            column[here.clone()].copy_from_slice(value.as_slice());
        }
        rows.rhs[here].copy_from_slice((measured - held).as_slice());
    }
}

/// The joints whose dry friction is found; none if there is no such joint.
pub(super) fn has_friction<const N: usize>(model: &Model<N>) -> Option<[bool; N]> {
    let found = |j| {
        let mut effects = model.fitted.iter();
        effects.any(|e| is_dissipative(e) && e.index == j)
    };
    let has = core::array::from_fn(found);
    has.contains(&true).then_some(has)
}

/// Angles at the common cutoff, speeds, and for every joint where it moves.
#[expect(clippy::type_complexity, reason = "three series")]
pub(super) fn motion<const N: usize>(
    trial: &Trial<N>,
    cutoff: f64,
) -> Result<(Vec<Joints<f64, N>>, Vec<Joints<f64, N>>, [Vec<bool>; N]), IdentError> {
    let slow_cutoff = DIRECTION_CUTOFF.min(cutoff);
    let (filter, slow) = (
        low_pass(cutoff, trial.rate)?,
        low_pass(slow_cutoff, trial.rate)?,
    );
    let noise = speed_noise(trial, slow_cutoff);
    let mut q = vec![Joints::zeros(); trial.len()];
    let mut speeds = q.clone();
    let mut moves = core::array::from_fn(|_| Vec::new());
    let turn = libm::ceil(TURN * trial.rate / slow_cutoff) as usize;
    for j in 0..N {
        let raw: Vec<f64> = trial.q.iter().map(|q| q[j]).collect();
        let smooth = filter.both_ways(&raw)?;
        let qd = speed(trial, j, &slow)?;
        for i in 0..trial.len() {
            q[i][j] = smooth[i];
            speeds[i][j] = qd[i];
        }
        moves[j] = moving(&qd, slowest(noise[j]), turn);
    }
    Ok((q, speeds, moves))
}

/// Where a joint moves one way: at least so fast, and for that many samples before and after.
///
/// The ends of the series are no turns.
pub(super) fn moving(speed: &[f64], least: f64, turn: usize) -> Vec<bool> {
    let way = |v: &f64| i8::from(*v >= least) - i8::from(*v <= -least);
    let mut moves = vec![false; speed.len()];
    let mut start = 0;
    for stretch in speed.chunk_by(|a, b| way(a) == way(b)) {
        let end = start + stretch.len();
        let from = if start == 0 { 0 } else { start + turn };
        let to = if end == speed.len() {
            end
        } else {
            end.saturating_sub(turn)
        };
        if way(&stretch[0]) != 0 && from < to {
            moves[from..to].fill(true);
        }
        start = end;
    }
    moves
}

/// Angles, speeds and accelerations at the common cutoff.
fn moving_at<const N: usize>(trial: &Trial<N>, cutoff: f64) -> Result<Kinematics<N>, IdentError> {
    let filter = low_pass(cutoff, trial.rate)?;
    let mut motion = Kinematics {
        q: vec![Joints::zeros(); trial.len()],
        qd: vec![Joints::zeros(); trial.len()],
        qdd: vec![Joints::zeros(); trial.len()],
        base: None,
        rest: [0.0; N],
        force: None,
    };
    for j in 0..N {
        let angles: Vec<f64> = trial.q.iter().map(|q| q[j]).collect();
        let smooth = filter.both_ways(&angles)?;
        let step = 1.0 / trial.rate;
        let (speed, acceleration) = (first(&smooth, step)?, second(&smooth, step)?);
        for i in 0..trial.len() {
            motion.q[i][j] = smooth[i];
            motion.qd[i][j] = speed[i];
            motion.qdd[i][j] = acceleration[i];
        }
    }
    Ok(motion)
}
