//! Effects in segments, frame, contact and robot, and in sensors.

use super::scene::{Place, Scene, Values};
use crate::effect::{Law, Sensing};
use crate::random::Random;
use crate::rig::BasePath;

/// The law of a kind with a size, and its values in the parameters of the catalogue; none for a kind of a joint.
pub(super) fn law(
    kind: &str,
    size: f64,
    place: &mut Place,
    scene: &Scene,
    random: &mut Random,
) -> Option<(Law, Values)> {
    let signed = size * random.sign();
    let turn = core::f64::consts::TAU;
    Some(match kind {
        "added_mass" => (Law::HandMass(size), Values::exact("mass", size)),
        "gravity_moment" => {
            // Towards the body there must be room.
            let link = &scene.rig.links[place.joint?];
            let room = 0.8 * link.mass * link.com;
            let moment = if size > room { size } else { signed };
            (
                Law::Segment([moment, 0.0, 0.0]),
                Values::exact("moment", moment),
            )
        }
        "inertia" => (
            Law::Segment([0.0, size, 0.0]),
            Values::exact("change", size),
        ),
        "segment_length" => (
            Law::Segment([0.0, 0.0, signed]),
            Values::exact("change", signed),
        ),
        "gravity_tilt" => (Law::Tilt(signed), Values::exact("angle", signed)),
        "shoulder_motion" => {
            let (sin, cos) = libm::sincos(random.within(0.0, turn));
            let per_angle = [size * cos, size * sin];
            let rest = 0.5 * (scene.range[0][0] + scene.range[0][1]);
            let values = both(per_angle).and_about("rest", rest);
            (Law::Base(BasePath::Line { per_angle, rest }), values)
        }
        "backlash" => {
            let play = random.pick(&[[size, size], [size, 0.0], [0.0, size], [size, 0.6 * size]]);
            (Law::Play(play), both(play))
        }
        "contact_compliance" => {
            let softer = random.pick(&[[size, size], [size, 0.0], [0.0, size]]);
            (Law::Compliance(softer), both(softer))
        }
        "contact_damping" => (Law::Damping([size; 2]), both([size; 2])),
        "robot_ripple" => {
            let (sin, cos) = libm::sincos(random.within(0.0, turn));
            let (frequency, phase) = (random.within(0.8, 5.0), random.within(0.0, turn));
            // Half a turn of the phase is the other sign of both amplitudes.
            let values = Values::exact("frequency", frequency)
                .and_about("y", size * cos)
                .and_about("z", size * sin)
                .and_about("phase", phase);
            (
                Law::Ripple([size * cos, size * sin, frequency, phase]),
                values,
            )
        }
        _ => {
            let (fault, values) = sensing(kind, (size, signed), place, random)?;
            (Law::Sensing(fault), values)
        }
    })
}

fn both([y, z]: [f64; 2]) -> Values {
    Values::exact("y", y).and_exact("z", z)
}

fn sensing(
    kind: &str,
    (size, signed): (f64, f64),
    place: &mut Place,
    random: &mut Random,
) -> Option<(Sensing, Values)> {
    Some(match kind {
        "force_bias" => {
            place.channel = Some(random.below(2));
            (Sensing::Bias(signed), Values::exact("bias", signed))
        }
        "force_drift" => {
            place.channel = Some(random.below(2));
            (Sensing::Drift(signed), Values::exact("rate", signed))
        }
        "force_gain" => {
            // Of a force that is there: the vertical one carries the arm.
            place.channel = Some(1);
            (Sensing::Gain(signed), Values::exact("gain", signed))
        }
        "force_misalignment" => (Sensing::Turn(signed), Values::exact("angle", signed)),
        "angle_offset" => (Sensing::Offset(signed), Values::exact("offset", signed)),
        "time_delay" => (Sensing::Delay(size), Values::exact("delay", size)),
        _ => return None,
    })
}
