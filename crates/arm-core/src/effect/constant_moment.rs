use super::law::{Info, Law, Local, Parameter, Parameters, Place, leading};
use crate::Scalar;

/// A moment that does not depend on the motion: muscle tone, or the weight of a cable.
pub struct ConstantMoment;

impl Law for ConstantMoment {
    const INFO: Info = Info {
        kind: "constant_moment",
        place: Place::Joint,
        summary: "constant resisting moment, such as muscle tone",
        formula: "R = moment",
        reference: "Kodek 2004, section 3.5.1: passive moment taken as constant",
        parameters: &[Parameter::linear("moment", "N m", -100.0, 100.0, 0.0)],
        states: 0,
    };
    const RATE_INDEPENDENT: bool = true;

    #[inline]
    fn torque<T: Scalar>(p: &Parameters<T>, _at: &Local<T>) -> T {
        p[0]
    }

    fn affine<T: Scalar>(p: &Parameters<T>) -> Option<[T; 3]> {
        Some([p[0], T::ZERO, T::ZERO])
    }

    fn gradient<T: Scalar>(_p: &Parameters<T>, _at: &Local<T>) -> Parameters<T> {
        leading([T::ONE])
    }
}
