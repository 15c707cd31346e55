//! Which effect is hidden, where, and how large.

use crate::effect::{Dry, Elastic, Hidden, Law, Muscle, Scored, Sensing, Wobble};
use crate::random::Random;
use crate::rig::{BasePath, Rig};

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

/// What is known of a session when its effects are chosen.
#[derive(Clone, Debug)]
pub struct Scene<'a> {
    /// The true rig without hidden effects.
    pub rig: &'a Rig,
    /// Smallest and largest angle of each joint in the movements to fit \[rad\].
    pub range: Vec<[f64; 2]>,
    /// Largest speed of each joint there \[rad/s\].
    pub speed: Vec<f64>,
    /// Duration of each trial to fit \[s\], and its number.
    pub trials: Vec<(usize, f64)>,
}

type Sizes = [[f64; 2]; 3];

/// A kind of the catalogue: name, family, sizes when strong and when medium, at shoulder, elbow and wrist.
///
/// Kinds of one family are never combined: neighbours in it can look alike.
struct Kind {
    name: &'static str,
    family: u8,
    strong: Sizes,
    medium: Sizes,
}

const fn at_joints(name: &'static str, family: u8, strong: Sizes, medium: Sizes) -> Kind {
    Kind {
        name,
        family,
        strong,
        medium,
    }
}

const fn anywhere(name: &'static str, family: u8, strong: [f64; 2], medium: [f64; 2]) -> Kind {
    at_joints(name, family, [strong; 3], [medium; 3])
}

const DISSIPATION: u8 = 0;
const ELASTICITY: u8 = 1;
const MUSCLE: u8 = 2;
const SEGMENT: u8 = 3;
const FRAME: u8 = 4;
const CONTACT: u8 = 5;
const FORCE: u8 = 6;
const ANGLE: u8 = 7;
const TIME: u8 = 8;

