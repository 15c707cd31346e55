//! Internal states of effects along a measured or simulated motion.

use crate::regression::trial::Model;
use arm_core::effect::{Effect, MAX_STATES, Motion, States, advance_states, any_state};

/// The states of a model's effects, sample after sample; zero at the first.
pub(crate) struct InternalStates<const N: usize> {
    pub(crate) fitted: Vec<States<f64>>,
    pub(crate) held: Vec<States<f64>>,
    effects: (Vec<Effect<f64>>, Vec<Effect<f64>>),
    /// Whether any effect has a state.
    any: bool,
    /// Where the states stand.
    last: Option<Motion<f64, N>>,
}

impl<const N: usize> InternalStates<N> {
    pub(crate) fn new(model: &Model<N>) -> Self {
        Self {
            fitted: vec![[0.0; MAX_STATES]; model.fitted.len()],
            held: vec![[0.0; MAX_STATES]; model.held.len()],
            effects: (model.fitted.clone(), model.held.clone()),
            any: any_state(&model.fitted) || any_state(&model.held),
            last: None,
        }
    }

    /// Carries the states to the next sample, `interval` \[s\] after the one before.
    pub(crate) fn advance(&mut self, motion: &Motion<f64, N>, interval: f64) {
        if !self.any {
            return;
        }
        if let Some(before) = self.last.replace(*motion) {
            let between = (&before, motion);
            advance_states(&self.effects.0, between, &mut self.fitted, interval);
            advance_states(&self.effects.1, between, &mut self.held, interval);
        }
    }
}
