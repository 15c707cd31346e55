use super::law::{Info, Law, Parameter, Parameters, Place};
use super::prior::{Part, Prior};
use crate::{Scalar, Setup};

/// Free play of the handle in the hand: the spring of the contact acts only beyond it.
pub struct Backlash;

impl Law for Backlash {
    const INFO: Info = Info {
        kind: "backlash",
        place: Place::Contact,
        summary: "free play between hand and handle",
        formula: "force = stiffness · (gap ∓ play) where |gap| > play, else 0",
        reference: "dead zone: Nordin, Gutman 2002",
        parameters: &[
            Parameter::shape("y", "m", 0.0, 0.1, 0.0),
            Parameter::shape("z", "m", 0.0, 0.1, 0.0),
        ],
        states: 0,
    };
    const PRIOR: Prior = Prior::lasting(&[Part::of(&[0, 1]).small(2e-4)]).with_law_error(0.003);

    fn alter<T: Scalar, const N: usize>(p: &Parameters<T>, _index: usize, setup: &mut Setup<T, N>) {
        for axis in 0..2 {
            setup.contact.play[axis] += p[axis];
        }
    }
}
