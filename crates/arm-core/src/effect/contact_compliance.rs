use super::law::{Info, Law, Parameter, Parameters, Place};
use super::prior::{Part, Prior};
use crate::{Scalar, Setup};

/// Compliance of hand and handle beyond that of the model, in series with it.
///
/// The contact becomes at most a hundred times stiffer at any negative value.
pub struct ContactCompliance;

impl Law for ContactCompliance {
    const INFO: Info = Info {
        kind: "contact_compliance",
        place: Place::Contact,
        summary: "compliance of the contact beyond the model",
        formula: "1/S += compliance: S becomes S/(1 + S · compliance)",
        reference: "springs in series",
        parameters: &[
            Parameter::shape("y", "m/N", -0.001, 0.1, 0.0),
            Parameter::shape("z", "m/N", -0.001, 0.1, 0.0),
        ],
        states: 0,
    };
    const PRIOR: Prior = Prior::lasting(&[Part::of(&[0, 1]).small(5e-6)]);

    fn alter<T: Scalar, const N: usize>(p: &Parameters<T>, _index: usize, setup: &mut Setup<T, N>) {
        for axis in 0..2 {
            let stiffness = setup.contact.stiffness[axis];
            let softer = (T::ONE + stiffness * p[axis]).max(T::of(0.01));
            setup.contact.stiffness[axis] = stiffness / softer;
        }
    }
}
