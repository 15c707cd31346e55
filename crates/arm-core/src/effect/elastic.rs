use super::law::{Info, Law, Local, Parameter, Parameters, Place, leading};
use super::prior::{Part, Prior, Values};
use crate::Scalar;

/// A linear spring about a rest angle.
pub struct Elastic;

impl Law for Elastic {
    const INFO: Info = Info {
        kind: "elastic",
        place: Place::Joint,
        summary: "linear spring about a rest angle",
        formula: "R = stiffness · (q − rest)",
        reference: "Kodek 2004, equation 3.13, with a rest angle",
        parameters: &[
            Parameter::linear("stiffness", "N m/rad", -10.0, 1000.0, 0.0),
            Parameter::shape("rest", "rad", -7.0, 7.0, 0.0),
        ],
        states: 0,
    };
    const TITLE: Option<&'static str> = Some("elastic spring");
    const PRIOR: Prior =
        Prior::lasting(&[Part::of(&[0]).shaped(&[(1, Values::Middle)]).resting(1)])
            .typically(1.0)
            .passive();

    #[inline]
    fn torque<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> T {
        p[0] * (at.q - p[1])
    }

    fn affine<T: Scalar>(p: &Parameters<T>) -> Option<[T; 3]> {
        Some([-(p[0] * p[1]), p[0], T::ZERO])
    }

    fn gradient<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> Parameters<T> {
        leading([at.q - p[1], -p[0]])
    }
}
