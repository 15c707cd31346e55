//! What an effect is chosen for, and how what was chosen is told.

use crate::effect::Scored;
use crate::rig::Rig;

/// What is known of a session when its effects are chosen.
#[derive(Clone, Debug)]
pub struct Scene<'a> {
    /// The true rig without hidden effects.
    pub rig: &'a Rig,
    /// Smallest and largest angle of each joint in the movements to fit \[rad\].
    pub range: Vec<[f64; 2]>,
    /// Largest speed of each joint there \[rad/s\].
    pub speed: Vec<f64>,
    /// Duration of each trial to fit \[s\], and its number.
    pub trials: Vec<(usize, f64)>,
}

/// Where an effect acts.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Place {
    pub joint: Option<usize>,
    pub channel: Option<usize>,
    pub trial: Option<usize>,
}

/// Values in the parameters of the catalogue.
pub(super) struct Values(pub Vec<Scored>);

impl Values {
    /// The law of the catalogue with this value is what acts.
    pub fn exact(name: &'static str, value: f64) -> Self {
        Self(Vec::new()).and_exact(name, value)
    }

    /// A value of about this size fits best.
    pub fn about(name: &'static str, value: f64) -> Self {
        Self(Vec::new()).and_about(name, value)
    }

    pub fn and_exact(self, name: &'static str, value: f64) -> Self {
        self.and(name, value, true)
    }

    pub fn and_about(self, name: &'static str, value: f64) -> Self {
        self.and(name, value, false)
    }

    fn and(mut self, name: &'static str, value: f64, exact: bool) -> Self {
        self.0.push(Scored { name, value, exact });
        self
    }
}
