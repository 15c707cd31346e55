//! The robot of the laboratory: its joint controller, and the safety supervisor that watches it (thesis section 3.3).
//!
//! The robot is two joints with the inertia of motors and gears, which count more than those of its links. In every control
//! period the supervisor checks first; then the controller follows the required angles by acceleration fed forward and
//! proportional, derivative and integral feedback; then robot and arm move on through their contact.

use arm_core::monitor::Stop;
use arm_core::{Joints, Plane, Robot};

use crate::laboratory::robot_and_arm::{Coupled, required};
use crate::laboratory::supervisor::{Supervisor, encoder_step};
use crate::{Experiment, JointMotion, Safety, SimulationError};

/// The robot's joints and their controller; values are those of both joints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Controller {
    /// Control period \[s\].
    pub period: f64,
    /// Inertia of a joint with motor and gear \[kg m²\].
    pub inertia: f64,
    /// Viscosity of a joint \[N m s/rad\].
    pub viscosity: f64,
    /// Largest torque of a motor at the joint \[N m\].
    pub torque_limit: f64,
    /// Natural frequency of the closed loop \[rad/s\].
    pub bandwidth: f64,
    /// Its damping ratio.
    pub damping: f64,
    /// Bits of an encoder over one turn of the joint.
    pub encoder_bits: u32,
    /// Deceleration of the brakes after a stop \[rad/s²\].
    pub braking: f64,
}

impl Default for Controller {
    fn default() -> Self {
        Self {
            period: 0.25e-3,
            inertia: 4.0,
            viscosity: 2.0,
            torque_limit: 400.0,
            bandwidth: 100.0,
            damping: 0.8,
            encoder_bits: 24,
            braking: 30.0,
        }
    }
}

/// A fault that is injected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum InjectedFault {
    /// The motor of a joint gives all its torque, whatever the command.
    Runaway(usize),
    /// The encoder of a joint keeps its value.
    Frozen(usize),
    /// The encoder of a joint reads NaN.
    NotANumber(usize),
    /// Data come late by this \[s\].
    Late(f64),
    /// A force acts on the handle \[N\].
    Pressed(Plane<f64>),
}

/// What the robot did.
#[derive(Clone, Debug, PartialEq)]
pub struct Controlled {
    /// Start of each control period \[s\].
    pub time: Vec<f64>,
    /// Angles of the robot's joints, two a period \[rad\].
    pub robot_q: Vec<f64>,
    /// Largest distance of an angle from the required one before a stop \[rad\].
    pub tracking_error: f64,
    /// Why and when the supervisor stopped it.
    pub stop: Option<Stop<f64>>,
    /// Control periods from the fault to the stop.
    pub periods_to_stop: Option<u64>,
    /// Largest force on the arm from the fault on \[N\].
    pub force_after_fault: f64,
    /// How far the handle moved after the stop \[m\].
    pub way_after_stop: f64,
}

/// Time that is recorded after a stop \[s\].
pub(crate) const AFTER_STOP: f64 = 0.25;
/// Time constant of the controller's speed filter \[s\].
pub(crate) const SPEED_FILTER: f64 = 0.5e-3;
/// Ratio of the time of the integral feedback to that of the loop.
const INTEGRAL_TIME: f64 = 10.0;

/// The robot leads the arm of an experiment with its controller, monitored by the supervisor.
///
/// The experiment's drive is the required motion of the robot. The run ends with the experiment, or a quarter of a second after a stop.
///
/// * `fault` - what goes wrong, and when \[s\]
/// * `seed` - of the sensors' noise
///
/// # Errors
/// [`SimulationError`] for an experiment without robot or handle, a path out of reach, and settings out of range.
pub fn control<const N: usize>(
    experiment: &Experiment<N>,
    (controller, safety): (&Controller, &Safety),
    fault: Option<(f64, InjectedFault)>,
    seed: u64,
) -> Result<Controlled, SimulationError> {
    check(controller, safety)?;
    let (robot, required) = required(experiment, controller.period)?;
    let periods = required.len();
    let mut loop_ = Loop::new(experiment, &robot, controller, &required[0])?;
    let mut supervisor = Supervisor::new(
        (controller.period, controller.encoder_bits),
        safety,
        &required,
        seed,
    )?;
    let injected = fault.map(|(time, fault)| ((time / controller.period).ceil() as usize, fault));
    let mut done = Controlled {
        time: Vec::with_capacity(periods),
        robot_q: Vec::with_capacity(2 * periods),
        tracking_error: 0.0,
        stop: None,
        periods_to_stop: None,
        force_after_fault: 0.0,
        way_after_stop: 0.0,
    };
    let mut stopped_at = None;
    for (k, wanted) in required.iter().enumerate() {
        let fault = injected.filter(|&(from, _)| k >= from).map(|(_, f)| f);
        done.time.push(k as f64 * controller.period);
        done.robot_q.extend(loop_.body.q.iter());
        let force = loop_.body.force_on_arm();
        if fault.is_some() {
            let size = libm::hypot(force[0], force[1]);
            done.force_after_fault = done.force_after_fault.max(size);
        }
        let read = loop_.encoders(fault);
        if done.stop.is_none() {
            let behind = match fault {
                Some(InjectedFault::Late(delay)) => delay,
                _ => 0.0,
            };
            done.stop = supervisor.look(k, &read, (wanted, pressed(force, fault)), behind);
            if done.stop.is_some() {
                let from = injected.map(|(from, _)| from);
                done.periods_to_stop = from.and_then(|from| (k as u64).checked_sub(from as u64));
                stopped_at = Some((k, loop_.body.handle()));
            } else {
                let error = loop_.body.q - wanted.q;
                done.tracking_error = error
                    .iter()
                    .fold(done.tracking_error, |m, e| m.max(e.abs()));
            }
        }
        if let Some((at, [y, z])) = stopped_at {
            let now = loop_.body.handle();
            done.way_after_stop = done.way_after_stop.max(libm::hypot(now[0] - y, now[1] - z));
            if (k - at) as f64 * controller.period > AFTER_STOP {
                break;
            }
        }
        let acceleration = match (stopped_at, fault) {
            (Some(_), _) => loop_.brake(),
            (None, fault) => loop_.drive(&read, wanted, fault),
        };
        loop_.body.advance(&acceleration, controller.period)?;
    }
    Ok(done)
}

