//! Arms of which little is known: the model handed over is rigid and from the literature, without any joint law.
//!
//! What a laboratory has on its first day. Every joint of the true arm has a spring with an unknown rest angle and a viscosity, half
//! of them rub, and up to two further effects act.

use crate::cast::{Scene, Strength, cast, family};
use crate::effect::{Dry, Hidden, Law, Scored};
use crate::model::Setting;
use crate::motion::Movement;
use crate::random::Random;
use crate::rig::{Link, Passive};

/// Stiffness of a joint \[N m/rad\].
const STIFFNESS: [f64; 2] = [0.4, 3.0];
/// Distance of the rest angle from the posture about which the movements go \[°\].
const REST: f64 = 12.0;
/// \[N m s/rad\]
const VISCOSITY: [f64; 2] = [0.05, 0.4];
/// Dry friction where a joint rubs \[N m\].
const FRICTION: [f64; 2] = [0.0, 0.25];
/// Standard deviation of masses, centres of mass and inertias, relative; none is off by more than 1.5 of these.
const UNCERTAINTY: [f64; 2] = [0.05, 0.10];
const FARTHEST: f64 = 1.5;
/// Part of the arms whose wrist is locked by an orthosis.
const LOCKED: f64 = 0.25;
/// Samples a second \[Hz\].
pub(crate) const RATES: [f64; 4] = [25.0, 50.0, 100.0, 200.0];
/// Kinds that can act besides: none that a rest angle or a segment within its uncertainty could stand for.
const FURTHER: &[&str] = &[
    "stretch_reflex",
    "contact_compliance",
    "gravity_tilt",
    "force_bias",
    "end_range",
    "tremor",
    "biarticular",
    "quadratic_drag",
    "relaxation",
    "voluntary",
    "force_misalignment",
    "time_delay",
];

/// A person's arm with passive joints, and the rigid model of it.
///
/// # Errors
/// In words, when there is no such person.
pub(crate) fn setting(random: &mut Random) -> Result<Setting, String> {
    let mut setting = Setting::of(true, 0.0, random)?;
    if random.chance(LOCKED) {
        lock_wrist(&mut setting);
    }
    let [low, high] = UNCERTAINTY;
    setting.uncertainty = random.within(low, high);
    for link in &mut setting.truth.links {
        let mut factor = || 1.0 + setting.uncertainty * random.limited_normal(FARTHEST);
        link.mass *= factor();
        link.com *= factor();
        link.inertia *= factor();
    }
    for (joint, posture) in setting.truth.joints.iter_mut().zip(&setting.posture) {
        *joint = Passive {
            stiffness: random.within(STIFFNESS[0], STIFFNESS[1]),
            rest: posture + random.within(-REST, REST).to_radians(),
            viscosity: random.within(VISCOSITY[0], VISCOSITY[1]),
        };
    }
    for joint in &mut setting.model.joints {
        *joint = Passive::NONE;
    }
    Ok(setting)
}

/// Forearm and hand become one segment.
fn lock_wrist(setting: &mut Setting) {
    setting.posture.truncate(2);
    for rig in [&mut setting.truth, &mut setting.model] {
        let hand = rig.links.remove(2);
        let forearm = rig.links[1];
        let mass = forearm.mass + hand.mass;
        let from_elbow = [forearm.com, forearm.length + hand.com];
        let com = (forearm.mass * from_elbow[0] + hand.mass * from_elbow[1]) / mass;
        let away = from_elbow.map(|at| (at - com) * (at - com));
        rig.links[1] = Link {
            length: forearm.length + hand.length,
            mass,
            com,
            inertia: forearm.inertia + hand.inertia + forearm.mass * away[0] + hand.mass * away[1],
        };
        rig.joints.truncate(2);
        rig.rotors.truncate(2);
    }
}

/// Dry friction in half of the joints.
pub(crate) fn friction(joints: usize, random: &mut Random) -> Vec<Hidden> {
    let mut rubs = |joint: usize| {
        let torque = random.within(FRICTION[0], FRICTION[1]);
        random.chance(0.5).then(|| {
            let law = Law::Dry(Dry::Coulomb(torque));
            passive("coulomb", joint, law, &[("torque", torque)])
        })
    };
    (0..joints).filter_map(&mut rubs).collect()
}

/// So many further effects of different families.
///
/// # Errors
/// In words, when a kind cannot be cast.
pub(crate) fn further(
    count: usize,
    strength: Strength,
    scene: &Scene,
    random: &mut Random,
) -> Result<Vec<Hidden>, String> {
    let mut names = FURTHER.to_vec();
    random.shuffle(&mut names);
    let (mut hidden, mut taken) = (Vec::new(), Vec::new());
    for name in names {
        let own = family(name);
        if hidden.len() < count && !taken.contains(&own) {
            taken.push(own);
            hidden.push(cast(name, strength, scene, random)?);
        }
    }
    Ok(hidden)
}

/// Spring and viscosity of every joint as the effects that the model lacks.
pub(crate) fn laws(setting: &Setting) -> Vec<Hidden> {
    let joints = setting.truth.joints.iter().enumerate();
    joints
        .flat_map(|(j, own)| {
            let spring = crate::effect::Elastic::Spring([own.stiffness, own.rest]);
            [
                passive(
                    "elastic",
                    j,
                    Law::Elastic(spring),
                    &[("stiffness", own.stiffness), ("rest", own.rest)],
                ),
                passive(
                    "viscous",
                    j,
                    Law::Viscous(own.viscosity),
                    &[("viscosity", own.viscosity)],
                ),
            ]
        })
        .collect()
}

fn passive(kind: &'static str, joint: usize, law: Law, values: &[(&'static str, f64)]) -> Hidden {
    let scored = values.iter().map(|&(name, value)| Scored {
        name,
        value,
        exact: true,
    });
    Hidden {
        kind,
        joint: Some(joint),
        channel: None,
        trial: None,
        law,
        scored: scored.collect(),
    }
}

/// Four or five of the movements to fit: the two large and quick ones, and some of the others.
pub(crate) fn choose(movements: Vec<Movement>, random: &mut Random) -> Vec<Movement> {
    let last = movements.len() - 1;
    let mut others: Vec<usize> = (0..last)
        .filter(|m| !["both-large", "fast"].contains(&movements[*m].name.as_str()))
        .collect();
    random.shuffle(&mut others);
    others.truncate(2 + random.below(2));
    let numbered = movements.into_iter().enumerate();
    numbered
        .filter(|(m, movement)| {
            *m == last
                || others.contains(m)
                || ["both-large", "fast"].contains(&movement.name.as_str())
        })
        .map(|(_, movement)| movement)
        .collect()
}

/// What slips in one trial.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Slip {
    /// The handle in the hand: when \[s\], by how much along the last segment and across \[m\].
    Handle(f64, [f64; 2]),
    /// The sensor of a joint angle: when \[s\], which joint, by how much \[rad\].
    Angle(f64, usize, f64),
}

/// Draws a slip in the middle half of a trial.
pub(crate) fn slip(joints: usize, duration: f64, random: &mut Random) -> Slip {
    let start = duration * random.within(0.25, 0.75);
    let signed =
        |low: f64, high: f64, random: &mut Random| random.within(low, high) * random.sign();
    if random.chance(0.5) {
        let by = [signed(2e-3, 4e-3, random), signed(0.0, 2e-3, random)];
        Slip::Handle(start, by)
    } else {
        let joint = random.below(joints);
        Slip::Angle(start, joint, signed(1.5, 4.0, random).to_radians())
    }
}
