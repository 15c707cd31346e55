//! Forces on the bodies in one step, and the constants of the arm.
//!
//! Positions are known at whole steps and speeds at half steps. A speed at a whole step is extrapolated from the two half
//! steps before it where a force needs it, and the mean of the half steps around it where it is recorded; both are of
//! second order.

use core::array::from_fn;

use arm_core::effect::{MAX_STATES, Motion, States};
use arm_core::{Contact, Joints, Plane, Pose, joint_force};

use super::settings::RapierSettings;
use super::world::{Bodies, Loads, Reaction, Start, World};
use crate::SimulationError;
use crate::closed_chain::model::{Link, Model};
use crate::closed_chain::state::Input;
use crate::integrators::friction::{self, Friction};
use crate::preparation::prepared_run::Prepared;
use crate::recording::recorder::Forces;

/// An arm on its way.
pub(super) struct Arm<'a, const N: usize> {
    model: &'a Model<f64, N>,
    world: World<N>,
    dt: f64,
    /// What the bodies do now.
    bodies: Bodies<N>,
    /// Speeds now, extrapolated.
    speeds: Speeds<N>,
    /// Speeds half a step before now.
    before: Speeds<N>,
    /// Force through each joint now, extrapolated \[N\].
    joint_force: [f64; N],
    /// What the joints did in the step before.
    reaction: Reaction<N>,
    /// States of the effects.
    pub memory: Vec<States<f64>>,
    rates: Vec<States<f64>>,
    middle: Vec<States<f64>>,
}

#[derive(Clone, Copy, Debug)]
struct Speeds<const N: usize> {
    /// Joint speeds \[rad/s\].
    joints: Joints<f64, N>,
    /// Velocity of the tip \[m/s\].
    tip: Plane<f64>,
}

/// What is known of an instant once the step from it is made.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample<const N: usize> {
    pub q: Joints<f64, N>,
    pub qd: Joints<f64, N>,
    pub forces: Forces<f64, N>,
    /// By handle and drive, against resistance and damping \[W\].
    pub power: [f64; 4],
    /// Half a step later.
    middle: Motion<f64, N>,
}

impl<'a, const N: usize> Arm<'a, N> {
    pub fn new(
        prepared: &'a Prepared<'a, N>,
        settings: &RapierSettings,
    ) -> Result<Self, SimulationError> {
        let (model, dt) = (&prepared.model, prepared.schedule.dt);
        let (q, qd) = prepared.start;
        let memory = vec![[0.0; MAX_STATES]; model.effects.len()];
        let input = prepared.input(0.0);
        // How a motion begins is, besides the laws of the effects, all that the engines share.
        let (first, _) = friction::at(model, &input, (&q, &qd), &memory);
        let (qdd, force) = (first.qdd, first.force_on_arm);
        let earlier = q - qd * dt + qdd * (0.5 * dt * dt);
        let start = Start {
            q,
            qd,
            earlier,
            handle: matches!(model.link, Link::Rigid).then_some(input.handle.position),
            placement: prepared.setup.placement,
            dry: model.dry,
        };
        let mut world = World::new(&model.chain, &start, dt, settings)?;
        let bodies = world.read();
        let pose = Pose::new(&q);
        Ok(Self {
            model,
            world,
            dt,
            speeds: Speeds {
                joints: qd,
                tip: model.tip_velocity(&qd, &pose),
            },
            before: Speeds {
                joints: bodies.qd,
                tip: rate(model.tip(&earlier, &Pose::new(&earlier)), bodies.tip, dt),
            },
            bodies,
            joint_force: first.joint_force,
            reaction: Reaction {
                change: qdd * dt,
                force: joint_force(&model.chain, &pose, (&qd, &qdd), force),
                handle: force,
            },
            rates: memory.clone(),
            middle: memory.clone(),
            memory,
        })
    }

    /// Makes the step from `input` to `next`, and returns its beginning.
    ///
    /// # Errors
    /// The first joint whose state ceased to be finite.
    pub fn step(
        &mut self,
        input: &Input<f64, N>,
        next: &Input<f64, N>,
    ) -> Result<Sample<N>, usize> {
        let (model, now, dt) = (self.model, self.bodies, self.dt);
        let mut motion = input.motion(&now.q, &self.speeds.joints);
        motion.joint_force = self.joint_force;
        let resisting = model.resisting(&motion, &self.memory);
        let (pull, damping) = match &model.link {
            Link::Compliant(contact) => self.contact(contact, input),
            Link::Free | Link::Forced(_) | Link::Rigid => ([0.0; 2], 0.0),
        };
        let (mut friction, sticky) = self.friction(&motion);
        let loads = Loads {
            torque: input.torque - resisting - friction.torque,
            force_on_arm: pull,
            sticky,
        };
        self.world
            .step(&now, &loads, &self.reaction, next.handle.position)?;
        friction.torque += self.world.friction();
        let after = self.world.read();
        let finite = |i: &usize| after.q[*i].is_finite() && after.qd[*i].is_finite();
        if let Some(joint) = (0..N).find(|i| !finite(i)) {
            return Err(joint);
        }

        let held = self.world.force_of_handle();
        let reaction = self.reaction(&after, held.unwrap_or(pull));
        let through = reaction.force.map(|[y, z]| (y * y + z * z).sqrt());
        let qd = (now.qd + after.qd) * 0.5;
        let (force, v) = (reaction.handle, input.handle.velocity);
        let sample = Sample {
            q: now.q,
            qd,
            forces: Forces {
                qdd: reaction.change / dt,
                force_on_arm: force,
                joint_force: through,
                friction: model.has_dry.then_some(friction),
            },
            power: [
                force[0] * v[0] + force[1] * v[1],
                dot(&input.torque, &qd),
                dot(&(resisting + friction.torque), &qd),
                damping,
            ],
            middle: Motion {
                time: input.time + 0.5 * dt,
                q: (now.q + after.q) * 0.5,
                qd: after.qd,
                qdd: reaction.change / dt,
                joint_force: through,
                activity: core::array::from_fn(|j| 0.5 * (input.activity[j] + next.activity[j])),
            },
        };
        self.advance(after, reaction);
        Ok(sample)
    }

