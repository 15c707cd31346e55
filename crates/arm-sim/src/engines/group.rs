//! Runs in the lanes of one, which make their steps together.

use arm_core::effect::States;
use arm_core::simd_dispatch::{Computation, dispatch};
use arm_core::{Joints, Lanes, Plane, Pose, Scalar, Setup};

use crate::closed_chain::branch_free::BranchFree;
use crate::closed_chain::model::Model;
use crate::closed_chain::state::{Input, Outcome, State};
use crate::engines::native::{BranchFreeSteps, diverged};
use crate::engines::packing::{
    pack, pack_assistance, pack_effect, pack_input, pack_link, pack_setup,
};
use crate::integrators::divided_step::step_in_pieces;
use crate::integrators::friction::{steady, switching};
use crate::integrators::input_buffer::{Ahead, InputBuffer};
use crate::integrators::step::{Inputs, Memory, step};
use crate::preparation::prepared_run::{Prepared, commands};
use crate::recording::recorder::{Instant, Recorder, Row};
use crate::{Columns, Handle, Integrator, Recording, SimulationError};

pub(super) type Outcomes<const N: usize> = Vec<Result<Recording<N>, SimulationError>>;

/// The run of a lane. A group of fewer runs than lanes repeats its last one in the lanes left over.
fn in_lane<'a, 'b, const N: usize>(
    prepared: &'b [&'b Prepared<'a, N>],
    lane: usize,
) -> &'b Prepared<'a, N> {
    prepared[lane.min(prepared.len() - 1)]
}

/// Runs in the lanes of one, on their way.
pub(super) struct Group<'a, 'b, const L: usize, const N: usize> {
    prepared: &'b [&'b Prepared<'a, N>],
    setup: Setup<Lanes<L>, N>,
    model: Model<Lanes<L>, N>,
    /// The rig, where it is plain.
    plain: Option<BranchFree<Lanes<L>, N>>,
    /// Whether one drive, without displacement, is that of all lanes.
    one_drive: bool,
    own: InputBuffer<Lanes<L>, N>,
    /// Room for the commands of each lane.
    commanded: [Vec<Input<f64, N>>; L],
    state: State<Lanes<L>, N>,
    memory: Memory<Lanes<L>>,
    /// Room for the states of effects in one lane.
    alone: Memory<f64>,
    row: Row<Lanes<L>>,
    /// Room for one recorded row of one lane.
    row_alone: Row<f64>,
    recorders: Vec<Recorder<'b, 'static, N>>,
    /// Why a run stopped early.
    stopped: Vec<Option<SimulationError>>,
}

impl<'a, 'b, const L: usize, const N: usize> Group<'a, 'b, L, N> {
    pub fn new(
        prepared: &'b [&'b Prepared<'a, N>],
        one_drive: bool,
    ) -> Result<Self, SimulationError> {
        let lane = |i: usize| in_lane(prepared, i);
        let first = prepared[0];
        let setup: Setup<Lanes<L>, N> = pack_setup(lane);
        let effects =
            (0..first.model.effects.len()).map(|e| pack_effect(|i| &lane(i).model.effects[e]));
        let mut model = Model::new(&setup, pack_link(lane, setup.contact), effects.collect())?;
        model.heaves = first.model.heaves;
        let assistance = pack_assistance(|i| lane(i).experiment.assistance.as_ref());
        if let Some([stiffness, damping]) = assistance {
            model.assist(stiffness, damping);
        }
        Ok(Self {
            prepared,
            plain: model.plain(),
            one_drive,
            own: InputBuffer::new(first.integrator()),
            commanded: [const { Vec::new() }; L],
            state: State {
                q: Joints::from_fn(|j, _| pack(|i| lane(i).start.0[j])),
                qd: Joints::from_fn(|j, _| pack(|i| lane(i).start.1[j])),
                work: [Lanes::ZERO; 4],
            },
            memory: Memory::new(model.effects.len()),
            alone: Memory::new(model.effects.len()),
            row: Row::new(),
            row_alone: Row::new(),
            recorders: prepared
                .iter()
                .map(|run| Recorder::new(run))
                .collect::<Result<_, _>>()?,
            stopped: vec![None; prepared.len()],
            setup,
            model,
        })
    }

