//! What effects see of the arm at an instant, and what they do to it.

use crate::rig::Plane;

/// What is known of the arm at an instant.
#[derive(Clone, Debug)]
pub struct Instant {
    /// \[s\]
    pub time: f64,
    /// Joint angles \[rad\].
    pub q: Vec<f64>,
    /// Joint speeds \[rad/s\].
    pub qd: Vec<f64>,
    /// Magnitude of the force through each joint \[N\].
    pub through: Vec<f64>,
    /// Joints and tip \[m\].
    pub points: Vec<Plane>,
    /// Directions of the links \[rad\].
    pub angles: Vec<f64>,
}

/// What effects do at an instant.
#[derive(Clone, Debug)]
pub struct Loads {
    /// Torque with which each joint resists \[N m\].
    pub resist: Vec<f64>,
    /// Largest dry friction of each joint \[N m\], against rising and against falling angle.
    pub dry: Vec<[f64; 2]>,
    /// Forces on links: which, where \[m\], how much \[N\].
    pub pushes: Vec<(usize, Plane, Plane)>,
}

impl Loads {
    /// Nothing, for so many joints.
    pub fn none(joints: usize) -> Self {
        Self {
            resist: vec![0.0; joints],
            dry: vec![[0.0; 2]; joints],
            pushes: Vec::new(),
        }
    }
}

/// Something that acts on the arm during a trial, with a memory where it has one.
pub trait Acts {
    /// Adds what it does now.
    fn act(&self, now: &Instant, loads: &mut Loads);

    /// Lets a step go by.
    fn advance(&mut self, _now: &Instant, _step: f64) {}
}
