use super::law::{Info, Law, Local, Parameter, Parameters, Place, leading};
use super::prior::{Family, Prior};
use crate::Scalar;

/// A viscosity in proportion to the activity of the muscles that move the joint.
pub struct ActiveViscosity;

impl Law for ActiveViscosity {
    const INFO: Info = Info {
        kind: "active_viscosity",
        place: Place::Joint,
        summary: "viscosity in proportion to muscle activity",
        formula: "R = viscosity · u · q̇, u the muscle activity: 0 at rest, 1 in a maximal voluntary contraction",
        reference: "Agarwal, Gottlieb 1977 (linear in the activation); Weiss, Hunter, Kearney 1988 found a constant damping ratio instead",
        parameters: &[Parameter::linear(
            "viscosity",
            "N m s/rad",
            0.0,
            1000.0,
            0.0,
        )],
        states: 0,
    };
    const FEELS_ACTIVITY: bool = true;
    // A search compares repeats, and no two have the same activity.
    const PRIOR: Prior = Prior::NONE.in_family(Family::Muscle);

    #[inline]
    fn torque<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> T {
        p[0] * at.activity * at.qd
    }

    fn gradient<T: Scalar>(_p: &Parameters<T>, at: &Local<T>) -> Parameters<T> {
        leading([at.activity * at.qd])
    }
}
