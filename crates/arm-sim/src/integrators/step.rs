//! One step of each integrator, the same source for single runs and lanes.

use arm_core::effect::{MAX_STATES, Motion, States};
use arm_core::simd_dispatch::{Computation, dispatch};
use arm_core::{Joints, Scalar};

use crate::closed_chain::model::{Link, Model};
use crate::closed_chain::state::{Input, Outcome, State};
use crate::integrators::implicit_friction::SmoothFriction;
use crate::{Integrator, SimulationError};

/// Newton steps that bring a rigidly held tip back to its handle: after a step it is off by the error of the integrator
/// in one step, and each squares it.
pub(crate) const PROJECTIONS: usize = 2;

/// What drives the arm in a step: at its start, its middle and its end.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Inputs<'a, T, const N: usize> {
    pub start: &'a Input<T, N>,
    /// Not used by semi-implicit Euler.
    pub middle: &'a Input<T, N>,
    pub end: &'a Input<T, N>,
}

impl<'a, T, const N: usize> Inputs<'a, T, N> {
    /// What drives the arm at a stage of [`Stages`].
    #[inline(always)]
    pub fn at_stage(&self, stage: usize) -> &'a Input<T, N> {
        [self.start, self.middle, self.middle, self.end][stage]
    }
}

/// Friction that has no unique solution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AmbiguousFriction {
    /// Time \[s\].
    pub time: f64,
    /// Zero-based joint.
    pub joint: usize,
    /// Loop gain of the friction, through the joint force with which it grows.
    pub gain: f64,
}

impl From<AmbiguousFriction> for SimulationError {
    fn from(ambiguous_friction: AmbiguousFriction) -> Self {
        let AmbiguousFriction { time, joint, gain } = ambiguous_friction;
        Self::AmbiguousFriction { time, joint, gain }
    }
}

/// States of the effects, and memory for those of the stages.
#[derive(Clone, Debug)]
pub(crate) struct Memory<T> {
    pub state: Vec<States<T>>,
    stage: Vec<States<T>>,
    rate: Vec<States<T>>,
    sum: Vec<States<T>>,
    /// The states before a step that may have to be made again.
    pub kept: Vec<States<T>>,
    /// Memory for the smooth friction of a step.
    pub smooth: Vec<SmoothFriction>,
    /// Why a step could not be made.
    pub ambiguous_friction: Option<AmbiguousFriction>,
}

impl<T: Scalar> Memory<T> {
    pub fn new(effects: usize) -> Self {
        let zeros = vec![[T::ZERO; MAX_STATES]; effects];
        Self {
            state: zeros.clone(),
            stage: zeros.clone(),
            rate: zeros.clone(),
            sum: zeros.clone(),
            kept: zeros,
            smooth: Vec::with_capacity(effects),
            ambiguous_friction: None,
        }
    }

    /// Brings the states of effects to a stage, `ahead` of the start along the motion there.
    pub fn advance_to_stage<const N: usize>(
        &mut self,
        model: &Model<T, N>,
        ahead: T,
        (input, q, qd): (&Input<T, N>, &Joints<T, N>, &Joints<T, N>),
        now: &Outcome<T, N>,
    ) {
        if model.has_memory {
            model.memory_rates(&motion(input, q, qd, now), &self.state, &mut self.sum);
            let (states, rates) = (self.state.as_flattened(), self.sum.as_flattened());
            for (i, at) in self.stage.as_flattened_mut().iter_mut().enumerate() {
                *at = states[i] + ahead * rates[i];
            }
        }
    }

    /// The states of effects at a stage.
    pub fn at_stage<const N: usize>(&self, model: &Model<T, N>) -> &[States<T>] {
        if model.has_memory {
            &self.stage
        } else {
            &self.state
        }
    }

    /// Brings the states of effects from the start to the end of a step.
    ///
    /// * `parts` - of the step, in which they go on as at the start and as at the stage
    pub fn advance_to_end<const N: usize>(
        &mut self,
        model: &Model<T, N>,
        parts: [T; 2],
        (input, q, qd): (&Input<T, N>, &Joints<T, N>, &Joints<T, N>),
        now: &Outcome<T, N>,
    ) {
        if model.has_memory {
            model.memory_rates(&motion(input, q, qd, now), &self.stage, &mut self.rate);
            let (early, late) = (self.sum.as_flattened(), self.rate.as_flattened());
            for (i, state) in self.state.as_flattened_mut().iter_mut().enumerate() {
                *state += parts[0] * early[i] + parts[1] * late[i];
            }
        }
    }
}

