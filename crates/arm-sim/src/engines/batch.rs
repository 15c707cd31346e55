//! Many runs side by side: eight in the lanes of one, groups of eight over threads.

use std::mem::discriminant;

use arm_core::effect::Effect;
use arm_core::{Contact, Displaced, Joints, Lanes, Plane, Pose, Scalar, Segment, Setup, Wave};

use crate::closed_chain::branch_free::BranchFree;
use crate::closed_chain::model::{Link, Model};
use crate::closed_chain::state::{BaseMotion, Input, Outcome, State};
use crate::engines::native::{BranchFreeSteps, diverged};
use crate::engines::simulate::simulate;
use crate::integrators::divided_step::step_in_pieces;
use crate::integrators::input_buffer::{Ahead, InputBuffer};
use crate::integrators::step::{Inputs, Memory, step};
use crate::preparation::prepared_run::{Prepared, commands};
use crate::recording::recorder::{Instant, Recorder, Row};
use crate::{Assistance, Experiment, Handle, Integrator, Recording, SimulationError, Springs};
use arm_core::simd_dispatch::{Computation, dispatch};

/// Runs in one group.
const LANES: usize = 8;

type Wide = Lanes<LANES>;
type Outcomes<const N: usize> = Vec<Result<Recording<N>, SimulationError>>;

/// Simulates many experiments; each has the bits of [`simulate`], whatever its neighbours and the number of threads.
///
/// Neighbours that differ only in values (not in kinds of effects, steps, or the kind of drive) run eight at a time in
/// one pass; order similar experiments together.
pub fn simulate_batch<const N: usize>(
    experiments: &[Experiment<N>],
    threads: usize,
) -> Outcomes<N> {
    let groups: Vec<&[Experiment<N>]> = experiments.chunks(LANES).collect();
    let threads = threads.clamp(1, groups.len().max(1));
    let mut done: Vec<Outcomes<N>> = Vec::new();
    if threads == 1 {
        done.extend(groups.into_iter().map(group));
    } else {
        // Every thread takes each `threads`-th group: fixed, and even for runs of slowly changing cost.
        let share = &|first: usize| -> Vec<Outcomes<N>> {
            let mine = groups.iter().skip(first).step_by(threads);
            mine.map(|experiments| group(experiments)).collect()
        };
        let mut shares: Vec<_> = std::thread::scope(|scope| {
            let workers: Vec<_> = (0..threads)
                .map(|first| scope.spawn(move || share(first)))
                .collect();
            let joined = workers.into_iter().map(|worker| worker.join());
            joined
                .map(|share| share.unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
                .map(Vec::into_iter)
                .collect()
        });
        for index in 0..groups.len() {
            done.extend(shares[index % threads].next());
        }
    }
    done.into_iter().flatten().collect()
}

/// Up to eight runs: in lanes where they are alike, else one by one.
fn group<const N: usize>(experiments: &[Experiment<N>]) -> Outcomes<N> {
    let prepared: Result<Vec<_>, _> = experiments.iter().map(Prepared::new).collect();
    match prepared {
        // The switches of dry friction are of each run alone.
        Ok(prepared)
            if prepared.len() > 1
                && !prepared.iter().any(|p| p.model.has_dry)
                && prepared.iter().all(|p| alike(p, &prepared[0])) =>
        {
            match side_by_side(&prepared) {
                Ok(outcomes) => outcomes,
                Err(error) => vec![Err(error); prepared.len()],
            }
        }
        _ => experiments.iter().map(simulate).collect(),
    }
}

/// Whether two runs take the same steps.
fn alike<const N: usize>(a: &Prepared<N>, b: &Prepared<N>) -> bool {
    let kinds =
        |p: &Prepared<N>| -> Vec<_> { p.model.effects.iter().map(|e| (e.kind, e.index)).collect() };
    a.schedule == b.schedule
        && a.experiment.columns == b.experiment.columns
        && a.integrator() == b.integrator()
        && discriminant(&a.model.link) == discriminant(&b.model.link)
        && a.model.base.is_some() == b.model.base.is_some()
        && a.setup.is_as_commanded() == b.setup.is_as_commanded()
        && a.model.heaves == b.model.heaves
        && a.model.is_assisted == b.model.is_assisted
        && kinds(a) == kinds(b)
}

/// Whether two runs are driven in the same way, seen from the base, with the same muscle activity and assistance.
fn same_drive<const N: usize>(a: &Prepared<N>, b: &Prepared<N>) -> bool {
    a.experiment.drive == b.experiment.drive
        && a.experiment.base == b.experiment.base
        && a.experiment.activity == b.experiment.activity
        && a.experiment.assistance == b.experiment.assistance
}

/// The run of a lane. A group of fewer than eight repeats its last one in the lanes left over.
fn in_lane<'a, 'b, const N: usize>(
    prepared: &'b [Prepared<'a, N>],
    lane: usize,
) -> &'b Prepared<'a, N> {
    &prepared[lane.min(prepared.len() - 1)]
}

