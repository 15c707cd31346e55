//! Responses of a led arm to small changes, along a linearised run.
//!
//! A change of the rig, an effect or the handle's path leaves a residual torque in the equation of motion of the run. The arm responds as a
//! linear system with coefficients that follow the run. A hundred candidates cost less than one simulation each.

use arm_core::effect::{Effect, any_state, dry_friction, resisting_besides_dry};
use arm_core::{Joints, Plane};
use arm_sim::SimulationError;

use crate::data::course::{Channels, smooth};
use crate::hypothesis::Hypothesis;
use crate::linearization::linearized_run::{ASTRAY, Linear};
use crate::linearization::origin::Origin;
use crate::linearization::plant::{Balance, Hand, Plant, balance, hands};
use crate::measurement_model::joint_torques::multiset_difference;
use crate::measurement_model::start::held_at_start;

/// Response of the channels to one unit of a number, by group.
#[derive(Clone, Debug)]
pub struct Response(pub Vec<Channels>);

/// A change of a hypothesis whose response is computed.
#[derive(Clone, Debug)]
pub struct Change<const N: usize> {
    /// The hypothesis with the change made.
    pub changed: Hypothesis<N>,
    /// Its size.
    pub size: f64,
    /// Whether it reaches the sensors alone.
    pub sensing: bool,
    /// Whether it moves the handle's path; computed from the run itself alone.
    pub moves_handle: bool,
}

impl<const N: usize> Change<N> {
    /// A change that moves the arm by other ways than the handle's path.
    pub fn of(changed: Hypothesis<N>, size: f64) -> Self {
        let (sensing, moves_handle) = (false, false);
        Self {
            changed,
            size,
            sensing,
            moves_handle,
        }
    }
}

/// Changes of the angles and of the force at a step.
type Answer<const N: usize> = (Joints<f64, N>, Plane<f64>);

