//! The initial state of a led arm: at rest, with the dry friction that follows from the measured force.

use arm_core::effect::{Effect, Kind, Motion, dry_friction, resisting_besides_dry};
use arm_core::{
    Chain, Contact, Joints, Placement, Plane, Pose, Setup, inverse_dynamics, jacobian, joint_force,
    static_torque, tip,
};
use arm_sim::{Experiment, SimulationError, Start, simulate};
use nalgebra::{SMatrix, Vector2};

use crate::data::contact_readings::Sensing;
use crate::data::course::Course;
use crate::data::session::Session;
use crate::hypothesis::Hypothesis;
use crate::measurement_model::joint_torques::offsets;

impl<const N: usize> Session<N> {
    /// The angles near which a run starts: measured, as a hypothesis has them.
    ///
    /// A joint that dry friction holds where it is measured may hardly turn in what the handle leaves free, while others turn much: then its
    /// angle, and what friction holds, is known from theirs. The joints that turn most there stay where they are measured; the other two are
    /// moved until the hand is where the handle and the stretched contact have it.
    ///
    /// # Errors
    /// [`SimulationError`] for a rig that cannot be.
    pub fn near(
        &self,
        hypothesis: &Hypothesis<N>,
        course: &Course<N>,
    ) -> Result<Joints<f64, N>, SimulationError> {
        /// The hand is where it must be to a millionth of what it was off by.
        const STEPS: usize = 3;
        let mut q = course.start(hypothesis);
        let effects = at_rest(&hypothesis.effects());
        if N <= 2 || !effects.iter().any(is_set_valued_friction) {
            return Ok(q);
        }
        let setup = self.rig(hypothesis)?;
        let chain = setup.chain()?;
        let force = force_at_start(&effects, course);
        let handle = course.handle_at_start(hypothesis, &setup);
        let Some(hand) = hand_in_contact(&setup, handle, force) else {
            return Ok(q);
        };
        for _ in 0..STEPS {
            let (at, moving) = hand_of(&setup, &chain, course, &q);
            let miss = Vector2::from([0, 1].map(|a| hand[a] - at[a]));
            let mut led = moving.transpose();
            for joint in turning_most(&moving) {
                led.row_mut(joint).fill(0.0);
            }
            let Some(inverse) = (moving * led).try_inverse() else {
                break;
            };
            q += led * (inverse * miss);
        }
        Ok(q)
    }

    /// The angles near which a run starts \[rad\], see [`Session::near`], and what dry friction resists with there, where the handle places a
    /// joint \[N m\].
    ///
    /// A joint at rest is held by any torque up to its friction in motion, and the force on a resting arm shows which. Joints that the
    /// handle leaves free stay at their measured angles instead: see `held_at_start`.
    ///
    /// # Errors
    /// [`SimulationError`] for a rig that cannot be.
    pub fn at_start(
        &self,
        hypothesis: &Hypothesis<N>,
        course: &Course<N>,
    ) -> Result<(Joints<f64, N>, Joints<f64, N>), SimulationError> {
        let q = self.near(hypothesis, course)?;
        let effects = hypothesis.effects();
        let zero = Joints::zeros();
        if !effects.iter().any(is_set_valued_friction) {
            return Ok((q, zero));
        }
        let setup = self.rig(hypothesis)?;
        let chain = setup.chain()?;
        let force = force_at_start(&effects, course);
        let pose = Pose::new(&q);
        let moment = Placement::of(&setup).map_or(0.0, |p| p.moment(&pose, force));
        let through = joint_force(&chain, &pose, (&zero, &zero), force);
        let motion = Motion::new(0.0, q, zero).with_joint_force(&through);
        let most = Joints::from(dry_friction(&effects, &motion, &[]));
        let holding = Joints::from(dry_friction(&at_rest(&effects), &motion, &[]));
        let held = held_at_start(&holding);
        let needed = static_torque(&chain, &pose, force, moment)
            - inverse_dynamics(&chain, &pose, &zero, &zero)
            - resisting_besides_dry(&effects, &motion, &[]);
        let friction = Joints::from_fn(|j, _| match held[j] {
            true => 0.0,
            false => needed[j].clamp(-most[j], most[j]),
        });
        Ok((q, friction))
    }

