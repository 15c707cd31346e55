//! The native engine: minimal coordinates, one run at a time.

use crate::closed_chain::branch_free::BranchFree;
use crate::closed_chain::state::{Outcome, State};
use crate::integrators::advance::advance;
use crate::integrators::divided_step::step_in_pieces;
use crate::integrators::input_buffer::{Ahead, InputBuffer};
use crate::integrators::step::{Memory, Stages, fourth_order};
use crate::preparation::prepared_run::Prepared;
use crate::recording::recorder::{Instant, Pieces, Recorder, Row};
use crate::{Experiment, Integrator, Partial, SimulationError};
use arm_core::effect::States;
use arm_core::simd_dispatch::{Computation, dispatch};
use arm_core::{Joints, Pose, Scalar};

/// Runs an experiment, recorded as a whole or in pieces; the loop does not allocate.
pub(crate) fn run<const N: usize>(
    experiment: &Experiment<N>,
    pieces: Option<Pieces<'_, N>>,
) -> Result<Partial<N>, SimulationError> {
    let prepared = Prepared::recorded(experiment, pieces.is_some())?;
    let schedule = prepared.schedule;
    let mut recorder = Recorder::with(&prepared, pieces)?;
    let mut memory = Memory::new(prepared.model.effects.len());
    let mut state = State {
        q: prepared.start.0,
        qd: prepared.start.1,
        work: [0.0; 4],
    };
    let mut row = Row::new();
    let mut sample = |steps: usize, state: &State<f64, N>, memory: &[States<f64>]| {
        let instant = Instant {
            model: &prepared.model,
            input: &prepared.input(schedule.time(steps)),
            state,
            memory,
        };
        row.fill_solved(&instant, experiment.columns);
        recorder.push(&row, |value| *value)
    };
    let mut wanted = sample(0, &state, &memory.state).is_continue();
    let mut feed = InputBuffer::new(prepared.integrator());
    let is_explicit = prepared.integrator() != Integrator::Imex;
    let plain = prepared.model.plain().filter(|_| is_explicit);
    let mut stopped = None;
    let mut broken = prepared.discontinuities.steps().peekable();
    let (mut done, mut sampled) = (0, 0);
    while wanted && done < schedule.steps {
        let next = done + 1;
        let at = (&mut state, &mut memory);
        if broken.next_if_eq(&next).is_some() {
            while broken.next_if_eq(&next).is_some() {}
            step_in_pieces(&prepared, next, at);
            done = next;
        } else {
            let most = schedule.smooth(done, sampled, broken.peek());
            let ahead = feed.ahead(next, most, |half_steps, out| {
                prepared.inputs(half_steps, out);
            });
            done += dispatch(Steps {
                prepared: &prepared,
                plain: plain.as_ref(),
                ahead,
                at,
            });
        }
        if let Some(joint) = diverged(&state) {
            stopped = Some(why(&memory, (done, schedule.time(done), joint)));
            break;
        }
        if done == sampled + schedule.every {
            sampled = done;
            wanted = sample(done, &state, &memory.state).is_continue();
        }
    }
    Ok(Partial {
        recording: recorder.finish(),
        stopped,
    })
}

/// Some steps, to the end or to the first after which the state is not finite.
struct Steps<'a, const N: usize> {
    prepared: &'a Prepared<'a, N>,
    /// The rig, where it is plain.
    plain: Option<&'a BranchFree<f64, N>>,
    ahead: Ahead<'a, f64, N>,
    at: (&'a mut State<f64, N>, &'a mut Memory<f64>),
}

impl<const N: usize> Computation for Steps<'_, N> {
    /// The number of steps made.
    type Output = usize;

    #[inline(always)]
    fn call(self) -> usize {
        let Self {
            prepared,
            plain,
            ahead,
            at: (state, memory),
        } = self;
        let h = prepared.schedule.dt;
        let Some(rig) = plain else {
            for number in 0..ahead.steps {
                let (inputs, at) = (ahead.step(number), (&mut *state, &mut *memory));
                advance(&prepared.model, prepared.integrator(), h, inputs, at);
                if !state.is_finite() {
                    return number + 1;
                }
            }
            return ahead.steps;
        };
        let rig = *rig;
        Alone { rig, ahead, h }.advance(prepared.integrator(), ahead.steps, state)
    }
}

