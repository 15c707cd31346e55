use super::law::{Info, Law, Parameter, Parameters, Place};
use super::probe::{Nature, Probe, Question};
use crate::{Scalar, Setup};

/// A periodic error of the robot's position, as of gears or of vibration.
///
/// With several of these the amplitudes add; the last one states frequency and phase.
pub struct RobotRipple;

impl Law for RobotRipple {
    const INFO: Info = Info {
        kind: "robot_ripple",
        place: Place::Contact,
        summary: "periodic error of the robot's position",
        formula: "handle += (y, z) · sin(2π frequency t + phase)",
        reference: "gear ripple: Sweet, Good 1985",
        parameters: &[
            Parameter::shape("y", "m", -0.1, 0.1, 0.0),
            Parameter::shape("z", "m", -0.1, 0.1, 0.0),
            Parameter::shape("frequency", "Hz", 0.01, 100.0, 1.0),
            Parameter::shape("phase", "rad", -7.0, 7.0, 0.0),
        ],
        states: 0,
    };
    const PROBE: Probe = Probe::lasting(&[Question::of(&[0, 1]).refining(&[2, 3]).stepping(1e-4)])
        .of_nature(Nature::Periodic);

    fn alter<T: Scalar, const N: usize>(p: &Parameters<T>, _index: usize, setup: &mut Setup<T, N>) {
        setup.displaced.ripple[0] += p[0];
        setup.displaced.ripple[1] += p[1];
        setup.displaced.frequency = p[2];
        setup.displaced.phase = p[3];
    }
}