/// The catalogue. Sizes in SI units; orientation: strong is 8 to 20 and medium 3 to 5 times the least that the planned
/// movements show, or that the declared tolerances leave.
const KINDS: &[Kind] = &[
    at_joints(
        "viscous",
        DISSIPATION,
        [[0.5, 1.0], [0.5, 1.0], [0.15, 0.3]],
        [[0.22, 0.35], [0.2, 0.35], [0.07, 0.11]],
    ),
    at_joints(
        "coulomb",
        DISSIPATION,
        [[0.2, 0.4], [0.12, 0.25], [0.05, 0.1]],
        [[0.07, 0.11], [0.04, 0.06], [0.02, 0.03]],
    ),
    at_joints(
        "stribeck",
        DISSIPATION,
        [[0.4, 0.6], [0.2, 0.35], [0.08, 0.12]],
        [[0.14, 0.2], [0.07, 0.1], [0.03, 0.045]],
    ),
    at_joints(
        "load_friction",
        DISSIPATION,
        [[0.010, 0.018], [0.010, 0.018], [0.006, 0.010]],
        [[0.004, 0.006], [0.003, 0.005], [0.002, 0.003]],
    ),
    at_joints(
        "quadratic_drag",
        DISSIPATION,
        [[0.6, 1.0], [0.5, 0.9], [0.3, 0.5]],
        [[0.25, 0.35], [0.18, 0.28], [0.1, 0.15]],
    ),
    at_joints(
        "elastic",
        ELASTICITY,
        [[2.0, 4.0], [2.0, 4.0], [1.5, 2.5]],
        [[0.8, 1.3], [0.8, 1.3], [0.6, 0.9]],
    ),
    at_joints(
        "cubic_elastic",
        ELASTICITY,
        [[6.0, 12.0], [4.0, 8.0], [4.0, 8.0]],
        [[2.5, 4.0], [1.5, 2.5], [1.5, 2.5]],
    ),
    at_joints(
        "relaxation",
        ELASTICITY,
        [[2.0, 4.0], [2.0, 4.0], [1.5, 2.5]],
        [[0.8, 1.2], [0.6, 1.0], [0.5, 0.8]],
    ),
    at_joints(
        "thixotropy",
        DISSIPATION,
        [[0.5, 0.8], [0.3, 0.5], [0.1, 0.2]],
        [[0.18, 0.25], [0.1, 0.15], [0.04, 0.06]],
    ),
    at_joints(
        "constant_moment",
        ELASTICITY,
        [[1.2, 2.5], [0.8, 1.5], [0.25, 0.4]],
        [[0.6, 0.9], [0.35, 0.5], [0.12, 0.18]],
    ),
    at_joints(
        "end_range",
        ELASTICITY,
        [[1.0, 2.0], [0.8, 1.6], [0.3, 0.5]],
        [[0.45, 0.65], [0.3, 0.45], [0.12, 0.18]],
    ),
    at_joints("biarticular", ELASTICITY, [[0.8, 1.5]; 3], [[0.3, 0.45]; 3]),
    at_joints(
        "stretch_reflex",
        MUSCLE,
        [[0.9, 1.5], [0.6, 1.0], [0.3, 0.5]],
        [[0.4, 0.55], [0.2, 0.3], [0.1, 0.15]],
    ),
    at_joints(
        "tremor",
        MUSCLE,
        [[0.2, 0.4], [0.12, 0.25], [0.04, 0.08]],
        [[0.08, 0.12], [0.05, 0.07], [0.02, 0.03]],
    ),
    at_joints(
        "voluntary",
        MUSCLE,
        [[2.0, 3.5], [1.2, 2.0], [0.3, 0.5]],
        [[0.8, 1.2], [0.5, 0.8], [0.12, 0.2]],
    ),
    at_joints(
        "motor_inertia",
        SEGMENT,
        [[0.35, 0.5], [0.1, 0.18], [0.02, 0.04]],
        [[0.18, 0.25], [0.05, 0.075], [0.01, 0.014]],
    ),
    anywhere("added_mass", SEGMENT, [0.4, 0.8], [0.22, 0.32]),
    at_joints(
        "gravity_moment",
        SEGMENT,
        [[0.14, 0.22], [0.09, 0.13], [0.02, 0.03]],
        [[0.08, 0.11], [0.05, 0.07], [0.012, 0.017]],
    ),
    at_joints(
        "inertia",
        SEGMENT,
        [[0.35, 0.5], [0.1, 0.18], [0.02, 0.04]],
        [[0.18, 0.25], [0.05, 0.075], [0.01, 0.014]],
    ),
    at_joints(
        "segment_length",
        SEGMENT,
        [[0.02, 0.04]; 3],
        [[0.01, 0.015]; 3],
    ),
    anywhere("gravity_tilt", FRAME, [0.11, 0.17], [0.06, 0.085]),
    anywhere("shoulder_motion", FRAME, [0.015, 0.03], [0.004, 0.008]),
    anywhere("backlash", CONTACT, [0.003, 0.006], [0.0012, 0.002]),
    anywhere(
        "contact_compliance",
        CONTACT,
        [1.0e-4, 2.0e-4],
        [3.5e-5, 5.0e-5],
    ),
    anywhere("contact_damping", CONTACT, [250.0, 400.0], [120.0, 180.0]),
    anywhere("robot_ripple", CONTACT, [2.0e-4, 5.0e-4], [6.0e-5, 1.0e-4]),
    anywhere("force_bias", FORCE, [2.0, 4.0], [1.0, 1.5]),
    anywhere("force_drift", FORCE, [0.12, 0.25], [0.05, 0.08]),
    anywhere("force_gain", FORCE, [0.12, 0.20], [0.06, 0.085]),
    anywhere("force_misalignment", FORCE, [0.06, 0.11], [0.02, 0.03]),
    at_joints(
        "angle_offset",
        ANGLE,
        [[0.06, 0.10]; 3],
        [[0.025, 0.037]; 3],
    ),
    anywhere("time_delay", TIME, [0.040, 0.080], [0.018, 0.027]),
];

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

/// Names of the kinds of the catalogue, in its order.
pub fn kinds() -> impl ExactSizeIterator<Item = &'static str> {
    KINDS.iter().map(|kind| kind.name)
}

