//! The states that some effects carry (stretch of a Maxwell element, broken structure), integrated along a motion that is given.
//!
//! A simulation integrates them with the motion, by its own method. Everything that follows a motion measured or simulated before
//! comes here: regression, gap analysis, online estimation, torques along a movement.
//!
//! One step of an exponential method (Hochbruck, Ostermann 2010, section 2.3): with the motion at the middle of the interval h and
//! the rate `f(s)` there, `s(t + h) = s + h φ(hλ) f(s)`, `φ(z) = (eᶻ − 1)/z`, `λ = (f(s + δ) − f(s))/δ`. It is of second order,
//! exact for rates that are linear in the state while the motion stays as it is, and stable however fast the state settles.

use super::{Effect, Local, Motion};
use crate::Scalar;

/// Fastest growth of a state in one interval, as an exponent: laws that settle have none.
const FASTEST_GROWTH: f64 = 1.0;
/// Exponent below which nothing is left of a state.
const FASTEST_DECAY: f64 = -60.0;
/// Least change of a state over which the slope of its rate is taken, far above rounding in either precision.
const LEAST_CHANGE: f64 = 1e-3;

impl<T: Scalar> Effect<T> {
    /// The effect's own state one `interval` \[s\] later, the motion of its joint going straight from one view to the other.
    pub fn next_state(&self, (from, to): (&Local<T>, &Local<T>), state: T, interval: T) -> T {
        let middle = middle(from, to);
        let rate = |memory: T| self.memory_rate(&Local { memory, ..middle });
        let now = rate(state);
        let change = (now * interval).abs() + T::of(LEAST_CHANGE);
        let slope = (rate(state + change) - now) / change;
        state + interval * growth(slope * interval) * now
    }
}

/// `(eᶻ − 1)/z`; growth is limited as above.
fn growth<T: Scalar>(z: T) -> T {
    let z = z.min(T::of(FASTEST_GROWTH));
    let small = T::of(0.03);
    // The series is exact to rounding below, the quotient above.
    let series = [7.0, 6.0, 5.0, 4.0, 3.0, 2.0]
        .iter()
        .fold(T::ONE, |sum, &n| T::ONE + z / T::of(n) * sum);
    let exponential = z.max(T::of(FASTEST_DECAY)).exp();
    let divisor = T::if_less(z.abs(), small, T::ONE, z);
    T::if_less(z.abs(), small, series, (exponential - T::ONE) / divisor)
}

fn middle<T: Scalar>(a: &Local<T>, b: &Local<T>) -> Local<T> {
    let mean = |a: T, b: T| T::of(0.5) * (a + b);
    Local {
        time: mean(a.time, b.time),
        q: mean(a.q, b.q),
        qd: mean(a.qd, b.qd),
        qdd: mean(a.qdd, b.qdd),
        proximal_q: mean(a.proximal_q, b.proximal_q),
        joint_force: mean(a.joint_force, b.joint_force),
        memory: T::ZERO,
    }
}

/// Whether some effect has a state of its own.
pub fn any_state<T>(effects: &[Effect<T>]) -> bool {
    effects.iter().any(|effect| effect.kind.info().memory)
}

/// Carries the states of effects from one instant of a motion to another, `interval` \[s\] later.
///
/// * `states` - one for each effect, in the same order; those of effects without a state stay as they are
///
/// ```
/// use arm_core::Joints;
/// use arm_core::effect::{Effect, Kind, Motion, advance_states};
/// // A Maxwell element with 0.5 s, stretched at 1 rad/s for a long time: e = q̇ · time.
/// let spring = Effect::new(Kind::named("relaxation")?, 0).with(&[3.0, 0.5]);
/// let moving = Motion::new(0.0, Joints::<f64, 1>::zeros(), Joints::<f64, 1>::repeat(1.0));
/// let mut states = [0.0];
/// advance_states(&[spring], (&moving, &moving), &mut states, 20.0);
/// assert!((states[0] - 0.5).abs() < 1e-12);
/// # Ok::<(), arm_core::Invalid>(())
/// ```
pub fn advance_states<T: Scalar, const N: usize>(
    effects: &[Effect<T>],
    (from, to): (&Motion<T, N>, &Motion<T, N>),
    states: &mut [T],
    interval: T,
) {
    for (effect, state) in effects.iter().zip(states) {
        if effect.kind.info().memory {
            let (a, b) = (
                from.local(effect.index, T::ZERO),
                to.local(effect.index, T::ZERO),
            );
            *state = effect.next_state((&a, &b), *state, interval);
        }
    }
}
