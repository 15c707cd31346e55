//! Plans: forecasts of movements, and search for better ones.

use arm_core::effect::Effect;
use arm_core::{Chain, Joints, Shape};
use arm_ident::IdentError;
use arm_ident::experiment_design::design::{Allowed, design};
use arm_ident::experiment_design::forecast::{Accuracy, Question, Task, forecast};
use arm_ident::experiment_design::results as core;
use numpy::PyReadonlyArray2;
use pyo3::prelude::*;

use crate::arm::{AnyChain, each_short_length};
use crate::arrays::rows;
use crate::errors::{bad_input, identification, simulation};
use crate::identification::{IdentificationSettings, model};
use crate::results;
use crate::rig::Rig;

/// The attributes of Python `Instruments` that the core reads: what the sensors do.
#[derive(FromPyObject)]
pub struct Sensing {
    rate: f64,
    cutoff: f64,
    force: f64,
    angle: f64,
}

/// The attributes of a Python `Movement` that the core reads.
#[derive(FromPyObject)]
pub struct Planned<'py> {
    waypoints: PyReadonlyArray2<'py, f64>,
    speed: f64,
    acceleration: f64,
    shape: String,
    pause: f64,
}

/// The attributes of Python `Limits`: what a plan must respect.
#[derive(FromPyObject)]
pub struct Bounds {
    angles: Vec<[f64; 2]>,
    speed: f64,
    acceleration: f64,
    robot_speed: f64,
    robot_acceleration: f64,
    force: f64,
    duration: f64,
}

/// What is searched, and for how long.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Search {
    speeds: Vec<f64>,
    waypoints: usize,
    repeats: usize,
    evaluations: usize,
    seed: u64,
}

fn question<const N: usize>(
    chain: &Chain<f64, N>,
    rig: &Rig,
    (settings, sensing): (&IdentificationSettings, &Sensing),
) -> PyResult<Question<N>> {
    Ok(Question {
        model: model(chain, rig, settings)?,
        robot: rig.robot,
        tolerance: settings.tolerance(),
        accuracy: Accuracy {
            rate: sensing.rate,
            cutoff: sensing.cutoff,
            force: sensing.force,
            angle: sensing.angle,
        },
    })
}

/// How well movements will show each parameter; see `armrs.forecast`.
#[pyfunction]
#[pyo3(name = "forecast")]
pub fn forecast_py<'py>(
    py: Python<'py>,
    rig: &Rig,
    settings: IdentificationSettings,
    sensing: Sensing,
    tasks: (Vec<Planned<'py>>, usize),
) -> PyResult<results::Forecast> {
    fn run<'py, const N: usize>(
        py: Python<'py>,
        chain: &Chain<f64, N>,
        rig: &Rig,
        (settings, sensing): (&IdentificationSettings, &Sensing),
        (tasks, repeats): (&[Planned<'py>], usize),
    ) -> PyResult<results::Forecast> {
        let question = question(chain, rig, (settings, sensing))?;
        let tasks = tasks
            .iter()
            .map(|t| {
                let waypoints = rows::<N>("waypoints", &t.waypoints)?;
                Ok(Task {
                    waypoints: waypoints.into_iter().map(Joints::from).collect(),
                    speed: t.speed,
                    acceleration: t.acceleration,
                    shape: match t.shape.as_str() {
                        "trapezoid" => Shape::Trapezoid,
                        "smooth" => Shape::Smooth,
                        other => return Err(bad_input("shape", other, "trapezoid or smooth")),
                    },
                    pause: t.pause,
                    repeats,
                })
            })
            .collect::<PyResult<Vec<_>>>()?;
        let found = py
            .detach(|| forecast(&question, &tasks))
            .map_err(|error| match error {
                // The movement is the caller's own; where a search finds none, it is not.
                IdentError::Simulation(error) => simulation(error),
                other => identification(other),
            })?;
        let found = core::Forecast::of(&found, &fitted(rig, settings));
        Ok(results::Forecast(found))
    }
    each_short_length!(&rig.arm.chain, c => run(py, c, rig, (&settings, &sensing), (&tasks.0, tasks.1)))
}

/// Movements that show every parameter well; see `armrs.plan`.
#[pyfunction]
#[pyo3(name = "design")]
pub fn design_py(
    py: Python<'_>,
    rig: &Rig,
    settings: IdentificationSettings,
    sensing: Sensing,
    bounds: Bounds,
    search: Search,
) -> PyResult<results::Design> {
    fn run<const N: usize>(
        py: Python<'_>,
        chain: &Chain<f64, N>,
        rig: &Rig,
        (settings, sensing): (&IdentificationSettings, &Sensing),
        (bounds, search): (&Bounds, &Search),
    ) -> PyResult<results::Design> {
        let question = question(chain, rig, (settings, sensing))?;
        let angle = <[[f64; 2]; N]>::try_from(bounds.angles.clone()).map_err(|given| {
            bad_input(
                "angles",
                format!("{} ranges", given.len()),
                &format!("{N}, one a joint"),
            )
        })?;
        let allowed = Allowed {
            angle,
            speed: bounds.speed,
            acceleration: bounds.acceleration,
            robot_speed: bounds.robot_speed,
            robot_acceleration: bounds.robot_acceleration,
            force: bounds.force,
            duration: bounds.duration,
            speeds: search.speeds.clone(),
            waypoints: search.waypoints,
            repeats: search.repeats,
            evaluations: search.evaluations,
            seed: search.seed,
        };
        let found = py
            .detach(|| design(&question, &allowed, || {}))
            .map_err(identification)?;
        let found = core::Design::of(&found, &fitted(rig, settings));
        Ok(results::Design(found))
    }
    each_short_length!(&rig.arm.chain, c => run(py, c, rig, (&settings, &sensing), (&bounds, &search)))
}

/// The effects that are fitted, in their order.
fn fitted(rig: &Rig, settings: &IdentificationSettings) -> Vec<Effect<f64>> {
    let each = rig.effects.iter().zip(settings.fitted());
    each.filter_map(|(effect, fit)| fit.then_some(*effect))
        .collect()
}
