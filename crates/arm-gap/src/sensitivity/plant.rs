//! The equation of motion of a led arm at one instant: what is left over of it, and the force that moves the arm.

use arm_core::effect::{Effect, Motion, Place, States, dry_friction, resisting_besides_dry};
use arm_core::{
    Chain, Contact, Joints, Placement, Plane, Pose, Setup, inverse_dynamics, jacobian, joint_force,
    static_torque, tip,
};
use arm_sim::{HandlePath, SimulationError};

use crate::data::session::Session;
use crate::measurement_model::hypothesis::Hypothesis;
use crate::measurement_model::start::is_rubbing;

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
    /// Whether some joint has dry friction that is set-valued.
    pub dry: bool,
}

impl<const N: usize> Plant<N> {
    pub fn new(session: &Session<N>, hypothesis: &Hypothesis<N>) -> Result<Self, SimulationError> {
        let setup = session.rig(hypothesis)?;
        let (resisting, sensing): (Vec<_>, Vec<_>) = hypothesis
            .effects()
            .into_iter()
            .filter(|e| e.on)
            .partition(|e| e.kind.info().place == Place::Joint);
        Ok(Self {
            chain: setup.chain()?,
            contact: setup.contact,
            dry: resisting.iter().any(is_rubbing),
            feels_force: setup.base_motion != [0.0; 2]
                || resisting.iter().any(|e| e.kind.feels_force()),
            setup,
            resisting,
            sensing,
        })
    }

    /// The chain as seen from its base, and how far and how fast the base has moved with the first joint.
    ///
    /// A base that is accelerated is one that stands in another gravity.
    fn based(&self, state: &State<N>) -> (Chain<f64, N>, Hand) {
        let u = self.setup.base_motion;
        if u == [0.0; 2] {
            return (self.chain, ([0.0; 2], [0.0; 2]));
        }
        let angle = state.q[0] - self.setup.base_rest;
        let mut setup = self.setup;
        for axis in 0..2 {
            setup.gravity[axis] -= u[axis] * state.qdd[0];
        }
        // The segments were accepted before, and gravity may be any.
        let chain = setup.chain().unwrap_or(self.chain);
        (chain, (u.map(|u| u * angle), u.map(|u| u * state.qd[0])))
    }

    /// Most that the set-valued dry friction of each joint can resist with \[N m\].
    pub fn friction(&self, motion: &Motion<f64, N>, memory: &[States<f64>]) -> Joints<f64, N> {
        match self.dry {
            true => Joints::from(dry_friction(&self.resisting, motion, memory)),
            false => Joints::zeros(),
        }
    }

    /// What joint effects resist with where joints slip in given directions (1, −1, and 0 for none) \[N m\].
    pub fn resisted(
        &self,
        motion: &Motion<f64, N>,
        memory: &[States<f64>],
        way: &Joints<f64, N>,
    ) -> Joints<f64, N> {
        resisting_besides_dry(&self.resisting, motion, memory)
            + self.friction(motion, memory).component_mul(way)
    }

    /// The handle as it stands in the hand.
    fn handle(&self, time: f64, (mut at, mut rate): Hand) -> Hand {
        if self.setup.displaced.is_somewhere() {
            let [position, velocity, _] = self.setup.displaced.at(time);
            for axis in 0..2 {
                at[axis] += position[axis];
                rate[axis] += velocity[axis];
            }
        }
        (at, rate)
    }
}

/// Position and velocity of the handle.
pub(super) type Hand = (Plane<f64>, Plane<f64>);

/// The arm's own state at one instant.
#[derive(Clone, Copy)]
pub(super) struct State<const N: usize> {
    pub time: f64,
    pub q: Joints<f64, N>,
    pub qd: Joints<f64, N>,
    pub qdd: Joints<f64, N>,
}

impl<const N: usize> State<N> {
    /// The state with changes on it.
    pub fn moved(&self, q: &Joints<f64, N>, qd: &Joints<f64, N>, qdd: &Joints<f64, N>) -> Self {
        Self {
            time: self.time,
            q: self.q + q,
            qd: self.qd + qd,
            qdd: self.qdd + qdd,
        }
    }

    /// The motion as the states of effects see it.
    pub fn motion(&self) -> Motion<f64, N> {
        let mut motion = Motion::new(self.time, self.q, self.qd);
        motion.qdd = self.qdd;
        motion
    }
}

/// What the equation of motion says of a state.
#[derive(Clone, Copy)]
pub(super) struct Balance<const N: usize> {
    /// Torque left over besides set-valued dry friction.
    pub torque: Joints<f64, N>,
    /// Most that this friction can resist with.
    pub friction: Joints<f64, N>,
    /// Force on the arm.
    pub force: Plane<f64>,
    /// The motion as joint effects see it.
    pub motion: Motion<f64, N>,
}

pub(super) fn balance<const N: usize>(
    plant: &Plant<N>,
    state: &State<N>,
    hand: Hand,
    memory: &[States<f64>],
) -> Balance<N> {
    let pose = Pose::new(&state.q);
    let (at, rate) = plant.handle(state.time, hand);
    let (chain, (shift, drift)) = plant.based(state);
    let place = tip(&chain, &pose);
    let moving = jacobian(&chain, &pose) * state.qd;
    let placement = Placement::of(&plant.setup);
    let beside = placement.map_or([0.0; 2], |p| p.arm(&pose));
    let turning = placement.map_or([0.0; 2], |p| p.velocity(&pose, &state.qd));
    let force = plant.contact.force_on_arm(
        [0, 1].map(|a| at[a] - place[a] - beside[a] - shift[a]),
        [0, 1].map(|a| rate[a] - moving[a] - turning[a] - drift[a]),
    );
    let moment = placement.map_or(0.0, |p| p.moment(&pose, force));
    let mut motion = state.motion();
    let mut torque = inverse_dynamics(&chain, &pose, &state.qd, &state.qdd)
        - static_torque(&chain, &pose, force, moment);
    if plant.feels_force {
        let through = joint_force(&chain, &pose, (&state.qd, &state.qdd), force);
        motion = motion.with_joint_force(&through);
        // The guide of a moving base carries the force through the first joint.
        let u = plant.setup.base_motion;
        torque[0] += u[0] * through[0][0] + u[1] * through[0][1];
    }
    torque += resisting_besides_dry(&plant.resisting, &motion, memory);
    Balance {
        torque,
        friction: plant.friction(&motion, memory),
        force,
        motion,
    }
}

/// Where the handle is at every step.
pub(super) fn hands<const N: usize>(path: &HandlePath<N>, count: usize, step: f64) -> Vec<Hand> {
    let (_, end) = path.span();
    (0..count)
        .map(|i| {
            let handle = path.at((i as f64 * step).min(end));
            (handle.position, handle.velocity)
        })
        .collect()
}
