use super::law::{Info, Law, Local, Parameter, Parameters, Place, States, leading};
use super::prior::{Family, Part, Prior, Values};
use crate::Scalar;

/// Resistance to stretch faster than a threshold, as in spasticity, after a latency.
///
/// The excess of speed is delayed by the Padé approximant of order (2, 3) of `exp(−s · latency)`, whose three states are zero at the
/// start, and all equal to the excess once that is constant. The first of them is the delayed excess \[rad/s\]; just after an onset it
/// swings a little below zero. A latency below 5 ms, shorter than that of any arm muscle, counts as none: the reflex acts at once.
///
/// Short of the tonic angle the threshold rises by `slope` for each radian: a muscle that is short needs a faster stretch, and one at
/// its tonic angle resists from `threshold` on. With a slope of zero, the threshold is the same everywhere. A reflex that is stronger in
/// one direction is two of them, one for each.
///
/// * `direction` - 1: motion with growing angle is resisted; −1: with falling angle; 0: both (rounded to the nearest of them)
pub struct StretchReflex;

impl Law for StretchReflex {
    const INFO: Info = Info {
        kind: "stretch_reflex",
        place: Place::Joint,
        summary: "resistance to motion faster than a threshold, after a latency",
        formula: "R(t + latency) = gain · max(0, ±q̇(t) − threshold − slope · max(0, ±(tonic − q(t)))), against the motion; the delay is its Padé approximant of order (2, 3)",
        reference: "Lance 1980; Powers, Campbell, Rymer 1989; threshold as in Levin, Feldman 1994; latency of 20 to 50 ms: Pruszynski, Scott 2012",
        parameters: &[
            Parameter::linear("gain", "N m s/rad", 0.0, 100.0, 0.0),
            Parameter::shape("threshold", "rad/s", 0.0, 20.0, 0.3),
            Parameter::shape("direction", "1", -1.0, 1.0, 1.0),
            Parameter::shape("latency", "s", 0.0, 0.2, 0.0),
            Parameter::shape("tonic", "rad", -7.0, 7.0, 0.0),
            Parameter::shape("slope", "1/s", 0.0, 100.0, 0.0),
        ],
        states: 3,
    };
    const PRIOR: Prior = Prior::lasting(&[Part::of(&[0])
        .shaped(&[
            (1, Values::Each(&[0.15, 0.3, 0.5])),
            (2, Values::Each(&[1.0, -1.0, 0.0])),
            (LATENCY, Values::Each(&[EXPECTED_LATENCY[0]])),
        ])
        .varying(&[1, LATENCY])
        .expecting(&[(LATENCY, EXPECTED_LATENCY)])])
    .with_law_error(0.1)
    .in_family(Family::Muscle)
    .typically(0.2);

    #[inline]
    fn torque<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> T {
        p[0] * if_late(p, at.memory[0], excess(p, at))
    }

    fn gradient<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> Parameters<T> {
        let [up, down] = excesses(p, at);
        let is = |excess: T| T::if_less(T::ZERO, excess, p[0], T::ZERO);
        let (rising, falling) = (is(up), is(down));
        let short = p[TONIC] - at.q;
        let (of_up, of_down) = (short.max(T::ZERO), (-short).max(T::ZERO));
        let moved = T::if_less(T::ZERO, short, rising, falling);
        let given = |now: T| if_late(p, T::ZERO, now);
        leading([
            if_late(p, at.memory[0], up - down),
            given(falling - rising),
            T::ZERO,
            T::ZERO,
            given(-(p[SLOPE] * moved)),
            given(falling * of_down - rising * of_up),
        ])
    }

    fn forgets<T: Scalar>(p: &Parameters<T>) -> bool {
        p[LATENCY].every(|latency| latency < SHORTEST)
    }

    #[inline]
    fn memory_rate<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> States<T> {
        // ŷ/û = (60 − 24 z + 3 z²) / (60 + 36 z + 9 z² + z³) with z = s · latency, in observer form.
        let [x, y, z] = at.memory;
        let (u, n) = (excess(p, at), T::of);
        let quick = if_late(p, T::ONE / p[LATENCY], T::ZERO);
        [
            quick * (n(3.0) * u - n(9.0) * x + n(6.0) * y),
            quick * (n(10.0) * z - n(6.0) * x - n(4.0) * u),
            quick * (u - x),
        ]
    }
}

/// Position of the latency among the parameters.
const LATENCY: usize = 3;
/// Position of the tonic angle among the parameters.
const TONIC: usize = 4;
/// Position of the slope of the threshold among the parameters.
const SLOPE: usize = 5;
/// Shortest latency that is one \[s\]: the states of a shorter one would be too quick for the steps of a simulation.
const SHORTEST: f64 = 0.005;
/// What a search expects of it and the standard deviation of that \[s\]: short- and medium-latency responses of arm muscles start 20 to
/// 50 ms after the stretch, and force follows within some 10 ms.
const EXPECTED_LATENCY: [f64; 2] = [0.04, 0.02];

/// One of two values, for a reflex with a latency and without.
#[inline]
fn if_late<T: Scalar>(p: &Parameters<T>, late: T, at_once: T) -> T {
    T::if_less(p[LATENCY], T::of(SHORTEST), at_once, late)
}

/// Speed above the threshold, signed.
#[inline]
fn excess<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> T {
    let [up, down] = excesses(p, at);
    up - down
}

/// Speed above the threshold with growing and with falling angle, zero where the direction is not resisted.
#[inline]
fn excesses<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> [T; 2] {
    let (half, short) = (T::of(0.5), p[TONIC] - at.q);
    let excess = |speed: T, short: T| (speed - p[1] - p[SLOPE] * short.max(T::ZERO)).max(T::ZERO);
    [
        T::if_less(p[2], -half, T::ZERO, excess(at.qd, short)),
        T::if_less(half, p[2], T::ZERO, excess(-at.qd, -short)),
    ]
}
