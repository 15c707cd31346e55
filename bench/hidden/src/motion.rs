//! What the robot is told to do, and what it does.

use crate::random::Random;
use crate::rig::{Plane, Rig};

/// A movement of the arm's joints as it is wanted.
#[derive(Clone, Debug, PartialEq)]
pub struct Movement {
    /// Name of the configuration.
    pub name: String,
    /// \[s\], a whole number of samples.
    pub duration: f64,
    /// Joint angles where it starts \[rad\].
    pub from: Vec<f64>,
    course: Course,
}

#[derive(Clone, Debug, PartialEq)]
enum Course {
    Legs(Vec<Leg>),
    /// For each joint amplitude \[rad\], frequency \[Hz\] and phase \[rad\] of two waves.
    Waves(Vec<[[f64; 3]; 2]>),
}

#[derive(Clone, Debug, PartialEq)]
struct Leg {
    start: f64,
    duration: f64,
    from: Vec<f64>,
    to: Vec<f64>,
    profile: Profile,
}

/// How a leg gains and loses speed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Profile {
    /// Least jerk: the quintic of Flash and Hogan 1985.
    LeastJerk,
    /// Constant speed with ramps at both ends, each an eighth of the time.
    Trapezoid,
}

impl Profile {
    /// Part of the way after a part of the time, both from 0 to 1.
    fn way(self, s: f64) -> f64 {
        let s = s.clamp(0.0, 1.0);
        match self {
            Self::LeastJerk => s * s * s * (10.0 + s * (6.0 * s - 15.0)),
            Self::Trapezoid => {
                let (ramp, speed) = (RAMP, 1.0 / (1.0 - RAMP));
                if s < ramp {
                    0.5 * speed * s * s / ramp
                } else if s <= 1.0 - ramp {
                    speed * (s - 0.5 * ramp)
                } else {
                    1.0 - 0.5 * speed * (1.0 - s) * (1.0 - s) / ramp
                }
            }
        }
    }

    /// Largest speed in units of the mean.
    fn peak(self) -> f64 {
        match self {
            Self::LeastJerk => 1.875,
            Self::Trapezoid => 1.0 / (1.0 - RAMP),
        }
    }
}

/// Part of a trapezoid's time in which it gains speed.
const RAMP: f64 = 0.125;
/// Rest before and after a movement \[s\].
const REST: f64 = 0.6;
/// Samples a second of every trial \[Hz\].
pub const RATE: f64 = 50.0;

/// Steps of the world in a second \[Hz\], a whole number of them a sample.
pub const STEPS: f64 = 2000.0;

/// How a closed course of waypoints is run through.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pace {
    /// Largest joint speed \[rad/s\].
    pub speed: f64,
    /// Rest in every waypoint \[s\].
    pub pause: f64,
    /// How speed is gained and lost.
    pub profile: Profile,
    /// About how long \[s\].
    pub duration: f64,
}

impl Movement {
    /// Through waypoints (displacements from `from`, the last of them zero), again and again while there is time.
    pub fn legs(name: &str, from: &[f64], waypoints: &[Vec<f64>], pace: &Pace) -> Self {
        let (mut legs, mut now, mut at) = (Vec::new(), REST, from.to_vec());
        loop {
            let before = (legs.len(), now);
            for waypoint in waypoints {
                let to: Vec<f64> = from.iter().zip(waypoint).map(|(a, b)| a + b).collect();
                let far = at
                    .iter()
                    .zip(&to)
                    .fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
                let duration = (pace.profile.peak() * far / pace.speed).max(0.1);
                legs.push(Leg {
                    start: now,
                    duration,
                    from: at,
                    to: to.clone(),
                    profile: pace.profile,
                });
                (now, at) = (now + duration + pace.pause, to);
            }
            if before.0 > 0 && now + REST > pace.duration + 1.5 {
                legs.truncate(before.0);
                now = before.1;
                break;
            }
            if now + REST > pace.duration {
                break;
            }
        }
        Self {
            name: name.to_owned(),
            duration: libm::ceil((now + REST) * RATE) / RATE,
            from: from.to_vec(),
            course: Course::Legs(legs),
        }
    }

