use super::law::{Info, Law, Local, Parameter, Parameters, Place, leading};
use super::prior::{Part, Prior, Values};
use crate::Scalar;

/// A spring that is soft about its rest angle and stiffens with the third power of the deflection.
pub struct CubicElastic;

impl Law for CubicElastic {
    const INFO: Info = Info {
        kind: "cubic_elastic",
        place: Place::Joint,
        summary: "spring that stiffens with the third power of its deflection",
        formula: "R = stiffness · (q − rest)³",
        reference: "Duffing 1918",
        parameters: &[
            Parameter::linear("stiffness", "N m/rad³", -10.0, 1000.0, 0.0),
            Parameter::shape("rest", "rad", -7.0, 7.0, 0.0),
        ],
        states: 0,
    };
    const TITLE: Option<&'static str> = Some("cubic spring");
    const PRIOR: Prior =
        Prior::lasting(&[Part::of(&[0]).shaped(&[(1, Values::Across)]).varying(&[1])])
            .with_law_error(0.002)
            .typically(2.0);

    #[inline]
    fn torque<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> T {
        let stretch = at.q - p[1];
        p[0] * stretch * stretch.squared()
    }

    fn gradient<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> Parameters<T> {
        let stretch = at.q - p[1];
        let square = stretch.squared();
        leading([stretch * square, T::of(-3.0) * p[0] * square])
    }
}
