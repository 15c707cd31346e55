use super::law::{Info, Law, Parameters, Place, WAVE, add_wave};
use super::prior::{Nature, Part, Prior};
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
        parameters: &WAVE,
        states: 0,
    };
    const PRIOR: Prior = Prior::lasting(&[Part::of(&[0, 1]).varying(&[2, 3]).small(1e-4)])
        .of_nature(Nature::Periodic);

    fn alter<T: Scalar, const N: usize>(p: &Parameters<T>, _index: usize, setup: &mut Setup<T, N>) {
        add_wave(p, &mut setup.displaced.ripple);
    }
}
