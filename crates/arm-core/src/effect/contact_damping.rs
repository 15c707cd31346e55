use super::law::{Info, Law, Parameter, Parameters, Place};
use super::prior::{Part, Prior};
use crate::{Scalar, Setup};

/// Damping of the contact beyond that of the model; the sum is never negative.
pub struct ContactDamping;

impl Law for ContactDamping {
    const INFO: Info = Info {
        kind: "contact_damping",
        place: Place::Contact,
        summary: "damping of the contact beyond the model",
        formula: "damping += change, at least 0",
        reference: "Kelvin-Voigt contact",
        parameters: &[
            Parameter::linear("y", "N s/m", -1000.0, 10000.0, 0.0),
            Parameter::linear("z", "N s/m", -1000.0, 10000.0, 0.0),
        ],
        states: 0,
    };
    const PRIOR: Prior = Prior::lasting(&[Part::of(&[0, 1]).small(10.0)]);

    fn alter<T: Scalar, const N: usize>(p: &Parameters<T>, _index: usize, setup: &mut Setup<T, N>) {
        for axis in 0..2 {
            let damping = setup.contact.damping[axis] + p[axis];
            setup.contact.damping[axis] = damping.max(T::ZERO);
        }
    }
}
