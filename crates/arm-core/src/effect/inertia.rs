use super::law::{Info, Law, Parameter, Parameters, Place};
use super::prior::{Part, Prior};
use crate::{Scalar, Setup};

/// A change of the moment of inertia of a segment about its centre of mass.
pub struct Inertia;

impl Law for Inertia {
    const INFO: Info = Info {
        kind: "inertia",
        place: Place::Segment,
        summary: "change of the moment of inertia of a segment",
        formula: "inertia += change: J_j += change",
        reference: "Kodek 2004, equation 3.4",
        parameters: &[Parameter::linear("change", "kg m²", -1.0, 10.0, 0.0)],
        states: 0,
    };
    const TITLE: Option<&'static str> = Some("change of inertia");
    const PRIOR: Prior = Prior::lasting(&[Part::of(&[0]).small(1e-3)]);

    fn alter<T: Scalar, const N: usize>(p: &Parameters<T>, index: usize, setup: &mut Setup<T, N>) {
        if let Some(segment) = setup.segments.get_mut(index) {
            segment.inertia += p[0];
        }
    }
}
