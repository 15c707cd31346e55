use super::law::{
    Info, Law, Local, Parameter, Parameters, Place, SMOOTHING, leading, smooth_sign,
    smooth_sign_slope,
};
use super::prior::{Family, Part, Prior, Values};
use crate::Scalar;

/// The excess of dry friction at low speed, which fades as the joint moves faster.
///
/// It comes on top of `coulomb`: together they are the friction curve of Stribeck, with `coulomb` as its plateau.
pub struct Stribeck;

impl Law for Stribeck {
    const INFO: Info = Info {
        kind: "stribeck",
        place: Place::Joint,
        summary: "excess of dry friction at low speed, on top of coulomb",
        formula: "R = torque · exp(−|q̇|/speed) · tanh(q̇/smoothing)",
        reference: "Bo, Pavelescu 1982; Armstrong-Hélouvry, Dupont, Canudas de Wit 1994",
        parameters: &[
            Parameter::linear("torque", "N m", 0.0, 100.0, 0.0),
            Parameter::shape("speed", "rad/s", 0.001, 10.0, 0.06),
            SMOOTHING,
        ],
        states: 0,
    };
    const TITLE: Option<&'static str> = Some("Stribeck friction");
    const SMOOTHED_BY: Option<usize> = Some(2);
    const PRIOR: Prior = Prior::lasting(&[Part::of(&[0])
        .shaped(&[(1, Values::Each(&[0.03, 0.06, 0.12]))])
        .varying(&[1, 2])])
    .with_law_error(0.05)
    .in_family(Family::Dry)
    .typically(0.1);

    #[inline]
    fn torque<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> T {
        p[0] * (-(at.qd.abs() / p[1])).exp() * smooth_sign(at.qd, p[2])
    }

    #[inline]
    fn dry<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> T {
        p[0] * (-(at.qd.abs() / p[1])).exp()
    }

    fn gradient<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> Parameters<T> {
        let fading = (-(at.qd.abs() / p[1])).exp();
        let sign = smooth_sign(at.qd, p[2]);
        leading([
            fading * sign,
            p[0] * fading * sign * at.qd.abs() / p[1].squared(),
            p[0] * fading * smooth_sign_slope(sign, at.qd, p[2]),
        ])
    }
}
