//! A robot and the arm at its handle, advanced together by control periods.

use arm_core::{Joints, Plane, Robot};

use crate::free_memory::require_memory;
use crate::{Drive, Experiment, JointMotion, Outside, Port, SimulationError, Start, Stepper};

/// The robot of an experiment, and what is required of its joints at the start of each control period \[s\].
///
/// # Errors
/// [`SimulationError`] for an experiment without robot or handle, a path out of reach, and more than fits into memory.
pub(crate) fn required<const N: usize>(
    experiment: &Experiment<N>,
    period: f64,
) -> Result<(Robot<f64>, Vec<JointMotion<2>>), SimulationError> {
    let missing = |what| SimulationError::Unsupported {
        engine: "controller",
        what,
    };
    let Drive::Handle { path, .. } = &experiment.drive else {
        return Err(missing("an arm without a handle"));
    };
    let robot = experiment.robot.ok_or(missing("an arm without a robot"))?;
    let periods = (experiment.duration / period).floor() as usize;
    // What is required of the robot, and what it does: before either is begun.
    let bytes = size_of::<JointMotion<2>>() + 3 * size_of::<f64>();
    require_memory((periods as u64).saturating_mul(bytes as u64))?;
    let mut required = Vec::with_capacity(periods + 1);
    for k in 0..=periods {
        required.push(path.robot_motion(&robot, k as f64 * period)?);
    }
    Ok((robot, required))
}

/// Robot and arm.
pub(crate) struct Coupled<'a, const N: usize> {
    pub arm: Stepper<N>,
    pub robot: &'a Robot<f64>,
    pub outside: Outside<N>,
    /// Angles of the robot \[rad\].
    pub q: Joints<f64, 2>,
    /// Speeds of the robot \[rad/s\].
    pub qd: Joints<f64, 2>,
}

impl<'a, const N: usize> Coupled<'a, N> {
    /// At rest with the robot at given angles.
    pub fn new(
        experiment: &Experiment<N>,
        robot: &'a Robot<f64>,
        period: f64,
        first: &Joints<f64, 2>,
    ) -> Result<Self, SimulationError> {
        let mut arm = Stepper::new(&experiment.setup, &experiment.effects, Port::Motion, period)?;
        let outside = Outside {
            position: robot.handle(first),
            ..Outside::default()
        };
        let near = match &experiment.start {
            Start::Given { q, .. } | Start::Equilibrium { near: q } => q,
        };
        let q = arm.equilibrium(&outside, near)?;
        arm.start(q, Joints::zeros(), 0.0)?;
        Ok(Self {
            arm,
            robot,
            outside,
            q: *first,
            qd: Joints::<f64, 2>::zeros(),
        })
    }

    pub fn force_on_arm(&mut self) -> Plane<f64> {
        self.arm.tip(&self.outside).2
    }

    pub fn handle(&self) -> Plane<f64> {
        self.robot.handle(&self.q)
    }

    /// Torque in the joints of the robot of the force on it, with what presses besides \[N m\].
    pub fn contact_torque(&mut self, pressed: Plane<f64>) -> Joints<f64, 2> {
        let force = self.force_on_arm();
        self.torque_of([pressed[0] - force[0], pressed[1] - force[1]])
    }

    /// Torque in the joints of the robot of a force on its handle \[N m\].
    pub fn torque_of(&self, force: Plane<f64>) -> Joints<f64, 2> {
        let j = self.robot.jacobian(&self.q);
        Joints::<f64, 2>::new(
            j[(0, 0)] * force[0] + j[(1, 0)] * force[1],
            j[(0, 1)] * force[0] + j[(1, 1)] * force[1],
        )
    }

    /// Accelerations under brakes, which hold once they have stopped it \[rad/s²\].
    pub fn brake(&self, most: f64, period: f64) -> Joints<f64, 2> {
        self.qd.map(|v| (-v / period).clamp(-most, most))
    }

    /// One control period with these accelerations of the robot \[rad/s²\].
    pub fn advance(
        &mut self,
        acceleration: &Joints<f64, 2>,
        h: f64,
    ) -> Result<(), SimulationError> {
        let before = self.handle();
        self.q += self.qd * h + acceleration * (0.5 * h * h);
        self.qd += acceleration * h;
        let after = self.handle();
        self.outside.position = before;
        self.outside.velocity = [0, 1].map(|i| (after[i] - before[i]) / h);
        self.arm.advance(&self.outside, h)?;
        self.outside.position = after;
        Ok(())
    }
}
