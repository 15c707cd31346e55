//! Steps with set-valued dry friction: each joint slips one way or sticks, and switches are located.
//!
//! The torque of dry friction is set-valued: c against the motion, and at rest any torque from −c to c that holds the joint.
//! Smoothed, it is so stiff that an explicit method needs steps far below those of everything else. So joints whose speed in
//! the state is exactly zero may stick; [`instant`] finds which of them do; between two switches the motion is smooth
//! and a step has the order of its integrator. A step in which a speed reaches zero, or a torque what friction holds at most,
//! ends there, and another one makes the rest of it: the switch is located as in Shampine, Gladwell, Brankin 1991.
//!
//! Semi-implicit Euler does not locate switches: it takes the torque with which speeds at the end of the step obey the law
//! (Moreau 1988; Stewart, Trinkle 1996), of first order as all of that method. Rk4 does so too with what is left of a step that
//! switches more than [`MOST_SWITCHES`] times.

mod gain;
mod growth;
mod hold;
pub(super) mod instant;
mod locate;
mod steady;

pub(crate) use instant::{Friction, at};
pub(crate) use steady::steady;

use core::cell::OnceCell;

use arm_core::Joints;
use instant::{Arm, Mode, Modes, Solved};
use locate::{LOCATED, first_beyond};
use steady::STILL;

use crate::closed_chain::model::{Link, Model};
use crate::closed_chain::state::{BaseMotion, Input, State};
use crate::integrators::step::{AmbiguousFriction, Inputs, Memory, PROJECTIONS, remember, rk4};
use crate::{Handle, Integrator};
use arm_core::effect::States;

/// Switches that are located in one step.
const MOST_SWITCHES: usize = 12;
/// Longest part of a step, in time constants of friction that falls with speed.
const RESOLVED: f64 = 0.3;
/// Shortest part of a step that is made for that, as a fraction of the step.
const SHORTEST: f64 = 1.0 / 128.0;

/// Advances a state by one step of length `h` in which there is dry friction.
#[inline(never)]
pub(super) fn step<const N: usize>(
    model: &Model<f64, N>,
    integrator: Integrator,
    h: f64,
    inputs: Inputs<f64, N>,
    (state, memory): (&mut State<f64, N>, &mut Memory<f64>),
) {
    match integrator {
        Integrator::SemiImplicitEuler => {
            implicit(model, (h, 1.0), [inputs.start, inputs.end], (state, memory));
        }
        Integrator::Rk4 | Integrator::Imex => {
            if !made_steadily(model, h, inputs, (state, memory)) {
                switching(model, h, &inputs, (state, memory));
            }
        }
    }
}

/// Makes a step if no joint starts or stops slipping in it; else leaves the state as it is and returns false.
fn made_steadily<const N: usize>(
    model: &Model<f64, N>,
    h: f64,
    inputs: Inputs<f64, N>,
    (state, memory): (&mut State<f64, N>, &mut Memory<f64>),
) -> bool {
    if !model.has_simple_friction() {
        return false;
    }
    let before = *state;
    memory.kept.copy_from_slice(&memory.state);
    let made = steady(model, h, inputs, (state, memory)) > 0.0;
    if !made {
        *state = before;
        memory.state.copy_from_slice(&memory.kept);
    }
    made
}

/// One step of Rk4 in as many parts as it has switches and one more.
pub(crate) fn switching<const N: usize>(
    model: &Model<f64, N>,
    h: f64,
    inputs: &Inputs<f64, N>,
    (state, memory): (&mut State<f64, N>, &mut Memory<f64>),
) {
    let (mut from, mut switches) = (0.0, 0);
    while switches < MOST_SWITCHES {
        let start = input_at(inputs, h, from);
        let arm = Arm::at(model, &start, (&state.q, &state.qd));
        let (modes, first) = arm.modes(&memory.state, None);
        if let Some((joint, gain)) = first.ambiguous_friction {
            return stop(start.time, (joint, gain), (state, memory));
        }
        for joint in (0..N).filter(|&j| first.held[j]) {
            state.qd[joint] = 0.0;
        }
        memory.kept.copy_from_slice(&memory.state);
        let part = Part {
            model,
            inputs,
            h,
            from,
            before: *state,
            modes,
            first,
        };
        let to = part.end(&arm, &memory.kept);
        let margin = part.attempt(to, (state, memory));
        if margin >= 0.0 || margin.is_nan() {
            from = to;
        } else {
            from = part.locate((to, margin), (state, memory));
            switches += 1;
        }
        part.settle(state);
        if 1.0 - from < LOCATED || margin.is_nan() {
            return;
        }
    }
    let (start, rest) = (input_at(inputs, h, from), (1.0 - from) * h);
    implicit(model, (rest, 0.5), [&start, inputs.end], (state, memory));
}

