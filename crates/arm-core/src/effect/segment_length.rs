use super::law::{Info, Law, Parameter, Parameters, Place};
use super::prior::{Part, Prior};
use crate::{Scalar, Setup};

/// A change of the length of a segment; its centre of mass stays where it is from the proximal joint.
pub struct SegmentLength;

impl Law for SegmentLength {
    const INFO: Info = Info {
        kind: "segment_length",
        place: Place::Segment,
        summary: "change of the length of a segment",
        formula: "length += change",
        reference: "Kodek 2004, appendix A (errors of segment lengths)",
        parameters: &[Parameter::shape("change", "m", -0.5, 0.5, 0.0)],
        states: 0,
    };
    const TITLE: Option<&'static str> = Some("change of length");
    const PRIOR: Prior = Prior::lasting(&[Part::of(&[0]).small(1e-3)]);

    fn alter<T: Scalar, const N: usize>(p: &Parameters<T>, index: usize, setup: &mut Setup<T, N>) {
        if let Some(segment) = setup.segments.get_mut(index) {
            segment.length += p[0];
        }
    }
}