/// Advances a state by one step of length `h`; nothing in it is dry friction.
#[inline(always)]
pub(crate) fn step<T: Scalar, const N: usize>(
    model: &Model<T, N>,
    integrator: Integrator,
    h: f64,
    inputs: Inputs<T, N>,
    (state, memory): (&mut State<T, N>, &mut Memory<T>),
) {
    match integrator {
        Integrator::SemiImplicitEuler => semi_implicit_euler(model, h, inputs, state, memory),
        Integrator::Rk4 | Integrator::Imex => {
            rk4_by_calls(model, (h, inputs), (state, memory), &mut { model })
        }
    }
    if matches!(model.link, Link::Rigid) {
        model.project(inputs.end, state, (PROJECTIONS, &[false; N]));
    }
}

/// What a stage of [`rk4_by_calls`] is evaluated with.
pub(crate) trait Evaluate<T, const N: usize> {
    /// What follows from input, angles and speeds, and states of effects; called for each stage in order.
    fn evaluate(
        &mut self,
        input: &Input<T, N>,
        moving: (&Joints<T, N>, &Joints<T, N>),
        memory: &[States<T>],
    ) -> Outcome<T, N>;
}

impl<T: Scalar, const N: usize> Evaluate<T, N> for &Model<T, N> {
    #[inline(always)]
    fn evaluate(
        &mut self,
        input: &Input<T, N>,
        (q, qd): (&Joints<T, N>, &Joints<T, N>),
        memory: &[States<T>],
    ) -> Outcome<T, N> {
        Model::evaluate(self, input, q, qd, memory)
    }
}

/// [`rk4`] with a separate call for each stage, for the vectors of this processor: its code is not inlined four times.
#[inline(always)]
pub(crate) fn rk4_by_calls<T: Scalar, const N: usize>(
    model: &Model<T, N>,
    how: (f64, Inputs<T, N>),
    at: (&mut State<T, N>, &mut Memory<T>),
    rig: &mut impl Evaluate<T, N>,
) {
    rk4(model, how, at, |input, q, qd, memory| {
        let (rig, moving) = (&mut *rig, (q, qd));
        dispatch(Stage {
            rig,
            input,
            moving,
            memory,
        })
    });
}

/// One stage.
struct Stage<'a, E, T, const N: usize> {
    rig: &'a mut E,
    input: &'a Input<T, N>,
    moving: (&'a Joints<T, N>, &'a Joints<T, N>),
    memory: &'a [States<T>],
}

impl<T: Scalar, E: Evaluate<T, N>, const N: usize> Computation for Stage<'_, E, T, N> {
    type Output = Outcome<T, N>;

    #[inline(always)]
    fn call(self) -> Outcome<T, N> {
        self.rig.evaluate(self.input, self.moving, self.memory)
    }
}

#[inline(always)]
fn semi_implicit_euler<T: Scalar, const N: usize>(
    model: &Model<T, N>,
    h: f64,
    inputs: Inputs<T, N>,
    state: &mut State<T, N>,
    memory: &mut Memory<T>,
) {
    let h = T::of(h);
    let now = model.evaluate(inputs.start, &state.q, &state.qd, &memory.state);
    remember(model, h, inputs.start, (state, memory), &now);
    state.advance(h, &now);
}

/// Carries the states of effects on for a time, along the motion at its start.
#[inline(always)]
pub(crate) fn remember<T: Scalar, const N: usize>(
    model: &Model<T, N>,
    h: T,
    input: &Input<T, N>,
    (state, memory): (&State<T, N>, &mut Memory<T>),
    now: &Outcome<T, N>,
) {
    if model.has_memory {
        let motion = motion(input, &state.q, &state.qd, now);
        model.memory_rates(&motion, &memory.state, &mut memory.rate);
        let rates = memory.rate.as_flattened();
        for (m, rate) in memory.state.as_flattened_mut().iter_mut().zip(rates) {
            *m += h * *rate;
        }
    }
}

/// Evaluation of the stages of Rk4. A trait, as closures cannot be forced inline.
pub(crate) trait Stages<T, const N: usize> {
    /// What follows from angles and speeds at one of [`STAGES`], called in order.
    fn evaluate(&mut self, stage: usize, q: &Joints<T, N>, qd: &Joints<T, N>) -> Outcome<T, N>;
}

/// Time of each stage as a fraction of the step, and its weight in the sum of slopes, in sixths.
const STAGES: [(f64, f64); 4] = [(0.0, 1.0), (0.5, 2.0), (0.5, 2.0), (1.0, 1.0)];

