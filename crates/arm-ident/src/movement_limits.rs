//! Limits of a planned movement, and limits that it exceeds.

/// A kind of limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limit {
    /// [`Allowed::force`](crate::experiment_design::design::Allowed::force).
    Force,
    /// [`Allowed::speed`](crate::experiment_design::design::Allowed::speed).
    Speed,
    /// [`Allowed::robot_speed`](crate::experiment_design::design::Allowed::robot_speed).
    RobotSpeed,
    /// [`Allowed::robot_acceleration`](crate::experiment_design::design::Allowed::robot_acceleration).
    RobotAcceleration,
    /// [`Allowed::duration`](crate::experiment_design::design::Allowed::duration), which no slower movement respects.
    Duration,
}

impl Limit {
    /// Its field of [`Allowed`](crate::experiment_design::design::Allowed).
    pub const fn name(self) -> &'static str {
        match self {
            Self::Force => "force",
            Self::Speed => "speed",
            Self::RobotSpeed => "robot_speed",
            Self::RobotAcceleration => "robot_acceleration",
            Self::Duration => "duration",
        }
    }

    /// What is limited, and its unit.
    pub const fn words(self) -> [&'static str; 2] {
        match self {
            Self::Force => ["force on the arm", "N"],
            Self::Speed => ["speed of a joint", "rad/s"],
            Self::RobotSpeed => ["speed of a joint of the robot", "rad/s"],
            Self::RobotAcceleration => ["acceleration of a joint of the robot", "rad/s²"],
            Self::Duration => ["duration of a trial", "s"],
        }
    }
}

/// A limit that a movement exceeds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Excess {
    /// Which.
    pub limit: Limit,
    /// What was found, in the unit of the limit.
    pub found: f64,
    /// Pace at which it was found, relative to the requested one.
    pub pace: f64,
    /// What is allowed.
    pub allowed: f64,
}

impl Excess {
    /// What was found and, of a slowed movement, at which pace.
    pub fn found_text(&self) -> String {
        let (found, [_, unit]) = (self.found, self.limit.words());
        // Four digits.
        let decimals = (3.0 - libm::floor(libm::log10(found))).clamp(0.0, 9.0) as usize;
        let pace = 100.0 * self.pace;
        if self.pace < 1.0 {
            format!("{found:.decimals$} {unit} at {pace:.0} % of the pace asked for")
        } else {
            format!("{found:.decimals$} {unit}")
        }
    }
}

impl core::fmt::Display for Excess {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let ([name, unit], found) = (self.limit.words(), self.found_text());
        write!(f, "{name}: found {found}, allowed {} {unit}", self.allowed)
    }
}