    /// The start of a run: in equilibrium near the measured angles.
    ///
    /// # Errors
    /// As [`simulate`].
    pub(crate) fn start(
        &self,
        hypothesis: &Hypothesis<N>,
        course: &Course<N>,
        experiment: &Experiment<N>,
    ) -> Result<Start<N>, SimulationError> {
        let (near, friction) = self.at_start(hypothesis, course)?;
        let effects = at_rest(&experiment.effects);
        let creeps = effects != experiment.effects;
        if !creeps && friction.iter().all(|&torque| torque == 0.0) {
            return Ok(Start::Equilibrium { near });
        }
        let mut resting = experiment.clone();
        resting.effects = effects;
        resting.start = Start::Equilibrium { near };
        resting.duration = resting.dt;
        resting.output_interval = None;
        for effect in resting
            .effects
            .iter_mut()
            .filter(|e| is_set_valued_friction(e))
        {
            if friction[effect.index] != 0.0 {
                effect.parameters[0] = 0.0;
            }
        }
        let holding = (0..N).map(|j| Effect::new(Kind::ConstantMoment, j).with(&[friction[j]]));
        resting.effects.extend(holding);
        let begun = simulate(&resting)?;
        Ok(Start::Given {
            q: Joints::from_column_slice(&begun.q[..N]),
            qd: Joints::from_column_slice(&begun.qd[..N]),
        })
    }
}

impl<const N: usize> Course<N> {
    /// Angles that are measured where the movement starts, as a hypothesis has them.
    pub fn start(&self, hypothesis: &Hypothesis<N>) -> Joints<f64, N> {
        self.start - offsets(&hypothesis.effects())
    }

    /// Where the handle stands in the hand at the start, as a hypothesis has it \[m\].
    fn handle_at_start(&self, hypothesis: &Hypothesis<N>, setup: &Setup<f64, N>) -> Plane<f64> {
        let [displaced, ..] = setup.displaced.at(0.0);
        [0, 1].map(|a| self.handle[0][a] + hypothesis.shift[a] + displaced[a])
    }

    /// How far a base whose path was measured is from its place at the start \[m\].
    fn base_at_start(&self) -> Plane<f64> {
        let path = self.base.as_ref();
        path.map_or([0.0; 2], |path| path.at(0.0).value)
    }
}

/// Force on the arm at the start \[N\]: what is measured, without what effects in the sensors make of it.
fn force_at_start<const N: usize>(effects: &[Effect<f64>], course: &Course<N>) -> Plane<f64> {
    let [y, z] = course.start_force;
    Sensing::of(effects).undone(0.0, [y, z, 0.0]).0
}

/// Where a contact that bears a force has the hand \[m\]; `None` where it bears none.
fn hand_in_contact<const N: usize>(
    setup: &Setup<f64, N>,
    handle: Plane<f64>,
    force: Plane<f64>,
) -> Option<Plane<f64>> {
    let Contact {
        stiffness, play, ..
    } = setup.contact;
    let stretch = |a: usize| force[a] / stiffness[a] + play[a].copysign(force[a]);
    let hand = [0, 1].map(|a| handle[a] - stretch(a));
    hand.iter().all(|v| v.is_finite()).then_some(hand)
}

/// Where the hand is \[m\], and its change with each angle \[m/rad\].
fn hand_of<const N: usize>(
    setup: &Setup<f64, N>,
    chain: &Chain<f64, N>,
    course: &Course<N>,
    q: &Joints<f64, N>,
) -> (Plane<f64>, SMatrix<f64, 2, N>) {
    let pose = Pose::new(q);
    let (mut at, mut moving) = (tip(chain, &pose), jacobian(chain, &pose));
    let beside = Placement::of(setup).map_or([0.0; 2], |p| p.arm(&pose));
    let [heave, ..] = setup.heave.at(0.0);
    let base = course.base_at_start();
    for a in 0..2 {
        at[a] += beside[a] + heave[a] + base[a] + setup.base_motion[a] * (q[0] - setup.base_rest);
        moving[(a, 0)] += setup.base_motion[a];
    }
    for mut turned in moving.column_iter_mut() {
        turned[0] -= beside[1];
        turned[1] += beside[0];
    }
    (at, moving)
}

/// The joints that turn most where the hand stays, all but two.
fn turning_most<const N: usize>(moving: &SMatrix<f64, 2, N>) -> Vec<usize> {
    let Some(inverse) = (moving * moving.transpose()).try_inverse() else {
        return Vec::new();
    };
    // What of a turn of the joint alone moves the hand.
    let leads = |j: usize| (moving.column(j).transpose() * inverse * moving.column(j))[0];
    let mut joints: Vec<usize> = (0..N).collect();
    joints.sort_by(|&a, &b| leads(a).total_cmp(&leads(b)));
    joints.truncate(N.saturating_sub(2));
    joints
}

