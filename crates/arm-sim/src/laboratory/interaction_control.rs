//! A robot with a compliant handle (impedance and admittance control, Hogan 1985), while motors in the joints may carry the arm.
//!
//! Both laws give the handle a behaviour about the required motion `x_d`. The impedance law commands the force
//! `K (x_d − x) + D (ẋ_d − ẋ)` through the model of the robot, of which the inertia remains. The admittance law reads the force sensor, moves a
//! virtual mass by `m (ẍ_c − ẍ_d) = F + K (x_d − x_c) + D (ẋ_d − ẋ_c)`, and lets the joints follow it.

use arm_core::monitor::Stop;
use arm_core::{
    Chain, Joints, Load, Plane, Pose, Robot, Segment, forward_dynamics, inverse_dynamics,
};

use crate::laboratory::joint_controller::{AFTER_STOP, SPEED_FILTER, check};
use crate::laboratory::noise::Normal;
use crate::laboratory::robot_and_arm::{Coupled, required};
use crate::laboratory::supervisor::{Supervisor, encoder_step, sensed};
use crate::{Controller, Experiment, JointMotion, Safety, SimulationError};

/// How the handle responds to a force.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InteractionLaw {
    /// Motion in, force out.
    Impedance,
    /// Force in, motion out.
    Admittance,
}

/// Impedance or admittance of the handle, in y and z alike, and the links behind it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interaction {
    /// Which of the two.
    pub law: InteractionLaw,
    /// Stiffness about the required position \[N/m\].
    pub stiffness: f64,
    /// Damping about the required velocity \[N s/m\].
    pub damping: f64,
    /// Virtual mass of the admittance \[kg\].
    pub mass: f64,
    /// Masses of the robot's links, uniform rods \[kg\].
    pub link_masses: [f64; 2],
}

impl Default for Interaction {
    fn default() -> Self {
        Self {
            law: InteractionLaw::Impedance,
            stiffness: 300.0,
            damping: 150.0,
            mass: 8.0,
            link_masses: [8.0, 5.0],
        }
    }
}

/// The torque that carries the arm, for time \[s\] and angles \[rad\]; `None` where none is valid.
pub type Support<'a, const N: usize> =
    &'a mut dyn FnMut(f64, &Joints<f64, N>) -> Option<Joints<f64, N>>;

/// What happened. Rows are those of the control periods.
#[derive(Clone, Debug, PartialEq)]
pub struct Yielded {
    /// Start of each control period \[s\].
    pub time: Vec<f64>,
    /// Angles of the robot's joints, two a period \[rad\].
    pub robot_q: Vec<f64>,
    /// Angles of the arm, one a joint \[rad\].
    pub q: Vec<f64>,
    /// Speeds of the arm \[rad/s\].
    pub qd: Vec<f64>,
    /// Force on the arm, two a period \[N\].
    pub force_on_arm: Vec<f64>,
    /// Torques of the motors that carry the arm, one a joint \[N m\].
    pub support: Vec<f64>,
    /// Largest distance of the handle from where it is required before a stop \[m\].
    pub tracking_error: f64,
    /// Why and when the supervisor stopped it.
    pub stop: Option<Stop<f64>>,
}

/// Time at rest before the movement, in which the arm settles; not recorded \[s\].
const SETTLING: f64 = 3.0;
/// Control periods from one torque of the support to the next; it acts one such time after its angles were read.
const SUPPORT_PERIODS: usize = 4;

