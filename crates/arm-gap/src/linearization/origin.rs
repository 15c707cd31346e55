//! The hypothesis that small changes are measured from.

use std::sync::OnceLock;

use arm_core::effect::Motion;
use arm_core::{Joints, Plane};

use crate::data::course::Channels;
use crate::linearization::plant::{Balance, Plant};
use crate::measurement_model::start::held_at_start;

/// A hypothesis from which changes are computed: that of the run, or one beside it.
pub struct Origin<const N: usize> {
    pub(super) plant: Plant<N>,
    /// The same at rest.
    pub(super) resting: Plant<N>,
    /// Where it starts: the angles that are measured, and what dry friction resists with where the handle places a joint.
    pub(super) start: (Joints<f64, N>, Joints<f64, N>),
    /// What its sensors read of the motion of the run.
    pub(super) shown: Channels,
    /// Force on the arm as its sensor shows it at the samples of the trial, without its errors, where it was needed.
    pub(super) delayed_force: OnceLock<Vec<Plane<f64>>>,
    /// Its balance for the motion of the run, where it was needed.
    pub(super) balances: OnceLock<Vec<Balance<N>>>,
}

impl<const N: usize> Origin<N> {
    pub(super) fn of(plant: Plant<N>, start: (Joints<f64, N>, Joints<f64, N>)) -> Self {
        Self {
            resting: plant.at_rest(),
            plant,
            start,
            shown: Channels::new(),
            delayed_force: OnceLock::new(),
            balances: OnceLock::new(),
        }
    }

    /// The joints that dry friction holds where the run starts.
    pub(super) fn held_at_start(&self, motion: &Motion<f64, N>) -> [bool; N] {
        held_at_start(&self.resting.friction(motion, &[]))
    }
}
