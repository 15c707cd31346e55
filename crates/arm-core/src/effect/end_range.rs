use super::law::{Info, Law, Local, Parameter, Parameters, Place, leading};
use super::prior::{Part, Prior, Values};
use crate::Scalar;

/// The steep rise of passive moment towards both ends of the range of motion (double exponential).
///
/// At `upper` it resists with `upper_moment`, at `lower` with −`lower_moment`.
pub struct EndRange;

impl Law for EndRange {
    const INFO: Info = Info {
        kind: "end_range",
        place: Place::Joint,
        summary: "moment that rises steeply at both ends of the range of motion",
        formula: "R = upper_moment · exp(steepness (q − upper)) − lower_moment · exp(−steepness (q − lower))",
        reference: "Audu, Davy 1985; Riener, Edrich 1999",
        parameters: &[
            Parameter::linear("upper_moment", "N m", 0.0, 100.0, 0.0),
            Parameter::linear("lower_moment", "N m", 0.0, 100.0, 0.0),
            Parameter::shape("steepness", "1/rad", 0.1, 50.0, 8.0),
            Parameter::shape("upper", "rad", -7.0, 7.0, 2.0),
            Parameter::shape("lower", "rad", -7.0, 7.0, -2.0),
        ],
        states: 0,
    };
    const TITLE: Option<&'static str> = Some("end-range moment");
    const PRIOR: Prior = Prior::lasting(&[
        Part::of(&[0])
            .shaped(&[(2, Values::Each(&[5.0, 8.0, 12.0])), (3, Values::Highest)])
            .varying(&[2]),
        Part::of(&[1])
            .shaped(&[(2, Values::Each(&[5.0, 8.0, 12.0])), (4, Values::Lowest)])
            .varying(&[2]),
    ])
    .with_law_error(0.05);

    #[inline]
    fn torque<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> T {
        let [high, low] = rises(p, at.q);
        p[0] * high - p[1] * low
    }

    fn gradient<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> Parameters<T> {
        let [high, low] = rises(p, at.q);
        leading([
            high,
            -low,
            p[0] * high * (at.q - p[3]) + p[1] * low * (at.q - p[4]),
            -p[0] * high * p[2],
            -p[1] * low * p[2],
        ])
    }
}

/// The two exponentials, one at each limit, at an angle `x`.
// On a device once in the code.
#[cfg_attr(target_os = "none", inline(never))]
#[cfg_attr(not(target_os = "none"), inline)]
pub(super) fn rises<T: Scalar>(p: &Parameters<T>, x: T) -> [T; 2] {
    [(p[2] * (x - p[3])).exp(), (-(p[2] * (x - p[4]))).exp()]
}
