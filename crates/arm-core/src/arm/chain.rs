//! The arm as a rigid serial chain in a vertical plane.

use core::array::from_fn;

use crate::check::{at_least_zero, finite, positive};
use crate::{Invalid, Lanes, Plane, Scalar};

/// One rigid segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment<T> {
    /// Distance from the proximal to the distal joint \[m\].
    pub length: T,
    /// Mass \[kg\].
    pub mass: T,
    /// Centre of mass from the proximal joint: along the segment, and normal to it (counter-clockwise) \[m\].
    pub com: Plane<T>,
    /// Moment of inertia about the centre of mass \[kg m²\].
    pub inertia: T,
}

/// The parameters of an arm; never changed by an algorithm.
///
/// Besides the segments it holds what the dynamics need of them, the base parameters in link form:
/// `X_j = m_j c_xj + a_j Σ_{k>j} m_k`, `H_j = m_j c_yj`, `J_j = I_j + m_j |c_j|² + a_j² Σ_{k>j} m_k`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chain<T, const N: usize> {
    pub(crate) segments: [Segment<T>; N],
    pub(crate) base: Plane<T>,
    pub(crate) gravity: Plane<T>,
    pub(crate) rotor: [T; N],
    pub(crate) x: [T; N],
    pub(crate) h: [T; N],
    pub(crate) j: [T; N],
}

impl<T: Scalar, const N: usize> Chain<T, N> {
    /// An arm from its segments, proximal first.
    ///
    /// * `base` - the first joint \[m\]
    /// * `gravity` - acceleration of gravity as a vector, usually `[0, −9.81]` \[m/s²\]
    ///
    /// # Errors
    /// [`Invalid`] names the first value that is not finite, a length or mass that is not positive, or a negative inertia.
    pub fn new(
        segments: [Segment<T>; N],
        base: Plane<T>,
        gravity: Plane<T>,
    ) -> Result<Self, Invalid> {
        for (index, s) in segments.iter().enumerate() {
            positive("length of segment", index, s.length)?;
            positive("mass of segment", index, s.mass)?;
            at_least_zero("inertia of segment", index, s.inertia)?;
            finite("centre of mass of segment", index, s.com[0])?;
            finite("centre of mass of segment", index, s.com[1])?;
        }
        for (index, value) in base.iter().enumerate() {
            finite("base coordinate", index, *value)?;
        }
        for (index, value) in gravity.iter().enumerate() {
            finite("gravity component", index, *value)?;
        }
        Ok(Self::assembled(segments, base, gravity, [T::ZERO; N]))
    }

    /// The same arm with the inertia of a drive's rotor on each joint, as seen at the joint \[kg m²\].
    ///
    /// # Errors
    /// [`Invalid`] for an inertia that is negative or not finite.
    pub fn with_rotor_inertia(self, rotor: [T; N]) -> Result<Self, Invalid> {
        for (index, value) in rotor.iter().enumerate() {
            at_least_zero("rotor inertia of joint", index, *value)?;
        }
        Ok(Self { rotor, ..self })
    }

    /// The same arm under another acceleration of gravity \[m/s²\]: on a base that accelerates by a, it is g − a.
    pub fn with_gravity(self, gravity: Plane<T>) -> Self {
        Self { gravity, ..self }
    }

    /// The same arm in another number: single precision, or the same in every lane.
    pub fn cast<S: Scalar>(&self) -> Chain<S, N>
    where
        T: Into<f64>,
    {
        let of = |value: T| S::of(value.into());
        let segments = self.segments.map(|s| Segment {
            length: of(s.length),
            mass: of(s.mass),
            com: s.com.map(of),
            inertia: of(s.inertia),
        });
        Chain::assembled(
            segments,
            self.base.map(of),
            self.gravity.map(of),
            self.rotor.map(of),
        )
    }

    pub(crate) fn assembled(
        segments: [Segment<T>; N],
        base: Plane<T>,
        gravity: Plane<T>,
        rotor: [T; N],
    ) -> Self {
        let distal_mass: [T; N] = from_fn(|i| {
            segments[i + 1..]
                .iter()
                .fold(T::ZERO, |sum, s| sum + s.mass)
        });
        Self {
            x: from_fn(|i| {
                segments[i].mass * segments[i].com[0] + segments[i].length * distal_mass[i]
            }),
            h: from_fn(|i| segments[i].mass * segments[i].com[1]),
            j: from_fn(|i| {
                let s = &segments[i];
                s.inertia
                    + s.mass * (s.com[0].squared() + s.com[1].squared())
                    + s.length.squared() * distal_mass[i]
            }),
            segments,
            base,
            gravity,
            rotor,
        }
    }

    /// The segments, proximal first.
    pub fn segments(&self) -> &[Segment<T>; N] {
        &self.segments
    }
    /// Position of the first joint \[m\].
    pub fn base(&self) -> Plane<T> {
        self.base
    }
    /// Acceleration of gravity \[m/s²\].
    pub fn gravity(&self) -> Plane<T> {
        self.gravity
    }
    /// Rotor inertia at each joint \[kg m²\].
    pub fn rotor_inertia(&self) -> &[T; N] {
        &self.rotor
    }
    /// First moments along the links, `X_j` \[kg m\].
    pub fn first_moments(&self) -> &[T; N] {
        &self.x
    }
    /// First moments normal to the links, `H_j` \[kg m\].
    pub fn normal_moments(&self) -> &[T; N] {
        &self.h
    }
    /// Second moments about the proximal joints, `J_j` \[kg m²\].
    pub fn second_moments(&self) -> &[T; N] {
        &self.j
    }
}

impl<const L: usize, const N: usize> Chain<Lanes<L>, N> {
    /// The arm of one lane.
    #[inline(always)]
    pub fn lane(&self, lane: usize) -> Chain<f64, N> {
        let of = |value: &Lanes<L>| value.0[lane];
        let plane = |value: &Plane<Lanes<L>>| [of(&value[0]), of(&value[1])];
        Chain {
            segments: from_fn(|i| Segment {
                length: of(&self.segments[i].length),
                mass: of(&self.segments[i].mass),
                com: plane(&self.segments[i].com),
                inertia: of(&self.segments[i].inertia),
            }),
            base: plane(&self.base),
            gravity: plane(&self.gravity),
            rotor: from_fn(|i| of(&self.rotor[i])),
            x: from_fn(|i| of(&self.x[i])),
            h: from_fn(|i| of(&self.h[i])),
            j: from_fn(|i| of(&self.j[i])),
        }
    }
}
