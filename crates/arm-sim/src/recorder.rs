//! Fills a recording from states, for every engine in the same way.

use arm_core::effect::Motion;
use arm_core::{Joints, Load, Plane, Pose, contributions};

use crate::model::{Input, State};
use crate::prepare::Prepared;
use crate::{JointMotion, Recording};

/// Forces of a state that an engine has computed in its own way.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Forces<const N: usize> {
    pub qdd: Joints<f64, N>,
    pub force_on_arm: Plane<f64>,
    /// Force through each joint, for the effects that depend on it \[N\].
    pub joint_force: [f64; N],
}

/// Writes samples into columns whose room was taken before the run.
pub(crate) struct Recorder<'a, const N: usize> {
    prepared: &'a Prepared<'a, N>,
    recording: Recording<N>,
}

impl<'a, const N: usize> Recorder<'a, N> {
    pub fn new(prepared: &'a Prepared<'a, N>) -> Self {
        let samples = prepared.schedule.samples();
        let effects = prepared.model.effects.len();
        let room = |width: usize| Vec::with_capacity(samples * width);
        let handle = if prepared.has_handle() { 2 } else { 0 };
        let flat = |part: fn(&JointMotion<2>) -> Joints<f64, 2>| {
            let parts = prepared.robot.iter().map(part);
            parts.flat_map(|v| [v[0], v[1]]).collect()
        };
        let mut recording = Recording {
            time: room(1),
            q: room(N),
            qd: room(N),
            qdd: room(N),
            tip: room(2),
            handle: room(handle),
            robot_q: flat(|m| m.q),
            robot_qd: flat(|m| m.qd),
            robot_qdd: flat(|m| m.qdd),
            force_on_arm: room(2),
            moment_on_arm: room(1),
            effects: prepared
                .model
                .effects
                .iter()
                .map(|e| (e.kind, e.index))
                .collect(),
            resisting: room(effects),
            memory: room(effects),
            ..Recording::default()
        };
        let t = &mut recording.torque;
        for column in [
            &mut t.inertial,
            &mut t.centrifugal,
            &mut t.coriolis,
            &mut t.gravity,
            &mut t.frame,
            &mut t.resisting,
            &mut t.drive,
            &mut t.contact,
        ] {
            *column = room(N);
        }
        let (e, w) = (&mut recording.energy, &mut recording.work);
        for column in [
            &mut e.kinetic,
            &mut e.potential,
            &mut e.contact,
            &mut w.handle,
            &mut w.drive,
            &mut w.resisted,
            &mut w.damped,
        ] {
            *column = room(1);
        }
        Self {
            prepared,
            recording,
        }
    }

    /// A sample of the native engine: forces follow from the model.
    pub fn push(&mut self, input: &Input<f64, N>, state: &State<f64, N>, memory: &[f64]) {
        let outcome = (self.prepared.model).evaluate(input, &state.q, &state.qd, memory);
        let forces = Forces {
            qdd: outcome.qdd,
            force_on_arm: outcome.force_on_arm,
            joint_force: outcome.joint_force,
        };
        self.push_with(input, state, memory, &forces);
    }

    /// A sample with forces of another engine.
    pub fn push_with(
        &mut self,
        input: &Input<f64, N>,
        state: &State<f64, N>,
        memory: &[f64],
        forces: &Forces<N>,
    ) {
        let model = &self.prepared.model;
        let State { q, qd, work } = state;
        let pose = Pose::new(q);
        let mut motion = Motion::new(input.time, *q, *qd);
        motion.joint_force = forces.joint_force;

        let tip = model.tip(q, &pose);
        let handle = input.handle.position;
        let r = &mut self.recording;
        r.time.push(input.time);
        r.q.extend(q.iter());
        r.qd.extend(qd.iter());
        r.qdd.extend(forces.qdd.iter());
        r.tip.extend(tip);
        if self.prepared.has_handle() {
            r.handle.extend(handle);
        }
        r.force_on_arm.extend(forces.force_on_arm);
        r.moment_on_arm.push(0.0);
        for (effect, &memory) in model.effects.iter().zip(memory) {
            let torque = effect.torque(&motion.local(effect.index, memory));
            r.resisting.push(torque);
            r.memory.push(memory);
        }

        let resisting = model.resisting(&motion, memory);
        let load = Load {
            torque: input.torque - resisting,
            force_on_arm: forces.force_on_arm,
            moment_on_arm: 0.0,
        };
        let parts = contributions(&model.chain, &pose, (qd, &forces.qdd), &load);
        let frame = match &model.base {
            Some(base) => base.torque(&model.chain, &pose, (qd, &forces.qdd), forces.force_on_arm),
            None => Joints::zeros(),
        };
        let t = &mut r.torque;
        t.inertial.extend(parts.inertial.iter());
        t.centrifugal.extend(parts.centrifugal.iter());
        t.coriolis.extend(parts.coriolis.iter());
        t.gravity.extend(parts.gravity.iter());
        t.frame.extend(frame.iter());
        t.resisting.extend(resisting.iter());
        t.drive.extend(input.torque.iter());
        t.contact.extend(parts.contact.iter());

        let [kinetic, potential, contact] = model.energy(&pose, (q, qd), handle);
        let e = &mut r.energy;
        e.kinetic.push(kinetic);
        e.potential.push(potential);
        e.contact.push(contact);
        let columns = &mut r.work;
        columns.handle.push(work[0]);
        columns.drive.push(work[1]);
        columns.resisted.push(work[2]);
        columns.damped.push(work[3]);
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
