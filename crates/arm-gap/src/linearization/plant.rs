//! The equation of motion of a led arm at one instant: its residual, and the force that moves the arm.

use arm_core::effect::{Effect, Motion, Place, States, dry_friction, resisting_besides_dry};
use arm_core::{
    Chain, Contact, Joints, Placement, Plane, Pose, Setup, inverse_dynamics, jacobian, joint_force,
    static_torque, tip,
};
use arm_sim::SimulationError;

use crate::data::course::Course;
use crate::data::session::Session;
use crate::hypothesis::Hypothesis;
use crate::measurement_model::start::{at_rest, creeps, is_set_valued_friction};

/// What moves a led arm, besides its own state.
pub(super) struct Plant<const N: usize> {
    pub setup: Setup<f64, N>,
    chain: Chain<f64, N>,
    contact: Contact<f64>,
    /// Effects that resist in joints: they alone count in every step.
    pub resisting: Vec<Effect<f64>>,
    /// Effects that the sensors show.
    pub sensing: Vec<Effect<f64>>,
    /// Whether the forces through the joints count.
    pub feels_force: bool,
    /// Whether some joint has dry friction that is set-valued,
    pub dry: bool,
    /// and whether some has smooth friction.
    pub creeps: bool,
}

impl<const N: usize> Plant<N> {
    /// * `rhythms` - of the trial; see [`Course::rhythms`]
    pub fn new(
        session: &Session<N>,
        hypothesis: &Hypothesis<N>,
        rhythms: &[Effect<f64>],
    ) -> Result<Self, SimulationError> {
        let setup = session.rig(hypothesis)?;
        let effects = hypothesis.effects().into_iter();
        let (resisting, mut sensing): (Vec<_>, Vec<_>) = effects
            .chain(rhythms.iter().copied())
            .filter(|e| e.on)
            .partition(|e| e.kind.info().place == Place::Joint);
        // Most errors of sensors are tested and none.
        sensing.retain(|e| e.parameters.iter().any(|p| *p != 0.0));
        Ok(Self {
            chain: setup.chain()?,
            contact: setup.contact,
            dry: resisting.iter().any(is_set_valued_friction),
            creeps: resisting.iter().any(creeps),
            feels_force: setup.base_motion != [0.0; 2]
                || resisting.iter().any(|e| e.kind.feels_force()),
            setup,
            resisting,
            sensing,
        })
    }

    /// The same without what resists in joints.
    pub fn without_effects(&self) -> Self {
        Self {
            resisting: Vec::new(),
            sensing: Vec::new(),
            dry: false,
            creeps: false,
            ..*self
        }
    }

    /// The same with joint effects as they act at rest.
    pub fn at_rest(&self) -> Self {
        let resting = at_rest(&self.resisting);
        Self {
            dry: resting.iter().any(is_set_valued_friction),
            creeps: false,
            resisting: resting,
            sensing: Vec::new(),
            ..*self
        }
    }

    /// The chain as seen from its base where that is another one, and how far and how fast the base has moved, with the first joint and by itself.
    ///
    /// A base that is accelerated is one that stands in another gravity.
    fn based(&self, state: &State<N>, base: Base) -> (Option<Chain<f64, N>>, [Plane<f64>; 2]) {
        let u = self.setup.base_motion;
        if u == [0.0; 2] && self.setup.heave.is_still() && base.is_none() {
            return (None, [[0.0; 2]; 2]);
        }
        let angle = state.q[0] - self.setup.base_rest;
        let [mut at, mut rate, mut acceleration] = self.setup.heave.at(state.time);
        let [further, faster, growing] = base.unwrap_or_default();
        for axis in 0..2 {
            at[axis] += u[axis] * angle + further[axis];
            rate[axis] += u[axis] * state.qd[0] + faster[axis];
            acceleration[axis] += u[axis] * state.qdd[0] + growing[axis];
        }
        let gravity = [0, 1].map(|axis| self.setup.gravity[axis] - acceleration[axis]);
        (Some(self.chain.with_gravity(gravity)), [at, rate])
    }

    /// Most that the set-valued dry friction of each joint can resist with \[N m\].
    pub fn friction(&self, motion: &Motion<f64, N>, memory: &[States<f64>]) -> Joints<f64, N> {
        match self.dry {
            true => Joints::from(dry_friction(&self.resisting, motion, memory)),
            false => Joints::zeros(),
        }
    }

    /// Position and velocity of the handle as it stands in the hand.
    fn handle(&self, time: f64, hand: Hand) -> [Plane<f64>; 2] {
        let [mut at, mut rate] = [hand.at, hand.rate];
        if self.setup.displaced.is_somewhere() {
            let [position, velocity, _] = self.setup.displaced.at(time);
            for axis in 0..2 {
                at[axis] += position[axis];
                rate[axis] += velocity[axis];
            }
        }
        [at, rate]
    }
}

