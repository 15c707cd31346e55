use super::law::{Info, Law, Local, MAX_PARAMETERS, Parameter, Parameters, Place};
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
        parameters: &[Parameter {
            name: "viscosity",
            unit: "N m s/rad",
            min: 0.0,
            max: 100.0,
            default: 0.0,
            linear: true,
        }],
        memory: false,
    };

    #[inline]
    fn torque<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> T {
        p[0] * at.qd
    }

    fn gradient<T: Scalar>(_p: &Parameters<T>, at: &Local<T>) -> Parameters<T> {
        let mut g = [T::ZERO; MAX_PARAMETERS];
        g[0] = at.qd;
        g
    }
}
