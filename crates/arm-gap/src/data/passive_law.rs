//! A passive law of a joint that the model does not state.

use arm_core::effect::Effect;

/// Standard deviations from zero beyond which a law that was identified from measured motion is simulated.
pub(super) const LIKELY: f64 = 2.0;

/// A law of a joint that the model leaves without one.
#[derive(Clone, Debug)]
pub struct Passive {
    /// The law as it was identified from measured motion.
    pub effect: Effect<f64>,
    /// Its fitted parameters.
    pub free: Vec<Free>,
    /// Whether measured motion shows it; the others are tested again once an effect is named.
    pub likely: bool,
}

/// A parameter of a law, with its prior.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Free {
    /// Its position among the parameters.
    pub parameter: usize,
    /// Value expected.
    pub mean: f64,
    /// Standard deviation: the typical size that follows from the weight of the arm.
    pub sd: f64,
    /// Smallest value allowed.
    pub lower: f64,
    /// A change that is small and yet seen.
    pub step: f64,
}

impl Free {
    /// What is expected of a parameter: its position, value and standard deviation.
    pub fn expected((parameter, [mean, sd]): (usize, [f64; 2])) -> Self {
        Self {
            parameter,
            mean,
            sd,
            lower: 0.0,
            step: 0.0,
        }
    }
}