/// The rest of a step, while no joint switches.
struct Part<'a, const N: usize> {
    model: &'a Model<f64, N>,
    inputs: &'a Inputs<'a, f64, N>,
    h: f64,
    /// Where it begins, as a fraction of the step.
    from: f64,
    before: State<f64, N>,
    modes: Modes<N>,
    first: Solved<N>,
}

impl<const N: usize> Part<'_, N> {
    /// Where it ends if nothing switches, as a fraction of the step.
    ///
    /// With friction that falls with speed, the speed of a joint that begins to slip grows exponentially; the step must not be
    /// longer than its time constant, or the slip begins a step too late.
    fn end(&self, arm: &Arm<'_, N>, memory: &[States<f64>]) -> f64 {
        let rest = 1.0 - self.from;
        if !self.model.dry_falls {
            return 1.0;
        }
        let qd = &self.before.qd;
        // Friction of the instant, unless a joint force was in it.
        let known = (!self.model.feels_joint_force).then_some(self.first.dry.most);
        let yielding = OnceCell::new();
        let yields = || *yielding.get_or_init(|| arm.yielding());
        // The speeds to which joints may slow down within a length: slower joints are in steeper friction.
        let slower = |length: f64| {
            Joints::<f64, N>::from_fn(|j, _| {
                let (speed, change) = (qd[j], 1.5 * length * self.h * self.first.outcome.qdd[j]);
                if speed * change >= 0.0 {
                    speed
                } else if change.abs() < speed.abs() {
                    speed + change
                } else {
                    0.0
                }
            })
        };
        let allowed = |ahead: f64| {
            let speeds = slower(ahead);
            let most = known.filter(|_| speeds == *qd);
            let motion = arm.motion_at(speeds);
            let rate = growth::growth(self.model, &motion, memory, &self.modes, (most, yields));
            (RESOLVED / (rate * self.h)).max(SHORTEST)
        };
        let least = allowed(rest);
        // NaN does not divide a step.
        if least >= rest || least.is_nan() {
            return 1.0;
        }
        let now = allowed(0.0).min(rest);
        self.from + now.min(allowed(now))
    }

    /// Makes the step up to a fraction of it, and returns the smallest margin of a joint to a switch; it is negative
    /// beyond the switch.
    fn attempt(&self, to: f64, (state, memory): (&mut State<f64, N>, &mut Memory<f64>)) -> f64 {
        *state = self.before;
        memory.state.copy_from_slice(&memory.kept);
        let whole = self.from == 0.0 && to == 1.0;
        let parts;
        let inputs = if whole {
            *self.inputs
        } else {
            let fractions = [self.from, 0.5 * (self.from + to), to];
            parts = fractions.map(|x| input_at(self.inputs, self.h, x));
            let [start, middle, end] = &parts;
            Inputs { start, middle, end }
        };
        let (mut begun, mut last) = (false, self.first.dry);
        let h = (to - self.from) * self.h;
        let evaluate = |input: &_, q: &_, qd: &_, memory: &_| {
            if !begun {
                begun = true;
                return self.first.outcome;
            }
            let solved = Arm::at(self.model, input, (q, qd)).solve(memory, (&self.modes, None));
            last = solved.dry;
            solved.outcome
        };
        rk4(self.model, (h, inputs), (state, memory), evaluate);
        for joint in (0..N).filter(|&j| self.first.held[j]) {
            state.qd[joint] = 0.0;
        }
        if matches!(self.model.link, Link::Rigid) {
            let how = (PROJECTIONS, &self.first.held);
            self.model.project(inputs.end, state, how);
        }
        self.margin(state, &last)
    }

    fn margin(&self, state: &State<f64, N>, last: &Friction<f64, N>) -> f64 {
        let mut margin = f64::INFINITY;
        for j in 0..N {
            let distance = match self.modes[j] {
                Mode::Slips(way) if way != 0.0 => {
                    let speed = way * state.qd[j];
                    let size = self.before.qd[j].abs() + self.h * self.first.outcome.qdd[j].abs();
                    if speed > -STILL {
                        speed.max(0.0) / (size + STILL)
                    } else {
                        speed / (size + STILL)
                    }
                }
                Mode::Sticks => instant::reserve(last, j),
                Mode::None | Mode::Slips(_) => continue,
            };
            // NaN counts as the smallest margin.
            margin = if distance >= margin { margin } else { distance };
        }
        margin
    }

    /// Makes the step up to the first switch, and returns where that is.
    ///
    /// * `after` - where it was tried to end it, and the margin there
    fn locate(
        &self,
        after: (f64, f64),
        (state, memory): (&mut State<f64, N>, &mut Memory<f64>),
    ) -> f64 {
        let before = self.margin(&self.before, &self.first.dry).max(1e-9);
        let mut tried = after.0;
        let found = first_beyond([(self.from, before), after], |to| {
            tried = to;
            self.attempt(to, (state, memory))
        });
        if tried != found {
            self.attempt(found, (state, memory));
        }
        found
    }

    /// Speeds that reached zero are exactly that.
    fn settle(&self, state: &mut State<f64, N>) {
        for j in 0..N {
            if let Mode::Slips(way) = self.modes[j]
                && way * state.qd[j] < 0.0
            {
                state.qd[j] = 0.0;
            }
        }
    }
}

