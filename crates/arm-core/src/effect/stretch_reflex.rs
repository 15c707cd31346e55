use super::law::{Info, Law, Local, Parameter, Parameters, Place, leading};
use super::probe::{Family, Probe, Question, Values};
use crate::Scalar;

/// Resistance to stretch faster than a threshold, as in spasticity.
///
/// * `direction` - 1: motion with growing angle is resisted; −1: with falling angle; 0: both (rounded to the nearest of them)
pub struct StretchReflex;

impl Law for StretchReflex {
    const INFO: Info = Info {
        kind: "stretch_reflex",
        place: Place::Joint,
        summary: "resistance to motion faster than a threshold",
        formula: "R = gain · max(0, ±q̇ − threshold), against the motion",
        reference: "Lance 1980; Powers, Campbell, Rymer 1989; threshold as in Levin, Feldman 1994",
        parameters: &[
            Parameter::linear("gain", "N m s/rad", 0.0, 100.0, 0.0),
            Parameter::shape("threshold", "rad/s", 0.0, 20.0, 0.3),
            Parameter::shape("direction", "1", -1.0, 1.0, 1.0),
        ],
        memory: false,
    };
    const PROBE: Probe = Probe::lasting(&[Question::of(&[0])
        .shaped(&[
            (1, Values::Each(&[0.15, 0.3, 0.5])),
            (2, Values::Each(&[1.0, -1.0, 0.0])),
        ])
        .refining(&[1])])
    .missing(0.1).in_family(Family::Muscle).typically(0.2);

    #[inline]
    fn torque<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> T {
        let [up, down] = excess(p, at);
        p[0] * (up - down)
    }

    fn gradient<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> Parameters<T> {
        let [up, down] = excess(p, at);
        let moving =
            T::if_less(T::ZERO, up, T::ONE, T::ZERO) - T::if_less(T::ZERO, down, T::ONE, T::ZERO);
        leading([up - down, -p[0] * moving])
    }
}

/// Speed above the threshold with growing and with falling angle, zero where the direction is not resisted.
#[inline]
fn excess<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> [T; 2] {
    let half = T::of(0.5);
    [
        T::if_less(p[2], -half, T::ZERO, (at.qd - p[1]).max(T::ZERO)),
        T::if_less(half, p[2], T::ZERO, (-at.qd - p[1]).max(T::ZERO)),
    ]
}
