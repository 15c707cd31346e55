use super::end_range::rises;
use super::law::{Info, Law, Local, Parameter, Parameters, Place, leading};
use super::prior::{Family, Prior};
use crate::Scalar;

/// The steep rise of passive moment towards both ends of a range of motion that depends on the joint before, as of a muscle or
/// ligament that crosses both; its joint is the distal one.
///
/// The exponentials are those of Riener and Edrich 1999, who put the adjacent angle into the exponent; the limits `upper` and
/// `lower` move by −`ratio` for each radian of the joint before, as the articular boundaries of Hatze 1997 do. With the energy
/// `upper_moment/steepness · exp(…) + lower_moment/steepness · exp(…)` it resists in the joint before by `ratio` times the same
/// torque. Two of them, each with one end, have steepnesses and ratios of their own.
pub struct BiarticularEndRange;

impl Law for BiarticularEndRange {
    const INFO: Info = Info {
        kind: "biarticular_end_range",
        place: Place::Joint,
        summary: "moment that rises steeply at ends of the range of motion that depend on the joint before; its joint is the distal one",
        formula: "R = upper_moment · exp(steepness (x − upper)) − lower_moment · exp(−steepness (x − lower)), x = q + ratio · q_proximal, R_proximal = ratio · R",
        reference: "Riener, Edrich 1999: steepness 1.7 to 11, ratio −0.7 to 1.3; Hatze 1997",
        parameters: &[
            Parameter::linear("upper_moment", "N m", 0.0, 100.0, 0.0),
            Parameter::linear("lower_moment", "N m", 0.0, 100.0, 0.0),
            Parameter::shape("steepness", "1/rad", 0.1, 50.0, 4.0),
            Parameter::shape("upper", "rad", -14.0, 14.0, 2.0),
            Parameter::shape("lower", "rad", -14.0, 14.0, -2.0),
            Parameter::shape("ratio", "1", -5.0, 5.0, 0.5),
        ],
        states: 0,
    };
    const TITLE: Option<&'static str> = Some("biarticular end-range moment");
    const PRIOR: Prior = Prior::NONE.in_family(Family::TwoJoints);
    const CROSSES: bool = true;

    #[inline]
    fn torque<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> T {
        let [high, low] = rises(p, angle(p, at));
        p[0] * high - p[1] * low
    }

    fn gradient<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> Parameters<T> {
        let x = angle(p, at);
        let [high, low] = rises(p, x);
        let slope = p[0] * high + p[1] * low;
        leading([
            high,
            -low,
            p[0] * high * (x - p[3]) + p[1] * low * (x - p[4]),
            -p[0] * high * p[2],
            -p[1] * low * p[2],
            slope * p[2] * at.proximal_q,
        ])
    }

    #[inline]
    fn proximal_share<T: Scalar>(p: &Parameters<T>) -> T {
        p[5]
    }
}

/// The angle of both joints on which it depends.
#[inline]
fn angle<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> T {
    at.q + p[5] * at.proximal_q
}
