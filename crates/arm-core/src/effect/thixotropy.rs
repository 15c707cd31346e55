use super::law::{
    Info, Law, Local, Parameter, Parameters, Place, SMOOTHING, States, leading, smooth_sign,
    smooth_sign_slope,
};
use super::prior::{Family, Part, Prior, Values};
use crate::Scalar;

/// Friction and stiffness of a structure that breaks down in motion and builds up again at rest.
///
/// Its state b is the broken part, zero at the start: a trial begins after a long rest.
pub struct Thixotropy;

impl Law for Thixotropy {
    const INFO: Info = Info {
        kind: "thixotropy",
        place: Place::Joint,
        summary: "friction and stiffness that build up at rest and break down in motion",
        formula: "R = (1 − b)(friction · tanh(q̇/smoothing) + stiffness · (q − rest)), ḃ = (1 − b)|q̇|/breakdown − b/recovery",
        reference: "Lakie, Walsh, Wright 1984 for the wrist; kinetics of structure as reviewed by Barnes 1997",
        parameters: &[
            Parameter::linear("friction", "N m", 0.0, 100.0, 0.0),
            Parameter::linear("stiffness", "N m/rad", 0.0, 1000.0, 0.0),
            Parameter::shape("rest", "rad", -7.0, 7.0, 0.0),
            Parameter::shape("breakdown", "rad", 0.001, 10.0, 0.1),
            Parameter::shape("recovery", "s", 0.01, 1000.0, 3.0),
            SMOOTHING,
        ],
        states: 1,
    };
    const SMOOTHED_BY: Option<usize> = Some(5);
    const PRIOR: Prior = Prior::lasting(&[Part::of(&[0])
        .shaped(&[
            (3, Values::Each(&[0.03, 0.1, 0.3])),
            (4, Values::Each(&[1.0, 3.0, 10.0])),
        ])
        .varying(&[3, 4])])
    .with_law_error(0.05)
    .in_family(Family::Dry)
    .typically(0.1);

    #[inline]
    fn torque<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> T {
        let intact = T::ONE - at.memory[0];
        intact * (p[0] * smooth_sign(at.qd, p[5]) + p[1] * (at.q - p[2]))
    }

    #[inline]
    fn dry<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> T {
        (T::ONE - at.memory[0]) * p[0]
    }

    #[inline]
    fn besides_dry<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> T {
        (T::ONE - at.memory[0]) * p[1] * (at.q - p[2])
    }

    fn gradient<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> Parameters<T> {
        let intact = T::ONE - at.memory[0];
        let sign = smooth_sign(at.qd, p[5]);
        leading([
            intact * sign,
            intact * (at.q - p[2]),
            -intact * p[1],
            T::ZERO,
            T::ZERO,
            intact * p[0] * smooth_sign_slope(sign, at.qd, p[5]),
        ])
    }

    #[inline]
    fn memory_rate<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> States<T> {
        let intact = T::ONE - at.memory[0];
        leading([intact * at.qd.abs() / p[3] - at.memory[0] / p[4]])
    }
}
