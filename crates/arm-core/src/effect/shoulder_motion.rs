use super::law::{Info, Law, Parameter, Parameters, Place};
use super::prior::{Part, Prior, Values};
use crate::{Scalar, Setup};

/// A first joint that does not stay in place but moves with its own angle, as a shoulder does.
///
/// With several of these the displacements add; the last one states the rest angle.
pub struct ShoulderMotion;

impl Law for ShoulderMotion {
    const INFO: Info = Info {
        kind: "shoulder_motion",
        place: Place::Base,
        summary: "first joint that moves with its angle",
        formula: "base += (y, z) · (q_1 − rest)",
        reference: "shoulder rhythm: Inman, Saunders, Abbott 1944; linear form",
        parameters: &[
            Parameter::shape("y", "m/rad", -1.0, 1.0, 0.0),
            Parameter::shape("z", "m/rad", -1.0, 1.0, 0.0),
            Parameter::shape("rest", "rad", -7.0, 7.0, 0.0),
        ],
        states: 0,
    };
    // The path of a shoulder is bent.
    const PRIOR: Prior =
        Prior::lasting(&[Part::of(&[0, 1]).shaped(&[(2, Values::Middle)]).small(1e-5)])
            .with_law_error(0.003);

    fn alter<T: Scalar, const N: usize>(p: &Parameters<T>, _index: usize, setup: &mut Setup<T, N>) {
        setup.base_motion[0] += p[0];
        setup.base_motion[1] += p[1];
        setup.base_rest = p[2];
    }
}
