//! The arm in rapier: one rigid body for each segment, revolute joints between them, and no collisions.

use core::array::from_fn;
use core::f64::consts::TAU;

use arm_core::{Chain, Invalid, Joints, Plane, Pose, joint_position};
use rapier2d_f64::prelude::{
    GenericJoint, GenericJointBuilder, ImpulseJointHandle, IntegrationParameters, JointAxesMask,
    JointAxis, MassProperties, MotorModel, PhysicsWorld, RevoluteJointBuilder, RigidBodyBuilder,
    RigidBodyHandle, SpringCoefficients, Vector,
};

use super::settings::RapierSettings;
use crate::SimulationError;

/// Hertz. So far above any step rate that a joint's error is removed within one step and its softness vanishes.
const STIFF: f64 = 1e9;
/// Gain of a motor that is dry friction \[N m s/rad\]: it gives its largest torque at any speed.
const RIGID: f64 = 1e12;

/// Times as many sweeps with motors, which rotors and dry friction are: what the sweeps leave of their torque is lost, whereas a joint that they leave open
/// is closed by the steps that follow.
const MOTORS: usize = 8;
/// Times as many sweeps around a closed loop of joints, where a sweep removes about a tenth of what is left.
const HELD: usize = 4;

/// A world with one arm in it.
pub(super) struct World<const N: usize> {
    world: PhysicsWorld,
    links: [RigidBodyHandle; N],
    joints: [ImpulseJointHandle; N],
    /// Separate joints for dry friction: motors with the target speed zero and the torque of the friction.
    friction: [Option<ImpulseJointHandle>; N],
    held: Option<Held>,
    /// Where the handle holds the last segment, in its own frame \[m\].
    tip: Plane<f64>,
    chain: Chain<f64, N>,
    /// Link angles, followed over full turns \[rad\].
    angles: [f64; N],
}

/// A tip that a handle holds rigidly.
struct Held {
    handle: RigidBodyHandle,
    /// One joint for each direction: a joint that locks two orthogonalises them, and its impulses are then not the forces.
    joints: [ImpulseJointHandle; 2],
    /// Force with which the hand was loaded in the last step \[N\].
    load: Plane<f64>,
}

/// Where the arm starts.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start<const N: usize> {
    /// Joint angles \[rad\].
    pub q: Joints<f64, N>,
    /// Joint speeds \[rad/s\].
    pub qd: Joints<f64, N>,
    /// Joint angles one step before \[rad\].
    pub earlier: Joints<f64, N>,
    /// The handle that holds the tip rigidly \[m\].
    pub handle: Option<Plane<f64>>,
    /// Where the hand holds the handle beside its tip: along the last segment and to its left \[m\].
    pub placement: Plane<f64>,
    /// Joints with dry friction.
    pub dry: [bool; N],
}

/// What is read of the bodies between two steps. Speeds are those of the step that led here, half a step ago.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bodies<const N: usize> {
    /// Joint angles \[rad\].
    pub q: Joints<f64, N>,
    /// Joint speeds \[rad/s\].
    pub qd: Joints<f64, N>,
    /// The arm's tip \[m\].
    pub tip: Plane<f64>,
    /// Velocities of the centres of mass \[m/s\].
    pub velocity: [Plane<f64>; N],
}

/// Forces and torques of one step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Loads<const N: usize> {
    /// Of each joint on its distal segment, and the opposite on the segment before \[N m\].
    pub torque: Joints<f64, N>,
    /// On the arm at its tip \[N\].
    pub force_on_arm: Plane<f64>,
    /// Most that dry friction which is still to be found does in each joint \[N m\].
    pub sticky: Joints<f64, N>,
}

/// What joints did in a step, and are expected to do in the next.
///
/// The bodies are loaded with it, and rapier finds what it must be more or less. Any value leads to the same step, but
/// from a good one it takes fewer sweeps.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reaction<const N: usize> {
    /// Change of the joint speeds \[rad/s\].
    pub change: Joints<f64, N>,
    /// Force of the proximal side on each joint \[N\].
    pub force: [Plane<f64>; N],
    /// Force on the arm of a handle that holds the tip rigidly \[N\].
    pub handle: Plane<f64>,
}

