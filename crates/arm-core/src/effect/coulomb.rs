use super::law::{
    Info, Law, Local, Parameter, Parameters, Place, SMOOTHING, leading, smooth_sign,
    smooth_sign_slope,
};
use super::prior::{Family, Part, Prior};
use crate::Scalar;

/// Dry friction: a torque against the direction of motion, whatever the speed.
pub struct Coulomb;

impl Law for Coulomb {
    const INFO: Info = Info {
        kind: "coulomb",
        place: Place::Joint,
        summary: "dry friction, independent of speed",
        formula: "R = torque · tanh(q̇/smoothing)",
        reference: "Kodek 2004, equation 3.12; smoothed as in Andersson, Söderberg, Björklund 2007",
        parameters: &[
            Parameter::linear("torque", "N m", 0.0, 100.0, 0.0),
            SMOOTHING,
        ],
        states: 0,
    };
    const TITLE: Option<&'static str> = Some("Coulomb friction");
    const SMOOTHED_BY: Option<usize> = Some(1);
    const RATE_INDEPENDENT: bool = true;
    const PRIOR: Prior = Prior::lasting(&[Part::of(&[0]).varying(&[1])])
        .with_law_error(0.03)
        .in_family(Family::Dry)
        .typically(0.1)
        .passive();

    #[inline]
    fn torque<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> T {
        p[0] * smooth_sign(at.qd, p[1])
    }

    #[inline]
    fn dry<T: Scalar>(p: &Parameters<T>, _at: &Local<T>) -> T {
        p[0]
    }

    fn gradient<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> Parameters<T> {
        let sign = smooth_sign(at.qd, p[1]);
        leading([sign, p[0] * smooth_sign_slope(sign, at.qd, p[1])])
    }
}