/// A step whose friction is that of its end. With it, angles go on with a speed that is `share` of the new one and else of the
/// old one.
fn implicit<const N: usize>(
    model: &Model<f64, N>,
    (h, share): (f64, f64),
    [start, end]: [&Input<f64, N>; 2],
    (state, memory): (&mut State<f64, N>, &mut Memory<f64>),
) {
    let (_, now) = Arm::at(model, start, (&state.q, &state.qd)).modes(&memory.state, Some(h));
    if let Some(ambiguous_friction) = now.ambiguous_friction {
        return stop(start.time, ambiguous_friction, (state, memory));
    }
    remember(model, h, start, (state, memory), &now.outcome);
    let mut power = now.outcome.power;
    for j in 0..N {
        let before = state.qd[j];
        let after = if now.held[j] {
            0.0
        } else {
            before + h * now.outcome.qdd[j]
        };
        // The energy of an impulse is its product with the mean of the speeds before and after it.
        power[2] += now.dry.torque[j] * 0.5 * (after - before);
        state.qd[j] = after;
        state.q[j] += h * (before + share * (after - before));
    }
    for (work, power) in state.work.iter_mut().zip(power) {
        *work += h * power;
    }
    if matches!(model.link, Link::Rigid) {
        model.project(end, state, (PROJECTIONS, &now.held));
    }
}

/// Ends the run.
pub(super) fn stop<const N: usize>(
    time: f64,
    (joint, gain): (usize, f64),
    (state, memory): (&mut State<f64, N>, &mut Memory<f64>),
) {
    memory.ambiguous_friction = Some(AmbiguousFriction { time, joint, gain });
    state.qd = Joints::repeat(f64::NAN);
}

/// The drive at a fraction of a step: positions by Hermite's cubic, all else by the parabola through start, middle and end.
pub(super) fn input_at<const N: usize>(inputs: &Inputs<f64, N>, h: f64, x: f64) -> Input<f64, N> {
    let Inputs { start, middle, end } = *inputs;
    if x <= 0.0 {
        return *start;
    }
    if x >= 1.0 {
        return *end;
    }
    let y = 1.0 - x;
    let parabola = |a: f64, b: f64, c: f64| y * (y - x) * a + 4.0 * x * y * b + x * (x - y) * c;
    let plane = |of: &dyn Fn(&Input<f64, N>) -> [f64; 2]| {
        let [a, b, c] = [start, middle, end].map(of);
        [0, 1].map(|axis| parabola(a[axis], b[axis], c[axis]))
    };
    let (from, to) = (&start.handle, &end.handle);
    Input {
        time: start.time + x * (end.time - start.time),
        handle: Handle {
            position: [0, 1].map(|axis| {
                let ends = y * y * (1.0 + 2.0 * x) * from.position[axis]
                    + x * x * (1.0 + 2.0 * y) * to.position[axis];
                ends + h * x * y * (y * from.velocity[axis] - x * to.velocity[axis])
            }),
            velocity: plane(&|input| input.handle.velocity),
            acceleration: plane(&|input| input.handle.acceleration),
        },
        torque: Joints::from_fn(|j, _| parabola(start.torque[j], middle.torque[j], end.torque[j])),
        base: BaseMotion {
            position: plane(&|input| input.base.position),
            velocity: plane(&|input| input.base.velocity),
            acceleration: plane(&|input| input.base.acceleration),
        },
        activity: core::array::from_fn(|j| {
            parabola(start.activity[j], middle.activity[j], end.activity[j])
        }),
    }
}