/// Effects as they act on joints at rest: dry friction that creeps below some speed holds a joint like friction that sticks. With 0.1 N m at
/// 0.01 rad/s, a spring of 1 N m/rad takes 10 s to turn it back.
pub(crate) fn at_rest(effects: &[Effect<f64>]) -> Vec<Effect<f64>> {
    let mut resting = effects.to_vec();
    for effect in resting.iter_mut().filter(|e| e.parameters[0] > 0.0) {
        if let Some(smoothing) = effect.kind.smoothed_by() {
            effect.parameters[smoothing] = 0.0;
        }
    }
    resting
}

/// Whether an effect is set-valued dry friction that acts.
pub(crate) fn is_set_valued_friction(effect: &Effect<f64>) -> bool {
    effect.on && effect.is_dry() && effect.parameters[0] > 0.0
}

/// Whether an effect is smooth dry friction, or has some, that acts.
pub(crate) fn creeps(effect: &Effect<f64>) -> bool {
    effect.on && effect.kind.smoothed_by().is_some() && !effect.is_dry()
}

/// The joints that dry friction holds where a run starts: what the handle leaves free, the last ones first.
pub(crate) fn held_at_start<const N: usize>(friction: &Joints<f64, N>) -> [bool; N] {
    let mut held = [false; N];
    let dry = (0..N).rev().filter(|&j| friction[j] > 0.0);
    dry.take(N.saturating_sub(2)).for_each(|j| held[j] = true);
    held
}

#[cfg(test)]
mod tests {
    use arm_core::Segment;
    use arm_ident::regression::trial::Trial;

    use super::*;
    use crate::data::course::tests::of_one;

    /// An arm without weight from its base on.
    fn three_segments(base: Plane<f64>) -> Chain<f64, 3> {
        let segment = |length: f64| Segment {
            length,
            mass: 1.0,
            com: [0.5 * length, 0.0],
            inertia: 0.01,
        };
        Chain::new([0.3, 0.25, 0.08].map(segment), base, [0.0; 2]).expect("an arm")
    }

    /// Three segments in whose null motion the last joint turns twenty times as far as the first, on a contact that bears 10 N forward.
    #[test]
    fn an_arm_with_dry_friction_starts_where_the_handle_has_its_hand() {
        let chain = three_segments([0.0, -9.81]);
        let truth = Joints::from([-1.05, 1.03, 0.16]);
        let at = tip(&chain, &Pose::new(&truth));
        let error = Joints::from([1e-3, -2e-3, 1e-3]);
        let trial = Trial {
            handle: Some(vec![[at[0] + 10.0 / 1e4, at[1]]; 50]),
            force_on_arm: Some(vec![[10.0, 0.0]; 50]),
            ..Trial::new(100.0, vec![truth + error; 50])
        };
        let mut session = of_one(chain, trial);
        let course = session.course(0).expect("a course");
        let measured = session.near(&session.given(), &course).expect("a rig");
        assert_eq!(measured, course.start, "no friction holds it");
        session.effects = vec![Effect::new(Kind::Coulomb, 0).with(&[0.2, 0.0])];
        let near = session.near(&session.given(), &course).expect("a rig");
        let off = near - truth;
        let hand = tip(&chain, &Pose::new(&near));
        assert!((0..2).all(|a| (hand[a] - at[a]).abs() < 1e-12));
        // What is left is what the handle leaves free: the first joint hardly turns in it.
        assert!(off.norm() < error.norm());
        assert!(
            off[0].abs() < 1e-4 && off[2].abs() > 10.0 * off[0].abs(),
            "{off}"
        );
    }

    /// Three segments with a spring in the last joint that turns it by 0.54 rad where nothing holds it.
    #[test]
    fn a_joint_that_creeps_starts_where_it_is_measured() {
        let chain = three_segments([0.0; 2]);
        let measured = Joints::from([-1.05, 1.03, 0.16]);
        let at = tip(&chain, &Pose::new(&measured));
        let trial = Trial {
            handle: Some(vec![at; 50]),
            force_on_arm: Some(vec![[0.0; 2]; 50]),
            ..Trial::new(100.0, vec![measured; 50])
        };
        let mut session = of_one(chain, trial);
        let spring = Effect::new(Kind::Elastic, 2).with(&[0.3, 0.7]);
        let mut start = |friction: &[f64]| {
            session.effects = vec![spring, Effect::new(Kind::Coulomb, 2).with(friction)];
            let course = session.course(0).expect("a course");
            let run = session.run(&session.given(), &course).expect("a run");
            run.recording().q[2]
        };
        let sticking = start(&[0.2, 0.0]);
        assert!((sticking - measured[2]).abs() < 1e-3, "{sticking}");
        assert!((start(&[0.2, 0.01]) - sticking).abs() < 1e-6);
        assert!((start(&[0.0, 0.01]) - 0.7).abs() < 0.05);
    }
}
