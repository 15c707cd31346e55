//! The path of the robot's handle over time.

use arm_core::{Chain, Plane, Robot, write_sines_and_cosines};

use crate::error::finite;
use crate::experiment::movement::Way;
use crate::{Interpolation, Jet, JointMotion, Movement, Series, SimulationError};

/// Motion of the handle at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Handle<T> {
    /// Position, y and z \[m\].
    pub position: Plane<T>,
    /// Velocity \[m/s\].
    pub velocity: Plane<T>,
    /// Acceleration \[m/s²\].
    pub acceleration: Plane<T>,
}

/// Motions of the handle at some times, each quantity by itself: written as vectors and read as numbers. Read in the other order, a
/// vector has to wait until all of its numbers have reached memory.
pub(crate) struct Handles<const P: usize>([[f64; P]; 6]);

impl<const P: usize> Handles<P> {
    /// The motion at one of the times.
    #[inline(always)]
    pub fn at(&self, time: usize) -> Handle<f64> {
        let plane = |axes: usize| [self.0[axes][time], self.0[axes + 1][time]];
        Handle {
            position: plane(0),
            velocity: plane(2),
            acceleration: plane(4),
        }
    }

    #[inline(always)]
    fn set(&mut self, time: usize, handle: &Handle<f64>) {
        let motion = [handle.position, handle.velocity, handle.acceleration];
        for (quantity, value) in self.0.iter_mut().zip(motion.as_flattened()) {
            quantity[time] = *value;
        }
    }
}

/// The commanded path of the robot's handle as a function of time.
///
/// How far the handle is from there ([`Displaced`](arm_core::Displaced)) comes on top of it when the experiment runs.
#[derive(Clone, Debug, PartialEq)]
pub struct HandlePath<const N: usize> {
    source: Source<N>,
}

#[derive(Clone, Debug, PartialEq)]
enum Source<const N: usize> {
    Fixed(Plane<f64>),
    Points(Series<2>),
    Arm(Chain<f64, N>, Movement<N>),
    Robot(Robot<f64>, Series<2>),
}

impl<const N: usize> HandlePath<N> {
    /// A handle that stays at a point \[m\].
    ///
    /// # Errors
    /// [`SimulationError::Setting`] for a coordinate that is not finite.
    pub fn fixed(point: Plane<f64>) -> Result<Self, SimulationError> {
        for found in point {
            finite("handle position", found, "a finite number of metres")?;
        }
        Ok(Self {
            source: Source::Fixed(point),
        })
    }

    /// A path through sampled handle positions \[s, m\], joined by a cubic spline.
    ///
    /// # Errors
    /// As [`Series::new`].
    pub fn through_points(times: &[f64], points: &[Plane<f64>]) -> Result<Self, SimulationError> {
        let series = Series::new("handle positions", times, points, Interpolation::Cubic)?;
        Ok(Self {
            source: Source::Points(series),
        })
    }

    /// The path on which the tip of the nominal arm goes in a desired movement: `T_A(q_d)` of thesis figure 3.13.
    ///
    /// * `nominal` - the arm for which the robot was programmed; the arm that is simulated may differ
    pub fn of_arm(nominal: Chain<f64, N>, movement: Movement<N>) -> Self {
        Self {
            source: Source::Arm(nominal, movement),
        }
    }

    /// The path of a robot's handle at sampled joint angles \[s, rad\], which are joined by a cubic spline.
    ///
    /// # Errors
    /// As [`Series::new`].
    pub fn of_robot(
        robot: Robot<f64>,
        times: &[f64],
        angles: &[[f64; 2]],
    ) -> Result<Self, SimulationError> {
        let series = Series::new("robot angles", times, angles, Interpolation::Cubic)?;
        Ok(Self {
            source: Source::Robot(robot, series),
        })
    }

    /// First and last time for which the path is known \[s\].
    pub fn span(&self) -> (f64, f64) {
        match &self.source {
            Source::Fixed(_) | Source::Arm(..) => (f64::NEG_INFINITY, f64::INFINITY),
            Source::Points(series) | Source::Robot(_, series) => (series.start(), series.end()),
        }
    }