impl<const N: usize> World<N> {
    /// # Errors
    /// [`SimulationError::Invalid`] for a segment without inertia: rapier takes it as one that does not turn.
    pub fn new(
        chain: &Chain<f64, N>,
        start: &Start<N>,
        dt: f64,
        settings: &RapierSettings,
    ) -> Result<Self, SimulationError> {
        for (index, segment) in chain.segments().iter().enumerate() {
            if segment.inertia <= 0.0 {
                return Err(SimulationError::Invalid(Invalid::OutOfRange {
                    name: "rapier: inertia of segment",
                    index,
                    found: segment.inertia,
                    min: f64::MIN_POSITIVE,
                    max: f64::INFINITY,
                }));
            }
        }
        let reach = chain.segments().last().map_or(0.0, |hand| hand.length);
        let tip = [reach + start.placement[0], start.placement[1]];
        let mut world = PhysicsWorld {
            gravity: vector(chain.gravity()),
            integration_parameters: parameters(chain, start, dt, settings),
            ..PhysicsWorld::default()
        };
        let links = links(&mut world, chain, start, dt);
        let joints = joints(&mut world, chain, &links);
        let friction = from_fn(|i| {
            if !start.dry[i] {
                return None;
            }
            let proximal = match i.checked_sub(1) {
                None => world.insert_body(RigidBodyBuilder::fixed()),
                Some(before) => links[before],
            };
            let motor = GenericJointBuilder::new(JointAxesMask::empty())
                .contacts_enabled(false)
                .motor_model(JointAxis::AngX, MotorModel::ForceBased)
                .motor_velocity(JointAxis::AngX, 0.0, RIGID)
                .motor_max_force(JointAxis::AngX, 0.0);
            Some(world.insert_impulse_joint(proximal, links[i], motor))
        });
        let held = match (start.handle, links.last()) {
            (Some(at), Some(&hand)) => Some(Held::new(&mut world, hand, tip, at)),
            _ => None,
        };
        let mut angle = 0.0;
        Ok(Self {
            world,
            links,
            joints,
            friction,
            held,
            tip,
            chain: *chain,
            angles: from_fn(|i| {
                angle += start.q[i];
                angle
            }),
        })
    }

    /// What the bodies do now.
    pub fn read(&mut self) -> Bodies<N> {
        let mut bodies = Bodies {
            q: Joints::zeros(),
            qd: Joints::zeros(),
            tip: [0.0; 2],
            velocity: [[0.0; 2]; N],
        };
        let (mut angle_before, mut speed_before) = (0.0, 0.0);
        for i in 0..N {
            let body = &self.world.bodies[self.links[i]];
            let rotation = body.rotation();
            let within_turn = libm::atan2(rotation.im, rotation.re);
            let turns = libm::round((self.angles[i] - within_turn) / TAU);
            let angle = within_turn + turns * TAU;
            self.angles[i] = angle;
            bodies.q[i] = angle - angle_before;
            bodies.qd[i] = body.angvel() - speed_before;
            bodies.velocity[i] = body.linvel().into();
            (angle_before, speed_before) = (angle, body.angvel());
            bodies.tip = body.position().transform_point(vector(self.tip)).into();
        }
        bodies
    }

    /// Makes one step from `now`, at whose end a handle that holds the tip rigidly is at `handle` \[m\].
    ///
    /// # Errors
    /// The first joint whose segment has no place any more.
    pub fn step(
        &mut self,
        now: &Bodies<N>,
        loads: &Loads<N>,
        expected: &Reaction<N>,
        handle: Plane<f64>,
    ) -> Result<(), usize> {
        let torque = loads.torque + self.turn_rotors(now, &expected.change);
        for (joint, &most) in self.friction.iter().zip(&loads.sticky) {
            let joint = joint.and_then(|j| self.world.impulse_joints.get_mut(j, false));
            if let Some(joint) = joint {
                joint.data.set_motor_max_force(JointAxis::AngX, most);
            }
        }
        for i in 0..N {
            let distal = if i + 1 < N { torque[i + 1] } else { 0.0 };
            let body = &mut self.world.bodies[self.links[i]];
            body.reset_forces(false);
            body.reset_torques(false);
            body.add_torque(torque[i] - distal, true);
        }
        for i in 0..N {
            let joint = self.world.bodies[self.links[i]].translation().into();
            let [y, z] = expected.force[i];
            self.pull(i, [y, z], joint);
            if i > 0 {
                self.pull(i - 1, [-y, -z], joint);
            }
        }
        let mut at_tip = loads.force_on_arm;
        if let Some(held) = &mut self.held {
            held.load = expected.handle;
            at_tip = from_fn(|k| at_tip[k] + held.load[k]);
            self.world.bodies[held.handle].set_next_kinematic_translation(vector(handle));
        }
        if N > 0 {
            self.pull(N - 1, at_tip, now.tip);
        }
        self.world.step();
        // Rapier takes what is not finite out of the world and goes on without it.
        let lost = self.world.physics_pipeline.quarantine().bodies();
        match self.links.iter().position(|link| lost.contains(link)) {
            None => Ok(()),
            Some(joint) => Err(joint),
        }
    }

