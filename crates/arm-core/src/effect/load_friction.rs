use super::law::{
    Info, Law, Local, Parameter, Parameters, Place, SMOOTHING, leading, smooth_sign,
    smooth_sign_slope,
};
use super::prior::{Family, Part, Prior};
use crate::Scalar;

/// Dry friction that grows with the force through the joint, as in a plain bearing.
///
/// The coefficient is that of friction times the radius on which it acts.
pub struct LoadFriction;

impl Law for LoadFriction {
    const INFO: Info = Info {
        kind: "load_friction",
        place: Place::Joint,
        summary: "dry friction that grows with the force through the joint",
        formula: "R = coefficient · |F_joint| · tanh(q̇/smoothing)",
        reference: "Coulomb friction of a plain bearing; Bittencourt, Axelsson 2014 for robot joints",
        parameters: &[
            Parameter::linear("coefficient", "m", 0.0, 1.0, 0.0),
            SMOOTHING,
        ],
        states: 0,
    };
    const FEELS_FORCE: bool = true;
    const SMOOTHED_BY: Option<usize> = Some(1);
    const PRIOR: Prior = Prior::lasting(&[Part::of(&[0]).varying(&[1])])
        .with_law_error(0.03)
        .in_family(Family::Dry);

    #[inline]
    fn torque<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> T {
        p[0] * at.joint_force * smooth_sign(at.qd, p[1])
    }

    #[inline]
    fn dry<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> T {
        p[0] * at.joint_force
    }

    fn gradient<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> Parameters<T> {
        let sign = smooth_sign(at.qd, p[1]);
        leading([
            at.joint_force * sign,
            p[0] * at.joint_force * smooth_sign_slope(sign, at.qd, p[1]),
        ])
    }
}
