//! Internal states of effects (stretch of a Maxwell element, broken structure), integrated along a given motion.
//!
//! A simulation integrates them with the motion, by its own method. Everything that follows a motion measured or simulated before
//! comes here: regression, gap analysis, online estimation, torques along a movement.
//!
//! One step of an exponential method (Hochbruck, Ostermann 2010, section 2.3): with the motion at the middle of the interval h and
//! the rate `f(s)` there, `s(t + h) = s + h φ(hλ) f(s)`, `φ(z) = (eᶻ − 1)/z`, `λ = (f(s + δ) − f(s))/δ`. It is of second order,
//! exact for rates that are linear in the state while the motion stays as it is, and stable however fast the state settles.
//! Where an effect has several states, `λ` is the matrix of their slopes, and `φ` the rational function that makes this a step of the
//! Radau IIA method of order 5 (Hairer, Wanner 1996, section IV.5) for the linearised law.

use core::array::from_fn;

use super::{Effect, Local, MAX_STATES, Motion, States};
use crate::Scalar;

/// Fastest growth of a state in one interval, as an exponent: laws that settle have none.
const FASTEST_GROWTH: f64 = 1.0;
/// Exponent below which nothing is left of a state.
const FASTEST_DECAY: f64 = -60.0;
/// Least change of a state over which the slope of its rate is taken, far above rounding in either precision.
const LEAST_CHANGE: f64 = 1e-3;

impl<T: Scalar> Effect<T> {
    /// The effect's own states one `interval` \[s\] later, the motion of its joint going straight from one view to the other.
    pub fn next_states(
        &self,
        (from, to): (&Local<T>, &Local<T>),
        states: States<T>,
        interval: T,
    ) -> States<T> {
        let middle = middle(from, to);
        let rate = |memory: States<T>| self.memory_rate(&Local { memory, ..middle });
        let now = rate(states);
        // What the rates change by with one state.
        let slope = |k: usize| {
            let change = (now[k] * interval).abs() + T::of(LEAST_CHANGE);
            let mut moved = states;
            moved[k] += change;
            let there = rate(moved);
            from_fn(|i| (there[i] - now[i]) / change)
        };
        let count = self.kind.info().states;
        let mut columns = [[T::ZERO; MAX_STATES]; MAX_STATES];
        for (k, column) in columns.iter_mut().enumerate().take(count) {
            *column = slope(k);
        }
        if count == 1 {
            let mut next = states;
            next[0] += interval * growth(columns[0][0] * interval) * now[0];
            return next;
        }
        let step = growth_of_several(&columns, interval, &now.map(|v| v * interval));
        from_fn(|i| states[i] + step[i])
    }
}

/// `φ(hΛ) v` with `φ(z) = (1 − z/10 + z²/60) / (1 − 3z/5 + 3z²/20 − z³/60)`, for slopes `Λ` in columns.
fn growth_of_several<T: Scalar>(columns: &[States<T>; 3], h: T, v: &States<T>) -> States<T> {
    let right = polynomial(columns, h, v, &[1.0, -0.1, 1.0 / 60.0, 0.0]);
    let left: [States<T>; 3] = from_fn(|k| {
        let unit = from_fn(|i| if i == k { T::ONE } else { T::ZERO });
        polynomial(columns, h, &unit, &[1.0, -0.6, 0.15, -1.0 / 60.0])
    });
    // By Cramer's rule: of states that settle, no eigenvalue of the left side is below one.
    let [x, y, z] = &left;
    let whole = determinant([x, y, z]);
    [
        determinant([&right, y, z]) / whole,
        determinant([x, &right, z]) / whole,
        determinant([x, y, &right]) / whole,
    ]
}

/// `(f₀ + f₁hΛ + f₂(hΛ)² + f₃(hΛ)³) w`.
#[cfg_attr(target_os = "none", inline(never))]
fn polynomial<T: Scalar>(
    columns: &[States<T>; 3],
    h: T,
    w: &States<T>,
    factors: &[f64; 4],
) -> States<T> {
    let (mut power, mut sum) = (*w, [T::ZERO; 3]);
    for (k, &factor) in factors.iter().enumerate() {
        if k > 0 {
            let w = power;
            power = from_fn(|i| {
                h * (columns[0][i] * w[0] + columns[1][i] * w[1] + columns[2][i] * w[2])
            });
        }
        for i in 0..3 {
            sum[i] += T::of(factor) * power[i];
        }
    }
    sum
}

#[cfg_attr(target_os = "none", inline(never))]
fn determinant<T: Scalar>([a, b, c]: [&States<T>; 3]) -> T {
    let minor = |i: usize, j: usize| b[i] * c[j] - b[j] * c[i];
    a[0] * minor(1, 2) + a[1] * minor(2, 0) + a[2] * minor(0, 1)
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
        activity: mean(a.activity, b.activity),
        memory: [T::ZERO; MAX_STATES],
    }
}

/// Whether some effect depends on states of its own.
pub fn any_state<T: Scalar>(effects: &[Effect<T>]) -> bool {
    effects.iter().any(Effect::remembers)
}

/// Carries the states of effects from one instant of a motion to another, `interval` \[s\] later.
///
/// * `states` - those of each effect, in the same order; those of effects without a state stay as they are
///
/// ```
/// use arm_core::Joints;
/// use arm_core::effect::{Effect, Kind, Motion, advance_states};
/// // A Maxwell element with 0.5 s, stretched at 1 rad/s for a long time: e = q̇ · time.
/// let spring = Effect::new(Kind::named("relaxation")?, 0).with(&[3.0, 0.5]);
/// let moving = Motion::new(0.0, Joints::<f64, 1>::zeros(), Joints::<f64, 1>::repeat(1.0));
/// let mut states = [[0.0; 3]];
/// advance_states(&[spring], (&moving, &moving), &mut states, 20.0);
/// assert!((states[0][0] - 0.5).abs() < 1e-12);
/// # Ok::<(), arm_core::Invalid>(())
/// ```
pub fn advance_states<T: Scalar, const N: usize>(
    effects: &[Effect<T>],
    (from, to): (&Motion<T, N>, &Motion<T, N>),
    states: &mut [States<T>],
    interval: T,
) {
    for (effect, own) in effects.iter().zip(states) {
        if effect.remembers() {
            let none = [T::ZERO; MAX_STATES];
            let (a, b) = (from.local(effect.index, none), to.local(effect.index, none));
            *own = effect.next_states((&a, &b), *own, interval);
        }
    }
}