/// The runs in the lanes of one.
fn side_by_side<const N: usize>(prepared: &[Prepared<N>]) -> Result<Outcomes<N>, SimulationError> {
    let schedule = prepared[0].schedule;
    let mut group = Group::new(prepared)?;
    group.sample(0);
    // Where the drive of any lane breaks, every lane makes its own step.
    let mut broken: Vec<usize> = prepared
        .iter()
        .flat_map(|p| p.discontinuities.steps())
        .collect();
    broken.sort_unstable();
    broken.dedup();
    let mut broken = broken.into_iter().peekable();
    let (mut done, mut sampled) = (0, 0);
    while done < schedule.steps {
        let next = done + 1;
        if broken.next_if_eq(&next).is_some() {
            step_apart(prepared, next, (&mut group.state, &mut group.memory));
            done = next;
        } else {
            let most = schedule.smooth(done, sampled, broken.peek());
            done += group.advance(next, most);
        }
        if group.stop_diverged(done) {
            break;
        }
        if done == sampled + schedule.every {
            sampled = done;
            group.sample(done);
        }
    }
    Ok(group.finish())
}

/// Runs in the lanes of one, on their way.
struct Group<'a, const N: usize> {
    prepared: &'a [Prepared<'a, N>],
    setup: Setup<Wide, N>,
    model: Model<Wide, N>,
    /// The rig, where it is plain.
    plain: Option<BranchFree<Wide, N>>,
    /// Whether one drive, without displacement, is that of all lanes.
    one_drive: bool,
    common: InputBuffer<f64, N>,
    own: InputBuffer<Wide, N>,
    /// Room for the commands of each lane.
    commanded: [Vec<Input<f64, N>>; LANES],
    state: State<Wide, N>,
    memory: Memory<Wide>,
    row: Row<Wide>,
    recorders: Vec<Recorder<'a, 'static, N>>,
    /// Why a run stopped early.
    stopped: Vec<Option<SimulationError>>,
}

impl<'a, const N: usize> Group<'a, N> {
    fn new(prepared: &'a [Prepared<'a, N>]) -> Result<Self, SimulationError> {
        let lane = |i: usize| in_lane(prepared, i);
        let first = &prepared[0];
        let setup = pack_setup(lane);
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
            one_drive: prepared
                .iter()
                .all(|p| same_drive(p, first) && p.setup.is_as_commanded()),
            common: InputBuffer::new(first.integrator()),
            own: InputBuffer::new(first.integrator()),
            commanded: Default::default(),
            state: State {
                q: Joints::from_fn(|j, _| pack(|i| lane(i).start.0[j])),
                qd: Joints::from_fn(|j, _| pack(|i| lane(i).start.1[j])),
                work: [Wide::ZERO; 4],
            },
            memory: Memory::new(model.effects.len()),
            row: Row::new(),
            recorders: prepared
                .iter()
                .map(Recorder::new)
                .collect::<Result<_, _>>()?,
            stopped: vec![None; prepared.len()],
            setup,
            model,
        })
    }

    /// Records the runs that go on, after a number of steps.
    fn sample(&mut self, steps: usize) {
        let time = self.prepared[0].schedule.time(steps);
        let input = if self.one_drive {
            self.prepared[0].input(time).wide()
        } else {
            pack_input(|i| in_lane(self.prepared, i).input(time))
        };
        let instant = Instant {
            model: &self.model,
            input: &input,
            state: &self.state,
            memory: &self.memory.state,
        };
        self.row.fill(&instant, self.prepared[0].experiment.columns);
        let recorders = self.recorders.iter_mut().zip(&self.stopped).enumerate();
        for (i, (recorder, stopped)) in recorders {
            if stopped.is_none() {
                // Whole recordings never break off.
                let _ = recorder.push(&self.row, |all| all.0[i]);
            }
        }
    }

    /// Makes steps from number `next` on, at most `most`; returns how many.
    fn advance(&mut self, next: usize, most: usize) -> usize {
        let (prepared, first) = (self.prepared, &self.prepared[0]);
        let schedule = &first.schedule;
        let steps = Steps {
            model: &self.model,
            plain: self.plain.as_ref(),
            integrator: first.integrator(),
            h: schedule.dt,
        };
        let at = (&mut self.state, &mut self.memory);
        if self.one_drive {
            let ahead = self.common.ahead(next, most, |half_steps, out| {
                commands(first.experiment, schedule, half_steps, out);
            });
            return dispatch(Advance { steps, ahead, at });
        }
        let (commanded, setup) = (&mut self.commanded, &self.setup);
        let ahead = self.own.ahead(next, most, |half_steps, out| {
            for (i, inputs) in commanded.iter_mut().enumerate() {
                inputs.clear();
                let experiment = in_lane(prepared, i).experiment;
                commands(experiment, schedule, half_steps, inputs);
            }
            for at in 0..half_steps.len() {
                let mut input = pack_input(|i| commanded[i][at]);
                input.stands_as_in(setup);
                out.push(input);
            }
        });
        dispatch(Advance { steps, ahead, at })
    }

    /// Stops the runs whose state is no longer finite after a number of steps; returns whether none is left.
    fn stop_diverged(&mut self, done: usize) -> bool {
        if self.state.is_finite() {
            return false;
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
        self.stopped.iter().all(Option::is_some)
    }

    fn finish(self) -> Outcomes<N> {
        let recordings = self.recorders.into_iter().map(Recorder::finish);
        recordings
            .zip(self.stopped)
            .map(|(recording, stopped)| stopped.map_or(Ok(recording), Err))
            .collect()
    }
}

