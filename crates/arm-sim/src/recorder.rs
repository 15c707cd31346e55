//! Fills a recording from states, for every engine in the same way.

use arm_core::effect::Motion;
use arm_core::{Joints, Plane, Pose, Scalar, contributions};

use crate::model::{Input, Link, Model, Outcome, State, difference};
use crate::prepare::Prepared;
use crate::widest::{Computation, widest};
use crate::{JointMotion, Recording};

/// Forces of a state, by whatever engine.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Forces<T, const N: usize> {
    pub qdd: Joints<T, N>,
    pub force_on_arm: Plane<T>,
    /// Force through each joint, for the effects that depend on it \[N\].
    pub joint_force: [T; N],
}

/// A run at one instant, or several runs in lanes.
pub(crate) struct Instant<'a, T, const N: usize> {
    pub model: &'a Model<T, N>,
    pub input: &'a Input<T, N>,
    pub state: &'a State<T, N>,
    /// States of the effects.
    pub memory: &'a [T],
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
        }
    }
}

/// Everything that is recorded of an instant, in the order of [`columns`]. Its room is taken once.
pub(crate) struct Row<T>(Vec<T>);

impl<T: Scalar> Row<T> {
    pub fn new() -> Self {
        Self(Vec::new())
    }

    /// An instant of the native engine: forces follow from the model.
    pub fn fill<const N: usize>(&mut self, instant: &Instant<T, N>) {
        widest(Native { row: self, instant });
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
        let mut motion = Motion::new(input.time, *q, *qd);
        motion.joint_force = forces.joint_force;
        let resisting = model.resisting(&motion, memory);
        let load = model.load(
            &pose,
            &difference(&input.torque, &resisting),
            forces.force_on_arm,
        );
        let parts = contributions(&model.chain, &pose, (qd, &forces.qdd), &load);
        let frame = match &model.base {
            Some(base) => base.torque(&model.chain, &pose, (qd, &forces.qdd), forces.force_on_arm),
            None => Joints::<T, N>::repeat(T::ZERO),
        };
        let handle = input.handle.position;

        let row = &mut self.0;
        row.clear();
        row.push(input.time);
        for joints in [q, qd, &forces.qdd] {
            row.extend(joints.iter());
        }
        row.extend(model.tip(q, &pose));
        if has_handle(model) {
            row.extend(handle);
        }
        row.extend(forces.force_on_arm);
        row.push(T::ZERO);
        let effects = model.effects.iter().zip(*memory);
        row.extend(effects.map(|(e, &memory)| e.torque(&motion.local(e.index, memory))));
        row.extend(memory.iter());
        for torque in [
            &parts.inertial,
            &parts.centrifugal,
            &parts.coriolis,
            &parts.gravity,
            &frame,
            &resisting,
            &input.torque,
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

/// The columns that grow with every instant, and how many numbers of it each takes.
fn columns<const N: usize>(
    recording: &mut Recording<N>,
    handle: bool,
) -> [(&mut Vec<f64>, usize); 25] {
    let effects = recording.effects.len();
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
        (&mut recording.memory, effects),
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

/// Writes instants into columns whose room was taken before the run.
pub(crate) struct Recorder<const N: usize> {
    recording: Recording<N>,
    handle: bool,
}

impl<const N: usize> Recorder<N> {
    pub fn new(prepared: &Prepared<N>) -> Self {
        let model = &prepared.model;
        let flat = |part: fn(&JointMotion<2>) -> Joints<f64, 2>| {
            let parts = prepared.robot.iter().map(part);
            parts.flat_map(|v| [v[0], v[1]]).collect()
        };
        let mut recording = Recording {
            robot_q: flat(|m| m.q),
            robot_qd: flat(|m| m.qd),
            robot_qdd: flat(|m| m.qdd),
            effects: model.effects.iter().map(|e| (e.kind, e.index)).collect(),
            ..Recording::default()
        };
        let handle = has_handle(model);
        for (column, width) in columns(&mut recording, handle) {
            column.reserve_exact(prepared.schedule.samples() * width);
        }
        Self { recording, handle }
    }

    /// Appends an instant, of which `of` reads the numbers of this run.
    pub fn push<T>(&mut self, row: &Row<T>, of: impl Fn(&T) -> f64) {
        let mut rest = row.0.as_slice();
        for (column, width) in columns(&mut self.recording, self.handle) {
            let (mine, others) = rest.split_at(width);
            column.extend(mine.iter().map(&of));
            rest = others;
        }
    }

    /// The recording, with the robot's columns as long as the others.
    pub fn finish(mut self) -> Recording<N> {
        let r = &mut self.recording;
        let kept = 2 * r.time.len();
        for column in [&mut r.robot_q, &mut r.robot_qd, &mut r.robot_qdd] {
            column.truncate(kept);
        }
        self.recording
    }
}
