use super::law::{Info, Law, Local, MAX_PARAMETERS, Parameter, Parameters, Place};
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
            Parameter { name: "stiffness", unit: "N m/rad", min: -10.0, max: 1000.0, default: 0.0, linear: true },
            Parameter { name: "rest", unit: "rad", min: -7.0, max: 7.0, default: 0.0, linear: false },
        ],
        memory: false,
    };

    #[inline]
    fn torque<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> T {
        p[0] * (at.q - p[1])
    }

    fn gradient<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> Parameters<T> {
        let mut g = [T::ZERO; MAX_PARAMETERS];
        g[0] = at.q - p[1];
        g[1] = -p[0];
        g
    }
}
