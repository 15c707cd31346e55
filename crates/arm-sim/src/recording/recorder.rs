//! The recorder, which fills a recording from states for every engine.

use core::ops::ControlFlow;

use arm_core::effect::States;
use arm_core::{Joints, Plane, Pose, Scalar, contributions};

use crate::closed_chain::model::{Link, Model};
use crate::closed_chain::state::{Input, Outcome, State, difference, sum};
use crate::free_memory::{require_memory, reserve_memory};
use crate::integrators::friction::{self, Friction};
use crate::preparation::prepared_run::Prepared;
use crate::recording::record::Piece;
use crate::recording::record::recorded_states;
use crate::{Columns, Recording, SimulationError};
use arm_core::simd_dispatch::{Computation, dispatch};

/// Forces of a state, by whatever engine.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Forces<T, const N: usize> {
    pub qdd: Joints<T, N>,
    pub force_on_arm: Plane<T>,
    /// Force through each joint, for the effects that depend on it \[N\].
    pub joint_force: [T; N],
    /// Dry friction, where there is any.
    pub friction: Option<Friction<T, N>>,
}

/// A run at one instant, or several runs in lanes.
pub(crate) struct Instant<'a, T, const N: usize> {
    pub model: &'a Model<T, N>,
    pub input: &'a Input<T, N>,
    pub state: &'a State<T, N>,
    /// States of the effects.
    pub memory: &'a [States<T>],
}

impl<T: Scalar, const N: usize> Instant<'_, T, N> {
    /// Forces as the model has them.
    #[inline(always)]
    fn forces(&self) -> Forces<T, N> {
        let State { q, qd, .. } = self.state;
        let Outcome {
            qdd,
            force_on_arm,
            joint_force,
            ..
        } = self.model.evaluate(self.input, q, qd, self.memory);
        Forces {
            qdd,
            force_on_arm,
            joint_force,
            friction: None,
        }
    }
}

/// Everything that is recorded of an instant, in the order of [`columns`]. Its memory is reserved once.
pub(crate) struct Row<T>(Vec<T>);

impl Row<f64> {
    /// An instant of the native engine, dry friction included.
    pub fn fill_solved<const N: usize>(&mut self, instant: &Instant<f64, N>, columns: Columns) {
        if !instant.model.has_dry || columns == Columns::Motion {
            return self.fill(instant, columns);
        }
        let State { q, qd, .. } = instant.state;
        let (outcome, friction) =
            friction::at(instant.model, instant.input, (q, qd), instant.memory);
        let forces = Forces {
            qdd: outcome.qdd,
            force_on_arm: outcome.force_on_arm,
            joint_force: outcome.joint_force,
            friction,
        };
        self.fill_with(instant, &forces);
    }
}

impl<T: Scalar> Row<T> {
    pub fn new() -> Self {
        Self(Vec::new())
    }

    /// An instant of the native engine without dry friction: forces follow from the model.
    pub fn fill<const N: usize>(&mut self, instant: &Instant<T, N>, columns: Columns) {
        match columns {
            Columns::All => dispatch(Native { row: self, instant }),
            Columns::Motion => self.start(instant),
        }
    }

    /// Time, angles and speeds of an instant, and nothing more yet.
    #[inline(always)]
    fn start<const N: usize>(&mut self, instant: &Instant<T, N>) {
        let row = &mut self.0;
        row.clear();
        row.push(instant.input.time);
        for joints in [&instant.state.q, &instant.state.qd] {
            row.extend(joints.iter());
        }
    }