/// What steps are made of, whatever drives them.
struct Steps<'a, const N: usize> {
    model: &'a Model<Wide, N>,
    /// The rig, where it is plain.
    plain: Option<&'a BranchFree<Wide, N>>,
    integrator: Integrator,
    h: f64,
}

/// Some steps of all lanes, to the end or to the first after which a state is not finite.
struct Advance<'a, T, const N: usize> {
    steps: Steps<'a, N>,
    ahead: Ahead<'a, T, N>,
    at: (&'a mut State<Wide, N>, &'a mut Memory<Wide>),
}

impl<T: Scalar, const N: usize> Computation for Advance<'_, T, N>
where
    Input<T, N>: Drives<N>,
{
    /// The number of steps made.
    type Output = usize;

    #[inline(always)]
    fn call(self) -> usize {
        let Self {
            steps,
            ahead,
            at: (state, memory),
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
                step(steps.model, steps.integrator, steps.h, inputs, at);
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
struct Abreast<'a, T, const N: usize> {
    rig: BranchFree<Wide, N>,
    ahead: Ahead<'a, T, N>,
    h: f64,
}

impl<T: Scalar, const N: usize> BranchFreeSteps<Wide, N> for Abreast<'_, T, N>
where
    Input<T, N>: Drives<N>,
{
    #[inline(always)]
    fn h(&self) -> f64 {
        self.h
    }

    /// One loop over lanes around all of it, of which the compiler makes vectors.
    #[inline(always)]
    fn first_order(&self, step: usize, state: &mut State<Wide, N>) {
        let input = self.ahead.step(step).start;
        let pose = Pose::new(&state.q);
        // Into another place: what a lane writes is nothing that another one reads.
        let mut next = *state;
        for i in 0..LANES {
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
        [q, qd]: [&Joints<Wide, N>; 2],
    ) -> Outcome<Wide, N> {
        // Copies of which nobody else knows, as of the rig.
        let (input, q, qd) = (*self.ahead.step(step).at_stage(stage), *q, *qd);
        let pose = Pose::new(&q);
        let mut all = Outcome::none();
        for i in 0..LANES {
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
trait Drives<const N: usize>: Copy {
    fn wide(&self) -> Input<Wide, N>;
    /// The handle of one lane.
    fn handle(&self, lane: usize) -> Handle<f64>;
}

impl<const N: usize> Drives<N> for Input<f64, N> {
    #[inline(always)]
    fn wide(&self) -> Input<Wide, N> {
        pack_input(|_| *self)
    }
    #[inline(always)]
    fn handle(&self, _: usize) -> Handle<f64> {
        self.handle
    }
}

impl<const N: usize> Drives<N> for Input<Wide, N> {
    #[inline(always)]
    fn wide(&self) -> Input<Wide, N> {
        *self
    }
    #[inline(always)]
    fn handle(&self, lane: usize) -> Handle<f64> {
        let plane = |of: &Plane<Wide>| [of[0].0[lane], of[1].0[lane]];
        Handle {
            position: plane(&self.handle.position),
            velocity: plane(&self.handle.velocity),
            acceleration: plane(&self.handle.acceleration),
        }
    }
}

/// One step of each run by itself.
fn step_apart<const N: usize>(
    prepared: &[Prepared<N>],
    number: usize,
    (state, memory): (&mut State<Wide, N>, &mut Memory<Wide>),
) {
    let mut lane_memory = Memory::new(memory.state.len());
    for i in 0..LANES {
        let run = in_lane(prepared, i);
        let mut lane = state.lane(i);
        let lanes = memory.state.as_flattened_mut();
        for (one, all) in lane_memory.state.as_flattened_mut().iter_mut().zip(&*lanes) {
            *one = all.0[i];
        }
        step_in_pieces(run, number, (&mut lane, &mut lane_memory));
        state.set_lane(i, &lane);
        for (one, all) in lane_memory.state.as_flattened().iter().zip(lanes) {
            all.0[i] = *one;
        }
    }
}

fn pack(value: impl Fn(usize) -> f64) -> Wide {
    Lanes(core::array::from_fn(value))
}

fn pack_plane(value: impl Fn(usize) -> Plane<f64>) -> Plane<Wide> {
    [0, 1].map(|axis| pack(|i| value(i)[axis]))
}

fn pack_link<'a, const N: usize>(
    lane: impl Fn(usize) -> &'a Prepared<'a, N>,
    contact: Contact<Wide>,
) -> Link<Wide> {
    match lane(0).model.link {
        Link::Compliant(_) => Link::Compliant(contact),
        Link::Free => Link::Free,
        Link::Forced(_) => Link::Forced(pack_plane(|i| match lane(i).model.link {
            Link::Forced(force) => force,
            _ => [0.0; 2],
        })),
        Link::Rigid => Link::Rigid,
    }
}

fn pack_effect<'a>(effect: impl Fn(usize) -> &'a Effect<f64>) -> Effect<Wide> {
    let first = effect(0);
    Effect {
        kind: first.kind,
        index: first.index,
        parameters: core::array::from_fn(|p| pack(|i| effect(i).parameters[p])),
        on: first.on,
    }
}

fn pack_input<const N: usize>(input: impl Fn(usize) -> Input<f64, N>) -> Input<Wide, N> {
    let inputs: [Input<f64, N>; LANES] = core::array::from_fn(input);
    Input {
        time: pack(|i| inputs[i].time),
        handle: Handle {
            position: pack_plane(|i| inputs[i].handle.position),
            velocity: pack_plane(|i| inputs[i].handle.velocity),
            acceleration: pack_plane(|i| inputs[i].handle.acceleration),
        },
        torque: Joints::from_fn(|j, _| pack(|i| inputs[i].torque[j])),
        base: BaseMotion {
            position: pack_plane(|i| inputs[i].base.position),
            velocity: pack_plane(|i| inputs[i].base.velocity),
            acceleration: pack_plane(|i| inputs[i].base.acceleration),
        },
        activity: core::array::from_fn(|j| pack(|i| inputs[i].activity[j])),
    }
}

/// Stiffness and damping of the lanes' assistance, which they all have or none has.
fn pack_assistance<'a, const N: usize>(
    assistance: impl Fn(usize) -> Option<&'a Assistance<N>>,
) -> Option<[[Wide; N]; 2]> {
    assistance(0)?;
    let of = |read: fn(&Springs<N>) -> &[f64; N]| {
        core::array::from_fn(|j| pack(|i| assistance(i).map_or(0.0, |a| read(&a.springs)[j])))
    };
    Some([of(|a| &a.stiffness), of(|a| &a.damping)])
}

fn pack_wave<'a>(wave: impl Fn(usize) -> &'a Wave<f64>) -> Wave<Wide> {
    Wave {
        amplitude: pack_plane(|i| wave(i).amplitude),
        frequency: pack(|i| wave(i).frequency),
        phase: pack(|i| wave(i).phase),
    }
}

fn pack_setup<'a, const N: usize>(lane: impl Fn(usize) -> &'a Prepared<'a, N>) -> Setup<Wide, N> {
    let setup = |i: usize| &lane(i).setup;
    Setup {
        segments: core::array::from_fn(|s| Segment {
            length: pack(|i| setup(i).segments[s].length),
            mass: pack(|i| setup(i).segments[s].mass),
            com: pack_plane(|i| setup(i).segments[s].com),
            inertia: pack(|i| setup(i).segments[s].inertia),
        }),
        rotor: core::array::from_fn(|s| pack(|i| setup(i).rotor[s])),
        base: pack_plane(|i| setup(i).base),
        gravity: pack_plane(|i| setup(i).gravity),
        contact: Contact {
            stiffness: pack_plane(|i| setup(i).contact.stiffness),
            damping: pack_plane(|i| setup(i).contact.damping),
            play: pack_plane(|i| setup(i).contact.play),
        },
        placement: pack_plane(|i| setup(i).placement),
        base_motion: pack_plane(|i| setup(i).base_motion),
        base_rest: pack(|i| setup(i).base_rest),
        heave: pack_wave(|i| &setup(i).heave),
        displaced: Displaced {
            ripple: pack_wave(|i| &setup(i).displaced.ripple),
            slip: pack_plane(|i| setup(i).displaced.slip),
            slip_start: pack(|i| setup(i).displaced.slip_start),
        },
        force_delay: pack(|i| setup(i).force_delay),
    }
}
