use super::law::{Info, Law, Parameter, Parameters, Place};
use super::prior::{Part, Prior, Promise};
use crate::{Scalar, Setup};

/// The force channels lag behind the joint angles, or with a negative value lead.
pub struct TimeDelay;

impl Law for TimeDelay {
    const INFO: Info = Info {
        kind: "time_delay",
        place: Place::Sensors,
        summary: "lag of the force channels behind the angles",
        formula: "F_read(t) = F(t − delay)",
        reference: "two clocks: one for the angles, one for the forces",
        parameters: &[Parameter::shape("delay", "s", -1.0, 1.0, 0.0)],
        states: 0,
    };
    const PRIOR: Prior = Prior::lasting(&[Part::of(&[0]).small(4e-3)]).promised(Promise::TimeDelay);

    fn alter<T: Scalar, const N: usize>(p: &Parameters<T>, _index: usize, setup: &mut Setup<T, N>) {
        setup.force_delay += p[0];
    }
}
