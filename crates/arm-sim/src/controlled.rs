//! The robot of the laboratory: its joint controller, and the safety supervisor that watches it (thesis section 3.3).
//!
//! The robot is two joints with the inertia of motors and gears, which count more than those of its links. In every control
//! period the supervisor looks first; then the controller follows the required angles by acceleration fed forward and
//! proportional, derivative and integral feedback; then robot and arm move on through their contact.

use arm_core::monitor::{Channel, Monitor, Observation, Quantity, Stop, Times};
use arm_core::{Joints, Plane, Robot};

use crate::noise::Normal;
use crate::room::require_room;
use crate::{Drive, Experiment, JointMotion, Outside, Port, SimulationError, Start, Stepper};

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

/// What the supervisor allows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Safety {
    /// How far an angle may be outside of the required ones \[rad\].
    pub angle_margin: f64,
    /// Largest speed of a joint \[rad/s\].
    pub speed: f64,
    /// Largest acceleration of a joint \[rad/s²\].
    pub acceleration: f64,
    /// Largest force in y and z \[N\].
    pub force: f64,
}

impl Default for Safety {
    fn default() -> Self {
        Self {
            angle_margin: 0.05,
            speed: 2.5,
            acceleration: 40.0,
            force: 100.0,
        }
    }
}

/// Something that goes wrong on purpose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// The motor of a joint gives all its torque, whatever it is told.
    Runaway(usize),
    /// The encoder of a joint keeps its value.
    Frozen(usize),
    /// The encoder of a joint reads not a number.
    NotANumber(usize),
    /// Data come late by this \[s\].
    Late(f64),
    /// Something presses against the handle \[N\].
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
const AFTER_STOP: f64 = 0.25;
/// Steps of an encoder in one period below which it may read the same value again.
const MOVING_STEPS: f64 = 8.0;
/// Time constant of the speed that the controller sees \[s\].
const SPEED_FILTER: f64 = 0.5e-3;
/// Ratio of the time of the integral feedback to that of the loop.
const INTEGRAL_TIME: f64 = 10.0;
/// The force sensor of the supervisor: noise \[N\], range \[N\], bits.
const FORCE_SENSOR: (f64, f64, u32) = (0.2, 110.0, 12);
/// Largest jitter of a time stamp \[µs\].
const JITTER: f64 = 40.0;

/// Lets the robot lead the arm of an experiment with its controller, under the eyes of the supervisor.
///
/// The experiment's drive says what is required of the robot. The run ends with the experiment, or a quarter of a second after a stop.
///
/// * `fault` - what goes wrong, and when \[s\]
/// * `seed` - of the sensors' noise
///
/// # Errors
/// [`SimulationError`] for an experiment without robot or handle, a path out of reach, and settings out of range.
pub fn control<const N: usize>(
    experiment: &Experiment<N>,
    (controller, safety): (&Controller, &Safety),
    fault: Option<(f64, Fault)>,
    seed: u64,
) -> Result<Controlled, SimulationError> {
    let missing = |what| SimulationError::Unsupported {
        engine: "controller",
        what,
    };
    let Drive::Handle { path, .. } = &experiment.drive else {
        return Err(missing("an arm without a handle"));
    };
    let robot = experiment.robot.ok_or(missing("an arm without a robot"))?;
    check(controller, safety)?;
    let periods = (experiment.duration / controller.period).floor() as usize;
    // What is required of the robot, and what it does: before either is begun.
    let bytes = size_of::<JointMotion<2>>() + 3 * size_of::<f64>();
    require_room((periods as u64).saturating_mul(bytes as u64))?;
    let mut required = Vec::with_capacity(periods + 1);
    for k in 0..=periods {
        required.push(path.robot_motion(&robot, k as f64 * controller.period)?);
    }
    let mut loop_ = Loop::new(experiment, &robot, controller, &required)?;
    let mut supervisor = Supervisor::new(controller, safety, &required, seed)?;
    let injected = fault.map(|(time, fault)| ((time / controller.period).ceil() as usize, fault));
    let mut done = Controlled {
        time: Vec::with_capacity(periods + 1),
        robot_q: Vec::with_capacity(2 * (periods + 1)),
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
        done.robot_q.extend(loop_.q.iter());
        let force = loop_.force_on_arm();
        if fault.is_some() {
            let size = libm::hypot(force[0], force[1]);
            done.force_after_fault = done.force_after_fault.max(size);
        }
        let read = loop_.encoders(fault);
        if done.stop.is_none() {
            let late = |(_, f): (usize, Fault)| matches!(f, Fault::Late(_)).then_some(f);
            let behind = injected.filter(|&(from, _)| k >= from).and_then(late);
            done.stop = supervisor.look(k, &read, (wanted, pressed(force, fault)), behind);
            if done.stop.is_some() {
                let from = injected.map(|(from, _)| from);
                done.periods_to_stop = from.and_then(|from| (k as u64).checked_sub(from as u64));
                stopped_at = Some((k, loop_.handle()));
            } else {
                let error = loop_.q - wanted.q;
                done.tracking_error = error
                    .iter()
                    .fold(done.tracking_error, |m, e| m.max(e.abs()));
            }
        }
        if let Some((at, [y, z])) = stopped_at {
            let now = loop_.handle();
            done.way_after_stop = done.way_after_stop.max(libm::hypot(now[0] - y, now[1] - z));
            if (k - at) as f64 * controller.period > AFTER_STOP {
                break;
            }
        }
        let acceleration = match (stopped_at, fault) {
            (Some(_), _) => loop_.brake(),
            (None, fault) => loop_.drive(&read, wanted, fault),
        };
        loop_.advance(&acceleration)?;
    }
    Ok(done)
}

