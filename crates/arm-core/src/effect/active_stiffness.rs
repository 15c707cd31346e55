use super::law::{Info, Law, Local, Parameter, Parameters, Place, leading};
use super::prior::{Family, Prior};
use crate::Scalar;

/// A spring in proportion to the activity of the muscles that move the joint, about the angle that they pull it to.
///
/// The same muscles' torque is in it: at the angle q they pull with `stiffness · u · (rest − q)`.
pub struct ActiveStiffness;

impl Law for ActiveStiffness {
    const INFO: Info = Info {
        kind: "active_stiffness",
        place: Place::Joint,
        summary: "spring in proportion to muscle activity, about the angle that the muscles pull to",
        formula: "R = (stiffness · q − torque) · u, u the muscle activity: 0 at rest, 1 in a maximal voluntary contraction",
        reference: "Agarwal, Gottlieb 1977; Weiss, Hunter, Kearney 1988: stiffness in proportion to the muscles' torque, from rest to maximal contraction",
        parameters: &[
            Parameter::linear("stiffness", "N m/rad", 0.0, 10000.0, 0.0),
            Parameter::linear("torque", "N m", -1000.0, 1000.0, 0.0),
        ],
        states: 0,
    };
    const FEELS_ACTIVITY: bool = true;
    // A search compares repeats, and no two have the same activity.
    const PRIOR: Prior = Prior::NONE.in_family(Family::Muscle);

    #[inline]
    fn torque<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> T {
        (p[0] * at.q - p[1]) * at.activity
    }

    fn gradient<T: Scalar>(_p: &Parameters<T>, at: &Local<T>) -> Parameters<T> {
        leading([at.q * at.activity, -at.activity])
    }
}
