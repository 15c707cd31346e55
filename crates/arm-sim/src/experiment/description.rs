//! The description of an experiment: the rig, its effects, its drive, and the numerical settings.

use arm_core::effect::Effect;
use arm_core::{Chain, Joints, Pose, Robot, Setup, inertia};

use crate::{HandlePath, Series, SimulationError};

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
    /// How far the base is from its place, y and z \[m\], where its path was measured.
    pub base: Option<Series<2>>,
    /// Activity of the muscles that move each joint, where it was measured; effects that depend on it need it.
    pub activity: Option<Series<N>>,
    /// What pulls the joints towards given angles beside the drive.
    pub assistance: Option<Assistance<N>>,
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
    /// What is recorded of each sample, [`Columns::All`] unless set.
    pub columns: Columns,
}

/// A spring and a damper in every joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Springs<const N: usize> {
    /// K \[N m/rad\].
    pub stiffness: [f64; N],
    /// D \[N m s/rad\].
    pub damping: [f64; N],
}

impl<const N: usize> Springs<N> {
    /// Those with which every joint of the stretched arm by itself follows with a natural frequency \[Hz\], critically damped.
    pub fn of_frequency(chain: &Chain<f64, N>, frequency: f64) -> Self {
        let stretched = inertia(chain, &Pose::new(&Joints::zeros()));
        let pace = core::f64::consts::TAU * frequency;
        Self {
            stiffness: core::array::from_fn(|j| stretched[(j, j)] * pace * pace),
            damping: core::array::from_fn(|j| 2.0 * stretched[(j, j)] * pace),
        }
    }
}

/// Springs and dampers that pull the joints towards angles that move, `K (q_d − q) + D (q̇_d − q̇)`.
#[derive(Clone, Debug, PartialEq)]
pub struct Assistance<const N: usize> {
    /// The angles q_d \[rad\].
    pub towards: Series<N>,
    /// K and D.
    pub springs: Springs<N>,
}

impl<const N: usize> Assistance<N> {
    /// `K q_d + D q̇_d` at a time \[N m\]; the rest is in the model.
    pub(crate) fn torque(&self, time: f64) -> Joints<f64, N> {
        let to = self.towards.at(time);
        let Springs { stiffness, damping } = &self.springs;
        Joints::from_fn(|j, _| stiffness[j] * to.value[j] + damping[j] * to.rate[j])
    }
}

/// What is recorded of each sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Columns {
    /// Every column of a [`Recording`](crate::Recording).
    All,
    /// Time, angles and speeds; all other columns stay empty. Where samples are close together, computing the others takes
    /// longer than the steps.
    Motion,
}

impl<const N: usize> Experiment<N> {
    /// An experiment with the default step and integrator, from rest at the zero angles.
    pub fn new(setup: Setup<f64, N>, drive: Drive<N>, duration: f64) -> Self {
        Self {
            setup,
            effects: Vec::new(),
            drive,
            robot: None,
            base: None,
            activity: None,
            assistance: None,
            start: Start::Given {
                q: Joints::zeros(),
                qd: Joints::zeros(),
            },
            dt: 0.25e-3,
            duration,
            integrator: Integrator::Rk4,
            output_interval: None,
            columns: Columns::All,
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
    /// At rest in the static equilibrium with the handle at its first position, found from angles near it \[rad\]. On a base that moves the
    /// joints move as the handle needs.
    Equilibrium {
        /// Where the search starts.
        near: Joints<f64, N>,
    },
}

/// How a step is made. All have a fixed step; the same run has the same bits everywhere.
///
/// Where the drive is not smooth (a ramp of a movement ends, or a sample of a series) inside a step, the step is made in
/// pieces, so that the order below holds wherever such times lie. It does not hold where the arm itself is not smooth: a
/// contact with play that opens, an effect with a corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Integrator {
    /// Speeds from the accelerations at the start of the step, then angles from the new speeds. First order; one
    /// evaluation a step. Without friction the energy error stays bounded, of the order of the step, and does not grow.
    ///
    /// [`Recording::energy_error`](crate::Recording::energy_error) of a step h is `h/2 · ( [P − q̇ᵀBq̈] + ∫ (2 ∂T/∂q + Q)·q̈ dt )` and terms in h², with the
    /// power P that the energy gains and Q all that acts besides its gradient: about 10⁻⁴ of the exchanged energy a second
    /// at the default step.
    SemiImplicitEuler,
    /// The classical fourth-order method of Kutta; four evaluations a step. Smooth motions lose or gain energy by the
    /// fifth power of the step in each step; vibrations near the stability limit are damped.
    ///
    /// [`Recording::energy_error`](crate::Recording::energy_error) is of fourth order too: below 5·10⁻¹² of the exchanged energy a second at the default
    /// step for movements as slow as those of the thesis, with a compliant and a rigid coupling.
    Rk4,
    /// Viscosity and dry friction of joints implicitly, all else explicitly, by the method ARS(2,2,2) of Ascher, Ruuth, Spiteri 1997; second order, two evaluations a step.
    /// Accurate for smooth dry friction of any steepness: with 0.16 N m and a smoothing of 0.003 rad/s in the wrist, the angle error at 2 ms is below
    /// 10⁻⁴ rad, where that of [`Integrator::Rk4`] at 1 ms is above 0.01 rad. Transitions of set-valued friction are not located. Not for a rigid
    /// coupling.
    Imex,
}