/// A robot with a compliant handle leads the arm of an experiment, monitored by the supervisor.
///
/// Ends with the experiment, or a quarter of a second after a stop, when brakes hold the robot and nothing carries the arm. A stop while the arm
/// settles counts as one at the start.
///
/// * `perturbation` - force that is added to the command of the impedance, or to the reading of the admittance, two a control
///   period, again and again \[N\]; empty for none
/// * `support` - what carries the arm by torques in its joints
/// * `limit` - largest such torque \[N m\]
/// * `seed` - of the sensors' noise
///
/// # Errors
/// [`SimulationError`] for an experiment without robot or handle, a handle that is pulled out of reach, and settings out of range.
pub fn interact<const N: usize>(
    experiment: &Experiment<N>,
    (controller, interaction, safety): (&Controller, &Interaction, &Safety),
    perturbation: &[f64],
    (mut support, limit): (Option<Support<'_, N>>, f64),
    seed: u64,
) -> Result<Yielded, SimulationError> {
    check(controller, safety)?;
    check_interaction(interaction, limit)?;
    let (robot, required) = required(experiment, controller.period)?;
    let mut loop_ = Loop::new(
        experiment,
        &robot,
        (controller, interaction),
        (&required[0], seed),
    )?;
    let encoders = (controller.period, controller.encoder_bits);
    let mut supervisor = Supervisor::new(encoders, safety, &required, seed)?;
    let ahead = (SETTLING / controller.period).round() as usize;
    let mut done = Yielded::with_capacity_for::<N>(required.len());
    let mut held = [Joints::<f64, N>::zeros(); 2];
    let mut stopped_at = None;
    for k in 0..ahead + required.len() {
        let row = k.saturating_sub(ahead);
        let still = at_rest(&required[0]);
        let wanted = if k < ahead { &still } else { &required[row] };
        if k % SUPPORT_PERIODS == 0 {
            let time = k as f64 * controller.period;
            let next = support
                .as_mut()
                .and_then(|carry| carry(time, &loop_.angles()));
            let next = next.map_or(Joints::zeros(), |t| t.map(|t| t.clamp(-limit, limit)));
            held = [held[1], next];
        }
        let carried = if stopped_at.is_some() {
            Joints::zeros()
        } else {
            held[0]
        };
        loop_.body.outside.torque = carried;
        let force = loop_.body.force_on_arm();
        if k >= ahead || stopped_at.is_some() {
            done.push(row as f64 * controller.period, &loop_.body, force);
        }
        let read = loop_.encoders();
        if stopped_at.is_none() {
            // The encoders of a robot that moves change, even where the required angles do not.
            let moving = JointMotion {
                qd: loop_.body.qd,
                ..*wanted
            };
            done.stop = supervisor.look(k, &read, (&moving, force), 0.0);
            if let Some(stop) = &mut done.stop {
                // By the time of what is recorded.
                stop.at = stop
                    .at
                    .saturating_sub((SETTLING * 1e6) as u64)
                    .max(1_000_000);
                stopped_at = Some(k);
            }
            let ([y, z], [yd, zd]) = (loop_.body.handle(), robot.handle(&wanted.q));
            if k >= ahead {
                done.tracking_error = done.tracking_error.max(libm::hypot(y - yd, z - zd));
            }
        }
        if stopped_at.is_some_and(|at| (k - at) as f64 * controller.period > AFTER_STOP) {
            break;
        }
        let pushed = match perturbation.len() / 2 {
            n if n > 0 && k >= ahead => [0, 1].map(|axis| perturbation[2 * (row % n) + axis]),
            _ => [0.0; 2],
        };
        let acceleration = match stopped_at {
            Some(_) => loop_.body.brake(controller.braking, controller.period),
            None => loop_.drive(&read, wanted, (force, pushed))?,
        };
        loop_.body.advance(&acceleration, controller.period)?;
    }
    Ok(done)
}

impl Yielded {
    fn with_capacity_for<const N: usize>(periods: usize) -> Self {
        let capacity = |width: usize| Vec::with_capacity(width * periods);
        Self {
            time: capacity(1),
            robot_q: capacity(2),
            q: capacity(N),
            qd: capacity(N),
            force_on_arm: capacity(2),
            support: capacity(N),
            tracking_error: 0.0,
            stop: None,
        }
    }

    fn push<const N: usize>(&mut self, time: f64, body: &Coupled<'_, N>, force: Plane<f64>) {
        self.time.push(time);
        self.robot_q.extend(body.q.iter());
        self.q.extend(body.arm.q().iter());
        self.qd.extend(body.arm.qd().iter());
        self.force_on_arm.extend(force);
        self.support.extend(body.outside.torque.iter());
    }
}

fn at_rest(motion: &JointMotion<2>) -> JointMotion<2> {
    JointMotion {
        q: motion.q,
        qd: Joints::<f64, 2>::zeros(),
        qdd: Joints::<f64, 2>::zeros(),
    }
}

fn check_interaction(interaction: &Interaction, limit: f64) -> Result<(), SimulationError> {
    let [first, second] = interaction.link_masses;
    let (positive, at_least_zero) = ("a positive number", "at least 0");
    let (k, d, m) = (interaction.stiffness, interaction.damping, interaction.mass);
    for (name, found, is_right, allowed) in [
        ("stiffness of the handle", k, k >= 0.0, at_least_zero),
        ("damping of the handle", d, d > 0.0, positive),
        ("virtual mass", m, m > 0.0, positive),
        ("mass of a link of the robot", first, first > 0.0, positive),
        (
            "mass of a link of the robot",
            second,
            second > 0.0,
            positive,
        ),
        ("limit of the support", limit, limit > 0.0, positive),
    ] {
        if !(is_right && found.is_finite()) {
            return Err(SimulationError::Setting {
                name,
                found,
                allowed,
            });
        }
    }
    Ok(())
}

/// The links and rotors of a robot under gravity.
fn links(
    robot: &Robot<f64>,
    (controller, interaction): (&Controller, &Interaction),
    gravity: Plane<f64>,
) -> Result<Chain<f64, 2>, SimulationError> {
    let rod = |i: usize| {
        let (length, mass) = (robot.lengths()[i], interaction.link_masses[i]);
        Segment {
            length,
            mass,
            com: [0.5 * length, 0.0],
            inertia: mass * length * length / 12.0,
        }
    };
    let chain = Chain::new([rod(0), rod(1)], robot.base(), gravity)?;
    Ok(chain.with_rotor_inertia([controller.inertia; 2])?)
}

/// Robot, controller and arm.
struct Loop<'a, const N: usize> {
    body: Coupled<'a, N>,
    links: Chain<f64, 2>,
    controller: &'a Controller,
    interaction: &'a Interaction,
    seen_q: Joints<f64, 2>,
    seen_qd: Joints<f64, 2>,
    /// Position and velocity of the virtual mass \[m, m/s\].
    virtual_mass: (Plane<f64>, Plane<f64>),
    noise: Normal,
}

