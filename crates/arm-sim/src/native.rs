//! The native engine: minimal coordinates, one run at a time.

use crate::breaks::step_in_pieces;
use crate::feed::Feed;
use crate::model::State;
use crate::prepare::Prepared;
use crate::recorder::Recorder;
use crate::step::{Memory, step};
use crate::{Experiment, Partial, SimulationError};

/// Runs an experiment; the loop does not allocate.
pub(crate) fn run<const N: usize>(
    experiment: &Experiment<N>,
) -> Result<Partial<N>, SimulationError> {
    let prepared = Prepared::new(experiment)?;
    let schedule = prepared.schedule;
    let mut recorder = Recorder::new(&prepared);
    let mut memory = Memory::new(prepared.model.effects.len());
    let mut state = State {
        q: prepared.start.0,
        qd: prepared.start.1,
        work: [0.0; 4],
    };
    recorder.push(0, &state, &memory.state);
    let mut feed = Feed::new(prepared.integrator());
    let mut stopped = None;
    let mut broken = prepared.breaks.steps().peekable();
    let mut sampled = 0;
    for done in 1..=schedule.steps {
        let at = (&mut state, &mut memory);
        if broken.next_if_eq(&done).is_some() {
            while broken.next_if_eq(&done).is_some() {}
            step_in_pieces(&prepared, done, at);
        } else {
            let inputs = feed.step(done, |half_steps, out| prepared.inputs(half_steps, out));
            step(
                &prepared.model,
                prepared.integrator(),
                schedule.dt,
                inputs,
                at,
            );
        }
        if let Some(joint) = diverged(&state) {
            stopped = Some(SimulationError::Diverged {
                step: done,
                time: schedule.time(done),
                joint,
            });
            break;
        }
        if done == sampled + schedule.every {
            sampled = done;
            recorder.push(done, &state, &memory.state);
        }
    }
    Ok(Partial {
        recording: recorder.finish(),
        stopped,
    })
}

/// The first joint whose angle or speed is not finite.
#[inline]
pub(crate) fn diverged<const N: usize>(state: &State<f64, N>) -> Option<usize> {
    if state.is_finite() {
        return None;
    }
    (0..N).find(|&i| !(state.q[i].is_finite() && state.qd[i].is_finite()))
}
