//! An arm whose number of joints is known at run time.

use arm_core::Joints;
use arm_core::effect::MAX_STATES;
use arm_sim::{Outside, Seen, SimulationError, Snapshot, Stepper};

use crate::quantity::Quantity;
use crate::spec::ArmSpec;

/// What the slave needs of a [`Stepper`], whatever its number of joints.
pub(crate) trait Plant: Send + Sync {
    /// Starts anew at the start of the specification.
    fn start(&mut self, spec: &ArmSpec, time: f64) -> Result<(), SimulationError>;
    /// Sets an input; any of the handle's starts its motion and its force anew, any of the motors' their torques.
    fn set_input(&mut self, quantity: Quantity, value: f64);
    /// Sets a continuous state.
    fn set_state(&mut self, quantity: Quantity, value: f64);
    /// Sets the time \[s\]; the handle is at its input.
    fn set_time(&mut self, time: f64);
    /// Advances, and carries the handle along.
    fn advance(&mut self, duration: f64) -> Result<(), SimulationError>;
    /// Time \[s\].
    fn time(&self) -> f64;
    /// An output.
    fn output(&mut self, quantity: Quantity) -> f64;
    /// Its time derivative, with the inputs going on as they are.
    fn derivative(&mut self, quantity: Quantity) -> f64;
    /// How many numbers a state has.
    fn size(&self) -> usize;
    /// Writes the state but for the inputs.
    fn save(&self) -> SavedPlant;
    /// Angles near those of the specification at which the arm rests with its inputs \[rad\].
    fn rest(&mut self, spec: &ArmSpec) -> Result<Vec<f64>, SimulationError>;
    /// Comes back to a state that [`Plant::save`] has written for the same arm.
    fn load(&mut self, saved: &SavedPlant);
}

/// The state of a plant but for the inputs, as numbers.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SavedPlant {
    /// Angles, speeds, works, memories, origin of time, ages of the handle's inputs and of the motors'.
    pub numbers: Vec<f64>,
    /// Whole inner steps since the origin.
    pub ticks: u64,
}

/// The arm of a specification.
pub(crate) fn plant(spec: &ArmSpec) -> Result<Box<dyn Plant>, SimulationError> {
    fn build<const N: usize>(spec: &ArmSpec) -> Result<Box<dyn Plant>, SimulationError> {
        let stepper = Stepper::new(
            &spec.setup::<N>()?,
            &spec.core_effects()?,
            spec.port,
            spec.step,
        )?;
        Ok(Box::new(Coupled {
            stepper,
            outside: Outside::default(),
            tip: None,
        }))
    }
    match spec.joints() {
        1 => build::<1>(spec),
        2 => build::<2>(spec),
        3 => build::<3>(spec),
        4 => build::<4>(spec),
        5 => build::<5>(spec),
        _ => build::<6>(spec),
    }
}

type Tip = ([f64; 2], [f64; 2], [f64; 2]);

struct Coupled<const N: usize> {
    stepper: Stepper<N>,
    outside: Outside<N>,
    /// Position and velocity of the tip and the force on the arm, while they hold.
    tip: Option<Tip>,
}

impl<const N: usize> Coupled<N> {
    fn tip(&mut self) -> Tip {
        *self
            .tip
            .get_or_insert_with(|| self.stepper.tip(&self.outside))
    }
}

impl<const N: usize> Plant for Coupled<N> {
    fn start(&mut self, spec: &ArmSpec, time: f64) -> Result<(), SimulationError> {
        let (q, qd) = spec.start_state();
        self.tip = None;
        self.stepper.start(q, qd, time)
    }

    #[inline]
    fn set_input(&mut self, quantity: Quantity, value: f64) {
        self.tip = None;
        let outside = &mut self.outside;
        match quantity {
            Quantity::ForceOnArm(axis) => outside.force_on_arm[axis] = value,
            Quantity::ForceRate(axis) => outside.force_rate[axis] = value,
            Quantity::RobotPosition(axis) => outside.position[axis] = value,
            Quantity::RobotVelocity(axis) => outside.velocity[axis] = value,
            Quantity::RobotAcceleration(axis) => outside.acceleration[axis] = value,
            Quantity::Torque(joint) => outside.torque[joint] = value,
            Quantity::TorqueRate(joint) => outside.torque_rate[joint] = value,
            _ => return,
        }
        match quantity {
            Quantity::Torque(_) | Quantity::TorqueRate(_) => outside.torque_age = 0.0,
            _ => outside.age = 0.0,
        }
    }

