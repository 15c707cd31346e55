//! Runs of an experiment by a chosen engine, whole or in pieces.

use core::ops::ControlFlow;

use crate::engines::native;
#[cfg(feature = "rapier")]
use crate::engines::rapier;
use crate::recording::recorder::Pieces;
use crate::{Experiment, Partial, Piece, Recording, SimulationError};

/// Which implementation computes the motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Engine {
    /// Minimal coordinates: the joint angles.
    Native,
    /// Maximal coordinates: rigid bodies and joints, solved by rapier. For comparison.
    #[cfg(feature = "rapier")]
    Rapier,
}

/// Simulates an experiment with the native engine.
///
/// # Errors
/// [`SimulationError`] with the refused value, or the step and joint at which the state ceased to be finite.
pub fn simulate<const N: usize>(
    experiment: &Experiment<N>,
) -> Result<Recording<N>, SimulationError> {
    simulate_partial(experiment)?.complete()
}

/// Simulates an experiment with a chosen engine.
///
/// # Errors
/// As [`simulate`].
pub fn simulate_with<const N: usize>(
    engine: Engine,
    experiment: &Experiment<N>,
) -> Result<Recording<N>, SimulationError> {
    match engine {
        Engine::Native => simulate(experiment),
        #[cfg(feature = "rapier")]
        Engine::Rapier => rapier::run(experiment, None)?.complete(),
    }
}

/// Simulates an experiment with a chosen engine and gives the samples away a piece after another, so that a long run takes no
/// more memory than a short one.
///
/// The samples have the bits of [`simulate_with`]. A run that stops early has given what was recorded before.
///
/// * `samples` - in each piece but the last
/// * `take` - gets every piece, and may end the run
///
/// # Errors
/// As [`simulate`].
pub fn simulate_in_pieces<const N: usize>(
    engine: Engine,
    experiment: &Experiment<N>,
    samples: usize,
    take: &mut dyn FnMut(&Piece<'_, N>) -> ControlFlow<()>,
) -> Result<(), SimulationError> {
    let samples = samples.max(1);
    let pieces = Some(Pieces { samples, take });
    let partial = match engine {
        Engine::Native => native::run(experiment, pieces)?,
        #[cfg(feature = "rapier")]
        Engine::Rapier => rapier::run(experiment, pieces)?,
    };
    partial.complete().map(|_| ())
}

/// Simulates with the native engine and keeps what was recorded before a state ceased to be finite.
///
/// # Errors
/// Only what is refused before the first step.
pub fn simulate_partial<const N: usize>(
    experiment: &Experiment<N>,
) -> Result<Partial<N>, SimulationError> {
    native::run(experiment, None)
}
