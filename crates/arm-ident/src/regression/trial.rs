//! A trial: uniformly sampled channels in SI units, with the force named by the body that it acts on.

use arm_core::effect::{Effect, Motion};
use arm_core::{Chain, Contact, Joints, Plane};
pub use arm_model::Tolerance;

/// Whether anything may be fitted on a trial.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Used for fitting.
    Fit,
    /// A test trial: only residuals are computed on it.
    Test,
}

/// One trial, sampled uniformly.
#[derive(Clone, Debug)]
pub struct Trial<const N: usize> {
    /// What it is used for.
    pub role: Role,
    /// Number of its movement; repeats of one movement carry the same.
    pub configuration: usize,
    /// Sampling rate \[Hz\].
    pub rate: f64,
    /// Joint angles \[rad\].
    pub q: Vec<Joints<f64, N>>,
    /// Joint speeds \[rad/s\], where measured; else angles are differentiated.
    pub speed: Option<Vec<Joints<f64, N>>>,
    /// Contact force on the arm \[N\], where measured.
    pub force_on_arm: Option<Vec<Plane<f64>>>,
    /// Contact moment on the arm \[N m\], where measured; else the handle turns freely and it is zero.
    pub moment_on_arm: Option<Vec<f64>>,
    /// Joint torques of motors or brakes on the distal segment \[N m\], where measured.
    pub torque: Option<Vec<Joints<f64, N>>>,
    /// Position of the robot's handle \[m\], where the robot's angles are known.
    pub handle: Option<Vec<Plane<f64>>>,
    /// Position of the first joint \[m\], where its path was measured; else it rests at the position in the model.
    pub base: Option<Vec<Plane<f64>>>,
    /// Activity of the muscles that move each joint, where it was measured, see [`Motion::activity`]; else the arm is at rest.
    pub activity: Option<Vec<[f64; N]>>,
    /// False where a sample was missing and filled in.
    pub valid: Vec<bool>,
}

impl<const N: usize> Trial<N> {
    /// A trial to fit of which only the angles \[rad\] are measured, at a rate \[Hz\] and without a gap.
    pub fn new(rate: f64, q: Vec<Joints<f64, N>>) -> Self {
        Self {
            role: Role::Fit,
            configuration: 0,
            rate,
            speed: None,
            force_on_arm: None,
            moment_on_arm: None,
            torque: None,
            handle: None,
            base: None,
            activity: None,
            valid: vec![true; q.len()],
            q,
        }
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.q.len()
    }

    /// Whether the trial has no sample.
    pub fn is_empty(&self) -> bool {
        self.q.is_empty()
    }

    /// Motion of the arm at a sample, the input of effects; without accelerations and joint forces.
    pub fn motion(&self, i: usize, q: &Joints<f64, N>, qd: &Joints<f64, N>) -> Motion<f64, N> {
        let mut motion = Motion::new(i as f64 / self.rate, *q, *qd);
        if let Some(activity) = &self.activity {
            motion.activity = activity[i];
        }
        motion
    }

    /// Whether no torque and no force acts on the arm during the whole trial.
    pub fn is_unloaded(&self) -> bool {
        let force = self.force_on_arm.iter().flatten().all(|f| *f == [0.0, 0.0]);
        let moment = self.moment_on_arm.iter().flatten().all(|&m| m == 0.0);
        let torque = self
            .torque
            .iter()
            .flatten()
            .all(|t| t.iter().all(|&v| v == 0.0));
        force && moment && torque
    }
}

/// The model that is fitted.
#[derive(Clone, Debug)]
pub struct Model<const N: usize> {
    /// The rigid arm.
    pub chain: Chain<f64, N>,
    /// Relative standard deviation of masses, centres of mass and inertias; 0 holds them.
    pub segment_uncertainty: f64,
    /// Effects whose linear parameters are fitted.
    pub fitted: Vec<Effect<f64>>,
    /// Effects that are held at their values.
    pub held: Vec<Effect<f64>>,
    /// The contact, needed for the simulated motion.
    pub contact: Contact<f64>,
}
