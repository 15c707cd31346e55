//! The recorded quantities of a run.

use crate::SimulationError;
use arm_core::effect::Kind;

/// A run as columns, each with one row a sample (row-major); names and signs as in the equation of motion
/// `B q̈ + C q̇ + G + frame + R = τ + Jᵀ F_on_arm`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recording<const N: usize> {
    /// Time since the start \[s\], `(n)`.
    pub time: Vec<f64>,
    /// Joint angles \[rad\], `(n, N)`.
    pub q: Vec<f64>,
    /// Joint speeds \[rad/s\], `(n, N)`.
    pub qd: Vec<f64>,
    /// Joint accelerations \[rad/s²\], `(n, N)`.
    pub qdd: Vec<f64>,
    /// Position of the arm's tip, y and z \[m\], `(n, 2)`.
    pub tip: Vec<f64>,
    /// Position of the handle as it stands in the hand, ripple and slip included \[m\], `(n, 2)`; empty without a handle.
    pub handle: Vec<f64>,
    /// Commanded joint angles of the robot \[rad\], `(n, 2)`; empty without a robot. Its encoders read these: a ripple of
    /// its position is behind them.
    pub robot_q: Vec<f64>,
    /// Joint speeds of the robot \[rad/s\].
    pub robot_qd: Vec<f64>,
    /// Joint accelerations of the robot \[rad/s²\].
    pub robot_qdd: Vec<f64>,
    /// Force on the arm at its tip, y and z \[N\], `(n, 2)`.
    pub force_on_arm: Vec<f64>,
    /// Moment on the arm at its tip \[N m\], `(n)`; zero, because the contact is a point.
    pub moment_on_arm: Vec<f64>,
    /// Every torque by itself.
    pub torque: TorqueColumns,
    /// Which effect each column of [`Recording::resisting`] belongs to: kind and zero-based joint.
    pub effects: Vec<(Kind, usize)>,
    /// Torque with which each joint effect resists in its joint \[N m\], `(n, effects)`.
    pub resisting: Vec<f64>,
    /// States of each joint effect in turn, `(n, states)`; one that is zero for those without.
    pub memory: Vec<f64>,
    /// What is stored.
    pub energy: EnergyColumns,
    /// What was exchanged since the start.
    pub work: WorkColumns,
}

/// Joint torques \[N m\], each `(n, N)`. Left-hand side less right-hand side is zero.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TorqueColumns {
    /// `B q̈`, left.
    pub inertial: Vec<f64>,
    /// The part of `C q̇` with squared speeds, left.
    pub centrifugal: Vec<f64>,
    /// The part of `C q̇` with products of two speeds, left.
    pub coriolis: Vec<f64>,
    /// `G`, left.
    pub gravity: Vec<f64>,
    /// What a moving base adds on the left: its inertia and weight, less the work of the contact force on it. Zero when it rests.
    pub frame: Vec<f64>,
    /// Sum of all resisting torques `R`, left.
    pub resisting: Vec<f64>,
    /// Torques of motors `τ`, right.
    pub drive: Vec<f64>,
    /// `Jᵀ F_on_arm`, right.
    pub contact: Vec<f64>,
}

/// Stored energy \[J\], each `(n)`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EnergyColumns {
    /// Energy of motion.
    pub kinetic: Vec<f64>,
    /// Energy of weight, relative to the base at rest.
    pub potential: Vec<f64>,
    /// Energy in the springs of the contact.
    pub contact: Vec<f64>,
}

/// Work since the start \[J\], each `(n)`, integrated with the order of the integrator.
///
/// `kinetic + potential + contact` grows by `handle + drive − resisted − damped`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WorkColumns {
    /// Done by the robot's handle on contact and arm: `∫ F_on_arm · v_handle dt`.
    pub handle: Vec<f64>,
    /// Done by motors: `∫ τ · q̇ dt`.
    pub drive: Vec<f64>,
    /// Done against all resisting torques, stored by elastic ones and lost in the others: `∫ R · q̇ dt`.
    pub resisted: Vec<f64>,
    /// Lost in the damping of the contact.
    pub damped: Vec<f64>,
}

/// How many states of a kind are recorded: one also where there are none, as for the torque.
pub(crate) fn recorded_states(kind: Kind) -> usize {
    kind.info().states.max(1)
}

