//! Composition of rigid bodies in the plane of a segment.

use crate::{Plane, Scalar, Segment};

/// A rigid body in the frame of a segment: origin at the proximal joint, first axis along the segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body<T> {
    /// Mass \[kg\].
    pub mass: T,
    /// Centre of mass: along the segment, and normal to it (counter-clockwise) \[m\].
    pub com: Plane<T>,
    /// Moment of inertia about its centre of mass \[kg m²\].
    pub inertia: T,
}

impl<T: Scalar> Body<T> {
    /// A mass on the axis of the segment, `at` from its proximal joint.
    pub fn point(mass: T, at: T) -> Self {
        Self {
            mass,
            com: [at, T::ZERO],
            inertia: T::ZERO,
        }
    }

    /// The body of a segment.
    pub fn of(segment: &Segment<T>) -> Self {
        Self {
            mass: segment.mass,
            com: segment.com,
            inertia: segment.inertia,
        }
    }

    /// A segment with this body.
    pub fn segment(&self, length: T) -> Segment<T> {
        Segment {
            length,
            mass: self.mass,
            com: self.com,
            inertia: self.inertia,
        }
    }

    /// Both bodies, firmly joined (thesis 3.14, with its inertia).
    ///
    /// The inertia is `I₁ + I₂ + m₁ m₂/(m₁+m₂) d²` with the distance d of the two centres of mass, which is the
    /// parallel-axis theorem. A body without mass at both sides stays as it is.
    pub fn with(&self, other: &Self) -> Self {
        let mass = self.mass + other.mass;
        // The share of the other body, so that nothing added is nothing changed, bit for bit.
        let share = T::if_less(T::ZERO, mass, other.mass / mass, T::ZERO);
        let apart = [other.com[0] - self.com[0], other.com[1] - self.com[1]];
        Self {
            mass,
            com: [
                self.com[0] + share * apart[0],
                self.com[1] + share * apart[1],
            ],
            inertia: self.inertia
                + other.inertia
                + self.mass * share * (apart[0].squared() + apart[1].squared()),
        }
    }
}

/// An elbow orthosis: one part strapped to the upper arm, the other to the forearm.
///
/// Both centres of mass are measured from the elbow, as the thesis does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orthosis<T> {
    /// Mass of the part on the upper arm \[kg\].
    pub upper_mass: T,
    /// Its centre of mass, proximal of the elbow \[m\].
    pub upper_from_elbow: T,
    /// Mass of the part on the forearm \[kg\].
    pub lower_mass: T,
    /// Its centre of mass, distal of the elbow \[m\].
    pub lower_from_elbow: T,
}

impl<T: Scalar> Orthosis<T> {
    /// Upper arm and forearm with the orthosis on (thesis 3.20, corrected).
    ///
    /// The printed `l_1 = a_1 − (l_ua m_ua + l_uo m_uo)/m_1` holds only when both are measured from the elbow; the
    /// upper arm's own centre of mass is given from the shoulder, so that here `l_1 = (l_ua m_ua + (a_1 − l_uo) m_uo)/m_1`.
    pub fn on(&self, upper_arm: &Segment<T>, forearm: &Segment<T>) -> [Segment<T>; 2] {
        let upper = Body::point(self.upper_mass, upper_arm.length - self.upper_from_elbow);
        let lower = Body::point(self.lower_mass, self.lower_from_elbow);
        [
            Body::of(upper_arm).with(&upper).segment(upper_arm.length),
            Body::of(forearm).with(&lower).segment(forearm.length),
        ]
    }
}
