//! Response of a run to a change that is not small, integrated step by step.
//!
//! The scheme of the linearised run with a nonlinear equation in every step. What it gives is the run itself and, on top, what two
//! coarse solutions differ by, so that their common error drops out.

use arm_core::effect::{MAX_STATES, Motion, States, advance_states, any_state};
use arm_core::{Joints, Plane};
use arm_sim::{Change, SimulationError, SmoothFriction};
use nalgebra::SMatrix;

use crate::data::course::{Channels, Course};
use crate::hypothesis::Hypothesis;
use crate::linearization::linearized_run::{ASTRAY, Linear};
use crate::linearization::newton::{MissingTorque, newton, slide};
use crate::linearization::plant::{Balance, Hand, Plant, State, balance, hands};
use crate::measurement_model::start::held_at_start;

impl<const N: usize> Linear<'_, N> {
    /// What the sensors would read under another hypothesis, which need not be near, on a trial of the same movement;
    /// before the low-pass.
    ///
    /// # Errors
    /// [`SimulationError`] for a rig that cannot be, and an arm that leaves the run.
    pub fn play(
        &self,
        changed: &Hypothesis<N>,
        course: &Course<N>,
    ) -> Result<Channels, SimulationError> {
        let plant = Plant::new(self.session, changed, &course.rhythms)?;
        // A trial that was broken off needs no more than its own steps.
        let steps = self.steps_until(course.raw[0].len()).min(self.states.len());
        let hands = hands(course, changed, (steps, self.step))?;
        let (near, friction) = self.session.at_start(changed, course)?;
        let answer = self.follow(&plant, &hands, (&near, &friction));
        let answer = answer.ok_or(ASTRAY)?;
        let mut sensed = self.sensed((&self.own, &plant), Some(&answer), None);
        // A low-pass ends where the trial ends.
        let count = course.raw[0].len();
        sensed
            .iter_mut()
            .for_each(|channel| channel.truncate(count));
        Ok(sensed)
    }

    /// Changes of angles and forces along the run when another plant takes its place, however large.
    fn follow(
        &self,
        plant: &Plant<N>,
        hands: &[Hand],
        start: (&Joints<f64, N>, &Joints<f64, N>),
    ) -> Option<Vec<(Joints<f64, N>, Plane<f64>)>> {
        /// Steps without a solution, in percent: a contact that closes takes hold in no time.
        const UNSOLVED: usize = 3;
        /// Distance from the run at which an arm is lost \[rad\].
        const LOST: f64 = 1.0;
        let h = self.step;
        let remembers = any_state(&plant.resisting);
        let count = if remembers { plant.resisting.len() } else { 0 };
        let mut memory = vec![[0.0; MAX_STATES]; count];
        let mut expected = memory.clone();
        let mut out = Vec::with_capacity(self.states.len());
        let mut follower = Follower::new(self, plant);
        let mut before = self.states[0];
        let mut unsolved = 0;
        for (i, hand) in hands.iter().enumerate() {
            let found = if i == 0 {
                follower.start(*hand, start, &memory)?
            } else {
                let instant = follower.instant(i);
                let carry = |to: &State<N>, memory: &mut Vec<States<f64>>| {
                    let motions = (&before.motion(), &to.motion());
                    advance_states(&plant.resisting, motions, memory, h);
                };
                // States of effects follow slowly: where the step is expected to end is near enough.
                expected.clone_from(&memory);
                if remembers {
                    carry(&instant.place(&instant.start), &mut expected);
                }
                let (found, exact) = follower.step(&instant, *hand, &expected)?;
                unsolved += usize::from(!exact);
                if remembers {
                    carry(&instant.place(&follower.change.qdd), &mut memory);
                }
                found
            };
            let Change { q, qd, qdd } = follower.change;
            let astray = q.iter().any(|v| !v.is_finite() || v.abs() > LOST);
            if astray || unsolved > UNSOLVED * self.states.len() / 100 {
                return None;
            }
            before = self.states[i].moved(&q, &qd, &qdd);
            let own = self.balances[i].force;
            out.push((q, [0, 1].map(|c| found.force[c] - own[c])));
        }
        Some(out)
    }
}

/// Increments of angle \[rad\] and speed \[rad/s\] for difference quotients.
const NUDGE: (f64, f64) = (1e-7, 1e-5);

/// How far angles, speeds and accelerations of another plant are from those of the run.
pub(super) struct Follower<'l, 's, const N: usize> {
    line: &'l Linear<'s, N>,
    plant: &'l Plant<N>,
    pub change: Change<N>,
    /// What the inverse slope differed by from that of the run itself in the last step, and the slope with dry friction.
    other: SMatrix<f64, N, N>,
    /// What accelerations differed by from those that nothing pushes, in the last two steps.
    pushed: [Joints<f64, N>; 2],
    /// Speeds after the last step \[rad/s\].
    speed: Joints<f64, N>,
    /// Smooth friction in a step, of the other plant and of the run.
    smooth: [Vec<SmoothFriction>; 2],
    /// Whether some joint has dry friction, in the run or with the other plant.
    rubs: bool,
}

/// One step of the way.
pub(super) struct Instant<'l, const N: usize> {
    i: usize,
    state: &'l State<N>,
    /// Speeds and angles without new accelerations.
    speed: Joints<f64, N>,
    angle: Joints<f64, N>,
    reach: f64,
    /// Accelerations that nothing pushes, and those that are expected.
    free: Joints<f64, N>,
    pub start: Joints<f64, N>,
}

