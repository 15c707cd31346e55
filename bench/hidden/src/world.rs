//! The arm as rapier holds it: a body for each segment, joints that hinge them, and motors that rub.

use rapier2d_f64::prelude::{
    GenericJoint, GenericJointBuilder, ImpulseJointHandle, IntegrationParameters, JointAxesMask,
    JointAxis, MassProperties, MotorModel, PhysicsWorld, RevoluteJointBuilder, RigidBodyBuilder,
    RigidBodyHandle, SpringCoefficients, Vector,
};

use crate::effect::Loads;
use crate::rig::{BasePath, Plane, Rig};

/// Hertz. So stiff that a gap of a hinge is closed within one step.
const STIFF: f64 = 1e9;
/// Sweeps of the solver over all hinges in a step.
const SWEEPS: usize = 8;
/// The same where motors rub or rotors turn, which the hinges have to agree with: with 24 what sticks creeps, and loses a
/// twentieth of its torque in half a second.
const SWEEPS_WITH_MOTORS: usize = 60;

/// What the bodies do between two steps. Speeds are those of the step that led here: of half a step ago.
#[derive(Clone, Debug)]
pub(crate) struct Bodies {
    /// Joint angles \[rad\].
    pub q: Vec<f64>,
    /// Joint speeds \[rad/s\].
    pub qd: Vec<f64>,
    /// Velocities of the centres of mass \[m/s\].
    velocity: Vec<Plane>,
}

/// An arm of rigid bodies.
pub(crate) struct World {
    world: PhysicsWorld,
    rig: Rig,
    ground: RigidBodyHandle,
    links: Vec<RigidBodyHandle>,
    /// Motors for dry friction and for rotors, beside the hinges.
    rubbing: Vec<ImpulseJointHandle>,
    turning: Vec<Option<ImpulseJointHandle>>,
    /// Damping of a motor that rubs \[N m s/rad\]; the larger, the sharper.
    grip: f64,
    step: f64,
    /// Link angles, followed over full turns \[rad\].
    angles: Vec<f64>,
    /// Force of the proximal side on each link in the last step \[N\].
    pub reaction: Vec<Plane>,
    /// Change of the joint speeds in the last step \[rad/s\].
    change: Vec<f64>,
}

impl World {
    /// The arm at rest.
    ///
    /// * `dry` - whether anything rubs
    /// * `grip` - damping of dry friction where it sticks \[N m s/rad\]
    pub fn new(rig: &Rig, q: &[f64], step: f64, (dry, grip): (bool, f64)) -> Self {
        let mut world = empty(rig, step, dry);
        let (points, angles) = rig.points(q);
        let links = insert_links(&mut world, rig, (&points, &angles));
        let ground = match rig.base_path {
            BasePath::Fixed => RigidBodyBuilder::fixed(),
            _ => RigidBodyBuilder::kinematic_position_based(),
        };
        let ground = world.insert_body(ground.translation(vector(points[0])));
        let (mut rubbing, mut turning) = (Vec::new(), Vec::new());
        for i in 0..rig.size() {
            let (before, end) = match i {
                0 => (ground, 0.0),
                _ => (links[i - 1], rig.links[i - 1].length),
            };
            let hinge: GenericJoint = RevoluteJointBuilder::new()
                .local_anchor1(vector([end, 0.0]))
                .contacts_enabled(false)
                .softness(SpringCoefficients::new(STIFF, 1.0))
                .into();
            world.insert_impulse_joint(before, links[i], hinge);
            let motor = || {
                GenericJointBuilder::new(JointAxesMask::empty())
                    .contacts_enabled(false)
                    .motor_model(JointAxis::AngX, MotorModel::ForceBased)
            };
            if dry {
                rubbing.push(world.insert_impulse_joint(before, links[i], motor()));
            }
            let rotor = rig.rotors[i] > 0.0;
            turning.push(rotor.then(|| world.insert_impulse_joint(before, links[i], motor())));
        }
        Self {
            world,
            rig: rig.clone(),
            ground,
            links,
            rubbing,
            turning,
            grip,
            step,
            angles,
            reaction: vec![[0.0; 2]; rig.size()],
            change: vec![0.0; rig.size()],
        }
    }