/// Family of a kind: kinds of different families are combined.
pub fn family(name: &str) -> Option<u8> {
    KINDS.iter().find(|k| k.name == name).map(|k| k.family)
}

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
    let kind = KINDS
        .iter()
        .find(|k| k.name == name)
        .ok_or_else(|| format!("no kind {name}"))?;
    let joint = choose_joint(kind.name, scene, random);
    let sizes = match strength {
        Strength::Strong => kind.strong,
        Strength::Medium => kind.medium,
    };
    let [low, high] = sizes[joint.min(2)];
    let size = random.within(low, high);
    let [lowest, highest] = scene.range[joint];
    let middle = 0.5 * (lowest + highest);
    let third = (highest - lowest) / 3.0;
    let signed = size * random.sign();
    let exact = |name, value| Scored {
        name,
        value,
        exact: true,
    };
    let about = |name, value| Scored {
        name,
        value,
        exact: false,
    };
    let (mut at_joint, mut channel, mut trial) = (true, None, None);
    let (law, scored) = match kind.name {
        "viscous" => (Law::Viscous(size), vec![exact("viscosity", size)]),
        "coulomb" => (Law::Dry(Dry::Coulomb(size)), vec![exact("torque", size)]),
        "stribeck" => {
            let half = random.within(0.05, 0.12);
            (
                Law::Dry(Dry::Stribeck([size, half])),
                vec![about("torque", size)],
            )
        }
        "load_friction" => (Law::Dry(Dry::Load(size)), vec![exact("coefficient", size)]),
        "quadratic_drag" => (Law::Drag(size), vec![exact("drag", size)]),
        "elastic" => {
            let rest = middle + random.within(-third, third);
            (
                Law::Elastic(Elastic::Spring([size, rest])),
                vec![exact("stiffness", size)],
            )
        }
        "cubic_elastic" => {
            let rest = middle + 0.5 * random.within(-third, third);
            (
                Law::Elastic(Elastic::Cubic([size, rest])),
                vec![exact("stiffness", size)],
            )
        }
        "relaxation" => {
            let time = random.within(0.5, 2.0);
            (
                Law::Elastic(Elastic::Creeping([size, time])),
                vec![exact("stiffness", size), exact("time", time)],
            )
        }
        "thixotropy" => {
            let (way, time) = (random.within(0.12, 0.3), random.within(1.0, 3.0));
            (
                Law::Dry(Dry::Thixotropy([size, way, time])),
                vec![about("friction", size)],
            )
        }
        "constant_moment" => (
            Law::Elastic(Elastic::Moment(signed)),
            vec![exact("moment", signed)],
        ),
        "end_range" => {
            // The last third of the range, at whose end the moment has the size drawn.
            let (side, steepness) = (random.sign(), random.within(5.0, 9.0));
            let end = if side > 0.0 { highest } else { lowest };
            let slack = random.within(0.7, 1.0) * third;
            let moment = size / (libm::exp(steepness * slack) - 1.0);
            (
                Law::Elastic(Elastic::Ligament([
                    moment,
                    steepness,
                    end - side * slack,
                    side,
                ])),
                vec![],
            )
        }
        "biarticular" => {
            let share = random.within(0.7, 1.3);
            let [low, high] = scene.range[joint - 1];
            let rest = middle + share * 0.5 * (low + high) + random.within(-0.2, 0.2);
            (
                Law::Elastic(Elastic::Cord([size, share, rest])),
                vec![exact("stiffness", size), exact("ratio", share)],
            )
        }
        "stretch_reflex" => {
            let threshold = random.within(0.2, 0.4) * scene.speed[joint].min(1.0);
            let latency = random.within(0.03, 0.05);
            (
                Law::Muscle(Muscle::Reflex([size, threshold, random.sign(), latency])),
                vec![about("gain", size)],
            )
        }
        "tremor" => {
            let frequency = random.within(4.0, 8.0);
            (
                Law::Muscle(Muscle::Tremor([size, frequency])),
                vec![about("amplitude", size), exact("frequency", frequency)],
            )
        }
        "voluntary" => {
            let (number, duration) = random.pick(&scene.trials);
            let width = random.within(0.4, 0.9);
            let start = random.within(1.0, duration - 1.0 - width);
            trial = Some(number);
            (
                Law::Muscle(Muscle::Burst([signed, start, width])),
                vec![about("amplitude", signed)],
            )
        }
        "motor_inertia" => (Law::Rotor(size), vec![exact("inertia", size)]),
        "added_mass" => {
            at_joint = false;
            (Law::HandMass(size), vec![exact("mass", size)])
        }
        "gravity_moment" => {
            // Towards the body there must be room.
            let link = &scene.rig.links[joint];
            let room = 0.8 * link.mass * link.com;
            let moment = if size > room { size } else { signed };
            (
                Law::Segment([moment, 0.0, 0.0]),
                vec![exact("moment", moment)],
            )
        }
        "inertia" => (Law::Segment([0.0, size, 0.0]), vec![exact("change", size)]),
        "segment_length" => (
            Law::Segment([0.0, 0.0, signed]),
            vec![exact("change", signed)],
        ),
        "gravity_tilt" => {
            at_joint = false;
            (Law::Tilt(signed), vec![exact("angle", signed)])
        }
        "shoulder_motion" => {
            at_joint = false;
            let (sin, cos) = libm::sincos(random.within(0.0, core::f64::consts::TAU));
            let per_angle = [size * cos, size * sin];
            let rest = 0.5 * (scene.range[0][0] + scene.range[0][1]);
            (
                Law::Base(BasePath::Line { per_angle, rest }),
                vec![exact("y", per_angle[0]), exact("z", per_angle[1])],
            )
        }
        "backlash" => {
            at_joint = false;
            let play = random.pick(&[[size, size], [size, 0.0], [0.0, size], [size, 0.6 * size]]);
            (
                Law::Play(play),
                vec![exact("y", play[0]), exact("z", play[1])],
            )
        }
        "contact_compliance" => {
            at_joint = false;
            let softer = random.pick(&[[size, size], [size, 0.0], [0.0, size]]);
            (
                Law::Compliance(softer),
                vec![exact("y", softer[0]), exact("z", softer[1])],
            )
        }
        "contact_damping" => {
            at_joint = false;
            (
                Law::Damping([size; 2]),
                vec![exact("y", size), exact("z", size)],
            )
        }
        "robot_ripple" => {
            at_joint = false;
            let (sin, cos) = libm::sincos(random.within(0.0, core::f64::consts::TAU));
            let (frequency, phase) = (
                random.within(0.8, 5.0),
                random.within(0.0, core::f64::consts::TAU),
            );
            (
                Law::Ripple([size * cos, size * sin, frequency, phase]),
                vec![exact("frequency", frequency)],
            )
        }
        "force_bias" | "force_drift" | "force_gain" => {
            at_joint = false;
            channel = Some(random.below(2));
            match kind.name {
                "force_bias" => (
                    Law::Sensing(Sensing::Bias(signed)),
                    vec![exact("bias", signed)],
                ),
                "force_drift" => (
                    Law::Sensing(Sensing::Drift(signed)),
                    vec![exact("rate", signed)],
                ),
                _ => {
                    // Of a force that is there: the vertical one carries the arm.
                    channel = Some(1);
                    (
                        Law::Sensing(Sensing::Gain(signed)),
                        vec![exact("gain", signed)],
                    )
                }
            }
        }
        "force_misalignment" => {
            at_joint = false;
            (
                Law::Sensing(Sensing::Turn(signed)),
                vec![exact("angle", signed)],
            )
        }
        "angle_offset" => (
            Law::Sensing(Sensing::Offset(signed)),
            vec![exact("offset", signed)],
        ),
        _ => {
            at_joint = false;
            (
                Law::Sensing(Sensing::Delay(size)),
                vec![exact("delay", size)],
            )
        }
    };
    Ok(Hidden {
        kind: kind.name,
        joint: at_joint.then_some(joint),
        channel,
        trial,
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
            mass: random.within(0.4, 0.6) * scene.rig.links[joint].mass,
            frequency: random.within(1.5, 3.0),
            damping: random.within(0.1, 0.3),
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
