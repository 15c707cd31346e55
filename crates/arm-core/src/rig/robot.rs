//! The two-link robot that leads the hand.

use core::cell::Cell;

use nalgebra::SMatrix;

use crate::check::{finite, positive};
use crate::{Invalid, Joints, Plane, Scalar};

/// On which side of the straight line from base to handle the robot's elbow lies.
///
/// The line divides the plane: above it is where z is greater at the same y. On a vertical line the side is that of a
/// handle at slightly greater y. As a handle passes straight above or below the base the elbow therefore changes sides,
/// and the joint angles jump; anywhere else they are continuous.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Elbow {
    /// Above the line.
    Up,
    /// Below the line.
    Down,
}

/// A planar robot of two links; its handle is the end of the second.
///
/// Angles as those of the arm: the first from +y, the second relative to the first link, counter-clockwise positive.
/// A negative second angle is an elbow above the line for a handle at greater y than the base, and below it otherwise.
///
/// ```
/// use arm_core::{Elbow, Robot};
/// let robot = Robot::new([0.45, 0.45], [1.05, -0.10], Elbow::Up)?;
/// let q = robot.angles([0.5, 0.2])?;
/// let [y, z] = robot.handle(&q);
/// assert!(f64::abs(y - 0.5) < 1e-15 && f64::abs(z - 0.2) < 1e-15);
/// assert!(robot.angles([0.1, 0.2]).is_err());
/// # Ok::<(), arm_core::Invalid>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Robot<T> {
    lengths: [T; 2],
    base: Plane<T>,
    elbow: Elbow,
}

/// How far beyond its reach a point is still taken as reached, as a fraction of the reach: rounding of the point.
const REACH_ROUNDING: f64 = 1e-12;

impl<T: Scalar> Robot<T> {
    /// A robot from its two lengths and the position of its first joint \[m\].
    ///
    /// # Errors
    /// [`Invalid`] for a length that is not positive or a coordinate that is not finite.
    pub fn new(lengths: [T; 2], base: Plane<T>, elbow: Elbow) -> Result<Self, Invalid> {
        for (index, &length) in lengths.iter().enumerate() {
            positive("length of robot link", index, length)?;
        }
        for (index, &value) in base.iter().enumerate() {
            finite("robot base coordinate", index, value)?;
        }
        Ok(Self {
            lengths,
            base,
            elbow,
        })
    }

    /// Lengths of the links \[m\].
    pub fn lengths(&self) -> [T; 2] {
        self.lengths
    }
    /// Position of the first joint \[m\].
    pub fn base(&self) -> Plane<T> {
        self.base
    }
    /// Shortest and longest distance of the handle from the base \[m\].
    pub fn reach(&self) -> [T; 2] {
        let [a, b] = self.lengths;
        [(a - b).abs(), a + b]
    }

    /// Position of the handle at joint angles `q` \[m\].
    pub fn handle(&self, q: &Joints<T, 2>) -> Plane<T> {
        let [e1, e2] = directions(q);
        let [a, b] = self.lengths;
        [
            self.base[0] + a * e1[0] + b * e2[0],
            self.base[1] + a * e1[1] + b * e2[1],
        ]
    }

    /// Derivative of the handle position to the joint angles, rows y and z \[m/rad\].
    pub fn jacobian(&self, q: &Joints<T, 2>) -> SMatrix<T, 2, 2> {
        let [e1, e2] = directions(q);
        let [a, b] = self.lengths;
        let second = [-b * e2[1], b * e2[0]];
        SMatrix::<T, 2, 2>::new(
            second[0] - a * e1[1],
            second[0],
            second[1] + a * e1[0],
            second[1],
        )
    }

    /// Velocity of the handle at joint speeds `qd` \[m/s\]; equals `jacobian · qd`.
    pub fn handle_velocity(&self, q: &Joints<T, 2>, qd: &Joints<T, 2>) -> Plane<T> {
        let j = self.jacobian(q);
        [
            j[(0, 0)] * qd[0] + j[(0, 1)] * qd[1],
            j[(1, 0)] * qd[0] + j[(1, 1)] * qd[1],
        ]
    }

    /// Acceleration of the handle \[m/s²\].
    pub fn handle_acceleration(
        &self,
        q: &Joints<T, 2>,
        qd: &Joints<T, 2>,
        qdd: &Joints<T, 2>,
    ) -> Plane<T> {
        let turning = self.handle_velocity(q, qdd);
        let inward = self.centripetal(directions(q), qd);
        [turning[0] - inward[0], turning[1] - inward[1]]
    }