impl<const N: usize> Instant<'_, N> {
    /// The state with new accelerations.
    pub fn place(&self, next: &Joints<f64, N>) -> State<N> {
        self.state
            .moved(&self.angle_with(next), &self.speed_with(next), next)
    }

    fn angle_with(&self, next: &Joints<f64, N>) -> Joints<f64, N> {
        self.angle + next * (self.reach * self.reach)
    }

    fn speed_with(&self, next: &Joints<f64, N>) -> Joints<f64, N> {
        self.speed + next * self.reach
    }
}

impl<'l, 's, const N: usize> Follower<'l, 's, N> {
    pub fn new(line: &'l Linear<'s, N>, plant: &'l Plant<N>) -> Self {
        let zero = Joints::zeros();
        Self {
            line,
            plant,
            change: Change::default(),
            other: SMatrix::zeros(),
            pushed: [zero; 2],
            speed: zero,
            smooth: [Vec::new(), Vec::new()],
            rubs: [plant, &line.own.plant].iter().any(|p| p.dry || p.creeps),
        }
    }

    /// At rest: the angles give way, but for those of joints that dry friction holds where they are measured.
    ///
    /// * `near` - angles that are measured
    /// * `friction` - what dry friction resists with where the handle places a joint
    pub fn start(
        &mut self,
        hand: Hand,
        (near, friction): (&Joints<f64, N>, &Joints<f64, N>),
        memory: &[States<f64>],
    ) -> Option<Balance<N>> {
        let (line, zero) = (self.line, Joints::zeros());
        let (state, error) = (&line.states[0], line.error(0));
        let moved = |angle: &Joints<f64, N>| state.moved(angle, &zero, &zero);
        let resting = self.plant.at_rest();
        let there = |angle: &Joints<f64, N>| balance(&resting, &moved(angle), hand, memory);
        if !(self.rubs || resting.dry) {
            let missing = |angle: &Joints<f64, N>| {
                let there = there(angle);
                (error - there.torque, there)
            };
            let solved = newton(zero, [&line.rest; 2], missing, NUDGE.0)?;
            self.change.q = solved.at;
            return Some(solved.there);
        }
        let missing = |angle: &Joints<f64, N>| {
            let mut there = there(angle);
            let held = held_at_start(&there.friction);
            for j in (0..N).filter(|&j| !held[j]) {
                there.friction[j] = 0.0;
            }
            MissingTorque {
                torque: error - there.torque - friction,
                speed: state.q + angle - near,
                there,
            }
        };
        let slope = (line.slopes[0].stiffness, 1.0);
        let slid = slide(zero, slope, (&[], &zero), missing)?;
        self.change.q = slid.at;
        Some(slid.there)
    }

    /// A step before it is solved.
    pub fn instant(&self, i: usize) -> Instant<'l, N> {
        let line = self.line;
        let (angle, speed, reach) = self.change.coast(line.step);
        let slopes = &line.slopes[i];
        let free = -(line.inverse[i] * (slopes.damping * speed + slopes.stiffness * angle));
        let start = match self.rubs {
            true => self.change.qdd,
            false => free + self.pushed[0] * 2.0 - self.pushed[1],
        };
        Instant {
            i,
            state: &line.states[i],
            speed,
            angle,
            reach,
            free,
            start,
        }
    }

    /// Makes a step; the balance of the equation of motion at its end, and whether it is solved.
    pub fn step(
        &mut self,
        instant: &Instant<N>,
        hand: Hand,
        memory: &[States<f64>],
    ) -> Option<(Balance<N>, bool)> {
        let (line, plant) = (self.line, self.plant);
        let Instant { i, reach, .. } = *instant;
        let error = line.error(i);
        let there = |next: &Joints<f64, N>| balance(plant, &instant.place(next), hand, memory);
        let (next, found, exact) = if self.rubs {
            let [smooth, own] = &mut self.smooth;
            renew(
                smooth,
                plant,
                &instant.place(&instant.start).motion(),
                memory,
            );
            renew(own, &line.own.plant, &line.balances[i].motion, &[]);
            let speed = |next: &Joints<f64, N>| instant.state.qd + instant.speed_with(next);
            let missing = |next: &Joints<f64, N>| {
                let (there, speed) = (there(next), speed(next));
                let rubbing = SmoothFriction::sum(smooth, &speed).0;
                MissingTorque {
                    torque: error - there.torque + rubbing,
                    speed,
                    there,
                }
            };
            let (_, steep) = SmoothFriction::sum(own, &instant.state.qd);
            let own = line.slopes[i].of_step(line.step) - SMatrix::from_diagonal(&(steep * reach));
            let (slope, near) = ((own + self.other, reach), self.speed);
            let slid = slide(instant.start, slope, (smooth, &near), missing)?;
            self.other = slid.slope - own;
            self.speed = slid.speed;
            (slid.at, slid.there, slid.exact)
        } else {
            let missing = |next: &Joints<f64, N>| {
                let there = there(next);
                (error - there.torque, there)
            };
            let own = &line.inverse[i];
            let nudge = NUDGE.1 / reach;
            let solved = newton(instant.start, [&(own + self.other), own], missing, nudge)?;
            self.other = solved.inverse - own;
            (solved.at, solved.there, solved.exact)
        };
        self.pushed = [next - instant.free, self.pushed[0]];
        self.change = Change {
            q: instant.angle_with(&next),
            qd: instant.speed_with(&next),
            qdd: next,
        };
        Some((found, exact))
    }
}

/// Takes the smooth friction of a plant in a motion.
fn renew<const N: usize>(
    smooth: &mut Vec<SmoothFriction>,
    plant: &Plant<N>,
    motion: &Motion<f64, N>,
    memory: &[States<f64>],
) {
    smooth.clear();
    if plant.creeps {
        smooth.extend(SmoothFriction::among(&plant.resisting, motion, memory));
    }
}
