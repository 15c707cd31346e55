//! The results of a plan, and of a fit by simulation.

use arm_ident::experiment_design::results as core;
use arm_ident::inference::by_simulation;
use pyo3::prelude::*;

use super::class::{digits, result_class};

result_class! {
    /// How well one parameter will be known.
    Prediction of core::Prediction, in "armrs.workflows.plan" {
        /// Name as identification gives it.
        name: String, "";
        /// "combination", or the kind of effect.
        kind: String, "";
        /// Joint, from 1.
        joint: Option<usize>, "";
        /// Value assumed before the experiment, in `unit`.
        value: f64, "";
        /// Standard deviation to be expected, with what is known beforehand, in `unit`.
        std: f64, "";
        /// The same from the data alone, within the calibration as promised, in `unit`.
        std_of_data: f64, "";
        /// The latter relative to the value; a parameter of an effect that is small counts as 0.05.
        relative: f64, "";
        /// SI unit.
        unit: String, "";
    }
}

#[pymethods]
impl Prediction {
    fn __str__(&self, py: Python<'_>) -> PyResult<String> {
        let (of, [value, std]) = (&self.0, [(self.0.value, ".4g"), (self.0.std, ".2g")]);
        let (value, std) = (digits(py, value.0, value.1)?, digits(py, std.0, std.1)?);
        Ok(format!("{} = {value} ± {std} {}", of.name, of.unit))
    }
}

result_class! {
    /// Forecast of movements: certainty of the parameters, and the load of the robot.
    Forecast of core::Forecast, in "armrs.workflows.plan" {
        /// Base parameters and parameters of effects.
        predictions: Vec<core::Prediction>, "";
        /// The worst relative standard deviation from the data alone.
        worst: f64, "";
        /// Largest force on the arm [N].
        force: f64, "N";
        /// Largest speed of a joint [rad/s].
        speed: f64, "rad/s";
        /// Largest speed of a joint of the robot, zero without one [rad/s].
        robot_speed: f64, "rad/s";
        /// Largest acceleration of a joint of the robot, zero without one [rad/s²].
        robot_acceleration: f64, "rad/s²";
        /// Of all trials together [s].
        duration: f64, "s";
    }
}

result_class! {
    /// A planned movement that had to be slowed: the same path, all of it slower by one factor in time.
    Slowed of core::Slowed, in "armrs.workflows.plan" {
        /// Number of the movement, from 1.
        movement: usize, "";
        /// Its share of the requested speed; of the acceleration that squared.
        pace: f64, "";
        /// What it would exceed if it were faster, by its name in `Limits`.
        limit: String, "";
        /// Value of that quantity at the requested speed, in `unit`.
        found: f64, "";
        /// The limit, in `unit`.
        allowed: f64, "";
        /// The limit in words.
        what: String, "";
        /// SI unit.
        unit: String, "";
    }
}

#[pymethods]
impl Slowed {
    fn __str__(&self, py: Python<'_>) -> PyResult<String> {
        let of = &self.0;
        let [found, allowed] = [of.found, of.allowed].map(|v| digits(py, v, ".4g"));
        Ok(format!(
            "movement {} is slowed to {} % of the pace asked for: at all of it the {} would be {} {unit}, allowed {} {unit}",
            of.movement,
            digits(py, 100.0 * of.pace, ".3g")?,
            of.what,
            found?,
            allowed?,
            unit = of.unit,
        ))
    }
}

result_class! {
    /// A movement of a design.
    DesignedMovement of core::DesignedMovement, in "armrs.workflows.plan" {
        /// Rows of joint angles [rad].
        waypoints: Vec<Vec<f64>>, "rad";
        /// Largest speed of a joint [rad/s].
        speed: f64, "rad/s";
        /// Largest acceleration of a joint [rad/s²].
        acceleration: f64, "rad/s²";
    }
}

result_class! {
    /// Movements that show every parameter well.
    Design of core::Design, in "armrs.workflows.plan" {
        /// What they will show.
        forecast: core::Forecast, "";
        /// The movements.
        movements: Vec<core::DesignedMovement>, "";
        /// Those that had to be slowed for a limit.
        slowed: Vec<core::Slowed>, "";
    }
}

result_class! {
    /// The run that comes closest to a record.
    RunFit of by_simulation::Fit, in "armrs.workflows.fitting" {
        /// Value of each free parameter, in its unit.
        values: Vec<f64>, "";
        /// Its standard deviation where the noise is white and of the sizes given, as if no bound held; infinite where the record is silent.
        sd: Vec<f64>, "";
        /// -1 at the least value, 1 at the greatest, 0 between.
        active: Vec<i8>, "";
        /// Sum of squared residuals, in units of the noise.
        squares: f64, "";
        /// Number of residuals.
        residuals: usize, "";
        /// Rounds of simulations from the start that led here.
        rounds: usize, "";
        /// Whether the estimate stands; false when the rounds ran out.
        settled: bool, "";
    }
}

/// Adds the classes to the module.
pub fn add(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_class::<Prediction>()?;
    m.add_class::<Forecast>()?;
    m.add_class::<Slowed>()?;
    m.add_class::<DesignedMovement>()?;
    m.add_class::<Design>()?;
    m.add_class::<RunFit>()
}
