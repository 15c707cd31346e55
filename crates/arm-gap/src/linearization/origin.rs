//! The hypothesis that small changes are measured from.

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use arm_core::effect::{Effect, Motion};
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
    /// What its effects resist with along the run.
    pub(super) resisted: Resisted<N>,
}

/// What effects resist with at every step of a run \[N m\], computed once.
#[derive(Default)]
pub(super) struct Resisted<const N: usize>(Mutex<Vec<Known<N>>>);

/// Effects, and what they resist with together.
type Known<const N: usize> = (Vec<Effect<f64>>, Arc<OnceLock<Vec<Joints<f64, N>>>>);

impl<const N: usize> Resisted<N> {
    /// What some effects resist with, where it is known already.
    pub fn of(&self, effects: &[Effect<f64>]) -> Arc<OnceLock<Vec<Joints<f64, N>>>> {
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, own)) = known.iter().find(|(e, _)| e == effects) {
            return Arc::clone(own);
        }
        let fresh = Arc::default();
        known.push((effects.to_vec(), Arc::clone(&fresh)));
        fresh
    }
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
            resisted: Resisted::default(),
        }
    }

    /// The joints that dry friction holds where the run starts.
    pub(super) fn held_at_start(&self, motion: &Motion<f64, N>) -> [bool; N] {
        held_at_start(&self.resting.friction(motion, &[]))
    }
}

#[cfg(test)]
mod tests {
    use arm_core::effect::Kind;

    use super::*;

    #[test]
    fn what_effects_resist_with_is_computed_once() {
        let resisted = Resisted::<1>::default();
        let of = |joint, torque| {
            let known = resisted.of(&[Effect::new(Kind::Viscous, joint)]);
            known.get_or_init(|| vec![Joints::repeat(torque)])[0][0]
        };
        assert_eq!(
            [of(0, 1.0), of(1, 2.0), of(0, 3.0), of(1, 4.0)],
            [1.0, 2.0, 1.0, 2.0]
        );
    }
}