    /// Whether any of the runs has not stopped early.
    pub fn goes_on(&self) -> bool {
        self.stopped.iter().any(Option::is_none)
    }

    /// Records the runs that go on, after a number of steps.
    pub fn sample(&mut self, steps: usize) {
        let time = self.prepared[0].schedule.time(steps);
        let input = if self.one_drive {
            self.prepared[0].input(time).wide()
        } else {
            pack_input(|i| in_lane(self.prepared, i).input(time))
        };
        let columns = self.prepared[0].experiment.columns;
        let recorders = self.recorders.iter_mut().zip(&self.stopped).enumerate();
        let going = recorders.filter(|(_, (_, stopped))| stopped.is_none());
        let recorders = going.map(|(i, (recorder, _))| (i, recorder));
        // Whole recordings never break off.
        if self.model.has_dry && columns == Columns::All {
            for (i, recorder) in recorders {
                copy_lane(i, &self.memory.state, &mut self.alone.state);
                let instant = Instant {
                    model: &self.prepared[i].model,
                    input: &input.lane(i),
                    state: &self.state.lane(i),
                    memory: &self.alone.state,
                };
                self.row_alone.fill_solved(&instant, columns);
                let _ = recorder.push(&self.row_alone, |value| *value);
            }
            return;
        }
        let instant = Instant {
            model: &self.model,
            input: &input,
            state: &self.state,
            memory: &self.memory.state,
        };
        self.row.fill(&instant, columns);
        for (i, recorder) in recorders {
            let _ = recorder.push(&self.row, |all| all.0[i]);
        }
    }

    /// Makes some steps from number `next` on, or those until all runs have stopped.
    ///
    /// * `drive` - of these steps if all runs share it, else `None`
    pub fn advance(&mut self, next: usize, steps: usize, drive: Option<Ahead<f64, N>>) {
        let mut made = 0;
        while made < steps && self.goes_on() {
            made += match drive {
                Some(ahead) => self.advance_along(ahead.after(made)),
                None => self.advance_apart(next + made, steps - made),
            };
            self.stop_diverged(next - 1 + made);
        }
    }

    /// Makes steps along one drive of all lanes; returns how many.
    fn advance_along(&mut self, ahead: Ahead<f64, N>) -> usize {
        let steps = Steps::of(&self.model, self.plain.as_ref(), self.prepared);
        let at = (&mut self.state, &mut self.memory, &mut self.alone);
        dispatch(Advance { steps, ahead, at })
    }

    /// Makes steps from number `next` on, at most `most`, each lane along its own drive; returns how many.
    fn advance_apart(&mut self, next: usize, most: usize) -> usize {
        let (prepared, first) = (self.prepared, self.prepared[0]);
        let (commanded, setup) = (&mut self.commanded, &self.setup);
        let ahead = self.own.ahead(next, most, |half_steps, out| {
            for (i, inputs) in commanded.iter_mut().enumerate() {
                inputs.clear();
                let experiment = in_lane(prepared, i).experiment;
                commands(experiment, &first.schedule, half_steps, inputs);
            }
            for at in 0..half_steps.len() {
                let mut input = pack_input(|i| commanded[i][at]);
                input.stands_as_in(setup);
                out.push(input);
            }
        });
        let steps = Steps::of(&self.model, self.plain.as_ref(), prepared);
        let at = (&mut self.state, &mut self.memory, &mut self.alone);
        dispatch(Advance { steps, ahead, at })
    }

    /// One step of each run by itself.
    pub fn step_apart(&mut self, number: usize) {
        let (before, memory) = (self.state, &mut self.memory);
        memory.kept.copy_from_slice(&memory.state);
        for i in 0..L {
            step_lane(
                i,
                &before,
                (&mut self.state, memory),
                &mut self.alone,
                |at| {
                    step_in_pieces(in_lane(self.prepared, i), number, at);
                },
            );
        }
        self.stop_diverged(number);
    }

    /// Stops the runs whose state is no longer finite after a number of steps.
    fn stop_diverged(&mut self, done: usize) {
        if self.state.is_finite() {
            return;
        }
        for (i, stop) in self.stopped.iter_mut().enumerate() {
            if let (None, Some(joint)) = (&stop, diverged(&self.state.lane(i))) {
                *stop = Some(SimulationError::Diverged {
                    step: done,
                    time: self.prepared[0].schedule.time(done),
                    joint,
                });
            }
        }
    }

