//! Sensitivity of the torques to an unknown that changes the motion of the arm.
//!
//! A robot that leads the hand does not hold every joint: where the arm has more joints than the handle has directions, what it
//! does between shoulder and handle depends on its own springs, friction and inertia. Torques computed along a simulated motion
//! then follow an unknown twice, directly and through the motion. The second part comes from the equation of motion linearised
//! along the run, `M q̈ + D q̇ + (K + Jᵀ S J) q = −Y`.

use arm_core::effect::{Effect, resisting_torque};
use arm_core::{Joints, Plane, Pose, inertia, inverse_dynamics, jacobian, static_torque};
use arm_sim::{Change, Recording, Slopes, Springs, cubic_weights};
use nalgebra::SMatrix;

use crate::regression::equation::Building;
use crate::regression::internal_state::InternalStates;
use crate::regression::kinematics::Kinematics;
use crate::regression::trial::{Model, Trial};
use crate::regression::unknown::{Source, Unknown};

/// Joints that a handle holds; what is left of their freedom is the give of the contact, which is none to speak of.
pub(crate) const HELD: usize = 2;
/// Samples a second that follow the arm's own vibrations between the samples of a trial \[Hz\].
const FINE: f64 = 200.0;
/// The model from which a fit starts: what the robot does not hold is damped so far that its own vibrations die out as fast as the rows end.
///
/// A joint with unknown damping oscillates in a simulation with a wrong decay and phase; a fit that is
/// linearised along such a run ends at a viscosity of zero once in ten times. Along a smooth run it finds back from ten times too much.
pub(crate) fn damped<const N: usize>(model: &Model<N>, cutoff: f64) -> Model<N> {
    let stretched = inertia(&model.chain, &Pose::new(&Joints::zeros()));
    let mut start = model.clone();
    for effect in &mut start.fitted {
        if is_viscous(effect) && (HELD..N).contains(&effect.index) {
            let enough = stretched[(effect.index, effect.index)] * core::f64::consts::TAU * cutoff;
            let most = effect.kind.info().parameters[0].max;
            effect.parameters[0] = effect.parameters[0].max(enough).min(most);
        }
    }
    start
}

/// Whether its torque is proportional to the speed.
fn is_viscous(effect: &Effect<f64>) -> bool {
    let slopes = effect.with(&[1.0]).affine();
    slopes.is_some_and(|[constant, angle, speed]| constant == 0.0 && angle == 0.0 && speed > 0.0)
}

/// Steps for each sample of a trial.
pub(crate) fn parts(rate: f64) -> usize {
    libm::ceil(FINE / rate).max(1.0) as usize
}

/// A simulated run, more finely sampled than the trial that it belongs to.
#[derive(Clone, Debug)]
pub(crate) struct Course<const N: usize> {
    /// What moved, as a trial without noise.
    fine: Trial<N>,
    motion: Kinematics<N>,
    parts: usize,
    /// What helped the joints to move as measured.
    pub assistance: Option<Springs<N>>,
}

impl<const N: usize> Course<N> {
    /// From a recording with `parts` samples for each of a trial at `rate` \[Hz\].
    pub fn new(recording: &Recording<N>, rate: f64, parts: usize) -> Self {
        let joints = |values: &[f64]| -> Vec<Joints<f64, N>> {
            values
                .chunks_exact(N)
                .map(Joints::from_column_slice)
                .collect()
        };
        let force = recording.force_on_arm.chunks_exact(2);
        let motion = Kinematics {
            q: joints(&recording.q),
            qd: joints(&recording.qd),
            qdd: joints(&recording.qdd),
            base: None,
            rest: [0.0; N],
            force: None,
        };
        let fine = Trial {
            force_on_arm: Some(force.map(|f| [f[0], f[1]]).collect()),
            ..Trial::new(rate * parts as f64, motion.q.clone())
        };
        Self {
            fine,
            motion,
            parts,
            assistance: None,
        }
    }

    /// The motion at the samples of the trial.
    pub fn at_samples(&self) -> Kinematics<N> {
        let pick = |values: &[Joints<f64, N>]| values.iter().step_by(self.parts).copied().collect();
        Kinematics {
            q: pick(&self.motion.q),
            qd: pick(&self.motion.qd),
            qdd: pick(&self.motion.qdd),
            base: None,
            rest: [0.0; N],
            force: Some(self.force_at_samples()),
        }
    }

    /// The angles at the samples of the trial.
    pub fn angles_at_samples(&self) -> impl Iterator<Item = &Joints<f64, N>> {
        self.motion.q.iter().step_by(self.parts)
    }

    /// The force on the arm at the samples of the trial \[N\].
    pub fn force_at_samples(&self) -> Vec<Plane<f64>> {
        let force = self.fine.force_on_arm.iter().flatten();
        force.step_by(self.parts).copied().collect()
    }

    /// What a delay of the force channels \[s\] takes from the force that they read at a sample of the trial \[N\]; before the first
    /// sample and after the last the force holds.
    pub fn change_by_delay(&self, delay: f64, sample: usize) -> Plane<f64> {
        let force = self.fine.force_on_arm.as_deref().unwrap_or_default();
        let last = force.len() as f64 - 1.0;
        let i = sample * self.parts;
        let place = (i as f64 - delay * self.fine.rate).clamp(0.0, last);
        let first = place.floor().clamp(1.0, (last - 2.0).max(1.0)) - 1.0;
        let weights = cubic_weights(place - first);
        let then = |axis: usize| -> f64 {
            let near = force[first as usize..].iter().zip(weights);
            near.map(|(f, w)| w * f[axis]).sum()
        };
        [0, 1].map(|axis| then(axis) - force[i][axis])
    }