    /// Times at which the path is not smooth \[s\].
    pub(crate) fn breaks(&self) -> Vec<f64> {
        match &self.source {
            Source::Fixed(_) => Vec::new(),
            Source::Arm(_, movement) => movement.breaks(),
            Source::Points(series) | Source::Robot(_, series) => series.times().to_vec(),
        }
    }

    /// The commanded motion of the handle at a time \[s\].
    #[inline]
    pub fn at(&self, time: f64) -> Handle<f64> {
        match &self.source {
            Source::Fixed(position) => Handle {
                position: *position,
                velocity: [0.0; 2],
                acceleration: [0.0; 2],
            },
            Source::Points(series) => {
                let jet = series.at(time);
                Handle {
                    position: jet.value,
                    velocity: jet.rate,
                    acceleration: jet.curvature,
                }
            }
            Source::Arm(..) => self.abreast(&[time]).at(0),
            Source::Robot(robot, series) => {
                let JointMotion { q, qd, qdd } = joints(series.at(time));
                Handle {
                    position: robot.handle(&q),
                    velocity: robot.handle_velocity(&q, &qd),
                    acceleration: robot.handle_acceleration(&q, &qd, &qdd),
                }
            }
        }
    }

    /// [`HandlePath::at`] for several increasing times at once; the same bits.
    #[inline(always)]
    pub(crate) fn abreast<const P: usize>(&self, times: &[f64; P]) -> Handles<P> {
        if let Source::Arm(arm, movement) = &self.source
            && let Some(way) = movement.way(times)
        {
            return tip_motion(arm, &way);
        }
        let mut handles = Handles([[0.0; P]; 6]);
        for (t, &time) in times.iter().enumerate() {
            handles.set(t, &self.at(time));
        }
        handles
    }

    /// Joint motion of the robot at a time: what it was given, or by inverse kinematics of `robot`.
    ///
    /// # Errors
    /// [`SimulationError::Unreachable`] with time and distance.
    pub fn robot_motion(
        &self,
        robot: &Robot<f64>,
        time: f64,
    ) -> Result<JointMotion<2>, SimulationError> {
        if let Source::Robot(own, series) = &self.source
            && own == robot
        {
            return Ok(joints(series.at(time)));
        }
        let handle = self.at(time);
        let q = robot.angles(handle.position).map_err(|e| match e {
            arm_core::Invalid::OutOfReach { distance, min, max } => SimulationError::Unreachable {
                time,
                distance,
                min,
                max,
            },
            other => other.into(),
        })?;
        let qd = robot.speeds(&q, handle.velocity);
        let qdd = robot.accelerations(&q, &qd, handle.acceleration);
        Ok(JointMotion { q, qd, qdd })
    }
}

fn joints(jet: Jet<2>) -> JointMotion<2> {
    JointMotion {
        q: jet.value.into(),
        qd: jet.rate.into(),
        qdd: jet.curvature.into(),
    }
}

/// Position, velocity and acceleration of an arm's tip at some times: the sums over its links, each for all times.
#[inline(always)]
fn tip_motion<const P: usize, const N: usize>(
    arm: &Chain<f64, N>,
    way: &Way<'_, P, N>,
) -> Handles<P> {
    let [mut angle, mut speed, mut acceleration, mut sin, mut cos] = [[0.0; P]; 5];
    let mut sums = [[0.0; P]; 6];
    let [y0, z0] = arm.base();
    (sums[0], sums[1]) = ([y0; P], [z0; P]);
    for (joint, segment) in arm.segments().iter().enumerate() {
        for t in 0..P {
            let [q, qd, qdd] = way.joint(joint, t);
            angle[t] += q;
            speed[t] += qd;
            acceleration[t] += qdd;
        }
        write_sines_and_cosines(&angle, [&mut sin, &mut cos]);
        for t in 0..P {
            let [y, z] = [segment.length * cos[t], segment.length * sin[t]];
            let inward = speed[t] * speed[t];
            sums[0][t] += y;
            sums[1][t] += z;
            sums[2][t] -= speed[t] * z;
            sums[3][t] += speed[t] * y;
            sums[4][t] -= acceleration[t] * z + inward * y;
            sums[5][t] += acceleration[t] * y - inward * z;
        }
    }
    Handles(sums)
}