    /// What the bodies do now.
    pub fn read(&mut self) -> Bodies {
        let (mut angle_before, mut speed_before) = (0.0, 0.0);
        let mut bodies = Bodies {
            q: Vec::new(),
            qd: Vec::new(),
            velocity: Vec::new(),
        };
        for (link, angle) in self.links.iter().zip(&mut self.angles) {
            let body = &self.world.bodies[*link];
            let rotation = body.rotation();
            let within_turn = libm::atan2(rotation.im, rotation.re);
            let turn = core::f64::consts::TAU;
            *angle = within_turn + turn * libm::round((*angle - within_turn) / turn);
            bodies.q.push(*angle - angle_before);
            bodies.qd.push(body.angvel() - speed_before);
            bodies.velocity.push(body.linvel().into());
            (angle_before, speed_before) = (*angle, body.angvel());
        }
        bodies
    }

    /// Makes a step under loads and a force on the hand at a point of the last segment (along it and across, \[m\]).
    ///
    /// # Errors
    /// The first joint whose segment has no finite place any more.
    pub fn step(
        &mut self,
        now: &Bodies,
        loads: &Loads,
        (force, grip_point): (Plane, Plane),
    ) -> Result<(), usize> {
        let size = self.links.len();
        self.set_motors(now, loads);
        for i in 0..size {
            let mut torque = -loads.resist[i] - self.rotor_torque(i);
            if i + 1 < size {
                torque += loads.resist[i + 1] + self.rotor_torque(i + 1);
            }
            let body = &mut self.world.bodies[self.links[i]];
            body.reset_forces(false);
            body.reset_torques(false);
            body.add_torque(torque, true);
        }
        // The bodies are loaded with what the hinges did in the last step; the solver finds the rest.
        for i in 0..size {
            let at = self.world.bodies[self.links[i]].translation().into();
            let [y, z] = self.reaction[i];
            self.pull(i, [y, z], at);
            if i > 0 {
                self.pull(i - 1, [-y, -z], at);
            }
        }
        for (link, at, push) in &loads.pushes {
            self.pull(*link, *push, *at);
        }
        let hand = size - 1;
        let at: Plane = self.world.bodies[self.links[hand]]
            .position()
            .transform_point(vector(grip_point))
            .into();
        self.pull(hand, force, at);
        self.move_base(now);
        self.world.step();
        let lost = self.world.physics_pipeline.quarantine().bodies();
        let missing = |link: &RigidBodyHandle| lost.contains(link);
        self.links.iter().position(missing).map_or(Ok(()), Err)
    }

    /// Takes note of what the hinges did in the step from `before` to `after`: Newton's law for all beyond each of them.
    pub fn note(&mut self, before: &Bodies, after: &Bodies, loads: &Loads, force: Plane) {
        let mut sum = force.map(|f| -f);
        for i in (0..self.links.len()).rev() {
            let mut mass = self.rig.links[i].mass;
            if i + 1 == self.links.len() {
                mass += self.rig.hand_mass;
            }
            for k in 0..2 {
                let change = after.velocity[i][k] - before.velocity[i][k];
                sum[k] += mass * (change / self.step - self.rig.gravity[k]);
                for (_, _, push) in loads.pushes.iter().filter(|(link, ..)| *link == i) {
                    sum[k] -= push[k];
                }
            }
            self.reaction[i] = sum;
            self.change[i] = after.qd[i] - before.qd[i];
        }
    }

