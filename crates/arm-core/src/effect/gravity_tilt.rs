use super::law::{Info, Law, Parameter, Parameters, Place};
use super::prior::{Part, Prior};
use crate::{Scalar, Setup};

/// A tilt of the frame of measurement against the plumb line, counter-clockwise as gravity is seen to turn.
pub struct GravityTilt;

impl Law for GravityTilt {
    const INFO: Info = Info {
        kind: "gravity_tilt",
        place: Place::Frame,
        summary: "tilt of the measuring frame against the plumb line",
        formula: "gravity turned by angle: (0, −g) becomes g (sin angle, −cos angle)",
        reference: "rotation of the plane",
        parameters: &[Parameter::shape("angle", "rad", -0.5, 0.5, 0.0)],
        states: 0,
    };
    const PRIOR: Prior = Prior::lasting(&[Part::of(&[0]).small(5e-3)]);

    fn alter<T: Scalar, const N: usize>(p: &Parameters<T>, _index: usize, setup: &mut Setup<T, N>) {
        let (sin, cos) = p[0].sin_cos();
        let [y, z] = setup.gravity;
        setup.gravity = [y * cos - z * sin, y * sin + z * cos];
    }
}
