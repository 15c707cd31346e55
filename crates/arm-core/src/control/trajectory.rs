//! Motion from rest to rest: profiles of speed, and joints led together through waypoints.

use crate::check::{at_least_zero, finite, positive};
use crate::effect::Motion;
use crate::numeric::scalar::Real;
use crate::{Invalid, Joints, Scalar};

/// What a motion must not exceed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits<T> {
    /// Speed \[rad/s or m/s\].
    pub speed: T,
    /// Acceleration, the same for speeding up and slowing down \[rad/s² or m/s²\].
    pub acceleration: T,
}

impl<T: Scalar> Limits<T> {
    fn validate(&self, index: usize) -> Result<(), Invalid> {
        positive("speed limit", index, self.speed)?;
        positive("acceleration limit", index, self.acceleration)
    }
}

/// How the speed rises from zero to its peak; it falls in the same way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// Straight: constant acceleration, which jumps at both ends (the trapezoidal profile of the thesis, section 4.3).
    Trapezoid,
    /// As 3τ² − 2τ³: continuous acceleration, zero at both ends. The ramp is half as long again for the same limit.
    Smooth,
}

impl Shape {
    /// Peak acceleration in a ramp, of that of a straight one.
    fn steepness(self) -> f64 {
        match self {
            Self::Trapezoid => 1.0,
            Self::Smooth => 1.5,
        }
    }

    /// Position, speed and acceleration in a ramp of unit length and unit rise.
    #[inline]
    fn ramp<T: Scalar>(self, x: T) -> [T; 3] {
        let half = T::of(0.5);
        match self {
            Self::Trapezoid => [half * x.squared(), x, T::ONE],
            Self::Smooth => {
                let square = x.squared();
                [
                    square * x * (T::ONE - half * x),
                    square * (T::of(3.0) - x - x),
                    T::of(6.0) * x * (T::ONE - x),
                ]
            }
        }
    }
}

/// Position, velocity and acceleration along a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample<T> {
    /// Position \[rad or m\].
    pub position: T,
    /// Its time derivative.
    pub velocity: T,
    /// Its second time derivative.
    pub acceleration: T,
}

/// Motion over a distance from rest to rest, symmetric in time: it speeds up, cruises and slows down.
///
/// Where the distance is too short to reach the limit of speed there is no cruise (the triangular case).
///
/// ```
/// use arm_core::{Limits, Profile, Shape};
/// let limits = Limits { speed: 2.0, acceleration: 4.0 };
/// let profile = Profile::new(Shape::Trapezoid, 3.0, limits)?;
/// assert_eq!(profile.duration(), 2.0); // 0.5 s up, 1 s at 2 m/s, 0.5 s down
/// assert_eq!(profile.at(1.0).velocity, 2.0);
/// assert_eq!(profile.at(2.0).position, 3.0);
/// # Ok::<(), arm_core::Invalid>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Profile<T> {
    shape: Shape,
    distance: T,
    /// Peak speed, as a fraction of the distance \[1/s\].
    peak: T,
    ramp: T,
    /// One over the length of the ramp, zero where there is none.
    ramp_rate: T,
    duration: T,
}

impl<T: Scalar> Profile<T> {
    /// The quickest profile of a shape within limits; `distance` may be negative or zero.
    ///
    /// # Errors
    /// [`Invalid`] for a limit that is not positive or a distance that is not finite.
    pub fn new(shape: Shape, distance: T, limits: Limits<T>) -> Result<Self, Invalid> {
        finite("distance", 0, distance)?;
        limits.validate(0)?;
        let by_speed = distance.abs() / limits.speed;
        let by_acceleration = distance.abs() / limits.acceleration;
        Ok(Self::quickest(shape, distance, by_speed, by_acceleration))
    }

    /// The profile of a shape with a given duration and a given length of each ramp \[s\].
    ///
    /// # Errors
    /// [`Invalid`] for times that are not positive, and ramps that are together longer than the duration.
    pub fn timed(shape: Shape, distance: T, duration: T, ramp: T) -> Result<Self, Invalid> {
        finite("distance", 0, distance)?;
        positive("duration of motion", 0, duration)?;
        positive("duration of ramp", 0, ramp)?;
        at_least_zero("duration of cruise", 0, duration - ramp - ramp)?;
        Ok(Self {
            shape,
            distance,
            peak: T::ONE / (duration - ramp),
            ramp,
            ramp_rate: T::ONE / ramp,
            duration,
        })
    }

