use super::law::{Info, Law, Parameter, Parameters, Place};
use super::prior::{Part, Prior};
use crate::{Body, Scalar, Setup};

/// A point mass at the tip of the last segment, such as a payload in the hand.
pub struct AddedMass;

impl Law for AddedMass {
    const INFO: Info = Info {
        kind: "added_mass",
        place: Place::Hand,
        summary: "point mass at the hand",
        formula: "mass at the tip of the last segment: X_j += mass · a_j, J_j += mass · a_j² for every j",
        reference: "parallel-axis theorem; Kodek 2004, equation 3.14",
        parameters: &[Parameter::linear("mass", "kg", 0.0, 50.0, 0.0)],
        states: 0,
    };
    const PRIOR: Prior = Prior::lasting(&[Part::of(&[0]).small(0.02)]);

    fn alter<T: Scalar, const N: usize>(p: &Parameters<T>, _index: usize, setup: &mut Setup<T, N>) {
        if let Some(segment) = setup.segments.last_mut() {
            let payload = Body::point(p[0], segment.length);
            let whole = Body::of(segment).with(&payload);
            *segment = whole.segment(segment.length);
        }
    }
}
