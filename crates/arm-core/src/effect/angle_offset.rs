use super::law::{Info, Law, Parameter, Parameters, Place};
use super::prior::{Part, Prior, Promise};
use crate::{Reading, Scalar};

/// An offset of the sensor of one joint angle, as of a misplaced marker.
pub struct AngleOffset;

impl Law for AngleOffset {
    const INFO: Info = Info {
        kind: "angle_offset",
        place: Place::AngleSensor,
        summary: "offset of a measured joint angle",
        formula: "q_read = q + offset",
        reference: "Kodek 2004, appendix A (errors of markers)",
        parameters: &[Parameter::shape("offset", "rad", -3.2, 3.2, 0.0)],
        states: 0,
    };
    const PRIOR: Prior =
        Prior::lasting(&[Part::of(&[0]).small(2e-3)]).promised(Promise::AngleOffset);

    #[inline]
    fn distort<T: Scalar, const N: usize>(
        p: &Parameters<T>,
        index: usize,
        reading: &mut Reading<T, N>,
    ) {
        if index < N {
            reading.q[index] += p[0];
        }
    }
}
