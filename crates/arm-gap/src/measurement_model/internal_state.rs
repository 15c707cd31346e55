//! States of effects that have one, carried along a motion.

use arm_core::effect::{Effect, Local, Motion};

/// Steps in which a state is carried from one instant to the next.
const PARTS: usize = 2;

/// Whether some effect has a state of its own.
pub fn is_needed(effects: &[Effect<f64>]) -> bool {
    effects.iter().any(|effect| effect.kind.info().memory)
}

/// Carries the states of effects from one instant of a motion to another, `interval` later \[s\]: Heun's method along the
/// straight line between the two.
pub fn advance<const N: usize>(
    effects: &[Effect<f64>],
    (from, to): (&Motion<f64, N>, &Motion<f64, N>),
    memory: &mut [f64],
    interval: f64,
) {
    let h = interval / PARTS as f64;
    for (effect, state) in effects.iter().zip(memory) {
        if !effect.kind.info().memory {
            continue;
        }
        let (a, b) = (from.local(effect.index, 0.0), to.local(effect.index, 0.0));
        let rate = |part: usize, value: f64| {
            effect.memory_rate(&between(&a, &b, part as f64 / PARTS as f64, value))
        };
        for part in 0..PARTS {
            let slope = rate(part, *state);
            let ahead = rate(part + 1, *state + h * slope);
            *state += 0.5 * h * (slope + ahead);
        }
    }
}

/// What an effect sees between two instants.
fn between(a: &Local<f64>, b: &Local<f64>, share: f64, memory: f64) -> Local<f64> {
    let mix = |a: f64, b: f64| a + share * (b - a);
    Local {
        time: mix(a.time, b.time),
        q: mix(a.q, b.q),
        qd: mix(a.qd, b.qd),
        qdd: mix(a.qdd, b.qdd),
        proximal_q: mix(a.proximal_q, b.proximal_q),
        joint_force: mix(a.joint_force, b.joint_force),
        memory,
    }
}