    fn set_state(&mut self, quantity: Quantity, value: f64) {
        let mut state = self.stepper.snapshot();
        match quantity {
            Quantity::Angle(j) => state.q[j] = value,
            Quantity::Speed(j) => state.qd[j] = value,
            Quantity::Work(which) => state.work[which] = value,
            _ => {}
        }
        self.stepper.restore(&state);
        self.tip = None;
    }

    fn set_time(&mut self, time: f64) {
        let mut state = self.stepper.snapshot();
        (state.origin, state.ticks) = (time, 0);
        self.stepper.restore(&state);
        (self.outside.age, self.outside.torque_age) = (0.0, 0.0);
        self.tip = None;
    }

    fn advance(&mut self, duration: f64) -> Result<(), SimulationError> {
        self.stepper.advance(&self.outside, duration)?;
        self.outside.age += duration;
        self.outside.torque_age += duration;
        self.tip = None;
        Ok(())
    }

    fn time(&self) -> f64 {
        self.stepper.time()
    }

    #[inline]
    fn output(&mut self, quantity: Quantity) -> f64 {
        match quantity {
            Quantity::Time => self.time(),
            Quantity::Angle(j) => self.stepper.q()[j],
            Quantity::Speed(j) => self.stepper.qd()[j],
            Quantity::TipPosition(axis) => self.tip().0[axis],
            Quantity::TipVelocity(axis) => self.tip().1[axis],
            Quantity::ForceOnRobot(axis) => -self.tip().2[axis],
            Quantity::Energy => {
                let [kinetic, potential, contact] = self.stepper.energy(&self.outside);
                kinetic + potential + contact
            }
            Quantity::Work(which) => self.stepper.work()[which],
            Quantity::AngleRate(_) | Quantity::SpeedRate(_) | Quantity::WorkRate(_) => {
                quantity.state().map_or(0.0, |state| self.derivative(state))
            }
            _ => 0.0,
        }
    }

    fn derivative(&mut self, quantity: Quantity) -> f64 {
        let seen: Seen<N> = self.stepper.seen(&self.outside);
        let [port, drive, resisted, damped] = seen.power;
        match quantity {
            Quantity::Angle(j) => self.stepper.qd()[j],
            Quantity::Speed(j) => seen.qdd[j],
            Quantity::TipPosition(axis) => seen.tip_velocity[axis],
            Quantity::TipVelocity(axis) => seen.tip_acceleration[axis],
            Quantity::ForceOnRobot(axis) => -seen.force_rate[axis],
            Quantity::Energy => port + drive - resisted - damped,
            Quantity::Work(which) => seen.power[which],
            _ => 0.0,
        }
    }

    fn size(&self) -> usize {
        2 * N + 4 + MAX_STATES * self.stepper.memories() + 3
    }

    fn save(&self) -> SavedPlant {
        let Snapshot {
            q,
            qd,
            work,
            memory,
            origin,
            ticks,
        } = self.stepper.snapshot();
        let numbers = q
            .iter()
            .chain(qd.iter())
            .chain(&work)
            .chain(memory.as_flattened())
            .chain(&[origin, self.outside.age, self.outside.torque_age])
            .copied()
            .collect();
        SavedPlant { numbers, ticks }
    }

    fn rest(&mut self, spec: &ArmSpec) -> Result<Vec<f64>, SimulationError> {
        let (near, _) = spec.start_state();
        let rest = self.stepper.equilibrium(&self.outside, &near)?;
        Ok(rest.iter().copied().collect())
    }

    fn load(&mut self, saved: &SavedPlant) {
        let memories = self.stepper.memories();
        let (q, rest) = saved.numbers.split_at(N);
        let (qd, rest) = rest.split_at(N);
        let (work, rest) = rest.split_at(4);
        let (memory, rest) = rest.split_at(MAX_STATES * memories);
        self.stepper.restore(&Snapshot {
            q: Joints::from_column_slice(q),
            qd: Joints::from_column_slice(qd),
            work: [work[0], work[1], work[2], work[3]],
            memory: memory.as_chunks().0.to_vec(),
            origin: rest[0],
            ticks: saved.ticks,
        });
        (self.outside.age, self.outside.torque_age) = (rest[1], rest[2]);
        self.tip = None;
    }
}
