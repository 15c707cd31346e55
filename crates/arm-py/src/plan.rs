//! Plans: what movements will show, and movements that show much.

use arm_core::effect::Effect;
use arm_core::{Chain, Joints, Shape};
use arm_ident::IdentError;
use arm_ident::experiment_design::design::{Allowed, design};
use arm_ident::experiment_design::forecast::{Accuracy, Forecast, Question, Task, forecast};
use arm_ident::experiment_design::limit::Excess;
use numpy::{PyReadonlyArray2, ToPyArray};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::arm::{AnyChain, each_short_length};
use crate::convert::rows;
use crate::errors::{bad_input, identification, simulation};
use crate::ident::{Settings, model};
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
    (settings, sensing): (&Settings, &Sensing),
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
    settings: Settings,
    sensing: Sensing,
    tasks: (Vec<Planned<'py>>, usize),
) -> PyResult<Bound<'py, PyDict>> {
    fn run<'py, const N: usize>(
        py: Python<'py>,
        chain: &Chain<f64, N>,
        rig: &Rig,
        (settings, sensing): (&Settings, &Sensing),
        (tasks, repeats): (&[Planned<'py>], usize),
    ) -> PyResult<Bound<'py, PyDict>> {
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
        plain(py, &found, &fitted(rig, settings))
    }
    each_short_length!(&rig.arm.chain, c => run(py, c, rig, (&settings, &sensing), (&tasks.0, tasks.1)))
}

/// Movements that show every parameter well; see `armrs.plan`.
#[pyfunction]
#[pyo3(name = "design")]
pub fn design_py<'py>(
    py: Python<'py>,
    rig: &Rig,
    settings: Settings,
    sensing: Sensing,
    bounds: Bounds,
    search: Search,
) -> PyResult<Bound<'py, PyDict>> {
    fn run<'py, const N: usize>(
        py: Python<'py>,
        chain: &Chain<f64, N>,
        rig: &Rig,
        (settings, sensing): (&Settings, &Sensing),
        (bounds, search): (&Bounds, &Search),
    ) -> PyResult<Bound<'py, PyDict>> {
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
        let out = plain(py, &found.forecast, &fitted(rig, settings))?;
        let list = PyList::empty(py);
        for ((task, pace), excess) in found.tasks.iter().zip(&found.paces).zip(&found.slowed_for) {
            let item = PyDict::new(py);
            let flat: Vec<f64> = task
                .waypoints
                .iter()
                .flat_map(|q| q.iter().copied())
                .collect();
            let shape = (task.waypoints.len(), N);
            let table = flat.to_pyarray(py).call_method1("reshape", (shape,))?;
            item.set_item("waypoints", table)?;
            item.set_item("speed", task.speed)?;
            item.set_item("acceleration", task.acceleration)?;
            item.set_item("pace", pace)?;
            item.set_item("slowed_for", excess.map(|e| told(py, &e)).transpose()?)?;
            list.append(item)?;
        }
        out.set_item("tasks", list)?;
        Ok(out)
    }
    each_short_length!(&rig.arm.chain, c => run(py, c, rig, (&settings, &sensing), (&bounds, &search)))
}

/// A limit by its name in `armrs.Limits`, and what would be found at the pace asked for.
fn told<'py>(py: Python<'py>, excess: &Excess) -> PyResult<Bound<'py, PyDict>> {
    let item = PyDict::new(py);
    let [what, unit] = excess.limit.words();
    item.set_item("limit", excess.limit.name())?;
    item.set_item("what", what)?;
    item.set_item("found", excess.found)?;
    item.set_item("allowed", excess.allowed)?;
    item.set_item("unit", unit)?;
    Ok(item)
}

/// The effects that are fitted, in their order.
fn fitted(rig: &Rig, settings: &Settings) -> Vec<Effect<f64>> {
    let each = rig.effects.iter().zip(settings.fitted());
    each.filter_map(|(effect, fit)| fit.then_some(*effect))
        .collect()
}

/// A forecast with the attributes of Python's `Prediction` and `Plan`.
fn plain<'py>(
    py: Python<'py>,
    found: &Forecast,
    fitted: &[Effect<f64>],
) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    let list = PyList::empty(py);
    for p in &found.predicted {
        let item = PyDict::new(py);
        item.set_item("name", &p.name)?;
        item.set_item("unit", p.unit.replace('·', " "))?;
        let effect = p.effect.map(|i| fitted[i]);
        let kind = effect.map_or("combination", |e| e.kind.info().kind);
        item.set_item("kind", kind)?;
        item.set_item("joint", effect.map(|e| e.index + 1))?;
        item.set_item("value", p.value)?;
        item.set_item("std", p.std)?;
        item.set_item("std_of_data", p.std_of_data)?;
        item.set_item("relative", p.relative())?;
        list.append(item)?;
    }
    out.set_item("predictions", list)?;
    out.set_item("worst", found.worst())?;
    out.set_item("force", found.force)?;
    out.set_item("speed", found.speed)?;
    out.set_item("robot_speed", found.robot_speed)?;
    out.set_item("robot_acceleration", found.robot_acceleration)?;
    out.set_item("duration", found.duration)?;
    Ok(out)
}
