use super::law::{Info, Law, Local, Parameter, Parameters, Place, leading};
use super::prior::{Family, Prior};
use crate::Scalar;

/// Resistance with the square of the joint's speed, as of a body in air or water.
pub struct QuadraticDrag;

impl Law for QuadraticDrag {
    const INFO: Info = Info {
        kind: "quadratic_drag",
        place: Place::Joint,
        summary: "resistance with the square of joint speed",
        formula: "R = drag · q̇ |q̇|",
        reference: "Rayleigh 1876; drag of a bluff body",
        parameters: &[Parameter::linear("drag", "N m s²/rad²", 0.0, 100.0, 0.0)],
        states: 0,
    };
    const PRIOR: Prior = Prior::FIRST.in_family(Family::Rate).typically(0.2);

    #[inline]
    fn torque<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> T {
        p[0] * at.qd * at.qd.abs()
    }

    fn gradient<T: Scalar>(_p: &Parameters<T>, at: &Local<T>) -> Parameters<T> {
        leading([at.qd * at.qd.abs()])
    }
}
