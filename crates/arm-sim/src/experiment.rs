//! What is simulated: the rig, what acts in it, how it is driven, and the numerical settings.

use core::ops::ControlFlow;

use arm_core::effect::Effect;
use arm_core::{Joints, Robot, Setup};

use crate::recorder::Pieces;
use crate::{HandlePath, Piece, Recording, Series, SimulationError, native};

/// The closed-chain experiment of thesis section 3.6 (figure 3.13), or an arm that is driven by torques or swings freely.
///
/// ```text
/// q_d → forward kinematics of the arm → x_d → inverse kinematics of the robot → q_r (tracked perfectly)
///                                        └→ spring and damper of the contact → forward dynamics of the arm → q
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Experiment<const N: usize> {
    /// The rig without the effects.
    pub setup: Setup<f64, N>,
    /// What acts in it. Effects that alter the rig are applied to `setup` in this order when the run is prepared.
    pub effects: Vec<Effect<f64>>,
    /// How the arm is driven.
    pub drive: Drive<N>,
    /// The robot whose joint angles are recorded; a path beyond its reach is refused.
    pub robot: Option<Robot<f64>>,
    /// Where it starts.
    pub start: Start<N>,
    /// Step \[s\], 0.25 ms unless set.
    pub dt: f64,
    /// Duration \[s\], a whole number of steps.
    pub duration: f64,
    /// How a step is made, [`Integrator::Rk4`] unless set.
    pub integrator: Integrator,
    /// Time from one recorded sample to the next \[s\], a whole number of steps; `None` records every step.
    pub output_interval: Option<f64>,
}

impl<const N: usize> Experiment<N> {
    /// An experiment with the default step and integrator, from rest at the zero angles.
    pub fn new(setup: Setup<f64, N>, drive: Drive<N>, duration: f64) -> Self {
        Self {
            setup,
            effects: Vec::new(),
            drive,
            robot: None,
            start: Start::Given {
                q: Joints::zeros(),
                qd: Joints::zeros(),
            },
            dt: 0.25e-3,
            duration,
            integrator: Integrator::Rk4,
            output_interval: None,
        }
    }

    /// The rig with all effects applied that alter it.
    ///
    /// # Errors
    /// [`SimulationError::Invalid`] for an effect with a value or a place outside what its kind allows.
    pub fn altered(&self) -> Result<Setup<f64, N>, SimulationError> {
        altered(&self.setup, &self.effects)
    }
}

/// A rig with all effects applied that alter it.
///
/// # Errors
/// [`SimulationError::Invalid`] for an effect with a value or a place outside what its kind allows.
pub fn altered<const N: usize>(
    setup: &Setup<f64, N>,
    effects: &[Effect<f64>],
) -> Result<Setup<f64, N>, SimulationError> {
    let mut setup = *setup;
    for effect in effects {
        effect.validate(N)?;
        effect.alter(&mut setup);
    }
    Ok(setup)
}

/// How the arm is driven.
#[derive(Clone, Debug, PartialEq)]
pub enum Drive<const N: usize> {
    /// A robot leads the tip with its handle.
    Handle {
        /// Where the handle is.
        path: HandlePath<N>,
        /// How it holds the tip.
        coupling: Coupling,
    },
    /// Motors in the joints: their torques \[N m\], `None` for an arm that swings freely.
    Torque(Option<Series<N>>),
}

/// How the handle holds the tip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coupling {
    /// By the springs and dampers of the [`Contact`](arm_core::Contact).
    Compliant,
    /// The tip follows the handle exactly; the force is the Lagrange multiplier of that constraint.
    Rigid,
}

/// Where a run starts. Memories of effects start at zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Start<const N: usize> {
    /// At given angles \[rad\] and speeds \[rad/s\]. With a rigid coupling they are projected onto the constraint.
    Given {
        /// Joint angles.
        q: Joints<f64, N>,
        /// Joint speeds.
        qd: Joints<f64, N>,
    },
    /// At rest in the static equilibrium with the handle at its first position, found from angles near it \[rad\].
    Equilibrium {
        /// Where the search starts.
        near: Joints<f64, N>,
    },
}

/// How a step is made. Both have a fixed step; the same run has the same bits everywhere.
///
/// Where the drive is not smooth (a ramp of a movement ends, or a sample of a series) inside a step, the step is made in
/// pieces, so that the order below holds wherever such times lie. It does not hold where the arm itself is not smooth: a
/// contact with play that opens, an effect with a corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Integrator {
    /// Speeds from the accelerations at the start of the step, then angles from the new speeds. First order; one
    /// evaluation a step. Without friction the energy error stays bounded, of the order of the step, and does not grow.
    ///
    /// [`Recording::energy_error`] of a step h is `h/2 · ( [P − q̇ᵀBq̈] + ∫ (2 ∂T/∂q + Q)·q̈ dt )` and terms in h², with the
    /// power P that the energy gains and Q all that acts besides its gradient: about 10⁻⁴ of the exchanged energy a second
    /// at the default step.
    SemiImplicitEuler,
    /// The classical fourth-order method of Kutta; four evaluations a step. Smooth motions lose or gain energy by the
    /// fifth power of the step in each step; vibrations near the stability limit are damped.
    ///
    /// [`Recording::energy_error`] is of fourth order too: below 5·10⁻¹² of the exchanged energy a second at the default
    /// step for movements as slow as those of the thesis, with a compliant and a rigid coupling.
    Rk4,
}

/// Which implementation computes the motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Engine {
    /// Minimal coordinates: the joint angles.
    Native,
    /// Maximal coordinates: rigid bodies and joints, solved by rapier. A second opinion.
    #[cfg(feature = "rapier")]
    Rapier,
}

/// Simulates an experiment with the native engine.
///
/// # Errors
/// [`SimulationError`] says what was refused, or at which step and joint the state ceased to be finite.
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
        Engine::Rapier => crate::rapier::run(experiment, None)?.complete(),
    }
}

/// Simulates an experiment with a chosen engine and gives the samples away a piece after another, so that a long run takes no
/// more memory than a short one.
///
/// The samples have the bits of [`simulate_with`]. A run that stops early has given what was recorded before.
///
/// * `samples` - in each piece but the last
/// * `take` - gets every piece, and breaks the run off where it wants no more
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
        Engine::Rapier => crate::rapier::run(experiment, pieces)?,
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

/// A recording and, where the run did not reach its end, why.
#[derive(Clone, Debug, PartialEq)]
pub struct Partial<const N: usize> {
    /// All samples before the stop.
    pub recording: Recording<N>,
    /// Why the run stopped early.
    pub stopped: Option<SimulationError>,
}

impl<const N: usize> Partial<N> {
    /// The recording of a run that reached its end.
    ///
    /// # Errors
    /// The reason for which it did not.
    pub fn complete(self) -> Result<Recording<N>, SimulationError> {
        match self.stopped {
            None => Ok(self.recording),
            Some(reason) => Err(reason),
        }
    }
}