    /// An instant with forces of another engine.
    #[inline(always)]
    pub fn fill_with<const N: usize>(&mut self, instant: &Instant<T, N>, forces: &Forces<T, N>) {
        let Instant {
            model,
            input,
            state: State { q, qd, work },
            memory,
        } = instant;
        let pose = Pose::new(q);
        let mut motion = input.motion(q, qd);
        motion.joint_force = forces.joint_force;
        let mut resisting = model.resisting(&motion, memory);
        if let Some(friction) = &forces.friction {
            resisting = sum(&resisting, &friction.torque);
        }
        let driving = model.driving(input, &pose);
        let load = model.load(
            &pose,
            &difference(&driving, &resisting),
            forces.force_on_arm,
        );
        let parts = contributions(&model.chain, &pose, (qd, &forces.qdd), &load);
        let frame = match &model.base {
            Some(base) => base.torque(&model.chain, &pose, (qd, &forces.qdd), forces.force_on_arm),
            None => Joints::<T, N>::repeat(T::ZERO),
        };
        let handle = input.handle.position;
        let in_world = |at: Plane<T>| [0, 1].map(|axis| at[axis] + input.base.position[axis]);

        self.start(instant);
        let row = &mut self.0;
        row.extend(forces.qdd.iter());
        row.extend(in_world(model.tip(q, &pose)));
        if has_handle(model) {
            row.extend(in_world(handle));
        }
        row.extend(forces.force_on_arm);
        row.push(T::ZERO);
        let effects = model.effects.iter().zip(*memory);
        row.extend(effects.map(|(e, &memory)| {
            let local = motion.local(e.index, memory);
            match &forces.friction {
                Some(friction) if e.is_dry() => {
                    e.besides_dry(&local) + friction.share(e.index, e.dry(&local))
                }
                _ => e.torque(&local),
            }
        }));
        let effects = model.effects.iter().zip(*memory);
        row.extend(effects.flat_map(|(e, states)| &states[..recorded_states(e.kind)]));
        for torque in [
            &parts.inertial,
            &parts.centrifugal,
            &parts.coriolis,
            &parts.gravity,
            &frame,
            &resisting,
            &driving,
            &parts.contact,
        ] {
            row.extend(torque.iter());
        }
        row.extend(model.energy(&pose, (q, qd), handle));
        row.extend(work);
    }
}

struct Native<'a, 'b, T, const N: usize> {
    row: &'a mut Row<T>,
    instant: &'a Instant<'b, T, N>,
}

impl<T: Scalar, const N: usize> Computation for Native<'_, '_, T, N> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let forces = self.instant.forces();
        self.row.fill_with(self.instant, &forces);
    }
}

fn has_handle<T, const N: usize>(model: &Model<T, N>) -> bool {
    !matches!(model.link, Link::Free)
}

/// The columns that grow with every instant, and how many numbers of it each takes; the first three are those of
/// [`Columns::Motion`].
fn all_columns<const N: usize>(
    recording: &mut Recording<N>,
    handle: bool,
) -> [(&mut Vec<f64>, usize); 25] {
    let (effects, memories) = (recording.effects.len(), recording.memories());
    let Recording { torque, energy, .. } = recording;
    let work = &mut recording.work;
    [
        (&mut recording.time, 1),
        (&mut recording.q, N),
        (&mut recording.qd, N),
        (&mut recording.qdd, N),
        (&mut recording.tip, 2),
        (&mut recording.handle, if handle { 2 } else { 0 }),
        (&mut recording.force_on_arm, 2),
        (&mut recording.moment_on_arm, 1),
        (&mut recording.resisting, effects),
        (&mut recording.memory, memories),
        (&mut torque.inertial, N),
        (&mut torque.centrifugal, N),
        (&mut torque.coriolis, N),
        (&mut torque.gravity, N),
        (&mut torque.frame, N),
        (&mut torque.resisting, N),
        (&mut torque.drive, N),
        (&mut torque.contact, N),
        (&mut energy.kinetic, 1),
        (&mut energy.potential, 1),
        (&mut energy.contact, 1),
        (&mut work.handle, 1),
        (&mut work.drive, 1),
        (&mut work.resisted, 1),
        (&mut work.damped, 1),
    ]
}

/// [`all_columns`] that an experiment records.
fn columns<'a, const N: usize>(
    recording: &'a mut Recording<N>,
    prepared: &Prepared<N>,
) -> impl Iterator<Item = (&'a mut Vec<f64>, usize)> + use<'a, N> {
    let recorded = match prepared.experiment.columns {
        Columns::All => usize::MAX,
        Columns::Motion => 3,
    };
    let all = all_columns(recording, has_handle(&prepared.model));
    all.into_iter().take(recorded)
}

/// Takes a run apart, see [`simulate_in_pieces`](crate::simulate_in_pieces).
pub(crate) struct Pieces<'a, const N: usize> {
    /// Samples in each but the last.
    pub samples: usize,
    pub take: &'a mut dyn FnMut(&Piece<'_, N>) -> ControlFlow<()>,
}

