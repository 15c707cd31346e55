use super::law::{Info, Law, Local, Parameter, Parameters, Place, leading};
use super::prior::{Family, Part, Prior, Values};
use crate::Scalar;

/// Position of the ratio among the parameters.
const RATIO: usize = 1;
/// What a search assumes of it, and the standard deviation of that: a muscle pulls with about the same arm at both joints. With springs in
/// both joints no movement determines it: three stiffnesses of two joints follow from four numbers.
const EXPECTED_RATIO: [f64; 2] = [1.0, 0.3];

/// A spring over two adjacent joints, as of a muscle that crosses both; its joint is the distal one.
///
/// With the energy ½ · stiffness · (q + ratio · q_proximal − rest)² it resists in the joint before by `ratio` times the same
/// torque. The gradient is that of the distal torque.
pub struct Biarticular;

impl Law for Biarticular {
    const INFO: Info = Info {
        kind: "biarticular",
        place: Place::Joint,
        summary: "spring over two adjacent joints; its joint is the distal one",
        formula: "R = stiffness · (q + ratio · q_proximal − rest), R_proximal = ratio · R",
        reference: "Hogan 1985",
        parameters: &[
            Parameter::linear("stiffness", "N m/rad", 0.0, 1000.0, 0.0),
            Parameter::shape("ratio", "1", -5.0, 5.0, 1.0),
            Parameter::shape("rest", "rad", -14.0, 14.0, 0.0),
        ],
        states: 0,
    };
    const TITLE: Option<&'static str> = Some("biarticular spring");
    const PRIOR: Prior = Prior::lasting(&[Part::of(&[0])
        .shaped(&[(1, Values::Each(&[1.0, 0.5]))])
        .resting(2)
        .varying(&[1])
        .expecting(&[(RATIO, EXPECTED_RATIO)])])
    .in_family(Family::TwoJoints)
    .typically(1.0);
    const CROSSES: bool = true;

    #[inline]
    fn torque<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> T {
        p[0] * (at.q + p[1] * at.proximal_q - p[2])
    }

    fn gradient<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> Parameters<T> {
        leading([
            at.q + p[1] * at.proximal_q - p[2],
            p[0] * at.proximal_q,
            -p[0],
        ])
    }

    #[inline]
    fn proximal_share<T: Scalar>(p: &Parameters<T>) -> T {
        p[1]
    }
}
