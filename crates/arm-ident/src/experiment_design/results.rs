//! The result of a plan, in the terms of files and reports: one type for Rust, Python and JSON.

use arm_core::effect::Effect;
use serde::Serialize;

use crate::experiment_design::design;
use crate::experiment_design::forecast::{self, Predicted};
use crate::movement_limits::Excess;

/// How well one parameter will be known.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Prediction {
    /// Name as identification gives it.
    pub name: String,
    /// `combination`, or the kind of effect.
    pub kind: String,
    /// Joint, from 1.
    pub joint: Option<usize>,
    /// Value assumed before the experiment, in `unit`.
    pub value: f64,
    /// Standard deviation to be expected, with the priors, in `unit`.
    pub std: f64,
    /// The same from the data alone, the calibration within its tolerance, in `unit`.
    pub std_of_data: f64,
    /// The latter relative to the value; a parameter of an effect that is small counts as 0.05.
    pub relative: f64,
    /// SI unit.
    pub unit: String,
}

impl Prediction {
    fn of(p: &Predicted, fitted: &[Effect<f64>]) -> Self {
        let effect = p.effect.map(|i| fitted[i]);
        Self {
            name: p.name.clone(),
            kind: effect
                .map_or("combination", |e| e.kind.info().kind)
                .to_owned(),
            joint: effect.map(|e| e.index + 1),
            value: p.value,
            std: p.std,
            std_of_data: p.std_of_data,
            relative: p.relative(),
            unit: p.unit.replace('·', " "),
        }
    }
}

/// Forecast of movements: certainty of the parameters, and the load of the robot.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Forecast {
    /// Base parameters and parameters of effects.
    pub predictions: Vec<Prediction>,
    /// The worst relative standard deviation from the data alone.
    #[serde(rename = "worst_relative_std")]
    pub worst: f64,
    /// Largest force on the arm \[N\].
    #[serde(rename = "largest_force_N")]
    pub force: f64,
    /// Largest speed of a joint \[rad/s\].
    #[serde(rename = "largest_speed_rad_s")]
    pub speed: f64,
    /// Largest speed of a joint of the robot, zero without one \[rad/s\].
    #[serde(rename = "largest_robot_speed_rad_s")]
    pub robot_speed: f64,
    /// Largest acceleration of a joint of the robot, zero without one \[rad/s²\].
    #[serde(rename = "largest_robot_acceleration_rad_s2")]
    pub robot_acceleration: f64,
    /// Of all trials together \[s\].
    #[serde(rename = "duration_s")]
    pub duration: f64,
}

impl Forecast {
    /// * `fitted` - the effects that were fitted, in their order
    pub fn of(found: &forecast::MovementForecast, fitted: &[Effect<f64>]) -> Self {
        let predictions = found.predicted.iter().map(|p| Prediction::of(p, fitted));
        Self {
            predictions: predictions.collect(),
            worst: found.worst(),
            force: found.force,
            speed: found.speed,
            robot_speed: found.robot_speed,
            robot_acceleration: found.robot_acceleration,
            duration: found.duration,
        }
    }
}

/// A planned movement that had to be slowed: the same path, all of it slower by one factor in time.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Slowed {
    /// Number of the movement, from 1.
    pub movement: usize,
    /// Its share of the requested speed; of the acceleration that squared.
    pub pace: f64,
    /// The limit that it would exceed if it were faster, by its name in `Limits`.
    pub limit: String,
    /// Value of that quantity at the requested speed, in `unit`.
    pub found: f64,
    /// The limit, in `unit`.
    pub allowed: f64,
    /// The limit in words.
    pub what: String,
    /// SI unit.
    pub unit: String,
}

impl Slowed {
    fn of((movement, pace): (usize, f64), excess: &Excess) -> Self {
        let [what, unit] = excess.limit.words();
        Self {
            movement,
            pace,
            limit: excess.limit.name().to_owned(),
            found: excess.found,
            allowed: excess.allowed,
            what: what.to_owned(),
            unit: unit.to_owned(),
        }
    }
}

/// A movement of a design.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DesignedMovement {
    /// Rows of joint angles \[rad\].
    pub waypoints: Vec<Vec<f64>>,
    /// Largest speed of a joint \[rad/s\].
    pub speed: f64,
    /// Largest acceleration of a joint \[rad/s²\].
    pub acceleration: f64,
}

/// Movements that show every parameter well.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Design {
    /// What they will show.
    pub forecast: Forecast,
    /// The movements.
    pub movements: Vec<DesignedMovement>,
    /// Those that had to be slowed for a limit.
    pub slowed: Vec<Slowed>,
}

impl Design {
    /// * `fitted` - as of [`Forecast::of`]
    pub fn of<const N: usize>(found: &design::OptimizedDesign<N>, fitted: &[Effect<f64>]) -> Self {
        let movements = found.tasks.iter().map(|task| DesignedMovement {
            waypoints: task
                .waypoints
                .iter()
                .map(|q| q.iter().copied().collect())
                .collect(),
            speed: task.speed,
            acceleration: task.acceleration,
        });
        let paces = (1..).zip(found.paces.iter().copied());
        let slowed = paces
            .zip(&found.slowed_for)
            .filter_map(|(which, excess)| Some(Slowed::of(which, excess.as_ref()?)));
        Self {
            forecast: Forecast::of(&found.forecast, fitted),
            movements: movements.collect(),
            slowed: slowed.collect(),
        }
    }
}