    /// From the time over the distance at the limit of speed \[s\], and distance over the limit of acceleration \[s²\].
    fn quickest(shape: Shape, distance: T, by_speed: T, by_acceleration: T) -> Self {
        let weighted = T::of(shape.steepness()) * by_acceleration;
        // Time over the distance at the peak speed: in the triangular case the ramps meet.
        let slowness = by_speed.max(weighted.sqrt());
        let peak = T::if_less(T::ZERO, slowness, T::ONE / slowness, T::ZERO);
        let ramp = weighted * peak;
        Self {
            shape,
            distance,
            peak,
            ramp,
            ramp_rate: T::if_less(T::ZERO, ramp, T::ONE / ramp, T::ZERO),
            duration: slowness + ramp,
        }
    }

    /// Time from rest to rest \[s\].
    pub fn duration(&self) -> T {
        self.duration
    }
    /// Time of speeding up, and of slowing down \[s\].
    pub fn ramp(&self) -> T {
        self.ramp
    }
    /// Position at the end.
    pub fn distance(&self) -> T {
        self.distance
    }

    /// The motion at a time \[s\]; at rest before zero and after the end.
    #[inline]
    pub fn at(&self, time: T) -> Sample<T> {
        let s = self.fraction(time);
        // Counted from the nearer end, so that both ends are exact.
        let near = self.distance * s.near;
        Sample {
            position: T::if_less(T::ZERO, s.late, self.distance - near, near),
            velocity: self.distance * s.rate,
            acceleration: self.distance * s.rate_of_rate,
        }
    }

    #[inline]
    fn fraction(&self, time: T) -> Fraction<T> {
        let to_end = self.duration - time;
        let nearer = time.min(to_end);
        let inside = nearer.max(T::ZERO);
        let [position, speed, slope] = self.shape.ramp((inside * self.ramp_rate).min(T::ONE));
        let cruised = (inside - self.ramp).max(T::ZERO);
        let steepness = self.peak * self.ramp_rate * slope;
        let signed = T::if_less(to_end, time, -steepness, steepness);
        let ramping = T::if_less(inside, self.ramp, signed, T::ZERO);
        Fraction {
            late: T::if_less(to_end, time, T::ONE, T::ZERO),
            near: self.peak * (self.ramp * position + cruised),
            rate: self.peak * speed,
            rate_of_rate: T::if_less(nearer, T::ZERO, T::ZERO, ramping),
        }
    }
}

/// Where a profile of unit distance is.
struct Fraction<T> {
    /// One in the second half, zero in the first.
    late: T,
    /// Distance from the nearer end.
    near: T,
    rate: T,
    rate_of_rate: T,
}

/// Joints led together on straight lines through waypoints, at rest in each of them.
///
/// In each part all joints start and end together and move in proportion; the slowest one for its limits sets the pace.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Path<'a, T, const N: usize> {
    waypoints: &'a [Joints<T, N>],
    limits: [Limits<T>; N],
    shape: Shape,
    pause: T,
}

impl<'a, T: Scalar, const N: usize> Path<'a, T, N> {
    /// A path through waypoints \[rad\].
    ///
    /// * `limits` - of each joint
    /// * `pause` - time at rest in each waypoint but the first and the last \[s\]
    ///
    /// # Errors
    /// [`Invalid`] without a waypoint, for one that is not finite, for limits that are not positive, for a negative pause.
    pub fn new(
        shape: Shape,
        waypoints: &'a [Joints<T, N>],
        limits: [Limits<T>; N],
        pause: T,
    ) -> Result<Self, Invalid> {
        if waypoints.is_empty() {
            return Err(Invalid::OutOfRange {
                name: "number of waypoints",
                index: 0,
                found: 0.0,
                min: 1.0,
                max: f64::INFINITY,
            });
        }
        for (index, waypoint) in waypoints.iter().enumerate() {
            for &angle in waypoint.iter() {
                finite("waypoint", index, angle)?;
            }
        }
        for (index, limit) in limits.iter().enumerate() {
            limit.validate(index)?;
        }
        at_least_zero("pause", 0, pause)?;
        Ok(Self {
            waypoints,
            limits,
            shape,
            pause,
        })
    }

    /// The profile from one waypoint to the next, as a fraction of the way.
    fn part(&self, from: &Joints<T, N>, to: &Joints<T, N>) -> Profile<T> {
        let (mut by_speed, mut by_acceleration) = (T::ZERO, T::ZERO);
        for i in 0..N {
            let way = (to[i] - from[i]).abs();
            by_speed = by_speed.max(way / self.limits[i].speed);
            by_acceleration = by_acceleration.max(way / self.limits[i].acceleration);
        }
        Profile::quickest(self.shape, T::ONE, by_speed, by_acceleration)
    }

