//! Documented sample arms for tests, benchmarks and examples.

use crate::{Chain, Orthosis, Segment};

const GRAVITY: [f64; 2] = [0.0, -9.81];

fn chain<const N: usize>(segments: [Segment<f64>; N]) -> Chain<f64, N> {
    Chain::assembled(segments, [0.0, 0.0], GRAVITY, [0.0; N])
}

const fn segment(length: f64, com: f64, mass: f64, inertia: f64) -> Segment<f64> {
    Segment {
        length,
        mass,
        com: [com, 0.0],
        inertia,
    }
}

/// The mechanical arm of table 4.3 (CAD). The thesis gives no moments of inertia: here those of uniform rods.
pub fn mechanical_arm() -> Chain<f64, 2> {
    chain([
        segment(0.376, 0.184, 1.440, 1.440 * 0.376 * 0.376 / 12.0),
        segment(0.239, 0.115, 1.160, 1.160 * 0.239 * 0.239 / 12.0),
    ])
}

/// The upper extremity of table 4.10. Moments of inertia are those about the axes of the joints after de Leva (1996) for 77 kg, the handle
/// counted as a point: table 1 of appendix D has those about the long axes.
pub fn human_arm() -> Chain<f64, 3> {
    chain([
        segment(0.322, 0.186, 2.114, 0.0157),
        segment(0.264, 0.121, 1.264, 0.0061),
        segment(0.093, 0.081, 0.753, 0.0016),
    ])
}

/// The elbow orthosis of the thesis (section 3.4.1).
pub const fn orthosis() -> Orthosis<f64> {
    Orthosis {
        upper_mass: 0.200,
        upper_from_elbow: 0.091,
        lower_mass: 0.191,
        lower_from_elbow: 0.066,
    }
}