    /// Dry friction of joints that slip in this step for certain, and what it is at most in the others, where rapier finds it.
    fn friction(&self, motion: &Motion<f64, N>) -> (Friction<f64, N>, Joints<f64, N>) {
        /// How much faster a joint that keeps its direction is than what a step, or friction in it, changes of its speed.
        const CERTAIN: f64 = 4.0;
        let inertia = |i: usize| self.model.chain.segments()[i].inertia;
        let most = self.model.dry_friction(motion, &self.memory);
        let (mut torque, mut sticky) = (Joints::zeros(), Joints::zeros());
        for j in (0..N).filter(|&j| self.model.dry[j]) {
            let (speed, change) = (self.before.joints[j], self.reaction.change[j]);
            // Segments that nothing else holds would give way most.
            let proximal = if j == 0 { 0.0 } else { 1.0 / inertia(j - 1) };
            let stopped = self.dt * most[j] * (proximal + 1.0 / inertia(j));
            if speed.abs() > CERTAIN * change.abs() + stopped {
                torque[j] = most[j] * speed.signum();
            } else {
                sticky[j] = most[j];
            }
        }
        (Friction { torque, most }, sticky)
    }

    /// Force of a compliant contact on the arm \[N\], and the power lost in its damping \[W\].
    fn contact(&self, contact: &Contact<f64>, input: &Input<f64, N>) -> (Plane<f64>, f64) {
        let handle = &input.handle;
        let gap = from_fn(|k| handle.position[k] - self.bodies.tip[k]);
        let rate: Plane<f64> = from_fn(|k| handle.velocity[k] - self.speeds.tip[k]);
        let force = contact.force_on_arm(gap, rate);
        let spring = contact.force_on_arm(gap, [0.0; 2]);
        let lost = (force[0] - spring[0]) * rate[0] + (force[1] - spring[1]) * rate[1];
        (force, lost)
    }

    /// What the joints have done in the step to `after`: by Newton's law for all bodies beyond each joint.
    fn reaction(&self, after: &Bodies<N>, force_on_arm: Plane<f64>) -> Reaction<N> {
        let chain = &self.model.chain;
        let gravity = chain.gravity();
        let mut sum = force_on_arm.map(|f| -f);
        let mut force = [[0.0; 2]; N];
        for (i, segment) in chain.segments().iter().enumerate().rev() {
            for k in 0..2 {
                let change = after.velocity[i][k] - self.bodies.velocity[i][k];
                sum[k] += segment.mass * (change / self.dt - gravity[k]);
            }
            force[i] = sum;
        }
        Reaction {
            change: after.qd - self.bodies.qd,
            force,
            handle: force_on_arm,
        }
    }

    fn advance(&mut self, after: Bodies<N>, reaction: Reaction<N>) {
        let half_step = Speeds {
            joints: after.qd,
            tip: rate(self.bodies.tip, after.tip, self.dt),
        };
        let ahead = |now: f64, before: f64| now + 0.5 * (now - before);
        self.speeds = Speeds {
            joints: half_step.joints.zip_map(&self.before.joints, ahead),
            tip: from_fn(|k| ahead(half_step.tip[k], self.before.tip[k])),
        };
        self.joint_force = from_fn(|i| {
            let ([y, z], [y_before, z_before]) = (reaction.force[i], self.reaction.force[i]);
            libm::hypot(2.0 * y - y_before, 2.0 * z - z_before)
        });
        (self.before, self.bodies, self.reaction) = (half_step, after, reaction);
    }

    /// Advances the states of the effects by the midpoint rule.
    pub fn remember(&mut self, sample: &Sample<N>) {
        if !self.model.has_memory {
            return;
        }
        let start = Motion {
            time: sample.middle.time - 0.5 * self.dt,
            q: sample.q,
            qd: sample.qd,
            ..sample.middle
        };
        let (memory, rates) = (&mut self.memory, &mut self.rates);
        self.model.memory_rates(&start, memory, rates);
        let from = memory.as_flattened().iter().zip(rates.as_flattened());
        for (middle, (state, rate)) in self.middle.as_flattened_mut().iter_mut().zip(from) {
            *middle = state + 0.5 * self.dt * rate;
        }
        self.model.memory_rates(&sample.middle, &self.middle, rates);
        let rates = rates.as_flattened();
        for (state, rate) in memory.as_flattened_mut().iter_mut().zip(rates) {
            *state += self.dt * rate;
        }
    }
}

fn rate(from: Plane<f64>, to: Plane<f64>, time: f64) -> Plane<f64> {
    from_fn(|k| (to[k] - from[k]) / time)
}

fn dot<const N: usize>(a: &Joints<f64, N>, b: &Joints<f64, N>) -> f64 {
    a.iter().zip(b.iter()).fold(0.0, |sum, (a, b)| sum + a * b)
}