fn check(controller: &Controller, safety: &Safety) -> Result<(), SimulationError> {
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

fn pressed(force_on_arm: Plane<f64>, fault: Option<Fault>) -> Plane<f64> {
    match fault {
        Some(Fault::Pressed(more)) => [force_on_arm[0] - more[0], force_on_arm[1] - more[1]],
        _ => force_on_arm,
    }
}

/// Robot, controller and arm.
struct Loop<'a, const N: usize> {
    arm: Stepper<N>,
    robot: &'a Robot<f64>,
    controller: &'a Controller,
    outside: Outside<N>,
    q: Joints<f64, 2>,
    qd: Joints<f64, 2>,
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
        required: &[JointMotion<2>],
    ) -> Result<Self, SimulationError> {
        let first = required[0].q;
        let mut arm = Stepper::new(
            &experiment.setup,
            &experiment.effects,
            Port::Motion,
            controller.period,
        )?;
        let outside = Outside {
            position: robot.handle(&first),
            ..Outside::default()
        };
        let near = match &experiment.start {
            Start::Given { q, .. } | Start::Equilibrium { near: q } => q,
        };
        let q = arm.equilibrium(&outside, near)?;
        arm.start(q, Joints::zeros(), 0.0)?;
        let mut made = Self {
            arm,
            robot,
            controller,
            outside,
            q: first,
            qd: Joints::<f64, 2>::zeros(),
            seen_q: first,
            seen_qd: Joints::<f64, 2>::zeros(),
            integral: Joints::<f64, 2>::zeros(),
            frozen: None,
            pressed: [0.0; 2],
        };
        // It has held the arm for a while.
        made.integral = -made.contact_torque();
        Ok(made)
    }

    fn force_on_arm(&mut self) -> Plane<f64> {
        self.arm.tip(&self.outside).2
    }

    fn handle(&self) -> Plane<f64> {
        self.robot.handle(&self.q)
    }

    /// Torque of the force on the robot in its joints \[N m\].
    fn contact_torque(&mut self) -> Joints<f64, 2> {
        let force = self.force_on_arm();
        let on_robot = [self.pressed[0] - force[0], self.pressed[1] - force[1]];
        let j = self.robot.jacobian(&self.q);
        Joints::<f64, 2>::new(
            j[(0, 0)] * on_robot[0] + j[(1, 0)] * on_robot[1],
            j[(0, 1)] * on_robot[0] + j[(1, 1)] * on_robot[1],
        )
    }

    fn encoders(&mut self, fault: Option<Fault>) -> Joints<f64, 2> {
        let step = encoder_step(self.controller);
        let mut read = self.q.map(|q| (q / step).round() * step);
        self.pressed = [0.0; 2];
        match fault {
            Some(Fault::Frozen(joint)) => {
                read[joint] = *self.frozen.get_or_insert(self.seen_q[joint]);
            }
            Some(Fault::NotANumber(joint)) => read[joint] = f64::NAN,
            Some(Fault::Pressed(force)) => self.pressed = force,
            _ => {}
        }
        read
    }

    /// Accelerations under the controller \[rad/s²\].
    fn drive(
        &mut self,
        read: &Joints<f64, 2>,
        wanted: &JointMotion<2>,
        fault: Option<Fault>,
    ) -> Joints<f64, 2> {
        let c = self.controller;
        let contact = self.contact_torque();
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
                Some(Fault::Runaway(joint)) if joint == i => c.torque_limit,
                // A driver makes nothing of a command that is not a number.
                _ if torque.is_nan() => 0.0,
                _ => torque.clamp(-c.torque_limit, c.torque_limit),
            };
            acceleration[i] = (given + contact[i] - c.viscosity * self.qd[i]) / c.inertia;
        }
        self.seen_q = *read;
        acceleration
    }

    /// Accelerations under the brakes, which hold once they have stopped it \[rad/s²\].
    fn brake(&self) -> Joints<f64, 2> {
        let most = self.controller.braking;
        self.qd
            .map(|v| (-v / self.controller.period).clamp(-most, most))
    }

    fn advance(&mut self, acceleration: &Joints<f64, 2>) -> Result<(), SimulationError> {
        let h = self.controller.period;
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

fn encoder_step(controller: &Controller) -> f64 {
    core::f64::consts::TAU / (1_u64 << controller.encoder_bits) as f64
}

/// The monitor of the core over angles, speeds, accelerations and forces, each of two joints or axes.
struct Supervisor {
    monitor: Monitor<f64, 8>,
    period: f64,
    encoder_step: f64,
    seen: [Joints<f64, 2>; 2],
    noise: Normal,
}

impl Supervisor {
    fn new(
        controller: &Controller,
        safety: &Safety,
        required: &[JointMotion<2>],
        seed: u64,
    ) -> Result<Self, SimulationError> {
        let period = micros(controller.period);
        let angle = |i: usize| {
            let range = required
                .iter()
                .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], m| {
                    [low.min(m.q[i]), high.max(m.q[i])]
                });
            let margin = safety.angle_margin;
            // One sample may stay the same by chance, two do not.
            Channel::range(Quantity::Angle, range[0] - margin, range[1] + margin)
                .frozen_after(period + period / 2)
        };
        let speed = Channel::magnitude(Quantity::Speed, safety.speed);
        let acceleration = Channel::magnitude(Quantity::Acceleration, safety.acceleration);
        let force = Channel::magnitude(Quantity::Force, safety.force);
        let channels = [
            angle(0),
            angle(1),
            speed,
            speed,
            acceleration,
            acceleration,
            force,
            force,
        ];
        Ok(Self {
            monitor: Monitor::new(
                channels,
                Times {
                    oldest: period,
                    period: 2 * period,
                },
            )?,
            period: controller.period,
            encoder_step: encoder_step(controller),
            seen: [required[0].q; 2],
            noise: Normal::new(seed, 1 << 20),
        })
    }

    /// One control period, by the time of the supervisor's own clock.
    fn look(
        &mut self,
        k: usize,
        read: &Joints<f64, 2>,
        (wanted, force): (&JointMotion<2>, Plane<f64>),
        late: Option<Fault>,
    ) -> Option<Stop<f64>> {
        let h = self.period;
        let [last, before] = self.seen;
        let speed = (read - last) / h;
        let acceleration = (read - last * 2.0 + before) / (h * h);
        let (deviation, range, bits) = FORCE_SENSOR;
        let step = 2.0 * range / (1_u64 << bits) as f64;
        let force = force.map(|f| {
            let noisy = f + deviation * self.noise.next();
            ((noisy / step).round() * step).clamp(-range, range)
        });
        let jitter = (5.0 * self.noise.next().abs()).min(JITTER) as u64;
        let delay = match late {
            Some(Fault::Late(delay)) => micros(delay),
            _ => 0,
        };
        // The clock starts at a second, so that late data have a time.
        let now = 1_000_000 + k as u64 * micros(h) + JITTER as u64;
        let moving = |i: usize| wanted.qd[i].abs() * h > MOVING_STEPS * self.encoder_step;
        self.seen = [*read, last];
        let seen = Observation {
            now,
            stamp: (now - jitter).saturating_sub(delay),
            values: [
                read[0],
                read[1],
                speed[0],
                speed[1],
                acceleration[0],
                acceleration[1],
                force[0],
                force[1],
            ],
            moving: [
                moving(0),
                moving(1),
                false,
                false,
                false,
                false,
                false,
                false,
            ],
        };
        self.monitor.check(&seen).err()
    }
}

fn micros(seconds: f64) -> u64 {
    (seconds * 1e6).round() as u64
}
