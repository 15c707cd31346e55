//! The kinds of the catalogue: their families, and how large they are.

pub(super) type Sizes = [[f64; 2]; 3];

/// A kind of the catalogue: name, family, sizes when strong and when medium, at shoulder, elbow and wrist.
///
/// Kinds of one family are never combined: neighbours in it can look alike.
pub(super) struct Kind {
    pub name: &'static str,
    pub family: u8,
    pub strong: Sizes,
    pub medium: Sizes,
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

/// The catalogue, with sizes in SI units.
///
/// Orientation: strong is 8 to 20 and medium 3 to 5 times what ten trials of an arm with muscle tone can just show (five standard
/// deviations), or what the declared tolerances leave. The README says what that is for the arms here, which have no tone.
pub(super) const KINDS: &[Kind] = &[
    at_joints(
        "viscous",
        DISSIPATION,
        [[0.4, 0.8], [0.3, 0.6], [0.1, 0.2]],
        [[0.15, 0.25], [0.1, 0.15], [0.04, 0.06]],
    ),
    at_joints(
        "coulomb",
        DISSIPATION,
        [[0.15, 0.35], [0.08, 0.18], [0.03, 0.06]],
        [[0.05, 0.09], [0.025, 0.04], [0.01, 0.018]],
    ),
    at_joints(
        "stribeck",
        DISSIPATION,
        [[0.25, 0.5], [0.12, 0.25], [0.05, 0.1]],
        [[0.09, 0.14], [0.04, 0.07], [0.015, 0.025]],
    ),
    at_joints(
        "load_friction",
        DISSIPATION,
        [[0.006, 0.012], [0.006, 0.012], [0.003, 0.006]],
        [[0.002, 0.003], [0.0015, 0.0025], [0.0008, 0.0012]],
    ),
    at_joints(
        "quadratic_drag",
        DISSIPATION,
        [[0.5, 0.9], [0.3, 0.6], [0.15, 0.3]],
        [[0.2, 0.3], [0.1, 0.15], [0.05, 0.08]],
    ),
    at_joints(
        "elastic",
        ELASTICITY,
        [[1.2, 2.5], [1.2, 2.5], [0.8, 1.6]],
        [[0.4, 0.7], [0.4, 0.7], [0.3, 0.5]],
    ),
    at_joints(
        "cubic_elastic",
        ELASTICITY,
        [[4.0, 8.0], [3.0, 6.0], [4.0, 8.0]],
        [[1.5, 2.5], [1.0, 1.8], [1.5, 2.5]],
    ),
    at_joints(
        "relaxation",
        ELASTICITY,
        [[1.2, 2.5], [1.2, 2.5], [0.8, 1.6]],
        [[0.4, 0.7], [0.3, 0.5], [0.2, 0.35]],
    ),
    at_joints(
        "thixotropy",
        DISSIPATION,
        [[0.35, 0.6], [0.2, 0.35], [0.06, 0.12]],
        [[0.12, 0.18], [0.06, 0.1], [0.02, 0.03]],
    ),
    at_joints(
        "constant_moment",
        ELASTICITY,
        [[1.0, 2.0], [0.6, 1.2], [0.15, 0.3]],
        [[0.4, 0.6], [0.2, 0.3], [0.05, 0.08]],
    ),
    at_joints(
        "end_range",
        ELASTICITY,
        [[0.8, 1.6], [0.5, 1.0], [0.15, 0.3]],
        [[0.3, 0.45], [0.2, 0.3], [0.06, 0.1]],
    ),
    at_joints(
        "biarticular",
        ELASTICITY,
        [[0.5, 1.0], [0.5, 1.0], [0.2, 0.4]],
        [[0.15, 0.25], [0.15, 0.25], [0.06, 0.1]],
    ),
    at_joints(
        "stretch_reflex",
        MUSCLE,
        [[0.7, 1.2], [0.4, 0.7], [0.2, 0.4]],
        [[0.25, 0.4], [0.1, 0.16], [0.08, 0.12]],
    ),
    at_joints(
        "tremor",
        MUSCLE,
        [[0.15, 0.3], [0.08, 0.16], [0.03, 0.06]],
        [[0.05, 0.08], [0.025, 0.04], [0.01, 0.015]],
    ),
    at_joints(
        "voluntary",
        MUSCLE,
        [[1.5, 3.0], [0.8, 1.5], [0.2, 0.4]],
        [[0.5, 0.8], [0.3, 0.45], [0.07, 0.12]],
    ),
    at_joints(
        "motor_inertia",
        SEGMENT,
        [[0.15, 0.3], [0.05, 0.1], [0.008, 0.016]],
        [[0.05, 0.08], [0.015, 0.025], [0.003, 0.005]],
    ),
    anywhere("added_mass", SEGMENT, [0.4, 0.8], [0.2, 0.3]),
    at_joints(
        "gravity_moment",
        SEGMENT,
        [[0.18, 0.26], [0.09, 0.13], [0.03, 0.04]],
        [[0.1, 0.14], [0.05, 0.07], [0.016, 0.022]],
    ),
    at_joints(
        "inertia",
        SEGMENT,
        [[0.15, 0.3], [0.05, 0.1], [0.008, 0.016]],
        [[0.05, 0.08], [0.015, 0.025], [0.003, 0.005]],
    ),
    at_joints(
        "segment_length",
        SEGMENT,
        [[0.012, 0.025]; 3],
        [[0.005, 0.008]; 3],
    ),
    anywhere("gravity_tilt", FRAME, [0.06, 0.12], [0.025, 0.04]),
    anywhere("shoulder_motion", FRAME, [0.006, 0.015], [0.002, 0.004]),
    anywhere("backlash", CONTACT, [0.0028, 0.0055], [0.0011, 0.0017]),
    anywhere(
        "contact_compliance",
        CONTACT,
        [7e-05, 0.00018],
        [2.6e-05, 4.4e-05],
    ),
    anywhere("contact_damping", CONTACT, [200.0, 400.0], [70.0, 120.0]),
    anywhere("robot_ripple", CONTACT, [0.0002, 0.0005], [6e-05, 0.0001]),
    anywhere("force_bias", FORCE, [3.0, 6.0], [1.4, 2.2]),
    anywhere("force_drift", FORCE, [0.08, 0.2], [0.03, 0.05]),
    anywhere("force_gain", FORCE, [0.2, 0.35], [0.11, 0.15]),
    anywhere("force_misalignment", FORCE, [0.042, 0.105], [0.016, 0.026]),
    at_joints(
        "angle_offset",
        ANGLE,
        [[0.08, 0.14]; 3],
        [[0.038, 0.058]; 3],
    ),
    anywhere("time_delay", TIME, [0.04, 0.08], [0.018, 0.027]),
];