impl<'a, const N: usize> Loop<'a, N> {
    fn new(
        experiment: &Experiment<N>,
        robot: &'a Robot<f64>,
        (controller, interaction): (&'a Controller, &'a Interaction),
        (first, seed): (&JointMotion<2>, u64),
    ) -> Result<Self, SimulationError> {
        let gravity = experiment.setup.gravity;
        Ok(Self {
            body: Coupled::new(experiment, robot, controller.period, &first.q)?,
            links: links(robot, (controller, interaction), gravity)?,
            controller,
            interaction,
            seen_q: first.q,
            seen_qd: Joints::<f64, 2>::zeros(),
            virtual_mass: (robot.handle(&first.q), [0.0; 2]),
            noise: Normal::new(seed, 1 << 21),
        })
    }

    fn encoders(&self) -> Joints<f64, 2> {
        let step = encoder_step(self.controller.encoder_bits);
        self.body.q.map(|q| (q / step).round() * step)
    }

    /// The angles of the arm as its own encoders read them.
    fn angles(&self) -> Joints<f64, N> {
        let step = encoder_step(self.controller.encoder_bits);
        self.body.arm.q().map(|q| (q / step).round() * step)
    }

    /// Accelerations under the controller \[rad/s²\].
    fn drive(
        &mut self,
        read: &Joints<f64, 2>,
        wanted: &JointMotion<2>,
        (force_on_arm, pushed): (Plane<f64>, Plane<f64>),
    ) -> Result<Joints<f64, 2>, SimulationError> {
        let (c, robot) = (self.controller, self.body.robot);
        let share = c.period / (SPEED_FILTER + c.period);
        self.seen_qd += ((read - self.seen_q) / c.period - self.seen_qd) * share;
        self.seen_q = *read;
        let torque = match self.interaction.law {
            InteractionLaw::Impedance => self.impedance(wanted, pushed),
            InteractionLaw::Admittance => self.admittance(robot, wanted, (force_on_arm, pushed))?,
        };
        let limited = torque.map(|t| t.clamp(-c.torque_limit, c.torque_limit));
        let load = Load {
            torque: limited - self.body.qd * c.viscosity,
            force_on_arm: force_on_arm.map(|f| -f),
            moment_on_arm: 0.0,
        };
        let pose = Pose::new(&self.body.q);
        Ok(forward_dynamics(&self.links, &pose, &self.body.qd, &load))
    }

    fn impedance(&self, wanted: &JointMotion<2>, pushed: Plane<f64>) -> Joints<f64, 2> {
        let (i, robot) = (self.interaction, self.body.robot);
        let (x, v) = (
            robot.handle(&self.seen_q),
            robot.handle_velocity(&self.seen_q, &self.seen_qd),
        );
        let (xd, vd) = (
            robot.handle(&wanted.q),
            robot.handle_velocity(&wanted.q, &wanted.qd),
        );
        let force =
            [0, 1].map(|a| i.stiffness * (xd[a] - x[a]) + i.damping * (vd[a] - v[a]) + pushed[a]);
        self.moving(&wanted.qd, &wanted.qdd) + self.body.torque_of(force)
    }

    /// Torques that move the robot alone, from where it is \[N m\].
    fn moving(&self, qd: &Joints<f64, 2>, qdd: &Joints<f64, 2>) -> Joints<f64, 2> {
        inverse_dynamics(&self.links, &Pose::new(&self.seen_q), qd, qdd)
            + qd * self.controller.viscosity
    }

    fn admittance(
        &mut self,
        robot: &Robot<f64>,
        wanted: &JointMotion<2>,
        (force_on_arm, pushed): (Plane<f64>, Plane<f64>),
    ) -> Result<Joints<f64, 2>, SimulationError> {
        let (i, c) = (self.interaction, self.controller);
        let on_arm = sensed(force_on_arm, &mut self.noise);
        let (xd, vd) = (
            robot.handle(&wanted.q),
            robot.handle_velocity(&wanted.q, &wanted.qd),
        );
        let ad = robot.handle_acceleration(&wanted.q, &wanted.qd, &wanted.qdd);
        let (mut x, mut v) = self.virtual_mass;
        let a = [0, 1].map(|k| {
            let returning = i.stiffness * (xd[k] - x[k]) + i.damping * (vd[k] - v[k]);
            ad[k] + (pushed[k] - on_arm[k] + returning) / i.mass
        });
        for k in 0..2 {
            v[k] += a[k] * c.period;
            x[k] += v[k] * c.period;
        }
        self.virtual_mass = (x, v);
        let q = robot.angles(x)?;
        let qd = robot.speeds(&q, v);
        let qdd = robot.accelerations(&q, &qd, a)
            + (q - self.seen_q) * (c.bandwidth * c.bandwidth)
            + (qd - self.seen_qd) * (2.0 * c.damping * c.bandwidth);
        Ok(self.moving(&qd, &qdd) + self.body.torque_of(on_arm))
    }
}
