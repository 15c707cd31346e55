//! The desired movement of the arm's joints.

use arm_core::{Joints, Limits, Profile, Shape};

use crate::SimulationError;

/// Joints led together on straight lines through waypoints, at rest in each: `q_d` of thesis figure 3.13.
///
/// Before its start it rests in the first waypoint, after its end in the last.
#[derive(Clone, Debug, PartialEq)]
pub struct Movement<const N: usize> {
    waypoints: Vec<Joints<f64, N>>,
    /// The way from waypoint i to i+1: when it starts, and how it passes as a fraction.
    parts: Vec<(f64, Profile<f64>)>,
    end: f64,
}

/// Angles, speeds and accelerations of the joints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointMotion<const N: usize> {
    /// Angles \[rad\].
    pub q: Joints<f64, N>,
    /// Speeds \[rad/s\].
    pub qd: Joints<f64, N>,
    /// Accelerations \[rad/s²\].
    pub qdd: Joints<f64, N>,
}

impl<const N: usize> Movement<N> {
    /// As quick as the limits of each joint allow.
    ///
    /// * `pause` - time at rest in each waypoint on the way \[s\]
    ///
    /// # Errors
    /// [`SimulationError`] for fewer than two waypoints, or values that are not finite or out of range.
    pub fn within(
        shape: Shape,
        waypoints: &[Joints<f64, N>],
        limits: &[Limits<f64>; N],
        pause: f64,
    ) -> Result<Self, SimulationError> {
        Self::build(waypoints, pause, |_, from, to| {
            let mut whole = Limits {
                speed: f64::INFINITY,
                acceleration: f64::INFINITY,
            };
            for i in 0..N {
                let way = (to[i] - from[i]).abs();
                if way > 0.0 {
                    whole.speed = whole.speed.min(limits[i].speed / way);
                    whole.acceleration = whole.acceleration.min(limits[i].acceleration / way);
                }
            }
            if whole.speed.is_infinite() {
                return Ok(None);
            }
            Ok(Some(Profile::new(shape, 1.0, whole)?))
        })
    }

    /// With a given duration of each part and a given length of its ramps.
    ///
    /// * `durations` - one for each part, one less than waypoints \[s\]
    /// * `ramp` - of each part's duration, up to one half
    ///
    /// # Errors
    /// [`SimulationError`] as for [`Movement::within`], or for a wrong number of durations.
    pub fn timed(
        shape: Shape,
        waypoints: &[Joints<f64, N>],
        durations: &[f64],
        ramp: f64,
    ) -> Result<Self, SimulationError> {
        if durations.len() + 1 != waypoints.len() {
            return Err(SimulationError::Samples {
                name: "waypoints",
                sample: waypoints.len().min(durations.len() + 1),
                problem: "one duration is needed for each pair of waypoints",
            });
        }
        Self::build(waypoints, 0.0, |i, _, _| {
            let duration = durations[i];
            Ok(Some(Profile::timed(shape, 1.0, duration, ramp * duration)?))
        })
    }

    fn build(
        waypoints: &[Joints<f64, N>],
        pause: f64,
        part: impl Fn(
            usize,
            &Joints<f64, N>,
            &Joints<f64, N>,
        ) -> Result<Option<Profile<f64>>, SimulationError>,
    ) -> Result<Self, SimulationError> {
        if waypoints.len() < 2 {
            return Err(SimulationError::Samples {
                name: "waypoints",
                sample: waypoints.len(),
                problem: "at least two are needed",
            });
        }
        if !(pause >= 0.0 && pause.is_finite()) {
            return Err(SimulationError::Setting {
                name: "pause",
                found: pause,
                allowed: "zero or more seconds",
            });
        }
        for (i, waypoint) in waypoints.iter().enumerate() {
            if waypoint.iter().any(|q| !q.is_finite()) {
                return Err(SimulationError::Samples {
                    name: "waypoints",
                    sample: i + 1,
                    problem: "not finite",
                });
            }
        }
        let mut kept = vec![waypoints[0]];
        let (mut parts, mut start, mut end) = (Vec::new(), 0.0, 0.0);
        for (i, pair) in waypoints.windows(2).enumerate() {
            if let Some(profile) = part(i, &pair[0], &pair[1])? {
                parts.push((start, profile));
                kept.push(pair[1]);
                end = start + profile.duration();
                start = end + pause;
            } else {
                start += pause;
            }
        }
        Ok(Self {
            waypoints: kept,
            parts,
            end,
        })
    }

    /// Time from the first to the last waypoint \[s\].
    pub fn duration(&self) -> f64 {
        self.end
    }

    /// Times at which a ramp starts or ends, and acceleration or jerk jumps \[s\].
    pub(crate) fn breaks(&self) -> Vec<f64> {
        let of_part = |(start, profile): &(f64, Profile<f64>)| {
            let (ramp, end) = (profile.ramp(), profile.duration());
            [0.0, ramp, end - ramp, end].map(|time| start + time)
        };
        self.parts.iter().flat_map(of_part).collect()
    }

    /// The motion at a time \[s\].
    #[inline]
    pub fn at(&self, time: f64) -> JointMotion<N> {
        let mut motion = JointMotion {
            q: self.waypoints[0],
            qd: Joints::zeros(),
            qdd: Joints::zeros(),
        };
        if let Some(way) = self.way(&[time]) {
            for i in 0..N {
                [motion.q[i], motion.qd[i], motion.qdd[i]] = way.joint(i, 0);
            }
        }
        motion
    }

    /// How far on which way it is at increasing times \[s\], where all of them are on the same one, as a single time is.
    #[inline(always)]
    pub(crate) fn way<const P: usize>(&self, times: &[f64; P]) -> Option<Way<'_, P, N>> {
        // Before the first part it is at that part's start.
        let begun = |time: f64| {
            self.parts
                .partition_point(|(start, _)| *start <= time)
                .max(1)
        };
        let to = begun(times[0]);
        if begun(times[P - 1]) != to {
            return None;
        }
        let mut way = Way {
            fraction: [[0.0; P]; 3],
            from: &self.waypoints[to - 1],
            to: self.waypoints.get(to).unwrap_or(&self.waypoints[0]),
        };
        if let Some((start, profile)) = self.parts.get(to - 1) {
            let [position, velocity, acceleration] = &mut way.fraction;
            for i in 0..P {
                let s = profile.at(times[i] - start);
                position[i] = s.position;
                velocity[i] = s.velocity;
                acceleration[i] = s.acceleration;
            }
        }
        Some(way)
    }
}

/// A way from one waypoint to the next at some times.
pub(crate) struct Way<'a, const P: usize, const N: usize> {
    /// The fraction of it that is behind, and its derivatives.
    fraction: [[f64; P]; 3],
    from: &'a Joints<f64, N>,
    to: &'a Joints<f64, N>,
}

impl<const P: usize, const N: usize> Way<'_, P, N> {
    /// Angle, speed and acceleration of a joint at one of the times.
    #[inline(always)]
    pub fn joint(&self, joint: usize, time: usize) -> [f64; 3] {
        let [position, velocity, acceleration] = self.fraction.each_ref().map(|of| of[time]);
        let (from, to) = (self.from[joint], self.to[joint]);
        let way = to - from;
        // A weighted mean: exact in both waypoints.
        [
            (1.0 - position) * from + position * to,
            velocity * way,
            acceleration * way,
        ]
    }
}
