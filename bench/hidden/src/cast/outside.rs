//! Effects that the catalogue does not have.

use super::scene::Scene;
use crate::effect::{Dry, Elastic, Hidden, Law, Sensing, Wobble};
use crate::random::Random;
use crate::rig::BasePath;

/// Kinds that no catalogue has.
pub const OUTSIDE: &[&str] = &[
    "wobbling_mass",
    "centre_on_a_circle",
    "magnetic_detent",
    "one_way_friction",
    "warming_angle_sensor",
    "placed_damping",
    "force_hysteresis",
];

/// Hides an effect that the catalogue does not have.
///
/// # Errors
/// A name that is not among [`OUTSIDE`].
pub fn cast_outside(name: &str, scene: &Scene, random: &mut Random) -> Result<Hidden, String> {
    let kind = OUTSIDE
        .iter()
        .find(|known| **known == name)
        .ok_or_else(|| format!("no kind {name} outside the catalogue"))?;
    let joint = random.below(2);
    let [lowest, highest] = scene.range[joint];
    let (middle, half) = (0.5 * (lowest + highest), 0.5 * (highest - lowest));
    let (mut place, mut channel) = (Some(joint), None);
    let law = match *kind {
        "wobbling_mass" => Law::Wobble(Wobble {
            mass: random.within(0.6, 0.75) * scene.rig.links[joint].mass,
            frequency: random.within(1.0, 1.8),
            damping: random.within(0.05, 0.15),
        }),
        "centre_on_a_circle" => {
            place = Some(0);
            Law::Base(BasePath::Circle {
                radius: random.within(0.008, 0.015),
                turns: random.within(3.0, 5.0),
                rest: 0.5 * (scene.range[0][0] + scene.range[0][1]),
            })
        }
        "magnetic_detent" => Law::Elastic(Elastic::Detent([
            random.within(0.3, 0.6),
            libm::round(random.within(16.0, 30.0)),
            random.within(0.0, core::f64::consts::TAU),
        ])),
        "one_way_friction" => Law::Dry(Dry::Pawl([
            random.sign(),
            random.within(0.6, 1.0) / (2.0 * half),
            lowest,
        ])),
        "warming_angle_sensor" => Law::Sensing(Sensing::WarmingAngle([
            random.within(0.08, 0.15) * random.sign(),
            middle,
        ])),
        "placed_damping" => {
            let strength = random.within(1.2, 2.0);
            Law::PlacedDamping([strength, middle + random.sign() * half, half])
        }
        _ => {
            place = None;
            channel = Some(random.below(2));
            Law::Sensing(Sensing::Hysteresis(random.within(0.8, 1.5)))
        }
    };
    Ok(Hidden {
        kind,
        joint: place,
        channel,
        trial: None,
        law,
        scored: Vec::new(),
    })
}