    /// Adds a force to a segment at a point of the plane.
    ///
    /// Not `add_force_at_point`: before the first step rapier does not know where the centre of mass is.
    fn pull(&mut self, link: usize, force: Plane, at: Plane) {
        let properties = &self.rig.links[link];
        let mut com = properties.com;
        if link + 1 == self.links.len() && self.rig.hand_mass > 0.0 {
            let moment = properties.mass * com + self.rig.hand_mass * properties.length;
            com = moment / (properties.mass + self.rig.hand_mass);
        }
        let body = &mut self.world.bodies[self.links[link]];
        let com = body.position().transform_point(vector([com, 0.0]));
        let arm = [at[0] - com.x, at[1] - com.y];
        body.add_force(vector(force), true);
        body.add_torque(arm[0] * force[1] - arm[1] * force[0], true);
    }

    /// Dry friction is a motor that wants the joint to stand and may only pull so much. A rotor is a motor that wants it to go
    /// on as expected, with the torque that its inertia has over a step.
    fn set_motors(&mut self, now: &Bodies, loads: &Loads) {
        let joints = &mut self.world.impulse_joints;
        for (i, handle) in self.rubbing.iter().enumerate() {
            let side = usize::from(now.qd[i] < 0.0);
            if let Some(joint) = joints.get_mut(*handle, false) {
                joint
                    .data
                    .set_motor_velocity(JointAxis::AngX, 0.0, self.grip)
                    .set_motor_max_force(JointAxis::AngX, loads.dry[i][side]);
            }
        }
        for (i, handle) in self.turning.iter().enumerate() {
            if let Some(joint) = handle.and_then(|handle| joints.get_mut(handle, false)) {
                let inertia = self.rig.rotors[i];
                let speed = now.qd[i] + self.change[i];
                joint
                    .data
                    .set_motor_velocity(JointAxis::AngX, speed, inertia / self.step);
            }
        }
    }

    /// Torque with which a rotor resists if the joint goes on as in the last step \[N m\].
    fn rotor_torque(&self, joint: usize) -> f64 {
        self.rig.rotors[joint] * self.change[joint] / self.step
    }

    fn move_base(&mut self, now: &Bodies) {
        if self.rig.base_path != BasePath::Fixed {
            let next = now.q[0] + self.step * (now.qd[0] + self.change[0]);
            let (shift, _) = self.rig.base_path.at(next);
            let base = self.rig.base;
            self.world.bodies[self.ground]
                .set_next_kinematic_translation(vector([base[0] + shift[0], base[1] + shift[1]]));
        }
    }
}

/// A world without bodies.
fn empty(rig: &Rig, step: f64, dry: bool) -> PhysicsWorld {
    let rotors = rig.rotors.iter().any(|r| *r > 0.0);
    PhysicsWorld {
        gravity: vector(rig.gravity),
        integration_parameters: IntegrationParameters {
            dt: step,
            num_solver_iterations: 1,
            num_internal_pgs_iterations: if dry || rotors {
                SWEEPS_WITH_MOTORS
            } else {
                SWEEPS
            },
            // What a second pass would change is the half step by which speeds and places differ in time.
            num_internal_stabilization_iterations: 0,
            warmstart_joints: false,
            max_ccd_substeps: 0,
            normalized_max_linear_velocity: f64::MAX,
            ..IntegrationParameters::default()
        },
        ..PhysicsWorld::default()
    }
}

/// The links where they are, with what the hand holds on the last.
fn insert_links(
    world: &mut PhysicsWorld,
    rig: &Rig,
    (points, angles): (&[Plane], &[f64]),
) -> Vec<RigidBodyHandle> {
    let last = rig.size() - 1;
    (0..rig.size())
        .map(|i| {
            let link = &rig.links[i];
            let mut mass = MassProperties::new(vector([link.com, 0.0]), link.mass, link.inertia);
            if i == last && rig.hand_mass > 0.0 {
                mass += MassProperties::new(vector([link.length, 0.0]), rig.hand_mass, 0.0);
            }
            world.insert_body(
                RigidBodyBuilder::dynamic()
                    .translation(vector(points[i]))
                    .rotation(angles[i])
                    .additional_mass_properties(mass)
                    .can_sleep(false)
                    .allow_fast_rotation(true),
            )
        })
        .collect()
}

fn vector([y, z]: Plane) -> Vector {
    Vector::new(y, z)
}