    pub fn finish(self) -> Outcomes<N> {
        let recordings = self.recorders.into_iter().map(Recorder::finish);
        recordings
            .zip(self.stopped)
            .map(|(recording, stopped)| stopped.map_or(Ok(recording), Err))
            .collect()
    }
}

/// Takes the states of effects out of one lane.
fn copy_lane<const L: usize>(lane: usize, all: &[States<Lanes<L>>], one: &mut [States<f64>]) {
    let states = one.as_flattened_mut().iter_mut();
    for (one, all) in states.zip(all.as_flattened()) {
        *one = all.0[lane];
    }
}

/// Makes a step of one lane by itself, from the state before the step; the states of effects before it are kept in `memory`.
///
/// * `alone` - room for its states of effects
fn step_lane<const L: usize, const N: usize>(
    lane: usize,
    before: &State<Lanes<L>, N>,
    (state, memory): (&mut State<Lanes<L>, N>, &mut Memory<Lanes<L>>),
    alone: &mut Memory<f64>,
    step: impl FnOnce((&mut State<f64, N>, &mut Memory<f64>)),
) {
    let mut one = before.lane(lane);
    copy_lane(lane, &memory.kept, &mut alone.state);
    step((&mut one, alone));
    state.set_lane(lane, &one);
    let states = memory.state.as_flattened_mut().iter_mut();
    for (all, one) in states.zip(alone.state.as_flattened()) {
        all.0[lane] = *one;
    }
}

/// What steps are made of, whatever drives them.
struct Steps<'a, const L: usize, const N: usize> {
    runs: &'a [&'a Prepared<'a, N>],
    model: &'a Model<Lanes<L>, N>,
    /// The rig, where it is plain.
    plain: Option<&'a BranchFree<Lanes<L>, N>>,
    integrator: Integrator,
    h: f64,
}

impl<'a, const L: usize, const N: usize> Steps<'a, L, N> {
    fn of(
        model: &'a Model<Lanes<L>, N>,
        plain: Option<&'a BranchFree<Lanes<L>, N>>,
        runs: &'a [&'a Prepared<'a, N>],
    ) -> Self {
        Self {
            runs,
            model,
            plain,
            integrator: runs[0].integrator(),
            h: runs[0].schedule.dt,
        }
    }

    /// A step with dry friction: of all lanes together, and again one by one of those in which a joint starts or stops slipping.
    #[inline(always)]
    fn step_with_friction(
        &self,
        inputs: Inputs<Lanes<L>, N>,
        (state, memory): (&mut State<Lanes<L>, N>, &mut Memory<Lanes<L>>),
        alone: &mut Memory<f64>,
    ) {
        let before = *state;
        memory.kept.copy_from_slice(&memory.state);
        let made = steady(self.model, self.h, inputs, (state, memory));
        if made.every(|made| made > 0.0) {
            return;
        }
        for i in (0..L).filter(|&i| made.0[i] < 0.0) {
            let [start, middle, end] =
                [inputs.start, inputs.middle, inputs.end].map(|input| input.lane(i));
            let inputs = Inputs {
                start: &start,
                middle: &middle,
                end: &end,
            };
            step_lane(i, &before, (state, memory), alone, |at| {
                switching(&in_lane(self.runs, i).model, self.h, &inputs, at);
            });
        }
    }
}

/// Some steps of all lanes, to the end or to the first after which a state is not finite.
struct Advance<'a, T, const L: usize, const N: usize> {
    steps: Steps<'a, L, N>,
    ahead: Ahead<'a, T, N>,
    at: (
        &'a mut State<Lanes<L>, N>,
        &'a mut Memory<Lanes<L>>,
        &'a mut Memory<f64>,
    ),
}