impl<const N: usize> Linear<'_, N> {
    /// A hypothesis beside the run as the origin of changes.
    ///
    /// # Errors
    /// [`SimulationError`] for a rig that cannot be.
    pub fn origin(&self, hypothesis: &Hypothesis<N>) -> Result<Origin<N>, SimulationError> {
        let plant = Plant::new(self.session, hypothesis, &self.course.rhythms)?;
        let start = self.session.at_start(hypothesis, &self.course)?;
        let mut origin = Origin::of(plant, start);
        origin.shown = self.sensed((&origin, &origin.plant), None, None);
        Ok(origin)
    }

    /// What the sensors would read more, for one unit of a change of the hypothesis of the run.
    ///
    /// # Errors
    /// [`SimulationError`] for a rig that cannot be.
    pub fn response(&self, asked: &Change<N>) -> Result<Channels, SimulationError> {
        self.response_from(&self.own, asked)
    }

    /// The same before the low-pass.
    ///
    /// # Errors
    /// As [`Linear::response`].
    pub fn response_raw(&self, asked: &Change<N>) -> Result<Channels, SimulationError> {
        self.response_raw_from(&self.own, asked)
    }

    /// What the sensors would read more, for one unit of a change of a hypothesis that need not be that of the run.
    ///
    /// # Errors
    /// As [`Linear::response`].
    pub fn response_from(
        &self,
        origin: &Origin<N>,
        asked: &Change<N>,
    ) -> Result<Channels, SimulationError> {
        let raw = self.response_raw_from(origin, asked)?;
        smooth(&raw, self.course.band, self.course.rate).map_err(|_| ASTRAY)
    }

    fn response_raw_from(
        &self,
        origin: &Origin<N>,
        asked: &Change<N>,
    ) -> Result<Channels, SimulationError> {
        let plant = Plant::new(self.session, &asked.changed, &self.course.rhythms)?;
        let nowhere = [Joints::<f64, N>::zeros(); 2];
        let start = match plant.dry || origin.resting.dry {
            true => self.start_from(origin, &plant, &asked.changed)?,
            false => nowhere,
        };
        let mut out = if asked.sensing && start == nowhere {
            self.sensed((origin, &plant), None, None)
        } else {
            let own;
            let hands = if asked.moves_handle {
                own = hands(&self.course, &asked.changed, (self.states.len(), self.step))?;
                &own
            } else {
                &self.hands
            };
            let answers = self.solve((origin, &plant), hands, start);
            let known = self.unchanged((origin, &plant), &answers);
            self.sensed((origin, &plant), Some(&answers), known)
        };
        for (channel, base) in out.iter_mut().zip(&origin.shown) {
            for (value, base) in channel.iter_mut().zip(base) {
                *value = (*value - base) / asked.size;
            }
        }
        Ok(out)
    }

    /// How far another hypothesis starts from the origin: the joints that dry friction holds where they are measured, and what dry
    /// friction resists less with in the others.
    fn start_from(
        &self,
        origin: &Origin<N>,
        plant: &Plant<N>,
        changed: &Hypothesis<N>,
    ) -> Result<[Joints<f64, N>; 2], SimulationError> {
        let (near, friction) = origin.start;
        let motion = &self.balances[0].motion;
        let held = match plant.dry {
            true => held_at_start(&plant.friction(motion, &[])),
            false => origin.held_at_start(motion),
        };
        let (place, resisted) = self.session.at_start(changed, &self.course)?;
        let moved = place - near;
        Ok([
            Joints::from_fn(|j, _| if held[j] { moved[j] } else { 0.0 }),
            friction - resisted,
        ])
    }

    /// Changes of angles and forces along the run when another plant takes the place of the origin.
    ///
    /// * `start` - see [`Linear::start_from`]
    fn solve(
        &self,
        plants: (&Origin<N>, &Plant<N>),
        hands: &[Hand],
        [moved, released]: [Joints<f64, N>; 2],
    ) -> Vec<Answer<N>> {
        let nothing = Joints::<f64, N>::zeros();
        let mut change = arm_sim::Change::default();
        let mut out = Vec::with_capacity(self.states.len());
        let mut is_still = true;
        for (i, (push, force)) in self.pushes(plants, hands).into_iter().enumerate() {
            let slopes = &self.slopes[i];
            if i == 0 {
                change.q = moved + self.rest * (push + released - slopes.stiffness * moved);
                is_still = change.q == nothing;
            } else if !is_still || push != nothing {
                is_still = false;
                for j in (0..N).filter(|&j| self.held[i][j]) {
                    (change.qd[j], change.qdd[j]) = (0.0, 0.0);
                }
                change.advance(slopes, &self.inverse[i], &push, self.step);
            }
            let [by_angle, by_speed] = &slopes.force;
            let follow = by_angle * change.q + by_speed * change.qd;
            out.push((change.q, [0, 1].map(|c| force[c] + follow[c])));
        }
        out
    }

    /// Torque that the motion of the run leaves over in another plant beyond the origin, and the force on the arm likewise, at every step.
    fn pushes(&self, (origin, plant): (&Origin<N>, &Plant<N>), hands: &[Hand]) -> Vec<Answer<N>> {
        let steps = 0..self.states.len();
        let before = &origin.plant;
        let same_rig = plant.setup == before.setup && std::ptr::eq(hands, self.hands.as_slice());
        let mut both = before.resisting.iter().chain(&plant.resisting);
        if !same_rig && both.any(|e| e.kind.feels_force()) {
            let memories = self.memories(&plant.resisting);
            let own = self.balances_from(origin);
            let one = |i: usize| {
                let changed = balance(plant, &self.states[i], hands[i], memories.at(i));
                let friction = (own[i].friction - changed.friction).component_mul(&self.ways[i]);
                let push = own[i].torque - changed.torque + friction;
                (push, [0, 1].map(|c| changed.force[c] - own[i].force[c]))
            };
            return steps.map(one).collect();
        }
        // What the same effects resist with takes itself out.
        let other = multiset_difference(&before.resisting, &plant.resisting);
        // Computing states is slow, and all parameters of an effect need the same ones.
        let (known, fresh);
        let less = if any_state(&other) {
            known = origin.resisted.of(&other);
            known.get_or_init(|| self.resisted(&other))
        } else {
            fresh = self.resisted(&other);
            &fresh
        };
        let more = self.resisted(&multiset_difference(&plant.resisting, &before.resisting));
        let push = |i: usize| less[i] - more[i];
        if same_rig {
            return steps.map(|i| (push(i), [0.0; 2])).collect();
        }
        let bare = plant.without_effects();
        let own = self.balances_from(origin);
        let one = |i: usize| {
            let changed = balance(&bare, &self.states[i], hands[i], &[]);
            let rigid = own[i].torque - own[i].resisted - changed.torque;
            let force = [0, 1].map(|c| changed.force[c] - own[i].force[c]);
            (rigid + push(i), force)
        };
        steps.map(one).collect()
    }

    /// The balance of an origin for the motion of the run.
    fn balances_from<'o>(&'o self, origin: &'o Origin<N>) -> &'o [Balance<N>] {
        if std::ptr::eq(origin, &raw const self.own) {
            return &self.balances;
        }
        let there = || self.balances_of(&origin.plant, &self.memories(&origin.plant.resisting));
        origin.balances.get_or_init(there)
    }

    /// What joint effects resist with at every step, where joints slip as in the run \[N m\].
    fn resisted(&self, effects: &[Effect<f64>]) -> Vec<Joints<f64, N>> {
        if effects.is_empty() {
            return vec![Joints::zeros(); self.states.len()];
        }
        let memories = self.memories(effects);
        let one = |i: usize| {
            let (motion, memory) = (&self.balances[i].motion, memories.at(i));
            let friction = Joints::from(dry_friction(effects, motion, memory));
            resisting_besides_dry(effects, motion, memory) + friction.component_mul(&self.ways[i])
        };
        (0..self.states.len()).map(one).collect()
    }

    /// What the sensors read before the motion changes; `None` where they are others than those of the origin.
    fn unchanged(
        &self,
        (origin, plant): (&Origin<N>, &Plant<N>),
        answers: &[Answer<N>],
    ) -> Option<Channels> {
        let before = &origin.plant;
        if plant.sensing != before.sensing || plant.setup.force_delay != before.setup.force_delay {
            return None;
        }
        let is_still =
            |(q, force): &&Answer<N>| *q == Joints::<f64, N>::zeros() && *force == [0.0; 2];
        let steps = answers.iter().take_while(is_still).count();
        let samples = steps.saturating_sub(1) * self.grid.stride / self.grid.parts;
        let known = |channel: &Vec<f64>| channel[..samples.min(channel.len())].to_vec();
        Some(origin.shown.iter().map(known).collect())
    }
}