    /// Two waves in every joint, which grow from rest and die out.
    ///
    /// * `sizes` - amplitude of the slower wave of each joint \[rad\]; the faster one has half of it
    pub fn waves(
        name: &str,
        from: &[f64],
        sizes: &[f64],
        duration: f64,
        random: &mut Random,
    ) -> Self {
        let turn = core::f64::consts::TAU;
        let waves = sizes.iter().map(|size| {
            [(1.0, 0.12, 0.2), (0.5, 0.28, 0.45)].map(|(part, low, high)| {
                [
                    part * size,
                    random.within(low, high),
                    random.within(0.0, turn),
                ]
            })
        });
        Self {
            name: name.to_owned(),
            duration,
            from: from.to_vec(),
            course: Course::Waves(waves.collect()),
        }
    }

    /// Joint angles wanted at a time \[rad\].
    pub fn at(&self, time: f64) -> Vec<f64> {
        match &self.course {
            Course::Legs(legs) => {
                let current = legs.iter().rev().find(|leg| leg.start <= time);
                match current {
                    None => self.from.clone(),
                    Some(leg) => {
                        let way = leg.profile.way((time - leg.start) / leg.duration);
                        let ends = leg.from.iter().zip(&leg.to);
                        ends.map(|(a, b)| a + way * (b - a)).collect()
                    }
                }
            }
            Course::Waves(waves) => {
                let fade = |edge: f64| Profile::LeastJerk.way((edge - REST) / 1.5);
                let size = fade(time) * fade(self.duration - time);
                let joints = self.from.iter().zip(waves);
                joints
                    .map(|(from, waves)| {
                        waves.iter().fold(*from, |sum, [amplitude, f, phase]| {
                            let wave =
                                libm::sin(core::f64::consts::TAU * f * (time - REST) + phase);
                            sum + size * amplitude * wave
                        })
                    })
                    .collect()
            }
        }
    }
}

/// How well a robot follows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Servo {
    /// Natural frequency of its critically damped controller \[Hz\].
    pub bandwidth: f64,
    /// Size of its slow wandering \[rad\].
    pub wander: f64,
}

/// What the robot does in one trial, at every step of the world.
#[derive(Clone, Debug)]
pub struct Lead {
    /// Joint angles of the robot \[rad\].
    pub robot: Vec<Plane>,
    /// Where they put the handle \[m\].
    pub handle: Vec<Plane>,
}

impl Lead {
    /// Leads the handle where the tip of the model's arm would go.
    ///
    /// `None` where the robot does not reach.
    pub fn along(
        movement: &Movement,
        model: &Rig,
        servo: &Servo,
        random: &mut Random,
    ) -> Option<Self> {
        let step = 1.0 / STEPS;
        let steps = libm::round(movement.duration * STEPS) as usize;
        let turn = core::f64::consts::TAU;
        let omega = turn * servo.bandwidth;
        let wander: [[f64; 3]; 2] = core::array::from_fn(|_| {
            [
                servo.wander * random.normal(),
                random.within(0.15, 0.6),
                random.within(0.0, turn),
            ]
        });
        let wanted = |time: f64| model.robot.angles(model.tip(&movement.at(time)));
        let (mut angle, mut speed) = (wanted(0.0)?, [0.0; 2]);
        let (mut robot, mut handle) = (Vec::with_capacity(steps), Vec::with_capacity(steps));
        for n in 0..=steps {
            let time = n as f64 * step;
            let strayed: Plane = core::array::from_fn(|k| {
                let [size, frequency, phase] = wander[k];
                angle[k] + size * libm::sin(turn * frequency * time + phase)
            });
            robot.push(strayed);
            handle.push(model.robot.handle(strayed));
            let goal = wanted(time)?;
            for k in 0..2 {
                speed[k] += step * omega * (omega * (goal[k] - angle[k]) - 2.0 * speed[k]);
                angle[k] += step * speed[k];
            }
        }
        Some(Self { robot, handle })
    }

    /// Velocity of the handle at a step \[m/s\].
    pub fn velocity(handle: &[Plane], n: usize) -> Plane {
        let (before, after) = (n.saturating_sub(1), (n + 1).min(handle.len() - 1));
        let span = (after - before) as f64 / STEPS;
        core::array::from_fn(|k| (handle[after][k] - handle[before][k]) / span)
    }
}