/// The columns of a recording in a fixed order, each with its name and number of entries a sample.
macro_rules! columns {
    ($of:ident, $($by:tt)+) => {{
        let (effects, memories) = ($of.effects.len(), $of.memories());
        [
            ("time", 1, $($by)+ $of.time),
            ("q", N, $($by)+ $of.q),
            ("qd", N, $($by)+ $of.qd),
            ("qdd", N, $($by)+ $of.qdd),
            ("tip", 2, $($by)+ $of.tip),
            ("handle", 2, $($by)+ $of.handle),
            ("robot_q", 2, $($by)+ $of.robot_q),
            ("robot_qd", 2, $($by)+ $of.robot_qd),
            ("robot_qdd", 2, $($by)+ $of.robot_qdd),
            ("force_on_arm", 2, $($by)+ $of.force_on_arm),
            ("moment_on_arm", 1, $($by)+ $of.moment_on_arm),
            ("torque.inertial", N, $($by)+ $of.torque.inertial),
            ("torque.centrifugal", N, $($by)+ $of.torque.centrifugal),
            ("torque.coriolis", N, $($by)+ $of.torque.coriolis),
            ("torque.gravity", N, $($by)+ $of.torque.gravity),
            ("torque.frame", N, $($by)+ $of.torque.frame),
            ("torque.resisting", N, $($by)+ $of.torque.resisting),
            ("torque.drive", N, $($by)+ $of.torque.drive),
            ("torque.contact", N, $($by)+ $of.torque.contact),
            ("resisting", effects, $($by)+ $of.resisting),
            ("memory", memories, $($by)+ $of.memory),
            ("energy.kinetic", 1, $($by)+ $of.energy.kinetic),
            ("energy.potential", 1, $($by)+ $of.energy.potential),
            ("energy.contact", 1, $($by)+ $of.energy.contact),
            ("work.handle", 1, $($by)+ $of.work.handle),
            ("work.drive", 1, $($by)+ $of.work.drive),
            ("work.resisted", 1, $($by)+ $of.work.resisted),
            ("work.damped", 1, $($by)+ $of.work.damped),
        ]
    }};
}

impl<const N: usize> Recording<N> {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.time.len()
    }

    /// Whether nothing was recorded.
    pub fn is_empty(&self) -> bool {
        self.time.is_empty()
    }

    /// Number of states of a sample in [`Recording::memory`].
    pub fn memories(&self) -> usize {
        let kinds = self.effects.iter();
        kinds.map(|(kind, _)| recorded_states(*kind)).sum()
    }

    /// Change of stored energy less the work that explains it, for each sample \[J\]; zero but for the integration error.
    pub fn energy_error(&self) -> Vec<f64> {
        Piece::from(self).energy_error()
    }

    /// Stored energy less the work since the start \[J\].
    pub(crate) fn balance(&self, i: usize) -> f64 {
        let (e, w) = (&self.energy, &self.work);
        e.kinetic[i] + e.potential[i] + e.contact[i] - w.handle[i] - w.drive[i]
            + w.resisted[i]
            + w.damped[i]
    }

    /// The same at the first sample; zero where no energy is recorded.
    pub(crate) fn first_balance(&self) -> f64 {
        if self.energy.kinetic.is_empty() {
            0.0
        } else {
            self.balance(0)
        }
    }

    /// Every column with its name and number of entries a sample, in a fixed order.
    pub fn columns(&self) -> [(&'static str, usize, &[f64]); 28] {
        columns!(self, &)
    }

    /// The same to change, or to take.
    pub fn columns_mut(&mut self) -> [(&'static str, usize, &mut Vec<f64>); 28] {
        columns!(self, &mut)
    }
}

/// Some samples of a run in a row.
#[derive(Clone, Copy, Debug)]
pub struct Piece<'a, const N: usize> {
    /// These samples.
    pub recording: &'a Recording<N>,
    /// Samples of the run before them.
    pub from: usize,
    /// [`Recording::balance`] at the start of the run.
    pub(crate) balance: f64,
}

impl<'a, const N: usize> From<&'a Recording<N>> for Piece<'a, N> {
    /// A whole run.
    fn from(recording: &'a Recording<N>) -> Self {
        Self {
            recording,
            from: 0,
            balance: recording.first_balance(),
        }
    }
}

impl<const N: usize> Piece<'_, N> {
    /// Change of stored energy since the start of the run less the work that explains it, for each sample \[J\].
    pub fn energy_error(&self) -> Vec<f64> {
        let samples = 0..self.recording.energy.kinetic.len();
        samples
            .map(|i| self.recording.balance(i) - self.balance)
            .collect()
    }
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