/// Steps of plain rigs. A trait, as closures cannot be made to be inlined.
pub(crate) trait BranchFreeSteps<T: Scalar, const N: usize> {
    /// Length of a step \[s\].
    fn h(&self) -> f64;

    /// One step of [`Integrator::SemiImplicitEuler`].
    ///
    /// * `step` - counted from zero
    fn first_order(&self, step: usize, state: &mut State<T, N>);

    /// What follows from angles and speeds at a stage of a step of [`Integrator::Rk4`].
    fn evaluate(&self, step: usize, stage: usize, state: [&Joints<T, N>; 2]) -> Outcome<T, N>;

    /// Makes some steps, up to the first after which the state is not finite; returns their number.
    #[inline(always)]
    fn advance(&self, integrator: Integrator, steps: usize, state: &mut State<T, N>) -> usize {
        match integrator {
            Integrator::SemiImplicitEuler => self.strides::<false>(steps, state),
            Integrator::Rk4 | Integrator::Imex => self.strides::<true>(steps, state),
        }
    }

    /// A state that is not finite stays so: it is checked after all of the steps, and only if the check fails they are repeated
    /// one by one.
    #[inline(always)]
    fn strides<const FOURTH: bool>(&self, steps: usize, state: &mut State<T, N>) -> usize {
        let (mut made, mut stride) = (0, if state.is_finite() { steps } else { 1 });
        while made < steps {
            let mut now = *state;
            for step in made..made + stride {
                if FOURTH {
                    fourth_order(self.h(), &mut now, &mut Step { of: self, step });
                } else {
                    self.first_order(step, &mut now);
                }
            }
            let finite = now.is_finite();
            if finite || stride == 1 {
                *state = now;
                made += stride;
            }
            if !finite {
                if stride == 1 {
                    break;
                }
                stride = 1;
            }
        }
        made
    }
}

/// One of some steps.
struct Step<'a, P: ?Sized> {
    of: &'a P,
    step: usize,
}

impl<T: Scalar, P: BranchFreeSteps<T, N> + ?Sized, const N: usize> Stages<T, N> for Step<'_, P> {
    #[inline(always)]
    fn evaluate(&mut self, stage: usize, q: &Joints<T, N>, qd: &Joints<T, N>) -> Outcome<T, N> {
        self.of.evaluate(self.step, stage, [q, qd])
    }
}

/// Steps of one plain rig.
struct Alone<'a, const N: usize> {
    rig: BranchFree<f64, N>,
    ahead: Ahead<'a, f64, N>,
    h: f64,
}

impl<const N: usize> BranchFreeSteps<f64, N> for Alone<'_, N> {
    #[inline(always)]
    fn h(&self) -> f64 {
        self.h
    }

    #[inline(always)]
    fn first_order(&self, step: usize, state: &mut State<f64, N>) {
        let handle = &self.ahead.step(step).start.handle;
        let pose = Pose::new(&state.q);
        let outcome = self.rig.evaluate(handle, &pose, [&state.q, &state.qd]);
        state.advance(self.h, &outcome);
    }

    #[inline(always)]
    fn evaluate(&self, step: usize, stage: usize, state: [&Joints<f64, N>; 2]) -> Outcome<f64, N> {
        let handle = &self.ahead.step(step).at_stage(stage).handle;
        self.rig.evaluate(handle, &Pose::new(state[0]), state)
    }
}

/// Why a state ceased to be finite.
pub(crate) fn why(
    memory: &Memory<f64>,
    (step, time, joint): (usize, f64, usize),
) -> SimulationError {
    match memory.ambiguous_friction {
        Some(ambiguous_friction) => ambiguous_friction.into(),
        None => SimulationError::Diverged { step, time, joint },
    }
}

/// The first joint whose angle or speed is not finite.
#[inline]
pub(crate) fn diverged<const N: usize>(state: &State<f64, N>) -> Option<usize> {
    if state.is_finite() {
        return None;
    }
    (0..N).find(|&i| !(state.q[i].is_finite() && state.qd[i].is_finite()))
}