pub(crate) fn check(controller: &Controller, safety: &Safety) -> Result<(), SimulationError> {
    let c = controller;
    let positive = [
        ("control period", c.period),
        ("inertia of the robot's joints", c.inertia),
        ("torque limit of the robot", c.torque_limit),
        ("bandwidth of the robot", c.bandwidth),
        ("damping of the robot", c.damping),
        ("braking of the robot", c.braking),
        ("angle margin", safety.angle_margin),
        ("speed limit", safety.speed),
        ("acceleration limit", safety.acceleration),
        ("force limit", safety.force),
    ];
    for (name, found) in positive {
        if !(found > 0.0 && found.is_finite()) {
            let allowed = "a positive number";
            return Err(SimulationError::Setting {
                name,
                found,
                allowed,
            });
        }
    }
    let limits = [
        ("control period", c.period, 0.01, "at most 0.01 s"),
        (
            "bandwidth of the robot",
            c.bandwidth * c.period,
            0.2,
            "at most a fifth of the control rate",
        ),
        (
            "bits of an encoder",
            f64::from(c.encoder_bits),
            40.0,
            "up to 40",
        ),
    ];
    for (name, found, most, allowed) in limits {
        if found > most {
            return Err(SimulationError::Setting {
                name,
                found,
                allowed,
            });
        }
    }
    Ok(())
}

fn pressed(force_on_arm: Plane<f64>, fault: Option<InjectedFault>) -> Plane<f64> {
    match fault {
        Some(InjectedFault::Pressed(more)) => {
            [force_on_arm[0] - more[0], force_on_arm[1] - more[1]]
        }
        _ => force_on_arm,
    }
}

/// Robot, controller and arm.
struct Loop<'a, const N: usize> {
    body: Coupled<'a, N>,
    controller: &'a Controller,
    seen_q: Joints<f64, 2>,
    seen_qd: Joints<f64, 2>,
    /// Torque of the integral feedback \[N m\].
    integral: Joints<f64, 2>,
    frozen: Option<f64>,
    pressed: Plane<f64>,
}

impl<'a, const N: usize> Loop<'a, N> {
    fn new(
        experiment: &Experiment<N>,
        robot: &'a Robot<f64>,
        controller: &'a Controller,
        first: &JointMotion<2>,
    ) -> Result<Self, SimulationError> {
        let mut body = Coupled::new(experiment, robot, controller.period, &first.q)?;
        // It has held the arm for a while.
        let integral = -body.contact_torque([0.0; 2]);
        Ok(Self {
            body,
            controller,
            seen_q: first.q,
            seen_qd: Joints::<f64, 2>::zeros(),
            integral,
            frozen: None,
            pressed: [0.0; 2],
        })
    }

    fn encoders(&mut self, fault: Option<InjectedFault>) -> Joints<f64, 2> {
        let step = encoder_step(self.controller.encoder_bits);
        let mut read = self.body.q.map(|q| (q / step).round() * step);
        self.pressed = [0.0; 2];
        match fault {
            Some(InjectedFault::Frozen(joint)) => {
                read[joint] = *self.frozen.get_or_insert(self.seen_q[joint]);
            }
            Some(InjectedFault::NotANumber(joint)) => read[joint] = f64::NAN,
            Some(InjectedFault::Pressed(force)) => self.pressed = force,
            _ => {}
        }
        read
    }

    /// Accelerations under the controller \[rad/s²\].
    fn drive(
        &mut self,
        read: &Joints<f64, 2>,
        wanted: &JointMotion<2>,
        fault: Option<InjectedFault>,
    ) -> Joints<f64, 2> {
        let c = self.controller;
        let contact = self.body.contact_torque(self.pressed);
        let share = c.period / (SPEED_FILTER + c.period);
        let stiffness = c.inertia * c.bandwidth * c.bandwidth;
        let viscosity = 2.0 * c.damping * c.inertia * c.bandwidth;
        let mut acceleration = Joints::<f64, 2>::zeros();
        for i in 0..2 {
            let speed = (read[i] - self.seen_q[i]) / c.period;
            self.seen_qd[i] += share * (speed - self.seen_qd[i]);
            let error = wanted.q[i] - read[i];
            let rate = stiffness * c.bandwidth / INTEGRAL_TIME;
            self.integral[i] += c.period * rate * error;
            let torque = c.inertia * wanted.qdd[i]
                + c.viscosity * wanted.qd[i]
                + stiffness * error
                + viscosity * (wanted.qd[i] - self.seen_qd[i])
                + self.integral[i];
            let given = match fault {
                Some(InjectedFault::Runaway(joint)) if joint == i => c.torque_limit,
                // A driver ignores a command that is not a number.
                _ if torque.is_nan() => 0.0,
                _ => torque.clamp(-c.torque_limit, c.torque_limit),
            };
            acceleration[i] = (given + contact[i] - c.viscosity * self.body.qd[i]) / c.inertia;
        }
        self.seen_q = *read;
        acceleration
    }

    fn brake(&self) -> Joints<f64, 2> {
        self.body
            .brake(self.controller.braking, self.controller.period)
    }
}
