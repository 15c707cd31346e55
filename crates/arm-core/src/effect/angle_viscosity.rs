use super::law::{Info, Law, Local, Parameter, Parameters, Place, leading};
use super::prior::{Family, Prior};
use crate::Scalar;

/// A viscosity that depends on the angle: it goes in a straight line from one value to another over a range of angles, and stays
/// constant beyond. It is never negative, so that it only takes energy.
pub struct AngleViscosity;

impl Law for AngleViscosity {
    const INFO: Info = Info {
        kind: "angle_viscosity",
        place: Place::Joint,
        summary: "viscosity that depends on the angle",
        formula: "R = (lower_viscosity · (1 − s) + upper_viscosity · s) · q̇, s = (q − lower)/range, limited to 0 to 1",
        reference: "a straight line between two values, which only takes energy",
        parameters: &[
            Parameter::linear("lower_viscosity", "N m s/rad", 0.0, 100.0, 0.0),
            Parameter::linear("upper_viscosity", "N m s/rad", 0.0, 100.0, 0.0),
            Parameter::shape("lower", "rad", -7.0, 7.0, 0.0),
            Parameter::shape("range", "rad", 0.01, 14.0, 2.0),
        ],
        states: 0,
    };
    const TITLE: Option<&'static str> = Some("angle-dependent viscosity");
    const PRIOR: Prior = Prior::NONE.in_family(Family::Rate);

    #[inline]
    fn torque<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> T {
        let s = share(p, at);
        (p[0] * (T::ONE - s) + p[1] * s) * at.qd
    }

    fn gradient<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> Parameters<T> {
        let s = share(p, at);
        let inside = T::if_less(T::ZERO, s, T::if_less(s, T::ONE, T::ONE, T::ZERO), T::ZERO);
        // What the torque changes by with s, and s with both angles.
        let slope = inside * (p[1] - p[0]) * at.qd / p[3];
        leading([(T::ONE - s) * at.qd, s * at.qd, -slope, -(slope * s)])
    }
}

/// Where the angle stands in the range, from 0 to 1.
#[inline]
fn share<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> T {
    ((at.q - p[2]) / p[3]).max(T::ZERO).min(T::ONE)
}
