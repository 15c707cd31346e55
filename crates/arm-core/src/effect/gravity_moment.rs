use super::law::{Info, Law, Parameter, Parameters, Place};
use super::prior::{Part, Prior};
use crate::{Scalar, Setup};

/// A change of the first moment m·l of a segment: its centre of mass lies elsewhere along the segment.
///
/// The mass and the inertia about the centre of mass stay. The torque of gravity is linear in it; the inertia about the joint
/// also changes with its square, moment²/mass, which is small.
pub struct GravityMoment;

impl Law for GravityMoment {
    const INFO: Info = Info {
        kind: "gravity_moment",
        place: Place::Segment,
        summary: "change of the first moment of a segment: its centre of mass lies elsewhere",
        formula: "com += moment/mass: X_j += moment",
        reference: "Kodek 2004, section 3.5.1 (m·l as unknown)",
        parameters: &[Parameter::linear("moment", "kg m", -5.0, 5.0, 0.0)],
        states: 0,
    };
    const TITLE: Option<&'static str> = Some("change of gravity moment");
    const PRIOR: Prior = Prior::lasting(&[Part::of(&[0]).small(2e-3)]);

    fn alter<T: Scalar, const N: usize>(p: &Parameters<T>, index: usize, setup: &mut Setup<T, N>) {
        if let Some(segment) = setup.segments.get_mut(index) {
            segment.com[0] += p[0] / segment.mass;
        }
    }
}
