//! Effects in a joint.

use super::scene::{Place, Scene, Values};
use crate::effect::{Dry, Elastic, Law, Muscle};
use crate::random::Random;

/// The law of a kind with a size, and its values in the parameters of the catalogue; none for a kind that acts elsewhere.
pub(super) fn law(
    kind: &str,
    size: f64,
    place: &mut Place,
    scene: &Scene,
    random: &mut Random,
) -> Option<(Law, Values)> {
    let joint = place.joint?;
    Some(match kind {
        "viscous" => (Law::Viscous(size), Values::exact("viscosity", size)),
        "coulomb" => (Law::Dry(Dry::Coulomb(size)), Values::exact("torque", size)),
        "stribeck" => {
            let half = random.within(0.05, 0.12);
            (
                Law::Dry(Dry::Stribeck([size, half])),
                Values::about("torque", size).and_about("speed", half),
            )
        }
        "load_friction" => (
            Law::Dry(Dry::Load(size)),
            Values::exact("coefficient", size),
        ),
        "quadratic_drag" => (Law::Drag(size), Values::exact("drag", size)),
        "thixotropy" => {
            let (way, time) = (random.within(0.12, 0.3), random.within(1.0, 3.0));
            let values = Values::about("friction", size)
                .and_about("breakdown", way)
                .and_about("recovery", time);
            (Law::Dry(Dry::Thixotropy([size, way, time])), values)
        }
        "constant_moment" => {
            let moment = size * random.sign();
            (
                Law::Elastic(Elastic::Moment(moment)),
                Values::exact("moment", moment),
            )
        }
        "motor_inertia" => (Law::Rotor(size), Values::exact("inertia", size)),
        "stretch_reflex" | "tremor" | "voluntary" => muscle(kind, size, place, scene, random),
        _ => return elastic(kind, size, joint, scene, random),
    })
}

fn elastic(
    kind: &str,
    size: f64,
    joint: usize,
    scene: &Scene,
    random: &mut Random,
) -> Option<(Law, Values)> {
    let [lowest, highest] = scene.range[joint];
    let middle = 0.5 * (lowest + highest);
    let third = (highest - lowest) / 3.0;
    let (law, values) = match kind {
        "elastic" => {
            let rest = middle + random.within(-third, third);
            let values = Values::exact("stiffness", size).and_about("rest", rest);
            (Elastic::Spring([size, rest]), values)
        }
        "cubic_elastic" => {
            let rest = middle + 0.5 * random.within(-third, third);
            let values = Values::exact("stiffness", size).and_about("rest", rest);
            (Elastic::Cubic([size, rest]), values)
        }
        "relaxation" => {
            let time = random.within(0.5, 2.0);
            let values = Values::exact("stiffness", size).and_exact("time", time);
            (Elastic::Creeping([size, time]), values)
        }
        "end_range" => {
            // The last third of the range, at whose end the moment has the size drawn.
            let (upper, steepness) = (random.chance(0.5), random.within(5.0, 9.0));
            let slack = random.within(0.7, 1.0) * third;
            let moment = size / (libm::exp(steepness * slack) - 1.0);
            let (names, from, side) = if upper {
                (["upper_moment", "upper"], highest - slack, 1.0)
            } else {
                (["lower_moment", "lower"], lowest + slack, -1.0)
            };
            let values = Values::about(names[0], moment)
                .and_about(names[1], from)
                .and_about("steepness", steepness);
            (Elastic::Ligament([moment, steepness, from, side]), values)
        }
        "biarticular" => {
            let share = random.within(0.7, 1.3);
            let [low, high] = scene.range[joint - 1];
            let rest = middle + share * 0.5 * (low + high) + random.within(-0.2, 0.2);
            let values = Values::exact("stiffness", size)
                .and_exact("ratio", share)
                .and_about("rest", rest);
            (Elastic::Cord([size, share, rest]), values)
        }
        _ => return None,
    };
    Some((Law::Elastic(law), values))
}

fn muscle(
    kind: &str,
    size: f64,
    place: &mut Place,
    scene: &Scene,
    random: &mut Random,
) -> (Law, Values) {
    let speed = place.joint.map_or(1.0, |joint| scene.speed[joint]);
    let (law, values) = match kind {
        "stretch_reflex" => {
            let threshold = random.within(0.2, 0.4) * speed.min(1.0);
            let (direction, latency) = (random.sign(), random.within(0.03, 0.05));
            let values = Values::about("gain", size)
                .and_about("threshold", threshold)
                .and_about("direction", direction)
                .and_about("latency", latency);
            (
                Muscle::Reflex([size, threshold, direction, latency]),
                values,
            )
        }
        "tremor" => {
            let frequency = random.within(4.0, 8.0);
            let values = Values::about("amplitude", size).and_exact("frequency", frequency);
            (Muscle::Tremor([size, frequency]), values)
        }
        _ => {
            let (number, duration) = random.pick(&scene.trials);
            let (push, width) = (size * random.sign(), random.within(0.4, 0.9));
            let start = random.within(1.0, duration - 1.0 - width);
            place.trial = Some(number);
            let values = Values::about("amplitude", push)
                .and_about("start", start)
                .and_about("duration", width);
            (Muscle::Burst([push, start, width]), values)
        }
    };
    (Law::Muscle(law), values)
}