    /// What the unknowns of the arm change, from the first sample on.
    pub fn responses<'a>(
        &'a self,
        model: &'a Model<N>,
        unknowns: &'a [Unknown],
    ) -> Responses<'a, N> {
        let count = unknowns
            .iter()
            .take_while(|u| !matches!(u.source, Source::Calibration(_)))
            .count();
        Responses {
            course: self,
            model,
            direct: Building::new((model, &unknowns[..count]), &self.fine, &self.motion),
            memory: InternalStates::new(model),
            moved: vec![Change::default(); count],
            done: 0,
        }
    }
}

/// What one unit of each unknown of the arm adds to the torques through speeds and accelerations, a stretch after another.
pub(crate) struct Responses<'a, const N: usize> {
    course: &'a Course<N>,
    model: &'a Model<N>,
    /// What each adds directly.
    direct: Building<'a, N>,
    memory: InternalStates<N>,
    /// What one unit of each has changed of the motion.
    moved: Vec<Change<N>>,
    /// Samples of the course that are behind.
    done: usize,
}

impl<const N: usize> Responses<'_, N> {
    /// Columns like those of [`Building`] for the next samples of the trial, none for the calibration.
    pub fn next(&mut self, count: usize) -> Vec<Vec<f64>> {
        let Course { fine, parts, .. } = self.course;
        let from = self.done;
        let to = (from + count * parts).min(fine.len());
        let direct = self.direct.next(to - from);
        let mut out = vec![Vec::with_capacity(count * N); self.moved.len()];
        for i in from..to {
            let (slopes, own_damping, inverse) = self.slopes(i);
            let push = (i - from) * N..(i - from + 1) * N;
            for ((moved, y), out) in self.moved.iter_mut().zip(&direct.columns).zip(&mut out) {
                let push = -Joints::from_column_slice(&y[push.clone()]);
                match i {
                    0 => moved.q = inverse * push,
                    _ => moved.advance(&slopes, &inverse, &push, 1.0 / fine.rate),
                }
                if i % parts == 0 {
                    let torque = slopes.mass * moved.qdd + own_damping * moved.qd;
                    let rests = |j: usize| self.direct.rests(i, j);
                    out.extend((0..N).map(|j| if rests(j) { 0.0 } else { torque[j] }));
                }
            }
        }
        self.done = to;
        out
    }

    /// The slopes at the next sample of the course, the damping of the arm without the contact, whose force is measured, and the inverse of
    /// what multiplies new accelerations.
    fn slopes(&mut self, i: usize) -> (Slopes<N>, SMatrix<f64, N, N>, SMatrix<f64, N, N>) {
        let Course { fine, motion, .. } = self.course;
        let model = self.model;
        let force = fine.force_on_arm.as_ref().map_or([0.0; 2], |f| f[i]);
        let (q, qd, qdd) = (motion.q[i], motion.qd[i], motion.qdd[i]);
        let moving = |q: &_, qd: &_| fine.motion(i, q, qd);
        self.memory.advance(&moving(&q, &qd), 1.0 / fine.rate);
        let memory = &self.memory;
        let left = |q: &_, qd: &_, qdd: &Joints<f64, N>| {
            let (pose, motion) = (Pose::new(q), moving(q, qd));
            inverse_dynamics(&model.chain, &pose, qd, qdd)
                + resisting_torque(&model.fitted, &motion, &memory.fitted)
                + resisting_torque(&model.held, &motion, &memory.held)
                - static_torque(&model.chain, &pose, force, 0.0)
        };
        let here = left(&q, &qd, &qdd);
        let own = Slopes::around([q, qd, qdd], &here, |q, qd, qdd| {
            (left(q, qd, qdd), [0.0; 2])
        });
        let jacobian = jacobian(&model.chain, &Pose::new(&q));
        let through = |gain: Plane<f64>| {
            let mut scaled = jacobian;
            for (axis, gain) in gain.into_iter().enumerate() {
                scaled.row_mut(axis).scale_mut(gain);
            }
            jacobian.transpose() * scaled
        };
        let mut slopes = Slopes {
            damping: own.damping + through(model.contact.damping),
            stiffness: own.stiffness + through(model.contact.stiffness),
            ..own
        };
        if let Some(assistance) = &self.course.assistance {
            for j in 0..N {
                slopes.damping[(j, j)] += assistance.damping[j];
                slopes.stiffness[(j, j)] += assistance.stiffness[j];
            }
        }
        // At rest, in the first instant, only angles give way.
        let whole = match i {
            0 => stuck_at_start(slopes.stiffness, &self.direct.dry),
            _ => slopes.of_step(1.0 / fine.rate),
        };
        let inverse = whole.try_inverse().unwrap_or_else(SMatrix::zeros);
        (slopes, own.damping, inverse)
    }
}

/// The stiffness at the start of a run, where dry friction holds the last joints that stick, as many as the handle leaves free.
fn stuck_at_start<const N: usize>(
    mut stiffness: SMatrix<f64, N, N>,
    dry: &[bool; N],
) -> SMatrix<f64, N, N> {
    for j in (0..N)
        .rev()
        .filter(|&j| dry[j])
        .take(N.saturating_sub(HELD))
    {
        stiffness.row_mut(j).fill(0.0);
        stiffness.column_mut(j).fill(0.0);
        stiffness[(j, j)] = 1.0;
    }
    stiffness
}
