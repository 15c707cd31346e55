use super::law::{Info, Law, Local, Parameter, Parameters, Place, leading};
use super::prior::{Family, Prior};
use crate::Scalar;

/// Resistance in proportion to the joint's speed.
pub struct Viscous;

impl Law for Viscous {
    const INFO: Info = Info {
        kind: "viscous",
        place: Place::Joint,
        summary: "resistance in proportion to joint speed",
        formula: "R = viscosity · q̇",
        reference: "Kodek 2004, equation 3.11",
        parameters: &[Parameter::linear("viscosity", "N m s/rad", 0.0, 100.0, 0.0)],
        states: 0,
    };
    const TITLE: Option<&'static str> = Some("viscous damping");
    const PRIOR: Prior = Prior::FIRST
        .in_family(Family::Rate)
        .typically(0.2)
        .passive();

    #[inline]
    fn torque<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> T {
        p[0] * at.qd
    }

    fn affine<T: Scalar>(p: &Parameters<T>) -> Option<[T; 3]> {
        Some([T::ZERO, T::ZERO, p[0]])
    }

    fn gradient<T: Scalar>(_p: &Parameters<T>, at: &Local<T>) -> Parameters<T> {
        leading([at.qd])
    }
}