    /// Adds a force to a segment at a point of the plane.
    ///
    /// Not `add_force_at_point`: before the first step rapier has not computed the centre of mass.
    fn pull(&mut self, link: usize, force: Plane<f64>, at: Plane<f64>) {
        let body = &mut self.world.bodies[self.links[link]];
        let com = vector(self.chain.segments()[link].com);
        let com = body.position().transform_point(com);
        let arm = [at[0] - com.x, at[1] - com.y];
        body.add_force(vector(force), true);
        body.add_torque(arm[0] * force[1] - arm[1] * force[0], true);
    }

    /// A rotor as a damper between two segments: `−I (q̇₊ − q̇₋)/h` is its torque, with the speed at the end of the step.
    ///
    /// Returns the torque for the change expected. The damper, set to the speed expected, makes up for the rest.
    fn turn_rotors(&mut self, now: &Bodies<N>, change: &Joints<f64, N>) -> Joints<f64, N> {
        let dt = self.world.integration_parameters.dt;
        let mut torque = Joints::zeros();
        for i in 1..N {
            let damping = self.chain.rotor_inertia()[i] / dt;
            if damping > 0.0
                && let Some(joint) = self.world.impulse_joints.get_mut(self.joints[i], false)
            {
                let speed = now.qd[i] + change[i];
                joint
                    .data
                    .set_motor_velocity(JointAxis::AngX, speed, damping);
                torque[i] = -damping * change[i];
            }
        }
        torque
    }

    /// Torque with which the dry friction that was found resisted in the last step \[N m\].
    pub fn friction(&self) -> Joints<f64, N> {
        let dt = self.world.integration_parameters.dt;
        Joints::from_fn(|i, _| {
            let joint = self.friction[i].and_then(|j| self.world.impulse_joints.get(j));
            joint.map_or(0.0, |joint| {
                joint.data.motors[JointAxis::AngX as usize].impulse / dt
            })
        })
    }

    /// Force on the arm over the last step of a handle that holds the tip rigidly \[N\].
    pub fn force_of_handle(&self) -> Option<Plane<f64>> {
        let held = self.held.as_ref()?;
        let joints = &self.world.impulse_joints;
        let dt = self.world.integration_parameters.dt;
        Some(from_fn(|axis| {
            // Rapier counts the impulse on the first body, the handle.
            let impulse = joints
                .get(held.joints[axis])
                .map_or(0.0, |joint| joint.impulses[axis]);
            held.load[axis] - impulse / dt
        }))
    }
}

impl Held {
    fn new(
        world: &mut PhysicsWorld,
        hand: RigidBodyHandle,
        tip: Plane<f64>,
        at: Plane<f64>,
    ) -> Self {
        let handle =
            world.insert_body(RigidBodyBuilder::kinematic_position_based().translation(vector(at)));
        let joints = [JointAxesMask::LIN_X, JointAxesMask::LIN_Y].map(|axis| {
            let joint = GenericJointBuilder::new(axis)
                .local_anchor2(vector(tip))
                .contacts_enabled(false)
                .softness(SpringCoefficients::new(STIFF, 1.0));
            world.insert_impulse_joint(handle, hand, joint)
        });
        Self {
            handle,
            joints,
            load: [0.0; 2],
        }
    }
}

