use super::law::{Info, Law, Parameter, Parameters, Place};
use super::prior::{Part, Prior};
use crate::{Reading, Scalar};

/// A force sensor that is mounted at an angle: it reads a force turned counter-clockwise.
pub struct ForceMisalignment;

impl Law for ForceMisalignment {
    const INFO: Info = Info {
        kind: "force_misalignment",
        place: Place::Sensors,
        summary: "force sensor mounted at an angle",
        formula: "F_read = F turned by angle",
        reference: "rotation of the plane",
        parameters: &[Parameter::shape("angle", "rad", -3.2, 3.2, 0.0)],
        states: 0,
    };
    const PRIOR: Prior = Prior::lasting(&[Part::of(&[0]).small(5e-3)]);

    #[inline]
    fn distort<T: Scalar, const N: usize>(
        p: &Parameters<T>,
        _index: usize,
        reading: &mut Reading<T, N>,
    ) {
        let (sin, cos) = p[0].sin_cos();
        let [y, z] = reading.force_on_arm;
        reading.force_on_arm = [y * cos - z * sin, y * sin + z * cos];
    }
}
