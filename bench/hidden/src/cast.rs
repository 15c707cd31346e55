//! Which effect is hidden, where, and how large.

mod joint;
mod outside;
mod rig;
mod scene;
mod sizes;

pub use outside::{OUTSIDE, cast_outside};
pub use scene::Scene;

use crate::effect::Hidden;
use crate::random::Random;
use scene::{Place, Values};
use sizes::KINDS;

/// How strong a hidden effect is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Strength {
    /// Far beyond what can be seen.
    Strong,
    /// A few times what can just be seen.
    Medium,
}

impl Strength {
    /// As it is called in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Strong => "strong",
            Self::Medium => "medium",
        }
    }
}

/// Names of the kinds of the catalogue, in its order.
pub fn kinds() -> impl ExactSizeIterator<Item = &'static str> {
    KINDS.iter().map(|kind| kind.name)
}

/// Family of a kind: kinds of different families are combined.
pub fn family(name: &str) -> Option<u8> {
    KINDS.iter().find(|k| k.name == name).map(|k| k.family)
}

/// Kinds that act on the whole rig or on a force channel, and so at no joint.
const WITHOUT_JOINT: &[&str] = &[
    "added_mass",
    "gravity_tilt",
    "shoulder_motion",
    "backlash",
    "contact_compliance",
    "contact_damping",
    "robot_ripple",
    "force_bias",
    "force_drift",
    "force_gain",
    "force_misalignment",
    "time_delay",
];

/// Hides an effect of a kind of the catalogue.
///
/// # Errors
/// A kind that it does not have.
pub fn cast(
    name: &str,
    strength: Strength,
    scene: &Scene,
    random: &mut Random,
) -> Result<Hidden, String> {
    let unknown = || format!("no kind {name}");
    let kind = KINDS.iter().find(|k| k.name == name).ok_or_else(unknown)?;
    let joint = choose_joint(kind.name, scene, random);
    let sizes = match strength {
        Strength::Strong => kind.strong,
        Strength::Medium => kind.medium,
    };
    let [low, high] = sizes[joint.min(2)];
    let size = random.within(low, high);
    let mut place = Place {
        joint: (!WITHOUT_JOINT.contains(&kind.name)).then_some(joint),
        ..Place::default()
    };
    let law = match joint::law(kind.name, size, &mut place, scene, random) {
        Some(found) => Some(found),
        None => rig::law(kind.name, size, &mut place, scene, random),
    };
    let (law, Values(scored)) = law.ok_or_else(unknown)?;
    Ok(Hidden {
        kind: kind.name,
        joint: place.joint,
        channel: place.channel,
        trial: place.trial,
        law,
        scored,
    })
}

/// A joint that moves enough for the effect to show.
fn choose_joint(kind: &str, scene: &Scene, random: &mut Random) -> usize {
    let moves = |j: &usize| {
        let [low, high] = scene.range[*j];
        match kind {
            "biarticular" => *j > 0,
            "stretch_reflex" | "quadratic_drag" | "inertia" | "motor_inertia" => {
                scene.speed[*j] > 0.6
            }
            "end_range" | "cubic_elastic" | "elastic" => high - low > 0.5,
            _ => high - low > 0.2,
        }
    };
    let able: Vec<usize> = (0..scene.range.len()).filter(moves).collect();
    if able.is_empty() {
        1
    } else {
        random.pick(&able)
    }
}