    /// The parts with the time at which each starts.
    fn parts(&self) -> impl Iterator<Item = (T, Profile<T>, [&'a Joints<T, N>; 2])> {
        let mut start = T::ZERO;
        self.waypoints.windows(2).map(move |pair| {
            let [from, to] = [&pair[0], &pair[1]];
            let part = self.part(from, to);
            let this = start;
            start += part.duration() + self.pause;
            (this, part, [from, to])
        })
    }

    /// Time from the first to the last waypoint \[s\].
    pub fn duration(&self) -> T {
        self.parts()
            .last()
            .map_or(T::ZERO, |(start, part, _)| start + part.duration())
    }

    /// The motion at a time \[s\]; at rest in the first waypoint before zero, and in the last after the end.
    pub fn at(&self, time: T) -> Motion<T, N> {
        let rest = Joints::<T, N>::repeat(T::ZERO);
        let first = self.waypoints.first().copied().unwrap_or(rest);
        let mut motion = Motion::new(time, first, rest);
        for (start, part, ends) in self.parts() {
            let here = along(time, time - start, &part, ends);
            for i in 0..N {
                let choose = |then: T, otherwise: T| T::if_less(time, start, otherwise, then);
                motion.q[i] = choose(here.q[i], motion.q[i]);
                motion.qd[i] = choose(here.qd[i], motion.qd[i]);
                motion.qdd[i] = choose(here.qdd[i], motion.qdd[i]);
            }
        }
        motion
    }
}

/// The motion on the way from one waypoint to the next, `since` its start.
#[inline]
fn along<T: Scalar, const N: usize>(
    time: T,
    since: T,
    part: &Profile<T>,
    [from, to]: [&Joints<T, N>; 2],
) -> Motion<T, N> {
    let s = part.at(since);
    // A weighted mean: exact in both waypoints.
    let left = T::ONE - s.position;
    let mut motion = Motion::new(time, *from, *from);
    for i in 0..N {
        let way = to[i] - from[i];
        motion.q[i] = left * from[i] + s.position * to[i];
        motion.qd[i] = s.velocity * way;
        motion.qdd[i] = s.acceleration * way;
    }
    motion
}

/// A [`Path`] of at most `W` waypoints that is kept with all that was computed of it; the motion has the same bits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Route<T, const N: usize, const W: usize> {
    waypoints: [Joints<T, N>; W],
    /// From each waypoint but the last to the next: when it starts, and how it passes.
    parts: [(T, Profile<T>); W],
    count: usize,
}

impl<T: Real, const N: usize, const W: usize> Route<T, N, W> {
    /// A route along a path.
    ///
    /// # Errors
    /// [`Invalid`] for more than `W` waypoints.
    pub fn new(path: &Path<'_, T, N>) -> Result<Self, Invalid> {
        let (given, first) = (path.waypoints.len(), path.waypoints.first());
        let first = first.copied().filter(|_| given <= W);
        let Some(first) = first else {
            return Err(Invalid::OutOfRange {
                name: "number of waypoints",
                index: 0,
                found: given as f64,
                min: 1.0,
                max: W as f64,
            });
        };
        let rest = Profile::quickest(path.shape, T::ZERO, T::ZERO, T::ZERO);
        let mut route = Self {
            waypoints: [first; W],
            parts: [(T::ZERO, rest); W],
            count: given - 1,
        };
        for (place, waypoint) in route.waypoints.iter_mut().zip(path.waypoints) {
            *place = *waypoint;
        }
        for (place, (start, part, _)) in route.parts.iter_mut().zip(path.parts()) {
            *place = (start, part);
        }
        Ok(route)
    }

    fn legs(&self) -> impl Iterator<Item = (&(T, Profile<T>), [&Joints<T, N>; 2])> {
        let next = self.waypoints.iter().skip(1);
        let ends = self.waypoints.iter().zip(next).map(|(a, b)| [a, b]);
        self.parts.iter().take(self.count).zip(ends)
    }

    /// Time from the first to the last waypoint \[s\].
    pub fn duration(&self) -> T {
        let last = self.legs().last();
        last.map_or(T::ZERO, |((start, part), _)| *start + part.duration())
    }

    /// The motion at a time \[s\], as of [`Path::at`].
    pub fn at(&self, time: T) -> Motion<T, N> {
        let rest = Joints::<T, N>::repeat(T::ZERO);
        let begun = self
            .legs()
            .take_while(|((start, _), _)| *start <= time)
            .last();
        match begun {
            Some(((start, part), ends)) => along(time, time - *start, part, ends),
            None => {
                let first = self.waypoints.first().copied().unwrap_or(rest);
                Motion::new(time, first, rest)
            }
        }
    }
}
