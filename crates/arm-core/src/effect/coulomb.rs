use super::law::{Info, Law, Local, MAX_PARAMETERS, Parameter, Parameters, Place};
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
            Parameter { name: "torque", unit: "N m", min: 0.0, max: 100.0, default: 0.0, linear: true },
            Parameter { name: "smoothing", unit: "rad/s", min: 1e-4, max: 1.0, default: 0.01, linear: false },
        ],
        memory: false,
    };

    #[inline]
    fn torque<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> T {
        p[0] * (at.qd / p[1]).tanh()
    }

    fn gradient<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> Parameters<T> {
        let t = (at.qd / p[1]).tanh();
        let mut g = [T::ZERO; MAX_PARAMETERS];
        g[0] = t;
        g[1] = -p[0] * (T::ONE - t * t) * at.qd / (p[1] * p[1]);
        g
    }
}