/// What leads the arm at one instant.
#[derive(Clone, Copy)]
pub(super) struct Hand {
    /// Position of the handle \[m\].
    at: Plane<f64>,
    /// Its velocity \[m/s\].
    rate: Plane<f64>,
    base: Base,
}

/// How far the base is from its place \[m\], its velocity \[m/s\] and its acceleration \[m/s²\], where its path was measured.
type Base = Option<[Plane<f64>; 3]>;

/// The arm's own state at one instant.
#[derive(Clone, Copy)]
pub(super) struct State<const N: usize> {
    pub time: f64,
    pub q: Joints<f64, N>,
    pub qd: Joints<f64, N>,
    pub qdd: Joints<f64, N>,
    /// At these angles, where everything about a run is computed.
    pose: Pose<f64, N>,
}

impl<const N: usize> State<N> {
    pub fn new(time: f64, [q, qd, qdd]: [Joints<f64, N>; 3]) -> Self {
        let pose = Pose::new(&q);
        Self {
            time,
            q,
            qd,
            qdd,
            pose,
        }
    }

    /// Another motion at the same instant.
    pub fn beside(&self, [q, qd, qdd]: [Joints<f64, N>; 3]) -> Self {
        match q == self.q {
            true => Self { qd, qdd, ..*self },
            false => Self::new(self.time, [q, qd, qdd]),
        }
    }

    /// The state with changes on it.
    pub fn moved(&self, q: &Joints<f64, N>, qd: &Joints<f64, N>, qdd: &Joints<f64, N>) -> Self {
        self.beside([self.q + q, self.qd + qd, self.qdd + qdd])
    }

    /// The motion as the input of the states of effects.
    pub fn motion(&self) -> Motion<f64, N> {
        let mut motion = Motion::new(self.time, self.q, self.qd);
        motion.qdd = self.qdd;
        motion
    }
}

/// The balance of the equation of motion for a state.
#[derive(Clone, Copy)]
pub(super) struct Balance<const N: usize> {
    /// Torque left over besides set-valued dry friction.
    pub torque: Joints<f64, N>,
    /// What joint effects resist with, which is part of it.
    pub resisted: Joints<f64, N>,
    /// Most that this friction can resist with.
    pub friction: Joints<f64, N>,
    /// Force on the arm.
    pub force: Plane<f64>,
    /// The motion as the input of joint effects.
    pub motion: Motion<f64, N>,
}

pub(super) fn balance<const N: usize>(
    plant: &Plant<N>,
    state: &State<N>,
    hand: Hand,
    memory: &[States<f64>],
) -> Balance<N> {
    let pose = &state.pose;
    let [at, rate] = plant.handle(state.time, hand);
    let (other, [shift, drift]) = plant.based(state, hand.base);
    let chain = other.as_ref().unwrap_or(&plant.chain);
    let place = tip(chain, pose);
    let moving = jacobian(chain, pose) * state.qd;
    let placement = Placement::of(&plant.setup);
    let beside = placement.map_or([0.0; 2], |p| p.arm(pose));
    let turning = placement.map_or([0.0; 2], |p| p.velocity(pose, &state.qd));
    let force = plant.contact.force_on_arm(
        [0, 1].map(|a| at[a] - place[a] - beside[a] - shift[a]),
        [0, 1].map(|a| rate[a] - moving[a] - turning[a] - drift[a]),
    );
    let moment = placement.map_or(0.0, |p| p.moment(pose, force));
    let mut motion = state.motion();
    let mut torque = inverse_dynamics(chain, pose, &state.qd, &state.qdd)
        - static_torque(chain, pose, force, moment);
    if plant.feels_force {
        let through = joint_force(chain, pose, (&state.qd, &state.qdd), force);
        motion = motion.with_joint_force(&through);
        // The guide of a moving base carries the force through the first joint.
        let u = plant.setup.base_motion;
        torque[0] += u[0] * through[0][0] + u[1] * through[0][1];
    }
    let resisted = resisting_besides_dry(&plant.resisting, &motion, memory);
    Balance {
        torque: torque + resisted,
        resisted,
        friction: plant.friction(&motion, memory),
        force,
        motion,
    }
}

/// Where handle and base are at every step.
pub(super) fn hands<const N: usize>(
    course: &Course<N>,
    hypothesis: &Hypothesis<N>,
    (count, step): (usize, f64),
) -> Result<Vec<Hand>, SimulationError> {
    let path = course.handle_path(hypothesis)?;
    let (_, end) = path.span();
    let hand = |i: usize| {
        let time = (i as f64 * step).min(end);
        let handle = path.at(time);
        let base = course.base.as_ref().map(|path| path.at(time));
        Hand {
            at: handle.position,
            rate: handle.velocity,
            base: base.map(|jet| [jet.value, jet.rate, jet.curvature]),
        }
    };
    Ok((0..count).map(hand).collect())
}
