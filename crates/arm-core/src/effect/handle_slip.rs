use super::law::{Info, Law, Parameter, Parameters, Place};
use super::prior::{Nature, Part, Prior};
use crate::{Scalar, Setup};

/// A handle that slips in the hand once and stays there: the hand is then further than by the robot's angles.
///
/// With several of these the ways add; the last one states the start.
pub struct HandleSlip;

impl Law for HandleSlip {
    const INFO: Info = Info {
        kind: "handle_slip",
        place: Place::Contact,
        summary: "handle that slips in the hand, once",
        formula: "handle += (y, z) · s³(10 − 15s + 6s²), s = (t − start)/(0.1 s) within 0 to 1",
        reference: "polynomial of least jerk: Flash, Hogan 1985; its duration is assumed",
        parameters: &[
            Parameter::shape("y", "m", -0.1, 0.1, 0.0),
            Parameter::shape("z", "m", -0.1, 0.1, 0.0),
            Parameter::shape("start", "s", -1000.0, 100000.0, 0.0),
        ],
        states: 0,
    };
    const PRIOR: Prior = Prior::lasting(&[Part::of(&[0, 1]).small(1e-4)]).of_nature(Nature::Slip);

    fn alter<T: Scalar, const N: usize>(p: &Parameters<T>, _index: usize, setup: &mut Setup<T, N>) {
        setup.displaced.slip[0] += p[0];
        setup.displaced.slip[1] += p[1];
        setup.displaced.slip_start = p[2];
    }
}