/// The segments, with the speeds with which they come from one step before.
fn links<const N: usize>(
    world: &mut PhysicsWorld,
    chain: &Chain<f64, N>,
    start: &Start<N>,
    dt: f64,
) -> [RigidBodyHandle; N] {
    let way = start.qd * dt;
    let now = frames(chain, &start.q);
    let [earlier, ahead, behind] =
        [start.earlier, start.q + way, start.q - way].map(|q| frames(chain, &q));
    from_fn(|i| {
        let s = &chain.segments()[i];
        let [com, from, next, last] = [&now, &earlier, &ahead, &behind].map(|f| f[i].point(s.com));
        // Rapier holds the joints of turning segments so far apart that they close over the step: so they start.
        let origin = from_fn(|k| now[i].origin[k] + com[k] - 0.5 * (next[k] + last[k]));
        // The first rotor turns against the ground, as the first segment does.
        let rotor = if i == 0 {
            chain.rotor_inertia()[0]
        } else {
            0.0
        };
        world.insert_body(
            RigidBodyBuilder::dynamic()
                .translation(vector(origin))
                .rotation(now[i].angle)
                .linvel(vector(from_fn(|k| (com[k] - from[k]) / dt)))
                // Rapier turns a body with speed ω by atan(ωh).
                .angvel(libm::tan(now[i].angle - earlier[i].angle) / dt)
                .additional_mass_properties(MassProperties::new(
                    vector(s.com),
                    s.mass,
                    s.inertia + rotor,
                ))
                .can_sleep(false)
                .allow_fast_rotation(true),
        )
    })
}

fn joints<const N: usize>(
    world: &mut PhysicsWorld,
    chain: &Chain<f64, N>,
    links: &[RigidBodyHandle; N],
) -> [ImpulseJointHandle; N] {
    let ground = world.insert_body(RigidBodyBuilder::fixed().translation(vector(chain.base())));
    from_fn(|i| {
        let (proximal, end) = match i.checked_sub(1) {
            None => (ground, 0.0),
            Some(before) => (links[before], chain.segments()[before].length),
        };
        let mut joint: GenericJoint = RevoluteJointBuilder::new()
            .local_anchor1(vector([end, 0.0]))
            .contacts_enabled(false)
            .softness(SpringCoefficients::new(STIFF, 1.0))
            .into();
        if i > 0 && chain.rotor_inertia()[i] > 0.0 {
            joint.set_motor_model(JointAxis::AngX, MotorModel::ForceBased);
        }
        world.insert_impulse_joint(proximal, links[i], joint)
    })
}

/// Where a segment is.
struct Frame {
    origin: Plane<f64>,
    angle: f64,
    cos: f64,
    sin: f64,
}

impl Frame {
    /// Where a point of the segment is in the plane \[m\].
    fn point(&self, [x, y]: Plane<f64>) -> Plane<f64> {
        [
            self.origin[0] + x * self.cos - y * self.sin,
            self.origin[1] + x * self.sin + y * self.cos,
        ]
    }
}

fn frames<const N: usize>(chain: &Chain<f64, N>, q: &Joints<f64, N>) -> [Frame; N] {
    let pose = Pose::new(q);
    let mut angle = 0.0;
    from_fn(|i| {
        angle += q[i];
        Frame {
            origin: joint_position(chain, &pose, i),
            angle,
            cos: libm::cos(angle),
            sin: libm::sin(angle),
        }
    })
}

fn parameters<const N: usize>(
    chain: &Chain<f64, N>,
    start: &Start<N>,
    dt: f64,
    settings: &RapierSettings,
) -> IntegrationParameters {
    let rotors = chain.rotor_inertia().iter().skip(1).any(|r| *r > 0.0);
    let motors = rotors || start.dry.contains(&true);
    let times = match (motors, start.handle.is_some()) {
        (true, _) => MOTORS,
        (false, true) => HELD,
        (false, false) => 1,
    };
    IntegrationParameters {
        dt,
        num_solver_iterations: 1,
        num_internal_pgs_iterations: settings.sweeps.saturating_mul(times),
        // A second pass would take out of the speeds what closes the joints over the step, and with it the second order.
        num_internal_stabilization_iterations: 0,
        // Rapier's own start from the impulses of the last step applies them one by one, each after the sweep over those
        // before it has begun; the bodies are loaded with them instead.
        warmstart_joints: false,
        max_ccd_substeps: 0,
        normalized_max_linear_velocity: f64::MAX,
        ..IntegrationParameters::default()
    }
}

fn vector([y, z]: Plane<f64>) -> Vector {
    Vector::new(y, z)
}