/// Writes instants into columns whose memory was reserved before the run.
pub(crate) struct Recorder<'a, 't, const N: usize> {
    prepared: &'a Prepared<'a, N>,
    recording: Recording<N>,
    pieces: Option<Pieces<'t, N>>,
    /// Samples that were taken away.
    from: usize,
    /// [`Recording::balance`] of the first sample.
    balance: f64,
}

impl<'a, 't, const N: usize> Recorder<'a, 't, N> {
    /// For the whole run.
    pub fn new(prepared: &'a Prepared<'a, N>) -> Result<Self, SimulationError> {
        Self::with(prepared, None)
    }

    /// For the whole run, or for a piece after another.
    pub fn with(
        prepared: &'a Prepared<'a, N>,
        pieces: Option<Pieces<'t, N>>,
    ) -> Result<Self, SimulationError> {
        let model = &prepared.model;
        let most = pieces.as_ref().map_or(usize::MAX, |p| p.samples);
        let capacity = prepared.schedule.samples().min(most);
        let mut recording = Recording {
            effects: model.effects.iter().map(|e| (e.kind, e.index)).collect(),
            ..Recording::default()
        };
        let robot = if prepared.records_robot() { 2 } else { 0 };
        let widths = columns(&mut recording, prepared).map(|(_, width)| width);
        let numbers = widths.sum::<usize>() + 3 * robot;
        require_memory((size_of::<f64>() * numbers * capacity) as u64)?;
        let r = &mut recording;
        for column in [&mut r.robot_q, &mut r.robot_qd, &mut r.robot_qdd] {
            reserve_memory(column, robot * capacity)?;
        }
        for (column, width) in columns(r, prepared) {
            reserve_memory(column, width * capacity)?;
        }
        Ok(Self {
            prepared,
            recording,
            pieces,
            from: 0,
            balance: 0.0,
        })
    }

    /// Appends an instant, of which `of` reads the numbers of this run. Breaks where no more is needed.
    pub fn push<T>(&mut self, row: &Row<T>, of: impl Fn(&T) -> f64) -> ControlFlow<()> {
        let mut rest = row.0.as_slice();
        for (column, width) in columns(&mut self.recording, self.prepared) {
            let (mine, others) = rest.split_at(width);
            column.extend(mine.iter().map(&of));
            rest = others;
        }
        match &self.pieces {
            Some(pieces) if self.recording.len() == pieces.samples => self.hand_over(),
            _ => ControlFlow::Continue(()),
        }
    }

    /// Gives what was recorded away, and keeps the memory.
    fn hand_over(&mut self) -> ControlFlow<()> {
        self.add_robot();
        let Some(Pieces { take, .. }) = &mut self.pieces else {
            return ControlFlow::Continue(());
        };
        if self.from == 0 {
            self.balance = self.recording.first_balance();
        }
        let piece = Piece {
            recording: &self.recording,
            from: self.from,
            balance: self.balance,
        };
        let wanted = take(&piece);
        self.from += self.recording.len();
        for (column, _) in columns(&mut self.recording, self.prepared) {
            column.clear();
        }
        let r = &mut self.recording;
        for column in [&mut r.robot_q, &mut r.robot_qd, &mut r.robot_qdd] {
            column.clear();
        }
        wanted
    }

    /// Makes the robot's columns as long as the others.
    fn add_robot(&mut self) {
        let r = &mut self.recording;
        if !self.prepared.records_robot() {
            return;
        }
        for motion in self
            .prepared
            .robot_motion(self.from..self.from + r.time.len())
        {
            r.robot_q.extend(motion.q.iter());
            r.robot_qd.extend(motion.qd.iter());
            r.robot_qdd.extend(motion.qdd.iter());
        }
    }

    /// The recording; in pieces, what is left of it is given away.
    pub fn finish(mut self) -> Recording<N> {
        if self.pieces.is_none() {
            self.add_robot();
        } else if !self.recording.is_empty() {
            // The run is over: there is nothing to break off.
            let _ = self.hand_over();
        }
        self.recording
    }
}