/// One step of the classical method.
#[inline(always)]
pub(crate) fn fourth_order<T: Scalar, const N: usize>(
    h: f64,
    state: &mut State<T, N>,
    stages: &mut impl Stages<T, N>,
) {
    let zero = Joints::<T, N>::repeat(T::ZERO);
    // Slopes of the stage before, and the weighted sums of all.
    let (mut speed, mut acceleration) = (zero, zero);
    let (mut speeds, mut accelerations, mut powers) = (zero, zero, [T::ZERO; 4]);
    for (stage, (into, weight)) in STAGES.into_iter().enumerate() {
        let (ahead, weight) = (T::of(into * h), T::of(weight));
        let (mut q, mut qd) = (state.q, state.qd);
        if stage > 0 {
            add(&mut q, ahead, &speed);
            add(&mut qd, ahead, &acceleration);
        }
        let now = stages.evaluate(stage, &q, &qd);
        (speed, acceleration) = (qd, now.qdd);
        add(&mut speeds, weight, &speed);
        add(&mut accelerations, weight, &acceleration);
        for (sum, power) in powers.iter_mut().zip(&now.power) {
            *sum += weight * *power;
        }
    }
    let sixth = T::of(h / 6.0);
    add(&mut state.q, sixth, &speeds);
    add(&mut state.qd, sixth, &accelerations);
    for (work, power) in state.work.iter_mut().zip(&powers) {
        *work += sixth * *power;
    }
}

/// One step of the classical method, with the states of effects; `evaluate` computes the outcome from input, angles, speeds and
/// these.
#[inline(always)]
pub(crate) fn rk4<T: Scalar, const N: usize>(
    model: &Model<T, N>,
    (h, inputs): (f64, Inputs<T, N>),
    (state, memory): (&mut State<T, N>, &mut Memory<T>),
    evaluate: impl FnMut(&Input<T, N>, &Joints<T, N>, &Joints<T, N>, &[States<T>]) -> Outcome<T, N>,
) {
    let mut stages = Remembering {
        model,
        h,
        inputs,
        memory,
        evaluate,
    };
    fourth_order(h, state, &mut stages);
    if model.has_memory {
        let (sixth, sums) = (T::of(h / 6.0), memory.sum.as_flattened());
        for (m, sum) in memory.state.as_flattened_mut().iter_mut().zip(sums) {
            *m += sixth * *sum;
        }
    }
}

/// Stages with the states of effects, whose slopes are summed on the way.
struct Remembering<'a, T, F, const N: usize> {
    model: &'a Model<T, N>,
    h: f64,
    inputs: Inputs<'a, T, N>,
    memory: &'a mut Memory<T>,
    evaluate: F,
}

impl<T: Scalar, F, const N: usize> Stages<T, N> for Remembering<'_, T, F, N>
where
    F: FnMut(&Input<T, N>, &Joints<T, N>, &Joints<T, N>, &[States<T>]) -> Outcome<T, N>,
{
    #[inline(always)]
    fn evaluate(&mut self, stage: usize, q: &Joints<T, N>, qd: &Joints<T, N>) -> Outcome<T, N> {
        let input = self.inputs.at_stage(stage);
        let (into, weight) = STAGES[stage];
        let memory = &mut *self.memory;
        if self.model.has_memory {
            let ahead = T::of(into * self.h);
            let (starts, rates) = (memory.state.as_flattened(), memory.rate.as_flattened());
            for (i, at) in memory.stage.as_flattened_mut().iter_mut().enumerate() {
                let start = starts[i];
                *at = if stage > 0 {
                    start + ahead * rates[i]
                } else {
                    start
                };
            }
        }
        let now = (self.evaluate)(input, q, qd, &memory.stage);
        if self.model.has_memory {
            self.model
                .memory_rates(&motion(input, q, qd, &now), &memory.stage, &mut memory.rate);
            let (weight, rates) = (T::of(weight), memory.rate.as_flattened());
            for (i, sum) in memory.sum.as_flattened_mut().iter_mut().enumerate() {
                let before = if stage > 0 { *sum } else { T::ZERO };
                *sum = before + weight * rates[i];
            }
        }
        now
    }
}

#[inline(always)]
fn motion<T: Scalar, const N: usize>(
    input: &Input<T, N>,
    q: &Joints<T, N>,
    qd: &Joints<T, N>,
    now: &Outcome<T, N>,
) -> Motion<T, N> {
    let mut motion = input.motion(q, qd);
    motion.qdd = now.qdd;
    motion.joint_force = now.joint_force;
    motion
}

/// `a += s b`.
#[inline(always)]
fn add<T: Scalar, const N: usize>(a: &mut Joints<T, N>, s: T, b: &Joints<T, N>) {
    for i in 0..N {
        a[i] += s * b[i];
    }
}
