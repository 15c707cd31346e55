use super::law::{Info, Law, Local, Parameter, Parameters, Place, States, leading};
use super::prior::{Part, Prior, Values};
use crate::Scalar;

/// A spring in series with a damper (Maxwell element): its torque fades when the joint rests.
///
/// Its state is the stretch of the spring \[rad\], zero at the start: a trial begins relaxed.
pub struct Relaxation;

impl Law for Relaxation {
    const INFO: Info = Info {
        kind: "relaxation",
        place: Place::Joint,
        summary: "spring whose torque fades at rest (Maxwell element)",
        formula: "R = stiffness · e, ė = q̇ − e/time, e(0) = 0",
        reference: "Maxwell 1867; Fung 1993 for living tissue",
        parameters: &[
            Parameter::linear("stiffness", "N m/rad", 0.0, 1000.0, 0.0),
            Parameter::shape("time", "s", 0.01, 1000.0, 1.0),
        ],
        states: 1,
    };
    const PRIOR: Prior = Prior::lasting(&[Part::of(&[0])
        .shaped(&[(1, Values::Each(&[0.3, 1.0, 3.0]))])
        .varying(&[1])])
    .with_law_error(0.002)
    .typically(1.0);

    #[inline]
    fn torque<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> T {
        p[0] * at.memory[0]
    }

    fn gradient<T: Scalar>(_p: &Parameters<T>, at: &Local<T>) -> Parameters<T> {
        leading([at.memory[0]])
    }

    #[inline]
    fn memory_rate<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> States<T> {
        leading([at.qd - at.memory[0] / p[1]])
    }
}