    /// Joint angles with the handle at a point and the elbow on its side \[rad\]; the inverse of [`Robot::handle`].
    ///
    /// By half angles, so that they are accurate up to full stretch, where the second angle is zero, and full fold, where
    /// it is ±π. With the handle on the base of a robot of equal lengths every first angle would do; one is returned.
    ///
    /// # Errors
    /// [`Invalid::OutOfReach`], and [`Invalid::NotFinite`] for a point that is none.
    pub fn angles(&self, handle: Plane<T>) -> Result<Joints<T, 2>, Invalid> {
        for (index, &value) in handle.iter().enumerate() {
            finite("handle coordinate", index, value)?;
        }
        let [y, z] = [handle[0] - self.base[0], handle[1] - self.base[1]];
        let distance = (y.squared() + z.squared()).sqrt();
        self.check_reach(distance)?;
        let [a, b] = self.lengths;
        let [shortest, longest] = self.reach();
        let sqrt = |x: T| x.max(T::ZERO).sqrt();
        let half_sine = sqrt((longest - distance) * (longest + distance));
        let half_cosine = sqrt((distance - shortest) * (distance + shortest));
        let bend = T::of(2.0) * half_sine.atan2(half_cosine);

        // Behind the base the direction is taken around π, so that it does not jump at the base's height.
        let behind = T::if_less(y, T::ZERO, T::ONE, T::ZERO);
        let ahead = T::ONE - behind - behind;
        let direction = behind * T::of(core::f64::consts::PI) + ahead * z.atan2(y.abs());
        let side = match self.elbow {
            Elbow::Up => -ahead,
            Elbow::Down => ahead,
        };
        let second = side * bend;
        let (sin, cos) = second.sin_cos();
        let first = direction - (b * sin).atan2(a + b * cos);
        Ok(Joints::<T, 2>::new(first, second))
    }

    /// Joint speeds that move the handle with `velocity` \[rad/s\].
    ///
    /// They grow as 1/sin of the second angle towards full stretch and full fold; there the handle cannot move along the
    /// links, and the result is not finite.
    pub fn speeds(&self, q: &Joints<T, 2>, velocity: Plane<T>) -> Joints<T, 2> {
        self.solve(directions(q), velocity)
    }

    /// Joint accelerations that accelerate the handle with `acceleration` at joint speeds `qd` \[rad/s²\].
    ///
    /// Not finite at full stretch and full fold, as [`Robot::speeds`].
    pub fn accelerations(
        &self,
        q: &Joints<T, 2>,
        qd: &Joints<T, 2>,
        acceleration: Plane<T>,
    ) -> Joints<T, 2> {
        let e = directions(q);
        let inward = self.centripetal(e, qd);
        self.solve(
            e,
            [acceleration[0] + inward[0], acceleration[1] + inward[1]],
        )
    }

    /// Acceleration towards the joints because the links turn.
    fn centripetal(&self, [e1, e2]: [Plane<T>; 2], qd: &Joints<T, 2>) -> Plane<T> {
        let near = self.lengths[0] * qd[0].squared();
        let far = self.lengths[1] * (qd[0] + qd[1]).squared();
        [near * e1[0] + far * e2[0], near * e1[1] + far * e2[1]]
    }

    /// Joint rates from `v = a ω₁ n₁ + b ω₂ n₂`: the product with one link's direction leaves the other link's rate.
    fn solve(&self, [e1, e2]: [Plane<T>; 2], v: Plane<T>) -> Joints<T, 2> {
        let sine = e1[0] * e2[1] - e1[1] * e2[0];
        let first = (v[0] * e2[0] + v[1] * e2[1]) / (self.lengths[0] * sine);
        let second = -(v[0] * e1[0] + v[1] * e1[1]) / (self.lengths[1] * sine);
        Joints::<T, 2>::new(first, second - first)
    }

    fn check_reach(&self, distance: T) -> Result<(), Invalid> {
        let [shortest, longest] = self.reach();
        let outside = (distance - longest).max(shortest - distance);
        let allowed = longest * T::of(REACH_ROUNDING);
        // Lanes within reach are marked by a distance that none has.
        let beyond = T::if_less(allowed, outside, distance, -T::ONE);
        let found = Cell::new(0.0);
        let within = beyond.every(|d| {
            found.set(d);
            d < 0.0
        });
        if within {
            return Ok(());
        }
        let value = |x: T| {
            let cell = Cell::new(0.0);
            let _ = x.every(|v| {
                cell.set(v);
                false
            });
            cell.get()
        };
        Err(Invalid::OutOfReach {
            distance: found.get(),
            min: value(shortest),
            max: value(longest),
        })
    }
}

/// Unit vectors along the two links.
fn directions<T: Scalar>(q: &Joints<T, 2>) -> [Plane<T>; 2] {
    let (s1, c1) = q[0].sin_cos();
    let (s12, c12) = (q[0] + q[1]).sin_cos();
    [[c1, s1], [c12, s12]]
}