impl<T: Scalar, const L: usize, const N: usize> Computation for Advance<'_, T, L, N>
where
    Input<T, N>: Drives<L, N>,
{
    /// The number of steps made.
    type Output = usize;

    #[inline(always)]
    fn call(self) -> usize {
        let Self {
            steps,
            ahead,
            at: (state, memory, alone),
        } = self;
        let Some(rig) = steps.plain else {
            for number in 0..ahead.steps {
                let inputs = ahead.step(number);
                let [start, middle, end] =
                    [inputs.start, inputs.middle, inputs.end].map(Drives::wide);
                let inputs = Inputs {
                    start: &start,
                    middle: &middle,
                    end: &end,
                };
                let at = (&mut *state, &mut *memory);
                if steps.model.has_dry {
                    steps.step_with_friction(inputs, at, alone);
                } else {
                    step(steps.model, steps.integrator, steps.h, inputs, at);
                }
                if !state.is_finite() {
                    return number + 1;
                }
            }
            return ahead.steps;
        };
        // A copy of which nobody else knows: without it the compiler must fear that the rig changes with the state.
        let (rig, h) = (*rig, steps.h);
        Abreast { rig, ahead, h }.advance(steps.integrator, ahead.steps, state)
    }
}

/// Steps of plain rigs in lanes.
struct Abreast<'a, T, const L: usize, const N: usize> {
    rig: BranchFree<Lanes<L>, N>,
    ahead: Ahead<'a, T, N>,
    h: f64,
}

impl<T: Scalar, const L: usize, const N: usize> BranchFreeSteps<Lanes<L>, N>
    for Abreast<'_, T, L, N>
where
    Input<T, N>: Drives<L, N>,
{
    #[inline(always)]
    fn h(&self) -> f64 {
        self.h
    }

    /// One loop over lanes around all of it, of which the compiler makes vectors.
    #[inline(always)]
    fn first_order(&self, step: usize, state: &mut State<Lanes<L>, N>) {
        let input = self.ahead.step(step).start;
        let pose = Pose::new(&state.q);
        // Into another place: what a lane writes is nothing that another one reads.
        let mut next = *state;
        for i in 0..L {
            let mut lane = state.lane(i);
            let rig = self.rig.lane(i);
            let now = rig.evaluate(&input.handle(i), &pose.lane(i), [&lane.q, &lane.qd]);
            lane.advance(self.h, &now);
            next.set_lane(i, &lane);
        }
        *state = next;
    }

    #[inline(always)]
    fn evaluate(
        &self,
        step: usize,
        stage: usize,
        [q, qd]: [&Joints<Lanes<L>, N>; 2],
    ) -> Outcome<Lanes<L>, N> {
        // Copies of which nobody else knows, as of the rig.
        let (input, q, qd) = (*self.ahead.step(step).at_stage(stage), *q, *qd);
        let pose = Pose::new(&q);
        let mut all = Outcome::none();
        for i in 0..L {
            let rig = self.rig.lane(i);
            // Not by `map`, which would copy every lane.
            let q = Joints::from_fn(|j, _| q[j].0[i]);
            let qd = Joints::from_fn(|j, _| qd[j].0[i]);
            let one = rig.evaluate(&input.handle(i), &pose.lane(i), [&q, &qd]);
            all.set_lane(i, &one);
        }
        all
    }
}

/// What drives all lanes, the same for each or not.
trait Drives<const L: usize, const N: usize>: Copy {
    fn wide(&self) -> Input<Lanes<L>, N>;
    /// The handle of one lane.
    fn handle(&self, lane: usize) -> Handle<f64>;
}

impl<const L: usize, const N: usize> Drives<L, N> for Input<f64, N> {
    #[inline(always)]
    fn wide(&self) -> Input<Lanes<L>, N> {
        pack_input(|_| *self)
    }
    #[inline(always)]
    fn handle(&self, _: usize) -> Handle<f64> {
        self.handle
    }
}

impl<const L: usize, const N: usize> Drives<L, N> for Input<Lanes<L>, N> {
    #[inline(always)]
    fn wide(&self) -> Input<Lanes<L>, N> {
        *self
    }
    #[inline(always)]
    fn handle(&self, lane: usize) -> Handle<f64> {
        let plane = |of: &Plane<Lanes<L>>| [of[0].0[lane], of[1].0[lane]];
        Handle {
            position: plane(&self.handle.position),
            velocity: plane(&self.handle.velocity),
            acceleration: plane(&self.handle.acceleration),
        }
    }
}
